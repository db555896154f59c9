!! Radau IIA of order 5 with three stages: one step, by a simplified Newton iteration.
!!
!! The collocation polynomial through c = ((4-√6)/10, (4+√6)/10, 1); the increments Z_i of the stages solve Z = h (A ⊗ I) f(z
!! + Z). A^-1 has one real eigenvalue and a conjugate pair, so that with T^-1 A^-1 T = Λ an iteration solves one real and one
!! complex system with the matrices λ/h - J. Error estimate, starting values and
!! iteration control are those of E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), IV.8.
!!
!! Why this one: L-stable, so that a stiff contact is damped out instead of ringing at the step's frequency; stiffly accurate, so
!! that the end of a step satisfies the stiff equation as well as the stages do; and of the highest order with both at
!! one real and one complex factorisation.
!!
!! With z = (y, y') the matrix λ - J is reduced by hand: (K + λ(B + λ)) y = q + (B + λ) p, v = λ y - p for the right-hand
!! side (p, q), where K and B are the tangents of the forces. That is an eighth of the work on the whole matrix, and less where K
!! and B, in a suitable order, are narrow bands, as in a chain.
module razy_runge_kutta_methods_radau5
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_system, only: system_t
   use razy_linalg_band_matrix, only: band_lu_t, band_t, complex_band_lu_t, dense_band, find_band
   use razy_linalg_dense, only: identity
   use razy_linalg_pattern, only: without_rounding
   use razy_runge_kutta_right_hand_side, only: right_hand_side_t, treat_by_events
   implicit none(type, external)
   private

   public :: lambda, lambda_im, lambda_re, radau5_t, radau_inverse_transform, radau_node, radau_transform, &
             radau_weight

   real(wp), parameter :: cube_root_81 = 4.32674871092222514696492_wp, cube_root_9 = 2.08008382305190411453006_wp
   !> Eigenvalues of A^-1: `lambda`, and `lambda_re` ± i `lambda_im`.
   real(wp), parameter :: lambda = 30/(6 + cube_root_81 - cube_root_9)
   real(wp), parameter :: inverse_re = (12 - cube_root_81 + cube_root_9)/60, &
                          inverse_im = (cube_root_81 + cube_root_9)*sqrt(3.0_wp)/60
   real(wp), parameter :: lambda_re = inverse_re/(inverse_re**2 + inverse_im**2), &
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

   !> Workspace and memory of the method for n = 2m components.
   type :: radau5_t
      integer, private :: m = 0
      integer(i8) :: factorisations = 0
      !> Whether there is a Jacobian matrix, whether it is that of the start of the step; step of the factors at hand.
      logical :: has_jacobian = .false.
      logical, private :: is_fresh = .false.
      real(wp), private :: h_factored = 0.0_wp
      !> df/dz (n, n); of it K and B, and the unit matrix, with rows and columns in this order (m); factors.
      real(wp), allocatable, private :: jacobian(:, :)
      integer, allocatable, private :: order(:)
      type(band_t), private :: stiffness, damping, mass
      type(band_lu_t), private :: factor
      type(complex_band_lu_t), private :: complex_factor
      !> Transformed increments of the stages; slopes, then corrections (n, 3).
      real(wp), allocatable, private :: w(:, :), f(:, :)
      real(wp), allocatable, private :: part(:), real_side(:)
      complex(wp), allocatable, private :: complex_side(:, :)
      !> Tolerances of the estimate, which is of lower order than the result.
      real(wp), private :: relative = 0.0_wp, absolute = 0.0_wp
      !> Newton iterations of the last attempt, and their rate of convergence; memory of the iteration's contraction.
      integer, private :: iterations = 0
      real(wp), private :: contraction = 0.0_wp, faded = 1.0_wp
      !> Factor by which the step should shrink after a failure.
      real(wp) :: shrink = 0.5_wp
      !> Step of the collocation polynomial at hand (0: there is none).
      real(wp), private :: h_polynomial = 0.0_wp
      !> Increments of the stages; divided differences of the polynomial (n, 3).
      real(wp), allocatable :: z(:, :)
      real(wp), allocatable, private :: difference(:, :)
      !> Error estimate, its first part, and a stage (n).
      real(wp), allocatable, private :: error(:), raw(:), stage(:)
   contains
      procedure :: prepare
      procedure :: restart
      procedure :: solve_stages
      procedure :: estimate_error
      procedure :: keep_polynomial
      procedure :: refuse
      procedure :: dense_coefficients
      procedure :: safety
   end type radau5_t

   real(wp), parameter :: root = sqrt(6.0_wp)
   real(wp), parameter :: radau_node(3) = [(4 - root)/10, (4 + root)/10, 1.0_wp]
   !> A of the method: stage i is z + h Σ_j a_ij f_j.
   real(wp), parameter :: radau_weight(3, 3) = reshape([(88 - 7*root)/360, (296 + 169*root)/1800, (16 - root)/36, &
                                                        (296 - 169*root)/1800, (88 + 7*root)/360, (16 + root)/36, &
                                                        (-2 + 3*root)/225, (-2 - 3*root)/225, 1.0_wp/9], [3, 3])
   !> -h p'(0) of the collocation polynomial in terms of the Z.
   real(wp), parameter :: slope_at_start(3) = [-(13 + 7*root)/3, (-13 + 7*root)/3, -1.0_wp/3]

   integer, parameter :: most_iterations = 7
   !> Rate of convergence below which the Jacobian matrix is kept, and above which the iteration is given up.
   real(wp), parameter :: good_contraction = 1.0e-3_wp, bad_contraction = 0.99_wp

contains

   !> From slopes f and transformed increments w to the correction of w, in f.
   subroutine newton_correction(self, h)
      type(radau5_t), intent(inout) :: self
      real(wp), intent(in) :: h

      complex(wp) :: eigenvalue, q
      real(wp) :: g(3), real_eigenvalue
      integer :: i, k, m

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
      do k = 1, 2
         do i = 1, m
            self%part(i) = self%f(self%order(i), k + 1)
            self%real_side(i) = self%f(m + self%order(i), k + 1)
         end do
         call self%damping%add_times(self%part, self%real_side)
         if (k == 1) self%complex_side(:, 1) = self%real_side
      end do
      do i = 1, m
         q = cmplx(real(self%complex_side(i, 1), wp), self%real_side(i), wp)
         self%complex_side(i, 1) = q + eigenvalue*cmplx(self%f(self%order(i), 2), self%part(i), wp)
      end do
      call self%complex_factor%solve(self%complex_side)
      do i = 1, m
         k = self%order(i)
         q = eigenvalue*self%complex_side(i, 1) - cmplx(self%f(k, 2), self%f(k, 3), wp)
         self%f(m + k, 2) = real(q, wp)
         self%f(m + k, 3) = aimag(q)
         self%f(k, 2) = real(self%complex_side(i, 1), wp)
         self%f(k, 3) = aimag(self%complex_side(i, 1))
      end do
   end subroutine newton_correction

   !> (eigenvalue - J)^-1 x in place of x (n).
   subroutine solve_real(self, eigenvalue, x)
      type(radau5_t), intent(inout) :: self
      real(wp), intent(in) :: eigenvalue
      real(wp), intent(inout) :: x(:)

      integer :: i, m

      m = self%m
      do i = 1, m
         self%part(i) = x(self%order(i))
         self%real_side(i) = x(m + self%order(i)) + eigenvalue*self%part(i)
      end do
      call self%damping%add_times(self%part, self%real_side)
      call self%factor%solve(self%real_side)
      do i = 1, m
         x(m + self%order(i)) = eigenvalue*self%real_side(i) - self%part(i)
         x(self%order(i)) = self%real_side(i)
      end do
   end subroutine solve_real

   !> Jacobian matrix and factors, if those at hand are not of this step.
   subroutine factorise(self, rhs, system, z, h, failed)
      type(radau5_t), intent(inout) :: self
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:), h
      logical, intent(out) :: failed

      real(wp), allocatable :: damping(:, :), stiffness(:, :)
      integer :: info, width

      failed = .false.
      associate (m => self%m, jacobian => self%jacobian)
         if (.not. self%has_jacobian) then
            call rhs%jacobian(system, 0.0_wp, z, jacobian)
            self%has_jacobian = .true.
            self%is_fresh = .true.
            self%h_factored = 0.0_wp
            failed = .not. all(ieee_is_finite(jacobian))
            if (failed) return
            stiffness = without_rounding(-jacobian(m + 1:, :m))
            damping = without_rounding(-jacobian(m + 1:, m + 1:))
            call find_band(stiffness, damping, identity(m), self%order, width)
            self%stiffness = dense_band(stiffness, self%order, width)
            self%damping = dense_band(damping, self%order, width)
            self%mass = dense_band(identity(m), self%order, width)
         end if
      end associate
      if (.not. abs(h - self%h_factored) > 0.0_wp) return
      self%factorisations = self%factorisations + 1
      self%h_factored = h
      call self%factor%factor(self%stiffness, self%damping, self%mass, lambda/h, info)
      failed = info /= 0
      call self%complex_factor%factor(self%stiffness, self%damping, self%mass, cmplx(lambda_re, lambda_im, wp)/h, info)
      failed = failed .or. info /= 0
      if (failed) self%h_factored = 0.0_wp
   end subroutine factorise

   !> out_i = Σ_j matrix_ij x_j for the three columns of x.
   pure subroutine transform(matrix, x, out)
      real(wp), intent(in) :: matrix(3, 3), x(:, :)
      real(wp), intent(out) :: out(:, :)

      integer :: j

      do j = 1, 3
         out(:, j) = matrix(j, 1)*x(:, 1) + matrix(j, 2)*x(:, 2) + matrix(j, 3)*x(:, 3)
      end do
   end subroutine transform

   !> Make room for n = 2m components and take the tolerances.
   !>
   !> The estimate is of order 4 in h and the error after many steps of order 5, so a tolerance `relative`^(4/5) of the
   !> estimate makes the error proportional to `relative`.
   subroutine prepare(self, n, relative, absolute)
      class(radau5_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: relative, absolute

      integer :: m

      m = n/2
      self%relative = relative**0.8_wp
      self%absolute = absolute*(self%relative/relative)
      self%factorisations = 0
      self%m = m
      if (allocated(self%z)) deallocate (self%z, self%difference, self%w, self%f, self%error, self%raw, self%stage, self%jacobian, &
                                         self%part, self%real_side, self%complex_side)
      allocate (self%z(n, 3), self%difference(n, 3), self%w(n, 3), self%f(n, 3), self%error(n), self%raw(n), self%stage(n))
      allocate (self%jacobian(n, n), self%part(m), self%real_side(m), self%complex_side(m, 1))
      call self%restart()
   end subroutine prepare

   !> Forget what is known from the steps before.
   pure subroutine restart(self)
      class(radau5_t), intent(inout) :: self

      self%has_jacobian = .false.
      self%is_fresh = .false.
      self%h_polynomial = 0.0_wp
      self%faded = 1.0_wp
   end subroutine restart

   !> The increments Z of the stages of a step h from z. `failed`: they were not found; `shrink` h and try again.
   subroutine solve_stages(self, rhs, system, z, h, failed)
      class(radau5_t), intent(inout) :: self
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:), h
      logical, intent(out) :: failed

      real(wp) :: change, largest, last_change, ratio, last_ratio, target
      integer :: i, j, n

      n = 2*self%m
      self%shrink = 0.5_wp
      call factorise(self, rhs, system, z, h, failed)
      if (failed) return
      call start_values(self, h)
      target = max(10*epsilon(1.0_wp)/self%relative, min(0.03_wp, sqrt(self%relative)))
      self%faded = max(self%faded, epsilon(1.0_wp))**0.8_wp
      self%contraction = good_contraction
      last_change = 0.0_wp
      last_ratio = 1.0_wp
      failed = .true.
      do i = 1, most_iterations
         self%iterations = i
         do j = 1, 3
            self%stage = z + self%z(:, j)
            call rhs%derivative(system, radau_node(j)*h, self%stage, self%f(:, j))
         end do
         call newton_correction(self, h)
         if (.not. all(ieee_is_finite(self%f))) return
         change = 0.0_wp
         do j = 1, n
            largest = max(abs(self%f(j, 1)), abs(self%f(j, 2)), abs(self%f(j, 3)))
            change = max(change, largest/(self%absolute + self%relative*abs(z(j))))
         end do
         if (i > 1) then
            ratio = change/last_change
            self%contraction = merge(ratio, sqrt(ratio*last_ratio), i == 2)
            last_ratio = ratio
            if (self%contraction >= bad_contraction) return
            self%faded = self%contraction/(1.0_wp - self%contraction)
            ratio = self%faded*change*self%contraction**(most_iterations - 1 - i)/target
            if (ratio >= 1.0_wp) then
               self%shrink = 0.8_wp*min(max(ratio, 1.0e-4_wp), 20.0_wp)**(-1.0_wp/(3 + most_iterations - i))
               return
            end if
         end if
         last_change = max(change, epsilon(1.0_wp))
         self%w = self%w + self%f
         call transform(radau_transform, self%w, self%z)
         if (self%faded*change <= target) then
            failed = .false.
            return
         end if
      end do
   end subroutine solve_stages

   !> Increments to start from: the last polynomial extrapolated, or zero.
   pure subroutine start_values(self, h)
      type(radau5_t), intent(inout) :: self
      real(wp), intent(in) :: h

      real(wp) :: s
      integer :: j

      self%z = 0.0_wp
      self%w = 0.0_wp
      if (.not. self%h_polynomial > 0.0_wp) return
      do j = 1, 3
         s = radau_node(j)*h/self%h_polynomial
         self%z(:, j) = s*(self%difference(:, 1) + (s - (radau_node(2) - 1)) &
                           *(self%difference(:, 2) + (s - (radau_node(1) - 1))*self%difference(:, 3)))
      end do
      call transform(radau_inverse_transform, self%z, self%w)
   end subroutine start_values

   !> Error estimate (λ/h - J)^-1 (f_0 - p'(0)) and its largest component in units of the tolerance. With `again` the estimate
   !> is filtered a second time where it is above 1 (first and rejected steps, but not first ones with events), which forgives a
   !> stiff transient.
   subroutine estimate_error(self, rhs, system, z, dz, h, again, scaled)
      class(radau5_t), intent(inout) :: self
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:), dz(:), h
      logical, intent(in) :: again
      real(wp), intent(out) :: scaled

      self%raw = (slope_at_start(1)*self%z(:, 1) + slope_at_start(2)*self%z(:, 2) + slope_at_start(3)*self%z(:, 3))/h
      self%error = self%raw + dz
      call solve_real(self, lambda/h, self%error)
      scaled = scaled_error(self, z)
      if (.not. ieee_is_finite(scaled)) return
      ! Where branches are followed by events every start is smooth, and what looks like a stiff transient there is motion.
      if (rhs%treatment == treat_by_events .and. .not. self%h_polynomial > 0.0_wp) return
      if (scaled <= 1.0_wp .or. .not. again) return
      self%stage = z + self%error
      call rhs%derivative(system, 0.0_wp, self%stage, self%error)
      self%error = self%error + self%raw
      call solve_real(self, lambda/h, self%error)
      scaled = scaled_error(self, z)
   end subroutine estimate_error

   pure function scaled_error(self, z) result(scaled)
      type(radau5_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp) :: scaled

      real(wp) :: part
      integer :: i

      scaled = 0.0_wp
      do i = 1, 2*self%m
         part = abs(self%error(i))/(self%absolute + self%relative*max(abs(z(i)), abs(z(i) + self%z(i, 3))))
         if (.not. ieee_is_finite(part)) then
            scaled = part
            return
         end if
         scaled = max(scaled, part)
      end do
   end function scaled_error

   !> After an accepted step h: keep its polynomial, and its Jacobian matrix if the iteration converged well with it.
   pure subroutine keep_polynomial(self, h)
      class(radau5_t), intent(inout) :: self
      real(wp), intent(in) :: h

      real(wp) :: chord, second
      integer :: i

      do i = 1, 2*self%m
         self%difference(i, 1) = (self%z(i, 2) - self%z(i, 3))/(radau_node(2) - 1)
         chord = (self%z(i, 1) - self%z(i, 2))/(radau_node(1) - radau_node(2))
         second = (chord - self%z(i, 1)/radau_node(1))/radau_node(2)
         self%difference(i, 2) = (chord - self%difference(i, 1))/(radau_node(1) - 1)
         self%difference(i, 3) = self%difference(i, 2) - second
      end do
      self%h_polynomial = h
      self%has_jacobian = self%contraction <= good_contraction
      self%is_fresh = .false.
   end subroutine keep_polynomial

   !> After an attempt that was not accepted: the next one takes the Jacobian matrix at its start.
   pure subroutine refuse(self)
      class(radau5_t), intent(inout) :: self

      self%has_jacobian = self%is_fresh
   end subroutine refuse

   !> Coefficients r_1…r_4 (n, 4) of the dense output (razy_runge_kutta_methods_tableaux): the collocation polynomial p of
   !> degree 3, corrected to degree 4 by the error estimate.
   !>
   !> p + D Q(θ), Q' = (1 - θ)(θ - c_1)(θ - c_2)/(c_1 c_2), passes through both ends (Q(1) = 0, for Q' is orthogonal to 1)
   !> and has the slopes of p at the nodes, and with D = h f_0 - p'(0) that of the motion at the start: its error is of order
   !> 5 in h, where that of p is of order 4. D is λ times the estimate, which is filtered, so that it stays
   !> bounded in stiff components.
   pure subroutine dense_coefficients(self, r)
      class(radau5_t), intent(in) :: self
      real(wp), intent(inout) :: r(:, :)

      real(wp) :: at_end, at_start, correction
      integer :: i

      do i = 1, 2*self%m
         correction = lambda*self%error(i)
         at_start = correction - (slope_at_start(1)*self%z(i, 1) + slope_at_start(2)*self%z(i, 2) + slope_at_start(3)*self%z(i, 3))
         at_end = self%difference(i, 1) - (radau_node(2) - 1)*(self%difference(i, 2) - (radau_node(1) - 1)*self%difference(i, 3))
         r(i, 1) = self%z(i, 3)
         r(i, 2) = at_start - r(i, 1)
         r(i, 3) = r(i, 1) - at_end - r(i, 2)
         r(i, 4) = -correction/(4*radau_node(1)*radau_node(2))
      end do
   end subroutine dense_coefficients

   !> Safety factor of step control after so much of Newton's work.
   pure function safety(self, usual) result(value)
      class(radau5_t), intent(in) :: self
      real(wp), intent(in) :: usual
      real(wp) :: value

      value = min(usual, usual*(1 + 2*most_iterations)/(self%iterations + 2*most_iterations))
   end function safety

end module razy_runge_kutta_methods_radau5
