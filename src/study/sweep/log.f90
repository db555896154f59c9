!! The log of a sweep: when it began and with what, how fast it was, which points were the slowest, and which failed, with the
!! command that computes such a point alone.
module razy_study_sweep_log
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: excerpt, name_characters, quoted, string_t
   use razy_motion_integrator, only: status_meanings
   use razy_study_sweep_task, only: sweep_task_t
   use razy_sweep_checkpoint, only: checkpoint_path, checkpoint_t
   use razy_sweep_scheduler, only: sweep_outcome_t
   implicit none(type, external)
   private

   public :: log_end, log_start, open_log, points_done, what_was_written

   !> Slowest points that are told.
   integer, parameter :: slowest = 10

contains

   !> Open a log, to which is appended; `-` is the unit of the error channel.
   subroutine open_log(path, error_channel, unit, error)
      character(*), intent(in) :: path
      integer, intent(in) :: error_channel
      integer, intent(out) :: unit
      type(error_t), allocatable, intent(out) :: error

      character(len(path) + 200) :: reason
      integer :: status

      unit = error_channel
      if (path == "-") return
      open (newunit=unit, file=path, position="append", action="write", iostat=status, iomsg=reason)
      if (status /= 0) call raise(error, excerpt(path)//": the log cannot be written"// &
                                  reason(index(reason, ": ", back=.true.):len_trim(reason)))
   end subroutine open_log

   !> The line with which a log begins.
   subroutine log_start(unit, task, checkpoint, from, to, ranks)
      integer, intent(in) :: unit, ranks
      class(sweep_task_t), intent(in) :: task
      type(checkpoint_t), intent(in) :: checkpoint
      !> Names of input and output.
      character(*), intent(in) :: from, to

      write (unit, "(a)") moment()//" start: "//from//" to "//to//", "//counted(to_text(ranks), "rank")//", "// &
         counted(to_text(task%plan%points), "point")//", "//to_text(checkpoint%n_done)//" done before"
   end subroutine log_start

   !> What was computed, the points that failed, and the slowest; not `in_full` only the first failures.
   subroutine log_end(unit, in_full, task, checkpoint, outcome, from, overrides, error)
      integer, intent(in) :: unit
      logical, intent(in) :: in_full
      class(sweep_task_t), intent(in) :: task
      type(checkpoint_t), intent(inout) :: checkpoint
      type(sweep_outcome_t), intent(in) :: outcome
      character(*), intent(in) :: from
      type(string_t), intent(in) :: overrides(:)
      type(error_t), allocatable, intent(out) :: error

      !> Failures that are told where there is no log.
      integer(i8), parameter :: most_on_screen = 3
      type(table_t) :: row
      integer(i8) :: failed, failures, point, slow_point(slowest)
      integer :: i, status
      real(wp) :: slow_time(slowest)

      if (in_full) write (unit, "(a)") computed(outcome)
      failures = checkpoint%tally_of("/point/status")
      slow_time = -1.0_wp
      slow_point = 0
      failed = 0
      row = checkpoint%row
      do point = 1, task%plan%points
         if (.not. checkpoint%has(point)) cycle
         if (failed >= min(most_on_screen, failures) .and. .not. in_full) exit
         call checkpoint%get(point, row, error)
         if (allocated(error)) return
         call enter(slow_time, slow_point, row%column(row%place_of("seconds"))%reals(1), point)
         status = int(row%column(row%place_of("/point/status"))%integers(1))
         if (status == 0) cycle
         failed = failed + 1
         write (unit, "(a)") "failed point "//to_text(point - 1)//": "//trim(status_meanings(status))//": "// &
            repeat_command(task, from, overrides, point)
      end do
      do i = 1, merge(slowest, 0, in_full)
         if (slow_point(i) > 0) write (unit, "(a)") "slow point "//to_text(slow_point(i) - 1)//": "// &
            decimal(1000*slow_time(i), 3)//" ms: "//repeat_command(task, from, overrides, slow_point(i))
      end do
      if (failures > failed) write (unit, "(a)") counted(to_text(failures - failed), "more point")//" failed; --log FILE tells all"
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

   !> How much was computed, and how fast.
   function computed(outcome) result(line)
      type(sweep_outcome_t), intent(in) :: outcome
      character(:), allocatable :: line

      real(wp) :: rate

      rate = 0.0_wp
      if (outcome%elapsed > 0.0_wp) rate = real(sum(outcome%tally%points), wp)/outcome%elapsed
      line = moment()//" "//trim(merge("stopped:", "end:    ", outcome%stopped))//" "// &
             counted(to_text(sum(outcome%tally%points)), "point")//" in "// &
             decimal(outcome%elapsed, 3)//" s, "//decimal(rate, 1)//" points/s, ranks busy "// &
             decimal(100*outcome%efficiency(), 1)//" %"
   end function computed

   !> The command that computes a point alone; of a chain the motion from the start of the input.
   function repeat_command(task, from, overrides, point) result(line)
      class(sweep_task_t), intent(in) :: task
      character(*), intent(in) :: from
      type(string_t), intent(in) :: overrides(:)
      integer(i8), intent(in) :: point
      character(:), allocatable :: line

      real(wp) :: values(size(task%varied))
      integer :: i, k

      line = "razy-run "//in_quotes(from)
      do i = 1, size(overrides)
         line = line//" --set "//in_quotes(overrides(i)%text)
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
            line = line//" --set "//in_quotes("start_range("//to_text(i)//")%values="// &
                                              to_text(task%starts%value(i, task%plan%grid_point(point), task%plan%start_of(point))))
         end do
      end if
      line = line//" --output point_"//to_text(point - 1)//".h5"
      if (task%plan%has_chains()) line = line//" (in the sweep it began where another ended)"
   end function repeat_command

   !> A word for the shell, in quotes if it needs them.
   pure function in_quotes(word) result(written)
      character(*), intent(in) :: word
      character(:), allocatable :: written

      written = word
      if (verify(word, name_characters//"%=+-./,:") > 0) written = quoted(word, after="\''")
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

   !> How many points are in the checkpoint of a result file.
   function points_done(task, checkpoint, output) result(line)
      class(sweep_task_t), intent(in) :: task
      type(checkpoint_t), intent(in) :: checkpoint
      character(*), intent(in) :: output
      character(:), allocatable :: line

      line = to_text(checkpoint%n_done)//" of "//to_text(task%plan%points)//" points are done, in "//checkpoint_path(output)
   end function points_done

   !> The line of a complete sweep: failures, and points with near misses if there are any.
   function what_was_written(task, checkpoint, outcome, output) result(line)
      class(sweep_task_t), intent(in) :: task
      type(checkpoint_t), intent(in) :: checkpoint
      type(sweep_outcome_t), intent(in) :: outcome
      character(*), intent(in) :: output
      character(:), allocatable :: line

      integer(i8) :: missing

      line = "wrote "//output//": "//counted(to_text(task%plan%points), "point")//", "// &
             to_text(checkpoint%tally_of("/point/status"))//" failed, "//decimal(outcome%elapsed, 3)//" s, ranks busy "// &
             decimal(100*outcome%efficiency(), 1)//" %"
      missing = checkpoint%tally_of("/point/near_misses")
      if (missing > 0) line = line//", near misses at "//counted(to_text(missing), "point")
      missing = checkpoint%tally_of("/point/unbalanced")
      if (missing > 0) line = line//", balances missed at "//counted(to_text(missing), "point")
   end function what_was_written

end module razy_study_sweep_log
