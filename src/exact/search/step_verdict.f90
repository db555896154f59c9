!! What one watched function does on one step of the closed form: stays inside its bounds, leaves them, or cannot be told.
!!
!! Proofs, in this order, from values and slopes at both ends and a bound of the fourth derivative (razy_exact_search_sign_proof):
!! positive, monotone, convex or concave; a convex function with a minimum inside is decided by the sign of that (grazing).
module razy_exact_search_step_verdict
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_response, only: finest_level, response_t
   use razy_exact_closed_form_rows, only: rows_t, value_of
   use razy_exact_search_refine, only: refine_root, watched_t
   use razy_exact_search_sign_proof, only: proved_curvature, proved_margin, proved_monotone
   implicit none(type, external)
   private

   public :: judge, leaves, stays, undecided

   !> Verdicts.
   integer, parameter :: stays = 0, leaves = 1, undecided = 2
   !> Times the fastest exponent, a step on which a change of third order is below rounding: its ends decide.
   real(wp), parameter :: shortest = 1.0e-6_wp
   !> A fall within one step of so many times the rounding of the value is a fall.
   real(wp), parameter :: clearly = 16.0_wp

contains

   !> What a function does on a step of h = 2^-level s after `from`, at whose end its form has the value `f` and the slope `g`;
   !> `high` (s after `from`) ends the bracket of a root, `room` says that twice the step may do. `lowest` is a cursor to work with.
   subroutine judge(from, level, response, rows, w, f, g, h, lowest, verdict, high, room)
      type(amplitudes_t), intent(in) :: from
      integer, intent(in) :: level
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(inout) :: w
      real(wp), intent(in) :: f, g, h
      type(amplitudes_t), intent(inout) :: lowest
      integer, intent(out) :: verdict
      real(wp), intent(out) :: high
      logical, intent(out) :: room

      real(wp) :: change, margin, m4, d0, d1
      integer :: curvature

      high = h
      w%f1 = w%side*(f - w%bound)
      w%g1 = w%side*g
      ! Rounding below zero is no crossing, unless the function is on its way: put off to the next step, the crossings of a body
      ! that hops ever lower would be late by a part of the hop.
      if (abs(w%f1) <= w%noise .and. .not. -w%g1*h > clearly*w%noise) w%f1 = max(w%f1, 0.0_wp)
      m4 = w%m4
      if (.not. response%bounded) m4 = fourth_derivative(from, response, rows, w, h)
      margin = proved_margin(w%f0, w%g0, w%f1, w%g1, h, m4)
      room = .false.
      verdict = stays
      if (w%f1 >= 0.0_wp .and. margin >= 0.0_wp) then
         ! Twice the step has sixteen times the error, and a smaller margin; what rests on its bound has neither.
         room = margin >= m4*h**4*(40.0_wp/144)
         return
      end if
      if (w%f1 < 0.0_wp) verdict = leaves
      if (level >= finest_level) return
      ! What changes by no more than its rounding is told by its ends; a parabola on its bound would be halved without end.
      change = h*(abs(w%g0) + abs(w%g1)) + m4*h**4
      if (change <= w%noise) then
         room = verdict == stays .and. 16*change <= w%noise
         return
      end if
      if (verdict == leaves .and. w%g0 > 0.0_wp .and. .not. w%f0 > 0.0_wp) then
         ! From zero up and below zero again: half the step separates the root at its start from the one to be found.
         verdict = undecided
         return
      end if
      ! Free flight, a parabola, has no time of its own.
      if (response%fastest > 0.0_wp .and. h*response%fastest <= shortest) return
      if (proved_monotone(w%f0, w%g0, w%f1, w%g1, h, m4, w%noise)) return
      call proved_curvature(w%f0, w%g0, w%f1, w%g1, h, m4, w%noise, d0, d1, curvature)
      if (curvature == 0) then
         verdict = undecided
      else if (verdict == stays .and. curvature > 0 .and. w%g0 < 0.0_wp .and. w%g1 > 0.0_wp) then
         call judge_minimum(from, level, response, rows, w, d0, d1, h, lowest, verdict, high)
      end if
   end subroutine judge

   !> A convex function that is positive at both ends: the sign of its minimum decides, and ends the bracket of the first root.
   subroutine judge_minimum(from, level, response, rows, w, d0, d1, h, at_minimum, verdict, high)
      type(amplitudes_t), intent(in) :: from
      integer, intent(in) :: level
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w
      real(wp), intent(in) :: d0, d1, h
      type(amplitudes_t), intent(inout) :: at_minimum
      integer, intent(out) :: verdict
      real(wp), intent(inout) :: high

      type(watched_t) :: slope
      real(wp) :: lowest, tau

      slope = watched_t(form=w%form, order=w%order + 1, side=-w%side, f0=-w%g0, g0=-d0, f1=-w%g1, g1=-d1, &
                        scale=w%scale*response%fastest)
      call refine_root(response, rows, from, level, h, slope, at_minimum, tau)
      lowest = w%side*(value_of(rows, response, at_minimum, w%form, w%order) - w%bound)
      verdict = stays
      if (lowest >= -w%noise) return
      verdict = leaves
      high = tau - from%tau
   end subroutine judge_minimum

   !> Bound of the fourth derivative of f on a step where amplitudes grow, are driven, or states are dense.
   pure function fourth_derivative(from, response, rows, w, h) result(m4)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w
      real(wp), intent(in) :: h
      real(wp) :: m4

      m4 = w%m4
      if (response%driven%count > 0) m4 = m4 + rows%drift(w%order, w%form)*((from%tau - w%since) + h)
      if (response%growing) m4 = m4*growth_over(response, h)
      if (response%nx > 0) m4 = m4 + dense_bound(from, response, rows, w%form, w%order + 4, h)
   end function fourth_derivative

   !> Largest factor by which an amplitude grows over a step.
   pure function growth_over(response, h) result(factor)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: h
      real(wp) :: factor

      factor = exp(min(h*max(0.0_wp, maxval(real(response%exponent))), 200.0_wp))
   end function growth_over

   !> Bound of the dense states' part in the derivative of order p: |r exp(Tt) x| <= max|r| exp(|T|t) sum|x|.
   pure function dense_bound(from, response, rows, form, p, h) result(bound)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      integer, intent(in) :: form, p
      real(wp), intent(in) :: h
      real(wp) :: bound

      integer :: i, j, k

      bound = 0.0_wp
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         bound = bound + maxval(abs(rows%dense(j:k, p, form)))*sum(abs(from%dense(j:k))) &
                 *exp(min(response%dense(i)%norm*h, 200.0_wp))
      end do
   end function dense_bound

end module razy_exact_search_step_verdict
