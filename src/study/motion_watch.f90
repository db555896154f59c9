!! What is asked of each motion of a sweep, and the form in which it goes into the point's result.
!!
!! Where attractors are looked for (`strobe_periods`), a result has the states of the motion at its end, some periods of the
!! excitation apart, for razy_study_attractors.
module razy_study_motion_watch
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_kinds, only: i8, wp
   use razy_study_attractors, only: state_norm
   use razy_observe_contact_statistics, only: contact_statistics_t
   use razy_observe_contact_tally, only: quantities
   use razy_observe_extrema, only: extrema_t
   use razy_observe_periodicity, only: periodicity_t, undetermined
   use razy_observe_strobe, only: strobe_t
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, status_no_machine, status_ok
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_machine, only: machine_t
   use razy_sweep_task, only: point_result_t
   implicit none(type, external)
   private

   public :: motion_result_t, motion_watch_t

   !> Integers of a result before those of the observables, for each observable, of the kind of motion, and of stroboscopic states.
   integer(i8), parameter :: n_head = 6, n_each = 2, n_kind = 2, n_strobe = 1

   !> What became of one point.
   type :: motion_result_t
      integer :: status = 0
      !> Changes of branch, steps, events in doubt.
      integer(i8) :: events = 0, steps = 0, doubts = 0
      !> Time that it took, s.
      real(wp) :: seconds = 0.0_wp
      !> For each observable (observables): number of extrema, kind of the first, which alternate with the others, and the place
      !> of the first value among the reals of the result; the times follow the values.
      integer(i8), allocatable :: count(:), place(:)
      integer(int8), allocatable :: first_kind(:)
      !> Period of the motion and contacts touched, if they are asked for (razy_observe_periodicity).
      integer :: period = undetermined
      integer(i8) :: touched = 0
      !> Statistics of the contacts that are asked for (quantities, contacts).
      real(wp), allocatable :: statistics(:, :)
      !> Stroboscopic states: number of reals, and the place of the first; see `append_strobe`.
      integer(i8) :: strobe_count = 0, strobe_place = 0
   end type motion_result_t

   !> The observers of a motion.
   type :: motion_watch_t
      type(extrema_t), allocatable :: extrema(:)
      !> Contacts whose statistics are asked for, by number; whether the kind of each motion is.
      integer, allocatable :: contacts(:)
      type(contact_statistics_t) :: statistics
      logical :: asks_kind = .false.
      type(periodicity_t) :: periodicity
      !> Periods of the excitation before the end of each motion at which its state is stored, 0: no state is; the period, s.
      integer :: strobe_periods = 0
      real(wp) :: strobe_period = 0.0_wp
      type(strobe_t), private :: strobe
      !> Norm of the state at the start of the motion.
      real(wp), private :: start_norm = 0.0_wp
   contains
      procedure :: integers
      procedure :: reset
      procedure :: run
      procedure :: append_to
      procedure, nopass :: count_of
      procedure :: extrema_found
      procedure :: read_from
   end type motion_watch_t

