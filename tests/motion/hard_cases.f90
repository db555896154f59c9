!! The hard cases of docs/hard_cases.md: machines that integrators stumble over, with their motion in closed form.
module hard_cases
   use machine_samples, only: add_contact, add_tone, bare_machine, connect, start_at, stop_law
   use movers, only: tight
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_contact_friction_law, only: new_friction_law
   use razy_contact_rigid_law, only: new_rigid_law, rigid_side_t
   use razy_core_kinds, only: i8, qp, wp
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: case_names, hard_case, hard_case_t, method_of, ways, way_names

   character(*), parameter :: case_names(*) = [character(24) :: "graze_touch", "graze_miss", "graze_touch_rigid", &
                           "graze_miss_rigid", "closing_at_once", "closing_at_once_rigid", "ball_to_rest", "rest_on_moving_table", &
                                                                                                   "sliding_kept", "sliding_left", &
                            "switched_spring", "stiff_stops", "clearance_tiny", "clearance_zero", "resonance", "critical_damping", &
      "free_body_between_stops", "start_on_boundary", "start_at_rest_on_edge", "start_in_penetration", "start_at_rest_in_contact", &
                                                                                      "start_in_rigid_stop", "closer_than_rounding"]

   !> Integrator, treatment, and sharpness of smoothing.
   character(*), parameter :: way_names(*) = [character(16) :: "exact", "rk4", "bogacki_shampine", "dormand_prince", "dop853", &
                                                                         "radau5", "switching", "smoothing 1e6", "smoothing 1e11", &
                                                                                                    "smoothing 1e17", "moreau_jean"]
   integer, parameter :: ways = size(way_names)

   !> A case: the state at t_end and the number of changes of branch in closed form (-1: infinitely many).
   type :: hard_case_t
      type(machine_t) :: machine
      real(wp) :: t_end = 1.0_wp
      !> Step of methods without step control, s.
      real(wp) :: step = 1.0e-3_wp
      real(wp), allocatable :: x(:), v(:)
      integer :: events = 0
      !> What x and v are to be compared with.
      real(wp) :: length = 1.0_wp, speed = 1.0_wp
      !> Whether some laws are rigid.
      logical :: rigid = .false.
   end type hard_case_t

   real(qp), parameter :: g = 10, pi = acos(-1.0_qp)

