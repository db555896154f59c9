!! One motion at each point of a sweep: extrema of the observables, status and counters.
!!
!! A driver extends this type with what makes a machine of a point. The propagator keeps modes from point to point as long as
!! only excitation, clearances or start differ; that changes no bit of a result.
!!
!! In a chain each motion starts where the one before ended (razy_sweep_carried); after a motion that failed the chain begins anew
!! as the input says. A machine whose stiffness varies has another split into coordinates that its contacts feel and those they do
!! not, so chains follow every coordinate.
!!
!! Where attractors are looked for (`strobe_periods`), a result has the states of the motion at its end, some periods of the
!! excitation apart, for razy_dynamics_attractors.
!!
!! Results go to the checkpoint at once; rank 0 keeps the place of each and the numbers of extrema.
module razy_sweep_motion_task
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_dynamics_attractors, only: state_norm
   use razy_dynamics_contact_statistics, only: contact_statistics_t
   use razy_dynamics_contact_tally, only: quantities
   use razy_dynamics_extrema, only: extrema_t
   use razy_dynamics_periodicity, only: periodicity_t, undetermined
   use razy_dynamics_strobe, only: strobe_t
   use razy_integrate_factory, only: new_integrator
   use razy_integrate_integrator, only: integrator_t, observer_slot_t, outcome_t, status_no_machine, status_ok
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_method, only: method_t
   use razy_machine_machine, only: machine_t
   use razy_sweep_carried, only: carried_t
   use razy_sweep_checkpoint, only: checkpoint_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_plan, only: plan_t
   use razy_sweep_task, only: point_result_t, point_task
   implicit none(type, external)
   private

   public :: motion_result_t, motion_task_t

   !> Integers of a result before those of the observables, for each observable, of the kind of motion, of stroboscopic states, and
   !> of the end of a link of a chain.
   integer(i8), parameter :: n_head = 6, n_each = 2, n_kind = 2, n_strobe = 1, n_carried = 2

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
      !> Period of the motion and contacts touched, if they are asked for (razy_dynamics_periodicity).
      integer :: period = undetermined
      integer(i8) :: touched = 0
      !> Statistics of the contacts that are asked for (quantities, contacts).
      real(wp), allocatable :: statistics(:, :)
      !> Stroboscopic states: number of reals, and the place of the first; see `append_strobe`.
      integer(i8) :: strobe_count = 0, strobe_place = 0
   end type motion_result_t

   !> The task. Units and points of the sweep are those of `plan`, the same on all ranks.
   type, abstract, extends(point_task) :: motion_task_t
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      type(machine_t) :: machine
      type(method_t) :: method
      class(integrator_t), allocatable :: integrator
      type(extrema_t), allocatable :: extrema(:)
      !> Contacts whose statistics are asked for, by number; whether the kind of each motion is.
      integer, allocatable :: contacts(:)
      type(contact_statistics_t) :: statistics
      logical :: asks_kind = .false.
      type(periodicity_t) :: periodicity
      type(plan_t) :: plan
      !> Periods of the excitation before the end of each motion at which its state is stored, 0: no state is; the period, s.
      integer :: strobe_periods = 0
      real(wp) :: strobe_period = 0.0_wp
      type(strobe_t), private :: strobe
      !> The unit that is being computed, the link of its chain that was computed last, and what it carries on.
      integer(i8), private :: at_unit = 0, link = 0
      type(carried_t), private :: carried
      !> Where chains that are taken up go on: the last result of each, one after the other. (units + 1), (units + 1)
      integer(i8), allocatable, private :: integers_before(:), reals_before(:), last_integers(:)
      real(wp), allocatable, private :: last_reals(:)
      !> On rank 0: the results, and the number of extrema of each observable (observables).
      type(checkpoint_t) :: checkpoint
      integer(i8), allocatable :: total(:)
      !> On rank 0: points that are done and failed.
      integer(i8) :: failures = 0
   contains
      procedure(make_machine), deferred :: machine_at
      procedure :: run => run_unit
      procedure :: collect => collect_point
      procedure :: settle => settle_points
      procedure :: prepare_root
      procedure :: share_plan
      procedure :: result_at
      procedure :: try_point => run_point
      procedure :: extrema_found
      procedure, private :: run_point
      procedure, private :: resume_chain
      procedure, private :: recall_chains
   end type motion_task_t

   abstract interface
      !> Set `self%machine`, `self%method` and, with strobes, `self%strobe_period` to those of point number `point`.
      subroutine make_machine(self, point, error)
         import :: error_t, i8, motion_task_t
         implicit none(type, external)
         class(motion_task_t), intent(inout) :: self
         integer(i8), intent(in) :: point
         type(error_t), allocatable, intent(out) :: error
      end subroutine make_machine
   end interface

