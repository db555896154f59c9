!! razy-sweep: many motions over a parameter, under mpirun or alone.
program razy_sweep
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use command_line, only: command_t, exit_failure, exit_interrupted, exit_ok, exit_usage, of_a_sweep, say
   use measuring, only: begin_measuring, longest_measuring, measured_enough
   use program_frame, only: check_files, read_case
   use progress, only: show_progress
   use rank_frame, only: begin_ranks, end_killed_end, end_ranks, leave_if
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: counted, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_io_posix, only: path_exists
   use razy_scenes_case, only: read_study
   use razy_study_sweep_forecast, only: forecast, most_timed
   use razy_study_sweep_log, only: log_end, log_start, open_log, points_done, what_was_written
   use razy_study_sweep_result, only: write_sweep
   use razy_study_sweep_starts, only: identity_of, read_start_file
   use razy_study_sweep_task, only: new_sweep, sweep_task_t
   use razy_sweep_checkpoint, only: checkpoint_path, checkpoint_t
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_protocol, only: sweep_options_t
   use razy_sweep_scheduler, only: run_sweep, sweep_outcome_t
   use razy_sweep_units, only: units_t
   use signals, only: time_is_up
   implicit none(type, external)

   type(communicator_t) :: ranks
   type(command_t) :: command
   type(error_t), allocatable :: error
   type(sweep_task_t) :: task
   type(units_t) :: units
   type(checkpoint_t) :: checkpoint
   type(sweep_options_t) :: options
   type(sweep_outcome_t) :: outcome
   ! Kept to the end: LeakSanitizer takes what an optimised program lets go of as lost.
   character(:), allocatable, save :: effective
   !> What the file of starts has, if there is one.
   real(wp), allocatable, save :: starts(:)
   !> Whether there is anything to compute; whether all points failed.
   logical :: go_on = .false., failed = .false.

   call begin_ranks(ranks)
   if (ranks%is_root()) call prepare(error)
   call leave_if(ranks, error, exit_usage)
   call ranks%broadcast(go_on)
   if (go_on) call compute()
   if (outcome%stopped) call end_ranks(ranks, exit_interrupted)
   call end_ranks(ranks, merge(exit_failure, exit_ok, failed))

