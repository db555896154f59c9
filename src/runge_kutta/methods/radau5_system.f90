!! The linear equations of Radau IIA (razy_runge_kutta_methods_radau5): factors of λ/h - J for the real eigenvalue λ of A^-1
!! and for the conjugate pair, and what Newton's iteration and the error estimate solve with them.
!!
!! With z = (y, y') the matrix λ - J is reduced by hand: (K + λ(B + λ)) y = q + (B + λ) p, v = λ y - p for the right-hand
!! side (p, q), where K and B are the tangents of the forces. That is an eighth of the work on the whole matrix.
module razy_runge_kutta_methods_radau5_system
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_jacobian, only: form_jacobian
   use razy_linalg_lapack, only: dgetrf, dgetrs, zgetrf, zgetrs
   implicit none(type, external)
   private

   public :: factorise, make_room, newton_correction, radau_system_t, solve_real, transform
   public :: radau_inverse_transform, radau_transform

   !> Matrices and workspace for n = 2m components.
   type :: radau_system_t
      integer :: m = 0
      integer(i8) :: factorisations = 0
      !> Whether there is a Jacobian matrix, whether it is that of the start of the step; step of the factors at hand.
      logical :: has_jacobian = .false., is_fresh = .false.
      real(wp) :: h_factored = 0.0_wp
      !> df/dz (n, n); factors (m, m).
      real(wp), allocatable :: jacobian(:, :), factor(:, :)
      complex(wp), allocatable :: complex_factor(:, :)
      integer, allocatable :: pivot(:), complex_pivot(:)
      !> Transformed increments of the stages; slopes, then corrections (n, 3).
      real(wp), allocatable :: w(:, :), f(:, :)
      real(wp), allocatable :: real_side(:)
      complex(wp), allocatable :: complex_side(:)
   end type radau_system_t

   real(wp), parameter :: cube_root_81 = 4.32674871092222514696492_wp, cube_root_9 = 2.08008382305190411453006_wp
   !> Eigenvalues of A^-1: `lambda`, and `lambda_re` ± i `lambda_im`.
   real(wp), parameter, public :: lambda = 30/(6 + cube_root_81 - cube_root_9)
   real(wp), parameter :: inverse_re = (12 - cube_root_81 + cube_root_9)/60, &
                          inverse_im = (cube_root_81 + cube_root_9)*sqrt(3.0_wp)/60
   real(wp), parameter, public :: lambda_re = inverse_re/(inverse_re**2 + inverse_im**2), &
                                  lambda_im = inverse_im/(inverse_re**2 + inverse_im**2)
   !> T and T^-1 (Hairer and Wanner II, IV.8), columns one after the other.
   real(wp), parameter :: radau_transform(3, 3) = reshape([ &
                                                          9.1232394870892942792e-2_wp, 0.24171793270710701896_wp, &
                                                          0.96604818261509293619_wp, -0.14125529502095420843_wp, &
                                                          0.20412935229379993199_wp, 1.0_wp, &
                                                          -3.0029194105147424492e-2_wp, 0.38294211275726193779_wp, &
                                                          0.0_wp], [3, 3])
   real(wp), parameter :: radau_inverse_transform(3, 3) = reshape([ &
                                                                  4.3255798900631553510_wp, -4.1787185915519047273_wp, &
                                                                  -0.50287263494578687595_wp, 0.33919925181580986954_wp, &
                                                                  -0.32768282076106238708_wp, 2.5719269498556054292_wp, &
                                                                  0.54177053993587487119_wp, 0.47662355450055045196_wp, &
                                                                  -0.59603920482822492497_wp], [3, 3])

contains

   !> Make room for 2m components.
   subroutine make_room(self, m)
      type(radau_system_t), intent(inout) :: self
      integer, intent(in) :: m

      integer :: n

      n = 2*m
      if (allocated(self%w)) deallocate (self%jacobian, self%factor, self%complex_factor, self%pivot, self%complex_pivot, self%w, &
                                         self%f, self%real_side, self%complex_side)
      allocate (self%jacobian(n, n), self%factor(m, m), self%complex_factor(m, m), self%pivot(m), self%complex_pivot(m))
      allocate (self%w(n, 3), self%f(n, 3), self%real_side(m), self%complex_side(m))
      self%m = m
   end subroutine make_room

   !> From slopes f and transformed increments w to the correction of w, in f.
   subroutine newton_correction(self, h)
      type(radau_system_t), intent(inout) :: self
      real(wp), intent(in) :: h

      complex(wp) :: eigenvalue, p, q, v
      real(wp) :: g(3), real_eigenvalue
      integer :: i, info, j, m

      m = self%m
      real_eigenvalue = lambda/h
      eigenvalue = cmplx(lambda_re, lambda_im, wp)/h
      do i = 1, 2*m
         g = matmul(radau_inverse_transform, self%f(i, :))
         self%f(i, 1) = g(1) - real_eigenvalue*self%w(i, 1)
         q = cmplx(g(2), g(3), wp) - eigenvalue*cmplx(self%w(i, 2), self%w(i, 3), wp)
         self%f(i, 2) = real(q, wp)
         self%f(i, 3) = aimag(q)
      end do
      call solve_real(self, real_eigenvalue, self%f(:, 1))
      do i = 1, m
         self%complex_side(i) = cmplx(self%f(m + i, 2), self%f(m + i, 3), wp) &
                                + eigenvalue*cmplx(self%f(i, 2), self%f(i, 3), wp)
      end do
      do j = 1, m
         p = cmplx(self%f(j, 2), self%f(j, 3), wp)
         do i = 1, m
            self%complex_side(i) = self%complex_side(i) - self%jacobian(m + i, m + j)*p
         end do
      end do
      call zgetrs("N", m, 1, self%complex_factor, m, self%complex_pivot, self%complex_side, m, info)
      do i = 1, m
         v = eigenvalue*self%complex_side(i) - cmplx(self%f(i, 2), self%f(i, 3), wp)
         self%f(i, 2) = real(self%complex_side(i), wp)
         self%f(i, 3) = aimag(self%complex_side(i))
         self%f(m + i, 2) = real(v, wp)
         self%f(m + i, 3) = aimag(v)
      end do
   end subroutine newton_correction

   !> (eigenvalue - J)^-1 x in place of x (n).
   subroutine solve_real(self, eigenvalue, x)
      type(radau_system_t), intent(inout) :: self
      real(wp), intent(in) :: eigenvalue
      real(wp), intent(inout) :: x(:)

      integer :: i, info, j, m

      m = self%m
      do i = 1, m
         self%real_side(i) = x(m + i) + eigenvalue*x(i)
      end do
      do j = 1, m
         do i = 1, m
            self%real_side(i) = self%real_side(i) - self%jacobian(m + i, m + j)*x(j)
         end do
      end do
      call dgetrs("N", m, 1, self%factor, m, self%pivot, self%real_side, m, info)
      do i = 1, m
         x(m + i) = eigenvalue*self%real_side(i) - x(i)
         x(i) = self%real_side(i)
      end do
   end subroutine solve_real

   !> Jacobian matrix and factors, if those at hand are not of this step.
   subroutine factorise(self, field, tau, z, h, failed)
      type(radau_system_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), h
      logical, intent(out) :: failed

      complex(wp) :: eigenvalue
      integer :: i, info, j, m

      failed = .false.
      if (.not. self%has_jacobian) then
         call form_jacobian(field, tau, z, self%jacobian)
         self%has_jacobian = .true.
         self%is_fresh = .true.
         self%h_factored = 0.0_wp
         failed = .not. all(ieee_is_finite(self%jacobian))
         if (failed) return
      end if
      if (.not. abs(h - self%h_factored) > 0.0_wp) return
      m = self%m
      eigenvalue = cmplx(lambda_re, lambda_im, wp)/h
      do j = 1, m
         do i = 1, m
            self%factor(i, j) = -self%jacobian(m + i, j) - (lambda/h)*self%jacobian(m + i, m + j)
            self%complex_factor(i, j) = -self%jacobian(m + i, j) - eigenvalue*self%jacobian(m + i, m + j)
         end do
         self%factor(j, j) = self%factor(j, j) + (lambda/h)**2
         self%complex_factor(j, j) = self%complex_factor(j, j) + eigenvalue**2
      end do
      self%factorisations = self%factorisations + 1
      self%h_factored = h
      call dgetrf(m, m, self%factor, m, self%pivot, info)
      failed = info /= 0
      call zgetrf(m, m, self%complex_factor, m, self%complex_pivot, info)
      failed = failed .or. info /= 0
      if (failed) self%h_factored = 0.0_wp
   end subroutine factorise

   !> out_i = Σ_j matrix_ij x_j for the three columns of x.
   pure subroutine transform(matrix, x, out)
      real(wp), intent(in) :: matrix(3, 3), x(:, :)
      real(wp), intent(out) :: out(:, :)

      integer :: i, j

      do j = 1, 3
         do i = 1, size(x, 1)
            out(i, j) = matrix(j, 1)*x(i, 1) + matrix(j, 2)*x(i, 2) + matrix(j, 3)*x(i, 3)
         end do
      end do
   end subroutine transform

end module razy_runge_kutta_methods_radau5_system
