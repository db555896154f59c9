!! From a point of a branch to another branch through it: that of twice the period at a doubling, the other one at a branch point.
module razy_orbits_switch
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: right_eigen
   use razy_orbits_branch, only: point_t
   use razy_orbits_identity, only: has_part
   use razy_orbits_orbit, only: orbit_t, problem_t
   implicit none(type, external)
   private

   public :: switch_branch

   !> First distances from the point, in scaled unknowns, one after the other; a motion farther off than so many of them is another.
   real(wp), parameter :: nearest = 50.0_wp
   real(wp), parameter :: distances(*) = [1.0e-3_wp, 1.0e-4_wp, 1.0e-5_wp, 1.0e-2_wp]

contains

   !> The first motion of the other branch through `point`, and the direction in which it goes on; on the other side if not
   !> `forward`. At a doubling the problem's periods double.
   subroutine switch_branch(problem, point, forward, orbit, guide, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      logical, intent(in) :: forward
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: guide(:)
      logical, intent(out) :: ok

      integer :: i
      logical :: has

      guide = direction_of(problem, point)
      if (.not. forward) guide = -guide
      if (point%label == "PD") problem%periods = 2*problem%periods
      do i = 1, size(distances)
         if (allocated(orbit%column)) deallocate (orbit%column)
         call problem%correct(point%orbit%u + distances(i)*guide, guide, orbit, ok)
         ! Of all motions in the plane across the direction the nearest.
         if (ok) ok = norm2(orbit%u - point%orbit%u) < nearest*distances(i)
         if (ok .and. point%label == "PD") then
            ! After half the period the motion is on the other side of the point, twice as far off.
            call has_part(problem, orbit, distances(i)/2, has)
            ok = .not. has
         end if
         if (ok) call problem%complete(orbit, ok)
         if (ok) return
      end do
   end subroutine switch_branch

   !> The unit vector of the multiplier -1 or 1, across the tangent of the branch.
   function direction_of(problem, point) result(direction)
      type(problem_t), intent(in) :: problem
      type(point_t), intent(in) :: point
      real(wp), allocatable :: direction(:)

      complex(wp), allocatable :: values(:), vectors(:, :)
      real(wp), allocatable :: matrix(:, :)
      integer :: info, k, n

      n = problem%map%n
      matrix = point%orbit%derivative
      allocate (values(n), vectors(n, n))
      call right_eigen(matrix, values, info, vectors)
      k = minloc(abs(values - merge(-1.0_wp, 1.0_wp, point%label == "PD")), dim=1)
      direction = 0*point%orbit%u
      direction(:n) = real(vectors(:, k), wp)
      direction = direction/problem%scales()
      direction = direction - point%tangent*(dot_product(direction, point%tangent))
      if (point%label == "PD") direction(size(direction)) = 0.0_wp
      direction = direction/norm2(direction)
   end function direction_of

end module razy_orbits_switch
