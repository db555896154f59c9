!! Energy that contacts give at an event. Impulses of what is passive take it away, or leave it as it is, whatever the sequence of
!! impacts: with M = 1 the length of y' does not grow. Motions that are given do work: with the least y', u, at which contacts
!! that have one would be at rest, y' - u does not grow, so y' grows by no more than 2 |u|.
!!
!! Newton's restitution of bodies that slide can give energy, too (Stronge, Impact Mechanics (2000)), and that is seen as well.
module razy_hybrid_event_impulses
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: given_speed

contains

   !> By how much |y'| has grown at (tau, z) from what it was as it `came` (m), beyond what given motions may do.
   function given_speed(dynamics, system, came, tau, z) result(grown)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: came(:), tau, z(:)
      real(wp) :: grown

      ! Made where it is needed, for most impacts give nothing.
      type(constraints_t), allocatable :: given
      integer :: j

      associate (speed => z(system%m + 1:))
         grown = max(0.0_wp, sqrt(dot_product(speed, speed)) - sqrt(dot_product(came, came)))
         if (.not. (grown > 0.0_wp .and. any(system%given))) return
         call dynamics%look_at_contacts(system, tau, z)
         allocate (given)
         call new_constraints(given, dynamics%w, pack([(j, j=1, size(system%given))], system%given), [integer ::], [integer ::], &
                              [real(wp) ::])
         associate (w => dynamics%w(:, given%contact))
            grown = max(0.0_wp, grown - 2*norm2(matmul(w, matmul(given%inverse, dynamics%rate(given%contact) - matmul(speed, w)))))
         end associate
      end associate
   end function given_speed

end module razy_hybrid_event_impulses
