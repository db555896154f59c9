!! Gear meshes of a rotor scene: geometry, contact law, static transmission error, and the speeds that follow from teeth.
module razy_scenes_rotor_meshes
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower, string_t
   use razy_machine_machine, only: contact_t
   use razy_rotor_gear_mesh, only: gear_mesh_t
   use razy_rotor_rotor, only: rotor_t
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t
   use razy_scenes_rotor_places, only: find_shaft
   implicit none(type, external)
   private

   public :: find_ratios, new_contact, read_meshes

contains

   !> The geometry of all meshes.
   subroutine read_meshes(rotor, input, error)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(gear_mesh_t) :: mesh
      type(string_t), allocatable :: name(:)
      real(wp), allocatable :: pair(:)
      integer, allocatable :: node(:)
      character(:), allocatable :: text
      integer :: gear, i

      do i = 1, input%count("gear_mesh")
         call input%get("gear_mesh", i, "between", name)
         call input%get("gear_mesh", i, "node", node)
         do gear = 1, 2
            call find_shaft(rotor, input, "gear_mesh", i, "between", name(gear)%text, mesh%shaft(gear), error)
            if (allocated(error)) return
            associate (nodes => rotor%shaft(mesh%shaft(gear))%nodes())
               if (node(gear) > nodes) call input%complain(error, "gear_mesh", i, "node", "1 to "//to_text(nodes)// &
                                                           " on "//name(gear)%text)
            end associate
            if (allocated(error)) return
         end do
         if (mesh%shaft(1) == mesh%shaft(2)) then
            call input%complain(error, "gear_mesh", i, "between", "two different shafts")
            return
         end if
         mesh%node = node
         call input%get("gear_mesh", i, "radius", pair)
         mesh%radius = pair
         call input%get("gear_mesh", i, "offset", pair)
         mesh%offset = pair
         call input%get("gear_mesh", i, "pressure_angle", mesh%pressure)
         call input%get("gear_mesh", i, "helix_angle", mesh%helix)
         call input%get("gear_mesh", i, "centre_line", mesh%centre_line)
         mesh%pressure = mesh%pressure*pi/180
         mesh%helix = mesh%helix*pi/180
         mesh%centre_line = mesh%centre_line*pi/180
         call input%get("gear_mesh", i, "hand", text)
         mesh%right_handed = lower(text) == "right"
         call input%get("gear_mesh", i, "drive", text)
         mesh%positive_drive = lower(text) == "positive"
         call input%get("gear_mesh", i, "stiffness", mesh%stiffness)
         call input%get("gear_mesh", i, "damping", mesh%damping)
         rotor%mesh = [rotor%mesh, mesh]
      end do
   end subroutine read_meshes

   !> Speeds of all shafts over that of `&rotation`, also as the shafts' `speed_ratio`; 0 where nothing says what it is.
   subroutine find_ratios(ratio, rotor, input, error)
      real(qp), allocatable, intent(out) :: ratio(:)
      type(rotor_t), intent(inout) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: given
      character(:), allocatable :: name
      integer :: i, pass, reference, s

      allocate (ratio(size(rotor%shaft)), source=0.0_qp)
      reference = 1
      if (input%given("rotation", 1, "of")) then
         call input%get("rotation", 1, "of", name)
         call find_shaft(rotor, input, "rotation", 1, "of", name, reference, error)
         if (allocated(error)) return
      end if
      ratio(reference) = 1.0_qp
      do s = 1, size(ratio)
         if (.not. input%given("shaft", s, "speed_ratio")) cycle
         call input%get("shaft", s, "speed_ratio", given)
         if (s == reference .and. abs(given - 1.0_wp) > 0.0_wp) then
            call input%complain(error, "shaft", s, "speed_ratio", "1 for the shaft that &rotation belongs to")
            return
         end if
         ratio(s) = given
      end do
      do pass = 1, size(ratio)
         do i = 1, size(rotor%mesh)
            call join(i)
            if (allocated(error)) return
         end do
      end do
      rotor%shaft%speed_ratio = real(ratio, wp)

   contains

      !> External gears turn against each other, with the ratio of their teeth.
      subroutine join(mesh)
         integer, intent(in) :: mesh

         integer, allocatable :: teeth(:)
         real(qp) :: change

         call input%get("gear_mesh", mesh, "teeth", teeth)
         change = -real(teeth(1), qp)/teeth(2)
         associate (first => ratio(rotor%mesh(mesh)%shaft(1)), second => ratio(rotor%mesh(mesh)%shaft(2)))
            if (abs(first) > 0.0_qp .and. .not. abs(second) > 0.0_qp) then
               second = change*first
            else if (abs(second) > 0.0_qp .and. .not. abs(first) > 0.0_qp) then
               first = second/change
            else if (abs(second - change*first) > 1.0e-12_qp*abs(second)) then
               call input%complain(error, "gear_mesh", mesh, "teeth", "numbers with which the speeds of both shafts agree")
            end if
         end associate
      end subroutine join

   end subroutine find_ratios

   !> The contact of mesh i with the direction `w`; its error goes to row `row` of the harmonics. `ratio` is the speed of its
   !> first shaft over that of `&rotation`.
   subroutine new_contact(contact, input, i, w, ratio, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      real(wp), intent(in) :: w(:)
      real(qp), intent(in) :: ratio
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(clearance_side_t) :: back, front
      real(wp), allocatable :: cosine(:), sine(:)
      integer, allocatable :: teeth(:)
      character(:), allocatable :: separation
      real(wp) :: backlash, share, speed
      real(qp) :: hertz
      integer :: k

      call input%get("gear_mesh", i, "name", contact%name)
      contact%w = w
      contact%unit = "m"
      contact%force_unit = "N"
      call input%get("gear_mesh", i, "backlash", backlash)
      front%present = .true.
      call input%get("gear_mesh", i, "stiffness", front%stiffness)
      call input%get("gear_mesh", i, "damping", front%damping)
      back = front
      back%edge = -backlash
      call input%get("gear_mesh", i, "back_stiffness", back%stiffness)
      call input%get("gear_mesh", i, "back_damping", back%damping)
      call input%get("gear_mesh", i, "separation", separation)
      call input%get("gear_mesh", i, "slope_in_backlash", share)
      if (share > 0.0_wp .and. lower(separation) == "zero_force") then
         call input%complain(error, "gear_mesh", i, "separation", "'zero_deformation' with a slope in the backlash")
      else if (share > 0.0_wp .and. .not. share*front%stiffness < back%stiffness) then
         call input%complain(error, "gear_mesh", i, "slope_in_backlash", "a slope less than that of the back flanks")
      end if
      if (allocated(error)) return
      contact%law = new_clearance_law(back, front, lower(separation) == "zero_force", share*front%stiffness)
      call input%get("gear_mesh", i, "error_sine", sine)
      call input%get("gear_mesh", i, "error_cosine", cosine)
      if (size(sine) + size(cosine) == 0) return
      if (input%count("rotation") == 0 .or. .not. abs(ratio) > 0.0_qp) then
         call input%complain(error, "gear_mesh", i, merge("error_sine  ", "error_cosine", size(sine) > 0), &
                             "an error needs &rotation of a shaft that meshes join to this one")
         return
      end if
      call input%get("gear_mesh", i, "teeth", teeth)
      call input%get("rotation", 1, "speed_rpm", speed)
      hertz = teeth(1)*abs(ratio)*speed/60.0_qp
      do k = 1, size(sine)
         call add_harmonic(harmonics, row, k*hertz, 0.0_wp, sine(k))
      end do
      do k = 1, size(cosine)
         call add_harmonic(harmonics, row, k*hertz, cosine(k), 0.0_wp)
      end do
   end subroutine new_contact

end module razy_scenes_rotor_meshes
