!! Arrays that grow: another length, of which what fits is kept.
module razy_core_resize
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: resize

   !> Give an array (along its last dimension) the length `length`; the first values are kept, new ones are undefined.
   interface resize
      module procedure :: resize_reals, resize_integers, resize_longs, resize_table
   end interface resize

contains

   pure subroutine resize_reals(array, length)
      real(wp), allocatable, intent(inout) :: array(:)
      integer(i8), intent(in) :: length

      real(wp), allocatable :: other(:)

      allocate (other(length))
      if (allocated(array)) other(:min(size(array, kind=i8), length)) = array(:min(size(array, kind=i8), length))
      call move_alloc(other, array)
   end subroutine resize_reals

   pure subroutine resize_integers(array, length)
      integer, allocatable, intent(inout) :: array(:)
      integer(i8), intent(in) :: length

      integer, allocatable :: other(:)

      allocate (other(length))
      if (allocated(array)) other(:min(size(array, kind=i8), length)) = array(:min(size(array, kind=i8), length))
      call move_alloc(other, array)
   end subroutine resize_integers

   pure subroutine resize_longs(array, length)
      integer(i8), allocatable, intent(inout) :: array(:)
      integer(i8), intent(in) :: length

      integer(i8), allocatable :: other(:)

      allocate (other(length))
      if (allocated(array)) other(:min(size(array, kind=i8), length)) = array(:min(size(array, kind=i8), length))
      call move_alloc(other, array)
   end subroutine resize_longs

   !> `rows` is the other extent.
   pure subroutine resize_table(array, rows, length)
      real(wp), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: rows
      integer(i8), intent(in) :: length

      real(wp), allocatable :: other(:, :)
      integer(i8) :: kept
      integer :: low

      allocate (other(rows, length))
      if (allocated(array)) then
         kept = min(size(array, 2, kind=i8), length)
         low = min(size(array, 1), rows)
         other(:low, :kept) = array(:low, :kept)
      end if
      call move_alloc(other, array)
   end subroutine resize_table

end module razy_core_resize
