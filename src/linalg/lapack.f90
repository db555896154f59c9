!! Explicit interfaces of the procedures of LAPACK, BLAS (netlib.org/lapack) and ARPACK (Lehoucq, Sorensen and Yang, ARPACK Users'
!! Guide, 1998) in use, double precision.
module razy_linalg_lapack
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: dgbmv, dgbtrf, dgbtrs, dgeev, dgejsv, dgemm, dgesv, dgesvd, dgetrf, dgetrs, dnaupd, dneupd, dpbtrf, dpbtrs, dposv, &
             dpotrf, dpotrs, dsaupd, dseupd, dsyev, dtbmv, dtbsv, dtrsm, zgbtrf, zgbtrs, zgesv, zheev

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

      !> Eigenvalues and eigenvectors of a Hermitian matrix.
      subroutine zheev(jobz, uplo, n, a, lda, w, work, lwork, rwork, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork
         complex(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: w(*), rwork(*)
         complex(wp), intent(out) :: work(*)
         integer, intent(out) :: info
      end subroutine zheev

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

      !> Singular values and vectors of a general matrix.
      subroutine dgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: jobu, jobvt
         integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
         integer, intent(out) :: info
      end subroutine dgesvd

      !> Solution of a linear system with several right-hand sides, which stay as they are where info > 0.
      subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgesv

      !> The same of a symmetric positive definite matrix.
      subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: info
      end subroutine dposv

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

      !> Triangular solve with several right-hand sides.
      subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(wp), intent(in) :: alpha, a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
      end subroutine dtrsm

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

      !> Singular values and vectors of a real matrix by Jacobi's method, each to its own rounding where columns are long and short.
      subroutine dgejsv(joba, jobu, jobv, jobr, jobt, jobp, m, n, a, lda, sva, u, ldu, v, ldv, work, lwork, iwork, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: joba, jobu, jobv, jobr, jobt, jobp
         integer, intent(in) :: m, n, lda, ldu, ldv, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: sva(*), u(ldu, *), v(ldv, *), work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dgejsv

      !> LU factors of a real banded matrix with row interchanges.
      subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: m, n, kl, ku, ldab
         real(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgbtrf

      !> Solution of linear systems with factors made by dgbtrf.
      subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb, ipiv(*)
         real(wp), intent(in) :: ab(ldab, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgbtrs

      !> LU factors of a complex banded matrix with row interchanges.
      subroutine zgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         implicit none(type, external)
         integer, intent(in) :: m, n, kl, ku, ldab
         complex(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgbtrf

      !> Solution of linear systems with factors made by zgbtrf.
      subroutine zgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb, ipiv(*)
         complex(wp), intent(in) :: ab(ldab, *)
         complex(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine zgbtrs

      !> alpha op(A) x + beta y becomes y, A in a band.
      subroutine dgbmv(trans, m, n, kl, ku, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: trans
         integer, intent(in) :: m, n, kl, ku, lda, incx, incy
         real(wp), intent(in) :: alpha, a(lda, *), x(*), beta
         real(wp), intent(inout) :: y(*)
      end subroutine dgbmv

      !> op(A) x becomes x, A in a triangular band.
      subroutine dtbmv(uplo, trans, diag, n, k, a, lda, x, incx)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo, trans, diag
         integer, intent(in) :: n, k, lda, incx
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: x(*)
      end subroutine dtbmv

      !> op(A)⁻¹ x becomes x, A in a triangular band.
      subroutine dtbsv(uplo, trans, diag, n, k, a, lda, x, incx)
         import :: wp
         implicit none(type, external)
         character, intent(in) :: uplo, trans, diag
         integer, intent(in) :: n, k, lda, incx
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: x(*)
      end subroutine dtbsv

      !> One step of the implicitly restarted Arnoldi method, by reverse communication.
      subroutine dnaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         implicit none(type, external)
         integer, intent(inout) :: ido, iparam(11), ipntr(14), info
         character, intent(in) :: bmat
         character(2), intent(in) :: which
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         real(wp), intent(inout) :: tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dnaupd

      !> Eigenvalues, and vectors or an invariant subspace, after dnaupd has converged.
      subroutine dneupd(rvec, howmny, select, dr, di, z, ldz, sigmar, sigmai, workev, bmat, n, which, nev, tol, resid, ncv, v, &
                        ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         implicit none(type, external)
         logical, intent(in) :: rvec
         character, intent(in) :: howmny, bmat
         character(2), intent(in) :: which
         integer, intent(in) :: ldz, n, nev, ncv, ldv, lworkl
         logical, intent(inout) :: select(*)
         real(wp), intent(in) :: sigmar, sigmai
         real(wp), intent(inout) :: tol, dr(*), di(*), z(ldz, *), workev(*), resid(*), v(ldv, *), workd(*), workl(*)
         integer, intent(inout) :: iparam(11), ipntr(14)
         integer, intent(inout) :: info
      end subroutine dneupd

      !> One step of the implicitly restarted Lanczos method, by reverse communication. A tolerance 0 becomes the rounding.
      subroutine dsaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: wp
         implicit none(type, external)
         integer, intent(inout) :: ido, iparam(11), ipntr(11), info
         character, intent(in) :: bmat
         character(2), intent(in) :: which
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         real(wp), intent(inout) :: tol, resid(*), v(ldv, *), workd(*), workl(*)
      end subroutine dsaupd

      !> Eigenvalues and vectors after dsaupd has converged.
      subroutine dseupd(rvec, howmny, select, d, z, ldz, sigma, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, &
                        ipntr, workd, workl, lworkl, info)
         import :: wp
         implicit none(type, external)
         logical, intent(in) :: rvec
         character, intent(in) :: howmny, bmat
         character(2), intent(in) :: which
         integer, intent(in) :: ldz, n, nev, ncv, ldv, lworkl
         logical, intent(inout) :: select(*)
         real(wp), intent(in) :: sigma
         real(wp), intent(inout) :: tol, d(*), z(ldz, *), resid(*), v(ldv, *), workd(*), workl(*)
         integer, intent(inout) :: iparam(11), ipntr(11)
         integer, intent(inout) :: info
      end subroutine dseupd
   end interface

end module razy_linalg_lapack
