!! Eigenvalues and right eigenvectors of a general real matrix, or the values alone, without what `eigen` adds to judge them.
module razy_linalg_right_eigen
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgeev
   implicit none(type, external)
   private

   public :: right_eigen, right_eigenvalues

contains

   !> `matrix` (n, n) is overwritten; `values` (n); `vectors` (n, n) of unit length; conjugate pairs stand together, the one with
   !> positive imaginary part first. `info` is LAPACK's: 0 is success.
   subroutine right_eigen(matrix, values, vectors, info)
      real(wp), intent(inout) :: matrix(:, :)
      complex(wp), intent(out) :: values(:), vectors(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: right(:, :), wi(:), work(:), wr(:)
      real(wp) :: none(1, 1)
      logical :: halting(size(ieee_all))
      integer :: j, n

      n = size(values)
      info = 0
      if (n == 0) return
      allocate (wr(n), wi(n), right(n, n), work(34*n))
      ! Vectors of a defective matrix overflow inside LAPACK by design.
      call ieee_get_halting_mode(ieee_all, halting)
      call ieee_set_halting_mode(ieee_all, .false.)
      call dgeev("N", "V", n, matrix, n, wr, wi, none, 1, right, n, work, size(work), info)
      call ieee_set_halting_mode(ieee_all, halting)
      if (info /= 0) return
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
   end subroutine right_eigen

   !> The eigenvalues alone (n), in a third of the time; `matrix` (n, n) is overwritten, `info` is LAPACK's.
   subroutine right_eigenvalues(matrix, values, info)
      real(wp), intent(inout) :: matrix(:, :)
      complex(wp), intent(out) :: values(:)
      integer, intent(out) :: info

      real(wp), allocatable :: wi(:), work(:), wr(:)
      real(wp) :: no_left(1, 1), no_right(1, 1)
      integer :: n

      n = size(values)
      info = 0
      if (n == 0) return
      allocate (wr(n), wi(n), work(34*n))
      call dgeev("N", "N", n, matrix, n, wr, wi, no_left, 1, no_right, 1, work, size(work), info)
      if (info == 0) values = cmplx(wr, wi, wp)
   end subroutine right_eigenvalues

end module razy_linalg_right_eigen
