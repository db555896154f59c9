!! Guards inside a step, on its dense output: their values, roots and turns.
!!
!! Guards that are functions of s alone are followed as scalar paths; any other, as a force, needs the state. Roots are found
!! by Newton's method in a bracket, to rounding of the time, turns by false position after Illinois.
module razy_runge_kutta_probe
   use razy_core_kinds, only: wp
   use razy_runge_kutta_methods_dense_output, only: path_t
   use razy_hybrid_field, only: field_t
   use razy_hybrid_guards, only: guards_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: guard_probe_t

   type :: guard_probe_t
      type(guards_t) :: guards
      !> The step that is looked at, and the guards to look at in it.
      real(wp) :: tau = 0.0_wp, h = 0.0_wp
      logical, allocatable :: suspect(:)
      !> Guards and rates at two points a and b, and at one in between.
      real(wp), allocatable :: ga(:), ra(:), gb(:), rb(:), gc(:), rc(:)
      real(wp), allocatable, private :: z(:)
      !> Whether all guards to look at are functions of s alone, and then the paths of s without excitation (contacts).
      logical, private :: on_paths = .false.
      type(path_t), allocatable, private :: path(:)
   contains
      procedure :: make_room
      procedure :: choose_paths
      procedure :: look_inside
      procedure, private :: look_at_guard
      procedure :: root
      procedure :: turn
      procedure :: emerge
      procedure :: come_back
   end type guard_probe_t

   integer, parameter :: most_iterations = 100
   real(wp), parameter :: eps = epsilon(1.0_wp), least_move = 1.0e-9_wp, least_part = 1.0e-3_wp

