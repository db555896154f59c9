!! Linear forms of the motion in one contact state, and of their derivatives, as rows of coefficients on its amplitudes.
module razy_exact_closed_form_rows
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_driven, only: driven_t
   use razy_exact_closed_form_response, only: response_t, shape_matrix
   use razy_hybrid_linear_form, only: linear_form_t
   implicit none(type, external)
   private

   public :: new_rows, rows_t

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

end module razy_exact_closed_form_rows
