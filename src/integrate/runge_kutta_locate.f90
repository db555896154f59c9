!! Where in a step the first guard of the mode is left, on the step's dense output.
!!
!! A step is looked at inside unless the speeds at its ends show that no guard can be reached. It is divided by `least_probes`
!! or more points, so that none is longer than half a radian of the fastest excitation of a gap; at each the guards and their
!! rates are formed. A guard that is negative at a point was left before it; one that falls at a point and rises at the next has
!! a minimum in between, which is found and judged. Roots are found by Newton's method in a bracket, to rounding of the time.
module razy_integrate_runge_kutta_locate
   use razy_core_kinds, only: wp
   use razy_integrate_dense_output, only: path_t
   use razy_integrate_field, only: field_t
   use razy_integrate_runge_kutta_guards, only: guards_t
   use razy_integrate_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: least_probes, locator_t

   integer, parameter :: least_probes = 8
   !> Angle of the fastest excitation of a gap between probes.
   real(wp), parameter :: longest_angle = 0.5_wp
   integer, parameter :: most_iterations = 100
   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> Guards with their values at the start and the end of a step.
   type :: locator_t
      type(guards_t) :: guards
      real(wp), allocatable :: g0(:), rate0(:), g1(:), rate1(:)
      !> The guards that are left at the event found (count).
      logical, allocatable :: hit(:)
      !> |s''| at the start and the end of a step (contacts each), and whether that at the start is known.
      real(wp), allocatable, private :: bend0(:), bend1(:)
      logical, private :: bend_known = .false.
      !> Where a guard that fell has turned in the step, the least |g| there, at least half of it; huge where it has not (count).
      real(wp), allocatable :: nearest(:)
      !> Workspace: guards at two points inside, those to look at, state.
      real(wp), allocatable, private :: ga(:), ra(:), gb(:), rb(:), gc(:), rc(:), z(:)
      logical, allocatable, private :: suspect(:), falling(:)
      !> Whether all guards to look at are functions of s alone, and then the paths of s without excitation (contacts).
      logical, private :: on_paths = .false.
      type(path_t), allocatable, private :: path(:)
      !> The step that is looked at.
      real(wp), private :: tau = 0.0_wp, h = 0.0_wp
      !> The guard that is left first.
      integer, private :: first = 0
   contains
      procedure :: attach
      procedure :: start
      procedure :: find
      procedure :: advance
      procedure :: keep_at_rest
      procedure, private :: root
      procedure, private :: turn
      procedure, private :: look_inside
   end type locator_t

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: n

      call self%guards%attach(field)
      n = size(self%guards%entry)
      if (allocated(self%g0)) deallocate (self%g0, self%rate0, self%g1, self%rate1, self%hit, self%bend0, self%bend1, self%ga, &
                                          self%ra, self%gb, self%rb, self%gc, self%rc, self%z, self%suspect, &
                                          self%falling, self%path, self%nearest)
      allocate (self%g0(n), self%rate0(n), self%g1(n), self%rate1(n), self%ga(n), self%ra(n), self%gb(n), self%rb(n), self%gc(n), &
                self%rc(n), source=0.0_wp)
      allocate (self%hit(n), self%suspect(n), self%falling(n), source=.false.)
      allocate (self%nearest(n), source=huge(1.0_wp))
      allocate (self%z(2*field%m), source=0.0_wp)
      allocate (self%path(size(field%branch)))
      allocate (self%bend0(size(field%branch)), self%bend1(size(field%branch)), source=0.0_wp)
   end subroutine attach

   !> List the guards of the field's mode, which begins at (tau, z).
   subroutine start(self, field, tau, z)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      call self%guards%watch(field)
      call self%guards%measure(field, tau, z, .false.)
      call self%guards%look(field, tau, z, self%g0, self%rate0)
      self%bend_known = .false.
   end subroutine start

   !> Go on to the next step of the mode, after `find` has found nothing.
   pure subroutine advance(self)
      class(locator_t), intent(inout) :: self

      integer :: i

      do i = 1, self%guards%count
         self%g0(i) = self%g1(i)
         self%rate0(i) = self%rate1(i)
      end do
      self%bend0 = self%bend1
      self%bend_known = .true.
   end subroutine advance

   !> Take out of z, at the end of a step in which `find` has found nothing, the rounding of contacts that rest on a bound of s:
   !> where neither s nor s' can be told from rest they are set to it. Left alone, rounding would drift over the bound and back.
   subroutine keep_at_rest(self, field, z)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(inout) :: z(:)

      real(wp) :: length
      integer :: i, m

      m = field%m
      do i = 1, self%guards%count
         if (abs(self%g1(i)) > self%guards%noise(i)) cycle
         associate (entry => self%guards%entry(i))
            if (entry%function == 0 .or. abs(entry%beta) > 0.0_wp .or. .not. self%guards%reach(entry%contact) > 0.0_wp) cycle
            if (abs(self%rate1(i)) > abs(entry%alpha)*self%guards%on_rate(entry%contact)) cycle
            length = entry%side*entry%alpha*sum(field%w(:, entry%contact)**2)
            z(:m) = z(:m) - field%w(:, entry%contact)*(self%g1(i)/length)
            z(m + 1:) = z(m + 1:) - field%w(:, entry%contact)*(self%rate1(i)/length)
            self%g1(i) = 0.0_wp
            self%rate1(i) = 0.0_wp
         end associate
      end do
   end subroutine keep_at_rest

   !> Look for the first exit in the accepted step h of the stepper from (tau, z). If one is `found`, it is at theta*h, and
   !> `hit` are the guards that are left there together. `dense`: the dense output has been made.
   subroutine find(self, field, stepper, tau, z, found, theta, dense)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: tau, z(:)
      logical, intent(out) :: found, dense
      real(wp), intent(out) :: theta

      real(wp) :: a, b
      integer :: i, k, n, probes

      found = .false.
      dense = .false.
      theta = 1.0_wp
      n = self%guards%count
      if (n == 0) return
      self%nearest(:n) = huge(1.0_wp)
      self%tau = tau
      self%h = stepper%h
      self%guards%delta = 1.0e-5_wp*stepper%h
      call self%guards%look(field, tau + stepper%h, stepper%z_end, self%g1, self%rate1)
      call choose_suspects(self, field, stepper)
      if (.not. any(self%suspect(:n))) return
      dense = .true.
      call self%guards%measure(field, tau + stepper%h, stepper%z_end, .false.)
      call stepper%prepare_dense(field, tau, z)
      call choose_paths(self, field, stepper)
      probes = 1
      if (.not. all(self%falling(:n) .or. .not. self%suspect(:n))) then
         probes = max(least_probes, ceiling(self%guards%fastest*stepper%h/longest_angle))
      end if
      do i = 1, n
         self%ga(i) = self%g0(i)
         self%ra(i) = self%rate0(i)
      end do
      a = 0.0_wp
      do k = 1, probes
         b = real(k, wp)/probes
         if (k < probes) then
            call self%look_inside(field, stepper, b, self%gb, self%rb)
         else
            self%gb(:n) = self%g1(:n)
            self%rb(:n) = self%rate1(:n)
         end if
         do i = 1, n
            if (self%suspect(i)) call search_between(self, field, stepper, i, a, b, theta, found)
         end do
         if (found) exit
         a = b
         do i = 1, n
            self%ga(i) = self%gb(i)
            self%ra(i) = self%rb(i)
         end do
      end do
      if (found) call gather(self, field, stepper, theta)
   end subroutine find

   !> The guards that could be left in the step, at whose end `look` has just been. A path that touches 0 is at least g0 + g1 long;
   !> its speed is at most that at the ends and what twice their accelerations add in half the step. By the same bound a guard that
   !> falls at both ends may be known to be `falling` all the way, with no more than one root. Functions of the rate and forces are
   !> trusted only if twice the
   !> room of a cubic's control points is left.
   pure subroutine choose_suspects(self, field, stepper)
      type(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper

      real(wp) :: b0, b1, lowest, room
      integer :: i, j, m, n

      m = field%m
      n = size(field%branch)
      do j = 1, n
         self%bend1(j) = abs(field%second_rate(j, stepper%dz_end(m + 1:)))
      end do
      if (.not. self%bend_known) then
         call field%look_at_time(self%tau)
         do j = 1, n
            self%bend0(j) = abs(field%second_rate(j, stepper%dz_start(m + 1:)))
         end do
         self%bend_known = .true.
      end if
      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i))
            if (entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp) then
               room = max(abs(self%rate0(i)), abs(self%rate1(i))) + abs(entry%alpha) &
                      *stepper%h*max(self%bend0(entry%contact), self%bend1(entry%contact))
               self%suspect(i) = min(self%g0(i), self%g1(i)) <= self%guards%noise(i) &
                                 .or. self%g0(i) + self%g1(i) <= stepper%h*room
               self%falling(i) = self%g0(i) > self%guards%noise(i) .and. max(self%rate0(i), self%rate1(i)) < -abs(entry%alpha) &
                                 *stepper%h*max(self%bend0(entry%contact), self%bend1(entry%contact))
            else
               b0 = self%g0(i) + stepper%h*self%rate0(i)/3
               b1 = self%g1(i) - stepper%h*self%rate1(i)/3
               lowest = min(self%g0(i), b0, b1, self%g1(i))
               room = 2*max(abs(b0 - self%g0(i)), abs(b1 - self%g1(i)), abs(self%g1(i) - self%g0(i)))
               self%suspect(i) = lowest <= room
               self%falling(i) = .false.
            end if
         end associate
      end do
   end subroutine choose_suspects

   !> The paths of s for guards that are functions of s alone.
   subroutine choose_paths(self, field, stepper)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(stepper_t), intent(in) :: stepper

      integer :: i

      self%on_paths = .true.
      do i = 1, self%guards%count
         if (.not. self%suspect(i)) cycle
         associate (entry => self%guards%entry(i))
            self%on_paths = entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp
            if (.not. self%on_paths) return
            call stepper%output%follow(field%w(:, entry%contact), self%path(entry%contact))
         end associate
      end do
   end subroutine choose_paths

   !> Guards at theta of the step, at least those to look at.
   subroutine look_inside(self, field, stepper, theta, g, rate)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: theta
      real(wp), intent(inout) :: g(:), rate(:)

      real(wp) :: error, error_rate, s, s_rate
      integer :: i

      if (.not. self%on_paths) then
         call stepper%at(theta, self%z)
         call self%guards%look(field, self%tau + theta*self%h, self%z, g, rate)
         return
      end if
      call field%look_at_time(self%tau + theta*self%h)
      do i = 1, self%guards%count
         if (.not. self%suspect(i)) cycle
         associate (entry => self%guards%entry(i))
            call field%look_at_error(entry%contact, error, error_rate)
            call self%path(entry%contact)%look(theta, s, s_rate)
            g(i) = entry%side*(entry%alpha*(error + s) + entry%gamma - entry%bound)
            rate(i) = entry%side*entry%alpha*(error_rate + s_rate)
         end associate
      end do
   end subroutine look_inside

   !> Whether guard i is left between the probes a and b, before what has been found so far at `theta`.
   subroutine search_between(self, field, stepper, i, a, b, theta, found)
      type(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(inout) :: theta
      logical, intent(inout) :: found

      real(wp) :: at, g_turn, lowest, turn
      logical :: left

      left = .false.
      at = a
      associate (ga => self%ga(i), gb => self%gb(i), ra => self%ra(i), rb => self%rb(i), noise => self%guards%noise(i))
         if (gb < -noise) then
            left = .true.
            if (ga > noise) then
               call self%root(field, stepper, i, a, b, ga, gb, at)
            else if (ra > 0.0_wp) then
               ! It starts on the bound and leads away from it before it comes back.
               call self%turn(field, stepper, i, a, b, turn, g_turn)
               if (g_turn > noise) call self%root(field, stepper, i, turn, b, g_turn, gb, at)
            end if
         else if (ra < 0.0_wp .and. rb > 0.0_wp) then
            ! A convex function is nowhere below the tangents at both ends.
            lowest = ga + ra*((gb - ga - rb*(b - a)*self%h)/(ra - rb))
            if (lowest > 0.5_wp*min(ga, gb) .and. min(ga, gb) > noise) then
               self%nearest(i) = min(self%nearest(i), lowest)
               return
            end if
            call self%turn(field, stepper, i, a, b, turn, g_turn)
            self%nearest(i) = min(self%nearest(i), abs(g_turn))
            left = g_turn < -noise
            if (left .and. ga > noise) call self%root(field, stepper, i, a, turn, ga, g_turn, at)
         end if
      end associate
      if (.not. left) return
      if (found .and. .not. at < theta) return
      theta = at
      self%first = i
      found = .true.
   end subroutine search_between

   !> Root of guard i between theta = a, where it is positive, and b, where it is negative.
   subroutine root(self, field, stepper, i, a, b, ga, gb, at)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b, ga, gb
      real(wp), intent(out) :: at

      real(wp) :: high, low, move
      integer :: k

      low = a
      high = b
      at = a + (b - a)*ga/(ga - gb)
      do k = 1, most_iterations
         call self%look_inside(field, stepper, at, self%gc, self%rc)
         if (.not. abs(self%gc(i)) > 0.0_wp) return
         if (self%gc(i) > 0.0_wp) low = at
         if (self%gc(i) < 0.0_wp) high = at
         move = 0.0_wp
         if (self%rc(i) < 0.0_wp) move = -self%gc(i)/(self%rc(i)*self%h)
         if (.not. (at + move > low .and. at + move < high) .or. .not. abs(move) > 0.0_wp .or. k > most_iterations/2) then
            move = 0.5_wp*(low + high) - at
         end if
         at = at + move
         if (abs(move) <= eps*at .or. high - low <= 2*eps*high) return
      end do
   end subroutine root

   !> Where between theta = a and b the rate of guard i, of other signs there, vanishes, and the guard at that point.
   subroutine turn(self, field, stepper, i, a, b, at, g)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at, g

      real(wp) :: high, low, rate_high, rate_low, sign_low
      integer :: k, side

      low = a
      high = b
      rate_low = self%ra(i)
      rate_high = self%rb(i)
      sign_low = sign(1.0_wp, rate_low)
      side = 0
      do k = 1, most_iterations
         at = 0.5_wp*(low + high)
         if (k <= most_iterations/2 .and. rate_low*rate_high < 0.0_wp) at = low + (high - low)*rate_low/(rate_low - rate_high)
         at = min(max(at, low), high)
         call self%look_inside(field, stepper, at, self%gc, self%rc)
         g = self%gc(i)
         if (sign_low*self%rc(i) > 0.0_wp) then
            low = at
            rate_low = self%rc(i)
            if (side == 1) rate_high = 0.5_wp*rate_high
            side = 1
         else
            high = at
            rate_high = self%rc(i)
            if (side == -1) rate_low = 0.5_wp*rate_low
            side = -1
         end if
         if (high - low <= 1.0e-9_wp*b .or. .not. abs(self%rc(i)) > 0.0_wp) return
         if (abs(self%rc(i))*(high - low)*self%h <= eps*abs(g)) return
      end do
   end subroutine turn

   !> Mark the guard that is left first, at `theta`, and all others that are left there to rounding of the time.
   subroutine gather(self, field, stepper, theta)
      type(locator_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: theta

      real(wp) :: resolution
      integer :: i

      call self%look_inside(field, stepper, theta, self%gc, self%rc)
      resolution = 8*eps*max(theta*self%h, abs(self%tau))
      do i = 1, self%guards%count
         self%hit(i) = self%suspect(i) .and. self%rc(i) < 0.0_wp &
                       .and. self%gc(i) <= self%guards%noise(i) - resolution*self%rc(i)
      end do
      self%hit(self%first) = .true.
   end subroutine gather

end module razy_integrate_runge_kutta_locate
