!! The signals by which a queue announces that time is up: SIGTERM and SIGUSR1.
!!
!! They are blocked, and asked for between points: no code runs at a moment of the system's choosing. POSIX; the numbers are those
!! of Linux.
module signals
   use, intrinsic :: iso_c_binding, only: c_int, c_long
   implicit none(type, external)
   private

   public :: hold_signals, time_is_up

   !> SIGUSR1 and SIGTERM; SIG_BLOCK of sigprocmask.
   integer(c_int), parameter :: awaited(2) = [10_c_int, 15_c_int], block = 0_c_int

   !> Room for C's sigset_t.
   type, bind(c) :: signal_set_t
      integer(c_long) :: words(32)
   end type signal_set_t

   interface
      integer(c_int) function c_sigemptyset(set) bind(c, name="sigemptyset")
         import :: c_int, signal_set_t
         implicit none(type, external)
         type(signal_set_t), intent(out) :: set
      end function c_sigemptyset

      integer(c_int) function c_sigaddset(set, signal) bind(c, name="sigaddset")
         import :: c_int, signal_set_t
         implicit none(type, external)
         type(signal_set_t), intent(inout) :: set
         integer(c_int), value, intent(in) :: signal
      end function c_sigaddset

      integer(c_int) function c_sigprocmask(how, set, old) bind(c, name="sigprocmask")
         import :: c_int, signal_set_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: how
         type(signal_set_t), intent(in) :: set
         type(signal_set_t), intent(out) :: old
      end function c_sigprocmask

      integer(c_int) function c_sigpending(set) bind(c, name="sigpending")
         import :: c_int, signal_set_t
         implicit none(type, external)
         type(signal_set_t), intent(out) :: set
      end function c_sigpending

      integer(c_int) function c_sigismember(set, signal) bind(c, name="sigismember")
         import :: c_int, signal_set_t
         implicit none(type, external)
         type(signal_set_t), intent(in) :: set
         integer(c_int), value, intent(in) :: signal
      end function c_sigismember
   end interface

contains

   !> Hold the signals back from now on; to be called before MPI starts threads, which inherit this. `held` is false if it failed,
   !> and the signals then end the program as ever.
   subroutine hold_signals(held)
      logical, intent(out) :: held

      type(signal_set_t) :: set, old
      integer :: i

      held = c_sigemptyset(set) == 0
      do i = 1, size(awaited)
         if (held) held = c_sigaddset(set, awaited(i)) == 0
      end do
      if (held) held = c_sigprocmask(block, set, old) == 0
   end subroutine hold_signals

   !> Whether one of the signals has come.
   logical function time_is_up()
      type(signal_set_t) :: set
      integer :: i

      time_is_up = c_sigpending(set) == 0
      if (time_is_up) time_is_up = any([(c_sigismember(set, awaited(i)) == 1, i=1, size(awaited))])
   end function time_is_up

end module signals
