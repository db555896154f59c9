!! Signals that are not to end a program. POSIX; the numbers are those of Linux.
!!
!! By SIGTERM and SIGUSR1 a queue announces that time is up. Their handler only notes that one has come, in whatever thread it
!! runs; programs look at that between points and now and then in a motion. SIGXFSZ comes when a file would grow beyond the limit
!! of the shell or the queue: without it the write fails, as on a full disk.
module signals
   use, intrinsic :: iso_c_binding, only: c_funloc, c_funptr, c_int, c_intptr_t, c_null_funptr
   implicit none(type, external)
   private

   public :: hold_signals, let_writes_fail, time_is_up

   !> SIGUSR1 and SIGTERM.
   integer(c_int), parameter :: awaited(2) = [10_c_int, 15_c_int]
   !> SIGXFSZ; SIG_IGN.
   integer(c_int), parameter :: file_too_large = 25_c_int
   integer(c_intptr_t), parameter :: ignore = 1_c_intptr_t

   !> Set by the handler.
   logical, volatile :: has_come = .false.

   interface
      !> signal of C, which glibc makes one that interrupts no system call for good.
      function c_signal(number, handler) result(before) bind(c, name="signal")
         import :: c_funptr, c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: number
         type(c_funptr), value, intent(in) :: handler
         type(c_funptr) :: before
      end function c_signal
   end interface

contains

   !> Note the signals from now on instead of ending the program.
   subroutine hold_signals()
      type(c_funptr) :: before
      integer :: i

      do i = 1, size(awaited)
         before = c_signal(awaited(i), c_funloc(note))
      end do
   end subroutine hold_signals

   !> A write that would make a file too large fails from now on, where it ended the program.
   subroutine let_writes_fail()
      type(c_funptr) :: before

      before = c_signal(file_too_large, transfer(ignore, c_null_funptr))
   end subroutine let_writes_fail

   subroutine note(number) bind(c, name="")
      integer(c_int), value, intent(in) :: number

      has_come = has_come .or. number > 0
   end subroutine note

   !> Whether one of the signals has come.
   logical function time_is_up()
      time_is_up = has_come
   end function time_is_up

end module signals
