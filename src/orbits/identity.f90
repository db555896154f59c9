!! Which motion it is: whether a part of the period is a period already, and whether two motions are one that begins elsewhere.
module razy_orbits_identity
   use razy_core_kinds, only: wp
   use razy_orbits_orbit, only: orbit_t, problem_t
   implicit none(type, external)
   private

   public :: has_part, is_same_motion, least_part, part_way, parts

   !> A motion whose halves, or other parts, differ by less than this part of what they should is one of a part of the period.
   real(wp), parameter :: least_part = 1.0e-3_wp
   !> Into how many parts the periods may fall.
   integer, parameter :: parts(*) = [2, 3, 5, 7, 11, 13]
   !> States nearer than this, relative to their size, are one.
   real(wp), parameter :: same = 1.0e-6_wp

contains

   !> How far a motion whose periods can be shared out in so many parts is from its start after the first; nothing of other motions.
   subroutine part_way(problem, orbit, count, apart)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      integer, intent(in) :: count
      real(wp), allocatable, intent(out) :: apart(:)

      type(orbit_t) :: part
      logical :: ok

      allocate (apart(0))
      if (modulo(problem%periods, count) /= 0 .or. problem%is_autonomous()) return
      problem%periods = problem%periods/count
      call problem%evaluate(orbit%u, .false., part, ok)
      problem%periods = count*problem%periods
      if (ok) apart = part%residual
   end subroutine part_way

   !> Whether a part of the period of a motion is a period already: after it the motion is nearer to its start than `size_of_part`.
   subroutine has_part(problem, orbit, size_of_part, has)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(in) :: size_of_part
      logical, intent(out) :: has

      real(wp), allocatable :: apart(:)
      integer :: i

      has = .false.
      do i = 1, size(parts)
         call part_way(problem, orbit, parts(i), apart)
         has = size(apart) > 0 .and. norm2(apart) < size_of_part
         if (has) return
      end do
   end subroutine has_part

   !> Whether two motions at the same parameter are one, which may begin some periods of the excitation later.
   subroutine is_same_motion(problem, a, b, same_motion)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: a, b
      logical, intent(out) :: same_motion

      type(orbit_t) :: later
      integer :: k, n, periods
      logical :: ok

      n = problem%order()
      periods = problem%periods
      same_motion = norm2(a%u - b%u) <= same*norm2(a%u(:n))
      if (problem%is_autonomous()) return
      do k = 1, periods - 1
         if (same_motion) exit
         problem%periods = k
         call problem%evaluate(a%u, .false., later, ok)
         if (ok) same_motion = norm2(a%u(:n) + later%residual - b%u(:n)) <= same*norm2(a%u(:n))
      end do
      problem%periods = periods
   end subroutine is_same_motion

end module razy_orbits_identity
