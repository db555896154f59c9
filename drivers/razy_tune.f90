!! razy-tune: the parameter with which a natural frequency has the value that &tune asks for.
program razy_tune
   use command_line, only: command_t, exit_usage
   use program_frame, only: begin_program, end_checks, end_program, fail
   use razy_core_error, only: error_t
   use razy_core_table, only: table_t
   use razy_input_input, only: input_t
   use razy_io_result_file, only: new_header
   use razy_study_tune, only: new_tune, solve_tune, tune_t
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(tune_t) :: task
   type(table_t) :: table

   call begin_program("razy-tune", "find the parameter with which a natural frequency has a given value", command, input)
   call new_tune(task, input, error)
   call end_checks(command, input, error)
   call solve_tune(task, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   call task%columns(table)
   call end_program(command, new_header("razy-tune", task%machine%title, "", "", input%effective()), table, task%words())

end program razy_tune
