!! Explicit interfaces of the ARPACK procedures in use (Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998).
module razy_linalg_arpack
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: dsaupd, dseupd

   interface
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

end module razy_linalg_arpack
