!! What all programs have in common: options, messages, the way they end.
module command_line
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: did_you_mean, string_t
   use razy_core_version, only: razy_git_commit, razy_version
   implicit none(type, external)
   private

   public :: command_t, finish, is_terminal, print_help, print_version, read_command, say
   public :: exit_failure, exit_interrupted, exit_ok, exit_usage

   integer, parameter :: exit_ok = 0, exit_failure = 1, exit_usage = 2, exit_interrupted = 3

   !> The options; `output` has its default already.
   type :: command_t
      character(:), allocatable :: input, output
      type(string_t), allocatable :: overrides(:)
      logical :: force = .false., check = .false., help = .false., version = .false.
      !> Of a sweep: forget the checkpoint; least time between two writings to disk that are waited for, s.
      logical :: anew = .false., dry_run = .false.
      real(wp) :: checkpoint = 60.0_wp
      !> Of a sweep: results after which they are written to disk before that time is over; 0: however many.
      integer(i8) :: checkpoint_points = 0
      !> Of a sweep: file of its log, not allocated if there is none.
      character(:), allocatable :: log
   end type command_t

   interface
      !> isatty of POSIX: 1 if the descriptor is a terminal.
      function c_isatty(descriptor) result(answer) bind(c, name="isatty")
         import :: c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor
         integer(c_int) :: answer
      end function c_isatty
   end interface

