!! What stands between two points: which points, in which direction, and the row w with which the displacement of the first point
!! against the second one, s = wᵀq, follows from the coordinates; or the angle by which the first body turns against the second,
!! where one of them is an inertia or `twist` says so. What acts on a mass does so along the line of that if not told otherwise.
module razy_scenes_parts_links
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_scenes_connections, only: unit_direction
   use razy_scenes_parts_bodies, only: add_motion, add_turn, bodies_t, find_point, of_inertia, of_mass, point_t
   implicit none(type, external)
   private

   public :: find_points, find_ring_rows, find_row, link_t, new_sliding_link, read_links

   !> One of the `pairs` pairs of `group` number `number`: both ends, direction of length 1, row (coordinates).
   type :: link_t
      character(:), allocatable :: group
      integer :: number = 0, pairs = 1
      type(point_t) :: first, second
      real(wp) :: direction(2) = 0.0_wp
      real(wp), allocatable :: w(:)
      !> Whether s is an angle; whether both ends are points of bodies in the plane, or the frame, and it is none.
      logical :: turns = .false., in_plane = .true.
      !> Of a linear spring or damper, with what &damping adds: N/m, N s/m.
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp
   end type link_t

   !> Points are on a line if they miss it by less than this part of their distance from the origin.
   real(wp), parameter :: in_line = 1.0e-6_wp

