!! Which entries of dense matrices matter: the sets of indices that they couple, and where their columns begin and end.
!!
!! In the coordinates of machine_coupled symmetric matrices are banded, for the basis is that of a Krylov process: with c contact
!! directions to start from, the half width is about c. What rounding leaves outside the band is not part of the machine.
module razy_linalg_pattern
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: connected_sets, find_profile, linked, without_rounding

   !> Entries are rounding if below this, relative to the diagonal: they change the energy of a motion by as little.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)

contains

   !> Number the sets of indices that are connected by `links` (n, n), from 1: set(i) is that of index i. A link counts in both
   !> directions.
   pure function connected_sets(links) result(set)
      logical, intent(in) :: links(:, :)
      integer :: set(size(links, 1))

      integer :: reached(size(links, 1)), found, i, j, next, sets

      set = 0
      sets = 0
      do i = 1, size(set)
         if (set(i) > 0) cycle
         sets = sets + 1
         set(i) = sets
         reached(1) = i
         found = 1
         next = 1
         do while (next <= found)
            do j = 1, size(set)
               if (set(j) > 0 .or. .not. (links(j, reached(next)) .or. links(reached(next), j))) cycle
               set(j) = sets
               found = found + 1
               reached(found) = j
            end do
            next = next + 1
         end do
      end do
   end function connected_sets

   !> Which indices of a square matrix are linked by an entry that is more than the part `negligible` of the largest in the
   !> rows and columns of both.
   pure function linked(matrix, negligible) result(links)
      real(wp), intent(in) :: matrix(:, :), negligible
      logical :: links(size(matrix, 1), size(matrix, 1))

      real(wp) :: largest(size(matrix, 1))
      integer :: j

      largest = [(max(maxval(abs(matrix(:, j))), maxval(abs(matrix(j, :)))), j=1, size(largest))]
      do j = 1, size(largest)
         links(:, j) = abs(matrix(:, j)) > negligible*max(largest, largest(j))
      end do
   end function linked

   !> First and last row (m each) that matter in the columns of a and b; an empty column has its diagonal.
   pure subroutine find_profile(a, b, first, last)
      real(wp), intent(in) :: a(:, :), b(:, :)
      integer, allocatable, intent(out) :: first(:), last(:)

      logical :: all(size(a, 1), size(a, 2))
      integer :: j

      all = matters(a) .or. matters(b)
      first = [(j, j=1, size(a, 2))]
      last = first
      do j = 1, size(first)
         if (.not. any(all(:, j))) cycle
         first(j) = min(j, findloc(all(:, j), .true., dim=1))
         last(j) = max(j, findloc(all(:, j), .true., dim=1, back=.true.))
      end do
   end subroutine find_profile

   !> A square matrix with zeros for the entries that do not matter.
   pure function without_rounding(a) result(clean)
      real(wp), intent(in) :: a(:, :)
      real(wp), allocatable :: clean(:, :)

      clean = merge(a, 0.0_wp, matters(a))
   end function without_rounding

   !> Which entries of a square matrix are more than rounding of the diagonal entries of their rows and columns.
   pure function matters(a)
      real(wp), intent(in) :: a(:, :)
      logical :: matters(size(a, 1), size(a, 1))

      real(wp) :: root(size(a, 1))
      integer :: i

      root = [(sqrt(abs(a(i, i))), i=1, size(root))]
      do i = 1, size(root)
         matters(:, i) = abs(a(:, i)) > rounding*root*root(i)
      end do
   end function matters

end module razy_linalg_pattern
