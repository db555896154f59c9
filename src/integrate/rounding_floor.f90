!! What of a linear form of the motion is rounding of the rest of the motion.
!!
!! A state is turned into amplitudes and a form into a row of coefficients by dense matrices of modes. Each sum of these
!! products errs by some epsilon of its terms, also where the sum itself is nearly 0: a body at rest seems to move by epsilon of
!! what the others move, and a contact at rest with gap 0 seems to open and close. A form all of whose motion is smaller than
!! that is known only to be at rest.
module razy_integrate_rounding_floor
   use razy_core_kinds, only: wp
   use razy_integrate_response, only: response_t, rows_t
   implicit none(type, external)
   private

   public :: small, within_rounding

   !> What is smaller than this part of the terms it is the sum of is rounding.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
   !> A form that is a larger part of what its terms could be is certainly no rounding.
   real(wp), parameter :: small = 1.0e-10_wp

contains

   !> Whether form `j`, which is at most `size` from its bound as long as the response lasts, never leaves the rounding of the
   !> state. `modulus` are the moduli of the amplitudes.
   pure function within_rounding(response, rows, modulus, j, size) result(within)
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      real(wp), intent(in) :: modulus(:), size
      integer, intent(in) :: j
      logical :: within

      real(wp) :: floor, sum_of_terms, state(2*response%m)
      integer :: i, k

      floor = rows%reach_constant(j)
      do k = 1, response%amplitudes
         floor = floor + rows%reach(k, j)*modulus(k)
      end do
      state = abs(response%constant)
      do k = 1, response%amplitudes
         do i = 1, 2*response%m
            state(i) = state(i) + hypot(response%from_re(i, k), response%from_im(i, k))*modulus(k)
         end do
      end do
      do k = 1, response%terms
         sum_of_terms = 0.0_wp
         do i = 1, 2*response%m
            sum_of_terms = sum_of_terms + hypot(response%to_re(i, k), response%to_im(i, k))*state(i)
         end do
         floor = floor + rows%size0(k, j)*sum_of_terms
      end do
      within = size <= rounding*floor
   end function within_rounding

end module razy_integrate_rounding_floor
