!! Motions that stretch no element: the null space of the directions in which elements act.
!!
!! A motion x is rigid if every row w of the elements, as the user wrote them, has wᵀ x = 0. Rows have unit size, so that a stretch
!! is of the size of 1, or 0 up to rounding and to that of the geometry: singular values below `rank_bound` count as 0.
module razy_linalg_null_space
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: identity
   use razy_linalg_lapack, only: dgesvd
   implicit none(type, external)
   private

   public :: null_space, rank_bound

   !> A stretch below it is rounding: products of a few ratios and sums over a loop of elements err by some units of rounding each.
   real(wp), parameter :: rank_bound = 1.0e-12_wp

contains

   !> An orthonormal `basis` (n, r) of the x with rowsᵀ x = 0 for the columns of `rows` (n, k), which are brought to unit length;
   !> columns of zeros are no rows. `info` is LAPACK's: 0 is success.
   subroutine null_space(rows, basis, info)
      real(wp), intent(in) :: rows(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: a(:, :), u(:, :), value(:), work(:)
      real(wp) :: unused(1, 1), length(size(rows, 2))
      integer :: i, k, n, rank

      n = size(rows, 1)
      info = 0
      length = norm2(rows, dim=1)
      k = count(length > 0.0_wp)
      if (n == 0 .or. k == 0) then
         basis = identity(n)
         return
      end if
      a = rows(:, pack([(i, i=1, size(length))], length > 0.0_wp))/spread(pack(length, length > 0.0_wp), 1, n)
      allocate (u(n, n), value(min(n, k)), work(8*max(n, k)))
      call dgesvd("A", "N", n, k, a, n, value, u, n, unused, 1, work, size(work), info)
      rank = count(value > rank_bound)
      basis = u(:, rank + 1:)
   end subroutine null_space

end module razy_linalg_null_space
