!! Gear meshes as an input names them, for every scene that has such: their keys, their law, their transmission error, and the
!! speeds that follow from teeth.
!!
!! A mesh has the deformation d = wᵀq + Δ(t) and the force of (4.58) and (4.59), with a back flank at d = -backlash; its error
!! Δ has the harmonics of the tooth frequency, and so may its stiffness; or this is that of one or two pairs of teeth in turn.
module razy_scenes_gears
   use razy_contact_clearance_law, only: clearance_law_t, clearance_side_t, new_clearance_law, vary_stiffness
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, add_string, group_spec_t, nonnegative, positive
   use razy_machine_machine, only: contact_t
   use razy_scenes_harmonics, only: add_harmonic, find_tone, harmonics_t
   implicit none(type, external)
   private

   public :: add_gear_keys, join_speeds, read_gear_mesh

   integer, parameter :: most_harmonics = 32
   !> Radii may be rounded by this share.
   real(wp), parameter :: ratio_tolerance = 1.0e-2_wp

contains

   !> Add the last keys of the group; `separation` is what that key says.
   subroutine add_gear_keys(schema, separation)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: separation
      call add_real(schema, "backlash", "backlash along the line of action", unit="m", rule=nonnegative, default="0.0")
      call add_string(schema, "separation", separation, choices=["zero_deformation", "zero_force      "], &
                      default="zero_deformation")
      call add_real(schema, "error_sine", "static transmission error: sine amplitudes of the harmonics of the tooth frequency", &
                    unit="m", least=1, most=most_harmonics)
      call add_real(schema, "error_cosine", "static transmission error: cosine amplitudes likewise", unit="m", least=1, &
                    most=most_harmonics)
      call add_real(schema, "stiffness_sine", "mesh stiffness that varies: sine amplitudes of the harmonics of the tooth "// &
                    "frequency, over the mean, which stiffness is", least=1, most=most_harmonics)
      call add_real(schema, "stiffness_cosine", "cosine amplitudes likewise", least=1, most=most_harmonics)
      call add_real(schema, "contact_ratio", "mesh stiffness that switches, stiffness being its mean: two pairs of teeth are "// &
                    "in mesh for the share contact_ratio - 1 of the period, one pair for the rest", low=1.0_wp, high=2.0_wp)
      call add_real(schema, "pair_ratio", "stiffness with two pairs over that with one", rule=positive, default="2.0")
      call add_real(schema, "mesh_phase", "of the stiffness: at time 0 the teeth are so far in their period; with "// &
                    "contact_ratio the second pair comes in at 0", unit="deg", default="0.0")
   end subroutine add_gear_keys

   !> The contact of mesh i with the direction `w`; its error goes to the first of the rows `row` of the harmonics, those of its
   !> stiffness to the second. `ratio` is the speed of its first gear over that of `&rotation`, 0 if it is not known; `joined` says
   !> what makes it known.
   subroutine read_gear_mesh(contact, input, i, w, ratio, joined, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row(2)
      real(wp), intent(in) :: w(:)
      real(qp), intent(in) :: ratio
      character(*), intent(in) :: joined
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(clearance_law_t) :: law
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
      law = new_clearance_law(back, front, lower(separation) == "zero_force", share*front%stiffness)
      call vary(contact, law, input, i, teeth(1)*ratio, joined, harmonics, row(2), error)
      if (allocated(error)) return
      contact%law = law
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
         call add_harmonic(harmonics, row(1), k*hertz, 0.0_wp, sine(k))
      end do
      do k = 1, size(cosine)
         call add_harmonic(harmonics, row(1), k*hertz, cosine(k), 0.0_wp)
      end do
   end subroutine read_gear_mesh

   !> The stiffness of mesh i over the phase of its teeth, which meet `orders` times in a turn of `&rotation`.
   subroutine vary(contact, law, input, i, orders, joined, harmonics, row, error)
      type(contact_t), intent(inout) :: contact
      type(clearance_law_t), intent(inout) :: law
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      real(qp), intent(in) :: orders
      character(*), intent(in) :: joined
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: keys(3) = [character(16) :: "stiffness_sine", "stiffness_cosine", "contact_ratio"]
      real(wp), allocatable :: cosine(:), sine(:)
      real(wp) :: contact_ratio, pair_ratio, phase, speed
      real(qp) :: hertz
      logical :: given(3)
      integer :: k

      do k = 1, 3
         given(k) = input%given("gear_mesh", i, trim(keys(k)))
      end do
      if (.not. any(given)) return
      k = findloc(given, .true., dim=1)
      if (any(given(:2)) .and. given(3)) then
         call input%complain(error, "gear_mesh", i, "contact_ratio", "left out where the stiffness has harmonics")
         return
      end if
      speed = 0.0_wp
      if (input%count("rotation") > 0) call input%get("rotation", 1, "speed_rpm", speed)
      hertz = abs(orders)*abs(speed)/60.0_qp
      if (.not. hertz > 0.0_qp) then
         call input%complain(error, "gear_mesh", i, trim(keys(k)), "a stiffness that varies needs the speed of &rotation, "// &
                             "other than 0, of "//joined//" join to this one")
         return
      end if
      call input%get("gear_mesh", i, "mesh_phase", phase)
      if (given(3)) then
         call input%get("gear_mesh", i, "contact_ratio", contact_ratio)
         call input%get("gear_mesh", i, "pair_ratio", pair_ratio)
         contact%mesh_share = contact_ratio - 1
         if (.not. (contact%mesh_share > 0.0_wp .and. contact%mesh_share < 1.0_wp)) then
            call input%complain(error, "gear_mesh", i, "contact_ratio", "between 1 and 2")
            return
         end if
         contact%mesh_phase = phase/360
         call find_tone(harmonics, hertz, contact%mesh_tone)
         call vary_stiffness(law, [1.0_wp, pair_ratio]/(1 + contact%mesh_share*(pair_ratio - 1)))
         return
      end if
      call input%get("gear_mesh", i, "stiffness_sine", sine)
      call input%get("gear_mesh", i, "stiffness_cosine", cosine)
      if (.not. sum(abs(sine)) + sum(abs(cosine)) < 1.0_wp) then
         call input%complain(error, "gear_mesh", i, trim(keys(k)), "amplitudes whose sum is less than 1")
         return
      end if
      phase = phase*pi/180
      do k = 1, size(sine)
         call add_harmonic(harmonics, row, k*hertz, sine(k)*sin(k*phase), sine(k)*cos(k*phase))
      end do
      do k = 1, size(cosine)
         call add_harmonic(harmonics, row, k*hertz, cosine(k)*cos(k*phase), -cosine(k)*sin(k*phase))
      end do
   end subroutine vary

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
