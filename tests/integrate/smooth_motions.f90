!! Machines with smooth motions in closed form, and their motion by fixed steps of a stepper.
module smooth_motions
   use machine_samples, only: add_contact, add_tone, bare_machine, connect, observe
   use razy_contact_contact_law, only: contact_law_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_integrate_field, only: field_t
   use razy_integrate_stepper, only: stepper_t
   use razy_machine_machine, only: machine_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: chain, chain_motion, fixed_steps, oscillator, oscillator_motion, power_law_t, slope_between

   !> F = stiffness |s|^(3/2) sign s, always closed.
   type, extends(contact_law_t) :: power_law_t
      real(wp) :: stiffness_of_power = 0.0_wp
      !> From this time of s on the force is no number.
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

   !> Displacements and velocities at `t_end` after `steps` equal steps of a method, whatever its error estimate says.
   subroutine fixed_steps(machine, name, t_end, steps, motion, dense_error, exact)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: t_end
      integer, intent(in) :: steps
      real(wp), intent(out) :: motion(:)
      !> Largest error of the dense output within single steps that start on the exact motion.
      real(wp), intent(out), optional :: dense_error
      interface
         pure function exact(t) result(motion)
            import :: wp
            implicit none(type, external)
            real(wp), intent(in) :: t
            real(wp) :: motion(6)
         end function exact
      end interface
      optional :: exact

      type(field_t) :: field
      type(stepper_t) :: stepper
      type(method_t) :: method
      type(error_t), allocatable :: error
      real(wp), allocatable :: z(:)
      real(wp) :: h
      integer :: i
      logical :: accepted, failed

      call field%attach(machine, .true., error)
      allocate (z(2*field%m))
      call field%first_state(z)
      method%integrator = name
      method%step = t_end/steps
      method%relative_tolerance = 1.0e30_wp
      call stepper%prepare(method, size(z))
      h = t_end/steps
      do i = 1, steps
         call stepper%attempt(field, (i - 1)*h, z, h, accepted, failed)
         z = stepper%z_end
      end do
      call field%to_coordinates(z, motion(:field%m), motion(field%m + 1:))
   end subroutine fixed_steps

   !> Order seen between errors at steps that differ by `ratio`.
   elemental function slope_between(coarse, fine, ratio) result(order)
      real(wp), intent(in) :: coarse, fine, ratio
      real(wp) :: order

      order = log(coarse/fine)/log(ratio)
   end function slope_between

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

      value = sign(self%stiffness_of_power*abs(s)**1.5_wp, s)
   end function force

   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      stiffness = 1.5_wp*self%stiffness_of_power*sqrt(abs(s))
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
