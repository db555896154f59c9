!! A drift is a displacement that a machine does not feel, so that the same motion goes on elsewhere.
!!
!! A displacement x shifts every motion of a machine if K x = 0 and w_jᵀ x = 0 for every contact whose law knows its variable s.
!! Dampers and friction feel velocities alone. A motion is periodic but for a drift if q(t + T) = q(t) + x, q'(t + T) = q'(t).
module razy_machine_drift
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: make_orthonormal
   use razy_machine_free_motions, only: keep_unstretched, open_motions
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: drift_basis

contains

   !> D (n, r) that spans the drifts, DᵀM D = I; none where there is no such displacement, or LAPACK fails.
   function drift_basis(machine) result(basis)
      type(machine_t), intent(in) :: machine
      real(wp), allocatable :: basis(:, :)

      real(wp), allocatable :: undamped(:, :)
      integer :: j

      call open_motions(machine, basis, undamped)
      call keep_unstretched(basis, machine, [(.not. machine%contact(j)%law%of_normal, j=1, size(machine%contact))])
      call make_orthonormal(basis, machine%mass)
   end function drift_basis

end module razy_machine_drift
