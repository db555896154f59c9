!! What stands between two places, whatever these are: keys of springs, dampers, stops, rings and friction, and what every kind of
!! scene reads of them alike.
module razy_scenes_connections
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, did_you_mean, position_of, string_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_logical, add_name, add_real, add_string, group_spec_t, nonnegative, &
                                positive
   use razy_scenes_contacts, only: add_friction_keys, add_ring_keys
   use razy_scenes_gap_laws, only: add_gap_law_keys
   use razy_scenes_loads, only: add_load_group
   use razy_scenes_shapes, only: add_motion_keys
   use razy_scenes_start, only: add_initial_group
   use razy_scenes_tables, only: add_damper_keys, add_spring_keys, is_linear
   implicit none(type, external)
   private

   public :: add_connection_groups, add_place, coefficients, connecting, find_connection, read_sides, &
             unit_direction

   !> What goes into K and B.
   character(*), parameter :: connecting(2) = ["spring", "damper"]
   integer, parameter :: most_ends = 64

contains

   !> Add the groups of bodies with one coordinate, and of what connects places, acts on them, or says where they start.
   subroutine add_connection_groups(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "inertia", "A body that turns", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "value", "moment of inertia", unit="kg m^2", rule=positive, required=.true.)
      call add_place(schema)
      call add_group(schema, "mass", "A body that moves along a line", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "value", "mass", unit="kg", rule=positive, required=.true.)
      call add_real(schema, "direction", "direction of the line beside bodies in the plane and shafts, and for &gravity, "// &
                    "of any length; along y if not given", least=2, most=3)
      call add_place(schema)
      call add_group(schema, "spring", "A spring between two places, or equal ones between several pairs", &
                     repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_pairs(schema)
      call add_direction(schema)
      call add_real(schema, "stiffness", "stiffness of all pairs together, for law='linear'", unit="N/m or N m/rad", &
                    rule=nonnegative)
      call add_real(schema, "damping", "viscous damping beside the spring, of all pairs together", unit="N s/m or N m s/rad", &
                    rule=nonnegative, default="0.0")
      call add_real(schema, "damping_factor", "viscous damping in proportion to the stiffness", unit="s", rule=nonnegative, &
                    default="0.0")
      call add_real(schema, "untuned_stiffness", "stiffness before tuning, which &damping matrix='untuned' takes", &
                    unit="N/m or N m/rad", rule=nonnegative)
      call add_spring_keys(schema)
      call add_group(schema, "damper", "A damper between two places, or equal ones between several pairs", repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_pairs(schema)
      call add_direction(schema)
      call add_real(schema, "damping", "viscous damping of all pairs together", unit="N s/m or N m s/rad", &
                    rule=nonnegative)
      call add_damper_keys(schema)
      call add_group(schema, "stop", "A stop between two places, acting on s = u1 - u2", repeatable=.true.)
      call add_name(schema)
      call add_contact_ends(schema)
      call add_real(schema, "direction", "direction in which the closed stop pushes the first end, of any length; if left "// &
                    "out, from the second point to the first, or along the line of a mass", &
                    least=2, most=3)
      call add_twist(schema)
      call add_string(schema, "side", "closes for s > clearance, for s < -clearance, or both; if left out, lower in the plane "// &
                      "or with a direction, else upper", choices=["upper", "lower", "both "])
      call add_real(schema, "clearance", "displacement up to contact; a negative one is preload", unit="m or rad", default="0.0")
      call add_gap_law_keys(schema)
      call add_motion_keys(schema, "a given motion of the second end, beside its own")
      call add_real(schema, "damping_factor", "damping of the closed contact in proportion to its stiffness, for "// &
                    "'kelvin_voigt'; added to damping", unit="s", rule=nonnegative)
      call add_group(schema, "ring", "A round hole of the second end around the first one", repeatable=.true.)
      call add_name(schema)
      call add_contact_ends(schema)
      call add_ring_keys(schema)
      call add_group(schema, "friction", "Dry friction between two places, with the velocity of sliding v = u1' - "// &
                     "u2' - belt_speed, beside shafts - radius1*omega1 - radius2*omega2 too", repeatable=.true.)
      call add_name(schema)
      call add_contact_ends(schema)
      call add_real(schema, "direction", "direction of sliding, of any length; if left out, that in which the stop or ring of "// &
                    "normal_contact, or else of only_with, pushes, turned by 90 degrees, clockwise or about +x of shafts; "// &
                    "without a stop the line "// &
                    "through the points, or that of a mass", least=2, most=3)
      call add_twist(schema)
      call add_real(schema, "radius", "radii of the rubbing surfaces about their axes, which bring in the turning of shafts; "// &
                    "one value: of the first", unit="m", least=1, most=2)
      call add_friction_keys(schema)
      call add_load_group(schema)
      call add_group(schema, "gravity", "Weight of masses, bodies, shafts, disks and housings; none without this group")
      call add_real(schema, "acceleration", "acceleration of free fall", unit="m/s^2", rule=nonnegative, default="9.81")
      call add_real(schema, "direction", "direction, of any length; against y if not given", least=2, most=3)
      call add_initial_group(schema)
   end subroutine add_connection_groups

   subroutine add_pairs(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "between", "names of two bodies (their centres), points, or 'frame'; of shafts places such as "// &
                      "'rotor.5', and housings; several pairs of bodies share the stiffness or damping equally", &
                      least=2, most=most_ends, required=.true.)
   end subroutine add_pairs

   subroutine add_contact_ends(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "between", "names of two bodies (their centres), points of such, or 'frame'; of shafts places "// &
                      "such as 'rotor.5', and housings", count=2, required=.true.)
   end subroutine add_contact_ends

   subroutine add_twist(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_logical(schema, "twist", "instead of a direction: acts on the angle of the first end against the second; so it "// &
                       "does anyway where one is an inertia, except beside shafts", default=".false.")
   end subroutine add_twist

   subroutine add_direction(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "direction", "direction in which it acts, of any length; if left out, the line through the points, "// &
                    "or that of a mass; required beside shafts", least=2, most=3)
      call add_twist(schema)
   end subroutine add_direction

   !> Where a body is in the plane; of one that only turns or has a line this is for pictures.
   subroutine add_place(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "centre", "centre of mass in the reference position, x to the right and y up", unit="m", &
                    low=-1.0e9_wp, high=1.0e9_wp, count=2, default="0.0, 0.0")
      call add_real(schema, "size", "width and height of the rectangle that stands for the body in pictures", unit="m", &
                    rule=nonnegative, count=2, default="0.0, 0.0")
   end subroutine add_place

   !> On which sides `&stop` number i closes; `in_plane`: its ends move in several directions.
   subroutine read_sides(sides, input, i, in_plane)
      logical, intent(out) :: sides(2)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      logical, intent(in) :: in_plane

      character(:), allocatable :: side

      side = merge("lower", "upper", in_plane .or. input%given("stop", i, "direction"))
      if (input%truth("stop", i, "twist")) side = "both"
      if (input%given("stop", i, "side")) side = input%choice("stop", i, "side")
      sides = side /= ["upper", "lower"]
   end subroutine read_sides

   !> Stiffness, N/m (N m/rad), and damping, N s/m (N m s/rad), of a linear spring or damper; of one with another law nothing.
   subroutine coefficients(input, group, i, stiffness, damping)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      real(wp), intent(out) :: stiffness, damping

      stiffness = 0.0_wp
      damping = 0.0_wp
      if (.not. is_linear(input, group, i)) return
      if (group == "spring") then
         stiffness = input%number(group, i, "stiffness")
         damping = stiffness*input%number(group, i, "damping_factor")
      end if
      damping = damping + input%number(group, i, "damping")
   end subroutine coefficients

   !> The key `direction` of a group with length 1; where it is not given what it was before.
   subroutine unit_direction(input, group, index, direction, error)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      real(wp), intent(inout) :: direction(:)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: given(:)

      call input%get(group, index, "direction", given)
      if (size(given) > 0) direction = 0.0_wp
      if (size(given) == size(direction)) direction = given
      if (norm2(direction) > 0.0_wp) then
         direction = direction/norm2(direction)
      else
         call input%complain(error, group, index, "direction", to_text(size(direction))//" numbers that are not all "// &
                             "zero, such as "//trim(merge("0.0, 1.0 for upwards", "0.0, 0.0, 1.0 for z ", size(direction) == 2))// &
                             trim(merge(", or twist = .true. instead", repeat(" ", 27), any(connecting == group))))
      end if
   end subroutine unit_direction

   !> Which of these `groups` is called `name` in `&record` number i: its group, number `group` of these, and its number.
   subroutine find_connection(input, i, groups, name, group, number, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: groups(:), name
      integer, intent(out) :: group, number
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      character(:), allocatable :: text

      allocate (known(0))
      do group = 1, size(groups)
         do number = 1, input%count(trim(groups(group)))
            call input%get(trim(groups(group)), number, "name", text)
            if (len(text) == 0) cycle
            call append_text(known, text)
            if (position_of(name, known(size(known):)) == 0) cycle
            if (.not. is_linear(input, trim(groups(group)), number)) then
               call input%complain(error, "record", i, "observable", "'contact_force' of a "//trim(groups(group))// &
                                   " that is not linear")
            end if
            return
         end do
      end do
      call input%complain(error, "record", i, "of", "the name of a "//trim(groups(1))//"; "// &
                          did_you_mean(name, known, "connections with names"))
   end subroutine find_connection

end module razy_scenes_connections
