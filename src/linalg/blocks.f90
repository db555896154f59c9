!! Sums over the amplitudes of a motion, in blocks of four, so that the order of each sum is the same at every width of vectors.
!!
!! Lists are filled up with zeros to whole blocks; the loops over a block become vectors of two or four numbers.
module razy_linalg_blocks
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: copy_blocks, filled, grow_shortly, moduli_of, paired, product, rotate, rotate_self, sum_of, three_sums, two_sums

   !> Numbers in a block; amplitudes go in pairs.
   integer, parameter :: block = 4, pair = 2

contains

   !> Length of a list of n numbers that is filled up to whole blocks.
   elemental integer function filled(n)
      integer, intent(in) :: n

      filled = block*((n + block - 1)/block)
   end function filled

   !> The same up to pairs.
   elemental integer function paired(n)
      integer, intent(in) :: n

      paired = pair*((n + pair - 1)/pair)
   end function paired

   !> Copy n numbers, and what stands behind them in the last block.
   pure subroutine copy_blocks(n, from, to)
      integer, intent(in) :: n
      real(wp), intent(in) :: from(filled(n))
      real(wp), intent(inout) :: to(filled(n))

      integer :: i, j

      do j = 0, n - 1, block
         !$omp simd
         do i = j + 1, j + block
            to(i) = from(i)
         end do
      end do
   end subroutine copy_blocks

   !> y = A x, four columns at a time.
   pure subroutine product(n, columns, a, x, y)
      integer, intent(in) :: n, columns
      real(wp), intent(in) :: a(n, columns), x(columns)
      real(wp), intent(out) :: y(n)

      integer :: c, i, last

      last = columns - modulo(columns, 4)
      !$omp simd
      do i = 1, n
         y(i) = 0.0_wp
      end do
      do c = 1, last, 4
         !$omp simd
         do i = 1, n
            y(i) = y(i) + ((a(i, c)*x(c) + a(i, c + 1)*x(c + 1)) + (a(i, c + 2)*x(c + 2) + a(i, c + 3)*x(c + 3)))
         end do
      end do
      do c = last + 1, columns
         !$omp simd
         do i = 1, n
            y(i) = y(i) + a(i, c)*x(c)
         end do
      end do
   end subroutine product

   !> Multiply n complex numbers, the real parts first, by factors.
   pure subroutine rotate(n, from, factor, to)
      integer, intent(in) :: n
      real(wp), intent(in) :: from(2*n), factor(2*n)
      real(wp), intent(out) :: to(2*n)

      integer :: i, j

      do j = 0, n - pair, pair
         !$omp simd
         do i = j + 1, j + pair
            to(i) = from(i)*factor(i) - from(n + i)*factor(n + i)
            to(n + i) = from(i)*factor(n + i) + from(n + i)*factor(i)
         end do
      end do
   end subroutine rotate

   !> The same in place.
   pure subroutine rotate_self(n, factor, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: factor(2*n)
      real(wp), intent(inout) :: x(2*n)

      real(wp) :: re, im
      integer :: i, j

      do j = 0, n - pair, pair
         !$omp simd private(re, im)
         do i = j + 1, j + pair
            re = x(i)
            im = x(n + i)
            x(i) = re*factor(i) - im*factor(n + i)
            x(n + i) = re*factor(n + i) + im*factor(i)
         end do
      end do
   end subroutine rotate_self

   !> Multiply n complex numbers by e^{(decay + i turn) t}, by series: right to rounding for moduli of exponents times t of at most
   !> 0.08, or 3e-3 if `shorter`.
   pure subroutine grow_shortly(n, decay, turn, t, shorter, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: decay(n), turn(n), t
      logical, intent(in) :: shorter
      real(wp), intent(inout) :: x(2*n)

      real(wp) :: d, y, y2, cosine, sine, re, im
      integer :: i, j

      if (shorter) then
         do j = 0, n - pair, pair
            !$omp simd private(d, y, y2, cosine, sine, re, im)
            do i = j + 1, j + pair
               d = decay(i)*t
               y = turn(i)*t
               y2 = y*y
               d = 1.0_wp + d*(1.0_wp + d*(0.5_wp + d*(1.0_wp/6 + d*(1.0_wp/24 + d*(1.0_wp/120)))))
               cosine = d*(1.0_wp - y2*(0.5_wp - y2*(1.0_wp/24)))
               sine = d*(y*(1.0_wp - y2*(1.0_wp/6 - y2*(1.0_wp/120))))
               re = x(i)
               im = x(n + i)
               x(i) = re*cosine - im*sine
               x(n + i) = re*sine + im*cosine
            end do
         end do
      else
         do j = 0, n - pair, pair
            !$omp simd private(d, y, y2, cosine, sine, re, im)
            do i = j + 1, j + pair
               d = decay(i)*t
               y = turn(i)*t
               y2 = y*y
               d = 1.0_wp + d*(1.0_wp + d*(0.5_wp + d*(1.0_wp/6 + d*(1.0_wp/24 + d*(1.0_wp/120 + d*(1.0_wp/720 &
                                                                      + d*(1.0_wp/5040 + d*(1.0_wp/40320 + d*(1.0_wp/362880)))))))))
               cosine = d*(1.0_wp - y2*(0.5_wp - y2*(1.0_wp/24 - y2*(1.0_wp/720 - y2*(1.0_wp/40320)))))
               sine = d*(y*(1.0_wp - y2*(1.0_wp/6 - y2*(1.0_wp/120 - y2*(1.0_wp/5040 - y2*(1.0_wp/362880))))))
               re = x(i)
               im = x(n + i)
               x(i) = re*cosine - im*sine
               x(n + i) = re*sine + im*cosine
            end do
         end do
      end if
   end subroutine grow_shortly

   !> Moduli of n complex numbers.
   pure subroutine moduli_of(n, x, modulus)
      integer, intent(in) :: n
      real(wp), intent(in) :: x(2*n)
      real(wp), intent(out) :: modulus(n)

      integer :: i, j

      do j = 0, n - pair, pair
         !$omp simd
         do i = j + 1, j + pair
            modulus(i) = sqrt(x(i)*x(i) + x(n + i)*x(n + i))
         end do
      end do
   end subroutine moduli_of

   !> Σ a x over n numbers, of which the last two need not be filled up.
   pure function sum_of(n, a, x) result(total)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n), x(n)
      real(wp) :: total

      real(wp) :: part(block)
      integer :: i, j

      part = 0.0_wp
      do j = 0, n - block, block
         !$omp simd
         do i = 1, block
            part(i) = part(i) + a(j + i)*x(j + i)
         end do
      end do
      total = (part(1) + part(3)) + (part(2) + part(4))
      do j = n - modulo(n, block) + 1, n
         total = total + a(j)*x(j)
      end do
   end function sum_of

   !> f = Σ a(:, 1) x and g = Σ a(:, 2) x over n numbers.
   pure subroutine two_sums(n, a, x, f, g)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, 2), x(n)
      real(wp), intent(out) :: f, g

      real(wp) :: first(block), second(block)
      integer :: i, j

      first = 0.0_wp
      second = 0.0_wp
      do j = 0, n - block, block
         !$omp simd
         do i = 1, block
            first(i) = first(i) + a(j + i, 1)*x(j + i)
            second(i) = second(i) + a(j + i, 2)*x(j + i)
         end do
      end do
      f = (first(1) + first(3)) + (first(2) + first(4))
      g = (second(1) + second(3)) + (second(2) + second(4))
   end subroutine two_sums

   !> The same, and d with the third column.
   pure subroutine three_sums(n, a, x, f, g, d)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, 3), x(n)
      real(wp), intent(out) :: f, g, d

      real(wp) :: first(block), second(block), third(block)
      integer :: i, j

      first = 0.0_wp
      second = 0.0_wp
      third = 0.0_wp
      do j = 0, n - block, block
         !$omp simd
         do i = 1, block
            first(i) = first(i) + a(j + i, 1)*x(j + i)
            second(i) = second(i) + a(j + i, 2)*x(j + i)
            third(i) = third(i) + a(j + i, 3)*x(j + i)
         end do
      end do
      f = (first(1) + first(3)) + (first(2) + first(4))
      g = (second(1) + second(3)) + (second(2) + second(4))
      d = (third(1) + third(3)) + (third(2) + third(4))
   end subroutine three_sums

end module razy_linalg_blocks
