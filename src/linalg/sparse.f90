!! Sparse matrices in compressed rows, and lists of entries to build them from.
module razy_linalg_sparse
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: rising_order
   use razy_linalg_lapack, only: dgemm
   implicit none(type, external)
   private

   public :: csr_t, entries_t, add_matrices, new_csr

   !> Entries of a matrix in any order; entries of the same place are added up by `new_csr`, in the order of their coming.
   type :: entries_t
      integer :: count = 0
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
   contains
      procedure :: add
      procedure :: add_block
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

      if (row < 1 .or. column < 1 .or. .not. abs(value) > 0.0_wp) return
      call make_room(self)
      self%count = self%count + 1
      self%row(self%count) = row
      self%column(self%count) = column
      self%value(self%count) = value
   end subroutine add

   !> Room for one more entry.
   pure subroutine make_room(self)
      type(entries_t), intent(inout) :: self

      integer, allocatable :: column(:), row(:)
      real(wp), allocatable :: value(:)
      integer :: room

      if (.not. allocated(self%row)) allocate (self%row(256), self%column(256), self%value(256))
      if (self%count < size(self%row)) return
      room = 2*self%count
      allocate (row(room), column(room), value(room))
      row(:self%count) = self%row
      column(:self%count) = self%column
      value(:self%count) = self%value
      call move_alloc(row, self%row)
      call move_alloc(column, self%column)
      call move_alloc(value, self%value)
   end subroutine make_room

   !> Cut the room of a matrix to its entries.
   pure subroutine trim_room(matrix, used)
      type(csr_t), intent(inout) :: matrix
      integer, intent(in) :: used

      integer, allocatable :: column(:)
      real(wp), allocatable :: value(:)

      matrix%start(matrix%rows + 1) = used + 1
      allocate (column(used), value(used))
      column = matrix%column(:used)
      value = matrix%value(:used)
      call move_alloc(column, matrix%column)
      call move_alloc(value, matrix%value)
   end subroutine trim_room

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

   !> The matrix (rows, columns) of these entries.
   pure function new_csr(entries, rows, columns) result(matrix)
      type(entries_t), intent(in) :: entries
      integer, intent(in) :: rows, columns
      type(csr_t) :: matrix

      integer, allocatable :: next(:), place(:), row(:)
      integer :: first, i, k, last, used

      matrix%rows = rows
      matrix%columns = columns
      allocate (matrix%start(rows + 1), source=0)
      do k = 1, entries%count
         matrix%start(entries%row(k) + 1) = matrix%start(entries%row(k) + 1) + 1
      end do
      matrix%start(1) = 1
      do i = 1, rows
         matrix%start(i + 1) = matrix%start(i) + matrix%start(i + 1)
      end do
      next = matrix%start
      allocate (place(entries%count), matrix%column(entries%count), matrix%value(entries%count))
      do k = 1, entries%count
         i = entries%row(k)
         place(next(i)) = k
         next(i) = next(i) + 1
      end do
      used = 0
      do i = 1, rows
         first = matrix%start(i)
         last = next(i) - 1
         row = place(first:last)
         place(first:last) = row(rising_order(real(entries%column(row), wp)))
         matrix%start(i) = used + 1
         do k = first, last
            associate (column => entries%column(place(k)), value => entries%value(place(k)))
               if (used >= matrix%start(i)) then
                  if (matrix%column(used) == column) then
                     matrix%value(used) = matrix%value(used) + value
                     cycle
                  end if
               end if
               used = used + 1
               matrix%column(used) = column
               matrix%value(used) = value
            end associate
         end do
      end do
      call trim_room(matrix, used)
   end function new_csr

   !> a*A + b*B of two matrices of the same shape.
   pure function add_matrices(a, matrix_a, b, matrix_b) result(total)
      real(wp), intent(in) :: a, b
      type(csr_t), intent(in) :: matrix_a, matrix_b
      type(csr_t) :: total

      integer :: i, ka, kb, used

      total%rows = matrix_a%rows
      total%columns = matrix_a%columns
      used = size(matrix_a%value) + size(matrix_b%value)
      allocate (total%start(total%rows + 1), total%column(used), total%value(used))
      used = 0
      do i = 1, total%rows
         total%start(i) = used + 1
         ka = matrix_a%start(i)
         kb = matrix_b%start(i)
         do while (ka < matrix_a%start(i + 1) .or. kb < matrix_b%start(i + 1))
            used = used + 1
            total%column(used) = min(column_at(matrix_a, i, ka), column_at(matrix_b, i, kb))
            total%value(used) = 0.0_wp
            if (column_at(matrix_a, i, ka) == total%column(used)) then
               total%value(used) = a*matrix_a%value(ka)
               ka = ka + 1
            end if
            if (column_at(matrix_b, i, kb) == total%column(used)) then
               total%value(used) = total%value(used) + b*matrix_b%value(kb)
               kb = kb + 1
            end if
         end do
      end do
      call trim_room(total, used)
   end function add_matrices

   !> Column of entry k, beyond all columns after the end of row i.
   pure function column_at(matrix, i, k) result(column)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: i, k
      integer :: column

      column = huge(column)
      if (k < matrix%start(i + 1)) column = matrix%column(k)
   end function column_at

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
      integer :: j, n, p

      n = size(basis, 1)
      p = size(basis, 2)
      allocate (image(n, p), projected(p, p))
      if (n*p == 0) return
      do j = 1, p
         call self%multiply(basis(:, j), image(:, j))
      end do
      call dgemm("T", "N", p, p, n, 1.0_wp, basis, n, image, n, 0.0_wp, projected, p)
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
