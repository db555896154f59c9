!! One call that runs a machine by any method, for tests.
module movers
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_flow, only: flow_t
   use razy_study_motion, only: run_motion
   use razy_motion_integrator, only: observer_slot_t, observer_t, outcome_t
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   use watchers, only: event_log_t, sampler_t
   implicit none(type, external)
   private

   public :: follow, tight

contains

   !> A method of step control with tolerances near rounding.
   function tight(integrator, relative, absolute) result(method)
      character(*), intent(in) :: integrator
      real(wp), intent(in), optional :: relative, absolute
      type(method_t) :: method

      method%integrator = integrator
      method%relative_tolerance = 1.0e-13_wp
      method%absolute_tolerance = 1.0e-15_wp
      if (present(relative)) method%relative_tolerance = relative
      if (present(absolute)) method%absolute_tolerance = absolute
   end function tight

   !> Run a machine from 0 to `t_end`, s, by a method; `x` and `v` are the state at the end.
   subroutine follow(machine, method, t_end, outcome, x, v, first, second, most_events)
      type(machine_t), intent(in) :: machine
      type(method_t), intent(in) :: method
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(out) :: outcome
      real(wp), intent(out), optional :: x(:), v(:)
      class(observer_t), intent(inout), target, optional :: first, second
      integer(i8), intent(in), optional :: most_events

      class(flow_t), allocatable :: integrator
      type(error_t), allocatable :: error
      type(observer_slot_t) :: slot(2)
      real(wp) :: displacement(size(machine%load)), velocity(size(machine%load))
      integer(i8) :: limit
      integer :: n

      n = 0
      if (present(first)) n = 1
      if (present(first)) slot(1)%observer => first
      if (present(second)) n = 2
      if (present(second)) slot(2)%observer => second
      call tell(slot(:n), machine)
      limit = 1000000_i8
      if (present(most_events)) limit = most_events
      call run_motion(machine, method, t_end, slot(:n), outcome, error, limit, .true., integrator)
      if (allocated(error)) error stop "the method or the machine was refused"
      call integrator%final_state(displacement, velocity)
      if (present(x)) x = displacement
      if (present(v)) v = velocity
   end subroutine follow

   !> Tell observers the size of the machine.
   subroutine tell(slot, machine)
      type(observer_slot_t), intent(in) :: slot(:)
      type(machine_t), intent(in) :: machine

      integer :: i

      do i = 1, size(slot)
         select type (watcher => slot(i)%observer)
         type is (event_log_t)
            watcher%contacts = size(machine%contact)
         type is (sampler_t)
            watcher%forms = size(machine%observable)
         end select
      end do
   end subroutine tell

end module movers
