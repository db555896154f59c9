!! The duel: one motion by several methods, compared with a reference of stated error.
!!
!! Errors are taken at `samples` equidistant times over all coordinates, each relative to the largest value that it reaches
!! in the reference, or, where that is `negligible` beside the others of its unit, to the largest of those. Events are compared
!! in their order: those before the first that differs in contact or branch are matched, and their times compared. Processor
!! time is the least of repeated runs without recording.
module duel
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use duel_case, only: entry_t
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_observe_event_log, only: event_log_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_study_integrators, only: new_integrator
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, status_meanings, status_ok
   use razy_io_duel_file, only: duel_content_t
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: check_method, method_t
   use razy_scenes_case, only: motion_t
   implicit none(type, external)
   private

   public :: compute_duel

   integer, parameter :: samples = 1000
   !> A coordinate that moves less than this part of the largest motion of its unit may hold nothing but rounding, of which no
   !> digit is right.
   real(wp), parameter :: negligible = 1.0e-9_wp
   !> Runs are repeated until they took this long together, s, or so many times.
   real(wp), parameter :: enough_time = 0.2_wp
   integer, parameter :: most_repeats = 20

   !> What a method made of the motion.
   type :: answer_t
      type(outcome_t) :: outcome
      type(trajectory_t) :: trajectory
      type(event_log_t) :: log
      real(wp) :: cpu_time = 0.0_wp
   end type answer_t

   !> Difference of two answers.
   type :: difference_t
      real(wp) :: displacement = 0.0_wp, velocity = 0.0_wp, event_time = 0.0_wp
      integer(int64) :: matched = 0
   end type difference_t

