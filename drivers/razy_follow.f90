!! razy-follow: periodic motions over a parameter, stable or not, and where they change their kind.
program razy_follow
   use command_line, only: command_t, exit_failure, exit_usage, say
   use program_frame, only: begin_program, end_checks, fail
   use razy_core_error, only: error_t
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_study_follow_follow, only: follow_t, new_follow
   use razy_study_follow_result, only: follow_words, write_follow
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(follow_t) :: task
   type(string_t), allocatable :: lines(:)
   integer :: i

   call begin_program("razy-follow", "follow periodic motions over a parameter, stable or not, through their bifurcations", &
                      command, input)
   call new_follow(task, input, error)
   call end_checks(command, input, error)
   call task%compute(error)
   if (allocated(error)) call fail(error%message, exit_usage)
   lines = follow_words(task)
   do i = 1, size(lines)
      call say(lines(i)%text)
   end do
   call write_follow(task, command%output, command%force, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   call say("wrote "//command%output)

end program razy_follow
