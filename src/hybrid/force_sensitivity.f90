!! How the force that holds a constraint, measured against its bound, depends on the state.
!!
!! With M = 1 the forces λ of closed rigid contacts and of friction that sticks obey A λ = Wᵀ a + e'' (razy_hybrid_constraints),
!! a being the acceleration y'' without them, whose derivative J = da/dz has the matrices and the slopes of all other contacts. For
!! one of them, and the normal force N that bounds it by β N,
!!
!!     d(λ_j - β N)/dz = (Aᵀ⁻¹ c)ᵀ Wᵀ J - β dN/dz,
!!
!! where c is 1 at λ_j, and has -β sign λ where another constraint presses; dN/dz is left of N from a contact that is no
!! constraint. The change of sliding friction's coefficient with the speed is left out where a constraint presses it.
module razy_hybrid_force_sensitivity
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_hybrid_mode, only: constrained, idle
   implicit none(type, external)
   private

   public :: force_sensitivity

contains

   !> d(λ_j - bound N_j)/dz (2m) of the constraint contact j at the forces in the field's workspace, which `accelerate` has left;
   !> `bound` is one per normal force if the law's is, else it does not matter.
   function force_sensitivity(field, j, bound) result(row)
      type(field_t), intent(in) :: field
      integer, intent(in) :: j
      real(wp), intent(in) :: bound
      real(wp) :: row(2*field%m)

      real(wp) :: reach(field%m), weight(field%constraints%count)
      integer :: i, k

      row = 0.0_wp
      associate (constraints => field%constraints)
         weight = merge(1.0_wp, 0.0_wp, constraints%contact(:constraints%count) == j)
         associate (by => field%machine%contact(j)%normal_of)
            if (field%machine%contact(j)%law%of_normal .and. by > 0) then
               if (field%does(by) == constrained) then
                  i = findloc(constraints%contact(:constraints%count), by, 1)
                  weight(i) = weight(i) - bound*sign(1.0_wp, field%force(by))
               else if (field%does(by) /= idle) then
                  call add_slopes(field, by, bound*sign(1.0_wp, field%force(by)), row)
               end if
            end if
         end associate
         reach = matmul(field%w(:, constraints%contact(:constraints%count)), transposed_solution(field, weight))
      end associate
      row(:field%m) = row(:field%m) - matmul(reach, field%coupled%stiffness)
      row(field%m + 1:) = row(field%m + 1:) - matmul(reach, field%coupled%damping)
      do i = 1, field%acts
         k = field%acting(i)
         call add_slopes(field, k, dot_product(reach, field%w(:, k)), row)
         associate (contact => field%machine%contact(k))
            if (.not. contact%law%of_normal .or. contact%normal_of == 0 .or. .not. abs(field%normal(k)) > 0.0_wp) cycle
            associate (by => contact%normal_of)
               if (field%does(by) == constrained .or. field%does(by) == idle) cycle
               call add_slopes(field, by, dot_product(reach, field%w(:, k))*field%force(k)/field%normal(k) &
                               *sign(1.0_wp, field%force(by)), row)
            end associate
         end associate
      end do
   end function force_sensitivity

   !> Take `factor` times the derivative of the force of contact k from `row`.
   subroutine add_slopes(field, k, factor, row)
      type(field_t), intent(in) :: field
      integer, intent(in) :: k
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: row(:)

      real(wp) :: damping, stiffness

      call field%slopes_of(k, stiffness, damping)
      row(:field%m) = row(:field%m) - factor*stiffness*field%w(:, k)
      row(field%m + 1:) = row(field%m + 1:) - factor*damping*field%w(:, k)
   end subroutine add_slopes

   !> Aᵀ⁻¹ c for the constraints of the mode: c on the columns of A⁻¹. Where A is singular the motion has ended before.
   function transposed_solution(field, weight) result(solution)
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: weight(:)
      real(wp) :: solution(size(weight))

      real(wp) :: column(size(weight)), phi(field%constraints%couplings), unit(size(weight))
      integer :: i, j
      logical :: found

      associate (constraints => field%constraints)
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = field%machine%contact(j)%law%force(field%branch(j), field%s(j), field%rate(j), 1.0_wp)
         end do
         if (constraints%couplings == 0) then
            ! A is symmetric.
            call constraints%solve(weight, phi, solution, found)
            return
         end if
         do i = 1, size(weight)
            unit = 0.0_wp
            unit(i) = 1.0_wp
            call constraints%solve(unit, phi, column, found)
            solution(i) = dot_product(weight, column)
         end do
      end associate
   end function transposed_solution

end module razy_hybrid_force_sensitivity
