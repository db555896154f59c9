!! The Jacobian matrix of a machine's right-hand side, for methods that solve equations.
module razy_runge_kutta_jacobian
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_hybrid_mode, only: constrained, idle
   implicit none(type, external)
   private

   public :: form_jacobian

contains

   !> df/dz (2m, 2m) at (tau, z).
   subroutine form_jacobian(self, tau, z, matrix)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: matrix(:, :)

      real(wp) :: a(self%m)
      integer :: i, m

      m = self%m
      self%jacobians = self%jacobians + 1
      call self%accelerate(tau, z, a)
      matrix = 0.0_wp
      do i = 1, m
         matrix(i, m + i) = 1.0_wp
      end do
      matrix(m + 1:, :m) = -self%coupled%stiffness
      matrix(m + 1:, m + 1:) = -self%coupled%damping
      do i = 1, self%acts
         call add_slopes(self, self%acting(i), matrix)
      end do
      if (self%constraints%count > 0) call constrain(self, matrix)
   end subroutine form_jacobian

   !> Add the slopes of contact j, whose forces `accelerate` has left, to the matrix df/dz.
   subroutine add_slopes(self, j, matrix)
      class(field_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: damping, per_normal, stiffness
      integer :: i, m

      m = self%m
      associate (contact => self%machine%contact(j))
         call self%slopes_of(j, stiffness, damping)
         do i = 1, m
            matrix(m + 1:, i) = matrix(m + 1:, i) - stiffness*self%w(:, j)*self%w(i, j)
            matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - damping*self%w(:, j)*self%w(i, j)
         end do
         if (.not. contact%law%of_normal .or. contact%normal_of == 0 .or. .not. abs(self%normal(j)) > 0.0_wp) return
         associate (by => contact%normal_of)
            if (self%does(by) == constrained .or. self%does(by) == idle) return
            per_normal = self%force(j)/self%normal(j)*sign(1.0_wp, self%force(by))
            call self%slopes_of(by, stiffness, damping)
            do i = 1, m
               matrix(m + 1:, i) = matrix(m + 1:, i) - per_normal*stiffness*self%w(:, j)*self%w(i, by)
               matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - per_normal*damping*self%w(:, j)*self%w(i, by)
            end do
         end associate
      end associate
   end subroutine add_slopes

   !> Take out of the rows y'' of df/dz what the constraint forces, with the friction that they press, let not happen.
   subroutine constrain(self, matrix)
      class(field_t), intent(in) :: self
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: force(self%constraints%count), phi(self%constraints%couplings)
      integer :: i, j, k
      logical :: found

      associate (constraints => self%constraints, m => self%m)
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = self%machine%contact(j)%law%force(self%branch(j), self%s(j), self%rate(j), 1.0_wp)
         end do
         do k = 1, 2*m
            call constraints%solve(matmul(matrix(m + 1:, k), self%w(:, constraints%contact)), phi, force, found)
            if (.not. found) return
            matrix(m + 1:, k) = matrix(m + 1:, k) - matmul(self%w(:, constraints%contact), force)
            do i = 1, constraints%couplings
               matrix(m + 1:, k) = matrix(m + 1:, k) &
                                   - self%w(:, constraints%sliding(i))*(phi(i)*constraints%sign(i)*force(constraints%row(i)))
            end do
         end do
      end associate
   end subroutine constrain

end module razy_runge_kutta_jacobian
