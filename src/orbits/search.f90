!! All periodic motions at one value of the parameter, as far as they are found: what motions from several starts settle to,
!! and, by Newton's method from where they come back most nearly after some periods of the excitation and from all over the box
!! of motions, those that nothing settles to. Motions that are known are not deflated: that leads Newton's method away from many
!! of the others, too.
module razy_orbits_search
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_uniform, only: uniform
   use razy_core_verdict, only: is_unstable
   use razy_linalg_square, only: solve_square
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_lyapunov, only: lyapunov_t
   use razy_orbits_periodic_identity, only: find_between
   use razy_orbits_periodic_newton, only: complete
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_section, only: carry
   use razy_orbits_start, only: distance, march, minimal, refine, states_from
   implicit none(type, external)
   private

   public :: found_t, is_on, new_found, search_t

   !> A motion: of how many periods of the excitation, its states after each of them in scaled unknowns (n, periods), how
   !> many starts settled to it.
   type :: found_t
      type(orbit_t) :: orbit
      integer :: periods = 1, starts = 0
      real(wp), allocatable :: phase(:, :)
   contains
      procedure :: is_near
      procedure :: is_same_as
   end type found_t

   !> What to look for: starts besides that of the machine, periods of the excitation that they are followed, most periods of
   !> a motion. What was found: motions, starts that settle to none of them, the largest Lyapunov exponent of what the
   !> machine's own start leads to, 1/s, and its standard error.
   type :: search_t
      integer :: starts = 0, settle = 0, most_periods = 1
      type(found_t), allocatable :: found(:)
      integer :: unsettled = 0
      real(wp) :: exponent = 0.0_wp, error = 0.0_wp
   contains
      procedure :: run
      procedure, private :: settled_to
      procedure, private :: try_from
      procedure, private :: try_returns
      procedure, private :: try_box
      procedure, private :: approach
   end type search_t

   !> Motions that come back this near, relative to their size, have settled; those nearer than this to each other are one.
   real(wp), parameter :: near = 1.0e-4_wp, same = 1.0e-5_wp
   !> Starts lie in boxes of these half widths, in scaled unknowns, around what the machine's own start settles to, in turn.
   real(wp), parameter :: widths(*) = [2.0_wp, 10.0_wp, 50.0_wp]
   !> Periods of close returns, for each number of them, that Newton's method begins from in a row without anything new; returns at
   !> motions that are known do not count.
   integer, parameter :: most_in_vain = 256
   real(wp), parameter :: beside = 1.0e-2_wp
   !> Starts all over the box of motions for each number of periods end when as many as there are starts have led to nothing new,
   !> or so many times as many where these do not all settle to one motion; at last after so many.
   integer, parameter :: denser = 16, most_in_box = 1000
   !> From afar no step of Newton's method is longer than the largest motion, until a motion is this near.
   real(wp), parameter :: at_hand = 1.0e-2_wp
   integer, parameter :: most_rounds = 20
   integer(i8), parameter :: key(2) = [20261123_i8, 0_i8], key_of_box(2) = [20261129_i8, 0_i8]

