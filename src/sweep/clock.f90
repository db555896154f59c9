!! Time and polite waiting.
!!
!! MPI libraries wait by spinning, which takes the core from a rank that has work when there are more ranks than cores. Whoever
!! waits here spins for some microseconds, so that an answer that is near comes without delay, and then sleeps between looks; the
!! sleeps stay below a twentieth of the time waited already, and below a millisecond.
module razy_sweep_clock
   use, intrinsic :: iso_c_binding, only: c_int, c_long, c_null_ptr, c_ptr
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: patience_t, seconds

   !> Time of spinning before the first sleep; shortest and longest sleep [s].
   real(wp), parameter :: spin_time = 50.0e-6_wp, shortest_sleep = 10.0e-6_wp, longest_sleep = 1.0e-3_wp

   !> One wait: `pause` as long as there is nothing to do, `reset` when there was something.
   type :: patience_t
      private
      logical :: waiting = .false.
      real(wp) :: since = 0.0_wp
   contains
      procedure :: pause
      procedure :: reset
   end type patience_t

   !> C's struct timespec.
   type, bind(c) :: timespec_t
      integer(c_long) :: seconds, nanoseconds
   end type timespec_t

   interface
      !> POSIX nanosleep; a signal may end it early, which does no harm here.
      integer(c_int) function c_nanosleep(time, remaining) bind(c, name="nanosleep")
         import :: c_int, c_ptr, timespec_t
         implicit none(type, external)
         type(timespec_t), intent(in) :: time
         type(c_ptr), value :: remaining
      end function c_nanosleep
   end interface

contains

   !> Seconds since an arbitrary moment, by a clock that never goes back.
   real(wp) function seconds()
      integer(i8) :: ticks, rate

      call system_clock(ticks, rate)
      seconds = real(ticks, wp)/real(rate, wp)
   end function seconds

   !> Let some time pass: none at first, a growing sleep later.
   subroutine pause(self)
      class(patience_t), intent(inout) :: self
      real(wp) :: now, waited, sleep
      integer(c_int) :: interrupted

      now = seconds()
      if (.not. self%waiting) then
         self%waiting = .true.
         self%since = now
      end if
      waited = now - self%since
      if (waited < spin_time) return
      sleep = min(longest_sleep, max(shortest_sleep, 0.05_wp*waited))
      interrupted = c_nanosleep(timespec_t(0_c_long, nint(1.0e9_wp*sleep, c_long)), c_null_ptr)
   end subroutine pause

   !> The wait is over.
   elemental subroutine reset(self)
      class(patience_t), intent(inout) :: self

      self%waiting = .false.
   end subroutine reset

end module razy_sweep_clock
