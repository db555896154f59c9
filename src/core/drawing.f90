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

   !> An element: one of the kinds above, and the bodies at both ends, 0 for the frame; ends (the axes of an exciter, the point of a
   !> load twice) and direction of length 1. An end in the frame without a place of its own stands where the other end does.
   type :: element_t
      character(name_length) :: name = ""
      integer :: kind = 0, bodies(2) = 0
      real(wp) :: first(2) = 0.0_wp, second(2) = 0.0_wp, direction(2) = 0.0_wp
   end type element_t

   !> Bodies, points and elements in a plane, x to the right and y up, m; of all pairs of an element, one after the other.
   type :: drawing_t
      character(name_length), allocatable :: body(:)
      !> Centres of mass and sizes (2, bodies).
      real(wp), allocatable :: centre(:, :), extent(:, :)
      character(name_length), allocatable :: point(:)
      !> Body of each point (points), from 1; 0 is the frame.
      integer, allocatable :: point_body(:)
      !> (2, points).
      real(wp), allocatable :: position(:, :)
      type(element_t), allocatable :: element(:)
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

      if (.not. allocated(self%element)) allocate (self%element(0))
      self%element = [self%element, element_t(name, kind, bodies, first, second, direction)]
   end subroutine add

   !> Hand over the group `/scene`.
   pure subroutine columns(self, table)
      class(drawing_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: axis = "/scene/axis", body = "/scene/body", point = "/scene/point", element = "/scene/element"
      character(*), parameter :: bodies(2) = [character(14) :: axis, body], points(2) = [character(14) :: axis, point], &
                                                                                      elements(2) = [character(14) :: axis, element]
      integer :: i, n

      call table%add(axis, ["x", "y"], "1", "axis of the plane", axis)
      call table%add(body, self%body, "1", "body", body)
      call table%add("/scene/centre", self%centre, "m", "centre of mass", bodies)
      call table%add("/scene/size", self%extent, "m", "width and height", bodies)
      call table%add(point, self%point, "1", "point", point)
      call table%add("/scene/point_body", self%point_body, "1", "body, from 1; 0 = frame", point)
      call table%add("/scene/position", self%position, "m", "position", points)
      if (.not. allocated(self%element)) return
      n = size(self%element)
      call table%add(element, self%element%name, "1", "element", element)
      call table%add("/scene/kind", self%element%kind, "1", "kind of element", element)
      call table%note("meanings", element_kinds)
      call table%add("/scene/first_body", self%element%bodies(1), "1", "body at the first end", element)
      call table%add("/scene/second_body", self%element%bodies(2), "1", "body at the second end", element)
      call table%add("/scene/first", reshape([(self%element(i)%first, i=1, n)], [2, n]), "m", "first end", elements)
      call table%add("/scene/second", reshape([(self%element(i)%second, i=1, n)], [2, n]), "m", "second end", elements)
      call table%add("/scene/direction", reshape([(self%element(i)%direction, i=1, n)], [2, n]), "1", &
                     "direction, length 1", elements)
   end subroutine columns

end module razy_core_drawing
