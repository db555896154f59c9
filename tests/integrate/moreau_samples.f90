!! Machines with rigid contacts and friction for the tests of time stepping, and one call that runs them.
module moreau_samples
   use machine_samples, only: add_contact, bare_machine, observe, stop_law
   use razy_contact_contact_law, only: branch_backward, branch_forward, branch_lower, branch_open, branch_sticking, branch_upper, &
                                       contact_law_t, guard_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_integrate_integrator, only: observer_slot_t, observer_t, outcome_t
   use razy_integrate_moreau, only: moreau_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: add_friction, add_rigid, bouncing_ball, energy, step_through

   !> Stand-ins for rigid and friction laws.
   type, extends(contact_law_t) :: rigid_sample_t
   contains
      procedure :: initial_branch => rigid_branch
      procedure :: force => no_force
      procedure :: slopes => no_slopes
      procedure :: smoothed => no_smoothed
   end type rigid_sample_t

   type, extends(contact_law_t) :: friction_sample_t
      real(wp) :: kinetic = 0.0_wp, static = 0.0_wp, decay = 0.0_wp
   contains
      procedure :: initial_branch => friction_branch
      procedure :: force => friction_force
      procedure :: slopes => friction_slopes
      procedure :: smoothed => friction_smoothed
   end type friction_sample_t

contains

   pure function rigid_branch(self, s, rate) result(branch)
      class(rigid_sample_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      branch = branch_open
      associate (open => self%guard(1, branch_open))
         if (open%above /= 0 .and. s >= open%upper .and. rate >= 0.0_wp) branch = branch_upper
         if (open%below /= 0 .and. s <= open%lower .and. rate <= 0.0_wp) branch = branch_lower
      end associate
   end function rigid_branch

   pure function no_force(self, branch, s, rate, normal) result(force)
      class(rigid_sample_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      force = 0.0_wp
   end function no_force

   pure subroutine no_slopes(self, branch, s, rate, normal, stiffness, damping)
      class(rigid_sample_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      stiffness = 0.0_wp
      damping = 0.0_wp
   end subroutine no_slopes

   pure subroutine no_smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(rigid_sample_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      force = 0.0_wp
      stiffness = 0.0_wp
      damping = 0.0_wp
   end subroutine no_smoothed

   pure function friction_branch(self, s, rate) result(branch)
      class(friction_sample_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      branch = branch_sticking
      if (rate > 0.0_wp) branch = branch_forward
      if (rate < 0.0_wp) branch = branch_backward
   end function friction_branch

   pure function friction_force(self, branch, s, rate, normal) result(force)
      class(friction_sample_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      force = normal*(self%kinetic + (self%static - self%kinetic)/(1 + self%decay*abs(rate)))
      if (branch == branch_backward) force = -force
   end function friction_force

   pure subroutine friction_slopes(self, branch, s, rate, normal, stiffness, damping)
      class(friction_sample_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      stiffness = 0.0_wp
      damping = 0.0_wp
   end subroutine friction_slopes

   pure subroutine friction_smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(friction_sample_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      force = 0.0_wp
      stiffness = 0.0_wp
      damping = 0.0_wp
   end subroutine friction_smoothed

   !> A rigid stop for wᵀq on one side of `edge`: `side` is upper or lower.
   subroutine add_rigid(machine, w, side, edge, restitution, error)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: w(:), edge, restitution
      character(*), intent(in) :: side
      complex(wp), intent(in), optional :: error(:)

      type(rigid_sample_t) :: law

      law%impacts = .true.
      law%restitution = restitution
      law%constraint([branch_upper, branch_lower]) = .true.
      if (side == "upper") law%guard(1, branch_open) = guard_t(upper=edge, above=branch_upper)
      if (side == "lower") law%guard(1, branch_open) = guard_t(lower=edge, below=branch_lower)
      call add_contact(machine, w, stop_law("upper", 1.0_wp, 1.0_wp), error=error)
      deallocate (machine%contact(size(machine%contact))%law)
      allocate (machine%contact(size(machine%contact))%law, source=law)
   end subroutine add_rigid

   !> Friction against wᵀq' + drive, pressed by a given normal force and, if not 0, by contact `normal_of`.
   subroutine add_friction(machine, w, static, kinetic, decay, normal, normal_of, drive)
      type(machine_t), intent(inout) :: machine
      real(wp), intent(in) :: w(:), static, kinetic, decay, normal
      integer, intent(in) :: normal_of
      real(wp), intent(in), optional :: drive

      type(friction_sample_t) :: law

      law%constraint(branch_sticking) = .true.
      law%force_guard(branch_sticking) = guard_t(-static, static, branch_backward, branch_forward)
      law%static = static
      law%kinetic = kinetic
      law%decay = decay
      call add_contact(machine, w, stop_law("upper", 1.0_wp, 1.0_wp))
      associate (contact => machine%contact(size(machine%contact)))
         deallocate (contact%law)
         allocate (contact%law, source=law)
         contact%normal = normal
         contact%normal_of = normal_of
         if (present(drive)) contact%drive = drive
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
   subroutine step_through(machine, h, t_end, outcome, q, v, first, second, theta, most_steps, most_events)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: h, t_end
      type(outcome_t), intent(out) :: outcome
      real(wp), allocatable, intent(out), optional :: q(:), v(:)
      class(observer_t), intent(inout), target, optional :: first, second
      real(wp), intent(in), optional :: theta
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
      if (present(theta)) scheme%theta = theta
      if (present(most_steps)) scheme%most_steps = most_steps
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

end module moreau_samples
