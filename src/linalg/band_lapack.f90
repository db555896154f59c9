!! Explicit interfaces of LAPACK's procedures for banded matrices and the symmetric-definite eigenproblem, and of BLAS.
module razy_linalg_band_lapack
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: dgemm, dgemv, dpbtrf, dpbtrs, dsygvd, zgbsv

   interface
      !> y = alpha op(A) x + beta y.
      subroutine dgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         real(wp), intent(in) :: alpha, a(lda, *), x(*), beta
         real(wp), intent(inout) :: y(*)
      end subroutine dgemv

      !> C = alpha op(A) op(B) + beta C.
      subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: transa, transb
         integer, intent(in) :: m, n, k, lda, ldb, ldc
         real(wp), intent(in) :: alpha, a(lda, *), b(ldb, *), beta
         real(wp), intent(inout) :: c(ldc, *)
      end subroutine dgemm

      !> Cholesky factor of a symmetric positive definite banded matrix.
      subroutine dpbtrf(uplo, n, kd, ab, ldab, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, kd, ldab
         real(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: info
      end subroutine dpbtrf

      !> Solution with the factor of dpbtrf.
      subroutine dpbtrs(uplo, n, kd, nrhs, ab, ldab, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, kd, nrhs, ldab, ldb
         real(wp), intent(in) :: ab(ldab, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpbtrs

      !> All eigenvalues and eigenvectors of A x = lambda B x, A symmetric, B symmetric positive definite.
      subroutine dsygvd(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, iwork, liwork, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: itype, n, lda, ldb, lwork, liwork
         character, intent(in) :: jobz, uplo
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dsygvd

      !> Solution of a complex banded linear system.
      subroutine zgbsv(n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
         complex(wp), intent(inout) :: ab(ldab, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgbsv
   end interface

end module razy_linalg_band_lapack
