!! The matrix exponential of small dense matrices, by scaled Taylor series.
!!
!! A step is cut into parts on which the norm of T*tau is at most one half, where the series reaches rounding in
!! fewer than twenty terms and has no cancellation to speak of (Al-Mohy and Higham, SIAM J. Sci. Comput. 33 (2011)).
module razy_linalg_exponential
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: identity
   implicit none(type, external)
   private

   public :: exponential_action, matrix_exponential

contains

   !> y = exp(matrix*tau) x. `norm` is the largest column sum of |matrix|, 1/s; `matrix` (n, n), `x`, `y` (n).
   pure subroutine exponential_action(matrix, norm, tau, x, y)
      real(wp), intent(in) :: matrix(:, :), norm, tau, x(:)
      real(wp), intent(out) :: y(:)

      real(wp) :: term(size(x)), part
      integer :: parts, i, k

      ! In so many parts the series would take longer than the whole exponential.
      if (norm*abs(tau) > size(x)) then
         y = matmul(matrix_exponential(matrix, tau), x)
         return
      end if
      parts = max(1, ceiling(2.0_wp*norm*abs(tau)))
      part = tau/parts
      y = x
      do i = 1, parts
         term = y
         do k = 1, 30
            term = matmul(matrix, term)*(part/k)
            y = y + term
            if (all(abs(term) <= 0.1_wp*epsilon(1.0_wp)*abs(y))) exit
         end do
      end do
   end subroutine exponential_action

   !> exp(matrix*tau), by scaling and squaring of the Taylor series. `matrix` and the result are (n, n).
   pure function matrix_exponential(matrix, tau) result(power)
      real(wp), intent(in) :: matrix(:, :), tau
      real(wp) :: power(size(matrix, 1), size(matrix, 1))

      real(wp) :: scaled(size(matrix, 1), size(matrix, 1)), term(size(matrix, 1), size(matrix, 1)), norm
      integer :: squarings, i, k

      norm = maxval(sum(abs(matrix), dim=1))*abs(tau)
      squarings = merge(exponent(2.0_wp*norm), 0, norm > 0.5_wp)
      scaled = matrix*scale(tau, -squarings)
      term = identity(size(matrix, 1))
      power = term
      do k = 1, 30
         term = matmul(scaled, term)/k
         power = power + term
         if (maxval(abs(term)) <= 0.01_wp*epsilon(1.0_wp)*maxval(abs(power))) exit
      end do
      do i = 1, squarings
         power = matmul(power, power)
      end do
   end function matrix_exponential

end module razy_linalg_exponential