contains

   !> Look at `parameter`, whose scale is `range`.
   subroutine run(self, problem, parameter, range, error)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: parameter(:), range
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: lost
      real(wp), allocatable :: first(:), x(:, :), history(:, :, :)
      integer :: coordinate, i, n

      allocate (self%found(0))
      problem%map%phase = 0.0_wp
      problem%parameter = parameter
      call problem%map%go_to(parameter, error)
      if (allocated(error)) return
      call problem%map%first_state(first, error)
      if (.not. allocated(error)) call march(problem, first, self%settle, problem%map%period, x, error)
      if (allocated(error)) return
      call problem%begin(x(:, self%settle), 0.0_wp, range)
      call find_exponent(self, problem, x(:, self%settle))
      n = problem%map%n
      allocate (history(n, 0:self%settle, self%starts + 1), source=spread(x, 3, self%starts + 1))
      associate (s => problem%scales())
         do i = 1, self%starts
            first = [(uniform(key, [int(i, i8), int(coordinate, i8)]), coordinate=1, n)]
            first = history(:, self%settle, 1) + widths(1 + modulo(i - 1, size(widths)))*(2*first - 1.0_wp)*s(:n)
            call march(problem, first, self%settle, problem%map%period, x, lost)
            ! What cannot be begun there is not looked at: the machine's own motion stands for it.
            if (.not. allocated(lost)) history(:, :, i + 1) = x
         end do
         ! In units of the largest motion Newton's method reaches all of them.
         i = maxloc([(norm2(history(:, self%settle, i)/s(:n)), i=1, self%starts + 1)], dim=1)
      end associate
      call problem%begin(history(:, self%settle, i), 0.0_wp, range)
      do i = 1, self%starts + 1
         call self%settled_to(problem, history(:, :, i))
      end do
      do i = 1, self%most_periods
         call self%try_returns(problem, history, i)
         call self%try_box(problem, history(:, self%settle/2:, :), i)
      end do
   end subroutine run

   !> Newton's method from a state; `place` of the motion among those found, at the end if it is new, 0 if there is none.
   subroutine try_from(self, problem, x, place)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:)
      integer, intent(out) :: place

      type(found_t) :: motion
      type(orbit_t) :: orbit
      logical :: ok

      place = 0
      call refine(problem, x, orbit, ok, bare=.true.)
      if (ok) ok = minimal(problem, orbit)
      if (.not. ok) return
      call new_found(motion, problem, orbit)
      do place = 1, size(self%found)
         associate (known => self%found(place))
            if (known%periods == motion%periods .and. is_same(known, motion%phase(:, 1), known%orbit%held)) return
         end associate
      end do
      call complete(problem, motion%orbit, ok)
      if (.not. ok) place = 0
      if (ok) self%found = [self%found, motion]
   end subroutine try_from

   subroutine find_exponent(self, problem, x)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:)

      type(lyapunov_t) :: lyapunov
      type(return_t) :: back

      lyapunov%asked = 1
      lyapunov%intervals = self%settle
      call problem%map%go(x, problem%map%period, .false., back)
      call lyapunov%follow(problem%map%by, (problem%map%by%z), problem%map%period)
      self%exponent = lyapunov%exponent(1)
      ! Scatter says nothing of what errs alike in each period: without damping the exponent is this alone.
      self%error = lyapunov%error(1) + max(problem%resolution, size(x)*epsilon(1.0_wp))/problem%map%period
   end subroutine find_exponent

   !> Count a start for the motion that it settles to, which may be a new one.
   subroutine settled_to(self, problem, x)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:, 0:)

      integer :: k, place

      do k = 1, self%most_periods
         if (distance(problem, x(:, self%settle), x(:, self%settle - k)) > near) cycle
         problem%periods = k
         call self%try_from(problem, [x(:, self%settle - k:self%settle - 1)], place)
         if (place == 0) cycle
         ! A chaotic motion can pass by one that nothing settles to.
         if (self%found(place)%orbit%stability() == is_unstable) exit
         self%found(place)%starts = self%found(place)%starts + 1
         return
      end do
      self%unsettled = self%unsettled + 1
   end subroutine settled_to

   !> Newton's method from the states after which the motions come back most nearly after `periods`.
   subroutine try_returns(self, problem, history, periods)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: history(:, 0:, :)
      integer, intent(in) :: periods

      real(wp) :: apart(0:ubound(history, 2) - periods, size(history, 3))
      integer :: at(2), i, in_vain, k, known, place

      do k = 1, size(history, 3)
         do i = 0, ubound(apart, 1)
            apart(i, k) = distance(problem, history(:, i, k), history(:, i + periods, k))
         end do
      end do
      problem%periods = periods
      in_vain = 0
      do while (in_vain*periods < most_in_vain)
         at = minloc(apart) + [-1, 0]
         if (apart(at(1), at(2)) > 1.0_wp) exit
         apart(at(1), at(2)) = huge(1.0_wp)
         associate (x => history(:, at(1):at(1) + periods - 1, at(2)))
            if (any([(self%found(i)%is_near(problem, x(:, 1), beside), i=1, size(self%found))])) cycle
            known = size(self%found)
            call self%try_from(problem, [x], place)
            in_vain = merge(0, in_vain + 1, size(self%found) > known)
         end associate
      end do
   end subroutine try_returns

   !> Newton's method from states all over the box, twice as wide as that of the motions `seen`, for those of `periods`.
   subroutine try_box(self, problem, seen, periods)
      class(search_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: seen(:, :, :)
      integer, intent(in) :: periods

      real(wp), dimension(size(seen, 1)) :: high, low, x
      real(wp), allocatable :: states(:)
      integer :: coordinate, in_vain, known, place, trial
      logical :: ok

      low = minval(minval(seen, dim=3), dim=2)
      high = maxval(maxval(seen, dim=3), dim=2)
      problem%periods = periods
      in_vain = 0
      do trial = 1, most_in_box
         known = size(self%found)
         x = [(uniform(key_of_box, [int(trial, i8), int(coordinate, i8)]), coordinate=1, size(x))]
         x = 0.5_wp*(low + high) + (high - low)*(2*x - 1.0_wp)
         call self%approach(problem, x, states, ok)
         if (ok) call self%try_from(problem, states, place)
         in_vain = merge(0, in_vain + 1, size(self%found) > known)
         if (in_vain >= (self%starts + 1)*merge(1, denser, self%unsettled == 0 .and. size(self%found) == 1)) exit
      end do
   end subroutine try_box

   !> Come near a motion of the problem's periods that is not known, from any state x: its states, one a period.
   subroutine approach(self, problem, x, states, ok)
      class(search_t), intent(in) :: self
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: x(:)
      real(wp), allocatable, intent(out) :: states(:)
      logical, intent(out) :: ok

      type(orbit_t) :: orbit
      real(wp), allocatable :: change(:), matrix(:, :), s(:), u(:)
      real(wp) :: missed
      integer :: i, round

      problem%map%phase = 0.0_wp
      u = states_from(problem, x)
      s = problem%scales()
      s = s(:size(u))
      missed = huge(1.0_wp)
      do round = 1, most_rounds
         call problem%evaluate([u, problem%parameter(1)/problem%range], .true., orbit, ok)
         if (.not. ok) return
         if (norm2(orbit%residual) > missed) then
            ! The step was too long for what the derivative says.
            change = 0.5_wp*change
            u = u - change
            cycle
         end if
         missed = norm2(orbit%residual)
         orbit%column = reshape(0*u, [size(u), 1])
         matrix = problem%jacobian(orbit)
         change = -orbit%residual
         call solve_square(matrix(:, :size(u)), change, ok)
         ok = ok .and. all(abs(change) <= huge(1.0_wp))
         if (.not. ok) return
         states = (u + change)*s
         ok = .not. any([(self%found(i)%is_near(problem, states(:size(x)), beside), i=1, size(self%found))])
         if (.not. ok .or. norm2(change) <= at_hand) return
         change = change/max(1.0_wp, norm2(change))
         u = u + change
      end do
      ok = .false.
   end subroutine approach

   !> The motion of an orbit of the problem's periods that was corrected, with its states after each period of the excitation.
   subroutine new_found(motion, problem, orbit)
      type(found_t), intent(inout) :: motion
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit

      real(wp), allocatable :: first(:)
      logical :: ok

      motion%orbit = orbit
      motion%periods = problem%periods
      ! The machine that the motion was found with, so it is there.
      call carry(problem, orbit%u, orbit%phase, modulo(-orbit%phase, 1.0_wp), first, ok)
      motion%phase = reshape(first(:problem%states()), [problem%map%n, problem%states()/problem%map%n])
   end subroutine new_found

   !> Whether a state is within `part` of the size of one of the motion, or of those at other places where friction holds it.
   pure logical function is_near(self, problem, x, part)
      class(found_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: x(:), part

      associate (s => problem%scales())
         is_near = closest(self, x/s(:size(x)), self%orbit%held) <= part*max(size_of(self), norm2(x/s(:size(x))))
      end associate
   end function is_near

   !> Whether another motion is this, at parameters that differ by no more than `value` in its scale.
   pure logical function is_same_as(self, other, value)
      class(found_t), intent(in) :: self
      type(found_t), intent(in) :: other
      real(wp), intent(in) :: value

      associate (last => size(self%orbit%u))
         is_same_as = self%periods == other%periods .and. abs(self%orbit%u(last) - other%orbit%u(last)) <= value
      end associate
      if (is_same_as) is_same_as = is_same(self, other%phase(:, 1), reshape([real(wp) ::], [size(self%phase, 1), 0]))
   end function is_same_as

   pure logical function is_same(self, u, held)
      type(found_t), intent(in) :: self
      real(wp), intent(in) :: u(:), held(:, :)

      is_same = closest(self, u(:size(self%phase, 1)), held) <= same*max(size_of(self), norm2(u(:size(self%phase, 1))))
   end function is_same

   !> How near a state comes to the motion, whatever its part in the directions `held`.
   pure real(wp) function closest(self, u, held)
      type(found_t), intent(in) :: self
      real(wp), intent(in) :: u(:), held(:, :)

      real(wp) :: apart(size(u))
      integer :: i

      closest = huge(closest)
      do i = 1, size(self%phase, 2)
         apart = self%phase(:, i) - u
         closest = min(closest, norm2(apart - matmul(held, matmul(apart, held))))
      end do
   end function closest

   pure real(wp) function size_of(self)
      type(found_t), intent(in) :: self

      size_of = max(norm2(self%phase(:, 1)), tiny(1.0_wp))
   end function size_of

   !> Whether a motion lies on a branch of as many periods.
   logical function is_on(motion, problem, branch)
      type(found_t), intent(in) :: motion
      type(problem_t), intent(inout) :: problem
      type(branch_t), intent(in) :: branch

      type(orbit_t) :: there
      real(wp), allocatable :: a(:)
      integer :: i
      logical :: ok

      is_on = .false.
      if (branch%periods /= motion%periods) return
      problem%periods = motion%periods
      do i = 2, branch%count
         associate (before => branch%point(i - 1)%orbit, next => branch%point(i)%orbit)
            call carry(problem, before%u, before%phase, modulo(next%phase - before%phase, 1.0_wp), a, ok)
            if (ok) call find_between(problem, motion%orbit, a, next, there, is_on)
         end associate
         if (is_on) return
      end do
   end function is_on

end module razy_orbits_search
