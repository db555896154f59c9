!! razy-duel: one motion by several integrators, error against cost.
program razy_duel
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, exit_failure
   use program_frame, only: begin_program, end_checks, end_program, fail
   use razy_core_error, only: error_t
   use razy_core_table, only: table_t
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_io_result_file, only: new_header
   use razy_machine_machine, only: machine_t
   use razy_scenes_case, only: motion_t, new_machine
   use razy_scenes_records, only: record_t
   use razy_study_duel, only: compute_duel, duel_t, entry_t, read_entries
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(machine_t) :: machine
   type(motion_t) :: motion
   ! Kept to the end: LeakSanitizer takes what an optimised program lets go of as lost.
   type(record_t), allocatable, save :: records(:)
   type(entry_t), allocatable, save :: entries(:)
   type(duel_t) :: duel
   type(table_t) :: table
   type(string_t), allocatable, save :: lines(:)
   integer :: i

   call begin_program("razy-duel", "compute one motion by several integrators: error against cost", command, input)
   call new_machine(machine, motion, records, input, error)
   if (.not. allocated(error)) call read_entries(entries, motion%method, machine, input, error)
   call end_checks(command, input, error)
   call compute_duel(duel, machine, motion, entries, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   call duel%columns(table)
   lines = duel%words()
   write (output_unit, "(a)") (lines(i)%text, i=1, size(lines))
   call end_program(command, new_header("razy-duel", machine%title, "several", "several", input%effective()), table, lines(:0))

end program razy_duel
