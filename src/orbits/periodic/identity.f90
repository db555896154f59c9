!! Which motion it is: whether a part of the period is a period already, and whether two motions are one that begins elsewhere.
module razy_orbits_periodic_identity
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_section, only: carry
   implicit none(type, external)
   private

   public :: doubled, find_between, least_part, part_way, parts, repeated

   !> A motion whose halves, or other parts, differ by less than this part of what they should is one of a part of the period.
   real(wp), parameter :: least_part = 1.0e-3_wp
   !> Into how many parts the periods may fall.
   integer, parameter :: parts(*) = [2, 3, 5, 7, 11, 13]
   !> States nearer than this, relative to their size, are one.
   real(wp), parameter :: same = 1.0e-6_wp

contains

   !> How far the states of a motion whose periods can be shared out in so many parts, without excitation in two, are from those of
   !> its next part; nothing of other motions.
   function part_way(problem, orbit, count) result(apart)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      integer, intent(in) :: count
      real(wp), allocatable :: apart(:)

      logical :: shared

      shared = modulo(problem%periods, count) == 0
      if (problem%is_autonomous()) shared = count == 2
      if (shared .and. problem%is_autonomous()) call carry(problem, orbit%u, orbit%phase, 0.5_wp, apart, shared)
      if (.not. shared) apart = [real(wp) ::]
      if (.not. shared) return
      associate (states => orbit%u(:problem%states()))
         if (.not. problem%is_autonomous()) apart = cshift(states, size(states)/count)
         apart = apart(:size(states)) - states
      end associate
   end function part_way

   !> Unknowns, or a direction, of a motion as one of so many times its periods.
   pure function repeated(u, times)
      real(wp), intent(in) :: u(:)
      integer, intent(in) :: times
      real(wp), allocatable :: repeated(:)

      integer :: i

      repeated = [(u(:size(u) - 1), i=1, times), u(size(u))]
   end function repeated

   !> Unknowns, or a direction, of a motion as one of twice the period.
   pure function doubled(problem, u) result(twice)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: u(:)
      real(wp), allocatable :: twice(:)

      twice = repeated(u, merge(1, 2, problem%is_autonomous()))
      if (problem%is_autonomous()) twice(size(u) - 1) = 2*u(size(u) - 1)
   end function doubled

   !> Whether a motion, which may begin later, also by some periods of the excitation, lies on a step of a branch from the unknowns
   !> `a` to the motion `b`, at whose phase they are; `at`: it, as it begins there.
   subroutine find_between(problem, motion, a, b, at, found)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: motion, b
      real(wp), intent(in) :: a(:)
      type(orbit_t), intent(out) :: at
      logical, intent(out) :: found

      real(wp), allocatable :: there(:)
      real(wp) :: along, chord(size(a)), nearly, way
      integer :: k, last

      last = size(a)
      chord = b%u - a
      way = norm2(chord)
      found = .false.
      if (abs(motion%u(last) - a(last)) > 2*way .or. .not. way > 0.0_wp) return
      chord = chord/way
      ! What lies at an end of the step does so but for rounding; steps may be shorter than what is one motion.
      nearly = min(same*norm2(b%u(:last - 1)), 0.1_wp*way)
      do k = 0, merge(0, problem%periods - 1, problem%is_autonomous())
         call carry(problem, motion%u, motion%phase, modulo(b%phase - motion%phase, 1.0_wp) + k, there, found)
         if (.not. found) cycle
         along = dot_product(there - a, chord)
         found = along >= -nearly .and. along <= way + nearly .and. norm2(there - a - along*chord) < 0.5_wp*way + nearly
         if (.not. found) cycle
         call problem%begin_as(b)
         call correct(problem, a + along*chord, chord, at, found)
         if (found) found = norm2(at%u - there) <= same*norm2(there(:last - 1))
         if (found) return
      end do
   end subroutine find_between

end module razy_orbits_periodic_identity
