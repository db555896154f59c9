!! A bound of the fourth derivative of a watched function on a step, beyond that of amplitudes which neither grow nor are driven.
module razy_exact_search_fourth_derivative
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: rows_t
   use razy_exact_search_refine, only: watched_t
   implicit none(type, external)
   private

   public :: fourth_derivative

contains

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

end module razy_exact_search_fourth_derivative
