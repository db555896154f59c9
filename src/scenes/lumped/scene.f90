!! The scene `lumped`: masses and inertias with one coordinate each become a machine (source thesis, chapters 2 to 4).
module razy_scenes_lumped_scene
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: qp, wp
   use razy_input_schema, only: group_spec_t
   use razy_machine_machine, only: machine_t, observable_t
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t, new_harmonics, read_load, take_harmonics
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_ends, new_bodies
   use razy_scenes_lumped_contacts, only: new_friction, new_mesh, new_stop
   use razy_scenes_lumped_observables, only: lumped_observable
   use razy_scenes_lumped_schema, only: lumped_schema
   use razy_scenes_lumped_tones, only: find_speeds
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
      integer :: i, n, contacts, meshes, stops

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
      contacts = meshes + stops + input%count("friction")
      allocate (machine%contact(contacts))
      call new_harmonics(harmonics, n + contacts)
      do i = 1, contacts
         if (i <= meshes) then
            call new_mesh(machine%contact(i), bodies, input, i, ratio, harmonics, n + i, error)
         else if (i <= meshes + stops) then
            call new_stop(machine%contact(i), bodies, input, i - meshes, harmonics, n + i, error)
         else
            call new_friction(machine%contact(i), machine%contact(meshes + 1:meshes + stops), meshes + 1, bodies, input, &
                              i - meshes - stops, error)
         end if
         if (allocated(error)) return
      end do
      call add_loads(machine, bodies, input, harmonics, error)
      if (allocated(error)) return
      call take_harmonics(machine, harmonics)
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

   !> Constant and harmonic loads.
   subroutine add_loads(machine, bodies, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: cosine, sine, value
      real(qp) :: hertz
      integer :: body, i

      do i = 1, input%count("load")
         call find_body(bodies, input, "load", i, "on", 1, body, error)
         if (.not. allocated(error)) call read_load(input, i, value, cosine, sine, hertz, error)
         if (allocated(error)) return
         machine%load(body) = machine%load(body) + value
         call add_harmonic(harmonics, body, hertz, cosine, sine)
      end do
   end subroutine add_loads

end module razy_scenes_lumped_scene
