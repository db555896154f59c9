!! The phase of the excitation at which a motion is begun: away from its events, at which the map of the state jumps.
module razy_orbits_section
   use razy_core_kinds, only: wp
   use razy_orbits_orbit, only: orbit_t, problem_t
   use razy_orbits_period_map, only: return_t
   implicit none(type, external)
   private

   public :: carry, find_quiet, is_quiet

   !> An event nearer than this to the beginning, in periods of the excitation, is too near.
   real(wp), parameter :: margin = 0.02_wp

contains

   !> Whether no event is near the beginning of a motion.
   pure logical function is_quiet(problem, orbit)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit

      is_quiet = .true.
      associate (changes => orbit%sequence, period => problem%map%period)
         if (changes%count == 0 .or. problem%is_autonomous()) return
         is_quiet = min(changes%time(1) - orbit%phase*period, &
                        orbit%phase*period + orbit%duration - changes%time(changes%count)) > margin*period
      end associate
   end function is_quiet

   !> Periods of the excitation from the beginning of a motion to the middle of its longest smooth piece.
   pure real(wp) function find_quiet(problem, orbit) result(later)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp) :: last, length
      integer :: i

      later = 0.0_wp
      length = 0.0_wp
      associate (changes => orbit%sequence, period => problem%map%period)
         if (changes%count == 0) return
         last = changes%time(changes%count) - orbit%duration
         do i = 1, changes%count
            if (changes%time(i) - last > length) then
               length = changes%time(i) - last
               later = (last + 0.5_wp*length)/period - orbit%phase
            end if
            last = changes%time(i)
         end do
         later = modulo(later, orbit%duration/period)
      end associate
   end function find_quiet

   !> The unknowns so many periods of the excitation later, from `phase` on; the map is left at the phase where it was.
   subroutine carry(problem, u, phase, later, to, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:), phase, later
      real(wp), allocatable, intent(out) :: to(:)
      logical, intent(out) :: ok

      type(return_t) :: back
      real(wp), allocatable :: s(:)
      real(wp) :: before

      to = u
      ok = .true.
      if (.not. later > 0.0_wp) return
      s = problem%scales()
      before = problem%map%phase
      problem%map%phase = phase
      call problem%go_to(u, ok)
      if (ok) then
         associate (n => problem%map%n)
            call problem%map%go(u(:n)*s(:n), later*problem%map%period, .false., back)
            ok = size(back%x) == n
            if (ok) to(:n) = back%x/s(:n)
         end associate
      end if
      problem%map%phase = before
   end subroutine carry

end module razy_orbits_section
