!! How far the bodies of a planar scene may turn: its geometry is that of the reference position.
!!
!! The arm of a force changes by φ of itself at an angle φ. A body that only stands has its weight to right it: at φ the arm of the
!! weight about the edge that it tilts over, b, has become b - h φ, h being the height of the centre above it; it is 0 at the angle
!! b/h, at which the body topples.
module razy_scenes_parts_turning
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_input_input, only: input_t
   use razy_machine_machine, only: machine_t
   use razy_scenes_parts_bodies, only: bodies_t, of_body
   use razy_scenes_parts_excitation, only: read_gravity
   use razy_scenes_parts_links, only: link_t
   implicit none(type, external)
   private

   public :: bound_turning

   !> Angle up to which small rotations hold, rad, and part of the angle at which a body topples.
   real(wp), parameter :: small = 0.05_wp

contains

   !> Say up to which displacements the machine holds; of what shifts up to any.
   subroutine bound_turning(machine, bodies, links, stops, input, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(link_t), intent(in) :: links(:), stops(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: down(2)
      integer :: c, k

      if (input%count("body") == 0) return
      machine%holds_to = merge(small, huge(small), bodies%turns .and. bodies%kind(bodies%of) == of_body)
      call read_gravity(down, input, error)
      if (allocated(error) .or. .not. norm2(down) > 0.0_wp) return
      do c = 1, size(bodies%of)
         if (.not. machine%holds_to(c) <= small) cycle
         if (any([(any(bodies%of(c) == [links(k)%first%body, links(k)%second%body]), k=1, size(links))])) cycle
         machine%holds_to(c) = small*min(1.0_wp, toppling_angle(stops, bodies%of(c), down))
      end do
   end subroutine bound_turning

   !> The angle at which body b topples over the nearer edge of the stops that it stands on; 1 where it does not stand.
   pure real(wp) function toppling_angle(stops, b, down) result(angle)
      type(link_t), intent(in) :: stops(:)
      integer, intent(in) :: b
      real(wp), intent(in) :: down(2)

      real(wp) :: edge(size(stops))
      integer :: k

      angle = 1.0_wp
      edge = 0.0_wp
      do k = 1, size(stops)
         if (stops(k)%first%body == b) edge(k) = edge_at(stops(k)%first%arm, stops(k)%direction, down)
         if (stops(k)%second%body == b) edge(k) = edge_at(stops(k)%second%arm, -stops(k)%direction, down)
      end do
      if (any(edge > 0.0_wp) .and. any(edge < 0.0_wp)) angle = min(maxval(edge), -minval(edge))
   end function toppling_angle

   !> How far a stop at `arm` that pushes along `push` is beside the centre, over its depth below it; 0 if it is no support.
   pure real(wp) function edge_at(arm, push, down) result(edge)
      real(wp), intent(in) :: arm(2), push(2), down(2)

      edge = 0.0_wp
      if (dot_product(push, down) < 0.0_wp .and. dot_product(arm, down) > 0.0_wp) then
         edge = (arm(1)*down(2) - arm(2)*down(1))/dot_product(arm, down)
      end if
   end function edge_at

end module razy_scenes_parts_turning
