!! Modal synthesis of rotor models (source thesis, 4.2.2), and the static correction of any reduction.
!!
!! - Modal synthesis: undamped modes of each shaft alone, without bearings and meshes, the lowest kept (4.36), (4.47)-(4.49).
!! - Static correction: for each mesh and shaft the part of K⁻¹ w outside the basis, so that the static compliance of the
!!   mesh is exact. Where rigid motion is free, K - shift M takes the place of K, with the shift of `reference_shift`.
module razy_rotor_reduction_synthesis
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_dense, only: product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, first_modes, modes_found
   use razy_linalg_null_space, only: null_space
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: append, new_reduced, reduced_t
   use razy_rotor_shaft_motions, only: list_held, list_motions
   use razy_rotor_whirl_modes, only: reference_shift, static_factor
   implicit none(type, external)
   private

   public :: add_static_correction, modal_synthesis

   !> A correction whose part outside the basis is smaller than this share of it is left out.
   real(wp), parameter :: least_part = 1.0e-8_wp

contains

   !> The `count(s)` lowest modes of each shaft s, but none above `limit`, rad/s, if that is positive. Fewer than its rigid motions
   !> are refused: which of these are kept would be chance, and bearings would hold a shaft that cannot move in them.
   subroutine modal_synthesis(reduced, model, count, limit, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count(:)
      real(wp), intent(in) :: limit
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: moved(6*size(count), size(model%numbering%at))
      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: basis(:, :), held(:, :), rigid(:, :)
      integer, allocatable :: own(:)
      integer :: i, info, kept, s

      call list_motions(model%rotor, moved)
      call list_held(model%numbering, moved, held)
      allocate (basis(model%mass%rows, 0))
      do s = 1, size(count)
         own = [(i, i=model%numbering%first(s), model%numbering%first(s + 1) - 1)]
         call null_space(held(6*s - 5:6*s, :), rigid, info)
         if (count(s) < max(1, size(rigid, 2)) .or. count(s) > size(own)) then
            call raise(error, to_text(count(s))//" modes of shaft "//to_text(s)//": "//to_text(max(1, size(rigid, 2)))// &
                       " (1, or its rigid motions) to its "//to_text(size(own))//" coordinates")
            return
         end if
         pairs = first_modes(model%shaft_stiffness%extract(own), model%mass%extract(own), count(s), -reference_shift(model))
         if (pairs%status /= modes_found) call raise(error, "modes of shaft "//to_text(s)//" were not found")
         if (allocated(error)) return
         kept = size(pairs%value)
         if (limit > 0.0_wp) kept = size(pack(pairs%value, pairs%value <= limit**2))
         call append(basis, own, pairs%vector(:, :kept))
      end do
      if (size(basis, 2) == 0) call raise(error, "no mode is below the limit of frequency")
      if (allocated(error)) return
      reduced = new_reduced(model, basis)
   end subroutine modal_synthesis

   !> Add the static shapes of mesh forces to the basis of a reduced model, one for each gear.
   subroutine add_static_correction(reduced, model, error)
      type(reduced_t), intent(inout) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(error_t), allocatable, intent(out) :: error

      type(band_factor_t) :: factor
      real(wp), allocatable :: basis(:, :), shape(:)
      real(wp) :: shift, size_all, size_part
      integer, allocatable :: all(:)
      integer :: i, info, j, s

      call static_factor(model, factor, shift, info)
      if (info /= 0) call raise(error, "the static correction was not found: the stiffness is not positive semidefinite")
      if (allocated(error)) return
      basis = reduced%basis
      all = [(i, i=1, size(basis, 1))]
      do j = 1, size(model%mesh_direction, 2)
         do s = 1, size(model%rotor%shaft)
            shape = merge(model%mesh_direction(:, j), 0.0_wp, model%numbering%shaft == s)
            if (.not. any(abs(shape) > 0.0_wp)) cycle
            shape = factor%solve(shape)
            size_all = sqrt(dot_product(shape, model%mass%times(shape)))
            call remove_span(shape, model, basis)
            size_part = sqrt(dot_product(shape, model%mass%times(shape)))
            if (size_part > least_part*size_all) call append(basis, all, reshape(shape/size_part, [size(shape), 1]))
         end do
      end do
      reduced = new_reduced(model, basis)
   end subroutine add_static_correction

   !> Make `x` M-orthogonal to the columns of `basis`, which need not be orthogonal to each other.
   subroutine remove_span(x, model, basis)
      real(wp), intent(inout) :: x(:)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :)

      type(eigenpairs_t) :: frame
      real(wp), allocatable :: orthonormal(:, :)
      integer :: pass

      ! Eigenvectors with respect to the projected mass make the basis orthonormal.
      frame = dense_modes(model%stiffness%congruence(basis), model%mass%congruence(basis))
      orthonormal = product_of(basis, frame%vector)
      do pass = 1, 2
         x = x - matmul(orthonormal, matmul(model%mass%times(x), orthonormal))
      end do
   end subroutine remove_span

end module razy_rotor_reduction_synthesis
