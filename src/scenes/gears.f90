!! Gear meshes as an input names them, for every scene that has such: their keys, their law, their transmission error, and the
!! speeds that follow from teeth.
!!
!! A mesh has the deformation d = wᵀq + Δ(t) and the force of (4.58) and (4.59), with a back flank at d = -backlash; its error
!! Δ has the harmonics of the tooth frequency.
module razy_scenes_gears
   use razy_contact_clearance_law, only: clearance_side_t, new_clearance_law
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower
   use razy_input_input, only: input_t
   use razy_input_schema, only: key_real, key_spec_t, key_string, nonnegative
   use razy_machine_machine, only: contact_t
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t
   implicit none(type, external)
   private

   public :: gear_keys, join_speeds, read_gear_mesh

   integer, parameter :: most_harmonics = 32
   !> Radii may be rounded by this share.
   real(wp), parameter :: ratio_tolerance = 1.0e-2_wp

contains

   !> The last keys of the group; `separation` is what that key says.
   function gear_keys(separation) result(specs)
      character(*), intent(in) :: separation
      type(key_spec_t), allocatable :: specs(:)

      specs = [ &
              key_real("backlash", "backlash along the line of action", unit="m", rule=nonnegative, default="0.0"), &
              key_string("separation", separation, choices=["zero_deformation", "zero_force      "], default="zero_deformation"), &
              key_real("error_sine", "static transmission error: sine amplitudes of the harmonics of the tooth frequency", &
                       unit="m", least=1, most=most_harmonics), &
              key_real("error_cosine", "static transmission error: cosine amplitudes likewise", unit="m", &
                       least=1, most=most_harmonics)]
   end function gear_keys

   !> The contact of mesh i with the direction `w`; its error goes to row `row` of the harmonics. `ratio` is the speed of its
   !> first gear over that of `&rotation`, 0 if it is not known; `joined` says what makes it known.
   subroutine read_gear_mesh(contact, input, i, w, ratio, joined, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      real(wp), intent(in) :: w(:)
      real(qp), intent(in) :: ratio
      character(*), intent(in) :: joined
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(clearance_side_t) :: back, front
      real(wp), allocatable :: cosine(:), radius(:), sine(:)
      integer, allocatable :: teeth(:)
      character(:), allocatable :: separation
      real(wp) :: backlash, share, speed
      real(qp) :: hertz
      integer :: k

      call input%get("gear_mesh", i, "radius", radius)
      call input%get("gear_mesh", i, "teeth", teeth)
      if (abs(radius(1)*teeth(2) - radius(2)*teeth(1)) > ratio_tolerance*radius(2)*teeth(1)) then
         call input%complain(error, "gear_mesh", i, "radius", "two radii in the ratio of teeth = "//to_text(teeth(1))//", "// &
                             to_text(teeth(2))//", to a hundredth")
         return
      end if
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
      share = 0.0_wp
      if (input%given("gear_mesh", i, "back_stiffness")) call input%get("gear_mesh", i, "back_stiffness", back%stiffness)
      if (input%given("gear_mesh", i, "back_damping")) call input%get("gear_mesh", i, "back_damping", back%damping)
      if (input%given("gear_mesh", i, "slope_in_backlash")) call input%get("gear_mesh", i, "slope_in_backlash", share)
      call input%get("gear_mesh", i, "separation", separation)
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
                             "an error needs &rotation of "//joined//" join to this one")
         return
      end if
      call input%get("rotation", 1, "speed_rpm", speed)
      hertz = teeth(1)*abs(ratio)*speed/60.0_qp
      do k = 1, size(sine)
         call add_harmonic(harmonics, row, k*hertz, 0.0_wp, sine(k))
      end do
      do k = 1, size(cosine)
         call add_harmonic(harmonics, row, k*hertz, cosine(k), 0.0_wp)
      end do
   end subroutine read_gear_mesh

   !> Speeds over that of `&rotation` of two parts, 0 where not known yet, of which the second turns `change` times as fast as
   !> the first. They do not `agree` if they differ from that by more than the share `tolerance`.
   pure subroutine join_speeds(first, second, change, tolerance, agree)
      real(qp), intent(inout) :: first, second
      real(qp), intent(in) :: change, tolerance
      logical, intent(out) :: agree

      agree = .true.
      if (abs(first) > 0.0_qp .and. .not. abs(second) > 0.0_qp) then
         second = change*first
      else if (abs(second) > 0.0_qp .and. .not. abs(first) > 0.0_qp) then
         first = second/change
      else
         agree = abs(second - change*first) <= tolerance*abs(second)
      end if
   end subroutine join_speeds

end module razy_scenes_gears
