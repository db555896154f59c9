!! The duel: one motion by several methods, compared with a reference of stated error.
!!
!! Errors are taken at `samples` equidistant times over all coordinates, each relative to the largest value that it reaches
!! in the reference, or, where that is `negligible` beside the others of its unit, to the largest of those. Events are compared
!! in their order: those before the first that differs in contact or branch are matched, and their times compared. Processor
!! time is the least of repeated runs without recording.
module razy_study_duel
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_hybrid_flow, only: flow_t
   use razy_input_input, only: input_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_slot_t, outcome_t, status_meanings, status_ok
   use razy_motion_method, only: check_method, method_t
   use razy_observe_event_log, only: event_log_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_scenes_case, only: motion_t
   use razy_study_motion, only: run_motion
   implicit none(type, external)
   private

   public :: compute_duel, duel_t, entry_t, read_entries

   integer, parameter :: samples = 1000
   !> A coordinate that moves less than this part of the largest motion of its unit may hold nothing but rounding, of which no
   !> digit is right.
   real(wp), parameter :: negligible = 1.0e-9_wp
   !> Runs are repeated until they took this long together, s, or so many times.
   real(wp), parameter :: enough_time = 0.2_wp
   integer, parameter :: most_repeats = 20
   character(*), parameter :: relative_to = "largest value of the coordinate in the reference; if that is below 1e-9 "// &
                              "of the largest of all coordinates of its unit, that largest value"

   !> One method with its setting: a tolerance, or a step in s.
   type :: entry_t
      type(method_t) :: method
      integer, private :: series = 0
      real(wp), private :: setting = 0.0_wp
      logical, private :: is_step = .false.
   end type entry_t

   !> What a method made of the motion.
   type :: answer_t
      type(outcome_t) :: outcome
      type(trajectory_t) :: trajectory
      type(event_log_t) :: log
      real(wp) :: cpu_time = 0.0_wp
   end type answer_t

   !> How far an answer is from the reference; NaN where it ended early.
   type :: difference_t
      !> Relative; s; leading events that match.
      real(wp) :: displacement = 0.0_wp, velocity = 0.0_wp, event_time = 0.0_wp
      integer(i8) :: matched = 0
   end type difference_t

   !> An entry's answer, and events that it has more than the reference.
   type :: row_t
      type(entry_t) :: entry
      type(outcome_t) :: outcome
      type(difference_t) :: difference
      integer(i8) :: surplus = 0
      real(wp) :: cpu_time = 0.0_wp
   end type row_t

   !> The result: a row for each entry; what they were compared with, and that with its check.
   type :: duel_t
      type(row_t), allocatable :: row(:)
      character(:), allocatable :: reference, check
      type(difference_t) :: reference_error
      integer(i8) :: reference_events = 0
   contains
      procedure :: columns
      procedure :: words
   end type duel_t

