!! The geometry of a machine in its reference position, as a scene knows it and as a result file holds it for pictures.
module razy_core_drawing
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   implicit none(type, external)
   private

   public :: drawing_t, element_kinds, element_spring, element_damper, element_stop, element_exciter, element_load

   !> Kinds of element, as results name them.
   integer, parameter :: element_spring = 1, element_damper = 2, element_stop = 3, element_exciter = 4, element_load = 5
   character(*), parameter :: element_kinds = "1 = spring, 2 = damper, 3 = stop, 4 = exciter, 5 = load"
   integer, parameter :: name_length = 64

   !> Bodies, points and elements in a plane, x to the right and y up, m.
   type :: drawing_t
      character(name_length), allocatable :: body(:)
      !> Centres of mass and sizes (2, bodies).
      real(wp), allocatable :: centre(:, :), extent(:, :)
      character(name_length), allocatable :: point(:)
      !> Body of each point (points), from 1; 0 is the frame.
      integer, allocatable :: point_body(:)
      !> (2, points).
      real(wp), allocatable :: position(:, :)
      character(name_length), allocatable :: element(:)
      !> One of the kinds above, and the bodies at both ends; 0 is the frame (elements).
      integer, allocatable :: kind(:), first_body(:), second_body(:)
      !> Ends (the axes of an exciter, the point of a load twice) and direction of length 1; of all pairs of an element, one
      !> after the other (2, elements). An end in the frame without a place of its own stands where the other end does.
      real(wp), allocatable :: first(:, :), second(:, :), direction(:, :)
   contains
      procedure :: add
      procedure :: columns
   end type drawing_t

contains

   !> Add an element.
   pure subroutine add(self, name, kind, bodies, first, second, direction)
      class(drawing_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: kind, bodies(2)
      real(wp), intent(in) :: first(2), second(2), direction(2)

      character(name_length) :: padded
      integer :: n

      padded = name
      n = 0
      if (allocated(self%kind)) n = size(self%kind)
      if (n == 0) then
         self%element = [padded]
         self%kind = [kind]
         self%first_body = [bodies(1)]
         self%second_body = [bodies(2)]
         self%first = reshape(first, [2, 1])
         self%second = reshape(second, [2, 1])
         self%direction = reshape(direction, [2, 1])
      else
         self%element = [self%element, padded]
         self%kind = [self%kind, kind]
         self%first_body = [self%first_body, bodies(1)]
         self%second_body = [self%second_body, bodies(2)]
         self%first = reshape([self%first, first], [2, n + 1])
         self%second = reshape([self%second, second], [2, n + 1])
         self%direction = reshape([self%direction, direction], [2, n + 1])
      end if
   end subroutine add

   !> Hand over the group `/scene`.
   pure subroutine columns(self, table)
      class(drawing_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: axis = "/scene/axis", body = "/scene/body", point = "/scene/point", element = "/scene/element"
      character(*), parameter :: bodies(2) = [character(14) :: axis, body], points(2) = [character(14) :: axis, point], &
                                                                                      elements(2) = [character(14) :: axis, element]

      call table%add(axis, ["x", "y"], "1", "axis of the plane", axis)
      call table%add(body, self%body, "1", "body", body)
      call table%add("/scene/centre", self%centre, "m", "centre of mass", bodies)
      call table%add("/scene/size", self%extent, "m", "width and height", bodies)
      call table%add(point, self%point, "1", "point", point)
      call table%add("/scene/point_body", self%point_body, "1", "body, from 1; 0 = frame", point)
      call table%add("/scene/position", self%position, "m", "position", points)
      if (.not. allocated(self%kind)) return
      call table%add(element, self%element, "1", "element", element)
      call table%add("/scene/kind", self%kind, "1", "kind of element", element)
      call table%note("meanings", element_kinds)
      call table%add("/scene/first_body", self%first_body, "1", "body at the first end", element)
      call table%add("/scene/second_body", self%second_body, "1", "body at the second end", element)
      call table%add("/scene/first", self%first, "m", "first end", elements)
      call table%add("/scene/second", self%second, "m", "second end", elements)
      call table%add("/scene/direction", self%direction, "1", "direction, length 1", elements)
   end subroutine columns

end module razy_core_drawing