contains

   !> Rank 0 reads and checks everything before anything runs.
   subroutine prepare(error)
      type(error_t), allocatable, intent(out) :: error

      type(input_t) :: input
      type(string_t), allocatable :: lines(:), written(:)
      integer :: i
      logical :: answered

      go_on = .false.
      call read_case("razy-sweep", &
                     "compute many motions over a parameter; also under mpirun", &
                     of_a_sweep, command, input, answered, error)
      if (answered) return
      if (.not. allocated(error)) call read_start_file(starts, input, error)
      if (.not. allocated(error)) call new_sweep(task, input, starts, error)
      if (allocated(error)) return
      effective = input%effective()
      if (command%check) then
         write (output_unit, "(a)", advance="no") effective
      else if (command%dry_run) then
         call say("measuring up to "//to_text(most_timed)//" points, for "//to_text(longest_measuring)//" s at most")
         call begin_measuring()
         task%watch%stop_is_asked => measured_enough
         call forecast(task, ranks%size, lines)
         outcome%stopped = time_is_up()
         if (.not. outcome%stopped) write (output_unit, "(a)") (lines(i)%text, i=1, size(lines))
      else
         allocate (written(0))
         call append_text(written, checkpoint_path(command%output))
         if (allocated(command%log)) then
            if (command%log /= "-") call append_text(written, command%log)
         end if
         call end_killed_end(command, effective)
         call check_files(command, input, written, error)
         if (command%so_far .and. .not. allocated(error)) then
            call write_so_far(error)
         else
            go_on = .true.
         end if
      end if
   end subroutine prepare

   !> The result file of the points that are in the checkpoint.
   subroutine write_so_far(error)
      type(error_t), allocatable, intent(out) :: error

      if (.not. path_exists(checkpoint_path(command%output))) then
         call raise(error, checkpoint_path(command%output)//": there is no such file; make it a copy of the checkpoint "// &
                    "of a sweep under way")
      else if (task%starts%wanted) then
         call raise(error, "--so-far: not for a sweep with &starts, whose attractors are found when all points are there")
      end if
      if (allocated(error)) return
      units%plan = task%plan
      call open_checkpoint(error)
      if (allocated(error)) return
      call write_sweep(task, checkpoint, command%output, command%force, error)
      if (.not. allocated(error)) call checkpoint%remove(error)
      if (.not. allocated(error)) call say("wrote "//command%output//": "//to_text(checkpoint%n_done)//" of "// &
                                           counted(to_text(task%plan%points), "point"))
   end subroutine write_so_far

   subroutine compute()
      type(input_t) :: input
      type(string_t) :: none(0)

      call ranks%broadcast(effective)
      call ranks%broadcast(starts)
      if (.not. ranks%is_root()) then
         call read_study(input, effective, "effective input", none, error)
         if (.not. allocated(error)) call new_sweep(task, input, starts, error)
      end if
      call leave_if(ranks, error, exit_failure)
      task%watch%stop_is_asked => time_is_up
      units%plan = task%plan
      if (ranks%is_root()) call open_checkpoint(error)
      call leave_if(ranks, error, exit_usage)
      call units%share(ranks)
      options%ask_ahead = .not. task%plan%has_chains()
      call run_sweep(ranks, task, units, checkpoint, options, show_progress, outcome, error, time_is_up)
      if (ranks%is_root()) call end_sweep(error)
      call leave_if(ranks, error, exit_failure)
      call ranks%broadcast(failed)
   end subroutine compute

   !> Lock the checkpoint, say what is there already, and begin the log.
   subroutine open_checkpoint(error)
      type(error_t), allocatable, intent(out) :: error

      type(table_t) :: row
      integer :: unit

      checkpoint%interval = command%checkpoint
      checkpoint%most_rows = command%checkpoint_points
      call task%describe(row)
      if (command%anew) call checkpoint%discard_old(command%output, error)
      if (.not. allocated(error)) call checkpoint%open(command%output, effective//identity_of(starts), row, units, error)
      if (allocated(error)) return
      if (checkpoint%dropped()) call say(checkpoint_path(command%output)//": what is behind its last whole record is dropped")
      if (checkpoint%n_done > 0) call say("going on: "//points_done(task, checkpoint, command%output))
      if (.not. allocated(command%log)) return
      call open_log(command%log, error_unit, unit, error)
      if (allocated(error)) return
      call log_start(unit, task, checkpoint, command%input, command%output, ranks%size)
      if (unit /= error_unit) close (unit)
   end subroutine open_checkpoint

   !> Have all rows on disk before the ranks part, end the log, and write the file of a complete sweep.
   subroutine end_sweep(error)
      type(error_t), allocatable, intent(inout) :: error

      integer :: unit

      if (.not. allocated(error)) call checkpoint%secure(error)
      if (allocated(error)) then
         call checkpoint%give_up(error)
         return
      end if
      unit = error_unit
      if (allocated(command%log)) call open_log(command%log, error_unit, unit, error)
      if (.not. allocated(error)) call log_end(unit, allocated(command%log), task, checkpoint, outcome, command%input, &
                                               command%overrides, error)
      if (unit /= error_unit) close (unit)
      if (allocated(error)) return
      if (outcome%stopped) then
         call say("stopped: "//points_done(task, checkpoint, command%output))
         return
      end if
      call write_sweep(task, checkpoint, command%output, command%force, error)
      if (allocated(error)) then
         call checkpoint%give_up(error)
         return
      end if
      failed = checkpoint%tally_of("/point/status") == task%plan%points
      call checkpoint%remove(error)
      if (.not. allocated(error)) call say(what_was_written(task, checkpoint, outcome, command%output))
   end subroutine end_sweep

end program razy_sweep
