!! Two machines whose contact forces are not piecewise linear, by DOP853 with events, in the form of the peers of the bench: the gear
!! pair of peers/gear_pair.h with Hertz flanks, the oscillator of peers/hunt_crossley.h.
!!
!! Usage: smooth hertz|hunt_crossley RTOL SPEED OUTPUT. OUTPUT gets lines `d time value`, 2001 of them, and `# key value` (`cpu`, s;
!! `events`; `rhs`). The absolute tolerance is RTOL times 1e-3, the size of the displacements.
program smooth
   use razy_contact_power_law, only: new_power_law, power_side_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_tone, only: tone_from_hertz
   use razy_machine_machine, only: add_contact, add_observable, machine_t, plain_machine
   use razy_motion_integrator, only: observer_slot_t, outcome_t
   use razy_motion_method, only: method_t
   use razy_observe_trajectory, only: trajectory_t
   use razy_study_motion, only: run_motion
   implicit none(type, external)

   integer, parameter :: points = 2001
   type(machine_t) :: machine
   type(method_t) :: method
   type(outcome_t) :: outcome
   type(trajectory_t), target :: trajectory
   type(observer_slot_t) :: observers(1)
   type(error_t), allocatable :: error
   character(256) :: word
   real(wp) :: begun, ended, speed, t_end
   integer :: i, unit

   method%integrator = "dop853"
   call get_command_argument(2, word)
   read (word, *) method%relative_tolerance
   method%absolute_tolerance = 1.0e-3_wp*method%relative_tolerance
   call get_command_argument(3, word)
   read (word, *) speed
   call get_command_argument(1, word)
   if (word == "hertz") then
      call make_gear_pair()
   else
      call make_oscillator()
   end if
   trajectory%form = [1]
   trajectory%interval = t_end/(points - 1)
   call trajectory%forget()
   observers(1)%observer => trajectory
   call cpu_time(begun)
   call run_motion(machine, method, t_end, observers, outcome, error)
   call cpu_time(ended)
   if (allocated(error)) error stop error%message
   if (outcome%status /= 0) error stop "the motion did not reach its end"
   call get_command_argument(4, word)
   open (newunit=unit, file=word, status="replace", action="write")
   do i = 1, trajectory%count
      write (unit, "(a, 2(1x, es24.16))") "d", trajectory%time(i), trajectory%value(1, i)
   end do
   write (unit, "(a, f0.6)") "# cpu ", ended - begun
   write (unit, "(a, i0)") "# events ", outcome%events, "# rhs ", outcome%evaluations
   close (unit)

contains

   subroutine make_gear_pair()
      real(wp), parameter :: inertia(4) = [0.1_wp, 0.00794_wp, 0.00794_wp, 0.1_wp], shaft = 6.2905e4_wp, radius = 0.08_wp
      real(wp), parameter :: torque = 100.0_wp, hertz = 6.4e11_wp
      real(wp) :: gap, k(4, 4), m(4, 4)
      complex(wp) :: error(1)
      integer :: i

      t_end = 0.2_wp
      m = 0.0_wp
      k = 0.0_wp
      do i = 1, 4
         m(i, i) = inertia(i)
         k(i, i) = shaft
      end do
      do i = 1, 3, 2
         k(i, i + 1) = -shaft
         k(i + 1, i) = -shaft
      end do
      machine = plain_machine(m, 5.0e-4_wp*k, k)
      machine%load = [torque, 0.0_wp, 0.0_wp, -torque]
      gap = (torque/(radius*hertz))**(2.0_wp/3.0_wp)/radius
      machine%displacement = [gap/2 + torque/shaft, gap/2, -gap/2, -gap/2 - torque/shaft]
      error = [(0.0_wp, -5.0e-5_wp)]
      call excite(40*speed/60, [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      call add_contact(machine, "mesh", [0.0_wp, radius, -radius, 0.0_wp], &
                       new_power_law(power_side_t(.true., -1.0e-4_wp, hertz), power_side_t(.true., 0.0_wp, hertz), .false.))
      machine%contact(1)%error = error
      call add_observable(machine, "d", "m", [0.0_wp, radius, -radius, 0.0_wp], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      machine%observable(1)%error = error
   end subroutine make_gear_pair

   subroutine make_oscillator()
      real(wp), parameter :: clearance = 5.0e-3_wp, stop = 2.0e7_wp, hysteresis = 0.2_wp

      t_end = 20.0_wp
      machine = plain_machine(reshape([1.0_wp], [1, 1]), reshape([4.0_wp], [1, 1]), reshape([400.0_wp], [1, 1]))
      call excite(speed/60, [40.0_wp])
      call add_contact(machine, "stop", [1.0_wp], &
                       new_power_law(power_side_t(.true., -clearance, stop, 1.5_wp, hysteresis), &
                                     power_side_t(.true., clearance, stop, 1.5_wp, hysteresis), .false.))
      call add_observable(machine, "d", "m", [1.0_wp], [0.0_wp])
      machine%observable(1)%constant = -clearance
   end subroutine make_oscillator

   !> One tone of this frequency, Hz, with these forces.
   subroutine excite(hertz, force)
      real(wp), intent(in) :: hertz, force(:)

      machine%tone = [tone_from_hertz(real(hertz, qp))]
      machine%harmonic_load = reshape(cmplx(force, kind=wp), [size(force), 1])
   end subroutine excite

end program smooth
