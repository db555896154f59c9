!! Linear forms of the motion in one mode, and their derivatives, as rows of coefficients on its amplitudes, and their values.
module razy_exact_closed_form_rows
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, rigid_of, rigid_rate_of
   use razy_exact_closed_form_driven, only: driven_t
   use razy_exact_closed_form_response, only: response_t
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_linalg_blocks, only: sum_of, three_sums, two_sums
   use razy_linalg_dense, only: felt
   implicit none(type, external)
   private

   public :: curvature_bound, derivatives, integral_of, new_rows, rows_t, size_of, square_integral_of, value_and_slope, value_of

   !> Rows of several forms and of their derivatives of order 0…4.
   type :: rows_t
      integer :: forms = 0
      !> Coefficients of the derivatives f^(p) on the list of a motion (length, 0:4, forms; razy_exact_closed_form_amplitudes).
      real(wp), allocatable, private :: on(:, :, :)
      !> Moduli of those of order 0…5 on amplitudes (filled up to pairs, 0:5, forms).
      real(wp), allocatable :: moduli(:, :, :)
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
      !> Constants, and how far the origin of the closed form shifts them (forms).
      real(wp), allocatable :: constant(:), shift(:)
   contains
      procedure :: numbers
   end type rows_t

   !> Below this angle a quotient of differences loses more digits than nine terms of the series leave out.
   real(wp), parameter :: smallest_angle = 0.1_wp
   !> Terms of that series.
   integer, parameter :: series = 9

