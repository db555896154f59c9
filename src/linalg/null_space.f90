!! Motions that stretch no element: the null space of the directions in which elements act.
!!
!! A motion x is rigid if every row w of the elements, as the user wrote them, has wᵀ x = 0. Rows have unit size, so that a stretch
!! is of the size of 1, or 0 up to rounding and to that of the geometry: singular values below `rank_bound` count as 0.
module razy_linalg_null_space
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: identity
   use razy_linalg_lapack, only: dgesvd
   use razy_linalg_pattern, only: connected_sets
   implicit none(type, external)
   private

   public :: complement_of, intersection_of, kernel_of, null_space, rank_bound

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
   !> Coordinates that no column couples have no motion in common.
   subroutine kernel_of(a, basis, info)
      real(wp), intent(in) :: a(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: info

      real(wp), allocatable :: copy(:, :), u(:, :), value(:), work(:)
      integer, allocatable :: members(:)
      real(wp) :: unused(1, 1)
      integer :: i, k, n, r, s, set(size(a, 1))

      k = size(a, 2)
      info = 0
      basis = identity(size(a, 1))
      if (size(a) == 0) return
      basis = 0.0_wp
      allocate (value(min(size(a, 1), k)), work(8*max(size(a, 1), k)))
      set = connected_sets(matmul(abs(a), transpose(abs(a))) > 0.0_wp)
      r = 0
      do s = 1, maxval(set)
         members = pack([(i, i=1, size(set))], set == s)
         n = size(members)
         copy = a(members, :)
         u = identity(n)
         call dgesvd("A", "N", n, k, copy, n, value, u, n, unused, 1, work, size(work), info)
         if (info /= 0) exit
         n = n - count(value(:min(n, k)) > rank_bound)
         basis(members, r + 1:r + n) = u(:, size(u, 2) - n + 1:)
         r = r + n
      end do
      basis = basis(:, :merge(r, 0, info == 0))
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
   !> Householder's reflections that take each of these to the unit vector of its largest entry that is left: what has no coordinate
   !> in common has none in the rest.
   pure function complement_of(basis) result(rest)
      real(wp), intent(in) :: basis(:, :)
      real(wp) :: rest(size(basis, 1), size(basis, 1) - size(basis, 2))

      real(wp) :: left(size(basis, 1), size(basis, 2)), mirror(size(basis, 1), size(basis, 2)), twice(size(basis, 2))
      integer :: at, i, j, k
      logical :: spare(size(basis, 1))

      if (size(rest) == 0) return
      left = basis
      spare = .true.
      do i = 1, size(basis, 2)
         mirror(:, i) = merge(left(:, i), 0.0_wp, spare)
         at = maxloc(abs(mirror(:, i)), 1, spare)
         mirror(at, i) = mirror(at, i) + sign(norm2(mirror(:, i)), mirror(at, i))
         spare(at) = .false.
         ! Not normalised, so that unit vectors stay what they are.
         twice(i) = 2/dot_product(mirror(:, i), mirror(:, i))
         do j = i, size(basis, 2)
            left(:, j) = left(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), left(:, j)))
         end do
      end do
      rest = 0.0_wp
      k = 0
      do j = 1, size(spare)
         if (.not. spare(j)) cycle
         k = k + 1
         rest(j, k) = 1.0_wp
         do i = size(basis, 2), 1, -1
            rest(:, k) = rest(:, k) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), rest(:, k)))
         end do
      end do
   end function complement_of

end module razy_linalg_null_space