contains

   !> Integers of a result.
   pure integer(i8) function integers(self)
      class(motion_watch_t), intent(in) :: self

      integers = n_head + n_each*size(self%extrema) + merge(n_kind, 0_i8, self%asks_kind) &
         + merge(n_strobe, 0_i8, self%strobe_periods > 0)
   end function integers

   !> Forget the motion before.
   subroutine reset(self)
      class(motion_watch_t), intent(inout) :: self

      integer :: i

      do i = 1, size(self%extrema)
         call self%extrema(i)%reset()
      end do
   end subroutine reset

   !> Run the integrator, which has been prepared for the machine, and watch.
   subroutine run(self, integrator, machine, t_end, most_events, outcome)
      class(motion_watch_t), intent(inout), target :: self
      class(integrator_t), intent(inout) :: integrator
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(outcome_t), intent(out) :: outcome

      type(observer_slot_t) :: slots(size(self%extrema) + 3)
      integer :: i, n

      call self%statistics%attach(machine, self%contacts)
      if (self%asks_kind) call self%periodicity%attach(machine, t_end)
      if (self%strobe_periods > 0) then
         call self%strobe%begin(size(machine%mass, 1), t_end, self%strobe_period, self%strobe_periods)
         self%start_norm = norm_of(self, machine, [machine%displacement, machine%velocity])
      end if
      n = size(self%extrema)
      do i = 1, n
         slots(i)%observer => self%extrema(i)
      end do
      if (size(self%contacts) > 0) then
         n = n + 1
         slots(n)%observer => self%statistics
      end if
      if (self%asks_kind) then
         n = n + 1
         slots(n)%observer => self%periodicity
      end if
      if (self%strobe_periods > 0) then
         n = n + 1
         slots(n)%observer => self%strobe
      end if
      call integrator%run(t_end, most_events, slots(:n), outcome)
   end subroutine run

   !> Append what was seen: status, events, steps, point, time in ns, doubts, then count and first kind for each observable, and
   !> values and times; if asked for period and what it touches, statistics of contacts, and stroboscopic states.
   subroutine append_to(self, result, machine, outcome, point, took)
      class(motion_watch_t), intent(in) :: self
      type(point_result_t), intent(inout) :: result
      type(machine_t), intent(in) :: machine
      type(outcome_t), intent(in) :: outcome
      integer(i8), intent(in) :: point
      real(wp), intent(in) :: took

      integer :: i

      call result%append([int(outcome%status, i8), outcome%events, outcome%steps, point, nint(1.0e9_wp*took, i8), outcome%doubts])
      do i = 1, size(self%extrema)
         associate (extrema => self%extrema(i))
            call result%append(int(extrema%count, i8))
            call result%append(int(merge(extrema%kind(1), 0, extrema%count > 0), i8))
            call result%append(extrema%value(:extrema%count))
            call result%append(extrema%time(:extrema%count))
         end associate
      end do
      call append_observed(self, machine, outcome%status, result)
      if (self%strobe_periods > 0) call append_strobe(self, machine, outcome%status == status_ok, result)
   end subroutine append_to

   !> Number of extrema of observable i in a result.
   pure integer(i8) function count_of(result, i)
      type(point_result_t), intent(in) :: result
      integer, intent(in) :: i

      count_of = result%integers(n_head + n_each*(i - 1) + 1)
   end function count_of

   !> Number of extrema of the motion that was computed last.
   pure integer(i8) function extrema_found(self) result(n)
      class(motion_watch_t), intent(in) :: self

      n = sum(int(self%extrema%count, i8))
   end function extrema_found

   !> Append the stroboscopic states of a motion, if it is `complete`: the largest norm of start and states, then the states one
   !> after the other (2 n, periods + 1).
   subroutine append_strobe(self, machine, complete, result)
      class(motion_watch_t), intent(in) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: complete
      type(point_result_t), intent(inout) :: result

      real(wp) :: norm
      integer :: k

      if (.not. complete) then
         call result%append(0_i8)
         return
      end if
      norm = self%start_norm
      do k = 1, self%strobe%count
         norm = max(norm, norm_of(self, machine, self%strobe%state(:, k)))
      end do
      call result%append(1 + size(self%strobe%state, 1, kind=i8)*self%strobe%count)
      call result%append(norm)
      do k = 1, self%strobe%count
         call result%append(self%strobe%state(:, k))
      end do
   end subroutine append_strobe

   pure real(wp) function norm_of(self, machine, state)
      class(motion_watch_t), intent(in) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: state(:)

      norm_of = state_norm(machine%mass, 2*acos(-1.0_wp)/self%strobe_period, state)
   end function norm_of

   !> Append period and contacts touched, and statistics, as far as they are asked for; of a machine that could not be made neither.
   subroutine append_observed(self, machine, status, result)
      class(motion_watch_t), intent(in) :: self
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: status
      type(point_result_t), intent(inout) :: result

      real(wp) :: period
      integer :: i

      if (status == status_no_machine) then
         if (self%asks_kind) call result%append([int(undetermined, i8), 0_i8])
         call result%append([(ieee_value(1.0_wp, ieee_quiet_nan), i=1, quantities*size(self%contacts))])
         return
      end if
      if (self%asks_kind) call result%append([int(self%periodicity%found(), i8), self%periodicity%touched])
      period = period_of_loads(machine)
      do i = 1, size(self%contacts)
         call result%append(self%statistics%tally(i)%values(self%statistics%time, period))
      end do
   end subroutine append_observed

   !> What became of a point; values and times stand in `result`.
   pure subroutine read_from(self, result, motion)
      class(motion_watch_t), intent(in) :: self
      type(point_result_t), intent(in) :: result
      type(motion_result_t), intent(inout) :: motion

      integer(i8) :: place
      integer :: i, n

      n = size(self%extrema)
      if (.not. allocated(motion%count)) allocate (motion%count(n), motion%place(n), motion%first_kind(n))
      motion%status = int(result%integers(1))
      motion%events = result%integers(2)
      motion%steps = result%integers(3)
      motion%seconds = 1.0e-9_wp*result%integers(5)
      motion%doubts = result%integers(6)
      place = 1
      do i = 1, n
         motion%count(i) = result%integers(n_head + n_each*(i - 1) + 1)
         motion%first_kind(i) = int(result%integers(n_head + n_each*i), int8)
         motion%place(i) = place
         place = place + 2*motion%count(i)
      end do
      if (self%asks_kind) then
         motion%period = int(result%integers(n_head + n_each*n + 1))
         motion%touched = result%integers(n_head + n_each*n + 2)
      end if
      motion%statistics = reshape(result%reals(place:place + quantities*size(self%contacts) - 1), [quantities, size(self%contacts)])
      place = place + quantities*size(self%contacts)
      if (self%strobe_periods == 0) return
      motion%strobe_count = result%integers(n_head + n_each*n + merge(n_kind, 0_i8, self%asks_kind) + n_strobe)
      motion%strobe_place = place
   end subroutine read_from

end module razy_study_motion_watch
