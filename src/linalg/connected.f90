!! Sets of indices that matrices couple with each other.
module razy_linalg_connected
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: connected_sets, linked

contains

   !> Number the sets of indices that are connected by `links` (n, n): set(i) is that of index i.
   pure function connected_sets(links) result(set)
      logical, intent(in) :: links(:, :)
      integer :: set(size(links, 1))

      integer :: i, j, low, high, sets
      logical :: seen(size(links, 1))

      set = [(i, i=1, size(set))]
      do i = 1, size(set)
         do j = 1, size(set)
            if (set(i) == set(j) .or. .not. links(i, j)) cycle
            low = min(set(i), set(j))
            high = max(set(i), set(j))
            where (set == high) set = low
         end do
      end do
      sets = 0
      seen = .false.
      do i = 1, size(set)
         if (seen(i)) cycle
         sets = sets + 1
         do j = size(set), i, -1
            if (set(j) == set(i) .and. .not. seen(j)) then
               seen(j) = .true.
               if (j /= i) set(j) = -sets
            end if
         end do
         set(i) = -sets
      end do
      set = -set
   end function connected_sets

   !> Which indices of a square matrix are linked by an entry that is more than the part `negligible` of the largest in the
   !> rows and columns of both.
   pure function linked(matrix, negligible) result(links)
      real(wp), intent(in) :: matrix(:, :), negligible
      logical :: links(size(matrix, 1), size(matrix, 1))

      real(wp) :: largest(size(matrix, 1))
      integer :: i, j

      largest = max(maxval(abs(matrix), dim=1), maxval(abs(matrix), dim=2))
      do j = 1, size(matrix, 1)
         do i = 1, size(matrix, 1)
            links(i, j) = abs(matrix(i, j)) > negligible*max(largest(i), largest(j))
         end do
      end do
   end function linked

end module razy_linalg_connected
