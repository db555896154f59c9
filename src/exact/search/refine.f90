!! A bracketed root of a watched function, to rounding, on the closed form.
module razy_exact_search_refine
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, copy, go_from, move_to, shift
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: derivatives, rows_t, value_of
   use razy_exact_search_sign_proof, only: hermite_root
   implicit none(type, external)
   private

   public :: refine_root, sharpen, watched_t

   !> f = side*(d^order/dt^order form - bound), which is to stay >= 0, with its values on the present step.
   type :: watched_t
      integer :: form = 1, order = 0
      real(wp) :: side = 1.0_wp, bound = 0.0_wp
      !> Starts on the bound and moves inwards.
      logical :: from_zero = .false.
      !> The rate outwards that it starts with, which is rounding.
      real(wp) :: slip = 0.0_wp
      !> What is known of its value at the start beside the sum of its terms; 0: nothing.
      real(wp) :: initial = 0.0_wp
      !> Known to stay on its bound; rounding in f that the form's own terms do not show.
      logical :: at_rest = .false.
      real(wp) :: floor = 0.0_wp
      !> Of the same form and order as the function before it in the list.
      logical :: shares_form = .false.
      !> On the present step: its value is that of the function before it, or is not needed; it is on its bound within the rounding
      !> of the state, as long as the piece lasts, or certain to stay.
      logical :: given = .false., idle = .false.
      !> Of large models: on its bound as long as the piece lasts; certain to stay until this time of the segment, s; whether f0
      !> and g0 are older than the present step.
      logical :: resting = .false.
      real(wp) :: safe_until = -huge(1.0_wp)
      logical :: stale = .false.
      !> Values and slopes at both ends of the step, bound of the fourth derivative of f.
      real(wp) :: f0 = 0.0_wp, g0 = 0.0_wp, f1 = 0.0_wp, g1 = 0.0_wp, m4 = 0.0_wp
      !> Time since when that bound holds, s, but for the growth of driven terms.
      real(wp) :: since = 0.0_wp
      !> Size of the terms that f is the sum of, and of the rounding in it.
      real(wp) :: scale = 0.0_wp, noise = 0.0_wp
   end type watched_t

   !> Times the fastest exponent, a shift that Taylor factors take to rounding.
   real(wp), parameter :: small_shift = 0.08_wp
   integer, parameter :: most_iterations = 60

contains

   !> The root in [0, high] (s after `from`) of a step of 2^-level s; f(0) >= 0 > f(high), and f has one root there.
   !>
   !> Cauchy's iteration, kept in the bracket by bisection; it ends when the correction is below the spacing of numbers at
   !> the root or f below its rounding. `probe` is left at the root, whose time in the segment is `root`.
   subroutine refine_root(response, rows, from, level, high, w, probe, root)
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: from
      integer, intent(in) :: level
      real(wp), intent(in) :: high
      type(watched_t), intent(in) :: w
      type(amplitudes_t), intent(inout) :: probe
      real(wp), intent(out) :: root

      real(wp) :: left, right, f, g, d, delta, next, tau
      integer :: i
      logical :: halves

      left = 0.0_wp
      right = high
      tau = hermite_root(w%f0, w%g0, w%f1, w%g1, response%step_length(level), high)
      call go_from(from, response, level, .true., tau, probe)
      do i = 1, most_iterations
         call derivatives(rows, response, probe, w%form, w%order, f, g, d)
         f = w%side*(f - w%bound)
         g = w%side*g
         d = w%side*d
         if (f >= 0.0_wp) then
            left = tau
         else
            right = tau
         end if
         if (abs(f) <= 0.5_wp*epsilon(1.0_wp)*w%scale) exit
         delta = cauchy_step(f, g, d, right - left)
         halves = abs(delta) > 1.5_wp*(right - left)
         ! A step to the end of the bracket may pass it by rounding.
         next = merge(0.5_wp*(left + right), max(left, min(right, tau + delta)), halves)
         delta = next - tau
         if (abs(delta) <= epsilon(1.0_wp)*(from%tau + tau)) exit
         tau = next
         if (abs(delta)*response%fastest <= small_shift) then
            call shift(probe, response, delta)
            ! The error is of third order: where the next correction would be rounding, it is not computed.
            if (.not. halves .and. abs(delta*d) < 1.0e-3_wp*abs(g)) then
               if (abs(delta)*max(abs(delta)*response%fastest, abs(delta*d/g))**2 &
                   <= 0.1_wp*epsilon(1.0_wp)*(from%tau + tau)) exit
            end if
         else
            call go_from(from, response, level, .false., tau, probe)
         end if
      end do
      root = from%tau + tau
      probe%tau = root
   end subroutine refine_root

   !> The correction that solves f + g x + d x²/2 = 0 where f falls (Cauchy's method, of third order). Where there is none, or
   !> one that is longer than `most`, twice that is returned, which breaks the bracket.
   elemental function cauchy_step(f, g, d, most) result(delta)
      real(wp), intent(in) :: f, g, d, most
      real(wp) :: delta

      real(wp) :: square, slope

      delta = 2*most
      square = g*g - 2*f*d
      if (.not. square > 0.0_wp) return
      slope = sqrt(square) - g
      if (2*abs(f) <= most*slope) delta = 2*f/slope
   end function cauchy_step

   !> The root `tau` of a function, soon after the start. There it is hardly more than the rounding of its terms, so what it gains
   !> is summed up from its rate, which is known to rounding of its own terms: by Gauss's rule of five places. `probe` is left at
   !> the root.
   subroutine sharpen(response, rows, start, w, tau, probe)
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: start
      type(watched_t), intent(in) :: w
      real(wp), intent(inout) :: tau
      type(amplitudes_t), intent(inout) :: probe

      real(wp), parameter :: near = sqrt(5 - 2*sqrt(10.0_wp/7))/6, far = sqrt(5 + 2*sqrt(10.0_wp/7))/6
      real(wp), parameter :: place(*) = 0.5_wp + [-far, -near, 0.0_wp, near, far]
      real(wp), parameter :: light = (322 - 13*sqrt(70.0_wp))/1800, heavy = (322 + 13*sqrt(70.0_wp))/1800
      real(wp), parameter :: weight(*) = [light, heavy, 64.0_wp/225, heavy, light]
      real(wp) :: correction, found, mean, slope
      integer :: i, k

      if (w%order > 0 .or. .not. tau > 0.0_wp .or. .not. (w%from_zero .or. w%initial > 0.0_wp)) return
      found = tau
      do i = 1, 3
         mean = merge(0.0_wp, w%initial/tau, w%from_zero)
         do k = 1, size(place)
            mean = mean + weight(k)*rate_at(place(k)*tau)
         end do
         slope = rate_at(tau)
         ! From zero, of f/tau, whose root is not the start.
         if (w%from_zero) slope = slope - mean
         if (.not. slope < 0.0_wp) exit
         correction = -tau*mean/slope
         if (.not. abs(tau + correction - found) <= 0.5_wp*found) tau = found - correction
         tau = tau + correction
         if (abs(correction) <= sqrt(epsilon(1.0_wp))*tau) exit
      end do
      call move_to(start, response, tau, probe)

   contains

      !> By the series as long as they are right.
      real(wp) function rate_at(at)
         real(wp), intent(in) :: at

         if (at*response%fastest <= small_shift) then
            call copy(start, response, probe)
            call shift(probe, response, at)
         else
            call move_to(start, response, at, probe)
         end if
         rate_at = w%side*value_of(rows, response, probe, w%form, 1)
      end function rate_at

   end subroutine sharpen

end module razy_exact_search_refine
