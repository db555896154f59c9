!! Machines with rigid contacts and friction for the tests of time stepping, and one call that runs them.
module moreau_samples
   use machine_samples, only: add_contact, bare_machine, observe, stop_law
   use razy_contact_friction_law, only: new_friction_law
   use razy_contact_rigid_law, only: new_rigid_law, rigid_side_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_motion_integrator, only: observer_slot_t, observer_t, outcome_t
   use razy_moreau_moreau, only: moreau_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: add_friction, add_rigid, bouncing_ball, energy, slope_of, step_through

contains

   !> A rigid stop for wᵀq on one side of `edge`: `side` is upper or lower.
   subroutine add_rigid(machine, w, side, edge, restitution, error)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: w(:), edge, restitution
      character(*), intent(in) :: side
      complex(wp), intent(in), optional :: error(:)

      call add_contact(machine, w, stop_law("upper", 1.0_wp, 1.0_wp), error=error)
      deallocate (machine%contact(size(machine%contact))%law)
      allocate (machine%contact(size(machine%contact))%law, source=new_rigid_law(rigid_side_t(side /= "upper", edge), &
                                                                                 rigid_side_t(side /= "lower", edge), restitution))
   end subroutine add_rigid

   !> Friction against wᵀq' + drive, pressed by a given normal force (while `only_with` is closed) and, if not
   !> 0, by contact `normal_of`.
   subroutine add_friction(machine, w, static, kinetic, decay, normal, normal_of, drive, only_with)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: w(:), static, kinetic, decay, normal
      integer, intent(in) :: normal_of
      real(wp), intent(in), optional :: drive
      integer, intent(in), optional :: only_with

      call add_contact(machine, w, stop_law("upper", 1.0_wp, 1.0_wp))
      associate (contact => machine%contact(size(machine%contact)))
         deallocate (contact%law)
         allocate (contact%law, source=new_friction_law(static, kinetic, decay))
         contact%normal = normal
         contact%normal_of = normal_of
         if (present(drive)) contact%drive = drive
         if (present(only_with)) contact%only_with = only_with
      end associate
   end subroutine add_friction

   !> A ball of 2 kg at the height 1 above a rigid table, g = 10; height and velocity observed.
   function bouncing_ball(restitution) result(machine)
      real(wp), intent(in) :: restitution
      type(machine_t) :: machine

      machine = bare_machine([2.0_wp])
      machine%load = -20.0_wp
      machine%displacement = 1.0_wp
      call add_rigid(machine, [1.0_wp], "lower", 0.0_wp, restitution)
      call observe(machine, [1.0_wp], [0.0_wp])
      call observe(machine, [0.0_wp], [1.0_wp])
   end function bouncing_ball

   !> Kinetic energy, energy of the springs, and that of the constant loads.
   function energy(machine, q, v)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: q(:), v(:)
      real(wp) :: energy

      energy = 0.5_wp*dot_product(v, matmul(machine%mass, v)) + 0.5_wp*dot_product(q, matmul(machine%stiffness, q)) &
               - dot_product(machine%load, q)
   end function energy

   !> Run a machine by steps of h and give the state that it ends with.
   subroutine step_through(machine, h, t_end, outcome, q, v, first, second, most_steps, most_events)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: h, t_end
      type(outcome_t), intent(out) :: outcome
      real(wp), allocatable, intent(out), optional :: q(:), v(:)
      class(observer_t), intent(inout), target, optional :: first, second
      integer(i8), intent(in), optional :: most_steps, most_events

      type(moreau_t) :: scheme
      type(error_t), allocatable :: error
      type(observer_slot_t) :: slots(2)
      real(wp), allocatable :: q_end(:), v_end(:)
      integer(i8) :: most
      integer :: observers

      observers = 0
      if (present(first)) call enter(first)
      if (present(second)) call enter(second)
      scheme%step = h
      if (present(most_steps)) scheme%budget%most_steps = most_steps
      most = huge(1_i8)
      if (present(most_events)) most = most_events
      call scheme%prepare(machine, .true., error)
      if (allocated(error)) error stop "step_through: refused"
      call scheme%run(t_end, most, slots(:observers), outcome)
      allocate (q_end(size(machine%load)), v_end(size(machine%load)))
      call scheme%final_state(q_end, v_end)
      if (present(q)) q = q_end
      if (present(v)) v = v_end

   contains

      subroutine enter(observer)
         class(observer_t), intent(inout), target :: observer

         observers = observers + 1
         slots(observers)%observer => observer
      end subroutine enter

   end subroutine step_through

   !> Least-squares slope of log(error) over log(step).
   pure function slope_of(steps, errors) result(slope)
      real(wp), intent(in) :: steps(:), errors(:)
      real(wp) :: slope

      real(wp) :: x(size(steps)), y(size(steps))

      x = log(steps) - sum(log(steps))/size(steps)
      y = log(errors) - sum(log(errors))/size(steps)
      slope = dot_product(x, y)/dot_product(x, x)
   end function slope_of

end module moreau_samples
