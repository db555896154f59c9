!! Eigenvalue problems of small dense matrices, by LAPACK.
module razy_linalg_eigen
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgeev, dsyev, zgesv
   implicit none(type, external)
   private

   public :: general_eigen, symmetric_eigen

contains

   !> Eigenvalues (ascending) and orthonormal eigenvectors of a symmetric matrix.
   !>
   !> `matrix` (n, n): on return its columns are the eigenvectors. `values` (n). `info` is LAPACK's: 0 is success.
   subroutine symmetric_eigen(matrix, values, info)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(out) :: values(:)
      integer, intent(out) :: info

      real(wp), allocatable :: work(:)
      integer :: n

      info = 0
      n = size(values)
      if (n == 0) return
      allocate (work(34*n))
      call dsyev("V", "U", n, matrix, n, values, work, size(work), info)
   end subroutine symmetric_eigen

   !> Eigenvalues, eigenvectors and inverse eigenvector matrix of a general real matrix.
   !>
   !> `matrix` (n, n); `values` (n); `vectors` (n, n) of unit length in its columns; `inverse` (n, n) its inverse, with
   !> the left eigenvectors in its rows; `condition` is the largest of the eigenvalues' condition numbers, 1 for a normal
   !> matrix. A matrix without n independent eigenvectors gives info /= 0 or an enormous condition.
   subroutine general_eigen(matrix, values, vectors, inverse, condition, info)
      real(wp), intent(in) :: matrix(:, :)
      complex(wp), intent(out) :: values(:), vectors(:, :), inverse(:, :)
      real(wp), intent(out) :: condition
      integer, intent(out) :: info

      real(wp), allocatable :: copy(:, :), wr(:), wi(:), right(:, :), work(:)
      complex(wp), allocatable :: factor(:, :)
      integer, allocatable :: pivot(:)
      real(wp) :: none(1, 1)
      logical :: halting(size(ieee_all))
      integer :: i, j, n

      n = size(values)
      condition = huge(1.0_wp)
      allocate (wr(n), wi(n), right(n, n), work(34*n), pivot(n))
      copy = matrix
      ! Eigenvectors of a defective matrix overflow inside LAPACK by design; its answer is judged by the condition.
      call ieee_get_halting_mode(ieee_all, halting)
      call ieee_set_halting_mode(ieee_all, .false.)
      call dgeev("N", "V", n, copy, n, wr, wi, none, 1, right, n, work, size(work), info)
      if (info == 0) then
         do j = 1, n
            values(j) = cmplx(wr(j), wi(j), wp)
            if (wi(j) > 0.0_wp) then
               vectors(:, j) = cmplx(right(:, j), right(:, j + 1), wp)
            else if (wi(j) < 0.0_wp) then
               vectors(:, j) = conjg(vectors(:, j - 1))
            else
               vectors(:, j) = cmplx(right(:, j), 0.0_wp, wp)
            end if
         end do
         factor = vectors
         inverse = (0.0_wp, 0.0_wp)
         do i = 1, n
            inverse(i, i) = (1.0_wp, 0.0_wp)
         end do
         call zgesv(n, n, factor, n, pivot, inverse, n, info)
         if (info == 0) condition = maxval(norm2(abs(vectors), dim=1)*norm2(abs(inverse), dim=2))
         if (.not. condition <= huge(1.0_wp)) condition = huge(1.0_wp)
      end if
      call ieee_set_halting_mode(ieee_all, halting)
   end subroutine general_eigen

end module razy_linalg_eigen
