!! Factors by which the amplitudes of a closed form change in a time.
module razy_exact_closed_form_step_table
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_response, only: response_t
   use razy_linalg_exponential, only: matrix_exponential
   implicit none(type, external)
   private

   public :: growth, tabulate

contains

   !> Enter the factors over 2^-level s into the table of the response.
   pure subroutine tabulate(response, level)
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level

      complex(wp) :: factor(response%amplitudes)
      integer :: i, j, k

      response%step_length(level) = scale(1.0_wp, -level)
      do i = 1, response%amplitudes
         call growth(response%exponent(i), response%step_length(level), response%step_re(i, level), response%step_im(i, level))
         factor(i) = cmplx(response%step_re(i, level), response%step_im(i, level), wp)
      end do
      associate (driven => response%driven)
         if (driven%count > 0) call driven%tabulate_push(response%step_length(level), factor(driven%first + 1:response%terms), &
                                                         factor(response%terms + 1:), response%push_re(:, :, level), &
                                                         response%push_im(:, :, level))
      end associate
      if (response%nx > 0) response%step_dense(:, :, level) = 0.0_wp
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         response%step_dense(j:k, j:k, level) = matrix_exponential(response%dense(i)%matrix, response%step_length(level))
      end do
      response%has_step(level) = .true.
   end subroutine tabulate

   !> Real and imaginary part of exp(exponent*tau); growth beyond the range of the numbers is held at its edge, where the
   !> caller sees a blow-up.
   pure subroutine growth(exponent, tau, re, im)
      complex(wp), intent(in) :: exponent
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: re, im

      real(wp) :: angle, factor

      angle = aimag(exponent)*tau
      re = cos(angle)
      im = sin(angle)
      if (.not. abs(real(exponent)) > 0.0_wp) return
      factor = exp(min(max(real(exponent)*tau, -700.0_wp), 200.0_wp))
      re = factor*re
      im = factor*im
   end subroutine growth

end module razy_exact_closed_form_step_table
