!! razy-duel: one motion by several integrators, error against cost.
program razy_duel
   use command_line, only: command_t, exit_failure, say
   use duel, only: compute_duel
   use duel_case, only: entry_t, read_entries
   use, intrinsic :: iso_fortran_env, only: output_unit
   use program_frame, only: begin_program, end_checks, fail
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_io_duel_file, only: duel_content_t, write_duel_file
   use razy_io_header, only: result_header_t
   use razy_machine_machine, only: machine_t
   use razy_scenes_records, only: record_t
   use razy_scenes_case, only: motion_t, new_machine
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(machine_t) :: machine
   type(motion_t) :: motion
   type(record_t), allocatable :: records(:)
   type(entry_t), allocatable :: entries(:)
   type(result_header_t) :: header
   type(duel_content_t) :: content
   integer :: i

   call begin_program("razy-duel", "compute one motion by several integrators: error against cost", command, input)
   call new_machine(machine, motion, records, input, error)
   if (.not. allocated(error)) call read_entries(entries, motion%method, machine, input, error)
   call end_checks(command, input, error)
   call compute_duel(machine, motion, entries, content, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   header%program = "razy-duel"
   header%title = machine%title
   header%integrator = "several"
   header%treatment = "several"
   header%input = input%effective()
   call write_duel_file(command%output, header, content, command%force, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   call print_table()
   call say("wrote "//command%output)

contains

   !> The rows as a table on standard output.
   subroutine print_table()
      character(*), parameter :: form = "(a16, 1x, a13, 1x, es9.2, 1x, es9.2, 1x, es9.2, 1x, es9.2, i9, i8, i8, i11, i10, 2x, a)"

      write (output_unit, "(a, es9.2, a, es9.2, a)") "reference: "//content%reference//"; against "//content%check// &
         " its error is ", content%reference_error, ", that of its event times ", content%reference_event_error, " s"
      write (output_unit, "(a16, 1x, a13, 4(1x, a9), a9, a8, a8, a11, a10, 2x, a)") "method", "treatment", "setting", "error", &
         "events, s", "cpu, s", "events", "surplus", "doubts", "rhs", "steps", "status"
      do i = 1, size(content%setting)
         write (output_unit, form) content%method(i), content%treatment(i), content%setting(i), content%error(i), &
            content%event_time_error(i), content%cpu_time(i), content%events(i), content%event_surplus(i), &
            content%doubts(i), content%evaluations(i), content%steps(i), trim(content%status_meanings(content%status(i) + 1))
      end do
   end subroutine print_table

end program razy_duel