contains

   !> All entries, in the order of the input. `base` is the method of &motion, whose other settings hold for all.
   subroutine read_entries(entries, base, machine, input, error)
      type(entry_t), allocatable, intent(out) :: entries(:)
      type(method_t), intent(in) :: base
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      allocate (entries(0))
      if (input%count("duel") == 0) then
         call input%complain(error, "duel", 1, "integrator", "required: a method that is set beside others")
         return
      end if
      do i = 1, input%count("duel")
         call add_series(entries, base, machine, input, i, error)
         if (allocated(error)) return
      end do
   end subroutine read_entries

   !> The entries of &duel number i.
   subroutine add_series(entries, base, machine, input, i, error)
      type(entry_t), allocatable, intent(inout) :: entries(:)
      type(method_t), intent(in) :: base
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(entry_t) :: entry
      character(:), allocatable :: allowed, key
      real(wp), allocatable :: settings(:), sharpness(:), steps(:)
      integer :: k

      entry%series = i
      entry%method = base
      entry%method%integrator = input%choice("duel", i, "integrator")
      call input%get("duel", i, "tolerance", settings)
      call input%get("duel", i, "step", steps)
      call input%get("duel", i, "sharpness", sharpness)
      if (input%given("duel", i, "band")) call input%get("duel", i, "band", entry%method%band)
      entry%is_step = size(steps) > 0
      if (size(settings) > 0 .and. size(steps) > 0) then
         call input%complain(error, "duel", i, "step", "a list of either tolerances or steps")
         return
      end if
      if (entry%is_step) settings = steps
      ! The exact propagator has nothing to set.
      if (size(settings) == 0) settings = [base%relative_tolerance]
      if (size(sharpness) > 1 .and. size(sharpness) /= size(settings)) then
         call input%complain(error, "duel", i, "sharpness", "one value, or as many as there are tolerances or steps")
         return
      end if
      do k = 1, size(settings)
         entry%method%treatment = input%choice("duel", i, "treatment")
         entry%setting = settings(k)
         if (entry%is_step) then
            entry%method%step = settings(k)
         else
            entry%method%relative_tolerance = settings(k)
            entry%method%absolute_tolerance = settings(k)*(base%absolute_tolerance/base%relative_tolerance)
            entry%method%step = 0.0_wp
         end if
         if (size(sharpness) > 0) entry%method%sharpness = sharpness(min(k, size(sharpness)))
         call check_method(entry%method, machine, key, allowed)
         if (len(key) > 0) call input%complain(error, "duel", i, key, allowed)
         if (allocated(error)) return
         entry%method%automatic = .false.
         entries = [entries, entry]
      end do
   end subroutine add_series

   !> Run all entries and compare them.
   subroutine compute_duel(duel, machine, motion, entries, error)
      type(duel_t), intent(out) :: duel
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(entry_t), intent(in) :: entries(:)
      type(error_t), allocatable, intent(out) :: error

      type(answer_t) :: answer, reference
      integer :: i

      call find_reference(duel, machine, motion, reference, error)
      if (allocated(error)) return
      allocate (duel%row(size(entries)))
      do i = 1, size(entries)
         call run_method(machine, motion, entries(i)%method, .true., answer, error)
         if (allocated(error)) return
         associate (row => duel%row(i))
            row%entry = entries(i)
            row%outcome = answer%outcome
            row%cpu_time = answer%cpu_time
            row%surplus = answer%log%count - reference%log%count
            row%difference = compare(answer, reference, machine)
         end associate
      end do
   end subroutine compute_duel

   !> The reference and its check: the exact propagator beside the tightest Runge-Kutta method where the laws are piecewise
   !> linear, else the tightest pair of two families of methods.
   subroutine find_reference(duel, machine, motion, reference, error)
      type(duel_t), intent(inout) :: duel
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(answer_t), intent(out) :: reference
      type(error_t), allocatable, intent(out) :: error

      type(method_t) :: method, tight
      type(answer_t) :: check
      character(:), allocatable :: allowed, key

      tight = method_t(integrator="dop853", treatment="event", relative_tolerance=1.0e-13_wp, absolute_tolerance=1.0e-16_wp)
      method = method_t(integrator="exact")
      call check_method(method, machine, key, allowed)
      if (len(key) == 0) then
         duel%reference = "exact"
         duel%check = "dop853, event, tolerance 1e-13"
      else
         method = tight
         tight%integrator = "radau5"
         tight%relative_tolerance = 1.0e-12_wp
         tight%absolute_tolerance = 1.0e-15_wp
         duel%reference = "dop853, event, tolerance 1e-13"
         duel%check = "radau5, event, tolerance 1e-12"
      end if
      call run_method(machine, motion, method, .false., reference, error)
      if (.not. allocated(error)) call run_method(machine, motion, tight, .false., check, error)
      if (allocated(error)) return
      if (reference%outcome%status /= status_ok) then
         call raise(error, "no reference: by "//duel%reference//" the motion ended with '" &
                    //trim(status_meanings(reference%outcome%status))//"'")
      else if (check%outcome%status /= status_ok) then
         call raise(error, "no check of the reference: by "//duel%check//" the motion ended with '" &
                    //trim(status_meanings(check%outcome%status))//"'")
      end if
      if (allocated(error)) return
      duel%reference_error = compare(check, reference, machine)
      duel%reference_events = reference%log%count
   end subroutine find_reference

   !> The motion by one method; with `timed` the processor time of runs without recording.
   subroutine run_method(machine, motion, method, timed, answer, error)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(method_t), intent(in) :: method
      logical, intent(in) :: timed
      type(answer_t), intent(out), target :: answer
      type(error_t), allocatable, intent(out) :: error

      class(flow_t), allocatable, target :: integrator
      type(outcome_t) :: outcome
      type(observer_slot_t) :: slots(2)
      real(wp) :: begin, end, total
      integer :: i

      slots(1)%observer => answer%log
      slots(2)%observer => answer%trajectory
      allocate (answer%trajectory%form(0))
      answer%trajectory%coordinates = size(machine%mass, 1)
      answer%trajectory%interval = motion%t_end/samples
      call run_motion(machine, method, motion%t_end, slots, answer%outcome, error, motion%most_events, .true., integrator)
      if (allocated(error)) return
      if (.not. timed) return
      total = 0.0_wp
      answer%cpu_time = huge(1.0_wp)
      do i = 1, most_repeats
         call cpu_time(begin)
         call integrator%run(motion%t_end, motion%most_events, slots(:0), outcome)
         call cpu_time(end)
         answer%cpu_time = min(answer%cpu_time, end - begin)
         total = total + (end - begin)
         if (total > enough_time) exit
      end do
   end subroutine run_method

   !> How far an answer is from the reference.
   function compare(answer, reference, machine) result(difference)
      type(answer_t), intent(in) :: answer, reference
      type(machine_t), intent(in) :: machine
      type(difference_t) :: difference

      integer :: i, n

      if (answer%outcome%status /= status_ok) then
         difference = difference_t(nan(), nan(), nan())
         return
      end if
      n = min(answer%trajectory%count, reference%trajectory%count)
      difference%displacement = largest(answer%trajectory%displacement(:, :n), reference%trajectory%displacement(:, :n), &
                                        machine%unit)
      difference%velocity = largest(answer%trajectory%velocity(:, :n), reference%trajectory%velocity(:, :n), machine%unit)
      do i = 1, min(answer%log%count, reference%log%count)
         if (answer%log%contact(i) /= reference%log%contact(i) .or. answer%log%branch(i) /= reference%log%branch(i)) exit
         difference%matched = i
         difference%event_time = max(difference%event_time, abs(answer%log%time(i) - reference%log%time(i)))
      end do
      if (difference%matched == 0 .and. reference%log%count > 0) difference%event_time = nan()
   end function compare

   real(wp) function nan()

      nan = ieee_value(nan, ieee_quiet_nan)
   end function nan

   !> Largest difference over coordinates (rows) and times (columns), relative to the largest value of its coordinate in the
   !> reference, or of all coordinates of its unit where that is `negligible` beside them.
   pure function largest(values, reference, unit) result(error)
      real(wp), intent(in) :: values(:, :), reference(:, :)
      character(*), intent(in) :: unit(:)
      real(wp) :: error

      real(wp) :: range(size(unit)), scale, widest
      integer :: i

      error = 0.0_wp
      range = maxval(abs(reference), dim=2)
      do i = 1, size(unit)
         widest = maxval(range, unit == unit(i))
         scale = merge(widest, range(i), range(i) < negligible*widest)
         if (scale > 0.0_wp) error = max(error, maxval(abs(values(i, :) - reference(i, :)))/scale)
      end do
   end function largest

   !> Hand over the rows and what they were compared with.
   subroutine columns(self, table)
      class(duel_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: single = "/reference/single"
      type(table_t) :: row
      integer :: i

      do i = 1, size(self%row)
         call row%rewind()
         associate (one => self%row(i), entry => self%row(i)%entry)
            call row%add("/method", trim(entry%method%integrator), "1", "integrator")
            call row%add("/treatment", trim(entry%method%treatment), "1", "treatment of jumps and kinks")
            call row%add("/series", entry%series, "1", "number of the &duel group")
            call row%add("/setting", entry%setting, "1", "relative tolerance, or step in s where setting_is_step")
            call row%add("/setting_is_step", merge(1, 0, entry%is_step), "1", "1 where the setting is a step in s")
            call row%add("/sharpness", merge(entry%method%sharpness, 0.0_wp, entry%method%treatment == "smoothing"), "1", &
                         "sharpness of smoothing, per unit of the contact variable; 0: none")
            call row%add("/error", one%difference%displacement, "1", &
                         "largest error of a displacement, relative to the largest of its coordinate")
            call row%note("relative_to", relative_to)
            call row%add("/velocity_error", one%difference%velocity, "1", "largest error of a velocity, relative likewise")
            call row%note("relative_to", relative_to)
            call row%add("/event_time_error", one%difference%event_time, "s", "largest error of the times of matched events")
            call row%add("/event_surplus", one%surplus, "1", "events more than the reference has")
            call row%add("/events_matched", one%difference%matched, "1", &
                         "leading events of the same contact and branch as the reference's")
            call row%add("/cpu_time", one%cpu_time, "s", "processor time, least of several runs")
            call one%outcome%columns(row, "/", brief=.false.)
         end associate
         call table%stack(row, "/row")
      end do
      call table%add("/reference/error", [self%reference_error%displacement], "1", &
                     "difference of the displacements of the reference and its check", single)
      call table%note("reference", self%reference)
      call table%note("check", self%check)
      call table%add("/reference/event_time_error", [self%reference_error%event_time], "s", &
                     "difference of their event times", single)
      call table%add("/reference/events", [self%reference_events], "1", "events of the reference", single)
   end subroutine columns

   !> The result as a table of text, a line for each row.
   function words(self) result(lines)
      class(duel_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      character(*), parameter :: form = "(a16, 1x, a13, 4(1x, es9.2), i9, i8, i8, i11, i10, 2x, a)"
      character(200) :: line
      integer :: i

      allocate (lines(0))
      write (line, "(a, es9.2, a, es9.2, a)") "reference: "//self%reference//"; against "//self%check//" its error is ", &
         self%reference_error%displacement, ", that of its event times ", self%reference_error%event_time, " s"
      call append_text(lines, trim(line))
      write (line, "(a16, 1x, a13, 4(1x, a9), a9, a8, a8, a11, a10, 2x, a)") "method", "treatment", "setting", "error", &
         "events, s", "cpu, s", "events", "surplus", "misses", "rhs", "steps", "status"
      call append_text(lines, trim(line))
      do i = 1, size(self%row)
         associate (row => self%row(i), entry => self%row(i)%entry)
            write (line, form) entry%method%integrator, entry%method%treatment, entry%setting, row%difference%displacement, &
               row%difference%event_time, row%cpu_time, row%outcome%events, row%surplus, row%outcome%near_misses, &
               row%outcome%evaluations, row%outcome%steps, trim(status_meanings(row%outcome%status))
         end associate
         call append_text(lines, trim(line))
      end do
   end function words

end module razy_study_duel
