!! razy-modes: natural frequencies and shapes; for rotors the Campbell diagram, critical speeds and stability limit.
program razy_modes
   use command_line, only: command_t, exit_usage
   use program_frame, only: begin_program, end_checks, end_program, fail
   use razy_core_error, only: error_t
   use razy_core_table, only: table_t
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_io_result_file, only: new_header
   use razy_study_modes_modes, only: find_modes, modes_task_t, new_modes
   use razy_study_modes_result, only: modes_result_t
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(modes_task_t) :: task
   type(modes_result_t) :: result
   type(table_t) :: table
   type(string_t) :: none(0)

   call begin_program("razy-modes", "natural frequencies and shapes, Campbell diagram, critical speeds, stability, response", &
                      command, input)
   call new_modes(task, input, error)
   call end_checks(command, input, error)
   call find_modes(task, result, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   call result%columns(table)
   call end_program(command, new_header("razy-modes", task%title, "", "", input%effective()), table, none, result%words())

end program razy_modes
