!! What all programs have in common: options, messages, the way they end.
module command_line
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: append_text, did_you_mean, excerpt, string_t, texts_of
   use razy_core_version, only: razy_git_commit, razy_version
   implicit none(type, external)
   private

   public :: command_t, finish, is_terminal, print_help, print_version, read_command, say
   public :: exit_failure, exit_interrupted, exit_ok, exit_usage
   public :: of_a_sweep, of_one, of_ranks

   integer, parameter :: exit_ok = 0, exit_failure = 1, exit_usage = 2, exit_interrupted = 3

   !> What a program does: one computation, tasks on several ranks that a checkpoint keeps, a sweep.
   integer, parameter :: of_one = 0, of_ranks = 1, of_a_sweep = 2

   !> The program, and its options; `output` has its default already.
   type :: command_t
      character(:), allocatable :: program, input, output
      type(string_t), allocatable :: overrides(:)
      logical :: force = .false., check = .false., help = .false., version = .false.
      !> On several ranks: forget the checkpoint; least time between two writings to disk that are waited for, s.
      logical :: anew = .false., dry_run = .false.
      !> Of a sweep: only write what the checkpoint has.
      logical :: so_far = .false.
      real(wp) :: checkpoint = 60.0_wp
      !> On several ranks: results after which they are written to disk before that time is over; 0: however many.
      integer(i8) :: checkpoint_points = 0
      !> Of a sweep: file of its log, not allocated if there is none.
      character(:), allocatable :: log
   end type command_t

   !> An option: whether a value goes with it, and the scope from which on programs have it.
   type :: option_t
      character(19) :: name
      logical :: takes_value
      integer :: scope
   end type option_t

   type(option_t), parameter :: options(*) = [ &
                  option_t("--force", .false., of_one), option_t("--check", .false., of_one), option_t("--help", .false., of_one), &
                    option_t("-h", .false., of_one), option_t("--version", .false., of_one), option_t("--output", .true., of_one), &
               option_t("--set", .true., of_one), option_t("--anew", .false., of_ranks), option_t("--dry-run", .false., of_ranks), &
                                option_t("--checkpoint", .true., of_ranks), option_t("--checkpoint-points", .true., of_ranks), &
                                option_t("--so-far", .false., of_a_sweep), option_t("--log", .true., of_a_sweep)]

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

   !> Read the arguments of a program, which has the options of its scope.
   subroutine read_command(command, scope, error)
      type(command_t), intent(out) :: command
      integer, intent(in) :: scope
      type(error_t), allocatable, intent(out) :: error

      type(option_t), allocatable :: known(:)
      character(:), allocatable :: name, option, value
      integer :: at, equals, i

      known = pack(options, options%scope <= scope)
      allocate (command%overrides(0))
      i = 0
      do while (i < command_argument_count() .and. .not. allocated(error))
         i = i + 1
         option = argument(i)
         equals = index(option, "=")
         name = option(:merge(equals - 1, len(option), equals > 0))
         at = findloc(known%name == name .and. (known%takes_value .or. equals == 0), .true., dim=1)
         if (at > 0) then
            value = option(equals + 1:)
            if (known(at)%takes_value .and. equals == 0) then
               i = i + 1
               value = argument(i)
            end if
            if (i > command_argument_count()) call raise(error, name//" needs a value; see --help")
            if (.not. allocated(error)) call set_option(command, name, value, error)
         else if (index(option, "-") == 1 .and. len(option) > 1) then
            call raise(error, excerpt(option)//": no such option; "//did_you_mean(option, texts_of(known%name), "options"))
         else if (allocated(command%input)) then
            call raise(error, excerpt(option)//": one input file only, and "//excerpt(command%input)//" is given already")
         else
            command%input = option
         end if
      end do
      if (allocated(error) .or. command%help .or. command%version) return
      if (.not. allocated(command%input)) then
         call raise(error, "no input file is given; see --help")
      else if (.not. allocated(command%output)) then
         command%output = default_output(command%input)
      end if
   end subroutine read_command

   !> Take over an option; `value` counts where one goes with it.
   subroutine set_option(command, option, value, error)
      type(command_t), intent(inout) :: command
      character(*), intent(in) :: option, value
      type(error_t), allocatable, intent(out) :: error

      integer :: status

      select case (option)
      case ("--help", "-h")
         command%help = .true.
      case ("--version")
         command%version = .true.
      case ("--force")
         command%force = .true.
      case ("--check")
         command%check = .true.
      case ("--anew")
         command%anew = .true.
      case ("--so-far")
         command%so_far = .true.
      case ("--dry-run")
         command%dry_run = .true.
      case ("--output")
         command%output = value
      case ("--set")
         call append_text(command%overrides, value)
      case ("--log")
         command%log = value
      case ("--checkpoint")
         read (value, *, iostat=status) command%checkpoint
         if (status /= 0 .or. command%checkpoint < 0.0_wp .or. verify(value, "0123456789.eE+-") > 0) then
            call raise(error, option//" "//excerpt(value)//": a time in s, 0 or more")
         end if
      case default
         read (value, *, iostat=status) command%checkpoint_points
         if (status /= 0 .or. command%checkpoint_points < 1 .or. verify(value, "0123456789") > 0) then
            call raise(error, option//" "//excerpt(value)//": a number of points, 1 or more")
         end if
      end select
   end subroutine set_option

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

   !> Help of program `name`, with the options of its scope.
   subroutine print_help(name, does, scope)
      character(*), intent(in) :: name, does
      integer, intent(in) :: scope

      write (output_unit, "(a)") &
         name//": "//does, &
         "", &
         "usage: "//name//" CASE.nml [options]", &
         "  --output FILE            result file (default: CASE.h5 in the current folder)", &
         "  --force                  overwrite the result file if it exists and is one of "//name, &
         "  --set GROUP%KEY=VALUE    change a value of the input, e.g. --set motion%t_end=0.5;", &
         "                           of a repeated group: --set 'load(2)%value=-50'", &
         "  --check                  check the input, print it with all defaults, and stop"
      if (scope >= of_ranks) write (output_unit, "(a)") &
         "  --checkpoint SECONDS     have results on the disk itself after this time (default: 60); an interrupted", &
         "                           run goes on when the same command is given again"// &
         trim(merge(" (with motions='all')", repeat(" ", 21), scope == of_ranks)), &
         "  --checkpoint-points N    and after so many points, if that is sooner", &
         "  --anew                   do not go on: delete the checkpoint, and begin again"
      if (scope >= of_a_sweep) write (output_unit, "(a)") &
         "  --so-far                 compute nothing: write the result file of the points that the checkpoint has, a copy of", &
         "                           that of a sweep under way, and delete it", &
         "  --log FILE               append to a log: start, speed, slowest points, failures; - is the error channel"
      if (scope >= of_ranks) write (output_unit, "(a)") &
         "  --dry-run                compute a few points, print what all will take, and stop"
      write (output_unit, "(a)") "  --help, --version"
      if (scope >= of_a_sweep) then
         write (output_unit, "(a)") &
            "exit code: 0 done, 2 bad input or usage, 3 stopped by SIGTERM or SIGUSR1, 1 all points failed, or anything else"
      else if (scope >= of_ranks) then
         write (output_unit, "(a)") "exit code: 0 done, 2 bad input or usage, 3 stopped by SIGTERM or SIGUSR1, 1 anything else"
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
