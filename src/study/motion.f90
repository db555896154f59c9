!! One motion: this machine, by this method, seen by these observers.
module razy_study_motion
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_exact_exact, only: exact_t
   use razy_hybrid_flow, only: flow_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: add_observer, ask_stop, observer_slot_t, outcome_t
   use razy_moreau_moreau, only: moreau_t
   use razy_observe_balance, only: balance_t
   use razy_runge_kutta_runge_kutta, only: new_runge_kutta, runge_kutta_t
   use razy_motion_method, only: check_method, integrators, method_t
   implicit none(type, external)
   private

   public :: new_integrator, run_motion

contains

   !> Run a machine from 0 to `t_end`, s, by a method and show the motion to the observers; how it ended is in `outcome`.
   !>
   !> `keep_all` follows every coordinate, which observers of the whole state and `integrator%final_state` need. An `integrator`
   !> of the same method is taken up with what it knows of the machine before; that changes no bit of a motion. `stop_is_asked` is
   !> looked at now and then, and ends the motion as interrupted.
   !> Errors: a method that the machine's laws do not allow, a machine that the integrator refuses.
   subroutine run_motion(machine, method, t_end, observers, outcome, error, most_events, keep_all, integrator, stop_is_asked)
      type(machine_t), intent(in) :: machine
      type(method_t), intent(in) :: method
      real(wp), intent(in) :: t_end
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome
      type(error_t), allocatable, intent(out) :: error
      integer(i8), intent(in) :: most_events
      logical, intent(in) :: keep_all
      class(flow_t), allocatable, intent(inout), target :: integrator
      procedure(ask_stop), pointer, intent(in), optional :: stop_is_asked

      type(method_t) :: checked
      type(balance_t), target :: balance
      type(observer_slot_t), allocatable :: slots(:)
      character(:), allocatable :: allowed, key
      integer :: i

      checked = method
      call check_method(checked, machine, key, allowed)
      if (len(key) > 0) call raise(error, key//": "//allowed)
      if (.not. allocated(error)) call new_integrator(integrator, checked, error)
      if (allocated(error)) return
      select type (integrator)
      type is (exact_t)
         integrator%apart = .true.
         integrator%may_give_up = method%automatic
      end select
      integrator%budget%stop_is_asked => null()
      if (present(stop_is_asked)) integrator%budget%stop_is_asked => stop_is_asked
      call integrator%prepare(machine, keep_all, error)
      if (allocated(error)) return
      slots = observers
      call add_observer(slots, balance)
      do i = 1, size(slots)
         call slots(i)%observer%attach(machine, t_end)
      end do
      call integrator%run(t_end, most_events, slots, outcome)
      outcome%residual = max(outcome%residual, balance%residual(integrator%transition%energy, integrator%transition%most))
      outcome%unbalanced = merge(1, 0, outcome%residual > checked%worst_balance())
      select type (integrator)
      type is (exact_t)
         integrator%may_give_up = .false.
      end select
      outcome%integrator = findloc(integrators, checked%integrator, dim=1)
   end subroutine run_motion

   !> Make the integrator of a method that razy_motion_method has checked; one of the same kind is kept with what it knows.
   subroutine new_integrator(integrator, method, error)
      class(flow_t), allocatable, intent(inout) :: integrator
      type(method_t), intent(in) :: method
      type(error_t), allocatable, intent(out) :: error

      class(flow_t), allocatable :: fresh
      type(exact_t), allocatable :: exact
      type(runge_kutta_t), allocatable :: runge_kutta
      type(moreau_t), allocatable :: moreau

      select case (method%integrator)
      case ("exact")
         if (.not. same_type_as(integrator, exact)) allocate (exact_t :: fresh)
      case ("rk4", "bogacki_shampine", "dormand_prince", "dop853", "radau5")
         if (.not. same_type_as(integrator, runge_kutta)) allocate (runge_kutta_t :: fresh)
      case ("moreau_jean")
         if (.not. same_type_as(integrator, moreau)) allocate (moreau_t :: fresh)
      case default
         call raise(error, "there is no integrator '"//trim(method%integrator)//"'")
         return
      end select
      if (allocated(fresh)) call move_alloc(fresh, integrator)
      select type (integrator)
      type is (exact_t)
         integrator%memory_mb = method%memory_mb
      type is (runge_kutta_t)
         call new_runge_kutta(integrator, method)
      type is (moreau_t)
         integrator%step = method%step
      end select
      integrator%budget%most_steps = method%most_steps
      integrator%budget%most_seconds = method%most_seconds
   end subroutine new_integrator

end module razy_study_motion
