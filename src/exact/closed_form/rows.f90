!! Linear forms of the motion in one mode, and their derivatives, as rows of coefficients on its amplitudes, and their values.
module razy_exact_closed_form_rows
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_driven, only: driven_t
   use razy_exact_closed_form_response, only: response_t, shape_matrix
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_linalg_wide_sums, only: sum_of, two_sums, wide
   implicit none(type, external)
   private

   public :: curvature_bound, derivatives, integral_of, new_rows, rows_t, size_of, value_and_slope, value_of

   !> Rows of several forms and of their derivatives of order 0…4.
   type :: rows_t
      integer :: forms = 0
      !> f^(p) = Σ re(:, p)*Re(a) + im(:, p)*Im(a) (amplitudes, 0:4, forms).
      real(wp), allocatable :: re(:, :, :), im(:, :, :)
      !> Moduli of the coefficients of order 0 and 4 (amplitudes, forms).
      real(wp), allocatable :: size0(:, :), size4(:, :)
      !> Of driven terms: bounds of what their excitation adds to derivatives of order 0…5, and of the terms of that (0:5, forms);
      !> by how much their part in derivatives of order 4, 5 and 2 may grow per s (0:2, forms).
      real(wp), allocatable :: forced(:, :), forced_reach(:, :), drift(:, :)
      !> What a coefficient of order 0 would be if form and mode were parallel (amplitudes, forms), the largest of each
      !> form, and its constant (forms).
      real(wp), allocatable :: reach(:, :), longest_reach(:), reach_constant(:)
      !> Lengths of the forms on displacements and velocities (2, forms).
      real(wp), allocatable :: length(:, :)
      !> On rigid modes and their rates (rigid, forms).
      real(wp), allocatable :: rigid_y(:, :), rigid_v(:, :)
      !> On dense states, orders 0…5 (nx, 0:5, forms).
      real(wp), allocatable :: dense(:, :, :)
      real(wp), allocatable :: constant(:)
   end type rows_t

   !> Below this angle a quotient of differences loses more digits than nine terms of the series leave out.
   real(wp), parameter :: smallest_angle = 0.1_wp

