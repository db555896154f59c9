!! What a rotor scene consists of, from its groups: shafts with their sections, disks, supports and bearings.
module razy_scenes_rotor_parts
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_core_text, only: lower, string_t
   use razy_rotor_rotor, only: damping_nodal, damping_none, longest_name, rotor_t
   use razy_rotor_section, only: material_t, section_t, shear_cowper, shear_none
   use razy_scenes_rotor_bearings, only: read_bearing
   use razy_scenes_rotor_places, only: find_node, find_shaft
   use razy_scenes_rotor_schema, only: coordinate_choices, damping_choices
   implicit none(type, external)
   private

   public :: read_parts

contains

   !> Shafts, disks, supports and bearings; lists of other parts are empty.
   subroutine read_parts(rotor, input, error)
      type(rotor_t), intent(out) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      allocate (rotor%shaft(input%count("shaft")), rotor%disk(input%count("disk")), rotor%bearing(input%count("bearing")))
      allocate (rotor%support(input%count("support")), rotor%mesh(0), rotor%load(0), rotor%unbalance(input%count("unbalance")))
      if (size(rotor%shaft) == 0) then
         call input%complain(error, "scene", 1, "kind", "a rotor scene needs at least one &shaft")
         return
      end if
      call input%get("freedom", 1, "axial", rotor%axial)
      call input%get("freedom", 1, "bending", rotor%bending)
      call input%get("freedom", 1, "torsion", rotor%torsion)
      if (.not. (rotor%axial .or. rotor%bending .or. rotor%torsion)) then
         call input%complain(error, "freedom", 1, "torsion", "at least one of axial, bending and torsion")
         return
      end if
      call read_shafts(rotor, input, error)
      if (.not. allocated(error)) call read_disks(rotor, input, error)
      if (allocated(error)) return
      do i = 1, size(rotor%bearing)
         call read_bearing(rotor%bearing(i), rotor, input, i, error)
         if (allocated(error)) return
      end do
   end subroutine read_parts

   subroutine read_shafts(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(material_t), allocatable :: material(:)
      type(section_t) :: section
      character(:), allocatable :: text
      integer :: i, kind, s

      allocate (material(size(rotor%shaft)))
      do s = 1, size(rotor%shaft)
         call input%get("shaft", s, "name", text)
         if (len(text) > longest_name) then
            call input%complain(error, "shaft", s, "name", "a name of at most 40 characters")
            return
         end if
         allocate (rotor%shaft(s)%section(0))
         rotor%shaft(s)%name = text
         call read_material(material(s), input, s, error)
         if (allocated(error)) return
         call input%get("shaft", s, "element", text)
         rotor%shaft(s)%shear = merge(shear_cowper, shear_none, lower(text) == "timoshenko")
         call input%get("shaft", s, "damping_ratio", rotor%shaft(s)%damping_ratio)
         call input%get("shaft", s, "damping", text)
         if (.not. rotor%shaft(s)%damping_ratio > 0.0_wp) cycle
         kind = damping_nodal - 2 + findloc(damping_choices, lower(text), dim=1)
         if (rotor%damping /= damping_none .and. rotor%damping /= kind) then
            call input%complain(error, "shaft", s, "damping", "the same for all shafts with damping")
            return
         end if
         rotor%damping = kind
      end do
      do i = 1, input%count("section")
         call input%get("section", i, "shaft", text)
         call find_shaft(rotor, input, "section", i, "shaft", text, s, error)
         if (allocated(error)) return
         section%material = material(s)
         call input%get("section", i, "length", section%length)
         call input%get("section", i, "outer_diameter", section%outer)
         call input%get("section", i, "inner_diameter", section%inner)
         call input%get("section", i, "elements", section%elements)
         if (section%inner >= section%outer) then
            call input%complain(error, "section", i, "inner_diameter", "less than the outer diameter")
            return
         end if
         rotor%shaft(s)%section = [rotor%shaft(s)%section, section]
      end do
      do s = 1, size(rotor%shaft)
         if (size(rotor%shaft(s)%section) > 0) cycle
         call input%complain(error, "shaft", s, "name", "the name of a shaft with at least one &section")
         return
      end do
   end subroutine read_shafts

   subroutine read_material(material, input, s, error)
      type(material_t), intent(out) :: material
      type(input_t), intent(in) :: input
      integer, intent(in) :: s
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: ratio

      call input%get("shaft", s, "young_modulus", material%young)
      call input%get("shaft", s, "density", material%density)
      if (input%given("shaft", s, "shear_modulus") .eqv. input%given("shaft", s, "poisson_ratio")) then
         call input%complain(error, "shaft", s, "shear_modulus", "one of shear_modulus and poisson_ratio has to be given")
      else if (input%given("shaft", s, "shear_modulus")) then
         call input%get("shaft", s, "shear_modulus", material%shear)
      else
         call input%get("shaft", s, "poisson_ratio", ratio)
         material%shear = material%young/(2*(1 + ratio))
      end if
   end subroutine read_material

   !> Disks, supports and unbalances.
   subroutine read_disks(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i, k

      do i = 1, size(rotor%disk)
         call find_node(rotor, input, "disk", i, rotor%disk(i)%shaft, rotor%disk(i)%node, error)
         if (allocated(error)) return
         call input%get("disk", i, "mass", rotor%disk(i)%mass)
         call input%get("disk", i, "polar_inertia", rotor%disk(i)%polar)
         call input%get("disk", i, "diametral_inertia", rotor%disk(i)%diametral)
         call input%get("disk", i, "offset", rotor%disk(i)%offset)
      end do
      do i = 1, size(rotor%support)
         call find_node(rotor, input, "support", i, rotor%support(i)%shaft, rotor%support(i)%node, error)
         if (allocated(error)) return
         do k = 1, 6
            rotor%support(i)%fixed(k) = holds(input, i, trim(coordinate_choices(k)))
         end do
      end do
      do i = 1, size(rotor%unbalance)
         call find_node(rotor, input, "unbalance", i, rotor%unbalance(i)%shaft, rotor%unbalance(i)%node, error)
         if (allocated(error)) return
         call input%get("unbalance", i, "moment", rotor%unbalance(i)%moment)
         call input%get("unbalance", i, "angle", rotor%unbalance(i)%angle)
         rotor%unbalance(i)%angle = rotor%unbalance(i)%angle*pi/180
      end do
   end subroutine read_disks

   !> Whether support i names a coordinate.
   function holds(input, i, coordinate)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: coordinate
      logical :: holds

      type(string_t), allocatable :: held(:)
      integer :: k

      call input%get("support", i, "held", held)
      holds = .false.
      do k = 1, size(held)
         holds = holds .or. lower(held(k)%text) == coordinate
      end do
   end function holds

end module razy_scenes_rotor_parts
