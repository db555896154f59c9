!! Bodies and points of a planar scene, and how points move with the coordinates.
!!
!! Body b has the coordinates x, y, φ, numbers 3b-2 to 3b. For small motion about the reference position its point at
!! r = (r1, r2) from the centre of mass moves by (x - φ r2, y + φ r1) (source thesis, 4.3).
module razy_scenes_planar_bodies
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: did_you_mean, excerpt, lower, position_of, string_t
   use razy_input_input, only: input_t
   implicit none(type, external)
   private

   public :: add_motion, bodies_t, components, coordinate_names, find_point, known_point, new_bodies, point_t, &
             unit_direction

   !> A point of body `body` (0: the frame) at `arm` from its centre of mass, at `place` in the reference position, m.
   !> `located` is false for 'frame' without a point.
   type :: point_t
      integer :: body = 0
      real(wp) :: arm(2) = 0.0_wp, place(2) = 0.0_wp
      logical :: located = .true.
   end type point_t

   !> All bodies and points of a scene.
   type :: bodies_t
      integer :: count = 0
      type(string_t), allocatable :: name(:)
      !> kg, kg m² (bodies).
      real(wp), allocatable :: mass(:), inertia(:)
      !> m (2, bodies).
      real(wp), allocatable :: centre(:, :)
      type(string_t), allocatable :: point_name(:)
      type(point_t), allocatable :: point(:)
   end type bodies_t

   !> Coordinates of a body, the first two also of a point.
   character(3), parameter :: components(3) = ["x  ", "y  ", "phi"]

contains

   !> Read `&body` and `&point`; there has to be a body.
   subroutine new_bodies(self, input, error)
      type(bodies_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: pair(:)
      character(:), allocatable :: body, name
      integer :: i

      self%count = input%count("body")
      if (self%count == 0) call input%complain(error, "scene", 1, "kind", "a planar scene needs at least one &body")
      if (allocated(error)) return
      allocate (self%name(self%count), self%mass(self%count), self%inertia(self%count), self%centre(2, self%count))
      do i = 1, self%count
         call read_name("body")
         if (allocated(error)) return
         self%name(i)%text = name
         call input%get("body", i, "mass", self%mass(i))
         call input%get("body", i, "inertia", self%inertia(i))
         call input%get("body", i, "centre", pair)
         self%centre(:, i) = pair
      end do
      allocate (self%point_name(input%count("point")), self%point(input%count("point")))
      do i = 1, size(self%point)
         call read_name("point")
         if (allocated(error)) return
         self%point_name(i)%text = name
         call input%get("point", i, "body", body)
         call input%get("point", i, "position", pair)
         associate (point => self%point(i))
            point%arm = pair
            point%place = pair
            if (lower(body) == "frame") cycle
            point%body = position_of(body, self%name)
            if (point%body == 0) then
               call input%complain(error, "point", i, "body", "no body is named "//excerpt(body)//"; "// &
                                   did_you_mean(body, [self%name, string_t("frame")], "bodies"))
               return
            end if
            point%place = pair + self%centre(:, point%body)
         end associate
      end do

   contains

      subroutine read_name(group)
         character(*), intent(in) :: group

         call input%get(group, i, "name", name)
         if (lower(name) == "frame") call input%complain(error, group, i, "name", "any name but frame, which is what does not move")
      end subroutine read_name

   end subroutine new_bodies

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
         call input%complain(error, group, index, key, "no point or body is named "//excerpt(names(element)%text)//"; "// &
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
      if (i > 0) point = self%point(i)
      if (i == 0) point%body = position_of(name, self%name)
      known = i > 0 .or. point%body > 0
      if (known .and. i == 0) point%place = self%centre(:, point%body)
   end function known_point

   !> Names of all coordinates, such as table.y.
   subroutine coordinate_names(self, names)
      type(bodies_t), intent(in) :: self
      type(string_t), allocatable, intent(out) :: names(:)

      integer :: i, k

      allocate (names(3*self%count))
      do i = 1, self%count
         do k = 1, 3
            names(3*(i - 1) + k)%text = self%name(i)%text//"."//trim(components(k))
         end do
      end do
   end subroutine coordinate_names

   !> Add the motion of a point along `direction` to a row (coordinates).
   pure subroutine add_motion(row, point, direction)
      real(wp), intent(inout) :: row(:)
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: direction(2)

      integer :: first

      if (point%body == 0) return
      first = 3*point%body - 2
      row(first:first + 1) = row(first:first + 1) + direction
      row(first + 2) = row(first + 2) + point%arm(1)*direction(2) - point%arm(2)*direction(1)
   end subroutine add_motion

   !> The key `direction` of a group with length 1; a default of the schema counts.
   subroutine unit_direction(input, group, index, direction, error)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      real(wp), intent(out) :: direction(2)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: given(:)
      real(wp) :: longest

      direction = 0.0_wp
      call input%get(group, index, "direction", given)
      longest = maxval(abs(given))
      if (longest > 0.0_wp) then
         direction = given/longest
         direction = direction/norm2(direction)
      else
         call input%complain(error, group, index, "direction", "two numbers that are not both zero, such as 0.0, 1.0 for upwards")
      end if
   end subroutine unit_direction

end module razy_scenes_planar_bodies
