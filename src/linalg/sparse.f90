!! Sparse matrices in compressed rows, and lists of entries to build them from.
module razy_linalg_sparse
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: rising_order, transposed_product
   implicit none(type, external)
   private

   public :: csr_t, entries_t, add_matrices, new_csr

   type :: entry_t
      integer :: row = 0, column = 0
      real(wp) :: value = 0.0_wp
   end type entry_t

   !> Entries of a matrix in any order; entries of the same place are added up by `new_csr`, in the order of their coming.
   type :: entries_t
      private
      integer :: count = 0
      !> The first `count` of these.
      type(entry_t), allocatable :: list(:)
   contains
      procedure :: add
      procedure :: add_block
      procedure :: add_matrix
   end type entries_t

   !> A matrix in compressed rows: row i holds `column(k)`, ascending, and `value(k)` for start(i) <= k < start(i + 1).
   type :: csr_t
      integer :: rows = 0, columns = 0
      integer, allocatable :: start(:), column(:)
      real(wp), allocatable :: value(:)
   contains
      procedure :: times
      procedure :: multiply
      procedure :: dense
      procedure :: diagonal
      procedure :: congruence
      procedure :: extract
   end type csr_t

contains

   !> Add `value` at (row, column). A row or column 0 (a coordinate that is not there) and a zero are left out.
   pure subroutine add(self, row, column, value)
      class(entries_t), intent(inout) :: self
      integer, intent(in) :: row, column
      real(wp), intent(in) :: value

      if (row > 0 .and. column > 0 .and. abs(value) > 0.0_wp) call append(self, entry_t(row, column, value))
   end subroutine add

   pure subroutine append(self, entry)
      type(entries_t), intent(inout) :: self
      type(entry_t), intent(in) :: entry

      if (.not. allocated(self%list)) allocate (self%list(256))
      if (self%count == size(self%list)) self%list = [self%list, self%list]
      self%count = self%count + 1
      self%list(self%count) = entry
   end subroutine append

   !> Add a dense `block` (m, m) at the rows and columns `index` (m); an index 0 is left out.
   pure subroutine add_block(self, index, block)
      class(entries_t), intent(inout) :: self
      integer, intent(in) :: index(:)
      real(wp), intent(in) :: block(:, :)

      integer :: i, j

      do j = 1, size(index)
         do i = 1, size(index)
            call self%add(index(i), index(j), block(i, j))
         end do
      end do
   end subroutine add_block

   !> Add `factor` times a matrix, with all its entries, also those that are zero.
   pure subroutine add_matrix(self, factor, matrix)
      class(entries_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(csr_t), intent(in) :: matrix

      integer :: i, k

      do i = 1, matrix%rows
         do k = matrix%start(i), matrix%start(i + 1) - 1
            call append(self, entry_t(i, matrix%column(k), factor*matrix%value(k)))
         end do
      end do
   end subroutine add_matrix

   !> The matrix (rows, columns) of these entries.
   pure function new_csr(entries, rows, columns) result(matrix)
      type(entries_t), intent(in) :: entries
      integer, intent(in) :: rows, columns
      type(csr_t) :: matrix

      integer, allocatable :: column(:), next(:), place(:), row(:)
      real(wp), allocatable :: value(:)
      integer :: i, k, used

      matrix%rows = rows
      matrix%columns = columns
      allocate (matrix%start(rows + 1), source=0)
      do k = 1, entries%count
         i = entries%list(k)%row
         matrix%start(i + 1) = matrix%start(i + 1) + 1
      end do
      matrix%start(1) = 1
      do i = 1, rows
         matrix%start(i + 1) = matrix%start(i) + matrix%start(i + 1)
      end do
      next = matrix%start
      allocate (place(entries%count), column(entries%count), value(entries%count))
      do k = 1, entries%count
         i = entries%list(k)%row
         place(next(i)) = k
         next(i) = next(i) + 1
      end do
      used = 0
      do i = 1, rows
         row = place(matrix%start(i):next(i) - 1)
         row = row(rising_order(real(entries%list(row)%column, wp)))
         matrix%start(i) = used + 1
         do k = 1, size(row)
            associate (entry => entries%list(row(k)))
               if (used >= matrix%start(i)) then
                  if (column(used) == entry%column) then
                     value(used) = value(used) + entry%value
                     cycle
                  end if
               end if
               used = used + 1
               column(used) = entry%column
               value(used) = entry%value
            end associate
         end do
      end do
      matrix%start(rows + 1) = used + 1
      matrix%column = column(:used)
      matrix%value = value(:used)
   end function new_csr

   !> a*A + b*B of two matrices of the same shape.
   pure function add_matrices(a, matrix_a, b, matrix_b) result(total)
      real(wp), intent(in) :: a, b
      type(csr_t), intent(in) :: matrix_a, matrix_b
      type(csr_t) :: total

      type(entries_t) :: entries

      call entries%add_matrix(a, matrix_a)
      call entries%add_matrix(b, matrix_b)
      total = new_csr(entries, matrix_a%rows, matrix_a%columns)
   end function add_matrices

   !> A x.
   pure function times(self, x) result(y)
      class(csr_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), allocatable :: y(:)

      allocate (y(self%rows))
      call self%multiply(x, y)
   end function times

   !> y = A x.
   pure subroutine multiply(self, x, y)
      class(csr_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: y(:)

      real(wp) :: total
      integer :: i, k

      do i = 1, self%rows
         total = 0.0_wp
         do k = self%start(i), self%start(i + 1) - 1
            total = total + self%value(k)*x(self%column(k))
         end do
         y(i) = total
      end do
   end subroutine multiply

   !> The matrix with all its zeros.
   pure function dense(self) result(full)
      class(csr_t), intent(in) :: self
      real(wp), allocatable :: full(:, :)

      integer :: i, k

      allocate (full(self%rows, self%columns), source=0.0_wp)
      do i = 1, self%rows
         do k = self%start(i), self%start(i + 1) - 1
            full(i, self%column(k)) = self%value(k)
         end do
      end do
   end function dense

   !> The diagonal of a square matrix.
   pure function diagonal(self) result(values)
      class(csr_t), intent(in) :: self
      real(wp), allocatable :: values(:)

      integer :: i, k

      allocate (values(self%rows), source=0.0_wp)
      do i = 1, self%rows
         do k = self%start(i), self%start(i + 1) - 1
            if (self%column(k) == i) values(i) = self%value(k)
         end do
      end do
   end function diagonal

   !> Vᵀ A V of a square matrix with `basis` V (n, p): (p, p).
   function congruence(self, basis) result(projected)
      class(csr_t), intent(in) :: self
      real(wp), contiguous, intent(in) :: basis(:, :)
      real(wp), allocatable :: projected(:, :)

      real(wp), allocatable :: image(:, :)
      integer :: j

      allocate (image, mold=basis)
      do j = 1, size(basis, 2)
         call self%multiply(basis(:, j), image(:, j))
      end do
      projected = transposed_product(basis, image)
   end function congruence

   !> The rows and columns `chosen`, each once, of a square matrix, in that order.
   pure function extract(self, chosen) result(part)
      class(csr_t), intent(in) :: self
      integer, intent(in) :: chosen(:)
      type(csr_t) :: part

      type(entries_t) :: entries
      integer, allocatable :: place(:)
      integer :: i, k

      allocate (place(self%columns), source=0)
      do i = 1, size(chosen)
         place(chosen(i)) = i
      end do
      do i = 1, size(chosen)
         do k = self%start(chosen(i)), self%start(chosen(i) + 1) - 1
            call entries%add(i, place(self%column(k)), self%value(k))
         end do
      end do
      part = new_csr(entries, size(chosen), size(chosen))
   end function extract

end module razy_linalg_sparse
