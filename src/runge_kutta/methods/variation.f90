!! The variational equation of a step: disturbances of the state, carried by the method that made the step.
module razy_runge_kutta_methods_variation
   use razy_core_kinds, only: wp
   use razy_hybrid_system, only: system_t
   use razy_linalg_lapack, only: dgesv
   use razy_runge_kutta_methods_radau5, only: radau_node, radau_weight
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: carry

contains

   !> Carry disturbances (n, columns) of the state through the first h, s, of the accepted step: the variational equation by the
   !> same method. Of the implicit one the stages are those of the step's dense output.
   subroutine carry(self, system, h, tangent)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: tangent(:, :)

      real(wp) :: stage(size(tangent, 1)), jacobian(size(stage), size(stage)), slope(size(stage), self%tableau%stages + 1)
      real(wp) :: moved(size(stage), size(tangent, 2)), change(size(stage), size(tangent, 2), self%tableau%stages + 1)
      integer :: i, j

      if (self%implicit) then
         call carry_implicitly(self, system, h, tangent)
         return
      end if
      do i = 1, self%tableau%stages + 1
         stage = self%z_start(:size(stage))
         moved = tangent
         associate (row => self%tableau%row(i))
            do j = 1, row%terms
               stage = stage + h*row%value(j)*slope(:, row%column(j))
               moved = moved + h*row%value(j)*change(:, :, row%column(j))
            end do
         end associate
         if (i > self%tableau%stages) exit
         call self%rhs%derivative(system, self%tableau%node(i)*h, stage, slope(:, i))
         call self%rhs%jacobian(system, self%tableau%node(i)*h, stage, jacobian)
         change(:, :, i) = matmul(jacobian, moved)
      end do
      tangent = moved
   end subroutine carry

   !> The same by the collocation of Radau IIA: K_i = J_i (V + h Σ_j a_ij K_j).
   subroutine carry_implicitly(self, system, h, tangent)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: tangent(:, :)

      real(wp) :: stage(size(tangent, 1)), jacobian(size(stage), size(stage))
      real(wp) :: matrix(3*size(stage), 3*size(stage)), side(3*size(stage), size(tangent, 2))
      integer :: i, info, j, n, pivot(3*size(stage))

      n = size(stage)
      call self%prepare_dense(system)
      do i = 1, 3
         call self%output%at(radau_node(i)*h/self%h, stage)
         call self%rhs%jacobian(system, radau_node(i)*h, stage, jacobian)
         associate (rows => [(n*(i - 1) + j, j=1, n)])
            side(rows, :) = matmul(jacobian, tangent)
            do j = 1, 3
               matrix(rows, n*(j - 1) + 1:n*j) = -h*radau_weight(i, j)*jacobian
            end do
         end associate
      end do
      do j = 1, 3*n
         matrix(j, j) = matrix(j, j) + 1.0_wp
      end do
      call dgesv(3*n, size(tangent, 2), matrix, 3*n, pivot, side, 3*n, info)
      do i = 1, 3
         tangent = tangent + h*radau_weight(3, i)*side(n*(i - 1) + 1:n*i, :)
      end do
   end subroutine carry_implicitly

end module razy_runge_kutta_methods_variation
