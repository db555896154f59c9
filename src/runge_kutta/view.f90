!! A step of a Runge-Kutta method, a strip of steps, or a moment (razy_runge_kutta_stretch), as observers see it:
!! observables and their turns.
!!
!! Values are those of the dense output; rates are those of the field at that state, so that both are continuous from step to
!! step. Turns are looked for between `probes` points, and are not proved to be all.
module razy_runge_kutta_view
   use razy_core_kinds, only: wp
   use razy_hybrid_field_observed, only: observed, observed_rate, observed_size
   use razy_motion_integrator, only: glimpse_t
   use razy_hybrid_mode, only: treat_by_events
   use razy_runge_kutta_stretch, only: stretch_t
   use razy_runge_kutta_turns, only: glimpse_sum, rate_path_t
   implicit none(type, external)
   private

   public :: view_t

   integer, parameter :: probes = 8, most_iterations = 100
   real(wp), parameter :: eps = epsilon(1.0_wp), longest_angle = 0.5_wp

   type, extends(stretch_t) :: view_t
      !> Largest frequency of excitation, rad/s.
      real(wp) :: fastest = 0.0_wp
      !> The rate of an observable, and whether turns are looked for on it.
      type(rate_path_t), private :: rate_path
      logical, private :: on_path = .false.
   contains
      procedure :: attach
      procedure :: see_strip
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure, private :: rate_of
   end type view_t

