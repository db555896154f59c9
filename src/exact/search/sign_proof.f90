!! Proofs about the sign of a function on a step from its values and slopes at both ends.
!!
!! The cubic Hermite interpolant H of f on [0, h] errs by at most m4 t²(h-t)²/24, m4 bounding |f''''|. In the Bernstein basis
!! of degree four this error is a single coefficient, m4 h⁴/144, so f >= 0 wherever the five coefficients of H less the
!! error are non-negative. The error vanishes at both ends, which is why a function that is zero at the start of a step
!! and leaves it upwards can be proved positive as well. Slope and curvature of H err by at most sqrt(3) m4 h³/216 and
!! m4 h²/12 (Birkhoff and Priver, J. Math. Phys. 46 (1967) 440–447), which proves f monotone, convex or concave from the
!! same numbers. `noise` is the rounding in values of f, which differences over h and h² enlarge.
module razy_exact_search_sign_proof
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: hermite_root, proved_curvature, proved_margin, proved_monotone

contains

   !> A lower bound of the inner Bernstein coefficients of f: f >= 0 on [0, h] is proved if it and f0, f1 are >= 0.
   !>
   !> `f0`, `f1` values, `g0`, `g1` slopes at 0 and h, `m4` bound of the fourth derivative.
   elemental function proved_margin(f0, g0, f1, g1, h, m4) result(margin)
      real(wp), intent(in) :: f0, g0, f1, g1, h, m4
      real(wp) :: margin

      margin = min(f0 + 0.25_wp*h*g0, f1 - 0.25_wp*h*g1, 0.5_wp*(f0 + f1) + h*(g0 - g1)*(1.0_wp/6) - m4*h**4*(1.0_wp/144))
   end function proved_margin

   !> Whether f is proved to be monotone on [0, h].
   elemental function proved_monotone(f0, g0, f1, g1, h, m4, noise) result(monotone)
      real(wp), intent(in) :: f0, g0, f1, g1, h, m4, noise
      logical :: monotone

      real(wp), parameter :: slope_error = sqrt(3.0_wp)/216
      real(wp) :: middle, error

      middle = 3*(f1 - f0)/h - g0 - g1
      error = slope_error*m4*h**3 + 6*noise/h
      monotone = min(g0, middle, g1) >= error .or. max(g0, middle, g1) <= -error
   end function proved_monotone

   !> Curvature of H at both ends, and +1 or -1 if f is proved convex or concave on [0, h], else 0.
   elemental subroutine proved_curvature(f0, g0, f1, g1, h, m4, noise, d0, d1, curvature)
      real(wp), intent(in) :: f0, g0, f1, g1, h, m4, noise
      real(wp), intent(out) :: d0, d1
      integer, intent(out) :: curvature

      real(wp) :: chord, error

      chord = 6*(f1 - f0)/h
      d0 = (chord - 4*g0 - 2*g1)/h
      d1 = (2*g0 + 4*g1 - chord)/h
      error = m4*h**2/12 + 12*noise/h**2
      curvature = 0
      if (min(d0, d1) >= error) curvature = 1
      if (max(d0, d1) <= -error) curvature = -1
   end subroutine proved_curvature

   !> A point of [0, high] near the root of the cubic with these values and slopes at 0 and h; it starts a Newton iteration.
   pure function hermite_root(f0, g0, f1, g1, h, high) result(root)
      real(wp), intent(in) :: f0, g0, f1, g1, h, high
      real(wp) :: root

      real(wp) :: a, b, s, left, right, p, dp
      integer :: i

      a = 2*(f0 - f1) + h*(g0 + g1)
      b = 3*(f1 - f0) - h*(2*g0 + g1)
      left = 0.0_wp
      right = high/h
      s = 0.5_wp*right
      if (f0 > 0.0_wp .and. f1 < 0.0_wp) s = f0/(f0 - f1)
      do i = 1, 4
         p = f0 + s*(h*g0 + s*(b + s*a))
         dp = h*g0 + s*(2*b + 3*s*a)
         if (p >= 0.0_wp) then
            left = s
         else
            right = s
         end if
         if (abs(p) < abs(dp)) then
            s = s - p/dp
         else
            s = 0.5_wp*(left + right)
         end if
         if (.not. (s > left .and. s < right)) s = 0.5_wp*(left + right)
         if (abs(p) <= 0.05_wp*abs(dp)) exit
      end do
      root = min(max(s*h, 0.0_wp), high)
   end function hermite_root

end module razy_exact_search_sign_proof
