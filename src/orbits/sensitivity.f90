!! How the place of a special point changes with another value of the machine.
!!
!! The point is located again with that value a little larger and smaller, so that its derivative is a central difference, and what
!! is wrong with it shows in that of steps of twice the size (Richardson's extrapolation takes the most of it away).
module razy_orbits_sensitivity
   use razy_core_kinds, only: wp
   use razy_linalg_square, only: bordered, solve_square
   use razy_orbits_locate, only: locate_near
   use razy_orbits_periodic_columns, only: differentiate
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: point_t
   use razy_orbits_touch, only: find_touch_again
   implicit none(type, external)
   private

   public :: find_slope, locate_again

   !> Steps of the other value, in parts of it, one after the other; larger for a method of larger errors.
   real(wp), parameter :: share(*) = [1.0e-4_wp, 1.0e-5_wp, 1.0e-6_wp, 1.0e-8_wp]
   real(wp), parameter :: coarse = 10.0_wp
   !> Places, in steps, and weights of differences whose error falls with the square of the step: to both sides, and to one where
   !> the machine, or the point, ends.
   real(wp), parameter :: both(*) = [-1.0_wp, 1.0_wp], both_weights(*) = [-0.5_wp, 0.5_wp]
   real(wp), parameter :: one_sided(*) = [0.0_wp, 1.0_wp, 2.0_wp], one_sided_weights(*) = [-1.5_wp, 2.0_wp, -0.5_wp]
   !> Half the lengths of the branches in which a point is looked for at first and at last, in scaled unknowns.
   real(wp), parameter :: narrow = 1.0e-6_wp, wide = 0.02_wp
   !> Differences of the two steps that are farther apart than this part of them, or, in parts of the range, than rounding leaves,
   !> are of two points.
   real(wp), parameter :: apart = 0.01_wp, rounding = 1.0e-9_wp
   !> Points are located to so much, in units of the range.
   real(wp), parameter :: located = 1.0e-13_wp

contains

   !> The derivative of the parameter, in its unit, at a special point of motions of so many periods by parameter number `other`,
   !> which is not 0; `error`: how far it may be off. If it is not `found`, problem%reason says why.
   subroutine find_slope(problem, point, periods, other, slope, error, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      integer, intent(in) :: periods, other
      real(wp), intent(out) :: slope, error
      logical, intent(out) :: found

      character(:), allocatable :: reason
      real(wp), allocatable :: drift(:)
      real(wp) :: step
      integer :: i, side

      problem%periods = periods
      call find_drift(problem, point, other, drift, found)
      if (.not. found) return
      do side = 0, 2
         do i = 1, size(share)
            step = share(i)*problem%parameter(other)*merge(coarse, 1.0_wp, problem%resolution > 0.0_wp)
            if (side == 2) step = -step
            if (side == 0) then
               call extrapolate(problem, point, other, drift, both*step, both_weights/step, slope, error, found)
            else
               call extrapolate(problem, point, other, drift, one_sided*step, one_sided_weights/step, slope, error, found)
            end if
            if (found) return
            if (.not. allocated(reason)) reason = problem%reason
         end do
      end do
      problem%reason = reason
   end subroutine find_slope

   !> The derivative from differences of these steps and of twice the steps.
   subroutine extrapolate(problem, point, other, drift, steps, weights, slope, error, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      integer, intent(in) :: other
      real(wp), intent(in) :: drift(:), steps(:), weights(:)
      real(wp), intent(out) :: slope, error
      logical, intent(out) :: found

      real(wp) :: by(2), value, where
      integer :: i, k

      slope = 0.0_wp
      error = 0.0_wp
      by = 0.0_wp
      value = problem%parameter(other)
      do k = 1, 2
         do i = 1, size(steps)
            problem%parameter(other) = value + k*steps(i)
            call locate_again(problem, point, point%orbit%u + k*steps(i)*drift, where, found)
            if (.not. found) exit
            by(k) = by(k) + weights(i)*where/k
         end do
         if (.not. found) exit
      end do
      problem%parameter(other) = value
      if (.not. found) return
      found = abs(by(1) - by(2)) <= apart*abs(by(1)) + rounding*problem%range*maxval(abs(weights))
      if (.not. found) problem%reason = "what is found with one step is another than with half of it"
      slope = (4*by(1) - by(2))/3
      error = max(abs(by(1) - by(2)), located*problem%range*sum(abs(weights)))
   end subroutine extrapolate

   !> How the motion changes with parameter number `other`, in the plane across its branch: unknowns per unit of it.
   subroutine find_drift(problem, point, other, drift, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      integer, intent(in) :: other
      real(wp), allocatable, intent(out) :: drift(:)
      logical, intent(out) :: ok

      type(orbit_t) :: here, there
      real(wp), allocatable :: matrix(:, :)
      real(wp) :: range

      there = point%orbit
      call problem%begin_as(there)
      drift = 0*there%u
      ! Where several stops are touched at once each motion beside this one may have an impact.
      call problem%map%keep_unchanged(there%sequence)
      call problem%evaluate(there%u, .false., here, ok)
      if (ok) there%residual = here%residual
      matrix = bordered(problem%jacobian(there), point%tangent)
      associate (last => size(there%u), held => problem%parameter(1), value => problem%parameter(other))
         range = problem%range
         held = there%u(last)*range
         problem%active = other
         problem%range = abs(value)
         there%u(last) = value/problem%range
         if (ok) call differentiate(problem, there, ok)
         problem%active = 1
         problem%range = range
         call problem%map%keep([integer ::], [integer ::], [integer ::])
         ! Of a machine that ends there the point is expected where it is.
         if (ok) drift(:last - 1) = -there%column(:, size(there%column, 2))/abs(value)
      end associate
      if (ok) call solve_square(matrix, drift, ok)
      if (.not. ok) problem%reason = "the motion has no derivative there"
   end subroutine find_drift

   !> The parameter where the point is in the machine as it is now, expected at these unknowns.
   subroutine locate_again(problem, point, expected, value, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: expected(:)
      real(wp), intent(out) :: value
      logical, intent(out) :: found

      real(wp), allocatable :: u(:)
      type(point_t) :: there

      value = 0.0_wp
      call problem%begin_as(point%orbit)
      call problem%go_to(expected, found)
      if (.not. found) return
      problem%reason = "there is no "//point%label//" near"
      ! Beyond the touch of a stop whose force jumps motions are no neighbours.
      if (point%touches) then
         call find_touch_again(problem, expected, point%tangent, point%orbit%sequence, point%contact, u, there%orbit, found)
      else
         there = point
         call locate_near(problem, point%label, point%contact, expected, point%tangent, narrow, wide, there, &
                          found)
         if (found) u = there%orbit%u
      end if
      if (found) value = u(size(u))*problem%range
   end subroutine locate_again

end module razy_orbits_sensitivity
