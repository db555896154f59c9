!! Closed forms of an impact: what a body that meets a stop with speed v leaves it with.
module bounce_forms
   use razy_core_kinds, only: qp, wp
   implicit none(type, external)
   private

   public :: central_impact, restitution_hunt_crossley, restitution_kelvin_voigt

contains

   !> Restitution of m p'' + b p' + k p = 0 with the damping ratio zeta = b/(2 sqrt(m k)).
   !>
   !> p = (v/ω_d) e^{-ζωt} sin ω_d t. At zero deformation ω_d t = π, and for ζ >= 1 never: 0. With ζ = sin β the force
   !> k p + b p' is in proportion to e^{-ζωt} sin(ω_d t + 2β), so at zero force ω_d t = π - 2β, where p'/v = -e^{-ζωt}.
   pure function restitution_kelvin_voigt(zeta, at_zero_force) result(e)
      real(wp), intent(in) :: zeta
      logical, intent(in) :: at_zero_force
      real(wp) :: e

      real(qp), parameter :: pi = acos(-1.0_qp)
      real(qp) :: z, beta

      z = zeta
      if (z < 1.0_qp) then
         beta = asin(z)
         e = real(exp(-tan(beta)*(pi - merge(2*beta, 0.0_qp, at_zero_force))), wp)
      else
         e = 0.0_wp
         if (at_zero_force .and. z > 1.0_qp) e = real(exp(-2*acosh(z)*z/sqrt(z**2 - 1)), wp)
         if (at_zero_force .and. .not. z > 1.0_qp) e = real(exp(-2.0_qp), wp)
      end if
   end function restitution_kelvin_voigt

   !> Restitution of m p'' + k pⁿ (1 + c p') = 0, c = (3/2) α, for a speed of approach v.
   !>
   !> m p' dp'/(1 + c p') = -k pⁿ dp, and p is 0 at both ends, so G(u) = c u - ln(1 + c u) is the same for u = v and
   !> u = -e v, whatever k and n. Solved by bisection.
   pure function restitution_hunt_crossley(hysteresis, v) result(e)
      real(wp), intent(in) :: hysteresis, v
      real(wp) :: e

      real(qp) :: a, b, cv, goal, middle
      integer :: i

      cv = 1.5_qp*hysteresis*v
      goal = cv - log(1 + cv)
      a = 0.0_qp
      b = 1.0_qp
      do i = 1, 110
         middle = 0.5_qp*(a + b)
         if (cv*middle >= 1.0_qp) then
            b = middle
         else if (-cv*middle - log(1 - cv*middle) > goal) then
            b = middle
         else
            a = middle
         end if
      end do
      e = real(a, wp)
   end function restitution_hunt_crossley

   !> Newton's impact of two bodies (2.1)-(2.8): velocities after it, and the energy lost as the difference of kinetic energies
   !> (2.9).
   pure subroutine central_impact(m, v, restitution, after, loss)
      real(wp), intent(in) :: m(2), v(2), restitution
      real(wp), intent(out) :: after(2), loss

      real(wp) :: shared

      shared = dot_product(m, v)/sum(m)
      after = (1 + restitution)*shared - restitution*v
      loss = 0.5_wp*dot_product(m, v**2) - 0.5_wp*dot_product(m, after**2)
   end subroutine central_impact

end module bounce_forms
