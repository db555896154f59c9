!! Gear meshes of a rotor scene: their geometry, and the speeds of shafts that follow from teeth.
module razy_scenes_rotor_meshes
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower, string_t
   use razy_rotor_gear_mesh, only: gear_mesh_t
   use razy_rotor_rotor, only: rotor_t
   use razy_scenes_gears, only: join_speeds
   use razy_scenes_rotor_places, only: find_shaft
   implicit none(type, external)
   private

   public :: find_ratios, read_meshes

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
         mesh%pressure = mesh%pressure*pi/180
         call input%get("gear_mesh", i, "helix_angle", mesh%helix)
         mesh%helix = mesh%helix*pi/180
         call input%get("gear_mesh", i, "centre_line", mesh%centre_line)
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

      real(qp), parameter :: rounding = 1.0e-12_qp
      real(wp) :: given
      character(:), allocatable :: name
      integer, allocatable :: teeth(:)
      integer :: i, pass, reference, s
      logical :: agree

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
            ! External gears turn against each other, with the ratio of their teeth.
            call input%get("gear_mesh", i, "teeth", teeth)
            associate (shaft => rotor%mesh(i)%shaft)
               call join_speeds(ratio(shaft(1)), ratio(shaft(2)), -real(teeth(1), qp)/teeth(2), rounding, agree)
            end associate
            if (agree) cycle
            call input%complain(error, "gear_mesh", i, "teeth", "numbers with which the speeds of both shafts agree")
            return
         end do
      end do
      rotor%shaft%speed_ratio = real(ratio, wp)
   end subroutine find_ratios

end module razy_scenes_rotor_meshes
