!! Gear meshes as an input names them, for every scene that has such: their keys, their law, their transmission error, and the
!! speeds that follow from teeth.
!!
!! A mesh has the deformation d = wᵀq + Δ(t) and the force of (4.58) and (4.59), with a back flank at d = -backlash; its error
!! Δ has the harmonics of the tooth frequency, and so may its stiffness; or this is that of one or two pairs of teeth in turn.
!! The errors of each gear over a turn may come from a measured table, whose discrete Fourier sum has the orders of that gear.
module razy_scenes_gears
   use razy_contact_clearance_law, only: clearance_law_t, clearance_side_t, damp_always, limit_damping, new_clearance_law, &
                                         vary_stiffness
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_text, only: did_you_mean, excerpt, lower, string_t
   use razy_core_text_columns, only: read_text_columns
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_integer, add_name, add_real, add_string, group_spec_t, nonnegative, positive
   use razy_machine_machine, only: contact_t
   use razy_scenes_harmonics, only: add_harmonic, find_tone, frequency_t, harmonics_t
   use razy_scenes_shapes, only: add_course, add_motion_keys
   use razy_scenes_teeth, only: add_tooth_keys, refuse_gone
   implicit none(type, external)
   private

   public :: add_gear_group, join_meshes, read_gear_mesh

   integer, parameter :: most_harmonics = 32, most_levels = 360, most_rows = 10000
   !> Radii may be rounded by this share.
   real(wp), parameter :: ratio_tolerance = 1.0e-2_wp

