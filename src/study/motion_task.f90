!! One motion at each point of a sweep, and what is seen of it (razy_study_motion_watch).
!!
!! A driver extends this type with what makes a machine of a point. The propagator keeps modes from point to point as long as
!! only excitation, clearances or start differ; that changes no bit of a result.
!!
!! In a chain each motion starts where the one before ended (razy_study_continuation_state); after a motion that failed the
!! chain begins anew as the input says. A machine whose stiffness varies has another split into coordinates that its contacts
!! feel and those they do not, so chains follow every coordinate.
!!
!! Results go to the checkpoint at once; rank 0 keeps the place of each and the numbers of extrema.
module razy_study_motion_task
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_study_integrators, only: new_integrator
   use razy_motion_integrator, only: integrator_t, outcome_t, status_no_machine, status_ok
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   use razy_study_continuation_state, only: carried_t
   use razy_sweep_checkpoint, only: checkpoint_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_study_motion_watch, only: motion_result_t, motion_watch_t
   use razy_sweep_plan, only: plan_t
   use razy_sweep_task, only: point_result_t, point_task
   implicit none(type, external)
   private

   public :: motion_task_t

   !> Integers of a result for the end of a link of a chain.
   integer(i8), parameter :: n_carried = 2

   !> The task. Units and points of the sweep are those of `plan`, the same on all ranks.
   type, abstract, extends(point_task) :: motion_task_t
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      type(machine_t) :: machine
      type(method_t) :: method
      class(integrator_t), allocatable :: integrator
      type(motion_watch_t) :: watch
      type(plan_t) :: plan
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
      procedure, private :: run_point
      procedure, private :: resume_chain
      procedure, private :: recall_chains
   end type motion_task_t

   abstract interface
      !> Set `self%machine`, `self%method` and, with strobes, `self%watch%strobe_period` to those of point number `point`.
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

      n_integers = self%watch%integers() + merge(n_carried, 0_i8, self%plan%has_chains())
      allocate (self%total(size(self%watch%extrema)), source=0_i8)
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

   !> Compute one motion; in a chain its result has what is carried on, too.
   subroutine run_point(self, point, result)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result

      type(error_t), allocatable :: error
      type(outcome_t) :: outcome
      real(wp), allocatable :: displacement(:), velocity(:)
      real(wp) :: begun
      logical :: chains

      begun = seconds()
      chains = self%plan%has_chains()
      call self%watch%reset()
      call self%machine_at(point, error)
      if (chains .and. .not. allocated(error)) call self%carried%begin(self%machine)
      if (.not. allocated(error)) call new_integrator(self%integrator, self%method, error)
      if (.not. allocated(error)) call self%integrator%prepare(self%machine, chains .or. self%watch%strobe_periods > 0, error)
      if (allocated(error)) then
         outcome%status = status_no_machine
      else
         call self%watch%run(self%integrator, self%machine, self%t_end, self%most_events, outcome)
      end if
      call self%watch%append_to(result, self%machine, outcome, point, seconds() - begun)
      if (.not. chains) return
      if (outcome%status == status_ok) then
         allocate (displacement(size(self%machine%displacement)), velocity(size(self%machine%velocity)))
         call self%integrator%final_state(displacement, velocity)
         call self%carried%finish(self%machine, self%t_end, displacement, velocity)
      else
         call self%carried%forget()
      end if
      call self%carried%append_to(result)
   end subroutine run_point

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
         self%total(i) = self%total(i) + self%watch%count_of(result, i)
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

      call self%checkpoint%get(point, result, error)
      if (.not. allocated(error)) call self%watch%read_from(result, motion)
   end subroutine result_at

end module razy_study_motion_task
