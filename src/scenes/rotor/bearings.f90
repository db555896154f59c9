!! Bearings and seals of a rotor scene: rolling elements, matrices, stiffness from geometry, or coefficients over the speed.
module razy_scenes_rotor_bearings
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_text, only: lower, string_t, texts_of
   use razy_core_text_columns, only: read_text_columns
   use razy_rotor_bearing, only: bearing_t, given_bearing, rolling_bearing, rolling_row_t, table_columns, tabled_bearing
   use razy_rotor_hertz, only: ball_race_t, ball_stiffness, roller_stiffness
   use razy_rotor_rotor, only: rotor_t
   use razy_linalg_dense, only: add_outer
   use razy_linalg_speed_table, only: new_speed_table, speed_table_t
   use razy_scenes_connections, only: coefficients, unit_direction
   use razy_scenes_rotor_places, only: find_ends, find_node, find_place
   use razy_scenes_rotor_schema, only: bearing_kinds, bearing_matrix, bearing_roller, bearing_rolling, bearing_table
   implicit none(type, external)
   private

   public :: check_tables, exponents, read_bearing, read_radial, read_spring

   !> n of Q = K delta^n, for each of `bearing_kinds`.
   real(wp), parameter :: exponents(size(bearing_kinds)) = [1.0_wp, 1.0_wp, 1.5_wp, 10.0_wp/9, 1.0_wp]

