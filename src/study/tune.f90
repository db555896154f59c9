!! A tuning as the input describes it: which mode, which parameter, and the answer as a table and in words.
module razy_study_tune
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, did_you_mean, position_of, string_t, texts_of
   use razy_eigen_mode_branches, only: branches_t, hertz, machines_t
   use razy_eigen_spectrum, only: spectrum_t
   use razy_eigen_tuning, only: attainable, change_t, changes, frequencies, objective, tune, tuning_t
   use razy_input_input, only: input_t
   use razy_machine_linearised, only: contact_choices, linear_ok, linearise, state_asked_for
   use razy_machine_machine, only: machine_t
   use razy_scenes_case, only: new_structure
   use razy_study_sweep_axes, only: new_varied, put_value, varied_t
   implicit none(type, external)
   private

   public :: apply_tune, new_tune, solve_tune, tune_t, tunes

   !> More changes of a mode than this are counted, not listed.
   integer, parameter :: most_lines = 8

   !> The input as a family of machines over one of its values.
   type, extends(machines_t) :: family_t
      type(input_t) :: input
      type(varied_t) :: varied
      integer :: contacts = 0
   contains
      procedure :: matrices
   end type family_t

   !> What &tune asks for, and the answer.
   type :: tune_t
      type(family_t) :: family
      type(machine_t) :: machine
      !> Which mode it is, in words.
      character(:), allocatable, private :: mode_words
      real(wp) :: frequency = 0.0_wp, reference = 0.0_wp
      real(wp), allocatable :: grid(:)
      integer :: coordinate = 0, mode = 0, stored = 0
      type(tuning_t) :: answer
      type(branches_t) :: branches
      !> All natural frequencies with the value of the input and with the tuned one, ascending, Hz (coordinates).
      real(wp), allocatable :: frequency_before(:), frequency_after(:)
   contains
      procedure :: columns
      procedure :: words
   end type tune_t

