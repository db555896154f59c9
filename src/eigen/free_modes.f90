!! Undamped modes of a machine whose rigid motions are known by structure: their frequency is 0 exactly, and those that nothing
!! else feels either are left out, because their pairs of eigenvalues 0 would err by the square root of rounding.
module razy_eigen_free_modes
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: congruence_of, make_orthonormal, product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t
   use razy_linalg_null_space, only: null_space
   implicit none(type, external)
   private

   public :: modes_beside

contains

   !> omega² (m) and shapes (p, m), orthonormal in the metric of `mass`, of K and M (p, p) beside the motions `untouched` (p, r):
   !> first those of `of_stiffness` (p, k), which has the others in its span, with 0. `status` is that of `dense_modes`.
   subroutine modes_beside(stiffness, mass, of_stiffness, untouched, squared, basis, status)
      real(wp), intent(in) :: stiffness(:, :), mass(:, :), of_stiffness(:, :), untouched(:, :)
      real(wp), allocatable, intent(out) :: squared(:), basis(:, :)
      integer, intent(out) :: status

      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: elastic(:, :), still(:, :), within(:, :)
      integer :: info

      call null_space(matmul(transpose(of_stiffness), matmul(mass, untouched)), within, info)
      still = matmul(of_stiffness, within)
      call make_orthonormal(still, mass)
      if (info == 0) call null_space(matmul(mass, of_stiffness), elastic, info)
      status = info
      if (info /= 0) return
      pairs = dense_modes(congruence_of(stiffness, elastic), congruence_of(mass, elastic))
      status = pairs%status
      elastic = product_of(elastic, pairs%vector)
      squared = [spread(0.0_wp, 1, size(still, 2)), pairs%value]
      basis = reshape([still, elastic], [size(mass, 1), size(squared)])
   end subroutine modes_beside

end module razy_eigen_free_modes
