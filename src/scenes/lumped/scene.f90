!! The scene `lumped`: masses and inertias with one coordinate each become a machine (source thesis, chapters 2 to 4).
module razy_scenes_lumped_scene
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_text, only: did_you_mean
   use razy_input_input, only: input_t
   use razy_input_schema, only: group_spec_t
   use razy_linalg_dense, only: add_outer
   use razy_machine_machine, only: machine_t
   use razy_scenes_harmonics, only: harmonics_t, new_harmonics, take_harmonics
   use razy_scenes_loads, only: add_loads
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_row, find_speeds, new_bodies
   use razy_scenes_lumped_contacts, only: new_friction, new_mesh, new_stop
   use razy_scenes_lumped_schema, only: lumped_schema
   use razy_scenes_scene, only: coordinate_t, scene_t
   implicit none(type, external)
   private

   public :: lumped_t

   !> The scene; it keeps the bodies of the machine that was built last.
   type, extends(scene_t) :: lumped_t
      type(bodies_t), private :: bodies
   contains
      procedure, nopass :: schema => lumped_schema
      procedure :: build
      procedure :: find_coordinate
   end type lumped_t

contains

   !> The machine of a lumped scene, without observables and start.
   subroutine build(self, machine, input, error)
      class(lumped_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      real(qp), allocatable :: ratio(:)
      integer :: i, meshes, n, stops

      call new_bodies(self%bodies, input, error)
      if (allocated(error)) return
      n = self%bodies%count
      call input%get("scene", 1, "title", machine%title)
      machine%coordinate = [character(64) ::(self%bodies%name(i)%text, i=1, n)]
      machine%unit = [character(16) :: merge("rad", "m  ", self%bodies%turns)]
      machine%rate_unit = [character(16) :: merge("rad/s", "m/s  ", self%bodies%turns)]
      allocate (machine%mass(n, n), machine%damping(n, n), machine%stiffness(n, n), machine%load(n), source=0.0_wp)
      do i = 1, n
         machine%mass(i, i) = self%bodies%mass(i)
      end do
      call add_connections(machine, self%bodies, input, error)
      if (.not. allocated(error)) call find_speeds(self%bodies, input, ratio, error)
      if (allocated(error)) return
      meshes = input%count("gear_mesh")
      stops = input%count("stop")
      allocate (machine%contact(meshes + stops + input%count("friction")))
      call new_harmonics(harmonics, n + size(machine%contact))
      do i = 1, size(machine%contact)
         if (i <= meshes) then
            call new_mesh(machine%contact(i), self%bodies, input, i, ratio, harmonics, n + i, error)
         else if (i <= meshes + stops) then
            call new_stop(machine%contact(i), self%bodies, input, i - meshes, harmonics, n + i, error)
         else
            call new_friction(machine%contact(i), machine%contact(meshes + 1:meshes + stops), meshes + 1, self%bodies, input, &
                              i - meshes - stops, error)
         end if
         if (allocated(error)) return
      end do
      call add_loads(machine, self, input, harmonics, error)
      if (.not. allocated(error)) call take_harmonics(machine, harmonics)
   end subroutine build

   !> Springs and dampers into K and B.
   subroutine add_connections(machine, bodies, input, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: w(:)
      real(wp) :: damping, factor, stiffness
      logical :: turns
      integer :: i

      do i = 1, input%count("spring")
         call find_row(bodies, input, "spring", i, w, turns, error)
         if (allocated(error)) return
         call input%get("spring", i, "stiffness", stiffness)
         call input%get("spring", i, "damping", damping)
         call input%get("spring", i, "damping_factor", factor)
         call add_outer(machine%stiffness, stiffness, w)
         call add_outer(machine%damping, damping + factor*stiffness, w)
      end do
      do i = 1, input%count("damper")
         call find_row(bodies, input, "damper", i, w, turns, error)
         if (allocated(error)) return
         call input%get("damper", i, "damping", damping)
         call add_outer(machine%damping, damping, w)
      end do
   end subroutine add_connections

   !> The coordinate of a body; without a name that of the only one.
   subroutine find_coordinate(self, coordinate, input, group, i, key, own, error)
      class(lumped_t), intent(in) :: self
      type(coordinate_t), intent(out) :: coordinate
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      logical, intent(in) :: own
      type(error_t), allocatable, intent(out) :: error

      associate (bodies => self%bodies, unused => own)
         coordinate%number = 1
         if (input%given(group, i, key)) then
            call find_body(bodies, input, group, i, key, coordinate%number, error)
         else if (bodies%count > 1) then
            call input%complain(error, group, i, key, "required where there are several; "//did_you_mean("", bodies%name, "bodies"))
         end if
         if (allocated(error)) return
         coordinate%name = bodies%name(coordinate%number)%text
         coordinate%turns = bodies%turns(coordinate%number)
         allocate (coordinate%row(bodies%count), source=0.0_wp)
         coordinate%row(coordinate%number) = 1.0_wp
      end associate
   end subroutine find_coordinate

end module razy_scenes_lumped_scene