contains

   !> Add the group &gear_mesh.
   subroutine add_gear_group(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "gear_mesh", "Two wheels in mesh: inertias, bodies in the plane, or gears on parallel shafts", &
                     repeatable=.true.)
      call add_name(schema)
      call add_string(schema, "between", "names of the two wheels: inertias; or bodies, with the axis in the centre, or points "// &
                      "in the axis; or shafts", count=2, required=.true.)
      call add_integer(schema, "node", "nodes of the gears, required on shafts", rule=positive, count=2)
      call add_string(schema, "kind", "internal: the wheel with the larger radius is a ring around the other, of bodies", &
                      choices=["external", "internal"], default="external")
      call add_real(schema, "radius", "base radii; of bodies their sum (internal: difference) over the distance of the "// &
                    "centres is the cosine of the pressure angle; of gears on shafts pitch radii", unit="m", rule=positive, &
                    count=2, required=.true.)
      call add_real(schema, "pressure_angle", "normal pressure angle, on shafts or with width", unit="deg", low=0.0_wp, &
                    high=89.0_wp, default="20.0")
      call add_real(schema, "helix_angle", "helix angle, on shafts or with width", unit="deg", low=0.0_wp, high=89.0_wp, &
                    default="0.0")
      call add_string(schema, "hand", "hand of the first gear, on shafts; that of the second is the other", &
                      choices=["right", "left "], default="right")
      call add_real(schema, "centre_line", "angle of the line from the first to the second axis, from y towards z, on shafts", &
                    unit="deg", default="0.0")
      call add_real(schema, "offset", "distances of the gears' middle planes from their nodes along +x, on shafts", unit="m", &
                    count=2, default="0.0, 0.0")
      call add_string(schema, "drive", "sign of the torque on the first wheel that loads the working flanks", &
                      choices=["positive", "negative"], default="positive")
      call add_real(schema, "back_stiffness", "stiffness on the back flanks; that of the working ones if not given", unit="N/m", &
                    rule=positive)
      call add_real(schema, "slope_in_backlash", "alpha of (4.58): stiffness within the backlash over that of the working flanks", &
                    low=0.0_wp, high=0.999_wp, default="0.0")
      call add_real(schema, "back_damping", "damping on the back flanks; that of the working ones if not given", unit="N s/m", &
                    rule=nonnegative)
      call add_integer(schema, "teeth", "numbers of teeth", rule=positive, count=2, required=.true.)
      call add_real(schema, "stiffness", "mesh stiffness", unit="N/m", rule=positive, required=.true.)
      call add_tooth_keys(schema)
      call add_real(schema, "damping", "mesh damping", unit="N s/m", rule=nonnegative, default="0.0")
      call add_string(schema, "damping_acts", "where the mesh damping acts: in contact; in contact and in the backlash; in "// &
                      "contact, and no more than the force of the mesh stiffness", &
                      choices=["in_contact", "always    ", "limited   "], default="in_contact")
      call add_real(schema, "backlash", "backlash along the line of action", unit="m", rule=nonnegative, default="0.0")
      call add_string(schema, "separation", "where a contact with damping_acts='in_contact' is lost; 'zero_force', so "// &
                      "that teeth do not pull, if not given (with slope_in_backlash 'zero_deformation')", &
                      choices=["zero_deformation", "zero_force      "])
      call add_real(schema, "error_sine", "static transmission error: sine amplitudes of the harmonics of the tooth frequency", &
                    unit="m", least=1, most=most_harmonics)
      call add_real(schema, "error_cosine", "static transmission error: cosine amplitudes likewise", unit="m", least=1, &
                    most=most_harmonics)
      call add_string(schema, "error_file", "errors of the first gear and of the second over a turn of each: comma-separated "// &
                      "text with the columns angle_deg, in equal steps once round, and error, m; '' for a gear without", &
                      least=1, most=2)
      call add_integer(schema, "error_harmonics", "harmonics of a turn that are taken from each table; 0: all", low=0, &
                       high=most_rows, default="0")
      call add_real(schema, "stiffness_sine", "mesh stiffness that varies: sine amplitudes of the harmonics of the tooth "// &
                    "frequency, over the mean, which stiffness is", least=1, most=most_harmonics)
      call add_real(schema, "stiffness_cosine", "cosine amplitudes likewise", least=1, most=most_harmonics)
      call add_string(schema, "stiffness_file", "the course of the stiffness over a period of the teeth instead, whose mean "// &
                      "stiffness is: comma-separated text with the columns angle_deg, in equal steps over 360, and "// &
                      "stiffness, N/m")
      call add_string(schema, "stiffness_course", "what is taken of the file: its first 32 harmonics, or each of its values "// &
                      "up to the next", choices=["harmonics", "held     "], default="harmonics")
      call add_real(schema, "contact_ratio", "mesh stiffness that switches, stiffness being its mean: of contact_ratio = n + s "// &
                    "n + 1 pairs of teeth are in mesh for the share s of the period, n for the rest", low=1.0_wp, high=10.0_wp)
      call add_real(schema, "pair_ratio", "stiffness with n + 1 pairs over that with n; (n + 1)/n if not given", rule=positive)
      call add_real(schema, "mesh_phase", "of the stiffness: at time 0 the teeth are so far in their period; with "// &
                    "contact_ratio a further pair comes in at 0", unit="deg", default="0.0")
      call add_motion_keys(schema, "a part of the error that is given over time")
   end subroutine add_gear_group

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

      character(*), parameter :: keys(3) = [character(12) :: "error_file", "error_sine", "error_cosine"]
      type(string_t), allocatable :: file(:)
      type(clearance_law_t) :: law
      type(clearance_side_t) :: back, front
      real(wp), allocatable :: cosine(:), radius(:), sine(:)
      integer, allocatable :: teeth(:)
      character(:), allocatable :: acts
      real(wp) :: constant, share
      logical :: by_force
      integer :: k

      call refuse_gone(input, i, error)
      if (allocated(error)) return
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
      front%present = .true.
      call input%get("gear_mesh", i, "stiffness", front%stiffness)
      call input%get("gear_mesh", i, "damping", front%damping)
      acts = input%choice("gear_mesh", i, "damping_acts")
      constant = front%damping
      if (acts == "always") front%damping = 0.0_wp
      back = front
      back%edge = -input%number("gear_mesh", i, "backlash")
      call input%get("gear_mesh", i, "back_stiffness", back%stiffness)
      call input%get("gear_mesh", i, "back_damping", back%damping)
      call input%get("gear_mesh", i, "slope_in_backlash", share)
      ! Dry teeth do not pull.
      by_force = input%choice("gear_mesh", i, "separation") == "zero_force" .or. &
                 .not. (input%given("gear_mesh", i, "separation") .or. share > 0.0_wp)
      if (acts /= "in_contact" .and. input%given("gear_mesh", i, "separation")) then
         call input%complain(error, "gear_mesh", i, "separation", "left out with damping_acts = '"//acts//"'")
      else if (acts == "always" .and. input%given("gear_mesh", i, "back_damping")) then
         call input%complain(error, "gear_mesh", i, "back_damping", "left out with damping_acts = 'always'")
      else if (acts == "limited" .and. share > 0.0_wp) then
         call input%complain(error, "gear_mesh", i, "damping_acts", "'in_contact' or 'always' with a slope in the backlash")
      else if (share > 0.0_wp .and. by_force) then
         call input%complain(error, "gear_mesh", i, "separation", "'zero_deformation' with a slope in the backlash")
      else if (share > 0.0_wp .and. .not. share*front%stiffness < back%stiffness) then
         call input%complain(error, "gear_mesh", i, "slope_in_backlash", "a slope less than that of the back flanks")
      end if
      if (allocated(error)) return
      law = new_clearance_law(back, front, by_force, share*front%stiffness)
      if (acts == "always") call damp_always(law, constant)
      if (acts == "limited") call limit_damping(law)
      call vary(contact, law, input, i, teeth(1)*ratio, joined, harmonics, row(2), error)
      if (allocated(error)) return
      allocate (contact%law, source=law)
      call add_course(harmonics, [(0.0_wp, k=2, row(1)), 1.0_wp], .true., input, "gear_mesh", i, "motion_", "m or rad", error)
      if (.not. allocated(error)) call input%refuse_alone(error, "gear_mesh", i, "error_harmonics", "error_file")
      if (allocated(error)) return
      call input%get("gear_mesh", i, "error_sine", sine)
      call input%get("gear_mesh", i, "error_cosine", cosine)
      if (size(sine) + size(cosine) == 0 .and. .not. input%given("gear_mesh", i, "error_file")) return
      if (input%count("rotation") == 0 .or. .not. abs(ratio) > 0.0_qp) then
         k = findloc([input%given("gear_mesh", i, "error_file"), size(sine) > 0, .true.], .true., dim=1)
         call input%complain(error, "gear_mesh", i, trim(keys(k)), "an error needs &rotation of "//joined//" join to this one")
         return
      end if
      ! The teeth turn on in either sense of rotation.
      associate (forward => sign(ratio, harmonics%rotation%hertz))
         do k = 1, size(sine)
            call add_harmonic(harmonics, row(1), harmonics%of_order(k*teeth(1)*forward), 0.0_wp, sine(k))
         end do
         do k = 1, size(cosine)
            call add_harmonic(harmonics, row(1), harmonics%of_order(k*teeth(1)*forward), cosine(k), 0.0_wp)
         end do
         if (.not. input%given("gear_mesh", i, "error_file")) return
         call input%get("gear_mesh", i, "error_file", file)
         do k = 1, size(file)
            if (len_trim(file(k)%text) == 0) cycle
            call add_table(harmonics, row(1), input, i, file(k)%text, forward*teeth(1)/teeth(k), error)
            if (allocated(error)) return
         end do
      end associate
   end subroutine read_gear_mesh

   !> Add the errors of a gear, from a file, to a row; the gear turns `ratio` times in a turn of `&rotation`. The angle counts from
   !> the gear's position at time 0, in the direction in which it turns.
   subroutine add_table(harmonics, row, input, i, file, ratio, error)
      type(harmonics_t), intent(inout) :: harmonics
      integer, intent(in) :: row, i
      type(input_t), intent(in) :: input
      character(*), intent(in) :: file
      real(qp), intent(in) :: ratio
      type(error_t), allocatable, intent(out) :: error

      complex(wp), allocatable :: amplitude(:)
      real(wp), allocatable :: values(:, :)
      integer :: k, most

      call input%get("gear_mesh", i, "error_harmonics", most)
      call read_turn(amplitude, values, input, i, "error", file, merge(most, most_rows, most > 0), error)
      if (allocated(error)) return
      call add_harmonic(harmonics, row, harmonics%of_order(0.0_qp), amplitude(0)%re, 0.0_wp)
      do k = 1, ubound(amplitude, 1)
         call add_harmonic(harmonics, row, harmonics%of_order(k*ratio), amplitude(k)%re, amplitude(k)%im)
      end do
   end subroutine add_table

   !> Harmonics c + i s, from 0 to at `most` one, of Σ c cos k φ + s sin k φ through the values of a file over one turn of `what`,
   !> and the angles and values of its rows (rows, 2).
   subroutine read_turn(amplitude, values, input, i, what, file, most, error)
      complex(wp), allocatable, intent(out) :: amplitude(:)
      real(wp), allocatable, intent(out) :: values(:, :)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, most
      character(*), intent(in) :: what, file
      type(error_t), allocatable, intent(out) :: error

      !> Share of a step up to which angles may be rounded; share of the largest value below which a harmonic is rounding.
      real(wp), parameter :: rounded = 1.0e-2_wp, nothing = 64*epsilon(1.0_wp)
      complex(wp), allocatable :: at(:)
      real(wp) :: cosine, sine, step
      integer :: j, k, n

      call read_text_columns(file, [string_t("angle_deg [deg]"), &
                                    string_t(what//" ["//trim(merge("m  ", "N/m", what == "error"))//"]")], values, error)
      if (allocated(error)) return
      n = size(values, 1)
      if (n < 3 .or. n > most_rows) then
         call input%complain(error, "gear_mesh", i, what//"_file", "a file with 3 to "//to_text(most_rows)//" rows")
         return
      end if
      step = 360.0_wp/n
      do j = 2, n
         if (.not. values(j, 1) > values(j - 1, 1)) then
            call input%complain(error, "gear_mesh", i, what//"_file", "a file whose angle_deg rises from row to row; row "// &
                                to_text(j)//" of '"//file//"' has "//decimal(values(j, 1), 3))
         else if (abs(values(j, 1) - values(1, 1) - (j - 1)*step) > rounded*step) then
            call input%complain(error, "gear_mesh", i, what//"_file", "a file whose angle_deg goes once round in equal steps, "// &
                                decimal(step, 3)//" with "//to_text(n)//" rows and none at 360; row "//to_text(j)//" of '"// &
                                file//"' has "//decimal(values(j, 1), 3))
         end if
         if (allocated(error)) return
      end do
      allocate (amplitude(0:min(most, n/2)), source=(0.0_wp, 0.0_wp))
      amplitude(0) = sum(values(:, 2))/n
      do k = 1, ubound(amplitude, 1)
         ! Whole turns are left out, so that the angle is right to rounding.
         at = turn(360*real([(modulo(k*(j - 1), n), j=1, n)], wp)/n)
         cosine = sum(values(:, 2)*at%re)*merge(1, 2, 2*k == n)/n
         sine = sum(values(:, 2)*at%im)*merge(0, 2, 2*k == n)/n
         if (hypot(cosine, sine) > nothing*maxval(abs(values(:, 2)))) amplitude(k) = cmplx(cosine, sine, wp)*turn(k*values(1, 1))
      end do
   end subroutine read_turn

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

      character(*), parameter :: key(4) = [character(16) :: "stiffness_file", "stiffness_sine", "stiffness_cosine", "contact_ratio"]
      complex(wp), allocatable :: amplitude(:)
      real(wp), allocatable :: cosine(:), sine(:), values(:, :)
      complex(wp) :: at
      real(wp) :: contact_ratio, mean, pair_ratio, phase, share
      type(frequency_t) :: teeth
      logical :: given(4), held
      integer :: k

      given = [(input%given("gear_mesh", i, trim(key(k))), k=1, size(key))]
      held = input%choice("gear_mesh", i, "stiffness_course") == "held"
      if (held .and. .not. given(1)) call input%complain(error, "gear_mesh", i, "stiffness_course", "'held' with a stiffness_file")
      if (.not. allocated(error)) call input%refuse_alone(error, "gear_mesh", i, "pair_ratio", "contact_ratio")
      if (.not. (allocated(error) .or. any(given)) .and. input%differs("gear_mesh", i, "mesh_phase")) then
         call input%complain(error, "gear_mesh", i, "mesh_phase", "left out where the stiffness does not vary")
      end if
      if (allocated(error) .or. .not. any(given)) return
      k = findloc(given, .true., dim=1)
      if (any(given(:3)) .and. given(4) .or. given(1) .and. any(given(2:))) then
         call input%complain(error, "gear_mesh", i, trim(key(findloc(given, .true., dim=1, back=.true.))), &
                             "left out where the stiffness has harmonics"//merge(" from a file", "            ", given(1)))
         return
      end if
      teeth = harmonics%of_order(sign(orders, harmonics%rotation%hertz))
      if (.not. max(teeth%hertz, abs(teeth%sweep)) > 0.0_qp) then
         call input%complain(error, "gear_mesh", i, trim(key(k)), "a stiffness that varies needs the speed of &rotation, "// &
                             "other than 0, of "//joined//" join to this one")
         return
      end if
      if ((given(4) .or. held) .and. teeth%hertz*(teeth%hertz + teeth%sweep*harmonics%t_end) < 0.0_qp) then
         call input%complain(error, "gear_mesh", i, trim(key(k)), "left out where &rotation turns back")
         return
      end if
      phase = mod(input%number("gear_mesh", i, "mesh_phase"), 360.0_wp)
      contact%mesh_phase = phase/360
      if (given(4)) then
         call input%get("gear_mesh", i, "contact_ratio", contact_ratio)
         pair_ratio = input%number("gear_mesh", i, "pair_ratio", &
                                   otherwise=real(floor(contact_ratio) + 1, wp)/floor(contact_ratio))
         share = contact_ratio - floor(contact_ratio)
         ! With as many pairs always the stiffness is its mean.
         if (.not. share > 0.0_wp) return
         contact%mesh_end = [0.0_wp, share]
         call find_tone(harmonics, teeth, contact%mesh_tone)
         call vary_stiffness(law, [1.0_wp, pair_ratio]/(1 + share*(pair_ratio - 1)), floor(contact_ratio))
         return
      end if
      call input%get("gear_mesh", i, "stiffness_sine", sine)
      call input%get("gear_mesh", i, "stiffness_cosine", cosine)
      allocate (amplitude(0:most_harmonics), source=(0.0_wp, 0.0_wp))
      amplitude(0) = 1.0_wp
      amplitude(1:size(sine))%im = sine
      amplitude(1:size(cosine))%re = cosine
      if (given(1)) then
         call read_turn(amplitude, values, input, i, "stiffness", input%text("gear_mesh", i, "stiffness_file"), most_harmonics, &
                        error)
         if (allocated(error)) return
      end if
      mean = amplitude(0)%re
      if (held) then
         associate (n => size(values, 1))
            if (.not. all(values(:, 2) > 0.0_wp) .or. n > most_levels) then
               call input%complain(error, "gear_mesh", i, "stiffness_file", "a file with at most "//to_text(most_levels)// &
                                   " rows, all above 0")
               return
            end if
            contact%mesh_phase = (phase - values(1, 1))/360
            contact%mesh_end = [(real(k, wp)/n, k=0, n - 1)]
            call find_tone(harmonics, teeth, contact%mesh_tone)
            call vary_stiffness(law, cshift(values(:, 2), -1)/mean, 0)
         end associate
         return
      end if
      amplitude = amplitude/mean
      if (.not. (mean > 0.0_wp .and. sum(abs(amplitude(1:)%re)) + sum(abs(amplitude(1:)%im)) < 1.0_wp)) then
         call input%complain(error, "gear_mesh", i, trim(key(k)), "amplitudes whose sum is less than 1")
         return
      end if
      do k = 1, ubound(amplitude, 1)
         at = amplitude(k)*turn(-k*phase)
         call add_harmonic(harmonics, row, harmonics%of_order(k*teeth%order), at%re, at%im)
      end do
   end subroutine vary

   !> Speeds `ratio` of all parts, which have these names, over that of `&rotation`, 0 where nothing says what they are, from those
   !> that are given, and that of the part which `&rotation` names, one that `turns`; the first, if it names none; whether they
   !> are `known` then, as one of 0 may be. Mesh i is
   !> between the parts `ends`(:, i), which turn one `way`(i) (1) or against each other (-1). Those in `coupled` (2, pairs) turn
   !> alike, as springs, dampers or stops on angles join them; 0 is the frame.
   subroutine join_meshes(ratio, known, names, turns, ends, way, coupled, input, error)
      real(qp), intent(inout) :: ratio(:)
      logical, intent(out) :: known(:)
      type(string_t), intent(in) :: names(:)
      logical, intent(in) :: turns(:)
      integer, intent(in) :: ends(:, :), way(:), coupled(:, :)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name
      integer, allocatable :: teeth(:)
      integer :: i, of, pass
      logical :: agree

      of = 1
      call input%get("rotation", 1, "of", name)
      if (len(name) > 0) of = findloc(turns .and. [(lower(names(i)%text) == lower(name), i=1, size(names))], .true., dim=1)
      if (of == 0) then
         call input%complain(error, "rotation", 1, "of", "nothing that turns is named "//excerpt(name)//"; "// &
                             did_you_mean(name, pack(names, turns), "names"))
         return
      else if (input%given("shaft", of, "speed_ratio") .and. abs(ratio(of) - 1) > 0.0_qp) then
         call input%complain(error, "shaft", of, "speed_ratio", "1 for the shaft that &rotation belongs to")
         return
      end if
      ratio(of) = 1.0_qp
      known = [(i == of .or. input%given("shaft", i, "speed_ratio"), i=1, size(known))]
      do pass = 1, size(ratio)
         do i = 1, size(coupled, 2)
            if (any(coupled(:, i) == 0)) cycle
            call join_speeds(ratio, known, coupled(:, i), 1.0_qp, agree)
            if (agree) cycle
            call input%complain(error, "rotation", 1, "speed_rpm", "that of a machine in which springs, dampers and stops on "// &
                                "angles join parts that turn alike")
            return
         end do
         do i = 1, size(way)
            call input%get("gear_mesh", i, "teeth", teeth)
            call join_speeds(ratio, known, ends(:, i), way(i)*real(teeth(1), qp)/teeth(2), agree)
            if (agree) cycle
            call input%complain(error, "gear_mesh", i, "teeth", "numbers with which the speeds of both agree")
            return
         end do
      end do
   end subroutine join_meshes

   !> Speeds over that of `&rotation` of the parts `ends`, 0 where not `known` yet, of which the second turns `change` times as fast
   !> as the first. They `agree` if they differ from that by no more than the rounding of a number that is given.
   pure subroutine join_speeds(ratio, known, ends, change, agree)
      real(qp), intent(inout) :: ratio(:)
      logical, intent(inout) :: known(:)
      integer, intent(in) :: ends(2)
      real(qp), intent(in) :: change
      logical, intent(out) :: agree

      real(qp), parameter :: rounding = 1.0e-12_qp

      associate (first => ratio(ends(1)), second => ratio(ends(2)))
         if (.not. known(ends(2))) then
            second = change*first
         else if (.not. known(ends(1))) then
            first = second/change
         end if
         known(ends) = any(known(ends))
         agree = abs(second - change*first) <= rounding*abs(second)
      end associate
   end subroutine join_speeds

end module razy_scenes_gears
