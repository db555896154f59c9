!! What is asked of a motion, who sees it, and what they hand over: what &record says, the kind of motion, and the states by which
!! attractors are told apart.
module razy_study_watch
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_hybrid_flow, only: flow_t
   use razy_io_result_file, only: check_name
   use razy_machine_drift, only: drift_basis
   use razy_machine_excitation, only: period_of_loads, strobe_period, turn_tones
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: add_observer, ask_stop, observer_slot_t, outcome_t, status_costly, status_inaccurate, &
      & status_ok
   use razy_observe_averages, only: averages_t
   use razy_observe_contact_statistics, only: contact_statistics_t
   use razy_observe_event_log, only: event_log_t
   use razy_observe_extrema, only: extrema_t
   use razy_observe_periodicity, only: periodicity_t
   use razy_observe_reach, only: reach_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_orbits_lyapunov, only: lyapunov_t
   use razy_scenes_case, only: motion_t
   use razy_scenes_common_schema, only: of_averages, of_extrema, of_statistics, of_strobe, of_trajectory
   use razy_scenes_records, only: contacts_asked, record_t
   use razy_study_motion, only: run_motion
   use razy_study_sweep_attractors, only: state_norm
   implicit none(type, external)
   private

   public :: ask_extrema, watch_t

   !> The observers of a motion; `ask`, then `run` and `columns` for each motion.
   type :: watch_t
      !> Extrema of observables are recorded, statistics of contacts.
      type(extrema_t), allocatable :: extrema(:)
      type(contact_statistics_t), private :: statistics
      !> Values once in each period of the excitation; means over the recorded time.
      type(trajectory_t), private :: strobe
      type(averages_t), private :: averages
      !> The list of events and trajectories are recorded, too.
      logical :: in_full = .false.
      !> The kind of the motion is asked for; it is followed only until it is periodic.
      logical :: asks_kind = .false., until_periodic = .false.
      type(periodicity_t) :: periodicity
      !> How long the motion was followed, s.
      real(wp) :: followed = 0.0_wp
      !> Every coordinate is followed, whoever sees it.
      logical :: keep_all = .false.
      !> Asked now and then during a motion, if it is associated: whether the motion is to end at once.
      procedure(ask_stop), pointer, nopass :: stop_is_asked => null()
      !> States at the end of the motion, if so many periods of their interval are asked for.
      integer :: periods = 0
      type(trajectory_t) :: states
      type(reach_t) :: reach
      type(trajectory_t), allocatable, private :: trajectory
      type(event_log_t), private :: log
      type(lyapunov_t), private :: lyapunov
      !> Largest norm of the start and the states that were stored; basis of the drifts of the machine, which it leaves out.
      real(wp), private :: norm = 0.0_wp
      real(wp), allocatable, private :: drifts(:, :)
   contains
      procedure :: ask
      procedure :: forget
      procedure :: run
      procedure :: columns
      procedure, private :: ask_trajectory
   end type watch_t