contains

   !> The way of following a case with this number, and whether the case's laws allow it.
   subroutine method_of(way, sample, method, allowed)
      integer, intent(in) :: way
      type(hard_case_t), intent(in) :: sample
      type(method_t), intent(out) :: method
      logical, intent(out) :: allowed

      method = tight(way_names(min(way, 6)))
      if (way == 3) method = tight("bogacki_shampine", 1.0e-8_wp, 1.0e-11_wp)
      if (way == 6) method = tight("radau5", 1.0e-10_wp, 1.0e-13_wp)
      method%most_steps = 2000000_i8
      method%step = 0.0_wp
      select case (way)
      case (2)
         method%step = sample%step
         allowed = .true.
      case (7)
         method = tight("dormand_prince", 1.0e-9_wp, 1.0e-12_wp)
         method%treatment = "switching"
         method%most_steps = 2000000_i8
         allowed = .not. sample%rigid
      case (8:10)
         method = tight("radau5", 1.0e-9_wp, 1.0e-12_wp)
         method%treatment = "smoothing"
         method%sharpness = 10.0_wp**merge(6, merge(11, 17, way == 9), way == 8)
         method%most_steps = 200000_i8
         allowed = .not. sample%rigid
      case (11)
         method = method_t(integrator="moreau_jean", step=0.1_wp*sample%step)
         allowed = .true.
      case default
         allowed = .true.
      end select
   end subroutine method_of

   !> A case by its name.
   function hard_case(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      select case (name)
      case ("graze_touch", "graze_miss", "graze_touch_rigid", "graze_miss_rigid")
         sample = grazing(name)
      case ("closing_at_once", "closing_at_once_rigid", "ball_to_rest")
         sample = falling(name)
      case ("rest_on_moving_table")
         sample = moving_table()
      case ("sliding_kept", "sliding_left")
         sample = sliding(name)
      case ("switched_spring")
         sample = switched_spring()
      case ("stiff_stops", "clearance_tiny", "free_body_between_stops", "clearance_zero")
         sample = between_stops(name)
      case ("resonance", "critical_damping")
         sample = linear_case(name)
      case ("closer_than_rounding")
         sample = two_edges()
      case default
         sample = floor_case(name)
      end select
   end function hard_case

   !> A ball on a table at a sin(omega t) that falls with more than gravity, restitution 0.1: off where the table's acceleration
   !> is -g, infinitely many bounces, rest, and off again one period later; seen 0.03 s after that, in flight.
   function moving_table() result(sample)
      type(hard_case_t) :: sample

      real(qp), parameter :: a = 0.01_qp, omega = 12*pi, flight = 0.03_qp
      real(qp) :: leave

      sample%rigid = .true.
      sample%events = -1
      sample%step = 1.0e-4_wp
      sample%length = real(a, wp)
      sample%speed = real(a*omega, wp)
      sample%machine = bare_machine([1.0_wp])
      sample%machine%load = [-real(g, wp)]
      call add_tone(sample%machine, 6.0_qp, [(0.0_wp, 0.0_wp)])
      ! s = x - a sin(omega t), with Re(i e^{iωt}) = -sin.
      call add_contact(sample%machine, [1.0_wp], new_rigid_law(rigid_side_t(.true., 0.0_wp), rigid_side_t(), 0.1_wp), &
                       error=[cmplx(0.0_wp, real(a, wp), wp)])
      call start_at(sample%machine, [0.0_wp], [real(a*omega, wp)])
      leave = asin(g/(a*omega**2))/omega
      sample%t_end = real(leave + 1/6.0_qp + flight, wp)
      sample%x = [real(g/omega**2 + flight*(a*omega*cos(omega*leave) - g*flight/2), wp)]
      sample%v = [real(a*omega*cos(omega*leave) - g*flight, wp)]
   end function moving_table

   !> x = sin t against a stop at 1 -+ 1e-12, elastic of 1e6 N/m or rigid.
   function grazing(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: edge, t, k, omega, centre, speed
      logical :: touch

      touch = index(name, "touch") > 0
      sample%rigid = index(name, "rigid") > 0
      sample%t_end = 3.0_wp
      sample%events = 0
      edge = real(1.0_wp + merge(-1.0e-12_wp, 1.0e-12_wp, touch), qp)
      sample%machine = bare_machine([1.0_wp])
      call connect(sample%machine%stiffness, 1, 0, 1.0_wp)
      if (sample%rigid) then
         call add_contact(sample%machine, [1.0_wp], new_rigid_law(rigid_side_t(), rigid_side_t(.true., real(edge, wp)), 1.0_wp))
      else
         call add_contact(sample%machine, [1.0_wp], stop_law("upper", real(edge, wp), 1.0e6_wp))
      end if
      call start_at(sample%machine, [0.0_wp], [1.0_wp])
      t = sample%t_end
      if (touch) then
         sample%events = merge(1, 2, sample%rigid)
         speed = sqrt(1 - edge**2)
         t = t - asin(edge)
         if (.not. sample%rigid) then
            ! x'' + (1 + k) x = k edge until it is back.
            k = 1.0e6_wp
            omega = sqrt(1 + k)
            centre = k*edge/(1 + k)
            t = sample%t_end - asin(edge) - 2*(atan2(speed/omega, edge - centre))/omega
         end if
         sample%x = [real(edge*cos(t) - speed*sin(t), wp)]
         sample%v = [real(-edge*sin(t) - speed*cos(t), wp)]
      else
         sample%x = [real(sin(t), wp)]
         sample%v = [real(cos(t), wp)]
      end if
   end function grazing

   !> Bodies that fall from 1 m: sixteen on elastic or twelve on rigid floors, or one on a floor with restitution to its rest.
   function falling(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: k, omega, speed, t, contact
      real(wp), allocatable :: w(:)
      integer :: j, n

      n = merge(16, 12, name == "closing_at_once")
      if (name == "ball_to_rest") n = 1
      allocate (w(n))
      sample%rigid = name /= "closing_at_once"
      sample%machine = bare_machine(spread(1.0_wp, 1, n))
      sample%machine%load = spread(-real(g, wp), 1, n)
      do j = 1, n
         w = 0.0_wp
         w(j) = 1.0_wp
         if (sample%rigid) then
            call add_contact(sample%machine, w, new_rigid_law(rigid_side_t(.true., 0.0_wp), rigid_side_t(), 0.5_wp))
         else
            call add_contact(sample%machine, w, stop_law("lower", 0.0_wp, 1.0e6_wp))
         end if
      end do
      call start_at(sample%machine, spread(1.0_wp, 1, n), spread(0.0_wp, 1, n))
      speed = sqrt(2*g)
      if (sample%rigid) then
         ! At rest from sqrt(2/g) (1 + e)/(1 - e) = 1.3416 s on.
         sample%t_end = 1.4_wp
         sample%x = spread(0.0_wp, 1, n)
         sample%v = sample%x
         sample%events = -1
         return
      end if
      sample%t_end = 0.7_wp
      sample%step = 2.0e-5_wp
      k = 1.0e6_wp
      omega = sqrt(k)
      contact = 2*(pi - atan2(speed*omega, g))/omega
      t = sample%t_end - speed/g - contact
      sample%x = spread(real(t*(speed - g*t/2), wp), 1, n)
      sample%v = spread(real(speed - g*t, wp), 1, n)
      sample%events = 2*n
   end function falling

   !> Friction of 2 N on 1 kg: v' = 1 - 2 sign v from 0.6 m/s keeps v = 0 from 0.6 s on; a load sin t on 0.5 N (sticking) and
   !> 0.3 N (sliding) pulls loose at pi/6 s.
   function sliding(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: from, t

      sample%t_end = 2.0_wp
      sample%events = 1
      sample%machine = bare_machine([1.0_wp])
      if (name == "sliding_kept") then
         sample%machine%load = [1.0_wp]
         call add_contact(sample%machine, [1.0_wp], new_friction_law(0.2_wp, 0.2_wp, 0.0_wp))
         call start_at(sample%machine, [0.0_wp], [0.6_wp])
         sample%x = [0.18_wp]
         sample%v = [0.0_wp]
      else
         call add_tone(sample%machine, 1/(2*pi), [(0.0_wp, -1.0_wp)])
         call add_contact(sample%machine, [1.0_wp], new_friction_law(0.05_wp, 0.03_wp, 0.0_wp))
         from = asin(0.5_qp)
         t = sample%t_end - from
         sample%v = [real(cos(from) - cos(real(sample%t_end, qp)) - 0.3_qp*t, wp)]
         sample%x = [real(cos(from)*t - sin(real(sample%t_end, qp)) + sin(from) - 0.15_qp*t**2, wp)]
      end if
      sample%machine%contact(1)%normal = 10.0_wp
   end function sliding

   !> The oscillator of the listings with the law that is printed, whose force jumps by 5e5 N at touch; to the first return.
   function switched_spring() result(sample)
      type(hard_case_t) :: sample

      real(qp) :: z(2), t

      sample%t_end = 4.0e-3_wp
      sample%step = 1.0e-6_wp
      sample%machine = bare_machine([1.0_wp])
      call connect(sample%machine%stiffness, 1, 0, 1.0e6_wp)
      call connect(sample%machine%damping, 1, 0, 1.0e2_wp)
      call add_contact(sample%machine, [1.0_wp], new_clearance_law(clearance_side_t(), &
                                                          clearance_side_t(.true., 1.0e-4_wp, 5.0e9_wp, 0.0_wp, 5.0e5_wp), .false.))
      call start_at(sample%machine, [-1.0_wp], [0.0_wp])
      sample%speed = 1.0e3_wp
      z = [-1, 0]
      t = 0
      call to_edge(1.0e6_qp, z, t, 1.4e-3_qp, 1.8e-3_qp)
      call to_edge(5.001e9_qp, z, t, 3.0e-5_qp, 5.5e-5_qp)
      call damped(1.0e6_qp, sample%t_end - t, z)
      sample%x = [real(z(1), wp)]
      sample%v = [real(z(2), wp)]
      sample%events = 2

   contains

      !> Follow x'' + 100 x' + k x = 0 from z at t to x = 1e-4 m, which lies between `low` and `high` s later.
      subroutine to_edge(k, z, t, low, high)
         real(qp), intent(in) :: k, low, high
         real(qp), intent(inout) :: z(2), t

         real(qp) :: a, b, trial(2), first(2)
         integer :: i

         a = low
         b = high
         first = z
         call damped(k, a, first)
         do i = 1, 130
            trial = z
            call damped(k, (a + b)/2, trial)
            if ((trial(1) > 1.0e-4_wp) .eqv. (first(1) > 1.0e-4_wp)) then
               a = (a + b)/2
            else
               b = (a + b)/2
            end if
         end do
         call damped(k, b, z)
         t = t + b
      end subroutine to_edge

   end function switched_spring

   !> x'' + 100 x' + k x = 0 from z, after t.
   pure subroutine damped(k, t, z)
      real(qp), intent(in) :: k, t
      real(qp), intent(inout) :: z(2)

      real(qp) :: omega, x, v

      omega = sqrt(k - 2500)
      x = exp(-50*t)*(z(1)*cos(omega*t) + (z(2) + 50*z(1))/omega*sin(omega*t))
      v = exp(-50*t)*(z(2)*cos(omega*t) - (k*z(1) + 50*z(2))/omega*sin(omega*t))
      z = [x, v]
   end subroutine damped

   !> A free body of 1 kg and 1 m/s between two elastic stops.
   function between_stops(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: clearance, flight, k, omega, t, touch
      real(wp) :: width
      integer :: way

      k = 1.0e6_wp
      select case (name)
      case ("stiff_stops")
         width = 1.0e-3_wp
         k = 1.0e12_wp
      case ("clearance_tiny")
         width = 1.0e-12_wp
      case ("clearance_zero")
         width = 0.0_wp
      case default
         width = 1.0e-3_wp
      end select
      sample%t_end = 0.1_wp
      sample%step = merge(1.0e-7_wp, 2.0e-5_wp, name == "stiff_stops")
      sample%machine = bare_machine([1.0_wp])
      call add_contact(sample%machine, [1.0_wp], stop_law("both", width, real(k, wp)))
      call start_at(sample%machine, [0.0_wp], [1.0_wp])
      sample%length = max(width, real(1/sqrt(k), wp))
      clearance = width
      omega = sqrt(k)
      flight = 2*clearance
      touch = pi/omega
      t = sample%t_end + clearance
      sample%events = 2*int(t/(flight + touch))
      way = 1 - 2*modulo(sample%events/2, 2)
      t = t - (flight + touch)*(sample%events/2)
      sample%x = [real(way*(t - clearance), wp)]
      sample%v = [real(way, wp)]
      if (t <= flight) return
      ! Without clearance it starts in a stop, not on the way to it.
      if (width > 0.0_wp) sample%events = sample%events + 1
      sample%x = [real(way*(clearance + sin(omega*(t - flight))/omega), wp)]
      sample%v = [real(way*cos(omega*(t - flight)), wp)]
   end function between_stops

   !> x'' + x = cos t from rest (undamped resonance) up to just beyond a soft stop; or a critically damped body that passes one.
   function linear_case(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: t

      sample%machine = bare_machine([1.0_wp])
      call connect(sample%machine%stiffness, 1, 0, 1.0_wp)
      sample%events = 0
      if (name == "resonance") then
         sample%t_end = 100.0_wp
         sample%length = 50.0_wp
         sample%speed = 50.0_wp
         call add_tone(sample%machine, 1/(2*pi), [(1.0_wp, 0.0_wp)])
         call add_contact(sample%machine, [1.0_wp], stop_law("upper", 60.0_wp, 1.0e3_wp))
         t = sample%t_end
         sample%x = [real(t/2*sin(t), wp)]
         sample%v = [real(sin(t)/2 + t/2*cos(t), wp)]
      else
         sample%t_end = 20.0_wp
         call connect(sample%machine%damping, 1, 0, 2.0_wp)
         ! The lower side gives the force that open would, so the closed form goes on through the edge.
         call add_contact(sample%machine, [1.0_wp], stop_law("lower", 0.0_wp, 0.0_wp))
         call start_at(sample%machine, [1.0_wp], [-2.0_wp])
         t = sample%t_end
         sample%x = [real((1 - t)*exp(-t), wp)]
         sample%v = [real((t - 2)*exp(-t), wp)]
         sample%events = 1
      end if
   end function linear_case

   !> A body at 1000 m/s against two stops whose edges are neighbouring numbers: touched 2e-19 s apart after 1 s.
   function two_edges() result(sample)
      type(hard_case_t) :: sample

      real(qp) :: omega

      sample%machine = bare_machine([1.0_wp])
      call add_contact(sample%machine, [1.0_wp], stop_law("upper", 1.0_wp, 1.0e6_wp))
      call add_contact(sample%machine, [1.0_wp], stop_law("upper", 1.0_wp + epsilon(1.0_wp), 3.0e6_wp))
      call start_at(sample%machine, [-1.0e3_wp], [1.0e3_wp])
      sample%step = 2.0e-5_wp
      sample%length = 1.0e3_wp
      sample%speed = 1.0e3_wp
      omega = sqrt(4.0e6_qp)
      sample%t_end = 1.5_wp
      sample%x = [real(1 - 1000*(sample%t_end - 1.001_qp - pi/omega), wp)]
      sample%v = [-1000.0_wp]
      sample%events = 4
   end function two_edges

   !> A body of 1 kg on an elastic floor of 1e6 N/m, or on a rigid one, from where nothing or everything is decided.
   function floor_case(name) result(sample)
      character(*), intent(in) :: name
      type(hard_case_t) :: sample

      real(qp) :: k, omega, t

      k = 1.0e6_wp
      omega = sqrt(k)
      sample%t_end = 0.1_wp
      sample%step = 1.0e-5_wp
      t = sample%t_end
      sample%length = 1.0e-5_wp
      sample%speed = 1.0e-2_wp
      sample%machine = bare_machine([1.0_wp])
      sample%machine%load = [-real(g, wp)]
      if (name == "start_in_rigid_stop") then
         sample%rigid = .true.
         call add_contact(sample%machine, [1.0_wp], new_rigid_law(rigid_side_t(.true., 0.0_wp), rigid_side_t(), 0.5_wp))
      else
         call add_contact(sample%machine, [1.0_wp], stop_law("lower", 0.0_wp, real(k, wp)))
      end if
      select case (name)
      case ("start_on_boundary")
         ! It falls into the floor, and is back at the edge at rest after each turn.
         t = 2*pi/omega*0.75_qp
         sample%t_end = real(t, wp)
         sample%x = [real(-g/k*(1 - cos(omega*t)), wp)]
         sample%v = [real(-g/omega*sin(omega*t), wp)]
         sample%events = 1
      case ("start_at_rest_on_edge")
         sample%machine%load = [0.0_wp]
         sample%x = [0.0_wp]
         sample%v = [0.0_wp]
      case ("start_in_penetration")
         ! Let go 1 mm deep; up with the speed at the edge.
         call start_at(sample%machine, [-1.0e-3_wp], [0.0_wp])
         sample%length = 1.0e-3_wp
         sample%speed = 1.0_wp
         call thrown_up(1.0e-3_qp, t)
      case ("start_at_rest_in_contact")
         call start_at(sample%machine, [-1.0e-5_wp], [0.0_wp])
         sample%x = [-1.0e-5_wp]
         sample%v = [0.0_wp]
      case ("start_in_rigid_stop")
         call start_at(sample%machine, [-1.0e-3_wp], [0.0_wp])
         sample%x = [0.0_wp]
         sample%v = [0.0_wp]
      case default
         error stop "no such case"
      end select

   contains

      !> From the depth d at rest: about the static position with amplitude d - g/k, free from x = 0 on.
      subroutine thrown_up(d, t)
         real(qp), intent(in) :: d, t

         real(qp) :: amplitude, speed, free

         amplitude = d - g/k
         free = t - acos(-(g/k)/amplitude)/omega
         speed = omega*sqrt(amplitude**2 - (g/k)**2)
         sample%x = [real(free*(speed - g*free/2), wp)]
         sample%v = [real(speed - g*free, wp)]
         sample%events = 1
      end subroutine thrown_up

   end function floor_case

end module hard_cases
