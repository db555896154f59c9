!! Bearings of a rotor scene: rolling elements, matrices, or stiffness from geometry.
module razy_scenes_rotor_bearings
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_core_text, only: lower
   use razy_rotor_bearing, only: bearing_t, given_bearing, rolling_bearing, rolling_row_t
   use razy_rotor_hertz, only: ball_race_t, ball_stiffness, roller_stiffness
   use razy_rotor_rotor, only: rotor_t
   use razy_scenes_rotor_places, only: find_node
   use razy_scenes_rotor_schema, only: bearing_kinds, bearing_matrix, bearing_roller, bearing_rolling
   implicit none(type, external)
   private

   public :: read_bearing

contains

   !> Bearing i of the input.
   subroutine read_bearing(bearing, rotor, input, i, error)
      type(bearing_t), intent(out) :: bearing
      type(rotor_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(rolling_row_t) :: row
      real(wp) :: damping(6, 6), stiffness(6, 6)
      character(:), allocatable :: text
      integer :: kind, node, shaft

      call find_node(rotor, input, "bearing", i, shaft, node, error)
      if (allocated(error)) return
      call input%get("bearing", i, "kind", text)
      kind = findloc(bearing_kinds, lower(text), dim=1)
      if (kind == bearing_matrix) then
         call need(input, i, kind, ["stiffness"], error)
         if (.not. allocated(error)) call read_matrix(stiffness, input, i, "stiffness", error)
         if (.not. allocated(error)) call read_matrix(damping, input, i, "damping_matrix", error)
         if (.not. allocated(error)) bearing = given_bearing(shaft, node, stiffness, damping)
         return
      end if
      call need(input, i, kind, ["elements"], error)
      if (.not. allocated(error)) call read_radial(row%radial, input, i, kind, error)
      if (allocated(error)) return
      call input%get("bearing", i, "elements", row%elements)
      call input%get("bearing", i, "axial_stiffness", row%axial)
      call input%get("bearing", i, "axial_radius", row%axial_radius)
      call input%get("bearing", i, "first_angle", row%first_angle)
      call input%get("bearing", i, "offset", row%offset)
      call input%get("bearing", i, "damping_factor", row%damping_factor)
      row%first_angle = row%first_angle*pi/180
      bearing = rolling_bearing(shaft, node, row)
   end subroutine read_bearing

   !> Radial stiffness of a rolling element, given or from its geometry.
   subroutine read_radial(radial, input, i, kind, error)
      real(wp), intent(out) :: radial
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, kind
      type(error_t), allocatable, intent(out) :: error

      type(ball_race_t) :: race
      real(wp) :: length, load

      radial = 0.0_wp
      select case (kind)
      case (bearing_rolling)
         call need(input, i, kind, ["radial_stiffness"], error)
         if (.not. allocated(error)) call input%get("bearing", i, "radial_stiffness", radial)
      case (bearing_roller)
         call need(input, i, kind, ["roller_length", "element_load "], error)
         if (allocated(error)) return
         call input%get("bearing", i, "roller_length", length)
         call input%get("bearing", i, "element_load", load)
         radial = roller_stiffness(length, load)
      case default
         call need(input, i, kind, [character(14) :: "ball_diameter", "pitch_diameter", "inner_groove", "outer_groove", &
                                    "element_load"], error)
         if (allocated(error)) return
         call input%get("bearing", i, "ball_diameter", race%ball)
         call input%get("bearing", i, "pitch_diameter", race%pitch)
         call input%get("bearing", i, "inner_groove", race%inner_groove)
         call input%get("bearing", i, "outer_groove", race%outer_groove)
         call input%get("bearing", i, "young_modulus", race%young)
         call input%get("bearing", i, "poisson_ratio", race%poisson)
         call input%get("bearing", i, "element_load", load)
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

      do k = 1, size(keys)
         if (input%given("bearing", i, trim(keys(k)))) cycle
         call input%complain(error, "bearing", i, trim(keys(k)), "required by kind = '"//trim(bearing_kinds(kind))//"'")
         return
      end do
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
