!! The closed form of the motion in one contact state under given excitation.
!!
!! All parts of the motion that vary in time stand in one list: exponential terms of the modes and, after them, one
!! term for each tone of excitation, whose amplitude is e^{iω_t t} itself. Every linear form of the state and every
!! derivative of it is then a row of coefficients on these amplitudes, plus those on rigid modes and dense parts.
module razy_integrate_response
   use razy_core_kinds, only: wp
   use razy_integrate_dense_part, only: dense_part_t, new_dense_part
   use razy_integrate_modal_parts, only: modal_basis_t
   use razy_integrate_products, only: wide
   implicit none(type, external)
   private

   public :: linear_form_t, new_response, new_rows, response_t, rows_t
   public :: coarsest_level, finest_level

   !> f = on_y·y + on_v·y' + constant + Re(Σ error_t e^{iω_t t}).
   type :: linear_form_t
      real(wp), allocatable :: on_y(:), on_v(:)
      real(wp) :: constant = 0.0_wp
      complex(wp), allocatable :: error(:)
   end type linear_form_t

   !> Rows of several forms and of their derivatives of order 0…4.
   type :: rows_t
      integer :: forms = 0
      !> f^(p) = Σ re(:, p)*Re(a) + im(:, p)*Im(a) (amplitudes, 0:4, forms).
      real(wp), allocatable :: re(:, :, :), im(:, :, :)
      !> Moduli of the coefficients of order 0 and 4 (amplitudes, forms).
      real(wp), allocatable :: size0(:, :), size4(:, :)
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

   !> Search steps are 2^-level seconds.
   integer, parameter :: coarsest_level = -30, finest_level = 70

   type :: response_t
      integer :: m = 0, terms = 0, tones = 0, rigid = 0, nx = 0
      !> terms + tones.
      integer :: amplitudes = 0
      !> Exponents of all amplitudes (terms + tones) and their moduli.
      complex(wp), allocatable :: exponent(:)
      real(wp), allocatable :: modulus(:)
      !> Largest modulus of an exponent or of the rates in a dense part, 1/s.
      real(wp) :: fastest = 0.0_wp
      logical :: growing = .false.
      !> Level of steps on which the fastest amplitude turns by less than 0.05.
      integer :: fine_level = 0
      !> z = constant + from_re Re(a) + from_im Im(a) + rigid and dense parts (2m, amplitudes).
      real(wp), allocatable :: constant(:), from_re(:, :), from_im(:, :)
      !> a = to_re z + i to_im z for the terms (2m, terms), z without constant and tones.
      real(wp), allocatable :: to_re(:, :), to_im(:, :)
      !> Moduli of `from` and `to`, made when they are asked for.
      real(wp), allocatable :: from_size(:, :), to_size(:, :)
      !> `to` transposed (terms, 2m), for large models only.
      real(wp), allocatable :: into_re(:, :), into_im(:, :)
      !> Rigid modes (m, rigid) and the constant force on each.
      real(wp), allocatable :: rigid_mode(:, :), rigid_force(:)
      type(dense_part_t), allocatable :: dense(:)
      !> First dense state of each part, and one beyond the last.
      integer, allocatable :: first(:)
      !> Factors of the amplitudes over steps of 2^-level s, made when first used (amplitudes, level).
      real(wp), allocatable :: step_re(:, :), step_im(:, :)
      !> Dense step matrices (nx, nx, level), block diagonal.
      real(wp), allocatable :: step_dense(:, :, :)
      logical :: has_step(coarsest_level:finest_level) = .false.
      real(wp) :: step_length(coarsest_level:finest_level) = 0.0_wp
   end type response_t