contains

   !> All pairs of groups of these kinds.
   subroutine read_links(links, bodies, input, groups, error)
      type(link_t), allocatable, intent(out) :: links(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: groups(:)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: ends(:)
      integer :: g, i, k, pair, pairs, pass

      ! First they are counted.
      do pass = 1, 2
         k = 0
         do g = 1, size(groups)
            do i = 1, input%count(trim(groups(g)))
               call input%get(trim(groups(g)), i, "between", ends)
               pairs = size(ends)/2
               if (modulo(size(ends), 2) /= 0) call input%complain(error, trim(groups(g)), i, "between", &
                                                                   "an even number of names, two for each pair")
               if (allocated(error)) return
               k = k + pairs
               do pair = 1, merge(pairs, 0, pass == 2)
                  associate (link => links(k - pairs + pair))
                     link%pairs = pairs
                     call find_points(link, bodies, input, trim(groups(g)), i, pair, error)
                     if (.not. allocated(error)) call find_direction(link, bodies, input, error)
                     if (.not. allocated(error)) call find_row(link, bodies, input, error)
                     if (allocated(error)) return
                  end associate
               end do
            end do
         end do
         if (pass == 1) allocate (links(k))
      end do
   end subroutine read_links

   !> The two ends of `&friction` number `index`, which rubs on `&stop` number `stop` (0: none). Both ends are taken at the place of
   !> the first point, because that is where surfaces touch: forces across the line through the points would be a moment.
   subroutine new_sliding_link(link, bodies, stops, input, index, stop, error)
      type(link_t), intent(out) :: link
      type(bodies_t), intent(in) :: bodies
      type(link_t), intent(in) :: stops(:)
      type(input_t), intent(in) :: input
      integer, intent(in) :: index, stop
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: across(2)

      call find_points(link, bodies, input, "friction", index, 1, error)
      if (input%given("friction", index, "radius") .and. .not. allocated(error)) then
         call input%complain(error, "friction", index, "radius", "left out without shafts; a surface that turns has a belt_speed")
      end if
      if (allocated(error)) return
      if (.not. link%in_plane) then
         call find_direction(link, bodies, input, error)
      else if (input%given("friction", index, "direction")) then
         call unit_direction(input, "friction", index, link%direction, error)
      else if (stop > 0) then
         link%direction = [stops(stop)%direction(2), -stops(stop)%direction(1)]
      else
         call find_direction(link, bodies, input, error)
      end if
      if (allocated(error)) return
      if (link%in_plane .and. link%first%located .and. link%second%located) then
         across = link%first%place - link%second%place
         across = across - dot_product(across, link%direction)*link%direction
         link%second%arm = link%second%arm + across
         link%second%place = link%second%place + across
      end if
      call find_row(link, bodies, input, error)
   end subroutine new_sliding_link

   !> The rows of both displacements, x and y (coordinates), of the first end of `group` number i, a ring or what rubs on it,
   !> against the second.
   subroutine find_ring_rows(along_x, along_y, bodies, input, group, i, error)
      real(wp), allocatable, intent(out) :: along_x(:), along_y(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link

      call find_points(link, bodies, input, group, i, 1, error)
      if (.not. allocated(error) .and. input%given(group, i, "direction")) then
         call input%complain(error, group, i, "direction", "left out where the element rubs on a ring")
      else if (.not. (allocated(error) .or. link%in_plane)) then
         call input%complain(error, group, i, "between", "a &body, a &point or 'frame' at both ends of a ring")
      end if
      if (allocated(error)) return
      link%direction = [1.0_wp, 0.0_wp]
      call find_row(link, bodies, input, error)
      if (allocated(error)) return
      along_x = link%w
      link%direction = [0.0_wp, 1.0_wp]
      call find_row(link, bodies, input, error)
      along_y = link%w
   end subroutine find_ring_rows

   !> The places number 2 pair - 1 and 2 pair of `between` of a group; what cannot be joined is an error.
   subroutine find_points(link, bodies, input, group, number, pair, error)
      type(link_t), intent(inout) :: link
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: number, pair
      type(error_t), allocatable, intent(out) :: error

      link%group = group
      link%number = number
      call find_point(bodies, input, group, number, "between", 2*pair - 1, link%first, error)
      if (.not. allocated(error)) call find_point(bodies, input, group, number, "between", 2*pair, link%second, error)
      if (allocated(error)) return
      associate (kinds => bodies%kind([link%first%body, link%second%body]))
         link%turns = any(kinds == of_inertia)
         if (.not. link%turns) link%turns = input%truth(group, number, "twist")
         link%in_plane = .not. (link%turns .or. any(kinds == of_mass))
         if (link%first%body == link%second%body) then
            call input%complain(error, group, number, "between", "two different bodies, points of such, or one and the frame")
         else if (link%turns .and. any(kinds == of_mass)) then
            call input%complain(error, group, number, "between", "no mass where the other end "// &
                                "turns: join inertias, bodies in the plane and the frame, or masses, points and the frame")
         end if
      end associate
   end subroutine find_points

   !> w (coordinates) of s = wᵀq, what the first end moves more than the second along the direction of the link, or turns more.
   subroutine find_row(link, bodies, input, error)
      type(link_t), intent(inout) :: link
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      link%w = 0*bodies%mass
      if (link%turns) then
         call add_turn(link%w, bodies, link%first, 1.0_wp)
         call add_turn(link%w, bodies, link%second, -1.0_wp)
      else
         call add_motion(link%w, bodies, link%first, link%direction)
         call add_motion(link%w, bodies, link%second, -link%direction)
      end if
      if (.not. any(abs(link%w) > 0.0_wp)) call input%complain(error, link%group, link%number, "between", &
                                                               "with an end that can move there, which is not held")
   end subroutine find_row

   !> The direction that is given, or that of the line through both points, or of a mass. Two forces along parallel lines would be
   !> a moment that nothing balances, so the points have to lie on one line in that direction; the guide of a mass balances it.
   subroutine find_direction(link, bodies, input, error)
      type(link_t), intent(inout) :: link
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: line(2), miss
      logical :: both, given

      given = input%given(link%group, link%number, "direction")
      both = link%first%located .and. link%second%located .and. link%in_plane
      line = 0.0_wp
      link%direction = 0.0_wp
      if (both) line = link%first%place - link%second%place
      if (given .and. link%turns) then
         call input%complain(error, link%group, link%number, "direction", "left out where both ends turn")
      else if (given) then
         call unit_direction(input, link%group, link%number, link%direction, error)
      else if (.not. (link%turns .or. link%in_plane)) then
         link%direction = line_of(merge(link%first%body, link%second%body, bodies%kind(link%first%body) == of_mass))
      else if (norm2(line) > 0.0_wp) then
         link%direction = line/norm2(line)
      else if (.not. link%turns) then
         call input%complain(error, link%group, link%number, "direction", &
                             "required, such as 0.0, 1.0 for upwards, where the two points lie on one another or one is "// &
                             "'frame' without a place")
      end if
      if (allocated(error)) return
      if (given .and. both) then
         miss = abs(line(1)*link%direction(2) - line(2)*link%direction(1))
         if (miss > in_line*max(norm2(link%first%place), norm2(link%second%place))) then
            call input%complain(error, link%group, link%number, "direction", &
                                "that of the line through the two points; beside it, the two forces would turn the machine")
         end if
      else if (.not. link%in_plane .and. .not. link%turns) then
         if (.not. (moves(link%first%body) .and. moves(link%second%body))) then
            call input%complain(error, link%group, link%number, "direction", "one in which each mass can move that it acts on")
         end if
      end if

   contains

      !> The direction in which a mass moves.
      function line_of(body) result(along)
         integer, intent(in) :: body
         real(wp) :: along(2)

         along = bodies%shift(:, findloc(bodies%of, body, dim=1))
      end function line_of

      !> Whether what acts in the direction moves a body, of a mass if it is one.
      logical function moves(body)
         integer, intent(in) :: body

         moves = bodies%kind(body) /= of_mass
         if (.not. moves) moves = abs(dot_product(line_of(body), link%direction)) > in_line
      end function moves

   end subroutine find_direction

end module razy_scenes_parts_links
