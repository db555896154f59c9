!! Watched functions of large models that need not be looked at on a step, as they cannot reach their bounds so soon.
!!
!! A function f is a sum of amplitudes with exponents λ and coefficients c. Of the sums Σ |c||λ|^p |a| those of order 0 and 4 are
!! known, and by Hölder's inequality that of order 2 is at most the root of their product. With |f''| <= b, f stays positive from f0
!! with the slope g0 for (g0 + sqrt(g0² + 2 b f0))/b. Until then it is not evaluated.
module razy_exact_search_screening
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: rows_t, value_and_slope
   use razy_exact_search_refine, only: watched_t
   implicit none(type, external)
   private

   public :: screen, find_safe

   !> Part of a proved time that is used.
   real(wp), parameter :: used = 0.99_wp

contains

   !> Until when each function is certain to stay, from its value, slope and bounds at the time `tau` of the segment.
   pure subroutine find_safe(response, rows, tau, watched)
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      real(wp), intent(in) :: tau
      type(watched_t), contiguous, intent(inout) :: watched(:)

      real(wp) :: bend, f, span
      integer :: i, k

      do i = 1, size(watched)
         associate (w => watched(i))
            w%stale = .false.
            w%given = w%shares_form
            w%idle = w%resting
            w%safe_until = tau
            if (w%order > 0 .or. response%growing .or. response%nx > 0) cycle
            f = max(w%f0, 0.0_wp)
            bend = sqrt(w%scale*w%m4)
            do k = 1, response%rigid
               bend = bend + abs(rows%rigid_y(k, w%form)*response%rigid_force(k))
            end do
            if (response%driven%count > 0) bend = bend + rows%forced(2, w%form)
            span = certain(f, w%g0, bend)
            if (response%driven%count > 0) span = certain(f, w%g0, bend + rows%drift(2, w%form)*span/3)
            w%safe_until = tau + used*span
         end associate
      end do
   end subroutine find_safe

   !> How long f + g t - bend t²/2 stays positive, f >= 0.
   elemental function certain(f, g, bend) result(span)
      real(wp), intent(in) :: f, g, bend
      real(wp) :: span

      real(wp), parameter :: longest = 1.0e3_wp

      span = longest
      if (f + g*longest - 0.5_wp*bend*longest**2 < 0.0_wp) span = (g + sqrt(g**2 + 2*bend*f))/max(bend, tiny(1.0_wp))
   end function certain

   !> Which functions need not be looked at on the step from `from` to the time `tau_end` of the segment. Of two that share a form
   !> both are looked at or none. Value and slope at the start are formed where they are missing.
   pure subroutine screen(response, rows, from, tau_end, watched)
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: from
      real(wp), intent(in) :: tau_end
      type(watched_t), contiguous, intent(inout) :: watched(:)

      real(wp) :: f, g
      integer :: i
      logical :: screened

      do i = 1, size(watched)
         associate (w => watched(i))
            if (.not. w%shares_form) then
               screened = tau_end <= w%safe_until
               if (i < size(watched)) then
                  if (watched(i + 1)%shares_form) screened = screened .and. tau_end <= watched(i + 1)%safe_until
               end if
            end if
            w%given = w%shares_form .or. screened
            w%idle = w%resting .or. screened
            if (.not. screened .and. w%stale) then
               call value_and_slope(rows, response, from, w%form, w%order, f, g)
               w%f0 = max(w%side*(f - w%bound), 0.0_wp)
               w%g0 = w%side*g
            end if
            w%stale = screened
         end associate
      end do
   end subroutine screen

end module razy_exact_search_screening
