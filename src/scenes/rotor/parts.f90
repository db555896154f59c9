!! What a rotor scene consists of, from its groups: shafts with their sections, disks, supports, bearings and gear meshes, and the
!! speeds of the shafts.
module razy_scenes_rotor_parts
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: position_of, string_t, texts_of
   use razy_input_input, only: input_t
   use razy_rotor_bearing, only: bearing_t
   use razy_rotor_rotor, only: check_layers, damping_nodal, damping_none, longest_name, rotor_t
   use razy_rotor_section, only: material_t, section_t, shear_cowper, shear_none
   use razy_scenes_connections, only: connecting, unit_direction
   use razy_scenes_gears, only: join_meshes
   use razy_scenes_rotor_bearings, only: read_bearing, read_spring
   use razy_scenes_rotor_places, only: find_ends, find_node, find_shaft
   use razy_scenes_rotor_schema, only: coordinate_choices, damping_choices
   use razy_scenes_tables, only: check_springs
   implicit none(type, external)
   private

   public :: read_parts

   !> Groups of rigid bodies, which come after the shafts.
   character(*), parameter :: rigid(3) = [character(7) :: "housing", "inertia", "mass"]

contains

   !> All parts but loads, and the speeds of all shafts over that of `&rotation`; 0 where nothing says what it is. `one_by_one`:
   !> rolling elements with clearance are left to contacts.
   subroutine read_parts(rotor, ratio, input, one_by_one, error)
      type(rotor_t), intent(out) :: rotor
      real(qp), allocatable, intent(out) :: ratio(:)
      type(input_t), intent(in) :: input
      logical, intent(in) :: one_by_one
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: joining(3) = [character(7) :: "bearing", connecting]
      type(bearing_t) :: bearing
      integer :: bodies, group, i

      call check_springs(input, error)
      if (allocated(error)) return
      bodies = sum([(input%count(trim(rigid(i))), i=1, size(rigid))])
      allocate (rotor%shaft(input%count("shaft") + bodies), rotor%bearing(0), rotor%disk(input%count("disk") + bodies))
      allocate (rotor%support(input%count("support") + bodies), rotor%mesh(input%count("gear_mesh")))
      allocate (rotor%unbalance(input%count("unbalance")))
      if (input%count("shaft") == 0) call input%complain(error, "scene", 1, "kind", "a rotor scene needs at least one &shaft")
      if (allocated(error)) return
      call input%get("freedom", 1, "axial", rotor%axial)
      call input%get("freedom", 1, "bending", rotor%bending)
      call input%get("freedom", 1, "torsion", rotor%torsion)
      if (.not. (rotor%axial .or. rotor%bending .or. rotor%torsion)) then
         call input%complain(error, "freedom", 1, "torsion", "at least one of axial, bending and torsion")
         return
      end if
      call read_housings(rotor, input, error)
      if (.not. allocated(error)) call read_shafts(rotor, input, error)
      if (.not. allocated(error)) call read_gravity(rotor%gravity, input, error)
      if (.not. allocated(error)) call read_disks(rotor, input, error)
      if (allocated(error)) return
      do group = 1, size(joining)
         do i = 1, input%count(trim(joining(group)))
            if (joining(group) == "bearing") call read_bearing(bearing, rotor, input, i, one_by_one, error)
            if (joining(group) /= "bearing") call read_spring(bearing, rotor, input, trim(joining(group)), i, error)
            if (allocated(error)) return
            rotor%bearing = [rotor%bearing, bearing]
         end do
      end do
      call read_meshes(rotor, input, error)
      if (.not. allocated(error)) call find_ratios(ratio, rotor, input, error)
   end subroutine read_parts

   !> Rigid bodies, their masses, after the disks, and what holds them where they do not move.
   subroutine read_housings(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: text
      real(wp), allocatable :: inertia(:)
      real(wp) :: direction(3)
      logical :: exists(6)
      integer :: g, i, n

      n = 0
      do g = 1, size(rigid)
         do i = 1, input%count(trim(rigid(g)))
            n = n + 1
            call input%get(trim(rigid(g)), i, "name", text)
            if (len(text) > longest_name) call input%complain(error, trim(rigid(g)), i, "name", "a name of at most 40 characters")
            if (allocated(error)) return
            associate (housing => rotor%shaft(input%count("shaft") + n), mass => rotor%disk(input%count("disk") + n), &
                       support => rotor%support(input%count("support") + n))
               housing%name = text
               housing%rigid = .true.
               allocate (housing%section(0))
               mass%shaft = input%count("shaft") + n
               mass%node = 1
               support%shaft = mass%shaft
               support%node = 1
               select case (rigid(g))
               case ("housing")
                  call input%get("housing", i, "turns", housing%turns)
                  call input%get("housing", i, "inertia", inertia)
                  mass%polar = inertia(1)
                  mass%diametral = inertia(2)
                  ! What has no inertia does not move.
                  support%fixed(4:) = .not. inertia([1, 2, 2]) > 0.0_wp
                  call input%get("housing", i, "mass", mass%mass)
               case ("inertia")
                  housing%turns = .true.
                  support%fixed = [.true., .true., .true., .false., .true., .true.]
                  call input%get("inertia", i, "value", mass%polar)
               case default
                  direction = [0.0_wp, 1.0_wp, 0.0_wp]
                  call unit_direction(input, "mass", i, direction, error)
                  support%fixed = [abs(direction) < 1.0_wp, .true., .true., .true.]
                  call input%get("mass", i, "value", mass%mass)
                  if (count(support%fixed) /= 5 .and. .not. allocated(error)) then
                     call input%complain(error, "mass", i, "direction", "that of x, y or z beside shafts")
                  end if
               end select
               if (allocated(error)) return
               exists = [rotor%axial, rotor%bending, rotor%bending, rotor%torsion, rotor%bending, rotor%bending]
               if (rigid(g) /= "housing" .and. .not. any(exists .and. .not. support%fixed)) then
                  call input%complain(error, trim(rigid(g)), i, "name", "a body with a motion that &freedom leaves")
                  return
               end if
            end associate
         end do
      end do
   end subroutine read_housings

   subroutine read_gravity(gravity, input, error)
      real(wp), intent(inout) :: gravity(3)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: direction(3)

      if (input%count("gravity") == 0) return
      direction = [0.0_wp, -1.0_wp, 0.0_wp]
      call unit_direction(input, "gravity", 1, direction, error)
      gravity = input%number("gravity", 1, "acceleration")*direction
   end subroutine read_gravity

   subroutine read_shafts(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(material_t), allocatable :: material(:)
      type(section_t) :: last, section
      character(:), allocatable :: text
      integer :: culprit, i, kind, owner(input%count("section")), s
      integer, allocatable :: own(:)

      allocate (material(size(rotor%shaft)))
      do s = 1, input%count("shaft")
         call input%get("shaft", s, "name", text)
         if (len(text) > longest_name) call input%complain(error, "shaft", s, "name", "a name of at most 40 characters")
         if (allocated(error)) return
         allocate (rotor%shaft(s)%section(0))
         rotor%shaft(s)%name = text
         call read_material(material(s), input, s, error)
         if (allocated(error)) return
         rotor%shaft(s)%shear = merge(shear_cowper, shear_none, input%choice("shaft", s, "element") == "timoshenko")
         call input%get("shaft", s, "damping_ratio", rotor%shaft(s)%damping_ratio)
         call input%get("shaft", s, "mass_damping", rotor%shaft(s)%mass_damping)
         call input%get("shaft", s, "stiffness_damping", rotor%shaft(s)%stiffness_damping)
         call input%get("shaft", s, "rotary_inertia", rotor%shaft(s)%rotary_inertia)
         if (.not. rotor%shaft(s)%damping_ratio > 0.0_wp) cycle
         kind = damping_nodal - 2 + findloc(damping_choices == input%choice("shaft", s, "damping"), .true., dim=1)
         if (rotor%damping /= damping_none .and. rotor%damping /= kind) then
            call input%complain(error, "shaft", s, "damping", "the same for all shafts with damping")
            return
         end if
         rotor%damping = kind
      end do
      do i = 1, input%count("section")
         call find_shaft(rotor, input, "section", i, "shaft", input%text("section", i, "shaft"), .false., s, error)
         if (allocated(error)) return
         owner(i) = s
         section = section_t(material=material(s))
         call input%get("section", i, "length", section%length)
         call input%get("section", i, "outer_diameter", section%outer)
         call input%get("section", i, "inner_diameter", section%inner)
         call input%get("section", i, "outer_diameter_end", section%outer_end)
         call input%get("section", i, "inner_diameter_end", section%inner_end)
         call input%get("section", i, "elements", section%elements)
         call input%get("section", i, "first_node", section%first_node)
         call input%get("section", i, "axial_force", section%axial_force)
         call input%get("section", i, "torque", section%torque)
         section%fixed = input%choice("section", i, "torque_axis") == "fixed"
         call input%get("section", i, "young_modulus", section%material%young)
         call input%get("section", i, "shear_modulus", section%material%shear)
         call input%get("section", i, "density", section%material%density)
         last = section%slice(1.0_wp)
         if (section%inner >= section%outer .or. last%inner >= last%outer) then
            call input%complain(error, "section", i, trim(merge("inner_diameter_end", "inner_diameter    ", &
                                                                section%inner < section%outer .and. &
                                                                input%given("section", i, "inner_diameter_end"))), &
                                "less than the outer diameter, at both ends")
            return
         end if
         rotor%shaft(s)%section = [rotor%shaft(s)%section, section]
      end do
      do s = 1, input%count("shaft")
         if (.not. any(rotor%shaft(s)%section%first_node == 0)) then
            call input%complain(error, "shaft", s, "name", "the name of a shaft with at least one &section that is no layer")
            return
         end if
         if (rotor%damping /= damping_nodal .and. rotor%shaft(s)%damping_ratio > 0.0_wp &
             .and. .not. all(rotor%shaft(s)%section%material%density > 0.0_wp)) then
            call input%complain(error, "shaft", s, "damping", "'nodal' for a shaft without mass, which has it at its disks")
            return
         end if
         call check_layers(rotor%shaft(s), culprit)
         if (culprit == 0) cycle
         own = pack([(i, i=1, size(owner))], owner == s)
         call input%complain(error, "section", own(culprit), "first_node", "a node from which on the shaft has elements of "// &
                             "the layer's lengths")
         return
      end do
   end subroutine read_shafts

   subroutine read_material(material, input, s, error)
      type(material_t), intent(out) :: material
      type(input_t), intent(in) :: input
      integer, intent(in) :: s
      type(error_t), allocatable, intent(out) :: error

      call input%get("shaft", s, "young_modulus", material%young)
      call input%get("shaft", s, "density", material%density)
      if (input%given("shaft", s, "shear_modulus") .eqv. input%given("shaft", s, "poisson_ratio")) then
         call input%complain(error, "shaft", s, "shear_modulus", "one of shear_modulus and poisson_ratio has to be given")
      else if (input%given("shaft", s, "shear_modulus")) then
         call input%get("shaft", s, "shear_modulus", material%shear)
      else
         material%shear = material%young/(2*(1 + input%number("shaft", s, "poisson_ratio")))
      end if
   end subroutine read_material

   !> Disks, supports and unbalances.
   subroutine read_disks(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: held(:)
      integer :: i, k

      do i = 1, input%count("disk")
         call find_node(rotor, input, "disk", i, rotor%disk(i)%shaft, rotor%disk(i)%node, error)
         if (allocated(error)) return
         call input%get("disk", i, "mass", rotor%disk(i)%mass)
         call input%get("disk", i, "polar_inertia", rotor%disk(i)%polar)
         call input%get("disk", i, "diametral_inertia", rotor%disk(i)%diametral)
         call input%get("disk", i, "offset", rotor%disk(i)%offset)
      end do
      do i = 1, input%count("support")
         call find_node(rotor, input, "support", i, rotor%support(i)%shaft, rotor%support(i)%node, error)
         if (allocated(error)) return
         call input%get("support", i, "held", held)
         rotor%support(i)%fixed = [(position_of(trim(coordinate_choices(k)), held) > 0, k=1, 6)]
      end do
      do i = 1, size(rotor%unbalance)
         call find_node(rotor, input, "unbalance", i, rotor%unbalance(i)%shaft, rotor%unbalance(i)%node, error)
         if (allocated(error)) return
         call input%get("unbalance", i, "moment", rotor%unbalance(i)%moment)
         call input%get("unbalance", i, "angle", rotor%unbalance(i)%angle)
      end do
   end subroutine read_disks

   !> The geometry of all meshes.
   subroutine read_meshes(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: name(:)
      integer, allocatable :: node(:)
      integer :: gear, i

      do i = 1, size(rotor%mesh)
         associate (mesh => rotor%mesh(i))
            if (.not. input%given("gear_mesh", i, "node")) then
               call input%complain(error, "gear_mesh", i, "node", "required: the nodes of the gears on their shafts")
            else if (input%differs("gear_mesh", i, "kind")) then
               call input%complain(error, "gear_mesh", i, "kind", "'external' between shafts")
            end if
            if (allocated(error)) return
            call input%get("gear_mesh", i, "between", name)
            call input%get("gear_mesh", i, "node", node)
            do gear = 1, 2
               call find_shaft(rotor, input, "gear_mesh", i, "between", name(gear)%text, .false., mesh%shaft(gear), &
                               error)
               if (allocated(error)) return
               associate (nodes => rotor%shaft(mesh%shaft(gear))%nodes())
                  if (node(gear) > nodes) call input%complain(error, "gear_mesh", i, "node", "1 to "//to_text(nodes)// &
                                                              " on "//name(gear)%text)
               end associate
               if (allocated(error)) return
            end do
            if (mesh%shaft(1) == mesh%shaft(2)) call input%complain(error, "gear_mesh", i, "between", "two different shafts")
            if (allocated(error)) return
            mesh%node = node
            mesh%radius = input%list("gear_mesh", i, "radius")
            mesh%offset = input%list("gear_mesh", i, "offset")
            call input%get("gear_mesh", i, "pressure_angle", mesh%pressure)
            call input%get("gear_mesh", i, "helix_angle", mesh%helix)
            call input%get("gear_mesh", i, "centre_line", mesh%centre_line)
            mesh%right_handed = input%choice("gear_mesh", i, "hand") == "right"
            mesh%positive_drive = input%choice("gear_mesh", i, "drive") == "positive"
            call input%get("gear_mesh", i, "stiffness", mesh%stiffness)
            call input%get("gear_mesh", i, "damping", mesh%damping)
         end associate
      end do
   end subroutine read_meshes

   !> Speeds of all shafts over that of `&rotation`, also as the shafts' `speed_ratio`; 0 where nothing says what it is.
   subroutine find_ratios(ratio, rotor, input, error)
      real(qp), allocatable, intent(out) :: ratio(:)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: on_angles(3) = [character(6) :: connecting, "stop"]
      integer :: coupled(2, input%count("spring") + input%count("damper") + input%count("stop"))
      integer :: g, i, n, node(2), s

      allocate (ratio(size(rotor%shaft)), source=0.0_qp)
      do s = 1, input%count("shaft")
         ratio(s) = input%number("shaft", s, "speed_ratio", otherwise=0.0_wp)
      end do
      n = 0
      do g = 1, size(on_angles)
         do i = 1, input%count(trim(on_angles(g)))
            n = n + 1
            call find_ends(coupled(:, n), node, rotor, input, trim(on_angles(g)), i, error)
            if (allocated(error)) return
            if (.not. input%truth(trim(on_angles(g)), i, "twist")) coupled(:, n) = 0
         end do
      end do
      call join_meshes(ratio, rotor%shaft%speed_known, texts_of(rotor%shaft%name), rotor%shaft%turns, &
                       reshape([(rotor%mesh(i)%shaft, i=1, size(rotor%mesh))], [2, size(rotor%mesh)]), &
                       [(-1, i=1, size(rotor%mesh))], coupled, input, error)
      rotor%shaft%speed_ratio = real(ratio, wp)
   end subroutine find_ratios

end module razy_scenes_rotor_parts
