!! Bodies and points, and how points move with the coordinates.
!!
!! An inertia turns, a mass moves along a line, a body in the plane does both: its coordinates are x, y, φ. A coordinate either
!! shifts its body along a direction or turns it. For small motion about the reference position the point of a body at r = (r1, r2)
!! from the centre of mass moves by (x - φ r2, y + φ r1) (source thesis, 4.3). A body on a pin has φ alone: its point at r from the
!! pin moves by (-φ r2, φ r1) beside the pin.
module razy_scenes_parts_bodies
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: append_text, did_you_mean, excerpt, lower, position_of, string_t
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: add_outer
   use razy_scenes_connections, only: unit_direction
   implicit none(type, external)
   private

   public :: add_motion, add_pinned_masses, add_righting, add_turn, bodies_t, centre_of, find_point, known_point, new_bodies
   public :: point_t, of_frame, of_inertia, of_mass, of_body

   !> A point of body `body` (0: the frame) at `arm` from what that turns about, at `place` in the reference position, m.
   !> `located` is false for 'frame' without a point.
   type :: point_t
      integer :: body = 0
      real(wp) :: arm(2) = 0.0_wp, place(2) = 0.0_wp
      logical :: located = .true.
   end type point_t

   !> All bodies and points of a scene: first the inertias, then the masses, then the bodies of the plane.
   type :: bodies_t
      integer :: count = 0
      type(string_t), allocatable :: name(:)
      !> Kind of each body (0 for the frame to count).
      integer, allocatable :: kind(:)
      !> m (2, bodies), and kg of each.
      real(wp), allocatable :: centre(:, :), extent(:, :), body_mass(:)
      !> What each body turns about: the point of another that it is on, or its centre, at rest and not located.
      type(point_t), allocatable :: pin(:)
      type(string_t), allocatable :: point_name(:)
      type(point_t), allocatable :: point(:)
      !> Name of each coordinate, the body it moves, kg or kg m², and the direction in which it shifts that (2, coordinates), if it
      !> does not turn it.
      type(string_t), allocatable :: coordinate(:)
      integer, allocatable :: of(:)
      real(wp), allocatable :: mass(:), shift(:, :)
      logical, allocatable :: turns(:)
   end type bodies_t

   !> Kinds of body, and their groups.
   integer, parameter :: of_frame = 0, of_inertia = 1, of_mass = 2, of_body = 3
   character(*), parameter :: groups(3) = [character(7) :: "inertia", "mass", "body"]

