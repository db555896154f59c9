!! What drives a planar machine beside loads: weight, and counter-rotating eccentrics (source thesis, 4.86-4.88).
!!
!! An exciter has two rotors on axes at p - l t and p + l t from the centre of mass, t across the direction n of the
!! resultant (t is to the right where n is up). With ω = 2πf, phases θ1 = ωt + φ and θ2 = θ1 + φ0 and U = unbalance
!!
!!     F1 = U ω² (sin θ1 n + cos θ1 t),   F2 = U ω² (sin θ2 n - cos θ2 t),
!!
!! so that for φ0 = 0 the resultant is 2 U ω² sin θ1 n through p. The eccentrics are part of the body; that their axes
!! move is left out, as in the source.
module razy_scenes_parts_excitation
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_input_input, only: input_t
   use razy_scenes_connections, only: unit_direction
   use razy_scenes_harmonics, only: add_harmonics, frequency_t, harmonics_t
   use razy_scenes_parts_bodies, only: add_motion, add_righting, bodies_t, centre_of, find_point, of_body, point_t
   implicit none(type, external)
   private

   public :: add_exciters, add_weights, exciter_axes, read_gravity

contains

   !> Add the weight of all bodies to the constant loads (coordinates), N or N m, and to K what it does against the turning of
   !> bodies that others hang from or stand on.
   subroutine add_weights(load, stiffness, bodies, input, error)
      real(wp), intent(inout) :: load(:), stiffness(:, :)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: gravity(2), righting(size(load))
      integer :: b, i

      call read_gravity(gravity, input, error)
      if (allocated(error)) return
      righting = 0.0_wp
      do b = 1, bodies%count
         call add_motion(load, bodies, centre_of(bodies, b), bodies%body_mass(b)*gravity)
         call add_righting(righting, bodies, centre_of(bodies, b), bodies%body_mass(b)*gravity)
      end do
      do i = 1, size(load)
         stiffness(i, i) = stiffness(i, i) + righting(i)
      end do
   end subroutine add_weights

   !> The acceleration of free fall, m/s².
   subroutine read_gravity(gravity, input, error)
      real(wp), intent(out) :: gravity(2)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      gravity = 0.0_wp
      if (input%count("gravity") == 0) return
      gravity = [0.0_wp, -1.0_wp]
      call unit_direction(input, "gravity", 1, gravity, error)
      gravity = input%number("gravity", 1, "acceleration")*gravity
   end subroutine read_gravity

   !> Add the forces of all exciters to the harmonics of the machine.
   subroutine add_exciters(bodies, input, harmonics, error)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(point_t) :: axis(2)
      complex(wp) :: at
      real(wp) :: across(2), along(2), force, frequency, phase, phase_error
      real(wp), dimension(size(bodies%mass)) :: x, y
      integer :: i, k

      do i = 1, input%count("exciter")
         call exciter_axes(bodies, input, i, axis, along, error)
         if (.not. allocated(error)) call rotor_force(input, i, force, error)
         if (allocated(error)) return
         call input%get("exciter", i, "frequency", frequency)
         call input%get("exciter", i, "phase", phase)
         call input%get("exciter", i, "phase_error", phase_error)
         do k = 1, 2
            across = merge(1, -1, k == 1)*[along(2), -along(1)]
            at = turn(phase + merge(phase_error, 0.0_wp, k == 2))
            x = 0.0_wp
            y = 0.0_wp
            call add_motion(x, bodies, axis(k), force*along)
            call add_motion(y, bodies, axis(k), force*across)
            call add_harmonics(harmonics, frequency_t(hertz=real(frequency, qp)), at%im*x + at%re*y, &
                               at%re*x - at%im*y)
         end do
      end do
   end subroutine add_exciters

   !> The axes of both rotors of exciter i, and the direction of the resultant.
   subroutine exciter_axes(bodies, input, i, axis, along, error)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(point_t), intent(out) :: axis(2)
      real(wp), intent(out) :: along(2)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: position(:)
      real(wp) :: arm, across(2)
      integer :: k

      along = 0.0_wp
      call find_point(bodies, input, "exciter", i, "on", 1, axis(1), error)
      if (allocated(error)) return
      if (bodies%kind(axis(1)%body) /= of_body) call input%complain(error, "exciter", i, "on", &
                                                                    "the name of a body or of a point of a body")
      if (.not. allocated(error)) call unit_direction(input, "exciter", i, along, error)
      if (allocated(error)) return
      axis(2) = axis(1)
      call input%get("exciter", i, "position", position)
      call input%get("exciter", i, "arm", arm)
      do k = 1, 2
         across = merge(-arm, arm, k == 1)*[along(2), -along(1)]
         axis(k)%arm = axis(k)%arm + position + across
         axis(k)%place = axis(k)%place + position + across
      end do
   end subroutine exciter_axes

   !> Centrifugal force U ω² of each rotor of exciter i, N, from the unbalance, or from the resultant at another frequency.
   subroutine rotor_force(input, i, force, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      real(wp), intent(out) :: force
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: frequency

      force = 0.0_wp
      call input%get("exciter", i, "frequency", frequency)
      if (input%given("exciter", i, "unbalance") .eqv. input%given("exciter", i, "force")) then
         call input%complain(error, "exciter", i, "unbalance", "one of unbalance and force has to be given")
      else if (input%given("exciter", i, "force") .neqv. input%given("exciter", i, "force_frequency")) then
         call input%complain(error, "exciter", i, "force_frequency", "goes with force, which it is the frequency of")
      else if (input%given("exciter", i, "force")) then
         force = input%number("exciter", i, "force")/2*(frequency/input%number("exciter", i, "force_frequency"))**2
      else
         force = input%number("exciter", i, "unbalance")*(2*pi*frequency)**2
      end if
   end subroutine rotor_force

end module razy_scenes_parts_excitation
