!! razy-modes: natural frequencies and shapes; for rotors the Campbell diagram, critical speeds and stability limit.
program razy_modes
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, exit_failure, exit_usage, finish, print_help, print_version, read_command, say
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_io_header, only: result_header_t
   use razy_io_output, only: output_is_free
   use razy_io_modes_file, only: modes_content_t, write_modes_file
   use razy_scenes_study, only: read_study
   use modes_case, only: find_modes, modes_task_t, new_modes
   use modes_words, only: words_of
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(modes_task_t) :: task
   type(modes_content_t) :: content
   type(result_header_t) :: header
   type(string_t), allocatable :: lines(:)
   character(:), allocatable :: text
   integer :: i

   call read_command(command, .false., error)
   if (allocated(error)) call fail("razy-modes: "//error%message, exit_usage)
   if (command%help) call print_help("razy-modes", "natural frequencies and shapes, Campbell diagram, critical speeds, stability", &
                                     .false.)
   if (command%version) call print_version("razy-modes")
   if (command%help .or. command%version) stop
   call read_text_file(command%input, text, error)
   if (.not. allocated(error)) call read_study(input, text, command%input, command%overrides, error)
   if (.not. allocated(error)) call new_modes(task, input, error)
   if (.not. allocated(error) .and. .not. command%check) call output_is_free(command%output, command%force, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   if (command%check) then
      write (output_unit, "(a)", advance="no") input%effective()
      stop
   end if
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

contains

   subroutine fail(line, code)
      character(*), intent(in) :: line
      integer, intent(in) :: code

      call say(line)
      call finish(code)
   end subroutine fail

end program razy_modes
