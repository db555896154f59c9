!! Explicit interfaces of the LAPACK procedures in use (netlib.org/lapack), double precision.
module razy_linalg_lapack
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: dgeev, dgetrf, dgetrs, dposv, dpotrf, dpotrs, dsyev, dtrsm, zgesv, zgetrf, zgetrs

   interface
      !> Eigenvalues and eigenvectors of a real symmetric matrix.
      subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsyev

      !> Eigenvalues and eigenvectors of a general real matrix.
      subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldvl, ldvr, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dgeev

      !> Triangular factors of a general matrix.
      subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: m, n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgetrf

      !> Solution of linear systems with factors made by dgetrf.
      subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs

      !> Solution of a symmetric positive definite system with several right-hand sides.
      subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: info
      end subroutine dposv

      !> Cholesky factor of a symmetric positive definite matrix.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf

      !> Solve A x = b (b becomes x) from the factor of dpotrf.
      subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpotrs

      !> Solution of a complex linear system with several right-hand sides.
      subroutine zgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: n, nrhs, lda, ldb
         complex(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgesv

      !> LU factors of a complex matrix with row interchanges.
      subroutine zgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: m, n, lda
         complex(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgetrf

      !> Solution of complex linear systems with factors made by zgetrf.
      subroutine zgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
         complex(wp), intent(in) :: a(lda, *)
         complex(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine zgetrs

      !> Triangular solve with several right-hand sides.
      subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(wp), intent(in) :: alpha, a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
      end subroutine dtrsm
   end interface

end module razy_linalg_lapack