contains

   !> The response of modes `basis` to the constant force `load` (m) and phasors `harmonic` (m, tones).
   pure subroutine new_response(self, basis, load, harmonic, omega)
      type(response_t), intent(inout) :: self
      type(modal_basis_t), intent(in) :: basis
      real(wp), intent(in) :: load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :)

      complex(wp) :: particular(2*basis%m)
      integer :: i, m, n, t

      m = basis%m
      self%m = m
      self%terms = size(basis%lambda)
      self%tones = size(omega)
      self%rigid = size(basis%rigid, 2)
      n = self%terms + self%tones
      self%amplitudes = n
      self%exponent = [basis%lambda, (cmplx(0.0_wp, omega(t), wp), t=1, self%tones)]
      self%modulus = abs(self%exponent)
      self%growing = any(real(basis%lambda) > 0.0_wp)
      self%constant = -real(matmul(basis%from_term, matmul(basis%to_term(:, m + 1:), load)/basis%lambda))
      if (self%terms == 0) self%constant = [(0.0_wp, i=1, 2*m)]
      call shape_matrix(self%from_re, 2*m, n)
      call shape_matrix(self%from_im, 2*m, n)
      self%from_re(:, :self%terms) = real(basis%from_term)
      self%from_im(:, :self%terms) = -aimag(basis%from_term)
      do t = 1, self%tones
         particular = harmonic_state(basis, harmonic(:, t), omega(t))
         self%from_re(:, self%terms + t) = real(particular)
         self%from_im(:, self%terms + t) = -aimag(particular)
      end do
      if (allocated(self%from_size)) deallocate (self%from_size, self%to_size)
      self%to_re = transpose(real(basis%to_term))
      self%to_im = transpose(aimag(basis%to_term))
      if (self%terms >= wide) then
         self%into_re = real(basis%to_term)
         self%into_im = aimag(basis%to_term)
      end if
      self%rigid_mode = basis%rigid
      self%rigid_force = matmul(load, basis%rigid)
      if (allocated(self%step_re)) deallocate (self%step_re, self%step_im)
      allocate (self%step_re(n, coarsest_level:finest_level), self%step_im(n, coarsest_level:finest_level))
      self%has_step = .false.
      call add_dense_parts(self, basis, load, harmonic, omega)
      self%fastest = 0.0_wp
      if (n > 0) self%fastest = maxval(self%modulus)
      if (size(self%dense) > 0) self%fastest = max(self%fastest, maxval(self%dense%norm))
      self%fine_level = min(max(exponent(20*self%fastest), coarsest_level), finest_level)
   end subroutine new_response

   pure subroutine add_dense_parts(self, basis, load, harmonic, omega)
      type(response_t), intent(inout) :: self
      type(modal_basis_t), intent(in) :: basis
      real(wp), intent(in) :: load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :)

      integer :: i

      self%nx = 0
      if (allocated(self%dense)) deallocate (self%dense)
      allocate (self%dense(size(basis%dense)))
      self%first = [1]
      do i = 1, size(basis%dense)
         call new_dense_part(self%dense(i), basis%dense(i), load, harmonic, omega)
         self%nx = self%nx + size(self%dense(i)%matrix, 1)
         self%first = [self%first, self%nx + 1]
      end do
      if (allocated(self%step_dense)) deallocate (self%step_dense)
      if (self%nx > 0) allocate (self%step_dense(self%nx, self%nx, coarsest_level:finest_level))
   end subroutine add_dense_parts

   !> P with z = Re(P e^{iωt}) in the exponential terms and rigid modes: (iω - A)⁻¹ (0, force), by modes.
   pure function harmonic_state(basis, force, omega) result(particular)
      type(modal_basis_t), intent(in) :: basis
      complex(wp), intent(in) :: force(:)
      real(wp), intent(in) :: omega
      complex(wp) :: particular(2*basis%m)

      complex(wp) :: drive, mirrored, rigid
      integer :: k, m

      m = basis%m
      particular = (0.0_wp, 0.0_wp)
      do k = 1, size(basis%lambda)
         drive = sum(basis%to_term(k, m + 1:)*force)/(cmplx(0.0_wp, omega, wp) - basis%lambda(k))
         if (abs(aimag(basis%lambda(k))) > 0.0_wp) then
            mirrored = sum(conjg(basis%to_term(k, m + 1:))*force)/(cmplx(0.0_wp, omega, wp) - conjg(basis%lambda(k)))
            particular = particular + 0.5_wp*(basis%from_term(:, k)*drive + conjg(basis%from_term(:, k))*mirrored)
         else
            particular = particular + basis%from_term(:, k)*drive
         end if
      end do
      do k = 1, size(basis%rigid, 2)
         rigid = -sum(basis%rigid(:, k)*force)/omega**2
         particular(:m) = particular(:m) + basis%rigid(:, k)*rigid
         particular(m + 1:) = particular(m + 1:) + basis%rigid(:, k)*rigid*cmplx(0.0_wp, omega, wp)
      end do
   end function harmonic_state

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
            if (i > response%terms) coefficient = coefficient + forms(j)%error(i - response%terms)
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
   end subroutine new_rows

   !> Length of a form times that of z (2m), displacements and velocities apart.
   pure function reach_of(length, z) result(reach)
      real(wp), intent(in) :: length(2), z(:)
      real(wp) :: reach

      associate (m => size(z)/2)
         reach = length(1)*norm2(z(:m)) + length(2)*norm2(z(m + 1:))
      end associate
   end function reach_of

   pure subroutine shape_matrix(matrix, rows, columns)
      real(wp), allocatable, intent(inout) :: matrix(:, :)
      integer, intent(in) :: rows, columns

      if (allocated(matrix)) then
         if (size(matrix, 1) == rows .and. size(matrix, 2) == columns) return
         deallocate (matrix)
      end if
      allocate (matrix(rows, columns))
   end subroutine shape_matrix

end module razy_integrate_response