contains

   !> Put the tuned value into an input whose &tune says so; `value` and `unit` are of it, unallocated if there is none.
   subroutine apply_tune(input, value, unit, error)
      type(input_t), intent(inout) :: input
      real(wp), allocatable, intent(out) :: value
      character(:), allocatable, intent(out) :: unit
      type(error_t), allocatable, intent(out) :: error

      type(tune_t) :: self

      if (.not. tunes(input)) return
      call new_tune(self, input, error)
      if (.not. allocated(error)) call solve_tune(self, error)
      if (allocated(error)) return
      value = self%answer%parameter
      unit = self%family%varied%unit
      call put_value(self%family%varied, input, value, error)
   end subroutine apply_tune

   !> Whether an input is to be tuned.
   logical function tunes(input)
      type(input_t), intent(in) :: input

      tunes = input%count("tune") > 0
      if (tunes) call input%get("tune", 1, "apply", tunes)
   end function tunes

   !> Read and check what is asked for.
   subroutine new_tune(self, input, error)
      type(tune_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: first, last
      integer :: i, points

      self%family%input = input
      if (input%count("tune") == 0) then
         call input%complain(error, "tune", 1, "parameter", "required: the group%key that razy-tune looks for")
         return
      end if
      call new_varied(self%family%varied, input, "tune", 1, error)
      if (allocated(error)) return
      if (self%family%varied%slot(1)%whole) then
         call input%complain(error, "tune", 1, "parameter", "a real number: frequencies change with an integer in jumps")
         return
      end if
      call input%get("tune", 1, "frequency", self%frequency)
      call input%get("tune", 1, "points", points)
      self%family%contacts = findloc(contact_choices == input%choice("tune", 1, "contacts"), .true., dim=1)
      call input%get("tune", 1, "first", first)
      call input%get("tune", 1, "last", last)
      if (.not. abs(last - first) > 1.0e6_wp*spacing(max(abs(first), abs(last)))) then
         call input%complain(error, "tune", 1, "last", "a value apart from first")
         return
      end if
      self%reference = self%family%varied%slot(1)%number
      if (ieee_is_nan(self%reference)) self%reference = first
      self%grid = [(min(first, last) + abs(last - first)*(real(i - 1, wp)/(points - 1)), i=1, points)]
      self%grid(points) = max(first, last)
      call new_structure(self%machine, input, error)
      if (.not. allocated(error)) call choose_mode(self, error)
      if (.not. allocated(error)) call check_ends(self, error)
   end subroutine new_tune

   !> The coordinate or number that says which mode is meant.
   subroutine choose_mode(self, error)
      type(tune_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)
      character(:), allocatable :: name
      integer :: n

      n = size(self%machine%coordinate)
      call self%family%input%get("tune", 1, "modes", self%stored)
      self%stored = min(self%stored, n)
      if (self%family%input%given("tune", 1, "coordinate") .eqv. self%family%input%given("tune", 1, "mode")) then
         call self%family%input%complain(error, "tune", 1, "coordinate", "one of coordinate and mode has to be given")
      else if (self%family%input%given("tune", 1, "mode")) then
         call self%family%input%get("tune", 1, "mode", self%mode)
         self%mode_words = "mode "//to_text(self%mode)
         if (self%mode > n) call self%family%input%complain(error, "tune", 1, "mode", "1 to "//to_text(n))
      else
         call self%family%input%get("tune", 1, "coordinate", name)
         names = texts_of(self%machine%coordinate)
         self%coordinate = position_of(name, names)
         if (self%coordinate == 0) then
            call self%family%input%complain(error, "tune", 1, "coordinate", did_you_mean(name, names, "coordinates"))
         else
            self%mode_words = "the mode that is mostly "//names(self%coordinate)%text
         end if
      end if
   end subroutine choose_mode

   !> Refuse a range whose ends are out of the key's limits or make no machine.
   subroutine check_ends(self, error)
      type(tune_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      real(wp), allocatable :: mass(:, :), stiffness(:, :)
      character(5) :: key
      integer :: k

      do k = 1, 2
         key = merge("first", "last ", k == 1)
         call self%family%matrices(self%family%input%number("tune", 1, trim(key)), mass, stiffness, problem)
         if (allocated(problem)) call self%family%input%complain(error, "tune", 1, trim(key), problem%message)
         if (allocated(error)) return
      end do
   end subroutine check_ends

   !> M and K with a value of the parameter.
   subroutine matrices(self, parameter, mass, stiffness, error)
      class(family_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      real(wp), allocatable, intent(out) :: mass(:, :), stiffness(:, :)
      type(error_t), allocatable, intent(out) :: error

      type(machine_t) :: machine
      real(wp), allocatable :: damping(:, :)
      integer :: culprit, status

      call put_value(self%varied, self%input, parameter, error)
      if (.not. allocated(error)) call new_structure(machine, self%input, error)
      if (allocated(error)) return
      mass = machine%mass
      call linearise(machine, self%contacts, stiffness, damping, status, culprit)
      if (status /= linear_ok) call raise(error, "contacts must be "//state_asked_for(machine, status, culprit))
   end subroutine matrices

   !> Look for the parameter. Values without a machine and a goal out of reach are errors of the input.
   subroutine solve_tune(self, error)
      type(tune_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: interval(:, :)
      character(:), allocatable :: has, problem
      integer :: k

      call tune(self%answer, self%branches, self%family, self%reference, self%grid, self%coordinate, self%mode, &
                self%frequency, error)
      if (self%answer%found) then
         call frequencies_at(self, self%reference, self%frequency_before, error)
         if (.not. allocated(error)) call frequencies_at(self, self%answer%parameter, self%frequency_after, error)
         return
      else if (allocated(error)) then
         problem = error%message
         call self%family%input%complain(error, "tune", 1, "parameter", problem)
         return
      end if
      interval = attainable(self%branches, self%grid(1), self%grid(size(self%grid)))
      has = ""
      do k = 1, size(interval, 2)
         if (k > 1) has = has//" and "
         has = has//decimal(interval(1, k), 4)//" to "//decimal(interval(2, k), 4)
      end do
      call self%family%input%complain(error, "tune", 1, "frequency", self%mode_words//" has "//has//" Hz for "// &
                                      self%family%varied%parameter//" from "//to_text(self%grid(1))//" to "// &
                                      to_text(self%grid(size(self%grid))))
   end subroutine solve_tune

   !> Hand over what depends on the parameter, the tuned value and what it brings.
   subroutine columns(self, table)
      class(tune_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along = "/parameter", mode = "/mode", order = "/order"
      integer, allocatable :: kept(:)
      real(wp), allocatable :: psi(:), tuned(:)
      integer :: i

      associate (branches => self%branches, answer => self%answer, varied => self%family%varied)
         kept = pack([(i, i=1, size(branches%point))], branches%point%asked)
         psi = objective(branches, self%frequency)
         tuned = frequencies(branches)
         call table%add(along, branches%point(kept)%parameter, varied%unit, varied%parameter, along)
         call table%add("/objective", psi(kept), "1", "(1 - f/goal)^2 of "//self%mode_words, along)
         call table%add("/tuned_frequency", tuned(kept), "Hz", "natural frequency of "//self%mode_words, along)
         call table%add("/tuned_place", branches%point(kept)%place, "1", "place in ascending order of "//self%mode_words, along)
         call table%add(mode, [(i, i=1, self%stored)], "1", "number of the mode before tuning", mode)
         call table%add("/frequency", hertz(branches%value(:self%stored, kept)), "Hz", &
                        "natural frequency, each mode followed by its shape", [character(10) :: mode, along])
         call table%add("/frequency_before", self%frequency_before, "Hz", "natural frequency with the value of the input", order)
         call table%add("/frequency_after", self%frequency_after, "Hz", "natural frequency with the tuned value", order)
         call table%add("/goal", self%frequency, "Hz", "natural frequency asked for, of "//self%mode_words)
         call table%add("/reference", self%reference, varied%unit, varied%parameter//" of the input")
         call table%add("/optimum", answer%parameter, varied%unit, varied%parameter//", tuned")
         call table%note("mode", self%mode_words)
         call table%add("/share", answer%share, "1", "share of the coordinate in the tuned mode")
      end associate
   end subroutine columns

   !> All natural frequencies with a value of the parameter, Hz, ascending.
   subroutine frequencies_at(self, parameter, frequency, error)
      type(tune_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      real(wp), allocatable, intent(out) :: frequency(:)
      type(error_t), allocatable, intent(out) :: error

      type(spectrum_t) :: spectrum

      call self%family%solve(parameter, spectrum, error)
      if (.not. allocated(error)) frequency = hertz(real(spectrum%value, wp))
   end subroutine frequencies_at

   !> The answer, and what becomes of the mode over the range, in lines for the user.
   function words(self) result(lines)
      class(tune_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      type(change_t), allocatable :: list(:)
      integer :: i, k

      allocate (lines(0))
      associate (answer => self%answer, varied => self%family%varied)
         call append_text(lines, varied%parameter//" = "//to_text(answer%parameter)//" "//varied%unit//": "//self%mode_words// &
                          " has "//decimal(answer%frequency, 6)//" Hz, share "//decimal(answer%share, 3))
         if (answer%others > 0) call append_text(lines, "the value nearest to that of the input; others in the range: " &
                                                 //to_text(answer%others))
         if (abs(answer%frequency/self%frequency - 1) > 1.0e-12_wp) then
            call append_text(lines, "rounding keeps the frequency from its goal by more than 1e-12 of it")
         end if
      end associate
      list = changes(self%branches, self%grid(1), self%grid(size(self%grid)))
      k = 0
      do i = 1, size(list)
         if (list(i)%branch(1) == list(i)%branch(2) .and. list(i)%place(1) == list(i)%place(2) .and. self%coordinate > 0) cycle
         k = k + 1
         if (k <= most_lines) call append_text(lines, change_words(self, list(i)))
      end do
      if (k > most_lines) call append_text(lines, "and "//to_text(k - most_lines)//" more changes of place or shape")
      if (.not. self%branches%resolved) call append_text(lines, "some modes change too often to be followed with certainty")
   end function words

   !> One change of the mode in words.
   function change_words(self, change) result(line)
      type(tune_t), intent(in) :: self
      type(change_t), intent(in) :: change
      character(:), allocatable :: line

      line = "at "//self%family%varied%parameter//" = "//to_text(real(change%parameter(1), wp))//" "// &
             self%family%varied%unit//", "
      if (change%branch(1) /= change%branch(2)) then
         line = line//"veering: "//self%mode_words//" is number "//to_text(change%place(1))//" below and " &
                //to_text(change%place(2))//" above, with a gap from "//decimal(minval(change%frequency), 4)//" to " &
                //decimal(maxval(change%frequency), 4)//" Hz"
      else if (change%place(1) /= change%place(2)) then
         line = line//"crossing: "//self%mode_words//" goes from place "//to_text(change%place(1))//" to " &
                //to_text(change%place(2))//" at "//decimal(change%frequency(1), 4)//" Hz"
      else
         line = line//self%mode_words//" turns from mostly "//trim(self%machine%coordinate(change%coordinate(1)))//" to mostly " &
                //trim(self%machine%coordinate(change%coordinate(2)))//" at "//decimal(change%frequency(1), 4)//" Hz"
      end if
   end function change_words

end module razy_study_tune
