!! razy-tune: the parameter with which a natural frequency has the value that &tune asks for.
program razy_tune
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, exit_failure, exit_usage, finish, print_help, print_version, read_command, say
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_text, only: string_t
   use razy_core_text_file, only: read_text_file
   use razy_io_header, only: result_header_t
   use razy_io_output, only: output_is_free
   use razy_io_tune_file, only: tune_content_t, write_tune_file
   use razy_scenes_study, only: read_study
   use tune_case, only: new_tune, solve_tune, tune_content, tune_t
   use tune_words, only: words_of
   implicit none(type, external)

   type(command_t) :: command
   type(error_t), allocatable :: error
   type(input_t) :: input
   type(tune_t) :: task
   type(tune_content_t) :: content
   type(result_header_t) :: header
   type(string_t), allocatable :: lines(:)
   character(:), allocatable :: text
   integer :: i

   call read_command(command, .false., error)
   if (allocated(error)) call fail("razy-tune: "//error%message, exit_usage)
   if (command%help) call print_help("razy-tune", "find the parameter with which a natural frequency has a given value", &
                                     .false.)
   if (command%version) call print_version("razy-tune")
   if (command%help .or. command%version) stop
   call read_text_file(command%input, text, error)
   if (.not. allocated(error)) call read_study(input, text, command%input, command%overrides, error)
   if (.not. allocated(error)) call new_tune(task, input, error)
   if (.not. allocated(error) .and. .not. command%check) call output_is_free(command%output, command%force, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   if (command%check) then
      write (output_unit, "(a)", advance="no") input%effective()
      stop
   end if
   call solve_tune(task, error)
   if (allocated(error)) call fail(error%message, exit_usage)
   call tune_content(task, content, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   header%program = "razy-tune"
   header%title = task%machine%title
   header%input = input%effective()
   call write_tune_file(command%output, header, content, command%force, error)
   if (allocated(error)) call fail(error%message, exit_failure)
   lines = words_of(task)
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

end program razy_tune
