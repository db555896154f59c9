!! Square matrices: a linear system, the determinant, and the row that makes a matrix square.
module razy_linalg_square
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgesv, dgetrf
   implicit none(type, external)
   private

   public :: bordered, determinant, solve_square

contains

   !> A matrix with one row more.
   pure function bordered(matrix, row) result(square)
      real(wp), intent(in) :: matrix(:, :), row(:)
      real(wp) :: square(size(row), size(row))

      square(:size(row) - 1, :) = matrix
      square(size(row), :) = row
   end function bordered

   !> Solve A x = b in place.
   subroutine solve_square(matrix, b, ok)
      real(wp), intent(inout) :: matrix(:, :), b(:)
      logical, intent(out) :: ok

      integer :: info, pivot(size(b))

      call dgesv(size(b), 1, matrix, size(b), pivot, b, size(b), info)
      ok = info == 0
   end subroutine solve_square

   !> Determinant of a matrix, which is overwritten.
   real(wp) function determinant(matrix)
      real(wp), intent(inout) :: matrix(:, :)

      integer :: i, info, pivot(size(matrix, 1))

      call dgetrf(size(pivot), size(pivot), matrix, size(pivot), pivot, info)
      determinant = 1.0_wp
      do i = 1, size(pivot)
         determinant = determinant*merge(matrix(i, i), -matrix(i, i), pivot(i) == i)
      end do
   end function determinant

end module razy_linalg_square
