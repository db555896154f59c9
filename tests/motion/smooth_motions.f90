!! Machines with smooth motions in closed form, and their motion by fixed steps of a stepper.
module smooth_motions
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use machine_samples, only: add_contact, add_tone, bare_machine, connect
   use razy_contact_contact_law, only: branch_t, contact_law_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_hybrid_system, only: system_t
   use razy_runge_kutta_methods_dense_output, only: path_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: controlled_steps, dense_errors, exact_motion, fixed_steps, make_ready, new_always_closed, order_between, &
             power_law_t, rate_inside, sample

   !> F = stiffness |s|^(3/2) sign s, always closed.
   type, extends(contact_law_t) :: power_law_t
      real(wp) :: factor = 0.0_wp
      !> Beyond this s the force is no number.
      real(wp) :: breaks_above = huge(1.0_wp)
   contains
      procedure :: initial_branch
      procedure :: force
      procedure :: slopes
      procedure :: smoothed
   end type power_law_t

   ! The oscillator: mass, kg, damping, N s/m, stiffness, N/m, force, N, its frequency, Hz, start, m and m/s.
   real(wp), parameter :: mass = 2.0_wp, damping = 8.0_wp, stiffness = 800.0_wp, force_0 = 30.0_wp, frequency = 2.0_wp
   real(wp), parameter :: x_0 = 0.1_wp, v_0 = -0.5_wp
   ! The chain between two walls: mass, stiffness, B = alpha K + beta M, forces on the masses 1 and 2 at two frequencies, Hz.
   real(wp), parameter :: chain_mass = 1.5_wp, chain_stiffness = 600.0_wp, alpha = 2.0e-3_wp, beta = 0.3_wp
   real(wp), parameter :: chain_force(2) = [5.0_wp, 7.0_wp], chain_frequency(2) = [1.5_wp, 3.7_wp]

