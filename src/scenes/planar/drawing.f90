!! The geometry of a planar scene, for pictures.
module razy_scenes_planar_drawing
   use razy_core_drawing, only: drawing_t, element_damper, element_exciter, element_load, element_spring, element_stop
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_scenes_planar_bodies, only: bodies_t, find_coordinate, known_point, point_t
   use razy_scenes_planar_excitation, only: exciter_axes
   use razy_scenes_planar_links, only: link_t, new_link, pair_count
   implicit none(type, external)
   private

   public :: draw_planar

contains

   !> Bodies, points, springs, dampers, stops, exciters and loads.
   subroutine draw_planar(drawing, bodies, input, error)
      type(drawing_t), intent(out) :: drawing
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: extent(:)
      type(point_t) :: axis(2)
      real(wp) :: along(2)
      integer :: i

      allocate (drawing%body(bodies%count), drawing%extent(2, bodies%count))
      drawing%centre = bodies%centre
      do i = 1, bodies%count
         drawing%body(i) = bodies%name(i)%text
         call input%get("body", i, "size", extent)
         drawing%extent(:, i) = extent
      end do
      allocate (drawing%point(size(bodies%point)), drawing%position(2, size(bodies%point)))
      drawing%point_body = bodies%point%body
      do i = 1, size(bodies%point)
         drawing%point(i) = bodies%point_name(i)%text
         drawing%position(:, i) = bodies%point(i)%place
      end do
      call draw_links(drawing, bodies, input, "spring", element_spring, error)
      if (.not. allocated(error)) call draw_links(drawing, bodies, input, "damper", element_damper, error)
      if (.not. allocated(error)) call draw_links(drawing, bodies, input, "stop", element_stop, error)
      if (.not. allocated(error)) call draw_loads(drawing, bodies, input, error)
      if (allocated(error)) return
      do i = 1, input%count("exciter")
         call exciter_axes(bodies, input, i, axis, along, error)
         if (allocated(error)) return
         call drawing%add(name_of(input, "exciter", i), element_exciter, axis%body, axis(1)%place, axis(2)%place, along)
      end do
   end subroutine draw_planar

   !> All pairs of all groups of a kind.
   subroutine draw_links(drawing, bodies, input, group, kind, error)
      type(drawing_t), intent(inout) :: drawing
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: kind
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link
      integer :: i, pair, pairs

      do i = 1, input%count(group)
         call pair_count(input, group, i, pairs, error)
         if (allocated(error)) return
         do pair = 1, pairs
            call new_link(link, bodies, input, group, i, pair, error)
            if (allocated(error)) return
            if (.not. link%first%located) link%first%place = link%second%place
            if (.not. link%second%located) link%second%place = link%first%place
            call drawing%add(name_of(input, group, i), kind, [link%first%body, link%second%body], link%first%place, &
                             link%second%place, link%direction)
         end do
      end do
   end subroutine draw_links

   !> Forces as arrows; a moment has no direction.
   subroutine draw_loads(drawing, bodies, input, error)
      type(drawing_t), intent(inout) :: drawing
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(point_t) :: point
      real(wp), allocatable :: row(:)
      character(:), allocatable :: on
      logical :: turns
      integer :: coordinate, i

      do i = 1, input%count("load")
         call find_coordinate(bodies, input, "load", i, "on", row, turns, coordinate, error)
         if (allocated(error)) return
         call input%get("load", i, "on", on)
         if (.not. known_point(bodies, on(:scan(on, ".", back=.true.) - 1), point)) cycle
         call drawing%add("load "//to_text(i), element_load, [point%body, 0], point%place, point%place, &
                          row(3*point%body - 2:3*point%body - 1))
      end do
   end subroutine draw_loads

   !> The name of a group, or its kind and number.
   function name_of(input, group, i) result(name)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      character(:), allocatable :: name

      name = group//" "//to_text(i)
      if (input%given(group, i, "name")) call input%get(group, i, "name", name)
   end function name_of

end module razy_scenes_planar_drawing
