!! What programs that run alone do before they compute, and how they give up.
module program_frame
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, exit_failure, exit_usage, finish, of_one, print_help, print_version, read_command, say
   use razy_core_error, only: error_t, raise
   use razy_input_input, only: input_t
   use razy_core_text_file, only: read_text_file
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_io_posix, only: check_distinct
   use razy_io_result_file, only: check_output, result_header_t, write_result
   use razy_linalg_threads, only: use_one_thread
   use razy_scenes_case, only: read_study
   use signals, only: hold_signals, let_writes_fail
   implicit none(type, external)
   private

   public :: begin_program, check_files, end_checks, end_program, fail, read_case

contains

   !> Read arguments and input; ends the program with --help, --version, and with the first mistake.
   subroutine begin_program(name, does, command, input)
      character(*), intent(in) :: name, does
      type(command_t), intent(out) :: command
      type(input_t), intent(out) :: input

      type(error_t), allocatable :: error
      logical :: answered

      call use_one_thread()
      call let_writes_fail()
      call read_case(name, does, of_one, command, input, answered, error)
      if (allocated(error)) call fail(error%message, exit_usage)
      if (answered) stop, quiet = .true.
   end subroutine begin_program

   !> Read arguments, of this scope, and input; with --help or --version the program has answered.
   subroutine read_case(name, does, scope, command, input, answered, error)
      character(*), intent(in) :: name, does
      integer, intent(in) :: scope
      type(command_t), intent(out) :: command
      type(input_t), intent(out) :: input
      logical, intent(out) :: answered
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      character(:), allocatable :: text

      answered = .false.
      call read_command(command, scope, problem)
      command%program = name
      if (allocated(problem)) then
         call raise(error, name//": "//problem%message)
         return
      end if
      answered = command%help .or. command%version
      if (command%help) call print_help(name, does, scope)
      if (command%version) call print_version(name)
      if (answered) return
      call read_text_file(command%input, text, error)
      if (.not. allocated(error)) call read_study(input, text, command%input, command%overrides, error)
   end subroutine read_case

   !> All has been read: ends the program with `error`, if there is one, or if the output exists; with --check after the effective
   !> input and what is to be known of the machine.
   subroutine end_checks(command, input, error, cautions)
      type(command_t), intent(in) :: command
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(inout) :: error
      type(string_t), intent(in), optional :: cautions(:)

      type(string_t) :: none(0)
      integer :: i

      if (.not. allocated(error) .and. .not. command%check) call check_files(command, input, none, error)
      if (allocated(error)) call fail(error%message, exit_usage)
      if (.not. command%check) return
      write (output_unit, "(a)", advance="no") input%effective()
      if (present(cautions)) then
         do i = 1, size(cautions)
            call say(cautions(i)%text)
         end do
      end if
      stop, quiet = .true.
   end subroutine end_checks

   !> Refuse an output that cannot be written, or that is a file which the command reads, or another that it writes.
   subroutine check_files(command, input, others, error)
      type(command_t), intent(in) :: command
      type(input_t), intent(in) :: input
      type(string_t), intent(in) :: others(:)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: files(:)
      integer :: i

      allocate (files(0))
      call append_text(files, command%input)
      call append_text(files, command%output)
      do i = 1, size(others)
         call append_text(files, others(i)%text)
      end do
      call add_file("starts", "file")
      call add_file("follow", "start_file")
      call check_distinct(files, error)
      if (.not. allocated(error)) call check_output(command%output, command%program, command%force, error)

   contains

      !> What the first group of this name reads.
      subroutine add_file(group, key)
         character(*), intent(in) :: group, key

         character(:), allocatable :: name

         if (input%count(group) == 0) return
         if (.not. input%given(group, 1, key)) return
         call input%get(group, 1, key, name)
         call append_text(files, name)
      end subroutine add_file

   end subroutine check_files

   !> Write the result file, print the answer, and say what the user is to know: lines, and that it was written.
   subroutine end_program(command, header, table, lines, answer)
      type(command_t), intent(in) :: command
      type(result_header_t), intent(in) :: header
      type(table_t), intent(in) :: table
      type(string_t), intent(in) :: lines(:)
      type(string_t), intent(in), optional :: answer(:)

      type(error_t), allocatable :: error
      integer :: i

      ! The work is done; a signal would leave half a file.
      call hold_signals()
      call write_result(command%output, header, table, command%force, error)
      if (allocated(error)) call fail(error%message, exit_failure)
      if (present(answer)) write (output_unit, "(a)") (answer(i)%text, i=1, size(answer))
      do i = 1, size(lines)
         call say(lines(i)%text)
      end do
      call say("wrote "//command%output)
   end subroutine end_program

   !> End the program with a message and an exit code.
   subroutine fail(line, code)
      character(*), intent(in) :: line
      integer, intent(in) :: code

      call say(line)
      call finish(code)
   end subroutine fail

end module program_frame
