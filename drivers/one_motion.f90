!! One motion with its observers, and what they saw as the content of a result file.
module one_motion
   use, intrinsic :: iso_fortran_env, only: int32, int8
   use razy_contact_contact_law, only: branch_meanings
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_observe_contact_statistics, only: contact_statistics_t
   use razy_observe_contact_tally, only: quantities, quantity_meaning, quantity_name, quantity_unit
   use razy_observe_event_log, only: event_log_t
   use razy_observe_extrema, only: extrema_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_study_integrators, only: new_integrator
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, status_meanings, status_ok
   use razy_io_run_file, only: run_content_t
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_machine, only: machine_t
   use razy_scenes_records, only: contacts_asked, record_t
   use razy_scenes_case, only: motion_t
   implicit none(type, external)
   private

   public :: compute

contains

   !> Compute the motion. `problem` says where and why it ended early; what was computed until then is in `content`.
   subroutine compute(machine, motion, records, content, problem, error)
      type(machine_t), intent(in) :: machine
      type(motion_t), intent(in) :: motion
      type(record_t), intent(in) :: records(:)
      type(run_content_t), intent(out) :: content
      character(:), allocatable, intent(out) :: problem
      type(error_t), allocatable, intent(out) :: error

      class(integrator_t), allocatable, target :: integrator
      type(extrema_t), allocatable, target :: extrema(:)
      type(trajectory_t), target :: trajectory
      type(event_log_t), target :: log
      type(contact_statistics_t), target :: statistics
      type(observer_slot_t), allocatable :: slots(:)
      type(outcome_t) :: outcome
      logical :: whole_state
      integer :: i, k

      whole_state = any(records%trajectory .and. records%observable == 0)
      call new_integrator(integrator, motion%method, error)
      if (allocated(error)) return
      call integrator%prepare(machine, whole_state, error)
      if (allocated(error)) return
      k = count(records%extrema)
      allocate (extrema(k), slots(k + 1 + count([any(records%statistics), any(records%trajectory)])))
      slots(1)%observer => log
      k = 0
      do i = 1, size(records)
         if (.not. records(i)%extrema) cycle
         k = k + 1
         extrema(k)%form = records(i)%observable
         extrema(k)%from = records(i)%from
         call extrema(k)%reset()
         slots(1 + k)%observer => extrema(k)
      end do
      if (any(records%statistics)) then
         statistics%from = records(findloc(records%statistics, .true., dim=1))%from
         call statistics%attach(machine, contacts_asked(records, size(machine%contact)))
         slots(k + 2)%observer => statistics
      end if
      if (any(records%trajectory)) then
         call plan_trajectory(trajectory, records, merge(size(machine%mass, 1), 0, whole_state))
         slots(size(slots))%observer => trajectory
      end if
      call integrator%run(motion%t_end, motion%most_events, slots, outcome)
      if (outcome%status /= status_ok) problem = "the motion ended at "//to_text(outcome%time)//" s: " &
                                                 //trim(status_meanings(outcome%status))
      call store_outcome(content, outcome)
      call store_events(content, log, machine)
      call store_extrema(content, extrema, machine)
      if (any(records%statistics)) call store_statistics(content, statistics, period_of_loads(machine))
      if (any(records%trajectory)) call store_trajectory(content, trajectory, machine, whole_state)
   end subroutine compute

   subroutine plan_trajectory(trajectory, records, coordinates)
      type(trajectory_t), intent(inout) :: trajectory
      type(record_t), intent(in) :: records(:)
      integer, intent(in) :: coordinates

      integer :: first

      trajectory%form = pack(records%observable, records%trajectory .and. records%observable > 0)
      first = findloc(records%trajectory, .true., dim=1)
      trajectory%from = records(first)%from
      trajectory%interval = records(first)%interval
      trajectory%coordinates = coordinates
      call trajectory%reset()
   end subroutine plan_trajectory

   subroutine store_outcome(content, outcome)
      type(run_content_t), intent(inout) :: content
      type(outcome_t), intent(in) :: outcome

      allocate (content%outcome)
      content%outcome%status = int(outcome%status, int32)
      content%outcome%status_meanings = [character(48) :: status_meanings]
      content%outcome%time = outcome%time
      content%outcome%events = outcome%events
      content%outcome%steps = outcome%steps
      content%outcome%rejected = outcome%rejected
      content%outcome%evaluations = outcome%evaluations
      content%outcome%jacobians = outcome%jacobians
      content%outcome%factorisations = outcome%factorisations
      content%outcome%impacts = outcome%impacts
      content%outcome%accumulations = outcome%accumulations
      content%outcome%doubts = outcome%doubts
      content%outcome%doubt_time = outcome%doubt_time
   end subroutine store_outcome

   subroutine store_events(content, log, machine)
      type(run_content_t), intent(inout) :: content
      type(event_log_t), intent(inout) :: log
      type(machine_t), intent(in) :: machine

      integer :: j

      if (size(machine%contact) == 0) return
      call log%finish()
      content%event_time = log%time
      content%event_contact = int(log%contact, int32)
      content%event_state = int(log%branch, int32)
      allocate (character(64) :: content%contact_names(size(machine%contact)))
      do j = 1, size(machine%contact)
         content%contact_names(j) = machine%contact(j)%name
      end do
      content%event_meanings = branch_meanings
   end subroutine store_events

   subroutine store_extrema(content, extrema, machine)
      type(run_content_t), intent(inout) :: content
      type(extrema_t), intent(in) :: extrema(:)
      type(machine_t), intent(in) :: machine

      integer :: i

      allocate (content%extrema(size(extrema)))
      do i = 1, size(extrema)
         associate (observable => machine%observable(extrema(i)%form), stored => content%extrema(i))
            stored%name = observable%name
            stored%units = observable%unit
            stored%long_name = observable%long_name
            stored%value = extrema(i)%value(:extrema(i)%count)
            stored%time = extrema(i)%time(:extrema(i)%count)
            stored%kind = int(extrema(i)%kind(:extrema(i)%count), int8)
         end associate
      end do
   end subroutine store_extrema

   subroutine store_statistics(content, statistics, period)
      type(run_content_t), intent(inout) :: content
      type(contact_statistics_t), intent(in) :: statistics
      real(wp), intent(in) :: period

      real(wp) :: values(quantities)
      integer :: i, k

      allocate (content%contact_values(quantities*size(statistics%tally)))
      do i = 1, size(statistics%tally)
         values = statistics%tally(i)%values(statistics%time, period)
         do k = 1, quantities
            associate (stored => content%contact_values((i - 1)*quantities + k), contact => statistics%tally(i)%contact)
               stored%path = "/contact/"//contact%name//"/"//trim(quantity_name(k))
               stored%units = quantity_unit(contact, k)
               stored%long_name = contact%name//": "//trim(quantity_meaning(k))
               stored%value = values(k)
            end associate
         end do
      end do
   end subroutine store_statistics

   subroutine store_trajectory(content, trajectory, machine, whole_state)
      type(run_content_t), intent(inout) :: content
      type(trajectory_t), intent(inout) :: trajectory
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: whole_state

      integer :: i

      call trajectory%finish()
      content%time = trajectory%time
      allocate (content%observables(size(trajectory%form)))
      do i = 1, size(trajectory%form)
         associate (observable => machine%observable(trajectory%form(i)))
            content%observables(i)%name = observable%name
            content%observables(i)%units = observable%unit
            content%observables(i)%long_name = observable%long_name
            content%observables(i)%values = trajectory%value(i, :)
         end associate
      end do
      if (.not. whole_state) return
      content%coordinate_names = machine%coordinate
      content%coordinate_units = machine%unit
      call move_alloc(trajectory%displacement, content%displacement)
      call move_alloc(trajectory%velocity, content%velocity)
   end subroutine store_trajectory

end module one_motion
