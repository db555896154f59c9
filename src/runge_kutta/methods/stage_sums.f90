!! Sums over the slopes of a Runge-Kutta step: stages, the error in units of the tolerance, and products with matrices that hold
!! such sums.
!!
!! Rows of slopes have a length that is a multiple of four.
module razy_runge_kutta_methods_stage_sums
   use razy_core_kinds, only: wp
   use razy_runge_kutta_methods_tableaux, only: sum_t
   implicit none(type, external)
   private

   public :: add_up, combine, multiply, scaled_error, width

   !> Rows of products are taken four at a time.
   integer, parameter :: width = 4

   !> Weight of the estimate of order 3 in that of DOP853 (Hairer, Nørsett and Wanner I, (10.17)).
   real(wp), parameter :: share_of_third = 0.01_wp

contains

   !> Largest component of the error `estimates` e of a step from z0 to z1 (n each) in units of the tolerance; not finite if one is
   !> not.
   pure function scaled_error(n, rows, estimates, e, z0, z1, absolute, relative) result(error)
      integer, intent(in) :: n, rows, estimates
      real(wp), intent(in) :: e(rows, estimates), z0(n), z1(n), absolute, relative
      real(wp) :: error

      real(wp) :: first, largest, scale, second
      integer :: i

      first = 0.0_wp
      second = 0.0_wp
      do i = 1, n
         scale = 1.0_wp/(absolute + relative*max(abs(z0(i)), abs(z1(i))))
         error = abs(e(i, 1))*scale
         if (.not. error <= huge(error)) return
         first = max(first, error)
         if (estimates < 2) cycle
         error = abs(e(i, 2))*scale
         if (.not. error <= huge(error)) return
         second = max(second, error)
      end do
      error = first
      if (estimates < 2 .or. .not. first > 0.0_wp) return
      second = sqrt(share_of_third)*second
      largest = max(first, second)
      error = first*((first/largest)/sqrt((first/largest)**2 + (second/largest)**2))
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

   !> out = matrix u, of `stacked` blocks of four rows, three at a time (DOP853 with two coordinates has three).
   pure subroutine multiply(stacked, columns, matrix, u, out)
      integer, intent(in) :: stacked, columns
      real(wp), intent(in) :: matrix(width, columns, stacked), u(columns)
      real(wp), intent(inout) :: out(width, stacked)

      real(wp) :: a1, a2, a3, a4, b1, b2, b3, b4, c1, c2, c3, c4, x
      integer :: i, j

      i = 1
      do while (i < stacked - 1)
         a1 = 0.0_wp
         a2 = 0.0_wp
         a3 = 0.0_wp
         a4 = 0.0_wp
         b1 = 0.0_wp
         b2 = 0.0_wp
         b3 = 0.0_wp
         b4 = 0.0_wp
         c1 = 0.0_wp
         c2 = 0.0_wp
         c3 = 0.0_wp
         c4 = 0.0_wp
         ! Pairs of rows, not pairs of columns, go together.
         !GCC$ novector
         do j = 1, columns
            x = u(j)
            a1 = a1 + matrix(1, j, i)*x
            a2 = a2 + matrix(2, j, i)*x
            a3 = a3 + matrix(3, j, i)*x
            a4 = a4 + matrix(4, j, i)*x
            b1 = b1 + matrix(1, j, i + 1)*x
            b2 = b2 + matrix(2, j, i + 1)*x
            b3 = b3 + matrix(3, j, i + 1)*x
            b4 = b4 + matrix(4, j, i + 1)*x
            c1 = c1 + matrix(1, j, i + 2)*x
            c2 = c2 + matrix(2, j, i + 2)*x
            c3 = c3 + matrix(3, j, i + 2)*x
            c4 = c4 + matrix(4, j, i + 2)*x
         end do
         out(:, i) = [a1, a2, a3, a4]
         out(:, i + 1) = [b1, b2, b3, b4]
         out(:, i + 2) = [c1, c2, c3, c4]
         i = i + 3
      end do
      do while (i <= stacked)
         a1 = 0.0_wp
         a2 = 0.0_wp
         a3 = 0.0_wp
         a4 = 0.0_wp
         !GCC$ novector
         do j = 1, columns
            x = u(j)
            a1 = a1 + matrix(1, j, i)*x
            a2 = a2 + matrix(2, j, i)*x
            a3 = a3 + matrix(3, j, i)*x
            a4 = a4 + matrix(4, j, i)*x
         end do
         out(:, i) = [a1, a2, a3, a4]
         i = i + 1
      end do
   end subroutine multiply

end module razy_runge_kutta_methods_stage_sums