contains

   !> A damped oscillator under a harmonic force.
   function oscillator() result(machine)
      type(machine_t) :: machine

      machine = bare_machine([mass])
      call connect(machine%stiffness, 1, 0, stiffness)
      call connect(machine%damping, 1, 0, damping)
      call add_tone(machine, real(frequency, qp), [cmplx(force_0, 0.0_wp, wp)])
      machine%displacement = [x_0]
      machine%velocity = [v_0]
   end function oscillator

   !> Displacement and velocity of the oscillator at time t.
   pure function oscillator_motion(t) result(motion)
      real(wp), intent(in) :: t
      real(wp) :: motion(2)

      motion = free_and_forced(t, damping/mass, stiffness/mass, [cmplx(force_0/mass, 0.0_wp, wp)], [2*pi*frequency], x_0, v_0)
   end function oscillator_motion

   !> Three masses between two walls under two harmonic forces, from rest.
   function chain() result(machine)
      type(machine_t) :: machine

      complex(wp), parameter :: none = (0.0_wp, 0.0_wp)
      integer :: i

      machine = bare_machine([chain_mass, chain_mass, chain_mass])
      call connect(machine%stiffness, 1, 0, chain_stiffness)
      call connect(machine%stiffness, 3, 0, chain_stiffness)
      do i = 1, 2
         call connect(machine%stiffness, i, i + 1, chain_stiffness)
      end do
      machine%damping = alpha*machine%stiffness + beta*machine%mass
      call add_tone(machine, real(chain_frequency(1), qp), [cmplx(chain_force(1), 0.0_wp, wp), none, none])
      call add_tone(machine, real(chain_frequency(2), qp), [none, cmplx(0.0_wp, chain_force(2), wp), none])
   end function chain

   !> Displacements and velocities of the chain at time t, by its modes sin(i j pi/4).
   pure function chain_motion(t) result(motion)
      real(wp), intent(in) :: t
      real(wp) :: motion(6)

      real(wp) :: mode(3), square, part(2)
      integer :: i, j

      motion = 0.0_wp
      do j = 1, 3
         mode = [(sin(i*j*pi/4), i=1, 3)]/sqrt(2*chain_mass)
         square = 4*chain_stiffness/chain_mass*sin(j*pi/8)**2
         part = free_and_forced(t, alpha*square + beta, square, &
                                [cmplx(mode(1)*chain_force(1), 0.0_wp, wp), cmplx(0.0_wp, mode(2)*chain_force(2), wp)], &
                                2*pi*chain_frequency, 0.0_wp, 0.0_wp)
         motion(:3) = motion(:3) + mode*part(1)
         motion(4:) = motion(4:) + mode*part(2)
      end do
   end function chain_motion

   !> x and x' of x'' + b x' + k x = Re Σ f e^{iωt}, underdamped, from x0 and v0.
   pure function free_and_forced(t, b, k, f, omega, x0, v0) result(motion)
      real(wp), intent(in) :: t, b, k, omega(:), x0, v0
      complex(wp), intent(in) :: f(:)
      real(wp) :: motion(2)

      complex(wp), parameter :: i = (0.0_wp, 1.0_wp)
      complex(wp) :: amplitude(size(f)), lambda, c
      real(wp) :: x, v

      amplitude = f/cmplx(k - omega**2, b*omega, wp)
      x = x0 - sum(real(amplitude, wp))
      v = v0 - sum(real(i*omega*amplitude, wp))
      lambda = cmplx(-b/2, sqrt(k - b**2/4), wp)
      ! Re c = x and Re(lambda c) = v.
      c = cmplx(x, (real(lambda)*x - v)/aimag(lambda), wp)
      motion(1) = real(c*exp(lambda*t), wp) + sum(real(amplitude*exp(i*omega*t), wp))
      motion(2) = real(lambda*c*exp(lambda*t), wp) + sum(real(i*omega*amplitude*exp(i*omega*t), wp))
   end function free_and_forced

   !> A machine by its name: "oscillator", "chain", or any other for the Hertz contact, whose motion has no closed form.
   function sample(name) result(machine)
      character(*), intent(in) :: name
      type(machine_t) :: machine

      select case (name)
      case ("oscillator")
         machine = oscillator()
      case ("chain")
         machine = chain()
      case default
         machine = pressed_ball()
      end select
   end function sample

   !> Its displacements and velocities at time t.
   pure function exact_motion(name, t) result(motion)
      character(*), intent(in) :: name
      real(wp), intent(in) :: t
      real(wp), allocatable :: motion(:)

      if (name == "oscillator") then
         motion = oscillator_motion(t)
      else
         motion = chain_motion(t)
      end if
   end function exact_motion

   !> A ball of 1 kg pressed onto a plane by 10 N and a harmonic force, which never lets it go.
   function pressed_ball() result(machine)
      type(machine_t) :: machine

      type(power_law_t) :: law

      call new_always_closed(law)
      machine = bare_machine([1.0_wp])
      call connect(machine%damping, 1, 0, 4.0_wp)
      machine%load = [10.0_wp]
      call add_tone(machine, 20.0_qp, [cmplx(3.0_wp, 0.0_wp, wp)])
      call add_contact(machine, [1.0_wp], law)
      machine%displacement = [(10.0_wp/law%factor)**(2.0_wp/3)]
      machine%velocity = [0.1_wp]
   end function pressed_ball

   !> A system, a right-hand side and a stepper ready at the state of the machine at time 0, all coordinates followed.
   subroutine make_ready(machine, name, relative, absolute, system, stepper, z)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: relative, absolute
      type(system_t), intent(out) :: system
      type(stepper_t), intent(out) :: stepper
      real(wp), allocatable, intent(out) :: z(:)

      type(method_t) :: method
      type(error_t), allocatable :: error
      integer :: j

      call system%take(machine, .true., .false., error)
      call stepper%rhs%dynamics%make_room(system, 0.0_wp)
      z = system%first_state()
      associate (dynamics => stepper%rhs%dynamics)
         call dynamics%excitation%begin(system%machine%tone, 0.0_wp, 0.0_wp)
         call dynamics%look_at_contacts(system, 0.0_wp, z)
         do j = 1, size(machine%contact)
            dynamics%mode%branch(j) = machine%contact(j)%law%initial_branch(dynamics%s(j), dynamics%rate(j))
         end do
      end associate
      call stepper%rhs%enter(system)
      method%integrator = name
      method%relative_tolerance = relative
      method%absolute_tolerance = absolute
      call stepper%prepare(method, size(z))
   end subroutine make_ready

   !> Displacements and velocities at `t_end` after equal steps of a method, whatever its error estimate says.
   subroutine fixed_steps(machine, name, t_end, steps, motion)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: t_end
      integer, intent(in) :: steps
      real(wp), intent(out) :: motion(:)

      type(system_t) :: system
      type(stepper_t) :: stepper
      real(wp), allocatable :: z(:)
      integer :: i
      logical :: accepted, failed

      call make_ready(machine, name, 1.0e-12_wp, 1.0e-15_wp, system, stepper, z)
      do i = 1, steps
         call stepper%rhs%dynamics%excitation%begin(system%machine%tone, (i - 1)*(t_end/steps), 0.0_wp)
         call stepper%attempt(system, z, t_end/steps, accepted, failed)
         z = stepper%z_end
         if (.not. accepted) call stepper%restart()
      end do
      call system%to_coordinates(z, motion(:system%m), motion(system%m + 1:))
   end subroutine fixed_steps

   !> dz/dt at theta of the step, by the dense output.
   function rate_inside(stepper, theta) result(dz)
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: theta
      real(wp) :: dz(size(stepper%z_end))

      type(path_t) :: path
      real(wp) :: unused
      integer :: i

      do i = 1, size(dz)
         call stepper%output%follow([1.0_wp], i - 1, path)
         call path%look(theta, unused, dz(i))
      end do
   end function rate_inside

   !> The same by controlled steps from a first one that the stepper chooses; `stepper` keeps the counters.
   subroutine controlled_steps(machine, name, relative, absolute, t_end, motion, stepper, ended)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: relative, absolute, t_end
      real(wp), intent(out) :: motion(:)
      type(stepper_t), intent(out) :: stepper
      logical, intent(out) :: ended

      type(system_t) :: system
      real(wp), allocatable :: z(:)
      real(wp) :: h, time
      logical :: accepted, failed

      call make_ready(machine, name, relative, absolute, system, stepper, z)
      call stepper%first_step(system, z, t_end, h)
      time = 0.0_wp
      do while (time < t_end .and. h > epsilon(1.0_wp)*t_end)
         call stepper%rhs%dynamics%excitation%begin(system%machine%tone, time, 0.0_wp)
         call stepper%attempt(system, z, h, accepted, failed)
         if (accepted) then
            z = stepper%z_end
            time = time + h
         end if
         h = min(stepper%h_next, t_end - time)
         if (t_end - time - h < 1.0e-9_wp*h) h = t_end - time
      end do
      ended = .not. time < t_end*(1.0_wp - 4*epsilon(1.0_wp))
      call system%to_coordinates(z, motion(:system%m), motion(system%m + 1:))
   end subroutine controlled_steps

   !> Largest errors of the dense output and of its time derivative within one step h that starts on the exact motion at time t.
   subroutine dense_errors(name, method, t, h, error, rate_error)
      character(*), intent(in) :: name, method
      real(wp), intent(in) :: t, h
      real(wp), intent(out) :: error, rate_error

      integer, parameter :: points = 16
      type(system_t) :: system
      type(stepper_t) :: stepper
      type(machine_t) :: machine
      real(wp), allocatable :: z(:), motion(:), x(:)
      integer :: i, m
      logical :: accepted, failed

      machine = sample(name)
      motion = exact_motion(name, t)
      m = size(motion)/2
      machine%displacement = motion(:m)
      machine%velocity = motion(m + 1:)
      call make_ready(machine, method, 1.0e20_wp, 1.0e20_wp, system, stepper, z)
      call stepper%rhs%dynamics%excitation%begin(system%machine%tone, t, 0.0_wp)
      call stepper%attempt(system, z, h, accepted, failed)
      call stepper%prepare_dense(system)
      allocate (x(2*m))
      error = 0.0_wp
      rate_error = 0.0_wp
      do i = 0, points
         motion = exact_motion(name, t + h*i/points)
         call stepper%output%at(real(i, wp)/points, z)
         call system%to_coordinates(z, x(:m), x(m + 1:))
         error = max(error, norm2(x - motion))
         z = rate_inside(stepper, real(i, wp)/points)
         call system%to_coordinates(z, x(:m), x(m + 1:))
         rate_error = max(rate_error, norm2(x(:m) - motion(m + 1:)))
      end do
   end subroutine dense_errors

   !> Order seen between errors at steps that differ by `ratio`.
   elemental function order_between(coarse, fine, ratio) result(order)
      real(wp), intent(in) :: coarse, fine, ratio
      real(wp) :: order

      order = log(coarse/fine)/log(ratio)
   end function order_between

   !> The law with the factor 1e5.
   subroutine new_always_closed(law)
      type(power_law_t), intent(out) :: law

      law%factor = 1.0e5_wp
      law%plain = 1
      law%branch = [branch_t(closed=.true.)]
   end subroutine new_always_closed

   pure function initial_branch(self, s, rate) result(branch)
      class(power_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      branch = 1
   end function initial_branch

   pure function force(self, branch, s, rate, normal) result(value)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: value

      value = sign(self%factor*abs(s)**1.5_wp, s)
      if (s > self%breaks_above) value = ieee_value(value, ieee_quiet_nan)
   end function force

   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      stiffness = 1.5_wp*self%factor*sqrt(abs(s))
      damping = 0.0_wp
   end subroutine slopes

   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(power_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      force = self%force(1, s, rate, normal)
      call self%slopes(1, s, rate, normal, stiffness, damping)
   end subroutine smoothed

end module smooth_motions
