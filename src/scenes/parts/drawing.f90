!! The geometry of a planar scene, for pictures.
module razy_scenes_parts_drawing
   use razy_core_drawing, only: drawing_t, element_damper, element_exciter, element_spring, element_stop
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_input_input, only: input_t
   use razy_scenes_parts_bodies, only: bodies_t, point_t
   use razy_scenes_parts_excitation, only: exciter_axes
   use razy_scenes_parts_links, only: link_t
   implicit none(type, external)
   private

   public :: draw_exciters, draw_links

contains

   !> Bodies, points, springs, dampers and stops.
   subroutine draw_links(drawing, bodies, links, input)
      type(drawing_t), intent(out) :: drawing
      type(bodies_t), intent(in) :: bodies
      type(link_t), intent(in) :: links(:)
      type(input_t), intent(in) :: input

      type(point_t) :: first, second
      integer :: i

      drawing%body = [character(len(drawing%body)) ::(bodies%name(i)%text, i=1, bodies%count)]
      drawing%centre = bodies%centre
      drawing%extent = bodies%extent
      allocate (drawing%point(size(bodies%point)), drawing%position(2, size(bodies%point)))
      drawing%point_body = bodies%point%body
      do i = 1, size(bodies%point)
         drawing%point(i) = bodies%point_name(i)%text
         drawing%position(:, i) = bodies%point(i)%place
      end do
      do i = 1, size(links)
         first = links(i)%first
         second = links(i)%second
         if (.not. first%located) first%place = second%place
         if (.not. second%located) second%place = first%place
         call drawing%add(name_of(input, links(i)%group, links(i)%number), kind_of(links(i)%group), [first%body, second%body], &
                          first%place, second%place, merge([1.0_wp, 0.0_wp], links(i)%direction, links(i)%turns))
      end do
   end subroutine draw_links

   !> Add exciters to the drawing, from axis to axis.
   subroutine draw_exciters(drawing, bodies, input, error)
      type(drawing_t), intent(inout) :: drawing
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(point_t) :: axis(2)
      real(wp) :: along(2)
      integer :: i

      do i = 1, input%count("exciter")
         call exciter_axes(bodies, input, i, axis, along, error)
         if (allocated(error)) return
         call drawing%add(name_of(input, "exciter", i), element_exciter, axis%body, axis(1)%place, axis(2)%place, along)
      end do
   end subroutine draw_exciters

   pure integer function kind_of(group) result(kind)
      character(*), intent(in) :: group

      kind = element_stop
      if (group == "spring") kind = element_spring
      if (group == "damper") kind = element_damper
   end function kind_of

   !> The name of a group, or its kind and number.
   function name_of(input, group, i) result(name)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      character(:), allocatable :: name

      name = group//" "//to_text(i)
      if (input%given(group, i, "name")) call input%get(group, i, "name", name)
   end function name_of

end module razy_scenes_parts_drawing
