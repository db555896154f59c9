!! What becomes of a volume of states along a motion, without tangents: it shrinks by the trace of the damping while a motion
!! goes on, Liouville's formula, and by the restitution twice at an impact of a rigid stop. So det ∂P/∂x and the sum of all
!! Lyapunov exponents are known in another way.
module razy_orbits_volume
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_negative_inf, ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_hybrid_flow, only: flow_t
   use razy_hybrid_mode, only: affine, idle, mode_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: volume_t

   !> Natural logarithm of the volume, of 1 at first. NaN: force laws are not piecewise linear, friction sticks or turns round, or
   !> several rigid stops are struck at once; -infinity: an impact without restitution.
   type, extends(observer_t) :: volume_t
      real(wp) :: logarithm = 0.0_wp
      type(mode_t), private :: mode
      !> Rates with which the piece before has ended (contacts), once there was one.
      real(wp), allocatable, private :: rate(:)
      logical, private :: begun = .false.
   contains
      procedure :: begin
      procedure :: piece
   end type volume_t

   !> A smaller jump of a rate, relative to it, is rounding.
   real(wp), parameter :: smallest = 1.0e-9_wp

contains

   !> Begin with a motion of this flow.
   subroutine begin(self, by)
      class(volume_t), intent(inout) :: self
      class(flow_t), intent(in) :: by

      self%logarithm = 0.0_wp
      self%begun = .false.
      call self%mode%make_room(size(by%branch), .false.)
      self%rate = spread(0.0_wp, 1, size(by%branch))
   end subroutine begin

   !> Take up what a piece does to the volume, and the impact that it begins with.
   subroutine piece(self, part)
      class(volume_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: force, rate, s
      integer :: j, struck
      logical :: known

      if (ieee_is_nan(self%logarithm)) return
      struck = 0
      known = .true.
      select type (by => part%by)
      class is (flow_t)
         self%mode%branch = by%branch
         call self%mode%enter(by%system)
         known = all(self%mode%does == idle .or. self%mode%does == affine)
         if (known) self%logarithm = self%logarithm - self%mode%damping_trace(by%system)*part%duration
         associate (contact => by%system%machine%contact)
            do j = 1, size(contact)
               if (.not. contact(j)%law%impacts) cycle
               call by%contact(j, 0.0_wp, s, rate, force)
               if (self%begun .and. abs(rate - self%rate(j)) > smallest*max(abs(rate), abs(self%rate(j)))) then
                  struck = struck + 1
                  if (contact(j)%law%restitution > 0.0_wp) then
                     self%logarithm = self%logarithm + 2*log(max(abs(rate/self%rate(j)), tiny(1.0_wp)))
                  else
                     self%logarithm = ieee_value(1.0_wp, ieee_negative_inf)
                  end if
               end if
               call by%contact(j, part%duration, s, self%rate(j), force)
            end do
            if (part%contact > 0) known = known .and. .not. contact(part%contact)%law%of_normal
         end associate
      end select
      self%begun = .true.
      if (.not. known .or. struck > 1) self%logarithm = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine piece

end module razy_orbits_volume
