!! The scene `rotor`: shafts by finite elements with disks, bearings and gear meshes (source thesis, 4.2).
!!
!! The machine has the coordinates of `&reduction`, or those of all nodes, and at the speed Omega of `&rotation` the matrices
!! B + Bx + Omega G and K + Kx + Omega C as far as `&rotation` asks for G and C. Meshes are contacts, not in its B and K.
module razy_scenes_rotor_scene
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_number, only: to_text
   use razy_input_schema, only: group_spec_t
   use razy_machine_machine, only: machine_t, observable_t
   use razy_rotor_model, only: new_rotor_model, rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_rotor, only: rotor_t
   use razy_scenes_harmonics, only: harmonics_t, new_harmonics, take_harmonics
   use razy_scenes_observables, only: begin_observable, name_observable, observe_contacts, observe_coordinate
   use razy_scenes_rotor_loads, only: add_loads, add_unbalance, find_row
   use razy_scenes_rotor_meshes, only: find_ratios, new_contact, read_meshes
   use razy_scenes_rotor_parts, only: read_parts
   use razy_scenes_rotor_reduction, only: is_reduced, reduce
   use razy_scenes_rotor_schema, only: rotor_schema
   use razy_scenes_rotor_signature, only: signature
   use razy_scenes_rotor_stops, only: new_rotor_friction, new_rotor_stop
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: rotor_scene_t

   !> The scene; it keeps the model of the machine that was built last.
   type, extends(scene_t) :: rotor_scene_t
      type(rotor_model_t) :: model
      type(reduced_t) :: reduced
      !> Speeds of the shafts over that of `&rotation`.
      real(qp), allocatable :: ratio(:)
      !> What model and reduction were made of; not allocated before they are.
      character(:), allocatable :: made_of
   contains
      procedure, nopass :: schema
      procedure :: build_model
      procedure :: build_reduced
      procedure :: build
      procedure :: new_observable
      procedure :: set_initial
   end type rotor_scene_t

