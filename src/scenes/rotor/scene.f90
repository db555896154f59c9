!! The scene `rotor`: shafts by finite elements with disks, bearings and gear meshes (source thesis, 4.2).
!!
!! The machine has the coordinates of `&reduction`, or those of all nodes, and at the speed Omega of `&rotation` the matrices
!! B + Bx + Omega G and K + Kx + Omega C as far as `&rotation` asks for G and C. Meshes are contacts, not in its B and K.
module razy_scenes_rotor_scene
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_text, only: append_text, lower
   use razy_core_number, only: to_text
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: symmetric_part
   use razy_linalg_speed_table, only: of_stiffness
   use razy_machine_by_speed, only: by_speed_t
   use razy_machine_machine, only: machine_t
   use razy_rotor_free_motions, only: find_rotor_motions
   use razy_rotor_model, only: new_rotor_model, rotor_model_t
   use razy_rotor_numbering, only: coordinate_names
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_rotor, only: rotor_t
   use razy_scenes_connections, only: coefficients, connecting, find_connection
   use razy_scenes_contacts, only: contacts_of, read_contacts
   use razy_scenes_gears, only: read_gear_mesh
   use razy_scenes_harmonics, only: add_harmonics, harmonics_t, new_harmonics, read_rotation, take_harmonics
   use razy_scenes_loads, only: add_loads
   use razy_scenes_rotor_bearings, only: check_tables
   use razy_scenes_rotor_parts, only: read_parts
   use razy_scenes_rotor_places, only: find_named
   use razy_scenes_rotor_rolling, only: add_elements, elements_of
   use razy_scenes_rotor_reduction, only: is_reduced, reduce
   use razy_scenes_rotor_schema, only: rotor_schema
   use razy_scenes_rotor_stops, only: find_rotor_site
   use razy_scenes_scene, only: beside_structure, coordinate_t, force_t, scene_t, site_t
   use razy_scenes_surrounding, only: note_surrounding
   implicit none(type, external)
   private

   public :: rotor_scene_t

   !> The scene; it keeps the model of the machine that was built last.
   type, extends(scene_t) :: rotor_scene_t
      !> Allocatable: of components of one type below a polymorphic object gfortran 12 frees only the first.
      type(rotor_model_t), allocatable :: model
      type(reduced_t) :: reduced
      !> Speeds of the shafts over that of `&rotation`.
      real(qp), allocatable, private :: ratio(:)
      !> Motions without stiffness, and without stiffness and damping (p, r each).
      real(wp), allocatable, private :: free_of_stiffness(:, :), free_of_both(:, :)
      !> Names of the coordinates (p), units of displacement and velocity (p).
      character(64), allocatable, private :: coordinate(:)
      character(16), allocatable, private :: unit(:), rate_unit(:)
   contains
      procedure, nopass :: schema => rotor_schema
      procedure :: build_model
      procedure :: build
      procedure :: new_structure
      procedure :: find_coordinate
      procedure :: find_site
      procedure :: find_force
   end type rotor_scene_t

   !> Beyond, fewer than six digits of the lowest frequencies are right.
   real(wp), parameter :: stiffest_bearing = 1.0e6_wp

