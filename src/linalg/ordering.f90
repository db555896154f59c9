!! Orderings that bring the entries of a sparse symmetric matrix near its diagonal.
!!
!! Cuthill and McKee's (George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981): breadth-first from a
!! vertex at the rim, neighbours by degree. The reversed order has the same bandwidth.
module razy_linalg_ordering
   use razy_linalg_sparse, only: csr_t
   implicit none(type, external)
   private

   public :: bandwidth, narrow_order

contains

   !> An order (n) of the rows and columns: `order(new)` is the old index. `matrix` is symmetric in its pattern.
   pure function narrow_order(matrix) result(order)
      type(csr_t), intent(in) :: matrix
      integer, allocatable :: order(:)

      logical, allocatable :: numbered(:)
      integer :: count, levels, first, found, k, last, old_levels, root, seed

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
            first = count + 1
            last = count + found
            do k = first, last
               numbered(order(k)) = .false.
            end do
            root = order(last)
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

      integer :: first, j, k, level_end, vertex

      order(1) = root
      numbered(root) = .true.
      found = 1
      levels = 0
      level_end = 1
      j = 1
      do while (j <= found)
         vertex = order(j)
         first = found + 1
         do k = matrix%start(vertex), matrix%start(vertex + 1) - 1
            if (numbered(matrix%column(k))) cycle
            found = found + 1
            order(found) = matrix%column(k)
            numbered(matrix%column(k)) = .true.
         end do
         call sort_by_degree(order(first:found), matrix%start)
         if (j == level_end) then
            levels = levels + 1
            level_end = found
         end if
         j = j + 1
      end do
   end subroutine number_component

   pure subroutine sort_by_degree(vertices, start)
      integer, intent(inout) :: vertices(:)
      integer, intent(in) :: start(:)

      integer :: degree, i, j, moved

      do i = 2, size(vertices)
         moved = vertices(i)
         degree = start(moved + 1) - start(moved)
         j = i - 1
         do while (j >= 1)
            if (start(vertices(j) + 1) - start(vertices(j)) <= degree) exit
            vertices(j + 1) = vertices(j)
            j = j - 1
         end do
         vertices(j + 1) = moved
      end do
   end subroutine sort_by_degree

   !> Largest distance of an entry from the diagonal in this order.
   pure function bandwidth(matrix, order) result(width)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: order(:)
      integer :: width

      integer, allocatable :: place(:)
      integer :: i, k

      allocate (place(size(order)))
      do i = 1, size(order)
         place(order(i)) = i
      end do
      width = 0
      do i = 1, matrix%rows
         do k = matrix%start(i), matrix%start(i + 1) - 1
            width = max(width, abs(place(i) - place(matrix%column(k))))
         end do
      end do
   end function bandwidth

end module razy_linalg_ordering
