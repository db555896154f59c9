!! What the reductions of rotor models share: modes of a part of the model, and columns of a basis.
module razy_rotor_reduction_part_modes
   use razy_core_kinds, only: wp
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, keep_first, lowest_modes, modes_found
   use razy_linalg_sparse, only: csr_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_modes, only: reference_shift
   implicit none(type, external)
   private

   public :: append, modes_of

   !> Shafts of at most this size go to LAPACK.
   integer, parameter :: most_dense = 300

contains

   !> The `count` lowest modes of a part of the model.
   function modes_of(model, stiffness, mass, count) result(pairs)
      type(rotor_model_t), intent(in) :: model
      type(csr_t), intent(in) :: stiffness, mass
      integer, intent(in) :: count
      type(eigenpairs_t) :: pairs

      if (mass%rows > most_dense .and. 3*count <= mass%rows) then
         pairs = lowest_modes(stiffness, mass, count, -reference_shift(model))
         return
      end if
      pairs = dense_modes(stiffness%dense(), mass%dense())
      if (pairs%status == modes_found) call keep_first(pairs, count)
   end function modes_of

   !> Further columns of the basis: `vectors` in the rows `own`.
   subroutine append(basis, own, vectors)
      real(wp), allocatable, intent(inout) :: basis(:, :)
      integer, intent(in) :: own(:)
      real(wp), intent(in) :: vectors(:, :)

      real(wp), allocatable :: larger(:, :)
      integer :: i, p

      p = size(basis, 2)
      allocate (larger(size(basis, 1), p + size(vectors, 2)), source=0.0_wp)
      larger(:, :p) = basis
      do i = 1, size(own)
         larger(own(i), p + 1:) = vectors(i, :)
      end do
      call move_alloc(larger, basis)
   end subroutine append

end module razy_rotor_reduction_part_modes
