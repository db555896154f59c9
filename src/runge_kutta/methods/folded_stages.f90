!! The stages of an explicit Runge-Kutta step in a mode whose forces are in its matrices (razy_hybrid_mode), without calls in
!! between: phases of excitation of all stages first, then one small product a stage.
module razy_runge_kutta_methods_folded_stages
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_tableaux, only: tableau_t
   implicit none(type, external)
   private

   public :: folded_stages, phases, stages

   !> Stages of any tableau.
   integer, parameter :: most = 16
   !> Angles below which phases are formed by short and long series.
   real(wp), parameter :: small_angle = 0.12_wp, large_angle = 0.8_wp

contains

   !> Slopes k(:, first … last) of a step h from z0 at tau, where the slopes before are known, and the state z of the last stage.
   subroutine folded_stages(field, tableau, tau, h, first, last, z0, k, z)
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: tau, h
      integer, intent(in) :: first, last
      real(wp), intent(in), contiguous :: z0(:)
      real(wp), intent(inout), contiguous :: k(:, :)
      real(wp), intent(inout), contiguous :: z(:)

      real(wp) :: part(field%m, most), c(most), d(most)
      integer :: i, j, t

      do j = first, last
         do i = 1, field%m
            part(i, j) = field%constant(i)
         end do
      end do
      do t = 1, size(field%omega)
         call phases(field%omega(t), (tau - field%base) + tableau%node(first:last)*h, field%base_cosine(t), field%base_sine(t), &
                     c(first:last), d(first:last))
         do j = first, last
            do i = 1, field%m
               part(i, j) = part(i, j) + (field%on_cosine(i, t)*c(j) + field%on_sine(i, t)*d(j))
            end do
         end do
      end do
      if (field%m == 2) then
         call stages_of_two(tableau, h, first, last, field%matrix, part, z0, k, z)
      else
         call stages(field%m, size(z0), tableau, h, first, last, field%matrix, part, z0, k, z)
      end if
   end subroutine folded_stages

   !> The same with the forcing `part` at the stages, for m coordinates and vectors of np >= 2m components, a multiple of four.
   pure subroutine stages(m, np, tableau, h, first, last, matrix, part, z0, k, z)
      integer, intent(in) :: m, np, first, last
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: h, matrix(m, 2*m), part(m, last), z0(np)
      real(wp), intent(inout) :: k(np, last), z(np)

      real(wp) :: a, sum(4), value
      integer :: i, j, l, term

      do i = first, last
         do j = 0, np - 4, 4
            sum = 0.0_wp
            do term = 1, tableau%row(i)%terms
               l = tableau%row(i)%column(term)
               value = tableau%row(i)%value(term)
               sum(1) = sum(1) + value*k(j + 1, l)
               sum(2) = sum(2) + value*k(j + 2, l)
               sum(3) = sum(3) + value*k(j + 3, l)
               sum(4) = sum(4) + value*k(j + 4, l)
            end do
            z(j + 1:j + 4) = z0(j + 1:j + 4) + h*sum
         end do
         do j = 1, m
            k(j, i) = z(m + j)
            a = part(j, i)
            do l = 1, 2*m
               a = a - matrix(j, l)*z(l)
            end do
            k(m + j, i) = a
         end do
      end do
   end subroutine stages

   !> `stages` for two coordinates, as relative motions in one contact have: all loops of known length.
   pure subroutine stages_of_two(tableau, h, first, last, matrix, part, z0, k, z)
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: first, last
      real(wp), intent(in) :: h, matrix(2, 4), part(2, last), z0(4)
      real(wp), intent(inout) :: k(4, last), z(4)

      real(wp) :: sum(4), x(4), value
      integer :: i, l, term

      do i = first, last
         sum = 0.0_wp
         do term = 1, tableau%row(i)%terms
            l = tableau%row(i)%column(term)
            value = tableau%row(i)%value(term)
            sum(1) = sum(1) + value*k(1, l)
            sum(2) = sum(2) + value*k(2, l)
            sum(3) = sum(3) + value*k(3, l)
            sum(4) = sum(4) + value*k(4, l)
         end do
         x = z0 + h*sum
         k(1, i) = x(3)
         k(2, i) = x(4)
         k(3, i) = (part(1, i) - matrix(1, 1)*x(1)) - (matrix(1, 2)*x(2) + (matrix(1, 3)*x(3) + matrix(1, 4)*x(4)))
         k(4, i) = (part(2, i) - matrix(2, 1)*x(1)) - (matrix(2, 2)*x(2) + (matrix(2, 3)*x(3) + matrix(2, 4)*x(4)))
      end do
      z = x
   end subroutine stages_of_two

   !> Cosine and sine of the phases of a tone of frequency omega at `later` s (times, the first or the last the longest) after the
   !> phase given by c0 and s0.
   pure subroutine phases(omega, later, c0, s0, c, s)
      real(wp), intent(in) :: omega, later(:), c0, s0
      real(wp), intent(out) :: c(:), s(:)

      real(wp) :: cosine, sine, x, x2, most_x
      integer :: i

      if (size(later) == 0) return
      most_x = omega*max(abs(later(1)), abs(later(size(later))))
      if (most_x <= small_angle) then
         do i = 1, size(later)
            x = omega*later(i)
            x2 = x*x
            cosine = 1 - x2*(1.0_wp/2 - x2*(1.0_wp/24 - x2*(1.0_wp/720 - x2*(1.0_wp/40320 - x2*(1.0_wp/3628800)))))
            sine = x*(1 - x2*(1.0_wp/6 - x2*(1.0_wp/120 - x2*(1.0_wp/5040 - x2*(1.0_wp/362880)))))
            c(i) = c0*cosine - s0*sine
            s(i) = s0*cosine + c0*sine
         end do
      else if (most_x <= large_angle) then
         do i = 1, size(later)
            x = omega*later(i)
            x2 = x*x
            cosine = 1.0_wp/3628800 - x2*(1.0_wp/479001600 - x2*(1.0_wp/87178291200.0_wp - x2*(1.0_wp/20922789888000.0_wp)))
            cosine = 1 - x2*(1.0_wp/2 - x2*(1.0_wp/24 - x2*(1.0_wp/720 - x2*(1.0_wp/40320 - x2*cosine))))
            sine = 1.0_wp/39916800 - x2*(1.0_wp/6227020800.0_wp - x2*(1.0_wp/1307674368000.0_wp - x2*(1.0_wp/355687428096000.0_wp)))
            sine = x*(1 - x2*(1.0_wp/6 - x2*(1.0_wp/120 - x2*(1.0_wp/5040 - x2*(1.0_wp/362880 - x2*sine)))))
            c(i) = c0*cosine - s0*sine
            s(i) = s0*cosine + c0*sine
         end do
      else
         do i = 1, size(later)
            x = omega*later(i)
            cosine = cos(x)
            sine = sin(x)
            c(i) = c0*cosine - s0*sine
            s(i) = s0*cosine + c0*sine
         end do
      end if
   end subroutine phases

end module razy_runge_kutta_methods_folded_stages
