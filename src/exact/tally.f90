!! Small numbers under keys that belong to the motion under way: what a form that was let go of leaves behind.
!!
!! A motion's bits may hang on what it has seen, not on what happens to be kept of it. So there is one size for all motions; when it
!! is full all is forgotten, which costs time only.
module razy_exact_tally
   use razy_core_kinds, only: i8
   implicit none(type, external)
   private

   public :: key_type, mixed, tally_t

   integer, parameter :: key_type = i8
   !> Numbers of keys, a power of 2, and the most that are used.
   integer, parameter :: room = 1024, most = 3*room/4

   type :: tally_t
      integer(key_type), private :: key(0:room - 1) = 0
      integer :: value(0:room - 1) = 0
      integer, private :: count = 0
      !> How often all was forgotten.
      integer :: forgotten = 0
   contains
      procedure :: forget
      procedure :: find
   end type tally_t

contains

   !> A key mixed with a number to another one; keys are positive. A linear mixture would be equal for many pairs of modes.
   elemental integer(key_type) function mixed(key, number)
      integer(key_type), intent(in) :: key
      integer, intent(in) :: number

      integer(key_type), parameter :: prime = 2147483629_key_type, factor = 1000003_key_type

      mixed = mod(key*key + number*factor, prime) + 1
   end function mixed

   !> A motion begins.
   pure subroutine forget(self)
      class(tally_t), intent(inout) :: self

      self%key = 0
      self%count = 0
      self%forgotten = self%forgotten + 1
   end subroutine forget

   !> The place of a key; the number there is `initial` if the key is `new`.
   pure subroutine find(self, key, initial, at, new)
      class(tally_t), intent(inout) :: self
      integer(key_type), intent(in) :: key
      integer, intent(in) :: initial
      integer, intent(out) :: at
      logical, intent(out) :: new

      at = int(iand(key, int(room - 1, key_type)))
      do while (self%key(at) /= key .and. self%key(at) /= 0)
         at = iand(at + 1, room - 1)
      end do
      new = self%key(at) == 0
      if (.not. new) return
      if (self%count == most) call self%forget()
      self%count = self%count + 1
      if (self%count == 1) at = int(iand(key, int(room - 1, key_type)))
      self%key(at) = key
      self%value(at) = initial
   end subroutine find

end module razy_exact_tally