contains

   !> Take over what is recorded of the observables and contacts of a machine.
   !>
   !> Errors: a name that cannot stand in a result file.
   subroutine ask(self, records, machine, motion, error)
      class(watch_t), intent(inout) :: self
      type(record_t), intent(in) :: records(:)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(error_t), allocatable, intent(out) :: error

      logical :: first
      integer :: i

      self%lyapunov%asked = motion%lyapunov
      self%lyapunov%intervals = motion%lyapunov_periods
      do i = 1, size(machine%observable)
         if (.not. allocated(error)) call check_name(machine%observable(i)%name, error)
      end do
      do i = 1, size(machine%contact)
         if (any(records%asks(of_statistics)) .and. .not. allocated(error)) call check_name(machine%contact(i)%name, error)
      end do
      if (allocated(error)) return

      ! All points of a sweep have the same columns.
      first = .not. allocated(self%extrema)
      call ask_extrema(self%extrema, records)
      ! Nothing excites the machine, so that its motions have periods of their own.
      if (first .and. self%asks_kind .and. .not. self%in_full .and. .not. any(machine%tone%omega > 0.0_wp)) then
         if (size(self%extrema) > 0) self%extrema(1)%cycle_tolerance = self%periodicity%tolerance
      end if
      self%statistics%numbers = contacts_asked(records, size(machine%contact))
      self%statistics%from = minval(records%from, mask=records%asks(of_statistics))
      self%averages%form = pack(records%observable, records%asks(of_averages))
      self%strobe%form = pack(records%observable, records%asks(of_strobe))
      self%strobe%strobe = .true.
      self%strobe%interval = strobe_period(machine)
      self%averages%from = minval(records%from, mask=records%asks(of_averages))
      self%strobe%from = minval(records%from, mask=records%asks(of_strobe))
      self%states%form = [integer ::]
      self%states%coordinates = size(machine%mass, 1)
      self%periodicity%from = minval(records%from, mask=records%of_points())
      if (self%in_full .and. any(records%asks(of_trajectory))) call self%ask_trajectory(records, size(machine%mass, 1))
   end subroutine ask

   !> Observers of all extrema that are asked for; those that are there keep what they have seen.
   subroutine ask_extrema(extrema, records)
      type(extrema_t), allocatable, intent(inout) :: extrema(:)
      type(record_t), intent(in) :: records(:)

      if (.not. allocated(extrema)) allocate (extrema(count(records%asks(of_extrema))))
      extrema%form = pack(records%observable, records%asks(of_extrema))
      extrema%from = pack(records%from, records%asks(of_extrema))
   end subroutine ask_extrema

   !> All trajectories share their times; one without an observable is that of all `n` coordinates.
   subroutine ask_trajectory(self, records, n)
      class(watch_t), intent(inout) :: self
      type(record_t), intent(in) :: records(:)
      integer, intent(in) :: n

      allocate (self%trajectory)
      self%trajectory%from = minval(records%from, mask=records%asks(of_trajectory))
      self%trajectory%interval = minval(records%interval, mask=records%asks(of_trajectory))
      self%trajectory%form = pack(records%observable, records%asks(of_trajectory) .and. records%observable > 0)
      if (any(records%asks(of_trajectory) .and. records%observable == 0)) self%trajectory%coordinates = n
      self%keep_all = self%keep_all .or. self%trajectory%coordinates > 0
   end subroutine ask_trajectory

   !> The observers whose columns a result has, in their order.
   subroutine list(self, slots)
      class(watch_t), intent(in), target :: self
      type(observer_slot_t), allocatable, intent(out) :: slots(:)

      integer :: i

      allocate (slots(0))
      if (allocated(self%trajectory)) call add_observer(slots, self%trajectory)
      if (self%in_full) call add_observer(slots, self%log)
      do i = 1, size(self%extrema)
         call add_observer(slots, self%extrema(i))
      end do
      if (size(self%statistics%numbers) > 0) call add_observer(slots, self%statistics)
      if (size(self%averages%form) > 0) call add_observer(slots, self%averages)
      if (size(self%strobe%form) > 0) call add_observer(slots, self%strobe)
   end subroutine list

   !> Nothing was seen of a machine.
   subroutine forget(self, machine)
      class(watch_t), intent(inout) :: self
      type(machine_t), intent(in), optional :: machine

      type(observer_slot_t), allocatable :: slots(:)
      integer :: i

      call list(self, slots)
      do i = 1, size(slots)
         if (present(machine)) call slots(i)%observer%attach(machine, 0.0_wp)
         call slots(i)%observer%forget()
      end do
      if (present(machine)) call self%periodicity%attach(machine, 0.0_wp)
      call self%periodicity%forget()
      call self%lyapunov%forget()
      call self%states%forget()
   end subroutine forget

   !> Run a machine as `motion` says, and watch; see `run_motion` for `integrator` and errors.
   !>
   !> Where the motion is to be followed only until it is periodic, it is tried with twice the recorded time, and anew with twice
   !> that as long as it has no period; the end of the recorded time is the end of the motion, and `t_end` the longest. Where a
   !> closed form is not accurate, or they do not pay, and the method is `automatic`, it is followed by dop853 from its start.
   subroutine run(self, machine, motion, outcome, error, integrator)
      class(watch_t), intent(inout), target :: self
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(outcome_t), intent(out) :: outcome
      type(error_t), allocatable, intent(out) :: error
      class(flow_t), allocatable, intent(inout), target :: integrator

      type(motion_t) :: tried
      real(wp) :: recorded

      tried = motion
      if (self%until_periodic) then
         recorded = motion%t_end - self%periodicity%from
         tried%t_end = min(2*recorded, motion%t_end)
      end if
      do
         self%followed = tried%t_end
         call follow(self, machine, tried, motion%t_end - tried%t_end, outcome, error, integrator)
         if (any(outcome%status == [status_inaccurate, status_costly]) .and. tried%method%automatic) then
            tried%method%automatic = .false.
            tried%method%integrator = "dop853"
            cycle
         end if
         if (allocated(error) .or. outcome%status /= status_ok .or. tried%t_end >= motion%t_end) return
         if (self%periodicity%found() > 0) return
         tried%t_end = min(2*tried%t_end, motion%t_end)
      end do
   end subroutine run

   !> One motion, recorded from `earlier` s before what &record says.
   subroutine follow(self, machine, motion, earlier, outcome, error, integrator)
      class(watch_t), intent(inout), target :: self
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: earlier
      type(outcome_t), intent(out) :: outcome
      type(error_t), allocatable, intent(out) :: error
      class(flow_t), allocatable, intent(inout), target :: integrator

      type(observer_slot_t), allocatable :: slots(:)
      real(wp), allocatable :: from(:)
      integer :: i

      call list(self, slots)
      self%states%from = motion%t_end + earlier - self%periods*self%states%interval
      if (self%asks_kind) call add_observer(slots, self%periodicity)
      if (self%in_full) call add_observer(slots, self%reach)
      if (self%periods > 0) call add_observer(slots, self%states)
      from = [(slots(i)%observer%from, i=1, size(slots))]
      do i = 1, size(slots)
         slots(i)%observer%from = max(from(i) - earlier, 0.0_wp)
      end do
      call self%forget()
      call run_motion(machine, motion%method, motion%t_end, slots, outcome, error, motion%most_events, &
                      self%keep_all .or. self%periods > 0, integrator, self%stop_is_asked)
      if (.not. allocated(error) .and. outcome%status == status_ok .and. motion%lyapunov > 0) then
         call find_exponents(self, machine, motion, integrator, error)
      end if
      do i = 1, size(slots)
         slots(i)%observer%from = from(i)
      end do
      if (allocated(error)) call self%forget()
      if (self%periods == 0) return
      if (outcome%status /= status_ok) call self%states%forget()
      self%drifts = drift_basis(machine)
      self%norm = norm_of(self, machine, [machine%displacement, machine%velocity])
      do i = 1, self%states%count
         self%norm = max(self%norm, norm_of(self, machine, [self%states%displacement(:, i), self%states%velocity(:, i)]))
      end do
   end subroutine follow

   !> Lyapunov exponents from the end of a motion on.
   subroutine find_exponents(self, machine, motion, by, error)
      class(watch_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      class(flow_t), allocatable, intent(inout), target :: by
      type(error_t), allocatable, intent(out) :: error

      type(machine_t) :: later
      real(wp), allocatable :: omega(:), z(:)
      real(wp) :: interval
      integer :: t
      logical :: whole

      interval = period_of_loads(machine)
      if (.not. interval > 0.0_wp) interval = motion%t_end/100
      later = machine
      omega = machine%tone%omega
      do t = 1, size(omega)
         if (allocated(machine%tone(t)%waveform)) omega(t) = 2*acos(-1.0_wp)*machine%tone(t)%hertz
      end do
      call turn_tones(later, exp(cmplx(0.0_wp, modulo(omega*motion%t_end, 2*acos(-1.0_wp)), wp)))
      z = by%z
      whole = by%system%keep_all
      if (whole) call by%final_state(later%displacement, later%velocity)
      call by%prepare(later, .false., error)
      if (allocated(error)) return
      if (whole) z = by%system%first_state()
      call self%lyapunov%follow(by, z, interval)
   end subroutine find_exponents

   !> Hand over what was seen of a motion of a machine.
   subroutine columns(self, table, machine)
      class(watch_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      type(observer_slot_t), allocatable :: slots(:)
      integer :: i

      call list(self, slots)
      do i = 1, size(slots)
         call slots(i)%observer%columns(table, machine)
      end do
      if (self%asks_kind .and. .not. self%in_full) call self%periodicity%columns(table, machine)
      if (self%until_periodic) call table%add("/point/duration", self%followed, "s", "time that the motion was followed")
      if (self%lyapunov%asked > 0) call self%lyapunov%columns(table)
      if (self%periods == 0) return
      call table%add("strobe/norm", self%norm, "1", "largest norm of the states")
      associate (states => self%states)
         call table%add("strobe/states", reshape([(states%displacement(:, i), states%velocity(:, i), i=1, states%count)], &
                                                 [2*states%coordinates*states%count]), "1", "states", "strobe/value")
      end associate
   end subroutine columns

   pure real(wp) function norm_of(self, machine, state)
      class(watch_t), intent(in) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: state(:)

      norm_of = state_norm(machine%mass, 2*acos(-1.0_wp)/self%states%interval, self%drifts, state)
   end function norm_of

end module razy_study_watch