contains

   !> Read all bodies and points; there has to be a body.
   subroutine new_bodies(self, input, error)
      type(bodies_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: direction(2)
      type(string_t), allocatable :: held(:)
      integer :: b, i, kind

      self%count = sum([(input%count(trim(groups(kind))), kind=1, size(groups))])
      if (self%count == 0) call input%complain(error, "scene", 1, "kind", "a scene of this kind needs at least one &inertia, "// &
                                               "&mass or &body")
      if (allocated(error)) return
      allocate (self%name(self%count), self%kind(0:self%count), self%centre(2, self%count), self%extent(2, self%count))
      allocate (self%body_mass(self%count), self%pin(self%count))
      allocate (self%coordinate(0), self%of(0), self%mass(0), self%shift(2, 0), self%turns(0))
      self%kind(0) = of_frame
      b = 0
      allocate (held(0))
      do kind = 1, size(groups)
         do i = 1, input%count(trim(groups(kind)))
            b = b + 1
            self%kind(b) = kind
            call read_name(self%name(b), input, trim(groups(kind)), i, error)
            if (allocated(error)) return
            self%centre(:, b) = input%list(trim(groups(kind)), i, "centre")
            self%extent(:, b) = input%list(trim(groups(kind)), i, "size")
            call input%get(trim(groups(kind)), i, trim(merge("mass ", "value", kind == of_body)), self%body_mass(b))
            self%pin(b) = point_t(place=self%centre(:, b), located=.false.)
            direction = 0.0_wp
            if (kind == of_mass) direction(2) = 1.0_wp
            if (kind == of_mass) call unit_direction(input, "mass", i, direction, error)
            if (allocated(error)) return
            if (kind /= of_body) then
               call add_coordinate("", self%body_mass(b), direction)
            else
               call input%get("body", i, "held", held)
               if (input%given("body", i, "pin")) held = [held, string_t("x"), string_t("y")]
               call add_coordinate(".x", self%body_mass(b), [1.0_wp, 0.0_wp])
               call add_coordinate(".y", self%body_mass(b), [0.0_wp, 1.0_wp])
               call add_coordinate(".phi", input%number("body", i, "inertia"), direction)
            end if
         end do
      end do
      if (size(self%of) == 0) call input%complain(error, "body", 1, "held", "not all coordinates there are")
      if (.not. allocated(error)) call read_points(self, input, error)
      if (.not. allocated(error)) call read_pins(self, input, error)

   contains

      !> One that is not held; it turns where it shifts in no direction.
      subroutine add_coordinate(component, mass, direction)
         character(*), intent(in) :: component
         real(wp), intent(in) :: mass, direction(2)

         if (kind == of_body .and. position_of(component(2:), held) > 0) return
         call append_text(self%coordinate, self%name(b)%text//component)
         self%of = [self%of, b]
         self%mass = [self%mass, mass]
         self%shift = reshape([self%shift, direction], [2, size(self%of)])
         self%turns = [self%turns,.not. norm2(direction) > 0.0_wp]
      end subroutine add_coordinate

   end subroutine new_bodies

   subroutine read_points(self, input, error)
      type(bodies_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: body
      integer :: i

      allocate (self%point_name(input%count("point")), self%point(input%count("point")))
      do i = 1, size(self%point)
         call read_name(self%point_name(i), input, "point", i, error)
         if (allocated(error)) return
         call input%get("point", i, "body", body)
         associate (point => self%point(i))
            point%arm = input%list("point", i, "position")
            point%place = point%arm
            if (lower(body) == "frame") cycle
            point%body = position_of(body, self%name)
            if (point%body == 0) then
               call input%complain(error, "point", i, "body", "no body is named "//excerpt(body)//"; "// &
                                   did_you_mean(body, [self%name, string_t("frame")], "bodies"))
            else if (self%kind(point%body) /= of_body) then
               call input%complain(error, "point", i, "body", "the name of a &body, or 'frame'")
            end if
            if (allocated(error)) return
            point%place = point%arm + self%centre(:, point%body)
         end associate
      end do
   end subroutine read_points

   !> The pins of bodies on points of the frame or of bodies before, and the arms of all points from what their bodies turn about.
   subroutine read_pins(self, input, error)
      type(bodies_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name
      integer :: b, i, k

      do i = 1, input%count("body")
         if (.not. input%given("body", i, "pin")) cycle
         b = self%count - input%count("body") + i
         call input%get("body", i, "pin", name)
         k = position_of(name, self%point_name)
         if (k > 0) self%pin(b) = self%point(k)
         if (k == 0 .or. self%pin(b)%body >= b) then
            call input%complain(error, "body", i, "pin", "a &point of the frame or of a &body before this one; "// &
                                did_you_mean(name, self%point_name, "points"))
            return
         end if
         do k = 1, size(self%point)
            if (self%point(k)%body == b) self%point(k)%arm = self%point(k)%place - self%pin(b)%place
         end do
      end do
   end subroutine read_pins

   subroutine read_name(name, input, group, i, error)
      type(string_t), intent(inout) :: name
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      call input%get(group, i, "name", name%text)
      if (lower(name%text) == "frame") call input%complain(error, group, i, "name", &
                                                           "any name but frame, which is what does not move")
   end subroutine read_name

   !> The point that a key names in its element `element`: a point, a body for its centre of mass, or the frame.
   subroutine find_point(self, input, group, index, key, element, point, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: index, element
      type(point_t), intent(out) :: point
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)

      call input%get(group, index, key, names)
      if (lower(names(element)%text) == "frame") then
         point%located = .false.
      else if (.not. known_point(self, names(element)%text, point)) then
         call input%complain(error, group, index, key, "no body or point is named "//excerpt(names(element)%text)//"; "// &
                             did_you_mean(names(element)%text, [self%point_name, self%name, string_t("frame")], "points"))
      end if
   end subroutine find_point

   !> Whether there is a point or a body of this name.
   function known_point(self, name, point) result(known)
      type(bodies_t), intent(in) :: self
      character(*), intent(in) :: name
      type(point_t), intent(out) :: point
      logical :: known

      integer :: i

      i = position_of(name, self%point_name)
      known = i > 0
      if (known) point = self%point(i)
      if (known) return
      i = position_of(name, self%name)
      known = i > 0
      if (known) point = centre_of(self, i)
   end function known_point

   !> The centre of a body as a place on it.
   pure function centre_of(self, body) result(point)
      type(bodies_t), intent(in) :: self
      integer, intent(in) :: body
      type(point_t) :: point

      point = point_t(body, self%centre(:, body) - self%pin(body)%place, self%centre(:, body))
   end function centre_of

   !> Add the masses of bodies on pins, which move with other bodies too, to a matrix (coordinates).
   subroutine add_pinned_masses(matrix, self)
      real(wp), intent(inout) :: matrix(:, :)
      type(bodies_t), intent(in) :: self

      real(wp) :: row(size(matrix, 1))
      integer :: axis, b

      do b = 1, self%count
         do axis = 1, merge(2, 0, self%pin(b)%located)
            row = 0.0_wp
            call add_motion(row, self, centre_of(self, b), real([2 - axis, axis - 1], wp))
            call add_outer(matrix, self%body_mass(b), row)
         end do
      end do
   end subroutine add_pinned_masses

   !> Add the motion of a point along `direction` to a row (coordinates).
   pure recursive subroutine add_motion(row, self, point, direction)
      real(wp), intent(inout) :: row(:)
      type(bodies_t), intent(in) :: self
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: direction(2)

      integer :: i

      do i = 1, size(row)
         if (self%of(i) /= point%body) cycle
         row(i) = row(i) + merge(point%arm(1)*direction(2) - point%arm(2)*direction(1), &
                                 dot_product(self%shift(:, i), direction), self%turns(i))
      end do
      if (point%body > 0) call add_motion(row, self, self%pin(point%body), direction)
   end subroutine add_motion

   !> Add the stiffness by which a weight at a point rights what it hangs from to a row (coordinates): an arm r that turns by φ is
   !> r (1 - φ²/2) along itself, whatever carries it.
   pure recursive subroutine add_righting(row, self, point, weight)
      real(wp), intent(inout) :: row(:)
      type(bodies_t), intent(in) :: self
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: weight(2)

      call add_turn(row, self, point, dot_product(point%arm, weight))
      if (point%body > 0) call add_righting(row, self, self%pin(point%body), weight)
   end subroutine add_righting

   !> Add a multiple of the angle by which the body of a point turns to a row (coordinates).
   pure subroutine add_turn(row, self, point, factor)
      real(wp), intent(inout) :: row(:)
      type(bodies_t), intent(in) :: self
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: factor

      where (self%of == point%body .and. self%turns) row = row + factor
   end subroutine add_turn

end module razy_scenes_parts_bodies
