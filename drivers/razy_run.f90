!! razy-run: one motion, with what &record asks for.
program razy_run
   use command_line, only: command_t, exit_failure, say
   use one_motion, only: compute
   use program_frame, only: begin_program, end_checks, fail
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_io_header, only: result_header_t
   use razy_io_run_file, only: run_content_t, write_run_file
   use razy_machine_machine, only: machine_t
   use sweep_starts, only: new_starts, starts_t
   use razy_scenes_records, only: record_t
   use razy_scenes_start, only: check_start
   use razy_scenes_case, only: motion_t, new_drawing, new_machine
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(machine_t) :: machine
   type(motion_t) :: motion
   type(record_t), allocatable :: records(:)
   type(result_header_t) :: header
   type(run_content_t) :: content
   character(:), allocatable :: problem

   call begin_program("razy-run", "compute one motion: trajectory, events, extrema, as &record asks", command, input)
   call new_machine(machine, motion, records, input, error)
   if (.not. allocated(error)) call apply_single_start(error)
   call end_checks(command, input, error)
   call compute(machine, motion, records, content, problem, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   header%program = "razy-run"
   header%title = machine%title
   header%integrator = trim(motion%method%integrator)
   header%treatment = trim(motion%method%treatment)
   header%input = input%effective()
   call new_drawing(header%drawing, input, error)
   if (.not. allocated(error)) call write_run_file(command%output, header, content, command%force, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   call say("wrote "//command%output)
   if (content%outcome%doubts > 0) call say(doubts_said(content%outcome%doubts, content%outcome%doubt_time))
   if (allocated(problem)) call fail(problem, exit_failure)

contains

   function doubts_said(count, time) result(line)
      integer(i8), intent(in) :: count
      real(wp), intent(in) :: time
      character(:), allocatable :: line

      line = to_text(count)//" events in doubt, the first after "//to_text(time)//" s: closer than the method resolves, so "// &
             "they may be missed or none (docs/hard_cases.md)"
   end function doubts_said

   !> Begin from the start of &starts if that is one alone, as razy-sweep names it for a point; several are for razy-sweep.
   subroutine apply_single_start(error)
      type(error_t), allocatable, intent(out) :: error

      type(starts_t) :: starts

      call new_starts(starts, machine, input, error)
      if (allocated(error)) return
      if (.not. starts%wanted) return
      if (starts%method /= "list" .or. starts%count /= 1) return
      call starts%apply(machine, 1_i8, 1_i8)
      call check_start(machine, input, error)
   end subroutine apply_single_start

end program razy_run
