!! A periodic motion to begin with: what a motion settles to, or comes back to most nearly.
module razy_orbits_start
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_linalg_null_space, only: null_space
   use razy_motion_integrator, only: observer_slot_t, status_ok
   use razy_orbits_periodic_columns, only: differentiate
   use razy_orbits_periodic_identity, only: part_way, parts
   use razy_orbits_periodic_newton, only: complete, correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_rest, only: find_rate
   use razy_orbits_periodic_section, only: carry, find_quiet, is_quiet
   use razy_orbits_volume, only: volume_t
   implicit none(type, external)
   private

   public :: distance, find_beside, find_periodic, march, minimal, refine, states_from

   !> Longest period that is recognised; a motion that comes back this near, relative to its size, has settled.
   integer, parameter :: longest = 16
   real(wp), parameter :: near = 1.0e-4_wp
   !> Close returns that Newton's method begins from, one after the other.
   integer, parameter :: most_trials = 12
   !> States in the time of &motion, and as many after it, in which a closed motion is looked for.
   integer, parameter :: samples = 2000
   !> What moves no farther than this, relative to the state, moves by rounding.
   real(wp), parameter :: at_rest = 1.0e-10_wp
   !> Rounding of impacts without loss.
   real(wp), parameter :: lossless = 1.0e-12_wp