contains

   !> Assemble the unreduced model; `one_by_one`: without the rolling elements that have clearance, else with their stiffness at a
   !> load.
   subroutine build_model(self, input, one_by_one, error)
      class(rotor_scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      logical, intent(in) :: one_by_one
      type(error_t), allocatable, intent(out) :: error

      type(rotor_t) :: rotor

      call read_parts(rotor, self%ratio, input, one_by_one, error)
      if (.not. allocated(self%model)) allocate (self%model)
      if (.not. allocated(error)) call new_rotor_model(self%model, rotor, error)
      if (allocated(error)) return
      if (self%model%numbering%n == 0) call input%complain(error, "support", 1, "held", "not all coordinates there are")
      if (.not. allocated(error)) call check_bearings(self%model, input, error)
   end subroutine build_model

   !> Refuse a bearing so stiff that the shafts' own stiffness is lost in the rounding of sums with it.
   subroutine check_bearings(model, input, error)
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: key
      real(wp) :: shaft(model%numbering%n), stiffest
      integer :: at(6), bearings, j, k

      bearings = input%count("bearing")
      shaft = model%shaft_stiffness%diagonal()
      do j = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(j))
            at = model%numbering%of(bearing%shaft, bearing%node)
            if (model%rotor%shaft(bearing%shaft)%rigid) cycle
            do k = 1, 6
               if (at(k) == 0) cycle
               stiffest = bearing%stiffness(k, k)
               if (allocated(bearing%table)) stiffest = max(stiffest, maxval(bearing%table%value(of_stiffness, :)))
               if (stiffest <= stiffest_bearing*shaft(at(k))) cycle
               key = "radial_stiffness"
               if (input%given("bearing", j, "stiffness")) key = "stiffness"
               if (allocated(bearing%table)) key = "file"
               if (j > bearings) key = "stiffness"
               call input%complain(error, trim(merge("spring ", "bearing", j > bearings)), &
                                   merge(j - bearings, j, j > bearings), key, &
                                   "at most 1e6 times that of the shaft at the node; hold the node by &support instead")
               return
            end do
         end associate
      end do
   end subroutine check_bearings

   subroutine build(self, machine, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      integer :: i, meshes, n

      call self%renew(input, [beside_structure, "stop    "], error)
      if (.not. allocated(error)) call check_tables(self%model%rotor, input, "rotation", "speed_rpm", error)
      if (allocated(error)) return
      n = size(self%reduced%load)
      machine%coordinate = self%coordinate
      machine%unit = self%unit
      machine%rate_unit = self%rate_unit
      call input%get("scene", 1, "title", machine%title)
      call take_matrices(machine, self%reduced, input)
      machine%free_of_stiffness = self%free_of_stiffness
      machine%free_of_both = self%free_of_both
      meshes = size(self%model%rotor%mesh)
      allocate (machine%contact(meshes + contacts_of(input) + elements_of(input)))
      call new_harmonics(harmonics, n + 2*size(machine%contact), input)
      do i = 1, meshes
         call read_gear_mesh(machine%contact(i), input, i, self%reduced%mesh_direction(:, i), &
                             self%ratio(self%model%rotor%mesh(i)%shaft(1)), "a shaft that meshes", harmonics, &
                             [n + i, n + size(machine%contact) + i], error)
         if (allocated(error)) return
      end do
      call read_contacts(machine, self, meshes, input, harmonics, error)
      if (.not. allocated(error)) call add_elements(machine, self%model, self%reduced%basis, self%ratio, input, harmonics, error)
      if (.not. allocated(error)) call add_loads(self, input, harmonics, error)
      if (.not. allocated(error)) call add_unbalance(self%model, self%reduced, self%ratio, input, harmonics, error)
      if (allocated(error)) return
      call take_harmonics(machine, harmonics)
      call note_surrounding(machine, input)
      if (allocated(self%reduced%caution)) call append_text(machine%caution, self%reduced%caution)
   end subroutine build

   !> Model and reduction.
   subroutine new_structure(self, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      logical :: circulatory, gyroscopic

      call self%build_model(input, .true., error)
      if (.not. allocated(error)) call reduce(self%reduced, self%model, input, error)
      if (allocated(error)) return
      call make_symmetric(self%reduced)
      call name_coordinates(self, self%model, self%reduced)
      circulatory = .false.
      gyroscopic = .false.
      if (input%count("rotation") > 0) then
         call input%get("rotation", 1, "gyroscopic", gyroscopic)
         call input%get("rotation", 1, "circulatory", circulatory)
      end if
      call find_rotor_motions(self%model, self%reduced, gyroscopic, circulatory, self%free_of_stiffness, self%free_of_both)
   end subroutine new_structure

   !> What is symmetric is so to the last bit, what is skew, too.
   subroutine make_symmetric(reduced)
      type(reduced_t), intent(inout) :: reduced

      reduced%mass = symmetric_part(reduced%mass)
      reduced%damping = symmetric_part(reduced%damping)
      reduced%stiffness = symmetric_part(reduced%stiffness)
      reduced%cross_damping = 0.5_wp*(reduced%cross_damping - transpose(reduced%cross_damping))
      reduced%cross_stiffness = 0.5_wp*(reduced%cross_stiffness - transpose(reduced%cross_stiffness))
      reduced%gyroscopic = 0.5_wp*(reduced%gyroscopic - transpose(reduced%gyroscopic))
   end subroutine make_symmetric

   subroutine name_coordinates(self, model, reduced)
      class(rotor_scene_t), intent(inout) :: self
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced

      integer :: i, n

      n = size(reduced%load)
      if (allocated(self%coordinate)) deallocate (self%coordinate, self%unit, self%rate_unit)
      allocate (self%coordinate(n), self%unit(n), self%rate_unit(n))
      do i = 1, n
         if (.not. allocated(reduced%own)) then
            self%coordinate(i) = "reduced."//to_text(i)
            self%unit(i) = "1"
            self%rate_unit(i) = "1/s"
         else
            self%coordinate(i) = model%numbering%name(model%rotor, reduced%own(i))
            self%unit(i) = merge("rad", "m  ", model%numbering%kind(reduced%own(i)) > 3)
            self%rate_unit(i) = trim(self%unit(i))//"/s"
         end if
      end do
   end subroutine name_coordinates

   !> M, B + Bx + Omega G, K + Kx + Omega C.
   subroutine take_matrices(machine, reduced, input)
      type(machine_t), intent(inout) :: machine
      type(reduced_t), intent(in) :: reduced
      type(input_t), intent(in) :: input

      logical :: circulatory, gyroscopic
      real(wp) :: acceleration, speed

      machine%mass = reduced%mass
      machine%damping = reduced%damping + reduced%cross_damping
      machine%stiffness = reduced%stiffness + reduced%cross_stiffness
      machine%load = reduced%load
      call read_rotation(speed, acceleration, input)
      call input%get("rotation", 1, "gyroscopic", gyroscopic)
      call input%get("rotation", 1, "circulatory", circulatory)
      speed = speed*pi/30
      if (gyroscopic) machine%damping = machine%damping + speed*reduced%gyroscopic
      if (circulatory) machine%stiffness = machine%stiffness + speed*reduced%circulatory
      if ((gyroscopic .or. circulatory .or. size(reduced%tabled) > 0) .and. abs(acceleration) > 0.0_wp) then
         machine%by_speed = by_speed_t(speed, merge(1.0_wp, 0.0_wp, circulatory)*reduced%circulatory, &
                                       merge(1.0_wp, 0.0_wp, gyroscopic)*reduced%gyroscopic, reduced%tabled)
      end if
      if (size(reduced%tabled) == 0) return
      machine%damping = machine%damping + reduced%bearing_change(speed, .true., .false., .true.)
      machine%stiffness = machine%stiffness + reduced%bearing_change(speed, .false., .false., .true.)
   end subroutine take_matrices

   !> A coordinate of the model, moved by those of the machine.
   subroutine find_coordinate(self, coordinate, input, group, i, key, error)
      class(rotor_scene_t), intent(in) :: self
      type(coordinate_t), intent(out) :: coordinate
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      integer :: at(6), node, shaft, which

      associate (model => self%model)
         if (is_reduced(input) .and. group == "initial") then
            call input%complain(error, group, i, key, "no &initial with &reduction: leave one of the two out")
         else if (.not. input%given(group, i, key)) then
            call input%complain(error, group, i, key, "required: a coordinate such as '"// &
                                trim(model%numbering%name(model%rotor, 1))//"'")
         else
            call find_named(model%rotor, input, group, i, key, shaft, node, which, error)
         end if
         if (allocated(error)) return
         call input%get(group, i, key, coordinate%name)
         at = model%numbering%of(shaft, node)
         coordinate%number = 0
         coordinate%turns = which > 3
         if (at(which) == 0) then
            call input%complain(error, group, i, key, "a coordinate that is neither held by a &support nor left out by &freedom")
         else if (group /= "record" .and. .not. model%have_mass([at(which)])) then
            call input%complain(error, group, i, key, "a coordinate with mass or inertia, such as a &disk gives the node")
         else
            if (allocated(self%reduced%own)) coordinate%number = findloc(self%reduced%own, at(which), dim=1)
            coordinate%row = self%reduced%basis(at(which), :)
         end if
      end associate
   end subroutine find_coordinate

   !> One of the six components of the force by which a node pushes its bearing.
   subroutine find_force(self, force, input, i, name, error)
      class(rotor_scene_t), intent(in) :: self
      type(force_t), intent(out) :: force
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error

      type(site_t) :: site
      real(wp) :: acceleration, rows(6, size(self%reduced%load)), speed, stiffness(6, 6), damping(6, 6)
      integer :: dot, group, k, number, which

      call find_connection(input, i, connecting, name, group, number, error)
      if (group <= size(connecting)) then
         if (.not. allocated(error)) call self%find_site(site, input, connecting(group), number, 0, error)
         if (allocated(error)) return
         call coefficients(input, connecting(group), number, stiffness(1, 1), damping(1, 1))
         force = force_t(stiffness(1, 1)*site%w, damping(1, 1)*site%w, site%turns)
         return
      end if
      deallocate (error)
      dot = index(name, ".", back=.true.)
      which = findloc(coordinate_names, lower(name(dot + 1:)), dim=1)
      if (dot < 2 .or. which == 0) then
         call input%complain(error, "record", i, "of", "a spring or damper, or a bearing and one of u, v, w, phi, "// &
                             "theta, psi, such as 'front.v'")
         return
      end if
      call find_connection(input, i, ["bearing"], name(:dot - 1), group, number, error)
      if (.not. allocated(error) .and. input%given("bearing", number, "clearance")) then
         call input%complain(error, "record", i, "observable", "'contact_force' of a rolling element such as '"// &
                             name(:dot)//"1', as the bearing has clearance")
      end if
      if (allocated(error)) return
      associate (bearing => self%model%rotor%bearing(number))
         call read_rotation(speed, acceleration, input)
         if (allocated(bearing%table) .and. abs(acceleration) > 0.0_wp) then
            call input%complain(error, "record", i, "of", "a bearing without a table, whose coefficients change in a run-up")
            return
         end if
         do k = 1, size(rows, 2)
            rows(:, k) = self%model%numbering%stretch(bearing, self%reduced%basis(:, k))
         end do
         call bearing%coefficients(real(self%ratio(bearing%shaft), wp)*speed*pi/30, stiffness, damping)
      end associate
      force%on_displacement = matmul(stiffness(which, :), rows)
      force%on_velocity = matmul(damping(which, :), rows)
      force%turns = which > 3
   end subroutine find_force

   subroutine find_site(self, site, input, group, i, stop, error)
      class(rotor_scene_t), intent(in) :: self
      type(site_t), intent(out) :: site
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, stop
      type(error_t), allocatable, intent(out) :: error

      call find_rotor_site(site, self%model, self%reduced%basis, self%ratio, input, group, i, stop, error)
   end subroutine find_site

   !> Unbalance of the shafts, each at its own speed: the force -d²/dt² Re(U e^(iφ)), Re(U omega² e^(i omega t)) at a constant one.
   subroutine add_unbalance(model, reduced, ratio, input, harmonics, error)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      integer :: i, s

      if (input%count("unbalance") > 0 .and. input%count("rotation") == 0) then
         call input%complain(error, "unbalance", 1, "moment", "an unbalance needs &rotation")
      end if
      if (allocated(error)) return
      i = findloc(model%rotor%shaft(model%rotor%unbalance%shaft)%speed_known, .false., dim=1)
      if (i > 0) call input%complain(error, "unbalance", i, "shaft", "a shaft whose speed is known, from teeth or speed_ratio")
      if (allocated(error)) return
      do s = 1, size(ratio)
         associate (unbalance => reduced%unbalance(:, s))
            call add_harmonics(harmonics, harmonics%of_order(ratio(s)), unbalance%re, -unbalance%im, unbalance=.true.)
         end associate
      end do
   end subroutine add_unbalance

end module razy_scenes_rotor_scene
