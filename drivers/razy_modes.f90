!! razy-modes: natural frequencies and shapes; for rotors the Campbell diagram, critical speeds and stability limit.
program razy_modes
   use command_line, only: command_t, exit_failure, exit_usage, say
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_text, only: string_t
   use razy_io_header, only: result_header_t
   use razy_io_modes_file, only: modes_content_t, write_modes_file
   use modes_case, only: find_modes, modes_task_t, new_modes
   use modes_words, only: words_of
   use program_frame, only: begin_program, end_checks, fail
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(modes_task_t) :: task
   type(modes_content_t) :: content
   type(result_header_t) :: header
   type(string_t), allocatable :: lines(:)
   integer :: i

   call begin_program("razy-modes", "natural frequencies and shapes, Campbell diagram, critical speeds, stability", command, input)
   call new_modes(task, input, error)
   call end_checks(command, input, error)
   call find_modes(task, content, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   header%program = "razy-modes"
   header%title = task%title
   header%input = input%effective()
   call write_modes_file(command%output, header, content, command%force, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   lines = words_of(content)
   do i = 1, size(lines)
      call say(lines(i)%text)
   end do
   call say("wrote "//command%output)

end program razy_modes
