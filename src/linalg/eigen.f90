!! Eigenvalue problems of small dense matrices, by LAPACK.
module razy_linalg_eigen
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use razy_core_kinds, only: qp, wp
   use razy_linalg_dense, only: identity, rising_order
   use razy_linalg_lapack, only: dgeev, dgetrf, dgetrs, dsyev
   use razy_linalg_pattern, only: connected_sets
   implicit none(type, external)
   private

   public :: general_eigen, refine_eigen, right_eigen, symmetric_eigen

   !> Rounds of `refine_eigen`; a correction whose square is below the rounding of eigenvalues 1e-16 of the largest is the last.
   !> Squares are compared: not every compiler has moduli in extended precision.
   integer, parameter :: rounds = 8
   real(qp), parameter :: small = 1.0e-17_qp**2
   !> A first correction larger than this belongs to vectors that were not those of the matrix.
   real(qp), parameter :: large = 0.1_qp**2

contains

   !> Eigenvalues (ascending) and orthonormal eigenvectors of a symmetric matrix. What no entry couples is solved apart, so that
   !> rounding couples it neither.
   !>
   !> `matrix` (n, n): on return its columns are the eigenvectors. `values` (n). `info` is LAPACK's: 0 is success.
   subroutine symmetric_eigen(matrix, values, info)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(out) :: values(:)
      integer, intent(out) :: info

      real(wp) :: found(size(values)), work(34*size(values))
      real(wp), allocatable :: part(:, :), vectors(:, :)
      integer, allocatable :: members(:)
      integer :: i, k, n, set(size(values))

      info = 0
      set = connected_sets(abs(matrix) > 0.0_wp)
      allocate (vectors(size(set), size(set)), source=0.0_wp)
      do k = 1, maxval(set)
         members = pack([(i, i=1, size(set))], set == k)
         n = size(members)
         part = matrix(members, members)
         call dsyev("V", "U", n, part, n, found(:n), work, size(work), info)
         if (info /= 0) return
         vectors(members, members) = part
         values(members) = found(:n)
      end do
      associate (order => rising_order(values))
         values = values(order)
         matrix = vectors(:, order)
      end associate
   end subroutine symmetric_eigen

   !> Eigenvalues `values` (n) and right eigenvectors of a general real matrix, or the values alone, in a third of the time. What no
   !> entry couples is solved apart, so that rounding couples it neither.
   !>
   !> `vectors` (n, n) and, only with them, left eigenvectors `left` (n, n), uᴴ A = λ uᴴ, have unit length. Conjugate pairs stand
   !> together, the one with positive imaginary part first. `info` is LAPACK's: 0 is success.
   subroutine right_eigen(matrix, values, info, vectors, left)
      real(wp), intent(in) :: matrix(:, :)
      complex(wp), intent(out) :: values(:)
      integer, intent(out) :: info
      complex(wp), intent(out), optional :: vectors(:, :), left(:, :)

      complex(wp), allocatable :: other(:, :), right(:, :)
      integer, allocatable :: members(:)
      integer :: first, i, k, set(size(values))

      info = 0
      set = connected_sets(abs(matrix) > 0.0_wp)
      if (present(vectors)) vectors = (0.0_wp, 0.0_wp)
      if (present(left)) left = (0.0_wp, 0.0_wp)
      first = 1
      do k = 1, maxval(set)
         members = pack([(i, i=1, size(set))], set == k)
         associate (last => first + size(members) - 1)
            call connected_eigen(matrix(members, members), values(first:last), right, other, present(vectors), present(left), info)
            if (info /= 0) return
            if (present(vectors)) vectors(members, first:last) = right
            if (present(left)) left(members, first:last) = other
         end associate
         first = first + size(members)
      end do
   end subroutine right_eigen

   !> The same of a matrix whose rows and columns are all coupled, by LAPACK; vectors if they are asked for.
   subroutine connected_eigen(matrix, values, right, left, asks_right, asks_left, info)
      real(wp), intent(in) :: matrix(:, :)
      complex(wp), intent(out) :: values(:)
      complex(wp), allocatable, intent(out) :: right(:, :), left(:, :)
      logical, intent(in) :: asks_right, asks_left
      integer, intent(out) :: info

      real(wp), allocatable :: a(:, :), u(:, :), v(:, :), wi(:), work(:), wr(:)
      logical :: halting(size(ieee_all))
      integer :: n

      n = size(values)
      a = matrix
      allocate (wr(n), wi(n), work(34*n), v(n, merge(n, 1, asks_right)), u(n, merge(n, 1, asks_left)))
      ! Vectors of a defective matrix overflow inside LAPACK by design.
      call ieee_get_halting_mode(ieee_all, halting)
      call ieee_set_halting_mode(ieee_all, .false.)
      call dgeev(merge("V", "N", asks_left), merge("V", "N", asks_right), n, a, n, wr, wi, u, n, v, n, work, size(work), info)
      call ieee_set_halting_mode(ieee_all, halting)
      values = cmplx(wr, wi, wp)
      if (info == 0 .and. asks_right) right = unpacked(v, wi)
      if (info == 0 .and. asks_left) left = unpacked(u, wi)
   end subroutine connected_eigen

   !> Complex vectors (n, n) from LAPACK's columns: of a pair, real parts in the first, imaginary ones in the second.
   pure function unpacked(columns, imaginary) result(vectors)
      real(wp), intent(in) :: columns(:, :), imaginary(:)
      complex(wp) :: vectors(size(imaginary), size(imaginary))

      integer :: j

      do j = 1, size(imaginary)
         if (imaginary(j) > 0.0_wp) then
            vectors(:, j) = cmplx(columns(:, j), columns(:, j + 1), wp)
         else if (imaginary(j) < 0.0_wp) then
            vectors(:, j) = conjg(vectors(:, j - 1))
         else
            vectors(:, j) = cmplx(columns(:, j), 0.0_wp, wp)
         end if
      end do
   end function unpacked

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

      real(wp), allocatable :: factor(:, :), rows(:, :)
      integer :: j, n, pivot(size(values))
      logical :: halting(size(ieee_all))

      n = size(values)
      condition = huge(1.0_wp)
      call right_eigen(matrix, values, info, vectors)
      if (info /= 0) return
      ! Vectors of a defective matrix have no inverse: the condition says so.
      call ieee_get_halting_mode(ieee_all, halting)
      call ieee_set_halting_mode(ieee_all, .false.)
      ! Of a pair the real part stands in one column, the imaginary one in the next: inverting a real matrix takes a quarter.
      factor = merge(-aimag(vectors), real(vectors), spread(aimag(values) < 0.0_wp, 1, n))
      rows = identity(n)
      call dgetrf(n, n, factor, n, pivot, info)
      if (info == 0) call dgetrs("N", n, n, factor, n, pivot, rows, n, info)
      inverse = cmplx(rows, kind=wp)
      do j = 1, n
         if (aimag(values(j)) > 0.0_wp) inverse(j, :) = 0.5_wp*cmplx(rows(j, :), -rows(j + 1, :), wp)
         if (aimag(values(j)) < 0.0_wp) inverse(j, :) = conjg(inverse(j - 1, :))
      end do
      if (info == 0) condition = sqrt(maxval(sum(vectors%re**2 + vectors%im**2, dim=1) &
                                             *sum(inverse%re**2 + inverse%im**2, dim=2)))
      if (.not. condition <= huge(1.0_wp)) condition = huge(1.0_wp)
      call ieee_set_halting_mode(ieee_all, halting)
   end subroutine general_eigen

   !> Refine what `general_eigen` gives of `matrix` (n, n), so that each of `values` (n) errs by its own rounding, not by that
   !> of the largest. What is real stays real. All are as they were if not `converged`.
   !>
   !> With X, the eigenvectors, and Y = X⁻¹ from Newton's iteration Y(2I - XY) the matrix Y A X is nearly diagonal, its diagonal the
   !> eigenvalues, and X(I + E), E_ij = (Y A X)_ij/(λ_j - λ_i), errs by the square of the error of X. The products are formed in
   !> extended precision.
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
         lambda = [(e(i, i), i=1, n)]
         do j = 1, n
            do i = 1, n
               gap = lambda(j) - lambda(i)
               if (i == j) then
                  e(i, j) = (0.0_qp, 0.0_qp)
               else if (real(e(i, j)*conjg(e(i, j))) < large*real(gap*conjg(gap))) then
                  e(i, j) = e(i, j)/gap
               else
                  return
               end if
            end do
         end do
         converged = maxval(real(e*conjg(e))) <= small
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

end module razy_linalg_eigen
