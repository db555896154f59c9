!! Random matrices and linear equations for the tests of complementarity problems.
module complementarity_samples
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: random_matrix, random_numbers, solve_linear

contains

   !> Numbers evenly spread over (0, 1) from `seed`, the same everywhere (Park and Miller's generator).
   subroutine random_numbers(seed, x)
      integer, intent(inout) :: seed
      real(wp), intent(out) :: x(:)

      integer :: i

      do i = 1, size(x)
         seed = 48271*modulo(seed, 44488) - 3399*(seed/44488)
         if (seed <= 0) seed = seed + huge(seed)
         x(i) = real(seed, wp)/huge(seed)
      end do
   end subroutine random_numbers

   !> Entries evenly spread over (-1, 1).
   subroutine random_matrix(seed, matrix)
      integer, intent(inout) :: seed
      real(wp), intent(out) :: matrix(:, :)

      integer :: j

      do j = 1, size(matrix, 2)
         call random_numbers(seed, matrix(:, j))
      end do
      matrix = 2*matrix - 1
   end subroutine random_matrix

   !> Solution of linear equations by Gauss's elimination with the largest pivot of the column.
   function solve_linear(matrix, right) result(x)
      real(wp), intent(in) :: matrix(:, :), right(:)
      real(wp) :: x(size(right))

      real(wp) :: a(size(right), size(right) + 1), row(size(right) + 1)
      integer :: i, k, n

      n = size(right)
      a(:, :n) = matrix
      a(:, n + 1) = right
      do k = 1, n
         i = k - 1 + maxloc(abs(a(k:, k)), dim=1)
         row = a(i, :)
         a(i, :) = a(k, :)
         a(k, :) = row
         do i = k + 1, n
            a(i, :) = a(i, :) - a(i, k)/a(k, k)*a(k, :)
         end do
      end do
      do k = n, 1, -1
         x(k) = (a(k, n + 1) - dot_product(a(k, k + 1:n), x(k + 1:)))/a(k, k)
      end do
   end function solve_linear

end module complementarity_samples