contains

   !> Make room for the machine of the field.
   subroutine attach(self)
      class(view_t), intent(inout) :: self

      call self%make_room()
      call self%rate_path%attach(self%field)
      self%fastest = 0.0_wp
      if (size(self%field%omega) > 0) self%fastest = maxval(self%field%omega)
   end subroutine attach

   !> See the first `steps` steps of the stepper's strip, which begins at `start` of the field's time.
   pure subroutine see_strip(self, start, steps)
      class(view_t), intent(inout) :: self
      real(wp), intent(in) :: start
      integer, intent(in) :: steps

      call self%take_strip(start, steps)
      self%rate_path%form = 0
   end subroutine see_strip

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(view_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      call self%look(tau)
      value = observed(self%field, form, self%start + tau, self%z)
   end function value

   !> Rate of observable `form` at `tau`, and the rounding in it.
   subroutine rate_of(self, form, tau, rate, noise)
      class(view_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rate, noise

      call self%look(tau)
      call observed_rate(self%field, form, self%start + tau, self%z, 1.0e-5_wp*self%h, rate, noise)
      noise = 16*eps*noise
   end subroutine rate_of

   !> Value, size and direction of observable `form` at `tau`; a rate of rounding is looked at again a little later.
   subroutine glimpse(self, form, tau, seen)
      class(view_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp), parameter :: later(*) = [0.0_wp, 1.0e-4_wp, 1.0e-2_wp, 0.1_wp, 1.0_wp]
      real(wp) :: noise, rate
      integer :: k

      if (self%rate_path%suits(form)) then
         call self%look(tau)
         call glimpse_sum(self%field, form, self%start + tau, self%z, seen%value, rate, seen%size, noise)
         if (self%moment) return
         if (abs(rate) > noise) then
            seen%direction = nint(sign(1.0_wp, rate))
            return
         end if
      else
         seen%value = self%value(form, tau)
         seen%size = observed_size(self%field, form, self%z)
         if (self%moment) return
      end if
      do k = 1, size(later)
         call self%rate_of(form, tau + later(k)*(self%duration - tau), rate, noise)
         if (.not. abs(rate) > noise) cycle
         seen%direction = nint(sign(1.0_wp, rate))
         return
      end do
   end subroutine glimpse

   !> The first time after `tau` at which the rate of observable `form`, of the sign of `direction` so far, changes sign.
   subroutine next_turn(self, form, tau, tau_end, direction, found, tau_found, value)
      class(view_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      found = .false.
      tau_found = tau_end
      value = 0.0_wp
      if (self%moment) return
      self%on_path = self%field%treatment == treat_by_events .and. self%rate_path%suits(form)
      if (.not. self%on_path) then
         call search(self, form, direction, tau, tau_end, found, tau_found)
      else if (self%steps > 1) then
         call search_strip(self, form, direction, tau, tau_end, found, tau_found)
      else
         if (self%rate_path%steady(self%field, form, self%start, self%h, direction, self%z_start, self%stepper%z_end, &
                                   self%stepper%dz_start, self%stepper%dz_end)) return
         call self%make_dense()
         call self%rate_path%follow(self%field, self%stepper%output)
         call search(self, form, direction, tau, tau_end, found, tau_found)
      end if
      if (found) value = self%value(form, tau_found)
   end subroutine next_turn

   !> The same in the steps of a strip, on the paths of those that may have one.
   subroutine search_strip(self, form, direction, tau, tau_end, found, tau_found)
      type(view_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(inout) :: found
      real(wp), intent(inout) :: tau_found

      integer :: k

      associate (strip => self%stepper%strip, path => self%rate_path)
         if (path%form /= form) call path%survey(self%field, form, strip, self%steps)
         do k = 1, self%steps
            if (strip%at(k) <= tau .or. path%steady_in(strip, k, direction)) cycle
            call self%load_step(k)
            call self%make_dense()
            path%start = self%start + strip%at(k - 1)
            path%h = strip%h
            call path%follow(self%field, self%stepper%output)
            call search(self, form, direction, max(tau - strip%at(k - 1), 0.0_wp), min(tau_end - strip%at(k - 1), strip%h), &
                        found, tau_found)
            if (.not. found) cycle
            tau_found = strip%at(k - 1) + tau_found
            return
         end do
      end associate
   end subroutine search_strip

   !> The same from `tau` on, by probes; on a path, both times count from the start of its step.
   subroutine search(self, form, direction, tau, tau_end, found, tau_found)
      type(view_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(out) :: found
      real(wp), intent(inout) :: tau_found

      real(wp) :: a, b, noise, rate
      integer :: k, n

      found = .false.
      n = max(1, ceiling(max(probes*(tau_end - tau)/self%h, self%fastest*(tau_end - tau)/longest_angle)))
      a = tau
      do k = 1, n
         b = tau + (tau_end - tau)*(real(k, wp)/n)
         if (k == n) b = tau_end
         call look_at_rate(self, form, b, rate, noise)
         found = direction*rate < -noise
         if (found) exit
         a = b
      end do
      if (found) call refine(self, form, direction, a, b, rate, tau_found)
   end subroutine search

   !> Rate of observable `form` at `tau` where turns are looked for, and the rounding in it.
   subroutine look_at_rate(self, form, tau, rate, noise)
      type(view_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rate, noise

      if (self%on_path) then
         rate = self%rate_path%rate_at(self%field, tau)
         noise = self%rate_path%noise
      else
         call self%rate_of(form, tau, rate, noise)
      end if
   end subroutine look_at_rate

   !> The sign change of a rate between a and b, where it is `rate_b`, by false position after Illinois, and bisection.
   subroutine refine(self, form, direction, a, b, rate_b, at)
      type(view_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: a, b, rate_b
      real(wp), intent(out) :: at

      real(wp) :: high, low, noise, rate, rate_high, rate_low
      integer :: k, side

      low = a
      high = b
      rate_high = rate_b
      call look_at_rate(self, form, a, rate_low, noise)
      side = 0
      at = high
      do k = 1, most_iterations
         at = 0.5_wp*(low + high)
         if (k <= most_iterations/2 .and. rate_low*rate_high < 0.0_wp) at = low + (high - low)*(rate_low/(rate_low - rate_high))
         call look_at_rate(self, form, at, rate, noise)
         if (abs(rate) <= noise) return
         if (direction*rate > 0.0_wp) then
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
         if (high - low <= 2*eps*max(high, self%h)) return
      end do
   end subroutine refine

end module razy_runge_kutta_view
