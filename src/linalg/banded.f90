!! Symmetric banded matrices in a narrow order: Cholesky factor, solutions, number of negative eigenvalues.
module razy_linalg_banded
   use razy_core_kinds, only: wp
   use razy_linalg_band_lapack, only: dpbtrf, dpbtrs
   use razy_linalg_ordering, only: bandwidth, narrow_order
   use razy_linalg_sparse, only: csr_t
   implicit none(type, external)
   private

   public :: band_factor_t, negative_eigenvalues

   !> Cholesky factor L Lᵀ of a sparse symmetric positive definite matrix, rows and columns reordered.
   type :: band_factor_t
      integer :: n = 0, width = 0
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

      call to_band(matrix, self%order, self%width, self%band)
      self%n = matrix%rows
      info = 0
      if (self%n > 0) call dpbtrf("L", self%n, self%width, self%band, self%width + 1, info)
   end subroutine factor

   !> x = A⁻¹ b with `b` (n).
   function solve(self, b) result(x)
      class(band_factor_t), intent(in) :: self
      real(wp), intent(in) :: b(:)
      real(wp), allocatable :: x(:)

      real(wp), allocatable :: column(:, :)
      integer :: i, info

      allocate (column(self%n, 1), x(self%n))
      do i = 1, self%n
         column(i, 1) = b(self%order(i))
      end do
      ! info reports arguments that are wrong, which these are not
      if (self%n > 0) call dpbtrs("L", self%n, self%width, 1, self%band, self%width + 1, column, self%n, info)
      do i = 1, self%n
         x(self%order(i)) = column(i, 1)
      end do
   end function solve

   !> Number of negative eigenvalues, by the signs of D in L D Lᵀ without pivoting (Sylvester's law of inertia). A pivot
   !> that vanishes is replaced by a rounding of the largest entry, which moves eigenvalues by no more than that.
   function negative_eigenvalues(matrix) result(count)
      type(csr_t), intent(in) :: matrix
      integer :: count

      real(wp), allocatable :: band(:, :)
      real(wp) :: pivot, ratio, tiny_pivot
      integer, allocatable :: order(:)
      integer :: i, j, last, width

      call to_band(matrix, order, width, band)
      count = 0
      if (matrix%rows == 0) return
      tiny_pivot = epsilon(1.0_wp)*maxval(abs(band))
      do j = 1, matrix%rows
         pivot = band(1, j)
         if (abs(pivot) < tiny_pivot) pivot = tiny_pivot
         if (pivot < 0.0_wp) count = count + 1
         last = min(width, matrix%rows - j)
         do i = 1, last
            ratio = band(1 + i, j)/pivot
            if (.not. abs(ratio) > 0.0_wp) cycle
            band(1:1 + last - i, j + i) = band(1:1 + last - i, j + i) - ratio*band(1 + i:1 + last, j)
         end do
      end do
   end function negative_eigenvalues

   !> The lower band of a symmetric matrix in a narrow order.
   subroutine to_band(matrix, order, width, band)
      type(csr_t), intent(in) :: matrix
      integer, allocatable, intent(out) :: order(:)
      integer, intent(out) :: width
      real(wp), allocatable, intent(out) :: band(:, :)

      integer, allocatable :: place(:)
      integer :: i, j, k, row

      allocate (order(matrix%rows), place(matrix%rows))
      order = narrow_order(matrix)
      do i = 1, matrix%rows
         place(order(i)) = i
      end do
      width = bandwidth(matrix, order)
      allocate (band(width + 1, matrix%rows), source=0.0_wp)
      do row = 1, matrix%rows
         i = place(row)
         do k = matrix%start(row), matrix%start(row + 1) - 1
            j = place(matrix%column(k))
            if (i >= j) band(1 + i - j, j) = matrix%value(k)
         end do
      end do
   end subroutine to_band

end module razy_linalg_banded