contains

   !> Read the arguments of the program; a sweep has more options than a single run.
   subroutine read_command(command, sweep, error)
      type(command_t), intent(out) :: command
      logical, intent(in) :: sweep
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: word
      integer :: i

      allocate (command%overrides(0))
      i = 0
      do while (i < command_argument_count())
         i = i + 1
         word = argument(i)
         select case (word)
         case ("--help", "-h")
            command%help = .true.
         case ("--version")
            command%version = .true.
         case ("--force")
            command%force = .true.
         case ("--check")
            command%check = .true.
         case ("--output", "--set")
            i = i + 1
            call take(command, word, i, error)
         case default
            if (sweep .and. word == "--anew") then
               command%anew = .true.
            else if (sweep .and. word == "--dry-run") then
               command%dry_run = .true.
            else if (sweep .and. (word == "--checkpoint" .or. word == "--checkpoint-points" .or. word == "--log")) then
               i = i + 1
               call take(command, word, i, error)
            else
               call take_word(command, word, sweep, error)
            end if
         end select
         if (allocated(error)) return
      end do
      if (command%help .or. command%version) return
      if (.not. allocated(command%input)) then
         call raise(error, "no input file is given; see --help")
      else if (.not. allocated(command%output)) then
         command%output = default_output(command%input)
      end if
   end subroutine read_command

   !> Take the value of an option that stands in argument number i.
   subroutine take(command, option, i, error)
      type(command_t), intent(inout) :: command
      character(*), intent(in) :: option
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      if (i > command_argument_count()) then
         call raise(error, option//" needs a value; see --help")
      else if (option == "--set") then
         call append(command%overrides, argument(i))
      else if (option == "--checkpoint") then
         call read_seconds(command%checkpoint, argument(i), error)
      else if (option == "--checkpoint-points") then
         call read_points(command%checkpoint_points, argument(i), error)
      else if (option == "--log") then
         command%log = argument(i)
      else
         command%output = argument(i)
      end if
   end subroutine take

   !> The time between two writings to disk, which may be 0.
   subroutine read_seconds(seconds, text, error)
      real(wp), intent(inout) :: seconds
      character(*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error

      integer :: status

      read (text, *, iostat=status) seconds
      if (status == 0) then
         if (seconds >= 0.0_wp .and. verify(text, "0123456789.eE+-") == 0) return
      end if
      call raise(error, "--checkpoint "//text//": a time in s, 0 or more")
   end subroutine read_seconds

   !> The number of results between two writings to disk.
   subroutine read_points(points, text, error)
      integer(i8), intent(inout) :: points
      character(*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error

      integer :: status

      read (text, *, iostat=status) points
      if (status == 0) then
         if (points >= 1 .and. verify(text, "0123456789") == 0) return
      end if
      call raise(error, "--checkpoint-points "//text//": a number of points, 1 or more")
   end subroutine read_points

   !> Take `--option=value`, or the input file.
   subroutine take_word(command, word, sweep, error)
      type(command_t), intent(inout) :: command
      character(*), intent(in) :: word
      logical, intent(in) :: sweep
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)

      if (index(word, "--output=") == 1) then
         command%output = word(len("--output=") + 1:)
      else if (index(word, "--set=") == 1) then
         call append(command%overrides, word(len("--set=") + 1:))
      else if (sweep .and. index(word, "--log=") == 1) then
         command%log = word(len("--log=") + 1:)
      else if (sweep .and. index(word, "--checkpoint=") == 1) then
         call read_seconds(command%checkpoint, word(len("--checkpoint=") + 1:), error)
      else if (sweep .and. index(word, "--checkpoint-points=") == 1) then
         call read_points(command%checkpoint_points, word(len("--checkpoint-points=") + 1:), error)
      else if (index(word, "-") == 1 .and. len(word) > 1) then
         known = [string_t("--output"), string_t("--force"), string_t("--set"), string_t("--check"), string_t("--help"), &
                  string_t("--version")]
         if (sweep) known = [known, string_t("--anew"), string_t("--checkpoint"), string_t("--checkpoint-points"), &
                             string_t("--dry-run"), string_t("--log")]
         call raise(error, word//": no such option; "//did_you_mean(word, known, "options"))
      else if (allocated(command%input)) then
         call raise(error, word//": one input file only, and "//command%input//" is given already")
      else
         command%input = word
      end if
   end subroutine take_word

   subroutine append(list, text)
      type(string_t), allocatable, intent(inout) :: list(:)
      character(*), intent(in) :: text

      type(string_t), allocatable :: longer(:)

      allocate (longer(size(list) + 1))
      longer(:size(list)) = list
      longer(size(longer))%text = text
      call move_alloc(longer, list)
   end subroutine append

   function argument(i) result(text)
      integer, intent(in) :: i
      character(:), allocatable :: text

      integer :: length

      call get_command_argument(i, length=length)
      allocate (character(length) :: text)
      if (length > 0) call get_command_argument(i, text)
   end function argument

   !> The name of the input file, in the current folder, with .h5 for its ending.
   pure function default_output(input) result(output)
      character(*), intent(in) :: input
      character(:), allocatable :: output

      integer :: dot

      output = input(index(input, "/", back=.true.) + 1:)
      dot = index(output, ".", back=.true.)
      if (dot > 1) output = output(:dot - 1)
      output = output//".h5"
   end function default_output

   !> Help of program `name`.
   subroutine print_help(name, does, sweep)
      character(*), intent(in) :: name, does
      logical, intent(in) :: sweep

      write (output_unit, "(a)") &
         name//": "//does, &
         "", &
         "usage: "//name//" CASE.nml [options]", &
         "  --output FILE            result file (default: CASE.h5 in the current folder)", &
         "  --force                  overwrite the result file if it exists", &
         "  --set GROUP%KEY=VALUE    change a value of the input, e.g. --set motion%t_end=0.5;", &
         "                           of a repeated group: --set 'load(2)%value=-50'", &
         "  --check                  check the input, print it with all defaults, and stop"
      if (sweep) write (output_unit, "(a)") &
         "  --checkpoint SECONDS     have results on the disk itself after this time (default: 60);", &
         "                           an interrupted sweep goes on when the same command is given again", &
         "  --checkpoint-points N    and after so many points, if that is sooner", &
         "  --anew                   do not go on: delete the checkpoint, and begin again", &
         "  --dry-run                compute a few points, print what all will take, and stop", &
         "  --log FILE               append to a log: start, speed, slowest points, failures; - is the error channel"
      write (output_unit, "(a)") "  --help, --version"
      if (sweep) then
         write (output_unit, "(a)") &
            "exit code: 0 done, 2 bad input or usage, 3 stopped by SIGTERM or SIGUSR1, 1 anything else"
      else
         write (output_unit, "(a)") "exit code: 0 done, 2 bad input or usage, 1 anything else"
      end if
   end subroutine print_help

   subroutine print_version(name)
      character(*), intent(in) :: name

      write (output_unit, "(a)") name//" "//razy_version//" ("//razy_git_commit//")"
   end subroutine print_version

   !> A line for the user on the error channel.
   subroutine say(line)
      character(*), intent(in) :: line

      write (error_unit, "(a)") line
   end subroutine say

   !> Whether messages go to a terminal.
   function is_terminal() result(yes)
      logical :: yes

      yes = c_isatty(2_c_int) == 1_c_int
   end function is_terminal

   !> End the program with this exit code.
   subroutine finish(code)
      integer, intent(in) :: code

      flush (output_unit)
      flush (error_unit)
      if (code /= exit_ok) stop code, quiet = .true.
   end subroutine finish

end module command_line
