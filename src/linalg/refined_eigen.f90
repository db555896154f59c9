!! Eigenvalues of small general matrices to their own rounding, however far they are apart.
!!
!! LAPACK's eigenvalues err by the rounding of the largest one. With X, its eigenvectors, and Y = X⁻¹ from Newton's iteration
!! Y(2I - XY) the matrix Y A X is nearly diagonal, its diagonal the eigenvalues, and X(I + E), E_ij = (Y A X)_ij/(λ_j - λ_i), errs
!! by the square of the error of X. The products are formed in extended precision.
module razy_linalg_refined_eigen
   use razy_core_kinds, only: qp, wp
   implicit none(type, external)
   private

   public :: refine_eigen

   !> Rounds of the iteration; a correction whose square is below the rounding of eigenvalues 1e-16 of the largest is the last.
   integer, parameter :: rounds = 8
   real(qp), parameter :: small = 1.0e-17_qp
   !> A first correction larger than this belongs to vectors that were not those of the matrix.
   real(qp), parameter :: large = 0.1_qp

contains

   !> Refine what LAPACK gives of `matrix` (n, n): `values` (n), `vectors` and `inverse` (n, n) as in general_eigen; what is real
   !> stays real. All are as they were if not `converged`.
   pure subroutine refine_eigen(matrix, values, vectors, inverse, converged)
      real(qp), intent(in) :: matrix(:, :)
      complex(wp), intent(inout) :: values(:), vectors(:, :), inverse(:, :)
      logical, intent(out) :: converged

      complex(qp), dimension(size(values), size(values)) :: a, e, x, y
      complex(qp) :: lambda(size(values)), gap
      integer :: i, j, n, round

      n = size(values)
      a = cmplx(matrix, kind=qp)
      x = cmplx(vectors, kind=qp)
      y = cmplx(inverse, kind=qp)
      converged = .false.
      do round = 1, rounds
         y = 2*y - matmul(y, matmul(x, y))
         y = 2*y - matmul(y, matmul(x, y))
         e = matmul(y, matmul(a, x))
         do i = 1, n
            lambda(i) = e(i, i)
         end do
         do j = 1, n
            do i = 1, n
               gap = lambda(j) - lambda(i)
               if (i == j) then
                  e(i, j) = (0.0_qp, 0.0_qp)
               else if (abs(e(i, j)) < large*abs(gap)) then
                  e(i, j) = e(i, j)/gap
               else
                  return
               end if
            end do
         end do
         converged = maxval(abs(e)) <= small
         x = x + matmul(x, e)
         y = y - matmul(e, y)
         do i = 1, n
            if (abs(aimag(values(i))) > 0.0_wp) cycle
            lambda(i) = real(lambda(i))
            x(:, i) = real(x(:, i))
            y(i, :) = real(y(i, :))
         end do
         if (converged) exit
      end do
      if (.not. converged) return
      values = cmplx(lambda, kind=wp)
      ! The entries of the matrix are rounded: a real part below that of an imaginary one is neither growth nor decay.
      where (abs(real(values)) <= epsilon(1.0_wp)*abs(aimag(values))) values = cmplx(0.0_wp, aimag(values), wp)
      vectors = cmplx(x, kind=wp)
      inverse = cmplx(y, kind=wp)
   end subroutine refine_eigen

end module razy_linalg_refined_eigen