contains

   !> On rank 0: open the checkpoint of the result file `output`, and find out what is to be done.
   subroutine prepare_root(self, output, input, error)
      class(motion_task_t), intent(inout) :: self
      character(*), intent(in) :: output, input
      type(error_t), allocatable, intent(out) :: error

      type(point_result_t) :: result
      type(motion_result_t) :: motion
      integer(i8) :: n_integers, point
      logical :: whole

      n_integers = n_head + n_each*size(self%extrema) + merge(n_kind, 0_i8, self%asks_kind) &
                   + merge(n_strobe, 0_i8, self%strobe_periods > 0) &
                   + merge(n_carried, 0_i8, self%plan%has_chains())
      allocate (self%total(size(self%extrema)), source=0_i8)
      call self%checkpoint%open(output, input, n_integers, self%plan, error)
      if (allocated(error)) return
      do point = 1, merge(self%plan%points, 0_i8, self%plan%n_done > 0)
         if (.not. self%plan%done(point)) cycle
         call self%result_at(point, result, motion, error)
         if (allocated(error)) return
         self%total = self%total + motion%count
         if (motion%status /= status_ok) self%failures = self%failures + 1
      end do
      call self%plan%close(whole)
      if (.not. whole) then
         call raise(error, self%checkpoint%journal%file%path//": does not belong to this sweep; delete it to begin anew")
      else if (self%plan%has_chains()) then
         call self%recall_chains(error)
      end if
   end subroutine prepare_root

   !> Collect the last results of chains that are to go on.
   subroutine recall_chains(self, error)
      class(motion_task_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(point_result_t) :: result, all
      integer(i8) :: unit, units

      units = self%plan%units()
      allocate (self%integers_before(units + 1), self%reals_before(units + 1), source=0_i8)
      call all%reserve(0_i8, 0_i8)
      do unit = 1, units
         if (self%plan%reached(unit) > 0) then
            call self%checkpoint%get(self%plan%point_of_link(self%plan%chain(unit), self%plan%reached(unit)), result, error)
            if (allocated(error)) return
            call all%append(result%integers(:result%n_integers))
            call all%append(result%reals(:result%n_reals))
         end if
         self%integers_before(unit + 1) = all%n_integers
         self%reals_before(unit + 1) = all%n_reals
      end do
      self%last_integers = all%integers(:all%n_integers)
      self%last_reals = all%reals(:all%n_reals)
   end subroutine recall_chains

   !> Give all ranks the plan that rank 0 has closed. Collective.
   subroutine share_plan(self, communicator, error)
      class(motion_task_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(error_t), allocatable, intent(out) :: error

      call communicator%broadcast(self%plan%n_done, error)
      if (self%plan%has_chains()) then
         if (.not. allocated(error)) call communicator%broadcast(self%plan%chain, error)
         if (.not. allocated(error)) call communicator%broadcast(self%plan%reached, error)
         if (.not. allocated(error)) call communicator%broadcast(self%integers_before, error)
         if (.not. allocated(error)) call communicator%broadcast(self%reals_before, error)
         if (.not. allocated(error)) call communicator%broadcast(self%last_integers, error)
         if (.not. allocated(error)) call communicator%broadcast(self%last_reals, error)
      else
         if (.not. allocated(error)) call communicator%broadcast(self%plan%run_first, error)
         if (.not. allocated(error)) call communicator%broadcast(self%plan%run_before, error)
      end if
   end subroutine share_plan

   !> Compute a missing point, or the next link of a chain.
   subroutine run_unit(self, point, result)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result

      if (self%plan%has_chains()) then
         if (self%at_unit /= point) call self%resume_chain(point)
         self%link = self%link + 1
         call self%run_point(self%plan%point_of_link(self%plan%chain(point), self%link), result)
         result%continues = self%link < self%plan%first_axis
         if (.not. result%continues) self%at_unit = 0
      else
         call self%run_point(self%plan%point_of_unit(point), result)
      end if
   end subroutine run_unit

   !> Take up the chain of a unit where it ended.
   subroutine resume_chain(self, unit)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: unit

      type(point_result_t) :: result

      self%at_unit = unit
      self%link = self%plan%reached(unit)
      call self%carried%forget()
      if (self%link == 0) return
      call result%append(self%last_integers(self%integers_before(unit) + 1:self%integers_before(unit + 1)))
      call result%append(self%last_reals(self%reals_before(unit) + 1:self%reals_before(unit + 1)))
      call self%carried%take_from(result)
   end subroutine resume_chain

   !> Compute one motion: status, events, steps, point, time in ns, doubts, then count and first kind for each observable, and
   !> values and times; if asked for its period and what it touches, statistics of contacts, and stroboscopic states; in a chain
   !> then what is carried on.
   subroutine run_point(self, point, result)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result

      type(error_t), allocatable :: error
      type(outcome_t) :: outcome
      real(wp), allocatable :: displacement(:), velocity(:)
      real(wp) :: begun, start_norm
      integer :: i

      begun = seconds()
      start_norm = 0.0_wp
      do i = 1, size(self%extrema)
         call self%extrema(i)%reset()
      end do
      call self%machine_at(point, error)
      if (self%plan%has_chains() .and. .not. allocated(error)) call self%carried%begin(self%machine)
      if (.not. allocated(error)) call new_integrator(self%integrator, self%method, error)
      if (.not. allocated(error)) call self%integrator%prepare(self%machine, self%plan%has_chains() .or. self%strobe_periods > 0, &
                                                               error)
      if (allocated(error)) then
         outcome%status = status_no_machine
      else
         call self%statistics%attach(self%machine, self%contacts)
         if (self%asks_kind) call self%periodicity%attach(self%machine, self%t_end)
         if (self%strobe_periods > 0) then
            call self%strobe%begin(size(self%machine%mass, 1), self%t_end, self%strobe_period, self%strobe_periods)
            start_norm = norm_of(self, [self%machine%displacement, self%machine%velocity])
         end if
         call follow(self%integrator, self, outcome)
      end if
      call result%append([int(outcome%status, i8), outcome%events, outcome%steps, point, nint(1.0e9_wp*(seconds() - begun), i8), &
                          outcome%doubts])
      do i = 1, size(self%extrema)
         associate (extrema => self%extrema(i))
            call result%append(int(extrema%count, i8))
            call result%append(int(merge(extrema%kind(1), 0, extrema%count > 0), i8))
            call result%append(extrema%value(:extrema%count))
            call result%append(extrema%time(:extrema%count))
         end associate
      end do
      call append_observed(self, outcome%status, result)
      if (self%strobe_periods > 0) call append_strobe(self, outcome%status == status_ok, start_norm, result)
      if (.not. self%plan%has_chains()) return
      if (outcome%status == status_ok) then
         allocate (displacement(size(self%machine%displacement)), velocity(size(self%machine%velocity)))
         call self%integrator%final_state(displacement, velocity)
         call self%carried%finish(self%machine, self%t_end, displacement, velocity)
      else
         call self%carried%forget()
      end if
      call self%carried%append_to(result)
   end subroutine run_point

   !> Number of extrema of the motion that was computed last.
   pure integer(i8) function extrema_found(self) result(n)
      class(motion_task_t), intent(in) :: self

      n = sum(int(self%extrema%count, i8))
   end function extrema_found

   !> Append the stroboscopic states of a motion, if it is `complete`: the largest norm of start and states, then the states one
   !> after the other (2 n, periods + 1).
   subroutine append_strobe(self, complete, start_norm, result)
      class(motion_task_t), intent(in) :: self
      logical, intent(in) :: complete
      real(wp), intent(in) :: start_norm
      type(point_result_t), intent(inout) :: result

      real(wp) :: norm
      integer :: k

      if (.not. complete) then
         call result%append(0_i8)
         return
      end if
      norm = start_norm
      do k = 1, self%strobe%count
         norm = max(norm, norm_of(self, self%strobe%state(:, k)))
      end do
      call result%append(1 + size(self%strobe%state, 1, kind=i8)*self%strobe%count)
      call result%append(norm)
      do k = 1, self%strobe%count
         call result%append(self%strobe%state(:, k))
      end do
   end subroutine append_strobe

   pure real(wp) function norm_of(self, state)
      class(motion_task_t), intent(in) :: self
      real(wp), intent(in) :: state(:)

      norm_of = state_norm(self%machine%mass, 2*acos(-1.0_wp)/self%strobe_period, state)
   end function norm_of

   !> Append period and contacts touched, and statistics, as far as they are asked for; of a machine that could not be made neither.
   subroutine append_observed(self, status, result)
      class(motion_task_t), intent(inout) :: self
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
      period = period_of_loads(self%machine)
      do i = 1, size(self%contacts)
         call result%append(self%statistics%tally(i)%values(self%statistics%time, period))
      end do
   end subroutine append_observed

   !> Run the integrator with all observers.
   subroutine follow(integrator, self, outcome)
      class(integrator_t), intent(inout) :: integrator
      class(motion_task_t), intent(inout), target :: self
      type(outcome_t), intent(out) :: outcome

      type(observer_slot_t) :: slots(size(self%extrema) + 3)
      integer :: i, n

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
      call integrator%run(self%t_end, self%most_events, slots(:n), outcome)
   end subroutine follow

   !> Take over a result: count its extrema and put it into the checkpoint.
   subroutine collect_point(self, point, result, error)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(in) :: result
      type(error_t), allocatable, intent(out) :: error

      integer :: i
      logical :: fresh

      fresh = point >= 1 .and. result%n_integers == self%checkpoint%n_integers
      if (fresh) call self%plan%mark_done(result%integers(4), fresh)
      if (.not. fresh) then
         call raise(error, "a point has sent a result of another sweep, or twice")
         return
      end if
      do i = 1, size(self%total)
         self%total(i) = self%total(i) + result%integers(n_head + n_each*(i - 1) + 1)
      end do
      if (result%integers(1) /= status_ok) self%failures = self%failures + 1
      call self%checkpoint%put(result%integers(4), result)
   end subroutine collect_point

   !> Make the results collected so far safe.
   subroutine settle_points(self, error)
      class(motion_task_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%checkpoint%settle(error)
   end subroutine settle_points

   !> On rank 0: what became of a point that is done; values and times stand in `result`.
   subroutine result_at(self, point, result, motion, error)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result
      type(motion_result_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: place
      integer :: i, n

      call self%checkpoint%get(point, result, error)
      if (allocated(error)) return
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
   end subroutine result_at

end module razy_sweep_motion_task
