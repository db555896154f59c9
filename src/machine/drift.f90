!! A drift is a displacement that a machine does not feel, so that the same motion goes on elsewhere.
!!
!! A displacement x shifts every motion of a machine if K x = 0 and w_jᵀ x = 0 for every contact whose law knows its variable s.
!! Dampers and friction feel velocities alone. A motion is periodic but for a drift if q(t + T) = q(t) + x, q'(t + T) = q'(t).
module razy_machine_drift
   use razy_core_kinds, only: wp
   use razy_linalg_null_space, only: null_space, rank_bound
   use razy_machine_machine, only: contact_rows, machine_t
   implicit none(type, external)
   private

   public :: drift_basis

contains

   !> D (n, r) that spans the drifts, DᵀM D = I; none where there is no such displacement, or LAPACK fails.
   function drift_basis(machine) result(basis)
      type(machine_t), intent(in) :: machine
      real(wp), allocatable :: basis(:, :)

      real(wp), allocatable :: free(:, :), rows(:, :), stretch(:, :), within(:, :)
      integer :: info, j

      if (allocated(machine%free_of_stiffness)) then
         free = machine%free_of_stiffness
      else
         call null_space(transpose(machine%stiffness), free, info)
         if (info /= 0) free = free(:, :0)
      end if
      rows = free(:, :0)
      do j = 1, size(machine%contact)
         if (machine%contact(j)%law%of_normal) cycle
         associate (more => contact_rows(machine%contact(j:j)))
            rows = reshape([rows, more], [size(rows, 1), size(rows, 2) + size(more, 2)])
         end associate
      end do
      allocate (stretch(size(free, 2), size(rows, 2)))
      do j = 1, size(rows, 2)
         stretch(:, j) = matmul(rows(:, j), free)
         where (abs(stretch(:, j)) <= rank_bound*matmul(abs(rows(:, j)), abs(free))) stretch(:, j) = 0.0_wp
      end do
      call null_space(stretch, within, info)
      if (info /= 0) within = within(:, :0)
      basis = matmul(free, within)
      call orthonormalise(basis, machine%mass)
   end function drift_basis

   !> Make columns M-orthonormal, each against those before it.
   pure subroutine orthonormalise(basis, mass)
      real(wp), intent(inout) :: basis(:, :)
      real(wp), intent(in) :: mass(:, :)

      integer :: i, k, pass

      do i = 1, size(basis, 2)
         do pass = 1, 2
            do k = 1, i - 1
               basis(:, i) = basis(:, i) - basis(:, k)*dot_product(basis(:, k), matmul(mass, basis(:, i)))
            end do
            basis(:, i) = basis(:, i)/sqrt(dot_product(basis(:, i), matmul(mass, basis(:, i))))
         end do
      end do
   end subroutine orthonormalise

end module razy_machine_drift
