!! The error that input produces: allocated means failed.
!!
!! Outcomes of the numerics (a chatter limit, a blow-up) are not errors but status values in the result.
module razy_core_error
   implicit none(type, external)
   private

   public :: error_t, raise

   !> One line for the user: `file: &group key = value: what is allowed`.
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

end module razy_core_error
