!! razy-run: one motion, with what &record asks for.
program razy_run
   use command_line, only: command_t, exit_failure, finish
   use program_frame, only: begin_program, end_checks, end_program, fail
   use razy_core_error, only: error_t
   use razy_core_table, only: table_t
   use razy_input_input, only: input_t
   use razy_io_result_file, only: new_header
   use razy_motion_integrator, only: status_ok
   use razy_study_run, only: new_run, run_t
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(run_t) :: run
   type(table_t) :: table

   call begin_program("razy-run", "compute one motion: trajectory, events, extrema, as &record asks", command, input)
   call new_run(run, input, error)
   call end_checks(command, input, error, run%machine%caution)
   call run%compute(error)
   if (allocated(error)) call fail(error%message, exit_failure)
   call run%columns(table)
   call end_program(command, new_header("razy-run", run%machine%title, run%motion%method%integrator, &
                                        run%motion%method%treatment, input%effective()), table, run%words(), run%answer())
   if (run%outcome%status /= status_ok) call finish(exit_failure)

end program razy_run