contains

   !> Make room for a machine.
   subroutine make_room(self, field)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: n

      call self%guards%attach(field)
      n = size(self%guards%entry)
      if (allocated(self%ga)) deallocate (self%ga, self%ra, self%gb, self%rb, self%gc, self%rc, self%z, self%suspect, self%path)
      allocate (self%ga(n), self%ra(n), self%gb(n), self%rb(n), self%gc(n), self%rc(n), source=0.0_wp)
      allocate (self%suspect(n), source=.false.)
      allocate (self%z(2*field%m), source=0.0_wp)
      allocate (self%path(size(field%branch)))
   end subroutine make_room

   !> The paths of s for guards that are functions of s alone.
   subroutine choose_paths(self, field, stepper)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(stepper_t), intent(in) :: stepper

      integer :: i

      self%on_paths = .true.
      do i = 1, self%guards%count
         if (.not. self%suspect(i)) cycle
         associate (entry => self%guards%entry(i))
            self%on_paths = entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp
            if (.not. self%on_paths) return
            call stepper%output%follow(field%w(:, entry%contact), 0, self%path(entry%contact))
         end associate
      end do
   end subroutine choose_paths

   !> Guards at theta of the step, at least those to look at.
   subroutine look_inside(self, field, stepper, theta, g, rate)
      class(guard_probe_t), intent(inout) :: self
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

   !> Guard i and its rate at theta of the step.
   subroutine look_at_guard(self, field, stepper, i, theta, g, rate)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: g, rate

      real(wp) :: error, error_rate, s, s_rate

      if (self%on_paths) then
         associate (entry => self%guards%entry(i))
            call field%look_at_time(self%tau + theta*self%h)
            call field%look_at_error(entry%contact, error, error_rate)
            call self%path(entry%contact)%look(theta, s, s_rate)
            g = entry%side*(entry%alpha*(error + s) + entry%gamma - entry%bound)
            rate = entry%side*entry%alpha*(error_rate + s_rate)
         end associate
      else
         call self%look_inside(field, stepper, theta, self%gc, self%rc)
         g = self%gc(i)
         rate = self%rc(i)
      end if
   end subroutine look_at_guard

   !> Root of guard i between theta = a, where it is positive, and b, where it is negative; with its rates there.
   subroutine root(self, field, stepper, i, a, b, ga, gb, ra, rb, at)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b, ga, gb, ra, rb
      real(wp), intent(out) :: at

      real(wp) :: g, high, low, move, rate
      integer :: k

      low = a
      high = b
      at = a + (b - a)*cubic_root(ga, gb, (b - a)*self%h*ra, (b - a)*self%h*rb)
      do k = 1, most_iterations
         call self%look_at_guard(field, stepper, i, at, g, rate)
         if (.not. abs(g) > 0.0_wp) return
         if (g > 0.0_wp) low = at
         if (g < 0.0_wp) high = at
         move = 0.0_wp
         if (rate < 0.0_wp) move = -g/(rate*self%h)
         ! The square of such a move is rounding.
         if (abs(move) > 0.0_wp .and. abs(move) <= least_move*at .and. at + move > low .and. at + move < high) then
            at = at + move
            return
         end if
         if (.not. (at + move > low .and. at + move < high) .or. .not. abs(move) > 0.0_wp .or. k > most_iterations/2) then
            move = 0.5_wp*(low + high) - at
         end if
         at = at + move
         if (abs(move) <= eps*at .or. high - low <= 2*eps*high) return
      end do
   end subroutine root

   !> About where in [0, 1] the cubic with the values g0 > 0 > g1 and the slopes d0 and d1 at the ends vanishes.
   pure function cubic_root(g0, g1, d0, d1) result(x)
      real(wp), intent(in) :: g0, g1, d0, d1
      real(wp) :: x

      real(wp) :: a, b, slope
      integer :: k

      a = d0 + d1 - 2*(g1 - g0)
      b = 3*(g1 - g0) - 2*d0 - d1
      x = g0/(g0 - g1)
      do k = 1, 2
         slope = d0 + x*(2*b + x*3*a)
         if (.not. slope < 0.0_wp) return
         x = min(max(x - (g0 + x*(d0 + x*(b + x*a)))/slope, 0.0_wp), 1.0_wp)
      end do
   end function cubic_root

   !> Where between theta = a and b the rate of guard i, of other signs there, vanishes, and the guard at that point.
   subroutine turn(self, field, stepper, i, a, b, at, g)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at, g

      real(wp) :: high, low, rate, rate_high, rate_low, sign_low
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
         call self%look_at_guard(field, stepper, i, at, g, rate)
         if (sign_low*rate > 0.0_wp) then
            low = at
            rate_low = rate
            if (side == 1) rate_high = 0.5_wp*rate_high
            side = 1
         else
            high = at
            rate_high = rate
            if (side == -1) rate_low = 0.5_wp*rate_low
            side = -1
         end if
         if (high - low <= 1.0e-9_wp*b .or. .not. abs(rate) > 0.0_wp) return
         if (abs(rate)*(high - low)*self%h <= eps*abs(g)) return
      end do
   end subroutine turn

   !> Where between theta = a, where guard i is on its bound, and b, where it is beyond, that can be told from rounding.
   subroutine emerge(self, field, stepper, i, a, b, at)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at

      real(wp) :: low, middle

      low = a
      at = b
      do while (at - low > least_part*at)
         middle = 0.5_wp*(low + at)
         call self%look_inside(field, stepper, middle, self%gc, self%rc)
         if (self%gc(i) < -self%guards%noise(i)) then
            at = middle
         else
            low = middle
         end if
      end do
   end subroutine emerge

   !> Where guard i, on its bound at theta = a and beyond it at b, comes back to it if it leads away from it first, though its rate
   !> at a does not say so (friction that begins to slide with no acceleration); `at` = a if it does not.
   subroutine come_back(self, field, stepper, i, a, b, at)
      class(guard_probe_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at

      real(wp) :: g, g_high, high, low, rate, rate_high
      integer :: k

      at = a
      high = b
      call self%look_at_guard(field, stepper, i, high, g_high, rate_high)
      do k = 1, digits(1.0_wp)
         low = a + 0.5_wp*(high - a)
         call self%look_at_guard(field, stepper, i, low, g, rate)
         if (abs(g) <= self%guards%noise(i)) return
         if (g > 0.0_wp) then
            call self%root(field, stepper, i, low, high, g, g_high, rate, rate_high, at)
            return
         end if
         high = low
         g_high = g
         rate_high = rate
      end do
   end subroutine come_back

end module razy_runge_kutta_probe