contains

   !> Rows of the forms in this response.
   pure subroutine new_rows(self, response, forms)
      type(rows_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      type(linear_form_t), intent(in) :: forms(:)

      complex(wp) :: coefficient
      real(wp) :: form(2*response%m)
      integer :: i, j, p, n, part

      n = response%amplitudes
      self%forms = size(forms)
      self%constant = [(forms(j)%constant, j=1, size(forms))]
      call shape_matrix(self%size0, n, self%forms)
      call shape_matrix(self%size4, n, self%forms)
      call shape_matrix(self%reach, n, self%forms)
      call shape_matrix(self%length, 2, self%forms)
      do j = 1, self%forms
         self%length(:, j) = [norm2(forms(j)%on_y), norm2(forms(j)%on_v)]
      end do
      self%reach_constant = [(reach_of(self%length(:, j), response%constant), j=1, size(forms))]
      call shape_matrix(self%rigid_y, response%rigid, self%forms)
      call shape_matrix(self%rigid_v, response%rigid, self%forms)
      if (allocated(self%re)) deallocate (self%re, self%im, self%dense, self%longest_reach)
      allocate (self%longest_reach(self%forms))
      allocate (self%re(n, 0:4, self%forms), self%im(n, 0:4, self%forms))
      allocate (self%dense(response%nx, 0:5, self%forms), source=0.0_wp)
      do j = 1, self%forms
         form = [forms(j)%on_y, forms(j)%on_v]
         self%constant(j) = self%constant(j) + dot_product(form, response%constant)
         do i = 1, n
            coefficient = cmplx(dot_product(form, response%from_re(:, i)), -dot_product(form, response%from_im(:, i)), wp)
            if (i > response%terms .and. i <= response%terms + response%tones) then
               coefficient = coefficient + forms(j)%error(i - response%terms)
            end if
            self%size0(i, j) = abs(coefficient)
            self%reach(i, j) = reach_of(self%length(:, j), response%from_re(:, i)) &
                               + reach_of(self%length(:, j), response%from_im(:, i))
            self%size4(i, j) = abs(coefficient)*response%modulus(i)**4
            do p = 0, 4
               self%re(i, p, j) = real(coefficient)
               self%im(i, p, j) = -aimag(coefficient)
               coefficient = coefficient*response%exponent(i)
            end do
         end do
         self%longest_reach(j) = maxval([0.0_wp, self%reach(:, j)])
         self%rigid_y(:, j) = matmul(forms(j)%on_y, response%rigid_mode)
         self%rigid_v(:, j) = matmul(forms(j)%on_v, response%rigid_mode)
         do part = 1, size(response%dense)
            call response%dense(part)%row(forms(j)%on_y, forms(j)%on_v, &
                                          self%dense(response%first(part):response%first(part + 1) - 1, :, j))
         end do
      end do
      if (response%driven%count > 0) call add_excitation(self, response%driven)
   end subroutine new_rows

   !> What derivatives of driven terms feel of their excitation.
   pure subroutine add_excitation(self, driven)
      type(rows_t), intent(inout) :: self
      type(driven_t), intent(in) :: driven

      integer :: j

      if (allocated(self%forced)) deallocate (self%forced, self%forced_reach, self%drift)
      allocate (self%forced(0:5, self%forms), self%forced_reach(0:5, self%forms), self%drift(0:2, self%forms))
      do j = 1, self%forms
         associate (first => driven%first + 1, last => driven%first + driven%count)
            call driven%add_to_row(cmplx(self%re(first:last, 0, j), -self%im(first:last, 0, j), wp), self%reach(first:last, j), &
                                   self%re(:, :, j), self%im(:, :, j), self%forced(:, j), self%forced_reach(:, j), &
                                   self%drift(:, j))
         end associate
      end do
   end subroutine add_excitation

   !> Length of a form times that of z (2m), displacements and velocities apart.
   pure function reach_of(length, z) result(reach)
      real(wp), intent(in) :: length(2), z(:)
      real(wp) :: reach

      associate (m => size(z)/2)
         reach = length(1)*norm2(z(:m)) + length(2)*norm2(z(m + 1:))
      end associate
   end function reach_of

   !> The derivatives f, g, d of orders `order`, `order` + 1 and `order` + 2 (0…4) of form `j` at the cursor.
   pure subroutine derivatives(rows, response, self, j, order, f, g, d)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp), intent(out) :: f, g, d

      integer :: i

      f = 0.0_wp
      g = 0.0_wp
      d = 0.0_wp
      do i = 1, response%amplitudes
         f = f + (rows%re(i, order, j)*self%re(i) + rows%im(i, order, j)*self%im(i))
         g = g + (rows%re(i, order + 1, j)*self%re(i) + rows%im(i, order + 1, j)*self%im(i))
         d = d + (rows%re(i, order + 2, j)*self%re(i) + rows%im(i, order + 2, j)*self%im(i))
      end do
      do i = 1, response%rigid
         if (order == 0) then
            f = f + (rows%rigid_y(i, j)*self%rigid(i) + rows%rigid_v(i, j)*self%rate(i))
            g = g + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
            d = d + rows%rigid_y(i, j)*response%rigid_force(i)
         else if (order == 1) then
            f = f + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
            g = g + rows%rigid_y(i, j)*response%rigid_force(i)
         else if (order == 2) then
            f = f + rows%rigid_y(i, j)*response%rigid_force(i)
         end if
      end do
      if (order == 0) f = f + rows%constant(j)
      do i = 1, response%nx
         f = f + rows%dense(i, order, j)*self%dense(i)
         g = g + rows%dense(i, order + 1, j)*self%dense(i)
         d = d + rows%dense(i, order + 2, j)*self%dense(i)
      end do
   end subroutine derivatives

   !> The value f and slope g of form `j` at the cursor, or those of its derivative of order `order` (0…3).
   pure subroutine value_and_slope(rows, response, self, j, order, f, g)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp), intent(out) :: f, g

      integer :: i

      if (response%terms >= wide) then
         call two_sums(response%amplitudes, rows%re(:, order, j), rows%im(:, order, j), rows%re(:, order + 1, j), &
                       rows%im(:, order + 1, j), self%re, self%im, f, g)
      else
         f = 0.0_wp
         g = 0.0_wp
         do i = 1, response%amplitudes
            f = f + (rows%re(i, order, j)*self%re(i) + rows%im(i, order, j)*self%im(i))
            g = g + (rows%re(i, order + 1, j)*self%re(i) + rows%im(i, order + 1, j)*self%im(i))
         end do
      end if
      do i = 1, response%rigid
         if (order == 0) then
            f = f + (rows%rigid_y(i, j)*self%rigid(i) + rows%rigid_v(i, j)*self%rate(i))
            g = g + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
         else if (order == 1) then
            f = f + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
            g = g + rows%rigid_y(i, j)*response%rigid_force(i)
         end if
      end do
      if (order == 0) f = f + rows%constant(j)
      do i = 1, response%nx
         f = f + rows%dense(i, order, j)*self%dense(i)
         g = g + rows%dense(i, order + 1, j)*self%dense(i)
      end do
   end subroutine value_and_slope

   !> The derivative of order `order` (0…4) of form `j` at the cursor.
   pure function value_of(rows, response, self, j, order) result(f)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: f

      integer :: i

      f = 0.0_wp
      do i = 1, response%amplitudes
         f = f + (rows%re(i, order, j)*self%re(i) + rows%im(i, order, j)*self%im(i))
      end do
      if (order == 0) f = f + rows%constant(j)
      if (order < 3 .and. response%rigid > 0) f = f + rigid_part(rows, response, self, j, order)
      do i = 1, response%nx
         f = f + rows%dense(i, order, j)*self%dense(i)
      end do
   end function value_of

   !> What rigid modes, which are parabolas in time, give to a derivative of order 0, 1 or 2.
   pure function rigid_part(rows, response, self, j, order) result(f)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: f

      integer :: i

      f = 0.0_wp
      do i = 1, response%rigid
         if (order == 0) then
            f = f + (rows%rigid_y(i, j)*self%rigid(i) + rows%rigid_v(i, j)*self%rate(i))
         else if (order == 1) then
            f = f + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
         else
            f = f + rows%rigid_y(i, j)*response%rigid_force(i)
         end if
      end do
   end function rigid_part

   !> Sum of the moduli of all that `value_of` is the sum of: its rounding is some epsilon of that. `modulus` are the moduli
   !> of the amplitudes.
   pure function size_of(rows, response, self, modulus, j, order) result(total)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      real(wp), intent(in) :: modulus(:)
      integer, intent(in) :: j, order
      real(wp) :: total

      integer :: i

      total = 0.0_wp
      if (order == 0) then
         total = abs(rows%constant(j))
         if (response%terms >= wide) then
            total = total + sum_of(response%amplitudes, rows%size0(:, j), modulus)
         else
            do i = 1, response%amplitudes
               total = total + rows%size0(i, j)*modulus(i)
            end do
         end if
      else
         do i = 1, response%amplitudes
            total = total + rows%size0(i, j)*response%modulus(i)**order*modulus(i)
         end do
         if (response%driven%count > 0) total = total + rows%forced(order, j)
      end if
      do i = 1, response%rigid
         if (order == 0) total = total + abs(rows%rigid_y(i, j)*self%rigid(i)) + abs(rows%rigid_v(i, j)*self%rate(i))
         if (order == 1) total = total + abs(rows%rigid_y(i, j)*self%rate(i)) + abs(rows%rigid_v(i, j)*response%rigid_force(i))
      end do
      do i = 1, response%nx
         total = total + abs(rows%dense(i, order, j)*self%dense(i))
      end do
   end function size_of

   !> Integral of form `j` between two points on one closed form without driven terms and dense parts: ∫ a e^{λτ} dτ = [a]/λ, or
   !> where λ turns a little only, a h (e^{λh} - 1)/(λh) by its series.
   pure function integral_of(rows, response, from, to, j) result(total)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: from, to
      integer, intent(in) :: j
      real(wp) :: total

      complex(wp) :: part, z
      real(wp) :: h, im, re
      integer :: i

      h = to%tau - from%tau
      total = h*rows%constant(j)
      do i = 1, response%amplitudes
         if (response%modulus(i)*h > smallest_angle) then
            re = to%re(i) - from%re(i)
            im = to%im(i) - from%im(i)
            part = cmplx(re*real(response%exponent(i)) + im*aimag(response%exponent(i)), &
                         im*real(response%exponent(i)) - re*aimag(response%exponent(i)), wp)/response%modulus(i)**2
         else
            z = h*response%exponent(i)
            part = h*cmplx(from%re(i), from%im(i), wp)*(1.0_wp + z/2*(1.0_wp + z/3*(1.0_wp + z/4*(1.0_wp + z/5*(1.0_wp &
                                                                             + z/6*(1.0_wp + z/7*(1.0_wp + z/8*(1.0_wp + z/9))))))))
         end if
         total = total + (rows%re(i, 0, j)*real(part) + rows%im(i, 0, j)*aimag(part))
      end do
      do i = 1, response%rigid
         total = total + h*(rows%rigid_y(i, j)*(from%rigid(i) + h/2*(from%rate(i) + h/3*response%rigid_force(i))) &
                            + rows%rigid_v(i, j)*(from%rate(i) + h/2*response%rigid_force(i)))
      end do
   end function integral_of

   !> A bound of the second derivative of form `j` after a point on a closed form that neither grows nor has driven terms or dense
   !> parts.
   pure function curvature_bound(rows, response, self, j) result(bound)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp) :: bound

      integer :: i

      bound = 0.0_wp
      do i = 1, response%amplitudes
         bound = bound + rows%size0(i, j)*response%modulus(i)**2*(abs(self%re(i)) + abs(self%im(i)))
      end do
      do i = 1, response%rigid
         bound = bound + abs(rows%rigid_y(i, j)*response%rigid_force(i))
      end do
   end function curvature_bound

end module razy_exact_closed_form_rows
