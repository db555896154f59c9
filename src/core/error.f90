!! The error that input produces: allocated means failed.
!!
!! Outcomes of the numerics (a chatter limit, a blow-up) are not errors but status values in the result.
module razy_core_error
   use razy_core_text, only: excerpt
   implicit none(type, external)
   private

   public :: error_t, raise, refuse, complaint, from_option

   !> Origin of a value that came from the command line and not from a file.
   character(*), parameter :: from_option = "--set"

   !> One line for the user: `file:line: &group key = value: what is allowed`.
   type :: error_t
      character(:), allocatable :: message
   end type error_t

contains

   !> Set `error` to a failure with this message.
   pure subroutine raise(error, message)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: message

      allocate (error)
      error%message = message
   end subroutine raise

   !> Refuse a file with one line.
   pure subroutine refuse(error, file, what)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: file, what

      call raise(error, complaint(file, "", "", "", what))
   end subroutine refuse

   !> The line `origin: &group key = value: allowed`, or `--set: &group%key = value: allowed`.
   !> Empty `group`, `key` or `value` are left out with what leads to them, long ones are cut; control characters become question
   !> marks, so that it stays one line.
   pure function complaint(origin, group, key, value, allowed) result(message)
      !> `file:line`, `file` or `from_option`
      character(*), intent(in) :: origin
      !> Without `&`, with the index of a repeated group: `load(2)`
      character(*), intent(in) :: group
      character(*), intent(in) :: key
      !> As the user wrote it
      character(*), intent(in) :: value
      character(*), intent(in) :: allowed
      character(:), allocatable :: message
      integer :: i

      message = origin//": "
      if (len(group) > 0) then
         message = message//"&"//excerpt(group)
         if (len(key) > 0) message = message//merge("%", " ", origin == from_option)//excerpt(key)
         if (len(value) > 0) message = message//" = "//excerpt(value)
         message = message//": "
      end if
      message = message//allowed
      do i = 1, len(message)
         if (iachar(message(i:i)) < iachar(" ")) message(i:i) = "?"
      end do
   end function complaint

end module razy_core_error
