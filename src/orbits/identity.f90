!! Which motion it is: whether a part of the period is a period already, and whether two motions are one that begins elsewhere.
module razy_orbits_identity
   use razy_core_kinds, only: wp
   use razy_orbits_orbit, only: orbit_t, problem_t
   use razy_orbits_section, only: carry
   implicit none(type, external)
   private

   public :: find_between, is_same_motion, least_part, part_way, parts

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
      type(orbit_t), intent(inout) :: orbit
      integer, intent(in) :: count
      real(wp), allocatable, intent(out) :: apart(:)

      type(orbit_t) :: part
      integer :: i
      logical :: ok

      if (.not. allocated(orbit%missed)) then
         allocate (orbit%missed(problem%order(), size(parts)), source=huge(1.0_wp))
         do i = 1, merge(0, size(parts), problem%is_autonomous())
            if (modulo(problem%periods, parts(i)) /= 0) cycle
            problem%periods = problem%periods/parts(i)
            call problem%evaluate(orbit%u, .false., part, ok)
            problem%periods = parts(i)*problem%periods
            if (ok) orbit%missed(:, i) = part%residual
         end do
      end if
      associate (missed => orbit%missed(:, findloc(parts, count, 1)))
         apart = pack(missed, missed < huge(1.0_wp))
      end associate
   end subroutine part_way

   !> Whether two motions at the same parameter are one, which may begin later, also by some periods of the excitation.
   subroutine is_same_motion(problem, a, b, same_motion)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: a, b
      logical, intent(out) :: same_motion

      real(wp), allocatable :: later(:)
      integer :: k, n
      logical :: ok

      n = problem%order()
      same_motion = .false.
      do k = 0, merge(0, problem%periods - 1, problem%is_autonomous())
         call carry(problem, a%u, a%phase, modulo(b%phase - a%phase, 1.0_wp) + k, later, ok)
         if (ok) same_motion = norm2(later(:n) - b%u(:n)) <= same*norm2(b%u(:n))
         if (same_motion) return
      end do
   end subroutine is_same_motion

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
      ! What lies at an end of the step does so but for rounding.
      nearly = same*norm2(b%u(:last - 1))
      do k = 0, merge(0, problem%periods - 1, problem%is_autonomous())
         call carry(problem, motion%u, motion%phase, modulo(b%phase - motion%phase, 1.0_wp) + k, there, found)
         if (.not. found) cycle
         along = dot_product(there - a, chord)
         found = along >= -nearly .and. along <= way + nearly .and. norm2(there - a - along*chord) < 0.5_wp*way + nearly
         if (.not. found) cycle
         problem%map%phase = b%phase
         call problem%correct(a + along*chord, chord, at, found)
         if (found) found = norm2(at%u - there) <= same*norm2(there(:last - 1))
         if (found) return
      end do
   end subroutine find_between

end module razy_orbits_identity