contains

   !> Bearing i of the input; `one_by_one`: rolling elements with clearance push by contacts, not by its matrices.
   subroutine read_bearing(bearing, rotor, input, i, one_by_one, error)
      type(bearing_t), intent(out) :: bearing
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      logical, intent(in) :: one_by_one
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: place

      call check_keys(input, i, error)
      if (.not. allocated(error)) call read_coefficients(bearing, rotor, input, i, one_by_one, error)
      if (allocated(error) .or. .not. input%given("bearing", i, "to")) return
      call input%get("bearing", i, "to", place)
      if (lower(place) == "frame") return
      call find_place(rotor, input, "bearing", i, "to", place, bearing%to_shaft, bearing%to_node, error)
      if (allocated(error)) return
      if (bearing%to_shaft == bearing%shaft) then
         call input%complain(error, "bearing", i, "to", "a place on another shaft, or a housing")
      else if (allocated(bearing%table)) then
         call input%complain(error, "bearing", i, "to", "left out with kind = 'table', which is of a bearing on the frame")
      end if
   end subroutine read_bearing

   !> Number i of `group`, spring or damper, as a bearing of one direction.
   subroutine read_spring(bearing, rotor, input, group, i, error)
      type(bearing_t), intent(out) :: bearing
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: across(6, 6), damping, row(6), stiffness
      integer :: first, node(2), shaft(2)
      logical :: twist

      call find_ends(shaft, node, rotor, input, group, i, error)
      if (allocated(error)) return
      twist = input%truth(group, i, "twist")
      row = [0.0_wp, 0.0_wp, 0.0_wp, merge(1.0_wp, 0.0_wp, twist), 0.0_wp, 0.0_wp]
      if (.not. twist) call unit_direction(input, group, i, row(:3), error)
      if (allocated(error)) return
      call coefficients(input, group, i, stiffness, damping)
      across = 0.0_wp
      call add_outer(across, 1.0_wp, row)
      first = merge(1, 2, shaft(1) > 0)
      bearing = given_bearing(shaft(first), node(first), stiffness*across, damping*across)
      bearing%to_shaft = shaft(3 - first)
      bearing%to_node = node(3 - first)
   end subroutine read_spring

   !> Its first end, and its matrices.
   subroutine read_coefficients(bearing, rotor, input, i, one_by_one, error)
      type(bearing_t), intent(out) :: bearing
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      logical, intent(in) :: one_by_one
      type(error_t), allocatable, intent(out) :: error

      type(rolling_row_t) :: row
      type(speed_table_t) :: table
      real(wp) :: damping(6, 6), stiffness(6, 6)
      integer :: kind, node, shaft

      call find_node(rotor, input, "bearing", i, shaft, node, error)
      if (allocated(error)) return
      kind = findloc(bearing_kinds == input%choice("bearing", i, "kind"), .true., dim=1)
      if (kind == bearing_matrix) then
         call need(input, i, kind, ["stiffness"], error)
         if (.not. allocated(error)) call read_matrix(stiffness, input, i, "stiffness", error)
         if (.not. allocated(error)) call read_matrix(damping, input, i, "damping_matrix", error)
         if (.not. allocated(error)) bearing = given_bearing(shaft, node, stiffness, damping)
         return
      end if
      if (kind == bearing_table) then
         call need(input, i, kind, ["file"], error)
         if (.not. allocated(error)) call read_table(table, input, i, error)
         if (.not. allocated(error)) bearing = tabled_bearing(shaft, node, table)
         return
      end if
      call need(input, i, kind, ["elements"], error)
      if (.not. (allocated(error) .or. (one_by_one .and. input%given("bearing", i, "clearance")))) then
         call read_radial(row%radial, input, i, kind, input%number("bearing", i, "element_load", otherwise=1.0_wp), error)
         if (.not. allocated(error) .and. kind /= bearing_rolling) call need(input, i, kind, ["element_load"], error)
      end if
      if (allocated(error)) return
      call input%get("bearing", i, "elements", row%elements)
      call input%get("bearing", i, "axial_stiffness", row%axial)
      call input%get("bearing", i, "axial_radius", row%axial_radius)
      call input%get("bearing", i, "first_angle", row%first_angle)
      call input%get("bearing", i, "offset", row%offset)
      call input%get("bearing", i, "damping_factor", row%damping_factor)
      bearing = rolling_bearing(shaft, node, row)
   end subroutine read_coefficients

   !> The table in the file of bearing i.
   subroutine read_table(table, input, i, error)
      type(speed_table_t), intent(out) :: table
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: values(:, :)
      integer :: k

      call read_text_columns(input%text("bearing", i, "file"), [string_t("speed_rpm"), texts_of(table_columns)], values, error)
      if (allocated(error)) return
      if (size(values, 1) < 2) call input%complain(error, "bearing", i, "file", "a file with at least two speeds")
      if (allocated(error)) return
      associate (rpm => values(:, 1))
         k = findloc([rpm(1) >= 0.0_wp, rpm(2:) > rpm(:size(rpm) - 1)], .false., dim=1)
         if (k > 0) call input%complain(error, "bearing", i, "file", "a file whose speed_rpm is not negative and rises from "// &
                                        "row to row; row "//to_text(k)//" has "//decimal(rpm(max(k, 1)), 3))
      end associate
      if (allocated(error)) return
      table = new_speed_table(values(:, 1)*pi/30, transpose(values(:, 2:)))
   end subroutine read_table

   !> Whether the speed of &rotation in `key` of `group` is one that all tables of bearings have.
   subroutine check_tables(rotor, input, group, key, error)
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      type(error_t), allocatable, intent(out) :: error

      real(wp), parameter :: rounding = 1.0e-12_wp
      real(wp) :: ratio, slowest, speed(2)
      integer :: i

      do i = 1, size(rotor%bearing)
         if (.not. allocated(rotor%bearing(i)%table)) cycle
         if (input%count(group) == 0) call input%complain(error, group, 1, key, "required by the table of bearing "//to_text(i))
         if (allocated(error)) return
         call input%get(group, 1, key, speed(1))
         speed(2) = speed(1)
         if (group == "rotation" .and. input%count("motion") > 0) then
            speed(2) = speed(1) + input%number(group, 1, "acceleration_rpm_per_s")*input%number("motion", 1, "t_end")
         end if
         ratio = abs(rotor%shaft(rotor%bearing(i)%shaft)%speed_ratio)
         ! Where the rotation turns back it has been at rest.
         slowest = merge(0.0_wp, minval(abs(speed)), product(speed) < 0.0_wp)*ratio*pi/30
         associate (known => rotor%bearing(i)%table%speed)
            if (slowest >= (1 - rounding)*known(1) .and. maxval(abs(speed))*ratio*pi/30 <= (1 + rounding)*known(size(known))) cycle
            call input%complain(error, group, 1, key, "such that the shaft of bearing "//to_text(i)//" turns with the "// &
                                "speeds of its table, "//decimal(known(1)*30/pi, 1)//" to "// &
                                decimal(known(size(known))*30/pi, 1)//" rpm, all the time")
         end associate
         return
      end do
   end subroutine check_tables

   !> Refuse keys that other kinds of bearings have, and those that belong to a clearance where there is none.
   subroutine check_keys(input, i, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: with_it(*) = [character(17) :: "contact_stiffness", "hysteresis", "cage_ratio"]
      character(*), parameter :: keys(*) = [character(16) :: "clearance", "elements", "axial_stiffness", "axial_radius", &
                                                     "first_angle", "offset", "damping_factor", "ball_diameter", "pitch_diameter", &
                                                        "element_load", "stiffness", "damping_matrix", "file", "radial_stiffness", &
                                                  "inner_groove", "outer_groove", "young_modulus", "poisson_ratio", "roller_length"]
      ! The kinds that have each of them.
      character(*), parameter :: owners(*) = [character(19) :: spread("rolling ball roller", 1, 9), "ball roller", "matrix", &
                                                                       "matrix", "table", "rolling", spread("ball", 1, 4), "roller"]
      character(:), allocatable :: kind
      integer :: k

      kind = input%choice("bearing", i, "kind")
      associate (others => pack(keys, index(owners, kind) == 0))
         k = findloc([(input%differs("bearing", i, trim(others(k))), k=1, size(others))], .true., dim=1)
         if (k > 0) call input%complain(error, "bearing", i, trim(others(k)), "left out with kind = '"//kind//"'")
      end associate
      if (allocated(error) .or. input%given("bearing", i, "clearance")) return
      k = findloc([(input%given("bearing", i, trim(with_it(k))), k=1, size(with_it))], .true., dim=1)
      if (k > 0) call input%complain(error, "bearing", i, trim(with_it(k)), "only with a clearance")
   end subroutine check_keys

   !> Radial stiffness of a rolling element at a load, N, given or from its geometry.
   subroutine read_radial(radial, input, i, kind, load, error)
      real(wp), intent(out) :: radial
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, kind
      real(wp), intent(in) :: load
      type(error_t), allocatable, intent(out) :: error

      type(ball_race_t) :: race

      radial = 0.0_wp
      if (input%given("bearing", i, "contact_stiffness")) then
         associate (n => exponents(kind))
            radial = n*input%number("bearing", i, "contact_stiffness")**(1/n)*load**(1 - 1/n)
         end associate
         return
      end if
      select case (kind)
      case (bearing_rolling)
         call need(input, i, kind, ["radial_stiffness"], error)
         if (.not. allocated(error)) call input%get("bearing", i, "radial_stiffness", radial)
      case (bearing_roller)
         call need(input, i, kind, ["roller_length"], error)
         if (.not. allocated(error)) radial = roller_stiffness(input%number("bearing", i, "roller_length"), load)
      case default
         call need(input, i, kind, [character(14) :: "ball_diameter", "pitch_diameter", "inner_groove", "outer_groove"], error)
         if (allocated(error)) return
         call input%get("bearing", i, "ball_diameter", race%ball)
         call input%get("bearing", i, "pitch_diameter", race%pitch)
         call input%get("bearing", i, "inner_groove", race%inner_groove)
         call input%get("bearing", i, "outer_groove", race%outer_groove)
         call input%get("bearing", i, "young_modulus", race%young)
         call input%get("bearing", i, "poisson_ratio", race%poisson)
         if (race%pitch <= race%ball) then
            call input%complain(error, "bearing", i, "pitch_diameter", "more than the diameter of the balls")
         else if (min(race%inner_groove, race%outer_groove) <= race%ball/2) then
            call input%complain(error, "bearing", i, "inner_groove", "grooves of a radius more than that of the balls")
         else
            radial = ball_stiffness(race, load)
         end if
      end select
   end subroutine read_radial

   !> Complain about the first of `keys` that is not given.
   subroutine need(input, i, kind, keys, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, kind
      character(*), intent(in) :: keys(:)
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      k = findloc([(input%given("bearing", i, trim(keys(k))), k=1, size(keys))], .false., dim=1)
      if (k > 0) call input%complain(error, "bearing", i, trim(keys(k)), "required by kind = '"//trim(bearing_kinds(kind))//"'")
   end subroutine need

   !> A matrix (6, 6) from its diagonal or the rows of some of its coordinates; zero if not given.
   subroutine read_matrix(matrix, input, i, key, error)
      real(wp), intent(out) :: matrix(6, 6)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: key
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: values(:)
      integer :: k

      matrix = 0.0_wp
      if (.not. input%given("bearing", i, key)) return
      call input%get("bearing", i, key, values)
      select case (size(values))
      case (4)
         call place([2, 3])
      case (6)
         do k = 1, 6
            matrix(k, k) = values(k)
         end do
      case (16)
         call place([2, 3, 5, 6])
      case (25)
         call place([1, 2, 3, 5, 6])
      case (36)
         call place([1, 2, 3, 4, 5, 6])
      case default
         call input%complain(error, "bearing", i, key, "6 values, the diagonal, or row by row 4 (v, w), 16 (v, w, theta, psi), "// &
                             "25 (and u) or 36 (and phi)")
         return
      end select
      if (any([(matrix(k, k), k=1, 6)] < 0.0_wp)) then
         call input%complain(error, "bearing", i, key, "a matrix without negative values on its diagonal")
      end if

   contains

      !> The values are the rows of these coordinates.
      subroutine place(at)
         integer, intent(in) :: at(:)

         matrix(at, at) = transpose(reshape(values, [size(at), size(at)]))
      end subroutine place

   end subroutine read_matrix

end module razy_scenes_rotor_bearings
