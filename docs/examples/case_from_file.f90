!! Runs the case of a namelist file, as razy-run does, prints how it ended, and writes the result file case_from_file.h5.
program case_from_file
   use razy_core_error, only: error_t
   use razy_core_table, only: table_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_input_input, only: input_t
   use razy_io_result_file, only: new_header, write_result
   use razy_motion_integrator, only: status_meanings
   use razy_scenes_case, only: read_study
   use razy_study_run, only: new_run, run_t
   implicit none(type, external)

   type(error_t), allocatable :: error
   type(input_t) :: input
   type(run_t) :: run
   type(table_t) :: table
   type(string_t) :: overrides(0)
   character(:), allocatable :: text
   character(1024) :: file

   call get_command_argument(1, file)
   call read_text_file(trim(file), text, error)
   if (.not. allocated(error)) call read_study(input, text, trim(file), overrides, error)
   if (.not. allocated(error)) call new_run(run, input, error)
   if (.not. allocated(error)) call run%compute(error)
   if (allocated(error)) error stop error%message
   print "(a, i0, a, f0.3, a)", trim(status_meanings(run%outcome%status))//": ", run%outcome%events, " events until ", &
      run%outcome%time, " s"
   call run%columns(table)
   call write_result("case_from_file.h5", new_header("case_from_file", run%machine%title, run%motion%method%integrator, &
                                                     run%motion%method%treatment, input%effective()), table, .true., error)
   if (allocated(error)) error stop error%message

end program case_from_file
