!! The log of a sweep: when it began and with what, how fast it was, which points were the slowest, and which failed, with the
!! command that computes such a point alone.
!!
!! The file is appended to, so that the parts of a sweep that was interrupted follow each other.
module sweep_log
   use, intrinsic :: iso_fortran_env, only: error_unit
   use command_line, only: command_t, decimal
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_motion_integrator, only: status_meanings
   use razy_study_motion_watch, only: motion_result_t
   use razy_sweep_scheduler, only: sweep_outcome_t
   use razy_sweep_task, only: point_result_t
   use sweep_case, only: sweep_task_t
   implicit none(type, external)
   private

   public :: log_end, log_start, repeat_command

   !> Slowest points that are told, and failures that are told where there is no file for them.
   integer, parameter :: slowest = 10, most_on_screen = 3

contains

   !> Begin the log, if one is wanted.
   subroutine log_start(task, command, ranks, error)
      class(sweep_task_t), intent(in) :: task
      type(command_t), intent(in) :: command
      integer, intent(in) :: ranks
      type(error_t), allocatable, intent(out) :: error

      integer :: unit

      if (.not. allocated(command%log)) return
      call open_log(command%log, unit, error)
      if (allocated(error)) return
      write (unit, "(3a, i0, a, i0, a, i0, a)") moment(), " start: ", command%input//" to "//command%output//", ", ranks, &
         " ranks, ", task%plan%points, " points, ", task%plan%n_done, " done before"
      call close_log(unit)
   end subroutine log_start

   !> End the log after `outcome`; without one, tell the first failures.
   subroutine log_end(task, command, outcome, computed, error)
      class(sweep_task_t), intent(inout) :: task
      type(command_t), intent(in) :: command
      type(sweep_outcome_t), intent(in) :: outcome
      !> Points of this run.
      integer(i8), intent(in) :: computed
      type(error_t), allocatable, intent(out) :: error

      type(point_result_t) :: result
      type(motion_result_t) :: motion
      integer(i8) :: point, slow_point(slowest), failed
      real(wp) :: slow_time(slowest), rate
      integer :: i, unit

      if (task%failures == 0 .and. .not. allocated(command%log)) return
      unit = error_unit
      if (allocated(command%log)) then
         call open_log(command%log, unit, error)
         if (allocated(error)) return
         rate = 0.0_wp
         if (outcome%elapsed > 0.0_wp) rate = real(computed, wp)/outcome%elapsed
         write (unit, "(3a, i0, a)") moment(), " ", trim(merge("stopped:", "end:    ", outcome%stopped))//" ", computed, &
            " points in "//decimal(outcome%elapsed, 3)//" s, "//decimal(rate, 1)//" points/s, ranks busy "// &
            decimal(100*outcome%efficiency(), 1)//" %"
      end if
      slow_time = -1.0_wp
      slow_point = 0
      failed = 0
      do point = 1, task%plan%points
         if (.not. task%plan%done(point)) cycle
         call task%result_at(point, result, motion, error)
         if (allocated(error)) exit
         if (motion%seconds > slow_time(slowest)) call enter(slow_time, slow_point, motion%seconds, point)
         if (motion%status == 0) cycle
         failed = failed + 1
         if (allocated(command%log) .or. failed <= most_on_screen) call tell_failure(unit, task, command, point, motion%status)
      end do
      if (allocated(command%log)) then
         do i = 1, merge(slowest, 0,.not. allocated(error))
            if (slow_point(i) > 0) write (unit, "(a, i0, 2a)") "slow point ", slow_point(i) - 1, ": ", &
               decimal(1000*slow_time(i), 3)//" ms: "//repeat_command(task, command, slow_point(i))
         end do
         call close_log(unit)
      else if (failed > most_on_screen) then
         write (unit, "(i0, a)") failed - most_on_screen, " more points failed; --log FILE tells all"
      end if
   end subroutine log_end

   !> Enter a point into the list of the slowest, the slowest first.
   pure subroutine enter(times, points, time, point)
      real(wp), intent(inout) :: times(:)
      integer(i8), intent(inout) :: points(:)
      real(wp), intent(in) :: time
      integer(i8), intent(in) :: point

      integer :: i

      i = count(times >= time) + 1
      times(i:) = [time, times(i:size(times) - 1)]
      points(i:) = [point, points(i:size(points) - 1)]
   end subroutine enter

   subroutine tell_failure(unit, task, command, point, status)
      integer, intent(in) :: unit, status
      class(sweep_task_t), intent(in) :: task
      type(command_t), intent(in) :: command
      integer(i8), intent(in) :: point

      write (unit, "(a, i0, 4a)") "failed point ", point - 1, ": ", trim(status_meanings(status)), ": ", &
         repeat_command(task, command, point)
   end subroutine tell_failure

   !> The command that computes a point alone; of a chain the motion from the start of the input.
   function repeat_command(task, command, point) result(line)
      class(sweep_task_t), intent(in) :: task
      type(command_t), intent(in) :: command
      integer(i8), intent(in) :: point
      character(:), allocatable :: line

      real(wp) :: values(size(task%varied))
      character(20) :: number
      integer :: i, k

      line = "razy-run "//in_quotes(command%input)
      do i = 1, size(command%overrides)
         line = line//" --set "//in_quotes(command%overrides(i)%text)
      end do
      values = task%grid%values(task%plan%grid_point(point))
      do i = 1, size(values)
         associate (varied => task%varied(i))
            do k = 1, size(varied%slot)
               line = line//" --set "//in_quotes(varied%slot(k)%path//"="//to_text(varied%factor(k)*values(i)))
            end do
         end associate
      end do
      if (task%starts%wanted) then
         line = line//" --set "//in_quotes("starts%method='list'")
         do i = 1, size(task%starts%range)
            write (number, "(i0)") i
            line = line//" --set "//in_quotes("start_range("//trim(number)//")%values="// &
                                              to_text(task%starts%value(i, task%plan%grid_point(point), task%plan%start_of(point))))
         end do
      end if
      write (number, "(i0)") point - 1
      line = line//" --output point_"//trim(number)//".h5"
      if (task%plan%has_chains()) line = line//" (in the sweep it began where another ended)"
   end function repeat_command

   !> A word for the shell, in quotes if it needs them.
   pure function in_quotes(word) result(quoted)
      character(*), intent(in) :: word
      character(:), allocatable :: quoted

      integer :: i

      quoted = word
      if (verify(word, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_%=+-./,:") == 0) return
      quoted = "'"
      do i = 1, len(word)
         if (word(i:i) == "'") then
            quoted = quoted//"'\''"
         else
            quoted = quoted//word(i:i)
         end if
      end do
      quoted = quoted//"'"
   end function in_quotes

   !> Date and time with the difference from UTC.
   function moment() result(text)
      character(:), allocatable :: text

      character(8) :: date
      character(10) :: time
      character(5) :: zone

      call date_and_time(date, time, zone)
      text = date(:4)//"-"//date(5:6)//"-"//date(7:8)//"T"//time(:2)//":"//time(3:4)//":"//time(5:6)//zone
   end function moment

   !> `-` is the error channel.
   subroutine open_log(path, unit, error)
      character(*), intent(in) :: path
      integer, intent(out) :: unit
      type(error_t), allocatable, intent(out) :: error

      character(200) :: reason
      integer :: status

      unit = error_unit
      if (path == "-") return
      open (newunit=unit, file=path, position="append", action="write", iostat=status, iomsg=reason)
      if (status /= 0) call raise(error, path//": the log cannot be written: "//trim(reason))
   end subroutine open_log

   subroutine close_log(unit)
      integer, intent(in) :: unit

      if (unit /= error_unit) close (unit)
   end subroutine close_log

end module sweep_log
