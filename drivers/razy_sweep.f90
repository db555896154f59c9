!! razy-sweep: many motions over a parameter, under mpirun or alone.
program razy_sweep
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, decimal, exit_failure, exit_ok, exit_usage, finish, print_help, print_version, &
                           read_command, say
   use mpi_f08, only: mpi_comm_world
   use progress, only: show_progress
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_io_header, only: result_header_t
   use razy_io_output, only: output_is_free
   use razy_io_sweep_file, only: sweep_content_t, write_sweep_file
   use razy_scenes_study, only: new_drawing, read_study
   use razy_sweep_communicator, only: communicator_t, new_communicator
   use razy_sweep_mpi, only: finish_mpi, start_mpi
   use razy_sweep_scheduler, only: run_sweep, sweep_options_t, sweep_outcome_t
   use sweep_case, only: new_sweep, sweep_content, sweep_task_t
   implicit none(type, external)

   type(communicator_t) :: ranks
   type(command_t) :: command
   type(error_t), allocatable :: error
   type(sweep_task_t) :: task
   character(:), allocatable :: effective
   logical :: go_on

   call start_mpi(error)
   if (.not. allocated(error)) call new_communicator(ranks, mpi_comm_world, error)
   if (allocated(error)) then
      call say("razy-sweep: "//error%message)
      call finish(exit_failure)
   end if
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
      call read_command(command, error)
      if (allocated(error)) return
      if (command%help) call print_help("razy-sweep", "compute many motions over a parameter; also under mpirun")
      if (command%version) call print_version("razy-sweep")
      if (command%help .or. command%version) return
      call read_text_file(command%input, text, error)
      if (.not. allocated(error)) call read_study(input, text, command%input, command%overrides, error)
      if (.not. allocated(error)) call new_sweep(task, input, error)
      if (.not. allocated(error) .and. .not. command%check) call output_is_free(command%output, command%force, error)
      if (allocated(error)) return
      effective = input%effective()
      go_on = .not. command%check
      if (command%check) write (output_unit, "(a)", advance="no") effective
   end subroutine read_case

   subroutine compute()
      type(sweep_outcome_t) :: outcome
      type(input_t) :: input
      type(string_t) :: none(0)

      call ranks%broadcast(effective, error)
      call leave_if(exit_failure)
      if (.not. ranks%is_root()) then
         call read_study(input, effective, "effective input", none, error)
         if (.not. allocated(error)) call new_sweep(task, input, error)
      else
         call task%prepare_root(task%axis%n_values())
      end if
      call leave_if(exit_failure)
      call run_sweep(ranks, task, task%axis%n_values(), sweep_options_t(), show_progress, outcome, error)
      call leave_if(exit_failure)
      if (ranks%is_root()) call write_results(outcome, error)
      call leave_if(exit_failure)
      call end_ranks(exit_ok)
   end subroutine compute

   subroutine write_results(outcome, error)
      type(sweep_outcome_t), intent(in) :: outcome
      type(error_t), allocatable, intent(out) :: error

      type(result_header_t) :: header
      type(sweep_content_t) :: content
      character(80) :: line

      call sweep_content(task, content)
      header%program = "razy-sweep"
      header%title = task%title
      header%integrator = trim(task%method%integrator)
      header%treatment = trim(task%method%treatment)
      header%input = effective
      call new_drawing(header%drawing, task%input, error)
      if (allocated(error)) return
      call write_sweep_file(command%output, header, content, command%force, error)
      if (allocated(error)) return
      write (line, "(i0, a, i0, a)") size(content%status), " points, ", count(content%status /= 0), " failed, "
      call say("wrote "//command%output//": "//trim(line)//" "//decimal(outcome%elapsed, 3)//" s, ranks busy "// &
               decimal(100*outcome%efficiency(), 1)//" %")
   end subroutine write_results

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
