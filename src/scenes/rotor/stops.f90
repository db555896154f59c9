!! Stops and dry friction of a rotor scene: a node against the frame or against a node of another shaft, with or without rubbing.
!!
!! A stop in direction n pushes its first node along n; s = n·(u1 - u2) as in a planar scene. A friction element in direction t
!! has surfaces at the radii R1 and R2 about the axes, on the sides that face each other. They move with the turning shafts, so
!!
!!     s' = t·(u1' - u2') - p (R1 (Ω1 + φ1') + R2 (Ω2 + φ2')) - belt speed,
!!
!! p being the length of t across the axis: with t = e_x x n the surface point of a shaft pushed along n is -R1 n from its axis,
!! and e_x x (-R1 n) = -R1 t. The friction force so has the moment R1 F about the first axis. A ring pushes its first node to its
!! centre, from wherever in the plane across the axis this is, and what rubs on it slides likewise along t = e_x x n.
module razy_scenes_rotor_stops
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_input_input, only: input_t
   use razy_rotor_model, only: rotor_model_t
   use razy_machine_frame, only: frame_t
   use razy_scenes_connections, only: connecting, read_sides, unit_direction
   use razy_scenes_harmonics, only: read_rotation
   use razy_scenes_rotor_places, only: find_ends
   use razy_scenes_scene, only: site_t
   use razy_scenes_tables, only: is_linear
   implicit none(type, external)
   private

   public :: find_rotor_site

   !> Shaft and node of both ends, 0 for the frame.
   type :: ends_t
      integer :: shaft(2) = 0, node(2) = 0
   end type ends_t

   integer, parameter :: phi = 4

contains

   !> Where number i of `group` acts on a machine with the coordinates of `basis` (coordinates of the model, of the machine).
   !> `ratio` (shafts) are the speeds of the shafts over that of `&rotation`.
   subroutine find_rotor_site(site, model, basis, ratio, input, group, i, stop, error)
      type(site_t), intent(out) :: site
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :)
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, stop
      type(error_t), allocatable, intent(out) :: error

      type(ends_t) :: between, ring_between
      real(wp), allocatable :: given(:)
      real(wp) :: acceleration, across, direction(3), radius(2), speed
      integer :: end, ring

      direction = 0.0_wp
      radius = 0.0_wp
      ring = merge(i, stop - input%count("stop"), group == "ring")
      call find_between(between, model, input, group, i, error)
      if (allocated(error)) return
      if (group == "stop") call read_sides(site%sides, input, i, .true.)
      site%turns = input%truth(group, i, "twist")
      if (site%turns .and. input%given(group, i, "direction")) then
         call input%complain(error, group, i, "direction", "left out where twist is .true.")
      else if (site%turns) then
         radius = [-1.0_wp, 1.0_wp]
      else if (ring > 0) then
         direction = [0.0_wp, 1.0_wp, 0.0_wp]
         call find_between(ring_between, model, input, "ring", ring, error)
         if (allocated(error)) return
         if (any([between%shaft, between%node] /= [ring_between%shaft, ring_between%node])) then
            call input%complain(error, group, i, "between", "the ends of the ring that it rubs on")
         else if (input%given(group, i, "direction")) then
            call input%complain(error, group, i, "direction", "left out where the element rubs on a ring")
         end if
      else if (input%given(group, i, "direction")) then
         call unit_direction(input, group, i, direction, error)
      else if (stop > 0) then
         if (input%given("stop", stop, "direction")) call unit_direction(input, "stop", stop, direction, error)
         direction = [0.0_wp, -direction(3), direction(2)]
         across = norm2(direction)
         if (across > 0.0_wp) direction = direction/across
      end if
      if (allocated(error)) return
      if (.not. (norm2(direction) > 0.0_wp .or. site%turns)) then
         call input%complain(error, group, i, "direction", "required, such as 0.0, 0.0, 1.0 for z"// &
                             trim(merge(", where no stop across the axis gives it", &
                                        ", or twist = .true. instead             ", group == "friction")))
         return
      end if
      if (input%given(group, i, "radius") .and. .not. site%turns) then
         call input%get(group, i, "radius", given)
         radius(:size(given)) = given
         radius = radius*norm2(direction(2:))
      end if
      if (ring > 0) then
         call find_frame(site, model, basis, input, group, i, ring, between, -radius, error)
      else
         site%w = row_of(model, basis, between, direction, -radius)
         call check_row(site%w, input, group, i, error)
      end if
      if (allocated(error) .or. input%count("rotation") == 0 .or. group /= "friction") return
      call read_rotation(speed, acceleration, input)
      do end = 1, 2
         if (between%shaft(end) == 0 .or. .not. abs(radius(end)) > 0.0_wp) cycle
         if (.not. model%rotor%shaft(between%shaft(end))%turns) cycle
         if (.not. model%rotor%shaft(between%shaft(end))%speed_known) call input%complain( &
            error, group, i, trim(merge("between", "radius ", site%turns)), &
            "none on a shaft whose speed is not known from teeth, speed_ratio or springs on angles")
         if (allocated(error)) return
         site%drive = site%drive - radius(end)*real(ratio(between%shaft(end)), wp)*speed*pi/30
         site%drive_rate = site%drive_rate - radius(end)*real(ratio(between%shaft(end)), wp)*acceleration*pi/30
      end do
   end subroutine find_rotor_site

   !> The nodes that a group is between.
   subroutine find_between(between, model, input, group, i, error)
      type(ends_t), intent(out) :: between
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      logical :: contact
      integer :: at(6), end

      call find_ends(between%shaft, between%node, model%rotor, input, group, i, error)
      contact = .not. is_linear(input, group, i)
      contact = contact .or. all(connecting /= group)
      do end = 1, 2
         if (allocated(error)) return
         if (between%shaft(end) == 0 .or. .not. contact) cycle
         at = model%numbering%of(between%shaft(end), between%node(end))
         if (.not. model%have_mass(at(:phi))) then
            call input%complain(error, group, i, "between", "nodes with mass and polar inertia, such as a &disk gives them "// &
                                "(without &freedom torsion no inertia)")
         end if
      end do
   end subroutine find_between

   !> The rows of ring number `ring`, or of what rubs on it with turn(1) φ1 + turn(2) φ2.
   subroutine find_frame(site, model, basis, input, group, i, ring, between, turn, error)
      type(site_t), intent(inout) :: site
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :), turn(2)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, ring
      type(ends_t), intent(in) :: between
      type(error_t), allocatable, intent(out) :: error

      site%w = row_of(model, basis, between, [0.0_wp, 1.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])
      site%frame = frame_t(row_of(model, basis, between, [0.0_wp, 0.0_wp, 1.0_wp], [0.0_wp, 0.0_wp]), &
                           row_of(model, basis, between, [0.0_wp, 0.0_wp, 0.0_wp], turn), input%list("ring", ring, "offset"))
      site%sides = [.false., .true.]
      call check_row(site%w, input, group, i, error)
      if (.not. allocated(error)) call check_row(site%frame%across, input, group, i, error)
   end subroutine find_frame

   !> The row of direction·(u1 - u2) + turn(1) φ1 + turn(2) φ2 on the coordinates of the machine.
   pure function row_of(model, basis, between, direction, turn) result(row)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :), direction(3), turn(2)
      type(ends_t), intent(in) :: between
      real(wp), allocatable :: row(:)

      real(wp) :: part(phi)
      integer :: at(6), end, k

      allocate (row(size(basis, 2)), source=0.0_wp)
      do end = 1, 2
         if (between%shaft(end) == 0) cycle
         at = model%numbering%of(between%shaft(end), between%node(end))
         part = [merge(direction, -direction, end == 1), turn(end)]
         do k = 1, phi
            if (at(k) > 0) row = row + part(k)*basis(at(k), :)
         end do
      end do
   end function row_of

   subroutine check_row(row, input, group, i, error)
      real(wp), intent(in) :: row(:)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      if (norm2(row) > 0.0_wp) return
      call input%complain(error, group, i, merge("direction", "between  ", input%given(group, i, "direction")), &
                          "with an end that can move there: not held by a &support, not left out by &freedom")
   end subroutine check_row

end module razy_scenes_rotor_stops
