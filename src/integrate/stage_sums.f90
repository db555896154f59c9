!! Sums over the slopes of a Runge-Kutta step: stages, and the error in units of the tolerance.
!!
!! Rows of slopes have a length that is a multiple of four.
module razy_integrate_stage_sums
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_integrate_tableaux, only: sum_t, tableau_t
   implicit none(type, external)
   private

   public :: add_up, combine, scaled_error

   !> Weight of the estimate of order 3 in that of DOP853 (Hairer, Nørsett and Wanner I, (10.17)).
   real(wp), parameter :: share_of_third = 0.01_wp

contains

   !> Largest component of the error estimates of a step h from z0 to z1 in units of the tolerance; not finite if one is not.
   pure function scaled_error(tableau, h, k, z0, z1, absolute, relative) result(error)
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: h, absolute, relative
      real(wp), intent(in), contiguous :: k(:, :), z0(:), z1(:)
      real(wp) :: error

      real(wp) :: estimate(2), part, scale, sum(size(k, 1), 2)
      integer :: e, i

      do e = 1, tableau%errors
         call add_up(k, tableau%error(e), sum(:, e))
      end do
      estimate = 0.0_wp
      do i = 1, size(z1)
         scale = 1.0_wp/(absolute + relative*max(abs(z0(i)), abs(z1(i))))
         do e = 1, tableau%errors
            part = abs(sum(i, e))*scale
            if (.not. ieee_is_finite(part)) then
               error = part
               return
            end if
            estimate(e) = max(estimate(e), part)
         end do
      end do
      error = abs(h)*estimate(1)
      if (tableau%errors == 2 .and. estimate(1) > 0.0_wp) then
         error = error*(estimate(1)/hypot(estimate(1), sqrt(share_of_third)*estimate(2)))
      end if
   end function scaled_error

   !> out = Σ_j value_j k_column(j), four components at a time.
   pure subroutine add_up(k, sum, out)
      real(wp), intent(in), contiguous :: k(:, :)
      type(sum_t), intent(in) :: sum
      real(wp), intent(out), contiguous :: out(:)

      real(wp) :: a, b, c, d, value
      integer :: i, j, l

      do i = 1, size(k, 1), 4
         a = 0.0_wp
         b = 0.0_wp
         c = 0.0_wp
         d = 0.0_wp
         do j = 1, sum%terms
            l = sum%column(j)
            value = sum%value(j)
            a = a + value*k(i, l)
            b = b + value*k(i + 1, l)
            c = c + value*k(i + 2, l)
            d = d + value*k(i + 3, l)
         end do
         out(i) = a
         out(i + 1) = b
         out(i + 2) = c
         out(i + 3) = d
      end do
   end subroutine add_up

   !> out = base + h Σ_j value_j k_column(j).
   pure subroutine combine(base, h, k, sum, out)
      real(wp), intent(in), contiguous :: base(:), k(:, :)
      real(wp), intent(in) :: h
      type(sum_t), intent(in) :: sum
      real(wp), intent(inout), contiguous :: out(:)

      integer :: i

      call add_up(k, sum, out)
      do i = 1, size(base)
         out(i) = base(i) + h*out(i)
      end do
   end subroutine combine

end module razy_integrate_stage_sums
