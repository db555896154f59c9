!! The scenes `lumped` and `planar`: bodies that turn, on lines and in a plane, with what acts between them (source thesis,
!! chapters 2 to 4).
!!
!! Motion is small: geometry is that of the reference position. A stop has s = u1 - u2 - z(t), z a given motion of its second end,
!! and acts with -F and +F; in direction n pushes its first point along n with
!! the force of its law, such as max(0, k p + b p'), where p = -(s + clearance) and s = n·(u1 - u2) is the
!! displacement of the first point against the second. Friction in direction t acts against s' = t·(u1' - u2') - belt speed; both of
!! its forces act at the place of the first point.
module razy_scenes_parts_scene
   use razy_core_drawing, only: drawing_t, element_load
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: did_you_mean, lower, position_of
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: add_outer
   use razy_machine_frame, only: frame_t
   use razy_machine_machine, only: find_free_motions, machine_t
   use razy_scenes_connections, only: coefficients, connecting, find_connection, read_sides
   use razy_scenes_contacts, only: contacts_of, read_contacts
   use razy_scenes_harmonics, only: harmonics_t, new_harmonics, read_rotation, take_harmonics
   use razy_scenes_loads, only: add_loads
   use razy_scenes_parts_bodies, only: add_motion, add_pinned_masses, bodies_t, known_point, new_bodies, point_t
   use razy_scenes_parts_drawing, only: draw_exciters, draw_links
   use razy_scenes_parts_excitation, only: add_exciters, add_weights
   use razy_scenes_parts_links, only: find_ring_rows, link_t, new_sliding_link, read_links
   use razy_scenes_parts_meshes, only: find_speeds, read_meshes
   use razy_scenes_parts_schema, only: matrix_all, matrix_untuned, parts_schema
   use razy_scenes_parts_turning, only: bound_turning
   use razy_scenes_scene, only: beside_structure, coordinate_t, force_t, says_same, scene_t, site_t
   use razy_scenes_surrounding, only: note_surrounding
   use razy_scenes_tables, only: check_springs, holds_always, is_linear
   implicit none(type, external)
   private

   public :: parts_t

   !> What acts on a machine and changes nothing else of it.
   character(*), parameter :: acting(2) = ["load   ", "exciter"]

   !> The scene; it keeps bodies, and what stands between them, of the machine that was built last.
   type, extends(scene_t) :: parts_t
      private
      type(bodies_t) :: bodies
      !> Springs and dampers; stops; gear meshes.
      type(link_t), allocatable :: link(:), stop(:), mesh(:)
      !> Mean speeds of the bodies over that of `&rotation`.
      real(qp), allocatable :: ratio(:)
      !> The machine built last without its tones and loads; these, and those that are none of loads and exciters; what the input
      !> said of the machine, and of its loads and exciters.
      type(machine_t), allocatable :: acted_on
      type(harmonics_t) :: harmonics, resting
      real(wp), allocatable :: said(:), said_to_act(:)
   contains
      procedure, nopass :: schema => parts_schema
      procedure :: build
      procedure :: new_structure
      procedure :: find_coordinate
      procedure :: find_site
      procedure :: find_force
      procedure, public :: draw
   end type parts_t

contains

   !> Where the input says another speed of &rotation only, and frequencies alone follow from that, they are set; where it says
   !> other loads and exciters, these alone are read.
   subroutine build(self, machine, input, error)
      class(parts_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: acceleration, speed
      logical :: is_kept, is_set

      is_kept = says_same(self%said, input, ["record ", "sweep  ", "tune   ", "initial", acting], within=.false.)
      is_set = says_same(self%said_to_act, input, acting, within=.true.) .and. is_kept
      call read_rotation(speed, acceleration, input)
      if (is_set) call self%harmonics%set_speed(speed, is_set)
      if (.not. is_set) then
         if (is_kept) call self%resting%set_speed(speed, is_kept)
         if (.not. is_kept) call read_machine(self, input, error)
         self%harmonics = self%resting
         if (.not. allocated(error)) call add_loads(self, input, self%harmonics, error)
         if (.not. allocated(error)) call add_exciters(self%bodies, input, self%harmonics, error)
      end if
      if (allocated(error)) then
         deallocate (self%said)
         return
      end if
      machine = self%acted_on
      call take_harmonics(machine, self%harmonics)
   end subroutine build

   !> All of the machine but its tones and loads, and the tones that are none of loads and exciters.
   subroutine read_machine(self, input, error)
      class(parts_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(machine_t), allocatable :: machine

      ! Where no matrix and no bound of angles follows from stops, they are beside the structure.
      call self%renew(input, [beside_structure, merge("stop    ", "exciter ", input%count("body") + input%count("damping") == 0), &
                              "exciter "], error)
      if (.not. allocated(error)) call read_links(self%stop, self%bodies, input, ["stop"], error)
      if (allocated(error)) return
      machine = self%structure
      call new_harmonics(self%resting, size(machine%load) + 2*size(machine%contact), input)
      call read_meshes(machine%contact, self%mesh, self%ratio, input, self%resting, error)
      if (.not. allocated(error)) call read_contacts(machine, self, input%count("gear_mesh"), input, self%resting, error)
      call move_alloc(machine, self%acted_on)
   end subroutine read_machine

   subroutine new_structure(self, input, error)
      class(parts_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call new_bodies(self%bodies, input, error)
      if (.not. allocated(error)) call check_springs(input, error)
      if (.not. allocated(error)) call read_links(self%link, self%bodies, input, connecting, error)
      if (.not. allocated(error)) call read_links(self%stop, self%bodies, input, ["stop"], error)
      if (allocated(error)) return
      call self%begin_structure(self%bodies%coordinate, self%bodies%turns, self%bodies%mass, &
                                input%count("gear_mesh") + contacts_of(input), input)
      call add_pinned_masses(self%structure%mass, self%bodies)
      call find_speeds(self%mesh, self%ratio, [self%link, self%stop], self%bodies, input, error)
      if (.not. allocated(error)) call add_weights(self%structure%load, self%structure%stiffness, self%bodies, input, error)
      if (.not. allocated(error)) call add_connections(self%structure, self%link, self%stop, input, error)
      if (.not. allocated(error)) call bound_turning(self%structure, self%bodies, self%link, self%stop, input, error)
      if (.not. allocated(error)) call note_surrounding(self%structure, input)
   end subroutine new_structure

   !> Springs, dampers and proportional damping into K, which holds what weights right so far, and B, and what is free of them; all
   !> pairs of a group share its stiffness and damping.
   subroutine add_connections(machine, links, stops, input, error)
      type(machine_t), intent(inout) :: machine
      type(link_t), intent(inout) :: links(:)
      type(link_t), intent(in) :: stops(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: proportional(:, :)
      real(wp) :: springs(size(machine%load), size(links) + size(machine%load))
      real(wp) :: dampers(size(machine%load), size(links) + size(stops))
      character(:), allocatable :: matrix
      real(wp) :: damping, factor, stiffness
      integer :: k

      springs = 0.0_wp
      springs(:, size(links) + 1:) = machine%stiffness
      dampers = 0.0_wp
      factor = input%number("damping", 1, "factor", otherwise=0.0_wp)
      allocate (proportional, mold=machine%stiffness)
      proportional(:, :) = 0.0_wp
      matrix = input%choice("damping", 1, "matrix")
      do k = 1, size(links)
         associate (group => links(k)%group, i => links(k)%number, pairs => links(k)%pairs, w => links(k)%w)
            if (group == "spring") then
               if (holds_always(input, i)) springs(:, k) = w
            end if
            if (.not. is_linear(input, group, i)) cycle
            call coefficients(input, group, i, stiffness, damping)
            call add_outer(machine%damping, damping/pairs, w)
            if (abs(damping) > 0.0_wp) dampers(:, k) = w
            links(k)%damping = damping/pairs
            if (group == "damper") cycle
            call add_outer(machine%stiffness, stiffness/pairs, w)
            if (abs(stiffness) > 0.0_wp) springs(:, k) = w
            links(k)%stiffness = stiffness/pairs
            if (matrix == matrix_untuned) call input%get(group, i, "untuned_stiffness", stiffness)
            call add_outer(proportional, stiffness/pairs, w)
            if (abs(factor*stiffness) > 0.0_wp) dampers(:, k) = w
            links(k)%damping = links(k)%damping + factor*stiffness/pairs
         end associate
      end do
      do k = 1, merge(size(stops), 0, input%count("damping") > 0 .and. matrix == matrix_all)
         if (input%choice("stop", k, "law") /= "kelvin_voigt") then
            call input%complain(error, "damping", 1, "matrix", "'springs' or 'untuned' where a stop has a law that is no spring")
            return
         end if
         call input%get("stop", k, "stiffness", stiffness)
         call add_outer(proportional, stiffness, stops(k)%w)
         if (abs(factor*stiffness) > 0.0_wp) dampers(:, size(links) + k) = stops(k)%w
      end do
      machine%damping = machine%damping + factor*proportional
      call find_free_motions(machine, springs, dampers)
   end subroutine add_connections

   !> The coordinate, or, but for the start, also the component of the motion of a point, that a key names; without a name the
   !> only coordinate.
   subroutine find_coordinate(self, coordinate, input, group, i, key, error)
      class(parts_t), intent(in) :: self
      type(coordinate_t), intent(out) :: coordinate
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(point_t) :: point
      integer :: component, dot
      logical :: is_point

      associate (known => self%bodies%coordinate)
         coordinate%name = known(1)%text
         if (input%given(group, i, key)) then
            call input%get(group, i, key, coordinate%name)
         else if (size(known) > 1) then
            call input%complain(error, group, i, key, "required where there are several coordinates; "// &
                                did_you_mean("", known, "coordinates"))
            return
         end if
         allocate (coordinate%row(size(known)), source=0.0_wp)
         associate (name => coordinate%name)
            coordinate%number = position_of(name, known)
            dot = scan(name, ".", back=.true.)
            component = findloc(["x", "y"] == lower(name(dot + 1:)), .true., dim=1)
            is_point = known_point(self%bodies, name(:max(0, dot - 1)), point)
            if (coordinate%number > 0) then
               coordinate%turns = self%bodies%turns(coordinate%number)
               coordinate%row(coordinate%number) = 1.0_wp
               coordinate%name = known(coordinate%number)%text
            else if (is_point .and. component > 0 .and. group /= "initial") then
               call add_motion(coordinate%row, self%bodies, point, real([2 - component, component - 1], wp))
            end if
         end associate
         if (any(abs(coordinate%row) > 0.0_wp)) return
         call input%complain(error, group, i, key, "a coordinate, or, not in &initial, a point of a body with .x or .y; "// &
                             did_you_mean(coordinate%name, known, "coordinates"))
      end associate
   end subroutine find_coordinate

   !> All pairs of a group together.
   subroutine find_force(self, force, input, i, name, error)
      class(parts_t), intent(in) :: self
      type(force_t), intent(out) :: force
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error

      integer :: group, k, number

      call find_connection(input, i, connecting, name, group, number, error)
      if (allocated(error)) return
      allocate (force%on_displacement(size(self%bodies%mass)), force%on_velocity(size(self%bodies%mass)), source=0.0_wp)
      do k = 1, size(self%link)
         associate (link => self%link(k))
            if (link%group /= connecting(group) .or. link%number /= number) cycle
            force%turns = link%turns
            force%on_displacement = force%on_displacement + link%stiffness*link%w
            force%on_velocity = force%on_velocity + link%damping*link%w
         end associate
      end do
   end subroutine find_force

   subroutine find_site(self, site, input, group, i, stop, error)
      class(parts_t), intent(in) :: self
      type(site_t), intent(out) :: site
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, stop
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link
      real(wp), allocatable :: along_x(:), along_y(:), offset(:)
      integer :: k, ring

      ring = merge(i, stop - size(self%stop), group == "ring")
      if (ring > 0) then
         call find_ring_rows(along_x, along_y, self%bodies, input, group, i, error)
         if (allocated(error)) return
         call input%get("ring", ring, "offset", offset)
         ! In this order what rubs slides along the push turned clockwise (razy_machine_frame).
         site%w = along_y
         site%frame = frame_t(along_x, 0*along_x, offset([2, 1]))
         site%sides = [.false., .true.]
      else if (group == "stop") then
         site%w = self%stop(i)%w
         site%turns = self%stop(i)%turns
         call read_sides(site%sides, input, i, self%stop(i)%in_plane)
      else if (any(connecting == group)) then
         do k = 1, size(self%link)
            if (self%link(k)%group /= group .or. self%link(k)%number /= i) cycle
            site%w = self%link(k)%w
            site%turns = self%link(k)%turns
            if (self%link(k)%pairs > 1) call input%complain(error, group, i, "between", "one pair where it is not linear")
            return
         end do
      else
         call new_sliding_link(link, self%bodies, self%stop, input, i, stop, error)
         if (allocated(error)) return
         site%w = link%w
         site%turns = link%turns
      end if
   end subroutine find_site

   subroutine draw(self, drawing, input, error)
      class(parts_t), intent(in) :: self
      type(drawing_t), intent(out) :: drawing
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(coordinate_t) :: on
      type(point_t) :: point
      character(:), allocatable :: name
      integer :: i

      call draw_links(drawing, self%bodies, [self%link, self%stop], input)
      do i = 1, input%count("load")
         call self%find_coordinate(on, input, "load", i, "on", error)
         if (allocated(error)) return
         name = on%name(:scan(on%name, ".", back=.true.) - 1)
         if (on%number > 0) name = self%bodies%name(self%bodies%of(on%number))%text
         ! Forces as arrows; a moment has no direction.
         if (.not. known_point(self%bodies, name, point)) cycle
         call drawing%add("load "//to_text(i), element_load, [point%body, 0], point%place, point%place, &
                          matmul(self%bodies%shift, on%row))
      end do
      call draw_exciters(drawing, self%bodies, input, error)
   end subroutine draw

end module razy_scenes_parts_scene