contains

   !> The motion that settles, after `settle` periods of the excitation, from the machine's own start at `parameter`, or the
   !> motion of `period` periods (0: whichever) that it comes nearest to; with `range` the scale of the parameter, `time`, s,
   !> how long a motion without excitation is followed. `settled`: the motion is the one that was settled to.
   subroutine find_periodic(problem, parameter, range, period, settle, time, orbit, settled, error)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: parameter(:), range, time
      integer, intent(in) :: period, settle
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: settled
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: first(:), guess(:), x(:, :)
      logical :: ok
      integer :: k

      settled = .false.
      problem%map%phase = 0.0_wp
      problem%parameter = parameter
      call problem%map%go_to(parameter, error)
      if (allocated(error)) return
      if (.not. problem%map%period > 0.0_wp) then
         call from_section(problem, time, range, orbit, settled, error)
         return
      end if
      call problem%map%first_state(first, error)
      if (.not. allocated(error)) call march(problem, first, settle, problem%map%period, x, error)
      if (allocated(error)) return
      call problem%begin(x(:, settle), 0.0_wp, range)
      do k = merge(period, 1, period > 0), merge(period, longest, period > 0)
         if (distance(problem, x(:, settle), x(:, settle - k)) > near) cycle
         problem%periods = k
         call refine(problem, [x(:, settle - k:settle - 1)], orbit, ok)
         if (ok) then
            call carry(problem, orbit%u, orbit%phase, modulo(-orbit%phase, 1.0_wp), guess, ok)
            settled = ok .and. norm2(guess(:problem%map%n) - x(:, settle)/first_scales(problem)) < 100*near
            call problem%go_to(orbit%u, ok)
         end if
         if (settled) settled = minimal(problem, orbit)
         if (settled) return
      end do
      problem%periods = max(period, 1)
      call from_returns(problem, x, orbit, ok)
      if (.not. ok) call raise(error, "no motion of period "//to_text(problem%periods)//" was found within "//to_text(settle)// &
                               " periods of the excitation: "//problem%reason)
   end subroutine find_periodic

   !> Without excitation: the closed motion that comes after `time`, s, from the machine's own start. Its period is the time
   !> until it goes through the plane across itself, near where it was, again.
   subroutine from_section(problem, time, range, orbit, settled, error)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: time, range
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: settled
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: apart(:), first(:), largest(:), x(:, :)
      real(wp) :: amplitude, dt, rate
      integer :: i, n
      logical :: ok

      settled = .false.
      dt = time/samples
      call problem%map%first_state(first, error)
      if (.not. allocated(error)) call march(problem, first, 2*samples, dt, x, error)
      if (allocated(error)) return
      n = samples
      problem%periods = 1
      call problem%begin(x(:, n), time, range)
      allocate (apart(0:samples), source=[(distance(problem, x(:, n + i), x(:, n)), i=0, samples)])
      amplitude = maxval(apart)
      problem%reason = "the motion after &motion t_end does not come back"
      if (amplitude <= at_rest) problem%reason = "the machine is at rest after &motion t_end"
      do i = 2, merge(0, samples - 1, amplitude <= at_rest)
         if (apart(i) > 0.05_wp*amplitude .or. apart(i) > apart(i - 1) .or. apart(i) > apart(i + 1)) cycle
         if (maxval(apart(:i)) < 0.5_wp*amplitude) cycle
         ! At one instant a state may be small.
         largest = maxval(abs(x(:, n:n + i)), dim=2)
         call problem%begin(largest, i*dt, range)
         call refine(problem, x(:, n), orbit, ok)
         settled = ok .and. orbit%u(problem%map%n + 1) > 0.5_wp .and. orbit%u(problem%map%n + 1) < 2.0_wp
         if (.not. settled) cycle
         if (keeps_volume(problem, orbit)) then
            call raise(error, "nothing drives or damps the machine: closed motions are not alone, there is one for every energy")
            return
         end if
         call find_rate(problem, orbit, rate, settled)
         if (.not. settled) cycle
         settled = abs(rate) > at_rest
         if (settled) call take_shortest(problem, largest, range, orbit, settled)
         if (settled) return
         problem%reason = "the machine comes to rest"
      end do
      call raise(error, "no closed motion was found: "//problem%reason)
   end subroutine from_section

   !> Without excitation: of a motion that runs through its period some times that once; not `found`: it is none. `largest`: states.
   subroutine take_shortest(problem, largest, range, orbit, found)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: largest(:), range
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: found

      type(orbit_t) :: shorter
      real(wp), allocatable :: to(:), x(:)
      integer :: k, n
      logical :: ok

      n = problem%map%n
      k = 1
      found = .true.
      do while (found .and. k <= size(parts))
         call carry(problem, orbit%u, orbit%phase, 1.0_wp/parts(k), to, ok)
         if (ok) ok = norm2(to(:n) - orbit%u(:n)) <= near*norm2(orbit%u(:n))
         if (ok) then
            x = orbit%u(:n)*first_scales(problem)
            call problem%begin(largest, orbit%duration/parts(k), range)
            call refine(problem, x, shorter, ok)
            ! The unknowns of the motion that stays are in scales of its own.
            if (.not. ok) call problem%begin(largest, orbit%duration, range)
            if (.not. ok) call refine(problem, x, orbit, found)
         end if
         if (ok) orbit = shorter
         if (.not. ok) k = k + 1
      end do
   end subroutine take_shortest

   !> Whether a motion keeps volumes of states, as those without damping do.
   logical function keeps_volume(problem, orbit)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit

      type(observer_slot_t) :: slot(1)
      type(return_t) :: back
      type(volume_t), target :: volume

      slot(1)%observer => volume
      call volume%begin(problem%map%by)
      call problem%map%go(orbit%u(:problem%map%n)*first_scales(problem), orbit%duration, .false., back, slot)
      keeps_volume = .not. ieee_is_nan(volume%logarithm)
      if (keeps_volume) keeps_volume = abs(volume%logarithm) <= lossless
   end function keeps_volume

   !> The states after each of `count` intervals, from `first` on.
   subroutine march(problem, first, count, interval, x, error)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: first(:)
      integer, intent(in) :: count
      real(wp), intent(in) :: interval
      real(wp), allocatable, intent(out) :: x(:, :)
      type(error_t), allocatable, intent(out) :: error

      type(return_t) :: back
      integer :: i

      allocate (x(problem%map%n, 0:count))
      x(:, 0) = first
      do i = 1, count
         problem%map%by%budget%goes_on = i > 1
         call problem%map%go(x(:, i - 1), interval, .false., back)
         problem%map%by%budget%goes_on = .false.
         if (back%outcome%status /= status_ok) then
            call raise(error, "the motion from the start of &motion does not come through "//to_text(i)//" periods")
            return
         end if
         x(:, i) = back%x
         call problem%tell("first motion", i, problem%parameter(problem%active))
      end do
   end subroutine march

   pure function first_scales(problem) result(scales)
      type(problem_t), intent(in) :: problem
      real(wp), allocatable :: scales(:)

      scales = problem%scales()
      scales = scales(:problem%map%n)
   end function first_scales

   !> Distance of two states, in scaled unknowns.
   pure real(wp) function distance(problem, a, b)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: a(:), b(:)

      distance = norm2((a - b)/first_scales(problem))
   end function distance

   !> The periodic motion near x, a state at phase 0 or one at the beginning of each of its periods, at the parameters as they are,
   !> with its multipliers and derivatives, unless it is to be `bare`. It begins there, or later if an event is near.
   subroutine refine(problem, x, orbit, ok, bare)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:)
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: ok
      logical, intent(in), optional :: bare

      real(wp), allocatable :: guess(:)

      call guess_at(problem, x, 0.0_wp, guess, orbit, ok)
      if (ok) call correct(problem, guess, [spread(0.0_wp, 1, size(guess) - 1), 1.0_wp], orbit, ok)
      if (ok .and. .not. present(bare)) call complete(problem, orbit, ok)
   end subroutine refine

   !> The periodic motion nearest to one with the state x at `phase`, across the branch that comes by there, at a fold too: the
   !> parameter may become another. `tangent` of that branch, `range` the scale of the parameter; `period`, s, counts without
   !> excitation. Errors: no such machine, no motion there.
   subroutine find_beside(problem, parameter, range, x, phase, period, orbit, tangent, error)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: parameter(:), range, x(:), phase, period
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: tangent(:)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: across(:, :), guess(:)
      integer :: info
      logical :: ok

      problem%parameter = parameter
      call problem%map%go_to(parameter, error)
      if (allocated(error)) return
      call problem%begin(x, period, range)
      call guess_at(problem, x, phase, guess, orbit, ok)
      if (ok) call problem%evaluate(guess, .true., orbit, ok)
      if (ok) call differentiate(problem, orbit, ok)
      if (ok) then
         call null_space(transpose(problem%jacobian(orbit)), across, info)
         ok = info == 0
         if (.not. ok) problem%reason = "the branch has no tangent"
      end if
      if (ok) then
         tangent = across(:, size(across, 2))
         call correct(problem, guess, tangent, orbit, ok)
      end if
      if (ok) call complete(problem, orbit, ok)
      if (ok) ok = minimal(problem, orbit)
      if (.not. ok) call raise(error, problem%reason)
   end subroutine find_beside

   !> Unknowns of a motion with the state x at `phase`, or one a period, begun there, or later if an event is near.
   subroutine guess_at(problem, x, phase, guess, orbit, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:), phase
      real(wp), allocatable, intent(out) :: guess(:)
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      real(wp), allocatable :: to(:)
      real(wp) :: later
      logical :: moved

      problem%map%phase = phase
      guess = [states_from(problem, x), spread(1.0_wp, 1, problem%order() - problem%states()), &
               problem%parameter(problem%active)/problem%range]
      call problem%evaluate(guess, .false., orbit, ok)
      if (.not. ok) return
      if (is_quiet(problem, orbit)) return
      later = find_quiet(problem, orbit)
      call carry(problem, guess, phase, later, to, moved)
      if (.not. moved) return
      guess = to
      problem%map%phase = problem%phase_after(phase, later)
   end subroutine guess_at

   !> The states, without scales one after another, at the beginning of each period of a motion that begins with x, in units of
   !> their scales; those that are there stay.
   function states_from(problem, x) result(states)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:)
      real(wp), allocatable :: states(:)

      type(return_t) :: back
      real(wp), allocatable :: s(:)
      logical :: ok

      s = problem%scales()
      states = x/s(:size(x))
      call problem%go_to([problem%parameter(problem%active)/problem%range], ok)
      if (.not. ok) return
      back%x = x
      do while (size(states) < problem%states())
         call problem%map%go((back%x), problem%map%period, .false., back)
         states = [states, back%x/s(:size(x))]
      end do
   end function states_from

   !> Newton's method from the states that the motion comes back to most nearly after the period.
   subroutine from_returns(problem, x, orbit, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:, 0:)
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: ok

      real(wp) :: apart(0:ubound(x, 2) - problem%periods)
      integer :: at, i, trial

      apart = [(distance(problem, x(:, i), x(:, i + problem%periods)), i=0, ubound(apart, 1))]
      ok = .false.
      do trial = 1, min(most_trials, size(apart))
         at = minloc(apart, dim=1) - 1
         apart(at) = huge(1.0_wp)
         call refine(problem, [x(:, at:at + problem%periods - 1)], orbit, ok)
         if (ok) ok = minimal(problem, orbit)
         if (ok) return
      end do
   end subroutine from_returns

   !> No part of the period is a period.
   logical function minimal(problem, orbit)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: apart(:)
      integer :: k

      minimal = .true.
      do k = 2, problem%periods
         if (modulo(problem%periods, k) /= 0) cycle
         apart = part_way(problem, orbit, k)
         minimal = minimal .and. norm2(apart) > near
      end do
      if (.not. minimal) problem%reason = "the motion found has a shorter period"
   end function minimal

end module razy_orbits_start