contains

   !> Run all entries and compare them.
   subroutine compute_duel(machine, motion, entries, content, error)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(entry_t), intent(in) :: entries(:)
      type(duel_content_t), intent(out) :: content
      type(error_t), allocatable, intent(out) :: error

      type(answer_t) :: answer, reference
      type(difference_t) :: difference
      integer :: i

      call find_reference(machine, motion, reference, content, error)
      if (allocated(error)) return
      call make_rows(content, size(entries))
      do i = 1, size(entries)
         call run_method(machine, motion, entries(i)%method, .true., answer, error)
         if (allocated(error)) return
         content%method(i) = entries(i)%method%integrator
         content%treatment(i) = entries(i)%method%treatment
         content%series(i) = int(entries(i)%series, int32)
         content%setting(i) = entries(i)%setting
         content%is_step(i) = entries(i)%is_step
         if (entries(i)%method%treatment == "smoothing") content%sharpness(i) = entries(i)%method%sharpness
         content%status(i) = int(answer%outcome%status, int32)
         content%events(i) = answer%outcome%events
         content%event_surplus(i) = int(answer%log%count - reference%log%count, int64)
         content%cpu_time(i) = answer%cpu_time
         content%evaluations(i) = answer%outcome%evaluations
         content%steps(i) = answer%outcome%steps
         content%rejected(i) = answer%outcome%rejected
         content%jacobians(i) = answer%outcome%jacobians
         content%doubts(i) = answer%outcome%doubts
         content%error(i) = ieee_value(1.0_wp, ieee_quiet_nan)
         content%velocity_error(i) = content%error(i)
         content%event_time_error(i) = content%error(i)
         if (answer%outcome%status /= status_ok) cycle
         difference = compare(answer, reference, machine)
         content%error(i) = difference%displacement
         content%velocity_error(i) = difference%velocity
         content%event_time_error(i) = difference%event_time
         content%events_matched(i) = difference%matched
      end do
   end subroutine compute_duel

   !> The reference and its check: the exact propagator beside the tightest Runge-Kutta method where the laws are piecewise
   !> linear, else the tightest pair of two families of methods.
   subroutine find_reference(machine, motion, reference, content, error)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(answer_t), intent(out) :: reference
      type(duel_content_t), intent(inout) :: content
      type(error_t), allocatable, intent(out) :: error

      type(method_t) :: method, tight
      type(answer_t) :: check
      type(difference_t) :: difference
      character(:), allocatable :: allowed, key

      tight = method_t(integrator="dop853", treatment="event", relative_tolerance=1.0e-13_wp, absolute_tolerance=1.0e-16_wp)
      method = method_t(integrator="exact")
      call check_method(method, machine, key, allowed)
      if (len(key) == 0) then
         content%reference = "exact"
         content%check = "dop853, event, tolerance 1e-13"
      else
         method = tight
         tight%integrator = "radau5"
         tight%relative_tolerance = 1.0e-12_wp
         tight%absolute_tolerance = 1.0e-15_wp
         content%reference = "dop853, event, tolerance 1e-13"
         content%check = "radau5, event, tolerance 1e-12"
      end if
      call run_method(machine, motion, method, .false., reference, error)
      if (.not. allocated(error)) call run_method(machine, motion, tight, .false., check, error)
      if (allocated(error)) return
      if (reference%outcome%status /= status_ok) then
         call raise(error, "no reference: by "//content%reference//" the motion ended with '" &
                    //trim(status_meanings(reference%outcome%status))//"'")
      else if (check%outcome%status /= status_ok) then
         call raise(error, "no check of the reference: by "//content%check//" the motion ended with '" &
                    //trim(status_meanings(check%outcome%status))//"'")
      end if
      if (allocated(error)) return
      difference = compare(check, reference, machine)
      content%reference_error = difference%displacement
      content%reference_event_error = difference%event_time
      content%reference_events = reference%log%count
   end subroutine find_reference

   !> The motion by one method; with `timed` the processor time of runs without recording.
   subroutine run_method(machine, motion, method, timed, answer, error)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(method_t), intent(in) :: method
      logical, intent(in) :: timed
      type(answer_t), intent(out), target :: answer
      type(error_t), allocatable, intent(out) :: error

      class(integrator_t), allocatable, target :: integrator
      type(outcome_t) :: outcome
      type(observer_slot_t) :: slots(2)
      real(wp) :: begin, end, total
      integer :: i

      call new_integrator(integrator, method, error)
      if (.not. allocated(error)) call integrator%prepare(machine, .true., error)
      if (allocated(error)) return
      slots(1)%observer => answer%log
      slots(2)%observer => answer%trajectory
      allocate (answer%trajectory%form(0))
      answer%trajectory%coordinates = size(machine%mass, 1)
      answer%trajectory%interval = motion%t_end/samples
      call answer%trajectory%reset()
      call integrator%run(motion%t_end, motion%most_events, slots, answer%outcome)
      call answer%trajectory%finish()
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

      n = min(answer%trajectory%count, reference%trajectory%count)
      difference%displacement = largest(answer%trajectory%displacement(:, :n), reference%trajectory%displacement(:, :n), &
                                        machine%unit)
      difference%velocity = largest(answer%trajectory%velocity(:, :n), reference%trajectory%velocity(:, :n), machine%unit)
      do i = 1, min(answer%log%count, reference%log%count)
         if (answer%log%contact(i) /= reference%log%contact(i) .or. answer%log%branch(i) /= reference%log%branch(i)) exit
         difference%matched = i
         difference%event_time = max(difference%event_time, abs(answer%log%time(i) - reference%log%time(i)))
      end do
   end function compare

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

   subroutine make_rows(content, rows)
      type(duel_content_t), intent(inout) :: content
      integer, intent(in) :: rows

      allocate (character(16) :: content%method(rows), content%treatment(rows))
      content%status_meanings = [character(48) :: status_meanings]
      allocate (content%series(rows), content%status(rows), source=0_int32)
      allocate (content%setting(rows), content%sharpness(rows), content%error(rows), content%velocity_error(rows), &
                content%event_time_error(rows), content%cpu_time(rows), source=0.0_wp)
      allocate (content%is_step(rows), source=.false.)
      allocate (content%events(rows), content%event_surplus(rows), content%events_matched(rows), content%evaluations(rows), &
                content%steps(rows), content%rejected(rows), content%jacobians(rows), content%doubts(rows), source=0_i8)
   end subroutine make_rows

end module duel
