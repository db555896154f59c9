!! Sparse symmetric matrices as banded ones: a narrow order, and the Cholesky factor with its solutions.
!!
!! The order is Cuthill and McKee's (George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981):
!! breadth-first from a vertex at the rim, neighbours by degree. The reversed order has the same bandwidth.
module razy_linalg_banded
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: rising_order
   use razy_linalg_lapack, only: dpbtrf, dpbtrs
   use razy_linalg_sparse, only: csr_t
   implicit none(type, external)
   private

   public :: band_factor_t, bandwidth, narrow_order

   !> Cholesky factor L Lᵀ of a sparse symmetric positive definite matrix, rows and columns reordered.
   type :: band_factor_t
      private
      !> `order(new)` is the old index.
      integer, allocatable :: order(:)
      !> `band(1 + i - j, j)` is entry (i, j), i >= j.
      real(wp), allocatable :: band(:, :)
   contains
      procedure :: factor
      procedure :: solve
   end type band_factor_t

contains

   !> Factor a symmetric matrix. `info` is 0, or the step at which it was found not to be positive definite.
   subroutine factor(self, matrix, info)
      class(band_factor_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      integer, intent(out) :: info

      type(csr_t) :: ordered
      integer :: i, k

      self%order = narrow_order(matrix)
      ordered = matrix%extract(self%order)
      self%band = spread(spread(0.0_wp, 1, bandwidth(ordered) + 1), 2, ordered%rows)
      do i = 1, ordered%rows
         do k = ordered%start(i), ordered%start(i + 1) - 1
            associate (j => ordered%column(k))
               if (i >= j) self%band(1 + i - j, j) = ordered%value(k)
            end associate
         end do
      end do
      info = 0
      associate (n => matrix%rows, height => size(self%band, 1))
         if (n > 0) call dpbtrf("L", n, height - 1, self%band, height, info)
      end associate
   end subroutine factor

   !> x = A⁻¹ b with `b` (n).
   function solve(self, b) result(x)
      class(band_factor_t), intent(in) :: self
      real(wp), intent(in) :: b(:)
      real(wp), allocatable :: x(:)

      real(wp), allocatable :: column(:, :)
      integer :: info

      allocate (x(size(b)))
      column = reshape(b(self%order), [size(b), 1])
      ! info reports arguments that are wrong, which these are not
      associate (n => size(b), height => size(self%band, 1))
         if (n > 0) call dpbtrs("L", n, height - 1, 1, self%band, height, column, n, info)
      end associate
      x(self%order) = column(:, 1)
   end function solve

   !> An order (n) of the rows and columns: `order(new)` is the old index. `matrix` is symmetric in its pattern.
   pure function narrow_order(matrix) result(order)
      type(csr_t), intent(in) :: matrix
      integer, allocatable :: order(:)

      logical, allocatable :: numbered(:)
      integer :: count, levels, found, old_levels, root, seed

      allocate (order(matrix%rows))
      allocate (numbered(matrix%rows), source=.false.)
      count = 0
      do seed = 1, matrix%rows
         if (numbered(seed)) cycle
         root = seed
         old_levels = -1
         do
            call number_component(matrix, root, numbered, order(count + 1:), found, levels)
            if (levels <= old_levels) exit
            ! The last vertex found is far from the root: try it as the root, while that makes the levels more.
            old_levels = levels
            numbered(order(count + 1:count + found)) = .false.
            root = order(count + found)
         end do
         count = count + found
      end do
   end function narrow_order

   !> Number the component of `root`; `found` vertices in `levels` levels go to the head of `order`.
   pure subroutine number_component(matrix, root, numbered, order, found, levels)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: root
      logical, intent(inout) :: numbered(:)
      integer, intent(inout) :: order(:)
      integer, intent(out) :: found, levels

      integer, allocatable :: near(:)
      integer :: j, level_end

      order(1) = root
      numbered(root) = .true.
      found = 1
      levels = 0
      level_end = 1
      j = 1
      do while (j <= found)
         associate (columns => matrix%column(matrix%start(order(j)):matrix%start(order(j) + 1) - 1))
            near = pack(columns,.not. numbered(columns))
         end associate
         numbered(near) = .true.
         order(found + 1:found + size(near)) = near(rising_order(real(matrix%start(near + 1) - matrix%start(near), wp)))
         found = found + size(near)
         if (j == level_end) then
            levels = levels + 1
            level_end = found
         end if
         j = j + 1
      end do
   end subroutine number_component

   !> Largest distance of an entry from the diagonal.
   pure function bandwidth(matrix) result(width)
      type(csr_t), intent(in) :: matrix
      integer :: width

      integer :: i

      width = 0
      do i = 1, matrix%rows
         associate (columns => matrix%column(matrix%start(i):matrix%start(i + 1) - 1))
            width = max(width, maxval(abs(columns - i)))
         end associate
      end do
   end function bandwidth

end module razy_linalg_banded
