!! Where in a step the first guard of the mode is left, on the step's dense output.
!!
!! A step is looked at inside unless the speeds at its ends show that no guard can be reached. It is divided by `least_probes`
!! or more points, so that none is longer than half a radian of the fastest excitation that guards feel; at each the guards and
!! their rates are formed. A guard that is negative at a point was left before it; one that falls at a point and rises at the next
!! has a minimum in between, which is found and judged (razy_runge_kutta_probe).
module razy_runge_kutta_locate
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_bounds, only: guard_bounds_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: least_probes, locator_t

   integer, parameter :: least_probes = 8
   !> Angle of the fastest excitation that guards feel between probes.
   real(wp), parameter :: longest_angle = 0.5_wp
   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Rounding of a sum in units of the length of its terms.
   real(wp), parameter :: of_sum = 16*eps

   !> Guards with their values at the start and the end of a step, and those that are left at an event.
   type, extends(guard_bounds_t) :: locator_t
      !> The guards that are left at the event found (count).
      logical, allocatable :: hit(:)
      !> The guard that is left first.
      integer :: first = 0
   contains
      procedure :: attach
      procedure :: find
      procedure :: keep_at_rest
   end type locator_t

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(locator_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      call self%make_bounds(field)
      if (allocated(self%hit)) deallocate (self%hit)
      allocate (self%hit(size(self%guards%entry)), source=.false.)
   end subroutine attach

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
      self%guards%delta = 1.0e-5_wp*stepper%h/max(1.0_wp, self%guards%fastest*stepper%h)
      call self%guards%look(field, tau + stepper%h, stepper%z_end, self%g1, self%rate1)
      call self%choose_suspects(field, stepper)
      if (.not. any(self%suspect(:n))) return
      dense = .true.
      call self%guards%measure(field, tau + stepper%h, stepper%z_end, .false.)
      call stepper%prepare_dense(field, tau, z)
      call self%choose_paths(field, stepper)
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
               call self%root(field, stepper, i, a, b, ga, gb, ra, rb, at)
            else if (at_rest(self, field, stepper, i, ga, ra)) then
               call self%emerge(field, stepper, i, a, b, at)
            else if (ra > 0.0_wp) then
               ! It starts on the bound and leads away from it before it comes back, if by no more than rounding.
               call self%turn(field, stepper, i, a, b, turn, g_turn)
               at = turn
               if (g_turn > noise) call self%root(field, stepper, i, turn, b, g_turn, gb, 0.0_wp, rb, at)
            else
               call self%come_back(field, stepper, i, a, b, at)
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
            if (left .and. ga > noise) call self%root(field, stepper, i, a, turn, ga, g_turn, ra, 0.0_wp, at)
         end if
      end associate
      if (.not. left) return
      if (found .and. .not. at < theta) return
      theta = at
      self%first = i
      found = .true.
   end subroutine search_between

   !> Whether guard i, with the value g and the rate at the start of the step, rests on its bound as far as can be told: g, g' and
   !> g'' are rounding there.
   pure function at_rest(self, field, stepper, i, g, rate)
      class(locator_t), intent(in) :: self
      type(field_t), intent(in) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: g, rate
      logical :: at_rest

      associate (entry => self%guards%entry(i), guards => self%guards)
         at_rest = entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp .and. abs(g) <= guards%noise(i) &
                   .and. abs(rate) <= abs(entry%alpha)*guards%on_rate(entry%contact)
         if (at_rest) at_rest = abs(self%bend0(entry%contact)) <= of_sum*guards%reach(entry%contact) &
                                *norm2(stepper%dz_start(field%m + 1:))
      end associate
   end function at_rest

   !> Whether guard i falls at the start of the step: with its rate, or from rest with its second derivative. The rate of dense
   !> output there is not that of the motion to the last bit.
   pure function falls(self, field, stepper, i)
      class(locator_t), intent(in) :: self
      type(field_t), intent(in) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      logical :: falls

      associate (entry => self%guards%entry(i), guards => self%guards)
         falls = self%rate0(i) < 0.0_wp
         if (entry%function == 0 .or. abs(entry%beta) > 0.0_wp) return
         if (abs(self%rate0(i)) > abs(entry%alpha)*guards%on_rate(entry%contact)) return
         falls = entry%side*entry%alpha*self%bend0(entry%contact) < -of_sum*abs(entry%alpha)*guards%reach(entry%contact) &
                 *norm2(stepper%dz_start(field%m + 1:))
      end associate
   end function falls

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
         if (.not. theta > 0.0_wp) then
            self%hit(i) = self%suspect(i) .and. self%g0(i) <= self%guards%noise(i) .and. falls(self, field, stepper, i)
            cycle
         end if
         self%hit(i) = self%suspect(i) .and. self%rc(i) < 0.0_wp &
                       .and. self%gc(i) <= self%guards%noise(i) - resolution*self%rc(i)
      end do
      self%hit(self%first) = .true.
   end subroutine gather

end module razy_runge_kutta_locate
