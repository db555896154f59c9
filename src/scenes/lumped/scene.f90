!! The scene `lumped`: masses and inertias with one coordinate each become a machine (source thesis, chapters 2 to 4).
!!
!! A gear mesh between wheels 1 and 2 has d = r1 q1 - r2 q2 + Δ(t) and acts with -r1 F(d) and +r2 F(d); a stop has
!! s = q1 - q2 - z(t), z a given motion of its second end, and a friction element slides with s' = q1' - q2' - belt speed; both act
!! with -F and +F.
module razy_scenes_lumped_scene
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_text, only: did_you_mean
   use razy_input_input, only: input_t
   use razy_input_schema, only: group_spec_t
   use razy_linalg_dense, only: add_outer
   use razy_machine_machine, only: contact_t, find_free_motions, machine_t
   use razy_scenes_connections, only: find_connection
   use razy_scenes_contacts, only: contacts_of, read_contacts
   use razy_scenes_gears, only: read_gear_mesh
   use razy_scenes_harmonics, only: harmonics_t, new_harmonics, take_harmonics
   use razy_scenes_loads, only: add_loads
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_ends, find_row, find_speeds, new_bodies
   use razy_scenes_lumped_schema, only: lumped_schema
   use razy_scenes_scene, only: beside_structure, coordinate_t, force_t, scene_t, site_t
   use razy_scenes_tables, only: check_springs, holds_always, is_linear
   implicit none(type, external)
   private

   public :: lumped_t

   !> The scene; it keeps the bodies of the machine that was built last, and their mean speeds over that of `&rotation`.
   type, extends(scene_t) :: lumped_t
      private
      type(bodies_t) :: bodies
      real(qp), allocatable :: ratio(:)
   contains
      procedure, nopass :: schema => lumped_schema
      procedure :: build
      procedure :: new_structure
      procedure :: find_coordinate
      procedure :: find_site
      procedure :: find_force
   end type lumped_t

   !> What goes into K and B.
   character(*), parameter :: groups(2) = ["spring", "damper"]

contains

   !> The machine of a lumped scene, without observables and start.
   subroutine build(self, machine, input, error)
      class(lumped_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      integer :: i, meshes, n

      call self%renew(input, [beside_structure, "stop    "], error)
      if (allocated(error)) return
      machine = self%structure
      n = self%bodies%count
      meshes = input%count("gear_mesh")
      call new_harmonics(harmonics, n + 2*size(machine%contact), input)
      do i = 1, meshes
         call new_mesh(machine%contact(i), self%bodies, input, i, self%ratio, harmonics, &
                       [n + i, n + size(machine%contact) + i], error)
         if (allocated(error)) return
      end do
      call read_contacts(machine, self, meshes, input, harmonics, error)
      if (.not. allocated(error)) call add_loads(machine, self, input, harmonics, error)
      if (.not. allocated(error)) call take_harmonics(machine, harmonics)
   end subroutine build

   subroutine new_structure(self, input, error)
      class(lumped_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call new_bodies(self%bodies, input, error)
      if (.not. allocated(error)) call check_springs(input, error)
      if (allocated(error)) return
      call self%begin_structure(self%bodies%name, self%bodies%turns, self%bodies%mass, &
                                input%count("gear_mesh") + contacts_of(input), input)
      call add_connections(self%structure, self%bodies, input, error)
      if (.not. allocated(error)) call find_speeds(self%bodies, input, self%ratio, error)
   end subroutine new_structure

   !> Gear mesh i; its error and the harmonics of its stiffness go to the rows `row` of the harmonics. `ratio` (bodies) are mean
   !> speeds over that of `&rotation`.
   subroutine new_mesh(contact, bodies, input, i, ratio, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row(2)
      real(qp), intent(in) :: ratio(:)
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: radius(:)
      real(wp) :: w(bodies%count)
      integer :: ends(2)

      call find_ends(bodies, input, "gear_mesh", i, ends, error)
      if (allocated(error)) return
      if (any(ends == 0)) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not the frame")
      else if (.not. all(bodies%turns(ends))) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not masses")
      end if
      if (allocated(error)) return
      call input%get("gear_mesh", i, "radius", radius)
      w = 0.0_wp
      w(ends) = [radius(1), -radius(2)]
      call read_gear_mesh(contact, input, i, w, ratio(ends(1)), "a body that springs and meshes", harmonics, row, error)
   end subroutine new_mesh

   !> Springs and dampers into K and B, and what is free of them; those of no stiffness or damping are none.
   subroutine add_connections(machine, bodies, input, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: w(:)
      real(wp), dimension(bodies%count, input%count("spring") + input%count("damper")) :: springs, dampers
      real(wp) :: damping, stiffness
      logical :: turns
      integer :: g, i, k

      springs = 0.0_wp
      dampers = 0.0_wp
      k = 0
      do g = 1, size(groups)
         do i = 1, input%count(groups(g))
            k = k + 1
            call find_row(bodies, input, groups(g), i, w, turns, error)
            if (allocated(error)) return
            if (groups(g) == "spring") then
               if (holds_always(input, i)) springs(:, k) = w
               if (.not. is_linear(input, i)) cycle
            end if
            call coefficients(input, groups(g), i, stiffness, damping)
            call add_outer(machine%stiffness, stiffness, w)
            call add_outer(machine%damping, damping, w)
            if (abs(stiffness) > 0.0_wp) springs(:, k) = w
            if (abs(damping) > 0.0_wp) dampers(:, k) = w
         end do
      end do
      call find_free_motions(machine, springs, dampers)
   end subroutine add_connections

   !> Stiffness, N/m (N m/rad), and damping, N s/m (N m s/rad), of a linear spring or damper.
   subroutine coefficients(input, group, i, stiffness, damping)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: factor

      stiffness = 0.0_wp
      call input%get(group, i, "damping", damping)
      if (group == "damper") return
      call input%get(group, i, "stiffness", stiffness)
      call input%get(group, i, "damping_factor", factor)
      damping = damping + factor*stiffness
   end subroutine coefficients

   subroutine find_force(self, force, input, i, name, error)
      class(lumped_t), intent(in) :: self
      type(force_t), intent(out) :: force
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: w(:)
      real(wp) :: damping, stiffness
      integer :: group, number

      call find_connection(input, i, groups, name, group, number, error)
      if (.not. allocated(error)) call find_row(self%bodies, input, groups(group), number, w, force%turns, error)
      if (allocated(error)) return
      call coefficients(input, groups(group), number, stiffness, damping)
      force%on_displacement = stiffness*w
      force%on_velocity = damping*w
   end subroutine find_force

   !> The coordinate of a body; without a name that of the only one.
   subroutine find_coordinate(self, coordinate, input, group, i, key, error)
      class(lumped_t), intent(in) :: self
      type(coordinate_t), intent(out) :: coordinate
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      associate (bodies => self%bodies)
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

   subroutine find_site(self, site, input, group, i, stop, error)
      class(lumped_t), intent(in) :: self
      type(site_t), intent(out) :: site
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, stop
      type(error_t), allocatable, intent(out) :: error

      associate (unused => stop)
         call find_row(self%bodies, input, group, i, site%w, site%turns, error)
      end associate
      if (allocated(error) .or. group /= "stop") return
      site%sides = input%choice(group, i, "side") /= ["upper", "lower"]
   end subroutine find_site

end module razy_scenes_lumped_scene
