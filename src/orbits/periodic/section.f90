!! The phase of the excitation at which a motion is begun: away from its events, at which the map of the state jumps.
module razy_orbits_periodic_section
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: carry, find_quiet, is_quiet

   !> An event nearer than this to the beginning, in periods of the excitation, is too near.
   real(wp), parameter :: margin = 0.02_wp
   !> Of pieces so short that each place is near one, this part of the longest counts instead.
   real(wp), parameter :: share = 0.25_wp

contains

   !> Whether no event is near the beginning of a motion, or of one of its periods.
   pure logical function is_quiet(problem, orbit)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: after(:)

      is_quiet = .true.
      if (orbit%sequence%count == 0 .or. problem%is_autonomous()) return
      after = after_beginning(problem, orbit)
      is_quiet = min(minval(after), 1.0_wp - maxval(after)) > min(margin, share*maxval(to_next(after)))
   end function is_quiet

   !> Periods of the excitation from the beginning of a motion to the middle of the longest piece without events in any of them.
   pure real(wp) function find_quiet(problem, orbit) result(later)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: after(:), length(:)
      integer :: i

      later = 0.0_wp
      if (orbit%sequence%count == 0) return
      after = after_beginning(problem, orbit)
      length = to_next(after)
      i = maxloc(length, 1)
      later = modulo(after(i) + 0.5_wp*length(i), 1.0_wp)
   end function find_quiet

   !> Of each event how long after the beginning of its period of the excitation it is, in such periods.
   pure function after_beginning(problem, orbit) result(after)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp), allocatable :: after(:)

      associate (changes => orbit%sequence)
         after = modulo(changes%time(:changes%count)/problem%map%period - orbit%phase, 1.0_wp)
      end associate
   end function after_beginning

   !> From each event to the next one in any of the periods.
   pure function to_next(after) result(length)
      real(wp), intent(in) :: after(:)
      real(wp) :: length(size(after))

      integer :: i

      do i = 1, size(after)
         associate (others => modulo(after - after(i), 1.0_wp))
            length(i) = min(1.0_wp, minval(others, others > 0.0_wp))
         end associate
      end do
   end function to_next

   !> The unknowns so many periods of the excitation later, from `phase` on; the map is left at the phase where it was.
   subroutine carry(problem, u, phase, later, to, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:), phase, later
      real(wp), allocatable, intent(out) :: to(:)
      logical, intent(out) :: ok

      type(return_t) :: back
      real(wp), allocatable :: s(:)
      real(wp) :: before
      integer :: i, m

      to = u
      ok = .true.
      m = problem%states()
      associate (n => problem%map%n)
         ! Whole periods later the states are those of other periods.
         if (.not. problem%is_autonomous()) to(:m) = cshift(u(:m), n*modulo(int(later), m/n))
      end associate
      if (.not. modulo(later, 1.0_wp) > 0.0_wp) return
      s = problem%scales()
      before = problem%map%phase
      problem%map%phase = phase
      call problem%go_to(u, ok)
      if (ok) then
         associate (n => problem%map%n)
            do i = 1, m, n
               call problem%map%go(to(i:i + n - 1)*s(:n), modulo(later, 1.0_wp)*problem%map%period, .false., back)
               to(i:i + n - 1) = back%x/s(:n)
            end do
         end associate
      end if
      problem%map%phase = before
   end subroutine carry

end module razy_orbits_periodic_section
