!! Modes of matrices whose elements are not known but by their rows.
module modes_of_matrices
   use razy_core_kinds, only: wp
   use razy_exact_modal_basis, only: modal_basis_t, new_modal_basis
   use razy_linalg_null_space, only: complement_of, intersection_of, null_space
   implicit none(type, external)
   private

   public :: find_modes

contains

   subroutine find_modes(basis, k, b)
      type(modal_basis_t), intent(out) :: basis
      real(wp), intent(in) :: k(:, :), b(:, :)

      real(wp), allocatable :: both(:, :), of_damping(:, :), of_stiffness(:, :), rest(:, :)
      integer :: info

      call null_space(transpose(k), of_stiffness, info)
      call null_space(transpose(b), of_damping, info)
      call intersection_of(of_stiffness, of_damping, both, info)
      rest = matmul(of_stiffness, complement_of(matmul(transpose(of_stiffness), both)))
      call new_modal_basis(basis, k, b, reshape([both, rest], shape(of_stiffness)), size(both, 2))
   end subroutine find_modes

end module modes_of_matrices