contains

   !> Rows of the forms in this response.
   pure subroutine new_rows(self, response, forms)
      type(rows_t), intent(out) :: self
      type(response_t), intent(in) :: response
      type(linear_form_t), intent(in) :: forms(:)

      complex(wp) :: coefficient
      real(wp) :: across(response%columns, 2*response%m), form(2*response%m), on(response%columns)
      real(wp) :: im(response%filled, 0:4), power(0:5, response%amplitudes), re(response%filled, 0:4)
      real(wp) :: slope
      integer :: f, i, j, k, p, n, part

      n = response%amplitudes
      f = response%filled
      self%forms = size(forms)
      self%constant = [(forms(j)%at_rest(response%origin), j=1, size(forms))]
      allocate (self%reach(n, self%forms), self%rigid_y(response%rigid, self%forms), &
                self%rigid_v(response%rigid, self%forms), self%longest_reach(self%forms))
      self%shift = [(abs(dot_product(forms(j)%on_y, response%origin(:response%m))), j=1, size(forms))]
      self%length = reshape([(norm2(forms(j)%on_y), norm2(forms(j)%on_v), j=1, size(forms))], [2, size(forms)])
      self%reach_constant = matmul(response%from_length(:, 0), self%length)
      if (response%driven%count > 0) then
         allocate (self%forced(0:5, self%forms), self%forced_reach(0:5, self%forms), self%drift(0:2, self%forms))
      end if
      allocate (self%on(response%length, 0:4, self%forms), self%moduli(response%filled, 0:5, self%forms), &
                self%dense(response%nx, 0:5, self%forms), source=0.0_wp)
      across = transpose(response%from)
      do i = 1, n
         power(:, i) = response%modulus(i)**[0, 1, 2, 3, 4, 5]
      end do
      do j = 1, self%forms
         re = 0.0_wp
         im = 0.0_wp
         form = [forms(j)%on_y, forms(j)%on_v]
         ! Of all columns at a time, which is four times as fast as one product after the other.
         on = 0.0_wp
         do k = 1, size(form)
            !$omp simd
            do i = 1, response%columns
               on(i) = on(i) + form(k)*across(i, k)
            end do
         end do
         self%constant(j) = self%constant(j) + on(response%one)
         do i = 1, n
            coefficient = cmplx(on(i), -on(f + i), wp)
            slope = 0.0_wp
            if (i > response%terms .and. i <= response%terms + response%tones) then
               coefficient = coefficient + forms(j)%error(i - response%terms)
               slope = response%slope(i - response%terms)
            end if
            self%moduli(i, :, j) = abs(coefficient)*power(:, i)
            if (slope > 0.0_wp) self%moduli(i, 1, j) = slope*abs(coefficient)
            self%reach(i, j) = dot_product(self%length(:, j), response%from_length(:, i))
            do p = 0, 4
               re(i, p) = real(coefficient)
               im(i, p) = -aimag(coefficient)
               if (slope > 0.0_wp) then
                  coefficient = cmplx(0.0_wp, -slope*real(coefficient), wp)
               else
                  coefficient = coefficient*response%exponent(i)
               end if
            end do
         end do
         self%longest_reach(j) = maxval([0.0_wp, self%reach(:, j)])
         self%rigid_y(:, j) = [(felt(forms(j)%on_y, response%rigid_mode(:, i)), i=1, response%rigid)]
         self%rigid_v(:, j) = [(felt(forms(j)%on_v, response%rigid_mode(:, i)), i=1, response%rigid)]
         do part = 1, size(response%dense)
            call response%dense(part)%row(forms(j)%on_y, forms(j)%on_v, &
                                          self%dense(response%first(part):response%first(part + 1) - 1, :, j))
         end do
         if (response%driven%count > 0) call add_excitation(self, response%driven, j, re, im)
         call list_coefficients(self, response, j, re, im)
      end do
   end subroutine new_rows

   !> Numbers that they hold, in the large arrays.
   elemental integer(i8) function numbers(self)
      class(rows_t), intent(in) :: self

      numbers = 0
      if (allocated(self%on)) numbers = size(self%on, kind=i8) + size(self%moduli) + size(self%reach) + size(self%dense)
   end function numbers

   !> Enter the coefficients re and im (filled, 0:4) of form j, and those on all else, into the list.
   pure subroutine list_coefficients(self, response, j, re, im)
      type(rows_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: j
      real(wp), intent(in) :: re(:, 0:), im(:, 0:)

      integer :: p

      associate (n => response%rigid, y => self%rigid_y(:, j), v => self%rigid_v(:, j))
         do p = 0, 4
            associate (row => self%on(:, p, j), one => response%one)
               row(:one - 1) = [re(:, p), im(:, p)]
               if (p == 0) row(one:one + 2*n) = [self%constant(j), y, v]
               if (p == 1) row(one + n + 1:one + 3*n) = [y, v]
               if (p == 2) row(one + 2*n + 1:one + 3*n) = y
            end associate
         end do
      end associate
   end subroutine list_coefficients

   !> What derivatives of driven terms feel of their excitation, in form j with the coefficients re and im (filled, 0:4).
   pure subroutine add_excitation(self, driven, j, re, im)
      type(rows_t), intent(inout) :: self
      type(driven_t), intent(in) :: driven
      integer, intent(in) :: j
      real(wp), intent(inout) :: re(:, 0:), im(:, 0:)

      associate (first => driven%first + 1, last => driven%first + driven%count)
         call driven%add_to_row(cmplx(re(first:last, 0), -im(first:last, 0), wp), self%reach(first:last, j), re, im, &
                                self%forced(:, j), self%forced_reach(:, j), self%drift(:, j))
      end associate
   end subroutine add_excitation

   !> The derivatives f, g, d of orders `order`, `order` + 1 and `order` + 2 (0…4) of form `j` at the cursor.
   pure subroutine derivatives(rows, response, self, j, order, f, g, d)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp), intent(out) :: f, g, d

      call three_sums(response%length, rows%on(1, order, j), self%x, f, g, d)
      if (response%nx == 0) return
      f = f + dense_part(rows, self, j, order)
      g = g + dense_part(rows, self, j, order + 1)
      d = d + dense_part(rows, self, j, order + 2)
   end subroutine derivatives

   !> The value f and slope g of form `j` at the cursor, or those of its derivative of order `order` (0…3).
   pure subroutine value_and_slope(rows, response, self, j, order, f, g)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp), intent(out) :: f, g

      call two_sums(response%length, rows%on(1, order, j), self%x, f, g)
      if (response%nx == 0) return
      f = f + dense_part(rows, self, j, order)
      g = g + dense_part(rows, self, j, order + 1)
   end subroutine value_and_slope

   !> The derivative of order `order` (0…4) of form `j` at the cursor.
   pure function value_of(rows, response, self, j, order) result(f)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: f

      f = sum_of(response%length, rows%on(1, order, j), self%x)
      if (response%nx > 0) f = f + dense_part(rows, self, j, order)
   end function value_of

   !> What dense states give to the derivative of order `order` of form `j`.
   pure function dense_part(rows, self, j, order) result(f)
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: f

      f = dot_product(rows%dense(:, order, j), self%dense(:size(rows%dense, 1)))
   end function dense_part

   !> Sum of the moduli of all that `value_of` is the sum of: its rounding is some epsilon of that. `modulus` are the moduli
   !> of the amplitudes, filled up to blocks.
   pure function size_of(rows, response, self, modulus, j, order) result(total)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: self
      real(wp), intent(in) :: modulus(:)
      integer, intent(in) :: j, order
      real(wp) :: total

      real(wp) :: rate
      integer :: i

      total = sum_of(response%filled, rows%moduli(:, order, j), modulus)
      if (order == 0) then
         total = total + abs(rows%constant(j)) + rows%shift(j)
      else if (response%driven%count > 0) then
         total = total + rows%forced(order, j)
      end if
      do i = 1, response%rigid
         rate = rigid_rate_of(self, response, i)
         if (order == 0) total = total + abs(rows%rigid_y(i, j)*rigid_of(self, response, i)) + abs(rows%rigid_v(i, j)*rate)
         if (order == 1) total = total + abs(rows%rigid_y(i, j)*rate) + abs(rows%rigid_v(i, j)*response%rigid_force(i))
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

      complex(wp) :: part
      real(wp) :: h, im, re
      integer :: i

      h = to%tau - from%tau
      total = h*rows%constant(j)
      associate (on => rows%on(:, 0, j), f => response%filled)
         do i = 1, response%amplitudes
            if (response%modulus(i)*h > smallest_angle) then
               re = to%x(i) - from%x(i)
               im = to%x(f + i) - from%x(f + i)
               associate (decay => response%decay(i), turn => response%turn(i))
                  total = total + (on(i)*(re*decay + im*turn) + on(f + i)*(im*decay - re*turn))/response%modulus(i)**2
               end associate
            else
               part = h*cmplx(from%x(i), from%x(f + i), wp)*mean_growth(h*response%exponent(i))
               total = total + (on(i)*real(part) + on(f + i)*aimag(part))
            end if
         end do
      end associate
      do i = 1, response%tones
         associate (at => response%terms + i)
            total = total + 0.5_wp*h**2*response%slope(i)*rows%on(at, 0, j)*from%x(response%filled + at)
         end associate
      end do
      do i = 1, response%rigid
         re = rigid_rate_of(from, response, i)
         total = total + h*(rows%rigid_y(i, j)*(rigid_of(from, response, i) + h/2*(re + h/3*response%rigid_force(i))) &
                            + rows%rigid_v(i, j)*(re + h/2*response%rigid_force(i)))
      end do
   end function integral_of

   !> (e^z - 1)/z for a small z, by its series.
   pure complex(wp) function mean_growth(z) result(mean)
      complex(wp), intent(in) :: z

      integer :: k

      mean = (1.0_wp, 0.0_wp)
      do k = series, 2, -1
         mean = 1.0_wp + (1.0_wp/k)*z*mean
      end do
   end function mean_growth

   !> Integral of the square of the rate of form `j` between two points on one closed form of exponential terms and tones alone: of
   !> Re Σ u_k the square is ½ Re Σ u_k (u_l + ū_l), and each product is an exponential again.
   pure function square_integral_of(rows, response, from, to, j) result(total)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: from, to
      integer, intent(in) :: j
      real(wp) :: total

      complex(wp), dimension(response%amplitudes) :: u_from, u_to
      real(wp) :: h
      integer :: k, l

      h = to%tau - from%tau
      associate (on => rows%on(:, 1, j), n => response%amplitudes, f => response%filled, rate => response%exponent)
         u_from = cmplx(on(:n), -on(f + 1:f + n), wp)*cmplx(from%x(:n), from%x(f + 1:f + n), wp)
         u_to = cmplx(on(:n), -on(f + 1:f + n), wp)*cmplx(to%x(:n), to%x(f + 1:f + n), wp)
         total = 0.0_wp
         do k = 1, n
            do l = 1, k
               total = total + merge(0.5_wp, 1.0_wp, k == l) &
                       *(passed(u_from(k)*u_from(l), u_to(k)*u_to(l), rate(k) + rate(l)) &
                         + passed(u_from(k)*conjg(u_from(l)), u_to(k)*conjg(u_to(l)), rate(k) + conjg(rate(l))))
            end do
         end do
      end associate

   contains

      !> Real part of the integral of what grows with `rate` from `first` to `last`.
      pure real(wp) function passed(first, last, rate)
         complex(wp), intent(in) :: first, last, rate

         if ((abs(rate%re) + abs(rate%im))*h > smallest_angle) then
            passed = real((last - first)/rate)
         else
            passed = real(h*first*mean_growth(h*rate))
         end if
      end function passed

   end function square_integral_of

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
         bound = bound + rows%moduli(i, 2, j)*(abs(self%x(i)) + abs(self%x(response%filled + i)))
      end do
      do i = 1, response%rigid
         bound = bound + abs(rows%rigid_y(i, j)*response%rigid_force(i))
      end do
   end function curvature_bound

end module razy_exact_closed_form_rows