contains

   function schema() result(groups)
      type(group_spec_t), allocatable :: groups(:)

      groups = rotor_schema()
   end function schema

   !> Assemble the unreduced model.
   subroutine build_model(self, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(rotor_t) :: rotor

      call read_parts(rotor, input, error)
      if (.not. allocated(error)) call read_meshes(rotor, input, error)
      if (.not. allocated(error)) call find_ratios(self%ratio, rotor, input, error)
      if (.not. allocated(error)) call new_rotor_model(self%model, rotor, error)
      if (allocated(error)) return
      if (self%model%numbering%n == 0) call input%complain(error, "support", 1, "held", "not all coordinates there are")
   end subroutine build_model

   !> Reduce it, after `build_model`.
   subroutine build_reduced(self, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call reduce(self%reduced, self%model, input, error)
   end subroutine build_reduced

   subroutine build(self, machine, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(harmonics_t) :: harmonics
      integer :: i, meshes, n, stops

      call renew_model(self, input, error)
      if (allocated(error)) return
      n = size(self%reduced%load)
      call name_coordinates(machine, self%model, n, is_reduced(input))
      call input%get("scene", 1, "title", machine%title)
      call take_matrices(machine, self%reduced, input)
      meshes = size(self%model%rotor%mesh)
      stops = input%count("stop")
      allocate (machine%contact(meshes + stops + input%count("friction")))
      call new_harmonics(harmonics, n + size(machine%contact))
      do i = 1, size(machine%contact)
         if (i <= meshes) then
            call new_contact(machine%contact(i), input, i, self%reduced%mesh_direction(:, i), &
                             self%ratio(self%model%rotor%mesh(i)%shaft(1)), harmonics, n + i, error)
         else if (i <= meshes + stops) then
            call new_rotor_stop(machine%contact(i), self%model, self%reduced%basis, input, i - meshes, error)
         else
            call new_rotor_friction(machine%contact(i), machine%contact(meshes + 1:meshes + stops), meshes + 1, self%model, &
                                    self%reduced%basis, self%ratio, input, i - meshes - stops, error)
         end if
         if (allocated(error)) return
      end do
      call add_loads(machine, self%model, self%reduced, input, harmonics, error)
      if (.not. allocated(error)) call add_unbalance(self%model, self%reduced, self%ratio, input, harmonics, error)
      if (allocated(error)) return
      call take_harmonics(machine, harmonics)
   end subroutine build

   !> Model and reduction, if they are not those of the machine before, as in a sweep over the speed.
   subroutine renew_model(self, input, error)
      class(rotor_scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: wanted

      wanted = signature(input)
      if (allocated(self%made_of)) then
         if (self%made_of == wanted) return
         deallocate (self%made_of)
      end if
      call self%build_model(input, error)
      if (.not. allocated(error)) call self%build_reduced(input, error)
      if (.not. allocated(error)) self%made_of = wanted
   end subroutine renew_model

   subroutine name_coordinates(machine, model, n, reduced)
      type(machine_t), intent(inout) :: machine
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: n
      logical, intent(in) :: reduced

      integer :: i

      allocate (machine%coordinate(n), machine%unit(n), machine%rate_unit(n))
      do i = 1, n
         if (reduced) then
            machine%coordinate(i) = "reduced."//to_text(i)
            machine%unit(i) = "1"
            machine%rate_unit(i) = "1/s"
         else
            machine%coordinate(i) = model%numbering%name(model%rotor, i)
            machine%unit(i) = merge("rad", "m  ", model%numbering%kind(i) > 3)
            machine%rate_unit(i) = trim(machine%unit(i))//"/s"
         end if
      end do
   end subroutine name_coordinates

   !> M, B + Bx + Omega G, K + Kx + Omega C; what is symmetric is so to the last bit.
   subroutine take_matrices(machine, reduced, input)
      type(machine_t), intent(inout) :: machine
      type(reduced_t), intent(in) :: reduced
      type(input_t), intent(in) :: input

      logical :: circulatory, gyroscopic
      real(wp) :: speed

      machine%mass = symmetric(reduced%mass)
      machine%damping = symmetric(reduced%damping)
      machine%stiffness = symmetric(reduced%stiffness)
      machine%damping = machine%damping + 0.5_wp*(reduced%cross_damping - transpose(reduced%cross_damping))
      machine%stiffness = machine%stiffness + 0.5_wp*(reduced%cross_stiffness - transpose(reduced%cross_stiffness))
      allocate (machine%load(size(reduced%load)), source=0.0_wp)
      if (input%count("rotation") == 0) return
      call input%get("rotation", 1, "speed_rpm", speed)
      call input%get("rotation", 1, "gyroscopic", gyroscopic)
      call input%get("rotation", 1, "circulatory", circulatory)
      speed = speed*pi/30
      if (gyroscopic) machine%damping = machine%damping + speed*0.5_wp*(reduced%gyroscopic - transpose(reduced%gyroscopic))
      if (circulatory) machine%stiffness = machine%stiffness + speed*reduced%circulatory
   end subroutine take_matrices

   pure function symmetric(matrix)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), allocatable :: symmetric(:, :)

      symmetric = 0.5_wp*(matrix + transpose(matrix))
   end function symmetric

   subroutine new_observable(self, observable, machine, input, i, error)
      class(rotor_scene_t), intent(in) :: self
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: row(:)
      logical :: taken
      integer :: at

      call begin_observable(observable, machine, input, i)
      call observe_contacts(observable, machine, input, i, size(self%model%rotor%mesh), input%count("stop"), taken, error)
      if (allocated(error)) return
      if (.not. taken .and. .not. input%given("record", i, "of")) then
         call input%complain(error, "record", i, "of", "required: a coordinate such as '"// &
                             trim(self%model%numbering%name(self%model%rotor, 1))//"'")
      else if (.not. taken) then
         call find_row(self%model, self%reduced, input, "record", i, "of", row, at, error)
         if (allocated(error)) return
         call observe_coordinate(observable, row, self%model%numbering%kind(at) > 3, input, i)
      end if
      if (.not. allocated(error)) call name_observable(observable, input, i)
   end subroutine new_observable

   subroutine set_initial(self, machine, input, error)
      class(rotor_scene_t), intent(in) :: self
      type(machine_t), intent(inout) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: row(:)
      integer :: at, i

      do i = 1, input%count("initial")
         if (is_reduced(input)) then
            call input%complain(error, "initial", i, "on", "no &initial with &reduction: leave one of the two out")
            return
         end if
         call find_row(self%model, self%reduced, input, "initial", i, "on", row, at, error)
         if (allocated(error)) return
         call input%get("initial", i, "displacement", machine%displacement(at))
         call input%get("initial", i, "velocity", machine%velocity(at))
      end do
   end subroutine set_initial

end module razy_scenes_rotor_scene
