!! The scene `lumped`: masses and inertias with one coordinate each become a machine (THEORY 2 and 4).
!!
!! A gear mesh between wheels 1 and 2 has d = r1 q1 - r2 q2 + Δ(t) and acts with -r1 F(d) and +r2 F(d) (THEORY 4, with the
!! continuous back flank k (d + backlash)); a stop has s = q1 - q2 and acts with -F(s) and +F(s).
module razy_scenes_lumped
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: qp, wp
   use razy_core_schema, only: group_spec_t
   use razy_core_text, only: lower
   use razy_machine_machine, only: contact_t, machine_t, observable_t
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_ends, new_bodies
   use razy_scenes_lumped_observables, only: lumped_observable
   use razy_scenes_lumped_schema, only: lumped_schema
   use razy_scenes_lumped_tones, only: add_harmonic, find_speeds, harmonics_t
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: lumped_t

   !> The scene; it keeps the bodies of the machine that was built last.
   type, extends(scene_t) :: lumped_t
      type(bodies_t) :: bodies
   contains
      procedure, nopass :: schema
      procedure :: build
      procedure :: new_observable
      procedure :: set_initial
   end type lumped_t

contains

   function schema() result(groups)
      type(group_spec_t), allocatable :: groups(:)

      groups = lumped_schema()
   end function schema

   subroutine build(self, machine, input, error)
      class(lumped_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call new_bodies(self%bodies, input, error)
      if (.not. allocated(error)) call assemble(machine, self%bodies, input, error)
   end subroutine build

   subroutine new_observable(self, observable, machine, input, i, error)
      class(lumped_t), intent(in) :: self
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      call lumped_observable(observable, machine, self%bodies, input, i, error)
   end subroutine new_observable

   subroutine set_initial(self, machine, input, error)
      class(lumped_t), intent(in) :: self
      type(machine_t), intent(inout) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: body, i

      do i = 1, input%count("initial")
         call find_body(self%bodies, input, "initial", i, "on", 1, body, error)
         if (allocated(error)) return
         call input%get("initial", i, "displacement", machine%displacement(body))
         call input%get("initial", i, "velocity", machine%velocity(body))
      end do
   end subroutine set_initial

   !> The machine of a lumped scene, without observables and start.
   subroutine assemble(machine, bodies, input, error)
      type(machine_t), intent(out) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      real(qp), allocatable :: ratio(:)
      integer :: i, n, meshes, stops

      n = bodies%count
      call input%get("scene", 1, "title", machine%title)
      machine%coordinate = [character(64) ::(bodies%name(i)%text, i=1, n)]
      machine%unit = [character(16) ::(bodies%unit(i, "m", "rad"), i=1, n)]
      machine%rate_unit = [character(16) ::(bodies%unit(i, "m/s", "rad/s"), i=1, n)]
      allocate (machine%mass(n, n), machine%damping(n, n), machine%stiffness(n, n), machine%load(n), source=0.0_wp)
      do i = 1, n
         machine%mass(i, i) = bodies%mass(i)
      end do
      call add_connections(machine, bodies, input, error)
      if (allocated(error)) return
      allocate (ratio(n))
      call find_speeds(input, bodies, ratio, error)
      if (allocated(error)) return
      meshes = input%count("gear_mesh")
      stops = input%count("stop")
      allocate (machine%contact(meshes + stops))
      allocate (harmonics%hertz(0), harmonics%tone(0), harmonics%phasor(n + meshes + stops, 0))
      allocate (harmonics%constant(n + meshes + stops), source=0.0_wp)
      do i = 1, meshes
         call new_mesh(machine%contact(i), bodies, input, i, ratio, harmonics, n + i, error)
         if (allocated(error)) return
      end do
      do i = 1, stops
         call new_stop(machine%contact(meshes + i), bodies, input, i, error)
         if (allocated(error)) return
      end do
      call add_loads(machine, bodies, input, harmonics, error)
      if (allocated(error)) return
      machine%tone = harmonics%tone
      machine%harmonic_load = harmonics%phasor(:n, :)
      machine%load = machine%load + harmonics%constant(:n)
      do i = 1, meshes + stops
         machine%contact(i)%error = harmonics%phasor(n + i, :)
         machine%contact(i)%offset = harmonics%constant(n + i)
      end do
   end subroutine assemble

   !> Springs and dampers into K and B.
   subroutine add_connections(machine, bodies, input, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: stiffness, damping, factor
      integer :: ends(2), i

      do i = 1, input%count("spring")
         call find_ends(bodies, input, "spring", i, ends, error)
         if (allocated(error)) return
         call input%get("spring", i, "stiffness", stiffness)
         call input%get("spring", i, "damping", damping)
         call input%get("spring", i, "damping_factor", factor)
         call connect(machine%stiffness, ends, stiffness)
         call connect(machine%damping, ends, damping + factor*stiffness)
      end do
      do i = 1, input%count("damper")
         call find_ends(bodies, input, "damper", i, ends, error)
         if (allocated(error)) return
         call input%get("damper", i, "damping", damping)
         call connect(machine%damping, ends, damping)
      end do
   end subroutine add_connections

   !> Add an element between two coordinates (0: the frame) to a matrix.
   pure subroutine connect(matrix, ends, value)
      real(wp), intent(inout) :: matrix(:, :)
      integer, intent(in) :: ends(2)
      real(wp), intent(in) :: value

      integer :: i

      do i = 1, 2
         if (ends(i) > 0) matrix(ends(i), ends(i)) = matrix(ends(i), ends(i)) + value
      end do
      if (any(ends == 0)) return
      matrix(ends(1), ends(2)) = matrix(ends(1), ends(2)) - value
      matrix(ends(2), ends(1)) = matrix(ends(2), ends(1)) - value
   end subroutine connect

   !> Gear mesh i; its error goes to row `row` of the harmonics.
   subroutine new_mesh(contact, bodies, input, i, ratio, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      real(qp), intent(in) :: ratio(:)
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: radius(:), sine(:), cosine(:)
      integer, allocatable :: teeth(:)
      real(wp) :: stiffness, damping, backlash, speed
      integer :: ends(2), k

      call find_ends(bodies, input, "gear_mesh", i, ends, error)
      if (allocated(error)) return
      if (any(ends == 0)) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not the frame")
      else if (.not. all(bodies%turns(ends))) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not masses")
      end if
      if (allocated(error)) return
      call input%get("gear_mesh", i, "name", contact%name)
      call input%get("gear_mesh", i, "radius", radius)
      call input%get("gear_mesh", i, "teeth", teeth)
      call input%get("gear_mesh", i, "stiffness", stiffness)
      call input%get("gear_mesh", i, "damping", damping)
      call input%get("gear_mesh", i, "backlash", backlash)
      allocate (contact%w(bodies%count), source=0.0_wp)
      contact%w(ends) = [radius(1), -radius(2)]
      contact%unit = "m"
      contact%force_unit = "N"
      contact%law = new_clearance_law(clearance_side_t(.true., -backlash, stiffness, damping), &
                                      clearance_side_t(.true., 0.0_wp, stiffness, damping), &
                                      parts_at_zero_force(input, "gear_mesh", i))
      call input%get("gear_mesh", i, "error_sine", sine)
      call input%get("gear_mesh", i, "error_cosine", cosine)
      if (size(sine) + size(cosine) == 0) return
      if (.not. abs(ratio(ends(1))) > 0.0_qp) then
         call input%complain(error, "gear_mesh", i, merge("error_sine  ", "error_cosine", size(sine) > 0), &
                             "an error needs &rotation of a body that springs and meshes join to this one")
         return
      end if
      call input%get("rotation", 1, "speed_rpm", speed)
      do k = 1, size(sine)
         call add_harmonic(harmonics, row, k*teeth(1)*ratio(ends(1))*speed/60.0_qp, 0.0_wp, sine(k))
      end do
      do k = 1, size(cosine)
         call add_harmonic(harmonics, row, k*teeth(1)*ratio(ends(1))*speed/60.0_qp, cosine(k), 0.0_wp)
      end do
   end subroutine new_mesh

   subroutine new_stop(contact, bodies, input, i, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: side
      real(wp) :: clearance, stiffness, damping
      integer :: ends(2)

      call find_ends(bodies, input, "stop", i, ends, error)
      if (allocated(error)) return
      call input%get("stop", i, "name", contact%name)
      call input%get("stop", i, "side", side)
      call input%get("stop", i, "clearance", clearance)
      call input%get("stop", i, "stiffness", stiffness)
      call input%get("stop", i, "damping", damping)
      side = lower(side)
      if (side == "both" .and. clearance < 0.0_wp) then
         call input%complain(error, "stop", i, "clearance", "at least 0 for a stop with side = 'both'")
         return
      end if
      allocate (contact%w(bodies%count), source=0.0_wp)
      if (ends(1) > 0) contact%w(ends(1)) = 1.0_wp
      if (ends(2) > 0) contact%w(ends(2)) = -1.0_wp
      contact%unit = bodies%unit(maxval(ends), "m", "rad")
      contact%force_unit = bodies%unit(maxval(ends), "N", "N m")
      if (side == "lower") contact%force_sign = -1.0_wp
      contact%law = new_clearance_law(clearance_side_t(side /= "upper", -clearance, stiffness, damping), &
                                      clearance_side_t(side /= "lower", clearance, stiffness, damping), &
                                      parts_at_zero_force(input, "stop", i))
   end subroutine new_stop

   function parts_at_zero_force(input, group, i) result(parts)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      logical :: parts

      character(:), allocatable :: separation

      call input%get(group, i, "separation", separation)
      parts = lower(separation) == "zero_force"
   end function parts_at_zero_force

   !> Constant and harmonic loads.
   subroutine add_loads(machine, bodies, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: amplitude, phase, value
      real(qp) :: hertz
      integer :: body, i

      do i = 1, input%count("load")
         call find_body(bodies, input, "load", i, "on", 1, body, error)
         if (allocated(error)) return
         call input%get("load", i, "value", value)
         call input%get("load", i, "amplitude", amplitude)
         call input%get("load", i, "phase", phase)
         machine%load(body) = machine%load(body) + value
         call load_frequency(input, i, abs(amplitude) > 0.0_wp, hertz, error)
         if (allocated(error)) return
         phase = phase*acos(-1.0_wp)/180
         call add_harmonic(harmonics, body, hertz, amplitude*sin(phase), amplitude*cos(phase))
      end do
   end subroutine add_loads

   !> The frequency of load i, Hz, from the one of three keys that gives it.
   subroutine load_frequency(input, i, needed, hertz, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      logical, intent(in) :: needed
      real(qp), intent(out) :: hertz
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: allowed = "one of frequency, angular_frequency and order goes with an amplitude"
      real(wp) :: value, speed

      hertz = 0.0_qp
      if (count([input%given("load", i, "frequency"), input%given("load", i, "angular_frequency"), &
                 input%given("load", i, "order")]) /= merge(1, 0, needed)) then
         if (needed) call input%complain(error, "load", i, "amplitude", allowed)
         if (needed) return
      end if
      if (input%given("load", i, "frequency")) then
         call input%get("load", i, "frequency", value)
         hertz = value
      else if (input%given("load", i, "angular_frequency")) then
         call input%get("load", i, "angular_frequency", value)
         hertz = value/(2*acos(-1.0_qp))
      else if (input%given("load", i, "order")) then
         if (input%count("rotation") == 0) then
            call input%complain(error, "load", i, "order", "an order needs &rotation")
            return
         end if
         call input%get("load", i, "order", value)
         call input%get("rotation", 1, "speed_rpm", speed)
         hertz = real(value, qp)*speed/60
      end if
   end subroutine load_frequency

end module razy_scenes_lumped
