!! Sums over the amplitudes of large models, in vectors of fixed width, so that the order of each sum is always the same.
!!
!! Below `wide` amplitudes plain loops are faster; this file alone is compiled with vectors.
module razy_linalg_wide_sums
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: add_product, rotate, sum_of, two_sums, wide

   !> From this number of terms on the procedures here serve.
   integer, parameter :: wide = 12
   integer, parameter :: lanes = 4

contains

   !> y = y + A x, four columns at a time.
   pure subroutine add_product(n, columns, a, x, y)
      integer, intent(in) :: n, columns
      real(wp), intent(in) :: a(n, columns), x(columns)
      real(wp), intent(inout) :: y(n)

      real(wp) :: x1, x2, x3, x4
      integer :: i, j

      do j = 1, columns - 3, 4
         x1 = x(j)
         x2 = x(j + 1)
         x3 = x(j + 2)
         x4 = x(j + 3)
         do i = 1, n
            y(i) = y(i) + ((a(i, j)*x1 + a(i, j + 1)*x2) + (a(i, j + 2)*x3 + a(i, j + 3)*x4))
         end do
      end do
      do j = columns - modulo(columns, 4) + 1, columns
         x1 = x(j)
         do i = 1, n
            y(i) = y(i) + a(i, j)*x1
         end do
      end do
   end subroutine add_product

   !> Multiply n complex numbers by factors.
   pure subroutine rotate(n, from_re, from_im, factor_re, factor_im, re, im)
      integer, intent(in) :: n
      real(wp), intent(in) :: from_re(n), from_im(n), factor_re(n), factor_im(n)
      real(wp), intent(out) :: re(n), im(n)

      integer :: i

      do i = 1, n
         re(i) = from_re(i)*factor_re(i) - from_im(i)*factor_im(i)
         im(i) = from_re(i)*factor_im(i) + from_im(i)*factor_re(i)
      end do
   end subroutine rotate

   !> f = Σ a0 re + b0 im and g = Σ a1 re + b1 im over n amplitudes.
   pure subroutine two_sums(n, a0, b0, a1, b1, re, im, f, g)
      integer, intent(in) :: n
      real(wp), intent(in) :: a0(n), b0(n), a1(n), b1(n), re(n), im(n)
      real(wp), intent(out) :: f, g

      real(wp) :: first(lanes), second(lanes)
      integer :: i, j

      first = 0.0_wp
      second = 0.0_wp
      do j = 0, n - lanes, lanes
         do i = 1, lanes
            first(i) = first(i) + (a0(j + i)*re(j + i) + b0(j + i)*im(j + i))
            second(i) = second(i) + (a1(j + i)*re(j + i) + b1(j + i)*im(j + i))
         end do
      end do
      f = (first(1) + first(3)) + (first(2) + first(4))
      g = (second(1) + second(3)) + (second(2) + second(4))
      do j = n - modulo(n, lanes) + 1, n
         f = f + (a0(j)*re(j) + b0(j)*im(j))
         g = g + (a1(j)*re(j) + b1(j)*im(j))
      end do
   end subroutine two_sums

   !> Σ a x over n amplitudes.
   pure function sum_of(n, a, x) result(total)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n), x(n)
      real(wp) :: total

      real(wp) :: part(lanes)
      integer :: i, j

      part = 0.0_wp
      do j = 0, n - lanes, lanes
         do i = 1, lanes
            part(i) = part(i) + a(j + i)*x(j + i)
         end do
      end do
      total = (part(1) + part(3)) + (part(2) + part(4))
      do j = n - modulo(n, lanes) + 1, n
         total = total + a(j)*x(j)
      end do
   end function sum_of

end module razy_linalg_wide_sums
