!! Where the columns of two matrices begin and end, so that products leave out what is zero.
!!
!! In the coordinates of machine_coupled symmetric matrices are banded, for the basis is that of a Krylov process: with c contact
!! directions to start from, the half width is about c. What rounding leaves outside the band is not part of the machine.
module razy_linalg_profile
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: find_profile

   !> Entries are rounding if below this, relative to the diagonal: they change the energy of a motion by as little.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)

contains

   !> First and last row (m each) that matter in the columns of a and b; an empty column has its diagonal.
   pure subroutine find_profile(a, b, first, last)
      real(wp), intent(in) :: a(:, :), b(:, :)
      integer, allocatable, intent(out) :: first(:), last(:)

      integer :: i, j

      allocate (first(size(a, 2)), last(size(a, 2)))
      do j = 1, size(a, 2)
         first(j) = j
         last(j) = j
         do i = 1, size(a, 1)
            if (.not. (matters(a, i, j) .or. matters(b, i, j))) cycle
            first(j) = min(first(j), i)
            last(j) = max(last(j), i)
         end do
      end do
   end subroutine find_profile

   !> Whether an entry is more than rounding of the diagonal entries of its row and column.
   pure function matters(a, i, j)
      real(wp), intent(in) :: a(:, :)
      integer, intent(in) :: i, j
      logical :: matters

      matters = abs(a(i, j)) > rounding*sqrt(abs(a(i, i)))*sqrt(abs(a(j, j)))
   end function matters

end module razy_linalg_profile
