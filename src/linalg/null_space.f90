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

   public :: complement_of, intersection_of, null_space, rank_bound

   !> A stretch below it is rounding: products of a few ratios and sums over a loop of elements err by some units of rounding each.
   real(wp), parameter :: rank_bound = 1.0e-12_wp

contains

   !> An orthonormal `basis` (n, r) of the x with rowsᵀ x = 0 for the columns of `rows` (n, k), which are brought to unit length;
   !> columns of zeros are no rows. `info` is LAPACK's: 0 is success, else there are none in it.
   subroutine null_space(rows, basis, info)
      real(wp), intent(in) :: rows(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: length(:)
      integer :: i

      length = norm2(rows, dim=1)
      associate (given => pack([(i, i=1, size(length))], length > 0.0_wp))
         call kernel_of(rows(:, given)/spread(length(given), 1, size(rows, 1)), basis, info)
      end associate
   end subroutine null_space

   !> An orthonormal basis (n, r) of the x with aᵀ x = 0, for `a` (n, k) whose entries are of the size of 1, or 0 to rounding.
   subroutine kernel_of(a, basis, info)
      real(wp), intent(in) :: a(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: copy(:, :), u(:, :), value(:), work(:)
      real(wp) :: unused(1, 1)
      integer :: k, n

      n = size(a, 1)
      k = size(a, 2)
      info = 0
      if (n == 0 .or. k == 0) then
         basis = identity(n)
         return
      end if
      copy = a
      allocate (u(n, n), value(min(n, k)), work(8*max(n, k)))
      call dgesvd("A", "N", n, k, copy, n, value, u, n, unused, 1, work, size(work), info)
      basis = u(:, count(value > rank_bound) + 1:)
      if (info /= 0) basis = basis(:, :0)
   end subroutine kernel_of

   !> An orthonormal basis (n, r) of what lies in the spans of `a` (n, p) and of `b` (n, q), whose columns are orthonormal.
   subroutine intersection_of(a, b, basis, info)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: within(:, :)

      call kernel_of(transpose(a - matmul(b, matmul(transpose(b), a))), within, info)
      basis = matmul(a, within)
   end subroutine intersection_of

   !> An orthonormal basis (n, n - r) of what is orthogonal to the orthonormal columns of `basis` (n, r): the last columns of
   !> Householder's reflections that take these to the first unit vectors.
   pure function complement_of(basis) result(rest)
      real(wp), intent(in) :: basis(:, :)
      real(wp) :: rest(size(basis, 1), size(basis, 1) - size(basis, 2))

      real(wp) :: left(size(basis, 1), size(basis, 2)), mirror(size(basis, 1), size(basis, 2)), twice(size(basis, 2))
      integer :: i, j, r

      r = size(basis, 2)
      left = basis
      mirror = 0.0_wp
      do i = 1, r
         mirror(i:, i) = left(i:, i)
         mirror(i, i) = mirror(i, i) + sign(norm2(left(i:, i)), left(i, i))
         ! Not normalised, so that unit vectors stay what they are.
         twice(i) = 2/dot_product(mirror(:, i), mirror(:, i))
         do j = i, r
            left(:, j) = left(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), left(:, j)))
         end do
      end do
      rest = 0.0_wp
      do j = 1, size(rest, 2)
         rest(r + j, j) = 1.0_wp
         do i = r, 1, -1
            rest(:, j) = rest(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), rest(:, j)))
         end do
      end do
   end function complement_of

end module razy_linalg_null_space
