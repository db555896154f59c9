!! The scene `planar`: rigid bodies in a plane with springs, dampers and one-way stops between points (source thesis, 4.3).
!!
!! Motion is small: geometry is that of the reference position. A stop in direction n pushes its first point along n with
!! the force of its law, such as max(0, k p + b p'), where p = -(s + clearance) and s = n·(u1 - u2) is the
!! displacement of the first point against the second. Friction in direction t acts against s' = t·(u1' - u2') - belt speed; both of
!! its forces act at the place of the first point.
module razy_scenes_planar_scene
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_input_schema, only: group_spec_t
   use razy_core_text, only: lower
   use razy_machine_machine, only: contact_t, machine_t, observable_t
   use razy_scenes_friction, only: read_friction, stop_of
   use razy_scenes_gap_laws, only: read_gap_law
   use razy_scenes_harmonics, only: harmonics_t, new_harmonics, take_harmonics
   use razy_scenes_observables, only: begin_observable, name_observable, observe_contacts, observe_coordinate
   use razy_scenes_planar_bodies, only: bodies_t, coordinate_names, find_coordinate, new_bodies
   use razy_scenes_planar_drawing, only: draw_planar
   use razy_scenes_planar_excitation, only: add_exciters, add_gravity, add_loads
   use razy_scenes_planar_links, only: link_t, new_link, new_sliding_link, pair_count
   use razy_scenes_planar_schema, only: matrix_all, matrix_untuned, planar_schema
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: planar_t

   !> The scene; it keeps the bodies of the machine that was built last.
   type, extends(scene_t) :: planar_t
      type(bodies_t) :: bodies
   contains
      procedure, nopass :: schema
      procedure :: build
      procedure :: new_observable
      procedure :: set_initial
      procedure :: draw
   end type planar_t

contains

   function schema() result(groups)
      type(group_spec_t), allocatable :: groups(:)

      groups = planar_schema()
   end function schema

   subroutine build(self, machine, input, error)
      class(planar_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      integer :: i, n, stops

      call new_bodies(self%bodies, input, error)
      if (allocated(error)) return
      n = 3*self%bodies%count
      call begin_machine(machine, self%bodies, input)
      stops = input%count("stop")
      allocate (machine%contact(stops + input%count("friction")))
      do i = 1, size(machine%contact)
         if (i <= stops) then
            call new_stop(machine%contact(i), self%bodies, input, i, error)
         else
            call new_friction(machine%contact(i), machine%contact(:stops), self%bodies, input, i - stops, error)
         end if
         if (allocated(error)) return
      end do
      call add_connections(machine, self%bodies, input, error)
      if (allocated(error)) return
      call new_harmonics(harmonics, n + size(machine%contact))
      call add_loads(machine%load, self%bodies, input, harmonics, error)
      if (.not. allocated(error)) call add_gravity(machine%load, self%bodies, input, error)
      if (.not. allocated(error)) call add_exciters(self%bodies, input, harmonics, error)
      if (allocated(error)) return
      call take_harmonics(machine, harmonics)
   end subroutine build

   !> Coordinates and masses; the other matrices are zero.
   subroutine begin_machine(machine, bodies, input)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input

      integer :: b, i, n

      n = 3*bodies%count
      call input%get("scene", 1, "title", machine%title)
      allocate (machine%coordinate(n), machine%unit(n), machine%rate_unit(n))
      associate (names => coordinate_names(bodies))
         do i = 1, n
            machine%coordinate(i) = names(i)%text
            machine%unit(i) = merge("rad", "m  ", modulo(i, 3) == 0)
            machine%rate_unit(i) = merge("rad/s", "m/s  ", modulo(i, 3) == 0)
         end do
      end associate
      allocate (machine%mass(n, n), machine%damping(n, n), machine%stiffness(n, n), machine%load(n), source=0.0_wp)
      do b = 1, bodies%count
         machine%mass(3*b - 2, 3*b - 2) = bodies%mass(b)
         machine%mass(3*b - 1, 3*b - 1) = bodies%mass(b)
         machine%mass(3*b, 3*b) = bodies%inertia(b)
      end do
   end subroutine begin_machine

   subroutine new_stop(contact, bodies, input, i, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link
      real(wp) :: clearance, factor

      call new_link(link, bodies, input, "stop", i, 1, error)
      if (allocated(error)) return
      call input%get("stop", i, "name", contact%name)
      call input%get("stop", i, "clearance", clearance)
      factor = 0.0_wp
      if (input%given("stop", i, "damping_factor")) call input%get("stop", i, "damping_factor", factor)
      contact%w = link%w
      contact%unit = "m"
      contact%force_unit = "N"
      contact%force_sign = -1.0_wp
      call read_gap_law(contact%law, input, "stop", i, [.true., .false.], [-clearance, clearance], .false., error, factor)
   end subroutine new_stop

   !> Friction element i; `stops` are the stops, which are the first contacts of the machine.
   subroutine new_friction(contact, stops, bodies, input, i, error)
      type(contact_t), intent(out) :: contact
      type(contact_t), intent(in) :: stops(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link

      call input%get("friction", i, "name", contact%name)
      call read_friction(contact, stops, 1, input, i, error)
      if (.not. allocated(error)) call new_sliding_link(link, bodies, input, i, stop_of(contact, 1), error)
      if (allocated(error)) return
      contact%w = link%w
      contact%unit = "m"
      contact%force_unit = "N"
   end subroutine new_friction

   !> Springs, dampers and proportional damping into K and B.
   subroutine add_connections(machine, bodies, input, error)
      type(machine_t), intent(inout) :: machine
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: proportional(:, :)
      character(:), allocatable :: law, matrix
      real(wp) :: damping, factor, stiffness, untuned
      integer :: i

      allocate (proportional, mold=machine%stiffness)
      proportional(:, :) = 0.0_wp
      call input%get("damping", 1, "matrix", matrix)
      do i = 1, input%count("spring")
         call input%get("spring", i, "stiffness", stiffness)
         call input%get("spring", i, "damping", damping)
         untuned = stiffness
         if (lower(matrix) == matrix_untuned .and. input%given("spring", i, "untuned_stiffness")) then
            call input%get("spring", i, "untuned_stiffness", untuned)
         end if
         call connect(machine%stiffness, bodies, input, "spring", i, stiffness, error)
         if (.not. allocated(error)) call connect(machine%damping, bodies, input, "spring", i, damping, error)
         if (.not. allocated(error)) call connect(proportional, bodies, input, "spring", i, untuned, error)
         if (allocated(error)) return
      end do
      do i = 1, input%count("damper")
         call input%get("damper", i, "damping", damping)
         call connect(machine%damping, bodies, input, "damper", i, damping, error)
         if (allocated(error)) return
      end do
      if (input%count("damping") == 0) return
      if (lower(matrix) == matrix_all) then
         do i = 1, input%count("stop")
            call input%get("stop", i, "law", law)
            if (lower(law) /= "kelvin_voigt") then
               call input%complain(error, "damping", 1, "matrix", "'springs' or 'untuned' where a stop has a law that is no spring")
               return
            end if
            call input%get("stop", i, "stiffness", stiffness)
            call connect(proportional, bodies, input, "stop", i, stiffness, error)
            if (allocated(error)) return
         end do
      end if
      call input%get("damping", 1, "factor", factor)
      machine%damping = machine%damping + factor*proportional
   end subroutine add_connections

   !> Add value w wᵀ to a matrix, shared by all pairs of a group.
   subroutine connect(matrix, bodies, input, group, index, value, error)
      real(wp), intent(inout) :: matrix(:, :)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      real(wp), intent(in) :: value
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: link
      integer :: k, pair, pairs

      call pair_count(input, group, index, pairs, error)
      do pair = 1, pairs
         if (allocated(error)) return
         call new_link(link, bodies, input, group, index, pair, error)
         if (allocated(error)) return
         do k = 1, size(matrix, 1)
            matrix(:, k) = matrix(:, k) + value/pairs*link%w*link%w(k)
         end do
      end do
   end subroutine connect

   subroutine new_observable(self, observable, machine, input, i, error)
      class(planar_t), intent(in) :: self
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: row(:)
      logical :: taken, turns
      integer :: coordinate

      call begin_observable(observable, machine, input, i)
      call observe_contacts(observable, machine, input, i, 0, input%count("stop"), taken, error)
      if (allocated(error)) return
      if (.not. taken .and. .not. input%given("record", i, "of")) then
         call input%complain(error, "record", i, "of", "required: a coordinate such as '"//trim(machine%coordinate(1))// &
                             "', or a point of a body with .x or .y")
      else if (.not. taken) then
         call find_coordinate(self%bodies, input, "record", i, "of", row, turns, coordinate, error)
         if (allocated(error)) return
         call observe_coordinate(observable, row, turns, input, i)
      end if
      if (.not. allocated(error)) call name_observable(observable, input, i)
   end subroutine new_observable

   subroutine set_initial(self, machine, input, error)
      class(planar_t), intent(in) :: self
      type(machine_t), intent(inout) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: row(:)
      logical :: turns
      integer :: coordinate, i

      do i = 1, input%count("initial")
         call find_coordinate(self%bodies, input, "initial", i, "on", row, turns, coordinate, error)
         if (allocated(error)) return
         if (coordinate == 0) then
            call input%complain(error, "initial", i, "on", "a coordinate such as '"//trim(machine%coordinate(1))//"', not a point")
            return
         end if
         call input%get("initial", i, "displacement", machine%displacement(coordinate))
         call input%get("initial", i, "velocity", machine%velocity(coordinate))
      end do
   end subroutine set_initial

   subroutine draw(self, drawing, input, error)
      class(planar_t), intent(in) :: self
      type(drawing_t), intent(out) :: drawing
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call draw_planar(drawing, self%bodies, input, error)
   end subroutine draw

end module razy_scenes_planar_scene
