!! razy-sweep: many motions over a parameter, under mpirun or alone.
program razy_sweep
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, decimal, exit_failure, exit_interrupted, exit_ok, exit_usage, finish, print_help, &
                           print_version, read_command, say
   use mpi_f08, only: mpi_comm_world
   use progress, only: show_progress
   use razy_core_error, only: error_t, raise
   use razy_input_input, only: input_t
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_io_header, only: result_header_t
   use razy_io_output, only: output_is_free
   use razy_scenes_case, only: new_drawing, read_study
   use razy_sweep_checkpoint, only: checkpoint_path
   use razy_sweep_communicator, only: communicator_t, new_communicator
   use razy_sweep_mpi, only: finish_mpi, start_mpi
   use razy_sweep_scheduler, only: run_sweep, sweep_options_t, sweep_outcome_t
   use signals, only: hold_signals, time_is_up
   use sweep_case, only: new_sweep, sweep_task_t
   use sweep_forecast, only: forecast
   use sweep_log, only: log_end, log_start
   use sweep_result, only: write_results
   use sweep_start_file, only: identity_of, read_start_file
   implicit none(type, external)

   type(communicator_t) :: ranks
   type(command_t) :: command
   type(error_t), allocatable :: error
   type(sweep_task_t) :: task
   character(:), allocatable :: effective
   !> What the file of starts has, if there is one.
   real(wp), allocatable :: starts(:)
   logical :: go_on, held

   call hold_signals(held)
   call start_mpi(error)
   if (.not. allocated(error)) call new_communicator(ranks, mpi_comm_world, error)
   if (allocated(error)) then
      call say("razy-sweep: "//error%message)
      call finish(exit_failure)
   end if
   if (.not. held .and. ranks%is_root()) call say("razy-sweep: signals cannot be held back; one of them ends the sweep at once")
   if (ranks%is_root()) call read_case(effective, go_on, error)
   call leave_if(exit_usage)
   call ranks%broadcast(go_on, error)
   call leave_if(exit_failure)
   if (go_on) then
      call compute()
   else
      call end_ranks(exit_ok)
   end if

contains

   !> Rank 0 reads and checks everything before anything runs.
   subroutine read_case(effective, go_on, error)
      character(:), allocatable, intent(out) :: effective
      logical, intent(out) :: go_on
      type(error_t), allocatable, intent(out) :: error

      type(input_t) :: input
      character(:), allocatable :: text

      go_on = .false.
      effective = ""
      call read_command(command, .true., error)
      if (allocated(error)) return
      if (command%help) call print_help("razy-sweep", "compute many motions over a parameter; also under mpirun", .true.)
      if (command%version) call print_version("razy-sweep")
      if (command%help .or. command%version) return
      call read_text_file(command%input, text, error)
      if (.not. allocated(error)) call read_study(input, text, command%input, command%overrides, error)
      if (.not. allocated(error)) call read_start_file(starts, input, error)
      if (.not. allocated(error)) call new_sweep(task, input, starts, error)
      if (.not. allocated(error) .and. .not. (command%check .or. command%dry_run)) then
         call output_is_free(command%output, command%force, error)
      end if
      if (allocated(error)) return
      effective = input%effective()
      go_on = .not. (command%check .or. command%dry_run)
      if (command%dry_run .and. .not. command%check) call forecast(task, ranks%size)
      if (command%check) write (output_unit, "(a)", advance="no") effective
   end subroutine read_case

   subroutine compute()
      type(sweep_options_t) :: options
      type(sweep_outcome_t) :: outcome
      type(input_t) :: input
      type(string_t) :: none(0)

      call ranks%broadcast(effective, error)
      if (.not. allocated(error)) call ranks%broadcast(starts, error)
      call leave_if(exit_failure)
      if (.not. ranks%is_root()) then
         call read_study(input, effective, "effective input", none, error)
         if (.not. allocated(error)) call new_sweep(task, input, starts, error)
      end if
      call leave_if(exit_failure)
      if (ranks%is_root()) call open_checkpoint(error)
      call leave_if(exit_usage)
      if (ranks%is_root()) call log_start(task, command, ranks%size, error)
      call leave_if(exit_usage)
      call task%share_plan(ranks, error)
      call leave_if(exit_failure)
      options%results = task%plan%points - task%plan%n_done
      options%ask_ahead = .not. task%plan%has_chains()
      call run_sweep(ranks, task, task%plan%units(), options, show_progress, outcome, error, time_is_up)
      if (ranks%is_root()) call secure(error)
      call leave_if(exit_failure)
      if (ranks%is_root()) call log_end(task, command, outcome, sum(outcome%points), error)
      call leave_if(exit_failure)
      if (outcome%stopped) then
         if (ranks%is_root()) call say("stopped: "//safe_points())
         call end_ranks(exit_interrupted)
         return
      end if
      if (ranks%is_root()) call write_file(outcome, error)
      call leave_if(exit_failure)
      call end_ranks(exit_ok)
   end subroutine compute

   !> Lock the checkpoint, and say what is there already.
   subroutine open_checkpoint(error)
      type(error_t), allocatable, intent(out) :: error

      task%checkpoint%interval = command%checkpoint
      task%checkpoint%most_results = command%checkpoint_points
      if (command%anew) call task%checkpoint%discard_old(command%output, error)
      if (.not. allocated(error)) call task%prepare_root(command%output, effective//identity_of(starts), error)
      if (allocated(error)) return
      if (task%checkpoint%journal%dropped > 0) then
         call say(checkpoint_path(command%output)//": its last record was not complete, and is dropped")
      end if
      if (task%plan%n_done > 0) call say("going on: "//safe_points())
   end subroutine open_checkpoint

   !> Have all results on disk before the ranks part or the file is written; a full disk is told with what is safe.
   subroutine secure(error)
      type(error_t), allocatable, intent(inout) :: error

      type(error_t), allocatable :: failure

      if (.not. allocated(error)) call task%checkpoint%settle(failure, now=.true.)
      if (allocated(failure)) call move_alloc(failure, error)
      if (allocated(error)) call tell_safe(error)
   end subroutine secure

   !> Add to a failure what is safe in spite of it.
   subroutine tell_safe(error)
      type(error_t), allocatable, intent(inout) :: error

      character(:), allocatable :: message

      call task%checkpoint%close()
      message = error%message//"; what was computed is safe in "//checkpoint_path(command%output)// &
                ", and the same command goes on from there"
      call raise(error, message)
   end subroutine tell_safe

   !> How many points are in the checkpoint.
   function safe_points() result(text)
      character(:), allocatable :: text

      character(80) :: line

      write (line, "(i0, a, i0, a)") task%plan%n_done, " of ", task%plan%points, " points are done, "
      text = trim(line)//" in "//checkpoint_path(command%output)
   end function safe_points

   subroutine write_file(outcome, error)
      type(sweep_outcome_t), intent(in) :: outcome
      type(error_t), allocatable, intent(out) :: error

      type(result_header_t) :: header
      integer(i8) :: failed, doubtful
      character(80) :: line

      header%program = "razy-sweep"
      header%title = task%title
      header%integrator = trim(task%method%integrator)
      header%treatment = trim(task%method%treatment)
      header%input = effective
      call new_drawing(header%drawing, task%input, error)
      if (allocated(error)) return
      call write_results(task, command%output, header, command%force, failed, doubtful, error)
      if (allocated(error)) then
         call tell_safe(error)
         return
      end if
      call task%checkpoint%remove(error)
      if (allocated(error)) return
      write (line, "(i0, a, i0, a)") task%plan%points, " points, ", failed, " failed, "
      call say("wrote "//command%output//": "//trim(line)//" "//decimal(outcome%elapsed, 3)//" s, ranks busy "// &
               decimal(100*outcome%efficiency(), 1)//" %"//doubts_said(doubtful))
   end subroutine write_file

   !> What the closing line says of points with events in doubt: nothing if there are none.
   function doubts_said(points) result(text)
      integer(i8), intent(in) :: points
      character(:), allocatable :: text

      character(40) :: number

      text = ""
      if (points == 0) return
      write (number, "(i0)") points
      text = ", events in doubt at "//trim(number)//trim(merge(" points", " point ", points > 1))
   end function doubts_said

   !> Leave together with one message if any rank has an error.
   subroutine leave_if(code)
      integer, intent(in) :: code

      call ranks%agree(error)
      if (.not. allocated(error)) return
      if (ranks%is_root()) call say(error%message)
      call end_ranks(code)
   end subroutine leave_if

   subroutine end_ranks(code)
      integer, intent(in) :: code

      type(error_t), allocatable :: ignored

      call ranks%free(ignored)
      call finish_mpi(ignored)
      call finish(code)
   end subroutine end_ranks

end program razy_sweep
