!! The phase of the excitation at which a motion is begun: away from its events, at which the map of the state jumps.
module razy_orbits_periodic_section
   use razy_core_kinds, only: wp
   use razy_motion_integrator, only: status_ok
   use razy_orbits_periodic_orbit, only: orbit_t, plane_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: carry, find_first_change, find_quiet, is_quiet

   !> An event nearer than this to the beginning, in periods of the excitation, is too near.
   real(wp), parameter :: margin = 0.02_wp
   !> Of pieces so short that each place is near one, this part of the longest counts instead.
   real(wp), parameter :: share = 0.25_wp
   !> Without excitation: a velocity that changes less than this, of how all do, may come to turn at its plane.
   real(wp), parameter :: least = 0.1_wp
   integer, parameter :: samples = 100, most_rounds = 30

contains

   !> Whether no event is near the beginning of a motion, or of one of its periods; without excitation, whether the velocity by
   !> which it begins is known to change there as fast as others do.
   logical function is_quiet(problem, orbit)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: after(:), change(:)

      is_quiet = .true.
      if (problem%is_autonomous()) then
         is_quiet = orbit%plane%velocity > problem%map%positions
         if (is_quiet) call find_first_change(problem, orbit%u, change, is_quiet)
         if (is_quiet) is_quiet = abs(change(orbit%plane%velocity)) > least*norm2(change)
      else if (orbit%sequence%count > 0) then
         after = after_beginning(problem, orbit)
         is_quiet = min(minval(after), 1.0_wp - maxval(after)) > min(margin, share*maxval(to_next(after)))
      end if
   end function is_quiet

   !> How the scaled state changes in the first of the samples of a period, of which any method knows more than rounding; not
   !> `ok`: the motion does not come through it.
   subroutine find_first_change(problem, u, change, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:)
      real(wp), allocatable, intent(out) :: change(:)
      logical, intent(out) :: ok

      call carry(problem, u, problem%map%phase, 1.0_wp/samples, change, ok)
      change = change(:problem%map%n) - u(:problem%map%n)
   end subroutine find_first_change

   !> Parts of a period, of the excitation if there is one, from the beginning of a motion to a better one: the middle of the
   !> longest piece without events in any of its periods; without excitation the plane, too, becomes that of the velocity that
   !> changes most where it passes through 0, or through its mean if it keeps its sign.
   real(wp) function find_quiet(problem, orbit) result(later)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: after(:), length(:)
      integer :: i

      later = 0.0_wp
      if (problem%is_autonomous()) then
         call find_plane(problem, orbit, later)
      else if (orbit%sequence%count > 0) then
         after = after_beginning(problem, orbit)
         length = to_next(after)
         i = maxloc(length, 1)
         later = modulo(after(i) + 0.5_wp*length(i), 1.0_wp)
      end if
   end function find_quiet

   !> The plane that a motion without excitation passes through fastest, away from its events, and after which part of its period.
   subroutine find_plane(problem, orbit, later)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(out) :: later

      logical :: busy(samples), ok
      real(wp) :: fastest, level, value(0:samples), x(problem%map%n, 0:samples)
      real(wp), allocatable :: to(:)
      integer :: at, i, k

      later = 0.0_wp
      busy = .false.
      associate (changes => orbit%sequence)
         busy(min(1 + int(samples*changes%time(:changes%count)/orbit%duration), samples)) = .true.
      end associate
      x(:, 0) = orbit%u(:problem%map%n)
      do i = 1, samples
         call carry(problem, [x(:, i - 1), orbit%u(problem%map%n + 1:)], problem%map%phase, 1.0_wp/samples, to, ok)
         if (.not. ok) return
         x(:, i) = to(:problem%map%n)
      end do
      fastest = 0.0_wp
      at = 0
      do k = problem%map%positions + 1, problem%map%n
         level = 0.0_wp
         if (minval(x(k, :)) > 0.0_wp .or. maxval(x(k, :)) < 0.0_wp) level = sum(x(k, 1:))/samples
         value = x(k, :) - level
         do i = 1, samples
            if (busy(i) .or. value(i - 1)*value(i) > 0.0_wp .or. abs(value(i) - value(i - 1)) <= fastest) cycle
            fastest = abs(value(i) - value(i - 1))
            problem%plane = plane_t(k, level)
            at = i
         end do
      end do
      if (at > 0) later = (at - 1 + passes_after([x(:, at - 1), orbit%u(problem%map%n + 1:)], x(:, at)))/samples

   contains

      !> After which part of the time between two states the motion passes through the plane.
      real(wp) function passes_after(a, b) result(part)
         real(wp), intent(in) :: a(:), b(:)

         real(wp) :: high, low, there, value(2)
         integer :: round

         low = 0.0_wp
         high = 1.0_wp
         value = [a(problem%plane%velocity), b(problem%plane%velocity)] - problem%plane%value
         do round = 1, most_rounds
            part = low + (high - low)*value(1)/(value(1) - value(2))
            call carry(problem, a, problem%map%phase, part/samples, to, ok)
            if (.not. ok .or. .not. (part > low .and. part < high)) return
            there = to(problem%plane%velocity) - problem%plane%value
            if (.not. abs(there) > epsilon(there)*fastest) return
            ! Half the value that stays, so that both ends come nearer.
            if (there*value(1) > 0.0_wp) then
               low = part
               value = [there, 0.5_wp*value(2)]
            else
               high = part
               value = [0.5_wp*value(1), there]
            end if
         end do
      end function passes_after

   end subroutine find_plane

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

   !> The unknowns so many periods of the excitation later, without excitation of the motion, from `phase` on; the map is left at
   !> the phase where it was.
   subroutine carry(problem, u, phase, later, to, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:), phase, later
      real(wp), allocatable, intent(out) :: to(:)
      logical, intent(out) :: ok

      type(return_t) :: back
      real(wp), allocatable :: s(:)
      real(wp) :: before, period
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
      period = problem%map%period
      if (problem%is_autonomous()) period = u(m + 1)*problem%period
      if (ok) then
         associate (n => problem%map%n)
            do i = 1, m, n
               call problem%map%go(to(i:i + n - 1)*s(:n), modulo(later, 1.0_wp)*period, .false., back)
               ok = ok .and. back%outcome%status == status_ok
               to(i:i + n - 1) = back%x/s(:n)
            end do
         end associate
         if (.not. ok) problem%reason = "the motion does not come to the end of the period"
      end if
      problem%map%phase = before
   end subroutine carry

end module razy_orbits_periodic_section
