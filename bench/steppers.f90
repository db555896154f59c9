!! Cost of the bare Runge-Kutta steppers, without events: processor time of a right-hand side and of a step, and work against error
!! on a smooth motion, for chains of m masses.
!!
!! Usage: steppers cost M REPEATS, one line `method m seconds_per_right_hand_side seconds_per_step` for each method; or
!! steppers precision M, lines `method tolerance error seconds right_hand_sides steps rejected`. The reference is DOP853 at the
!! tightest tolerance, whose difference from Radau IIA comes first, as `# reference`.
program steppers
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, qp, wp
   use razy_core_tone, only: tone_from_hertz
   use razy_hybrid_system, only: system_t
   use razy_machine_machine, only: machine_t, plain_machine
   use razy_motion_method, only: method_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)

   character(*), parameter :: methods(*) = [character(16) :: "rk4", "bogacki_shampine", "dormand_prince", "dop853", "radau5"]
   character(32) :: mode, text
   integer :: m, repeats

   call get_command_argument(1, mode)
   call get_command_argument(2, text)
   read (text, *) m
   if (mode == "cost") then
      call get_command_argument(3, text)
      read (text, *) repeats
      call measure_cost(chain(m), repeats)
   else
      call measure_precision(chain(m))
   end if

contains

   !> m masses of 1 kg between two walls, natural frequencies up to 10 Hz, lightly damped, under two tones.
   function chain(m) result(machine)
      integer, intent(in) :: m
      type(machine_t) :: machine

      real(wp), parameter :: stiffness = 1000.0_wp
      real(wp) :: k(m, m), unit(m, m)
      integer :: i

      unit = 0.0_wp
      k = 0.0_wp
      do i = 1, m
         unit(i, i) = 1.0_wp
         k(i, i) = 2*stiffness
         if (i > 1) k(i - 1, i) = -stiffness
         if (i < m) k(i + 1, i) = -stiffness
      end do
      machine = plain_machine(unit, 1.0e-4_wp*k, k)
      machine%tone = [tone_from_hertz(3.0_qp), tone_from_hertz(4.5_qp)]
      machine%harmonic_load = reshape([((0.0_wp, 0.0_wp), i=1, 2*m)], [m, 2])
      machine%harmonic_load(1, 1) = (10.0_wp, 0.0_wp)
      machine%harmonic_load(m, 2) = (0.0_wp, 10.0_wp)
      machine%displacement = [(1.0e-2_wp*i/m, i=1, m)]
   end function chain

   subroutine make_ready(machine, name, tolerance, system, stepper, z)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: tolerance
      type(system_t), intent(out) :: system
      type(stepper_t), intent(out) :: stepper
      real(wp), allocatable, intent(out) :: z(:)

      type(error_t), allocatable :: error
      type(method_t) :: method

      call system%take(machine, .true., error)
      if (allocated(error)) error stop error%message
      z = system%first_state()
      call stepper%rhs%dynamics%make_room(system, 0.0_wp)
      call stepper%rhs%dynamics%excitation%begin(system%machine%tone, 0.0_wp, 0.0_wp)
      call stepper%rhs%enter(system)
      method%integrator = name
      method%relative_tolerance = tolerance
      method%absolute_tolerance = 1.0e-2_wp*tolerance
      call stepper%prepare(method, size(z))
   end subroutine make_ready

   subroutine measure_cost(machine, repeats)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: repeats

      type(system_t) :: system
      type(stepper_t) :: stepper
      real(wp), allocatable :: z(:), dz(:)
      real(wp) :: begun, ended, right_hand_side
      integer :: i, k
      logical :: accepted, failed

      do k = 1, size(methods)
         call make_ready(machine, methods(k), 1.0_wp, system, stepper, z)
         allocate (dz, mold=z)
         call cpu_time(begun)
         do i = 1, repeats
            call stepper%rhs%derivative(system, 1.0e-6_wp*i, z, dz)
         end do
         call cpu_time(ended)
         right_hand_side = (ended - begun)/repeats
         call cpu_time(begun)
         do i = 1, repeats/10
            call stepper%rhs%dynamics%excitation%begin(system%machine%tone, 1.0e-4_wp*(i - 1), 0.0_wp)
            call stepper%attempt(system, z, 1.0e-4_wp, accepted, failed)
            z = stepper%z_end
         end do
         call cpu_time(ended)
         write (output_unit, "(a, i6, 2es12.3)") methods(k), system%m, right_hand_side, (ended - begun)/(repeats/10)
         deallocate (dz)
      end do
   end subroutine measure_cost

   subroutine measure_precision(machine)
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: motion(:), reference(:)
      real(wp) :: seconds, tolerance
      integer(i8) :: counts(3)
      integer :: i, k

      call follow(machine, "dop853", 3.0e-14_wp, 0.0_wp, reference, seconds, counts)
      call follow(machine, "radau5", 1.0e-13_wp, 0.0_wp, motion, seconds, counts)
      write (output_unit, "(a, es10.2)") "# reference", norm2(motion - reference)/norm2(reference)
      do k = 1, size(methods)
         do i = 3, 12
            tolerance = 10.0_wp**(-i)
            call follow(machine, methods(k), tolerance, 0.05_wp*tolerance**0.25_wp, motion, seconds, counts)
            write (output_unit, "(a, 3es10.2, 3i9)") methods(k), tolerance, norm2(motion - reference)/norm2(reference), &
               seconds, counts
         end do
      end do
   end subroutine measure_precision

   !> z after 2 s; `h` is the step of a method without control. Counts: right-hand sides, steps, rejected steps.
   subroutine follow(machine, name, tolerance, h, z, seconds, counts)
      type(machine_t), intent(in) :: machine
      character(*), intent(in) :: name
      real(wp), intent(in) :: tolerance, h
      real(wp), allocatable, intent(out) :: z(:)
      real(wp), intent(out) :: seconds
      integer(i8), intent(out) :: counts(3)

      real(wp), parameter :: t_end = 2.0_wp
      type(system_t) :: system
      type(stepper_t) :: stepper
      real(wp) :: begun, ended, step, tau
      logical :: accepted, failed

      call make_ready(machine, name, tolerance, system, stepper, z)
      call cpu_time(begun)
      if (stepper%adaptive) then
         call stepper%first_step(system, z, t_end, step)
      else
         step = t_end/ceiling(t_end/h)
      end if
      tau = 0.0_wp
      do while (tau < t_end)
         call stepper%rhs%dynamics%excitation%begin(system%machine%tone, tau, 0.0_wp)
         call stepper%attempt(system, z, step, accepted, failed)
         if (accepted) then
            z = stepper%z_end
            tau = tau + step
         end if
         if (stepper%adaptive) step = stepper%h_next
         if (t_end - tau < 1.000001_wp*step) step = t_end - tau
         if (failed .or. step < epsilon(tau)) exit
      end do
      call cpu_time(ended)
      seconds = ended - begun
      counts = [stepper%rhs%evaluations, stepper%accepted_steps, stepper%rejected_steps]
   end subroutine follow

end program steppers
