!! Reduction of rotor models: modal synthesis of shafts, Craig-Bampton, static correction, two levels (THEORY 7).
!!
!! - Modal synthesis: undamped modes of each shaft alone, without bearings and meshes, the lowest kept (4.36), (4.47)-(4.49).
!! - Craig-Bampton (Craig and Bampton, AIAA J. 6 (1968)): static shapes of unit displacements of nodes with bearings or gears, and
!!   modes of each shaft with these nodes held.
!! - Static correction: for each mesh and shaft the part of K⁻¹ w outside the basis, so that the static compliance of the
!!   mesh is exact. Where rigid motion is free, K - shift M takes the place of K, with the shift of `reference_shift`.
!! - Second level: modes of the reduced model on its bearings with meshes open (A, (4.67)) or closed (B, (4.74)); those kept
!!   are the first in the order of |d|, d = wᵀ t, of d itself (which depends on the sign of the shapes, here with their
!!   largest component positive), or of the frequency.
module razy_rotor_synthesis
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_dense, only: product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, keep_first, lowest_modes, modes_found
   use razy_linalg_sparse, only: add_matrices, csr_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_modes, only: reference_shift
   use razy_rotor_reduced, only: new_reduced, reduced_t, transformed
   implicit none(type, external)
   private

   public :: add_static_correction, craig_bampton, full_basis, modal_synthesis, second_level, select_modes
   public :: sort_absolute, sort_signed, sort_frequency

   !> Orders of the second level: |d| falling, d falling, frequency rising.
   integer, parameter :: sort_absolute = 1, sort_signed = 2, sort_frequency = 3
   !> Shafts of at most this size go to LAPACK.
   integer, parameter :: most_dense = 300
   !> A correction whose part outside the basis is smaller than this share of it is left out.
   real(wp), parameter :: least_part = 1.0e-8_wp
   !> Values of d below this share of the largest are zero but for rounding; such modes go by frequency.
   real(wp), parameter :: least_d = 1.0e-9_wp

contains

   !> The `count(s)` lowest modes of each shaft s, but none above `limit`, rad/s, if that is positive.
   subroutine modal_synthesis(reduced, model, count, limit, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count(:)
      real(wp), intent(in) :: limit
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: basis(:, :)
      integer, allocatable :: own(:)
      integer :: i, kept, s

      allocate (basis(model%mass%rows, 0))
      do s = 1, size(count)
         own = [(i, i=model%numbering%first(s), model%numbering%first(s + 1) - 1)]
         if (count(s) < 1 .or. count(s) > size(own)) then
            call raise(error, to_text(count(s))//" modes of shaft "//to_text(s)//": 1 to its "//to_text(size(own))//" coordinates")
            return
         end if
         pairs = modes_of(model, model%shaft_stiffness%extract(own), model%mass%extract(own), count(s))
         if (pairs%status /= modes_found) then
            call raise(error, "modes of shaft "//to_text(s)//" were not found")
            return
         end if
         kept = size(pairs%value)
         if (limit > 0.0_wp) then
            do while (kept > 0)
               if (pairs%value(kept) <= limit**2) exit
               kept = kept - 1
            end do
         end if
         call append(basis, own, pairs%vector(:, :kept))
      end do
      if (size(basis, 2) == 0) then
         call raise(error, "no mode is below the limit of frequency")
         return
      end if
      reduced = new_reduced(model, basis)
   end subroutine modal_synthesis

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

   !> The Craig-Bampton model: all coordinates of nodes with bearings or gears, and `count` modes of each shaft with these held.
   subroutine craig_bampton(reduced, model, count, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count
      type(error_t), allocatable, intent(out) :: error

      type(band_factor_t) :: factor
      type(eigenpairs_t) :: pairs
      type(csr_t) :: inner_stiffness
      logical, allocatable :: held(:)
      real(wp), allocatable :: basis(:, :), column(:), shape(:, :)
      integer, allocatable :: inner(:), rim(:)
      integer :: i, info, j, n, s

      n = model%mass%rows
      held = interface_coordinates(model)
      allocate (basis(n, 0), column(n))
      do s = 1, size(model%rotor%shaft)
         associate (first => model%numbering%first(s), last => model%numbering%first(s + 1) - 1)
            inner = pack([(i, i=first, last)],.not. held(first:last))
            rim = pack([(i, i=first, last)], held(first:last))
         end associate
         if (count < 0 .or. count > size(inner)) then
            call raise(error, to_text(count)//" modes of shaft "//to_text(s)//": 0 to its "//to_text(size(inner))// &
                       " coordinates between bearings and gears")
            return
         end if
         inner_stiffness = model%shaft_stiffness%extract(inner)
         call factor%factor(inner_stiffness, info)
         if (info /= 0) then
            call raise(error, "shaft "//to_text(s)//" moves freely with its bearings and gears held")
            return
         end if
         do j = 1, size(rim)
            column = 0.0_wp
            column(rim(j)) = 1.0_wp
            column = model%shaft_stiffness%times(column)
            allocate (shape(n, 1), source=0.0_wp)
            shape(rim(j), 1) = 1.0_wp
            shape(inner, 1) = -factor%solve(column(inner))
            call append(basis, [(i, i=1, n)], shape)
            deallocate (shape)
         end do
         if (count == 0) cycle
         pairs = modes_of(model, inner_stiffness, model%mass%extract(inner), count)
         if (pairs%status /= modes_found) then
            call raise(error, "modes of shaft "//to_text(s)//" were not found")
            return
         end if
         call append(basis, inner, pairs%vector)
      end do
      reduced = new_reduced(model, basis)
   end subroutine craig_bampton

   !> Which coordinates (n) belong to nodes with bearings or gears.
   pure function interface_coordinates(model) result(held)
      type(rotor_model_t), intent(in) :: model
      logical, allocatable :: held(:)

      integer :: at(6), gear, i, k

      allocate (held(0:model%mass%rows), source=.false.)
      do i = 1, size(model%rotor%bearing)
         at = model%numbering%of(model%rotor%bearing(i)%shaft, model%rotor%bearing(i)%node)
         do k = 1, 6
            held(at(k)) = .true.
         end do
      end do
      do i = 1, size(model%rotor%mesh)
         do gear = 1, 2
            at = model%numbering%of(model%rotor%mesh(i)%shaft(gear), model%rotor%mesh(i)%node(gear))
            do k = 1, 6
               held(at(k)) = .true.
            end do
         end do
      end do
      held = held(1:)
   end function interface_coordinates

   !> The unreduced model as a reduced one with all coordinates, which are its undamped modes without meshes.
   subroutine full_basis(reduced, model, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs

      pairs = dense_modes(model%stiffness%dense(), model%mass%dense())
      if (pairs%status /= modes_found) then
         call raise(error, "the modes of the unreduced model were not found")
         return
      end if
      reduced = new_reduced(model, pairs%vector)
   end subroutine full_basis

   !> Add the static shapes of mesh forces to the basis of a reduced model, one for each gear.
   subroutine add_static_correction(reduced, model, error)
      type(reduced_t), intent(inout) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(error_t), allocatable, intent(out) :: error

      type(band_factor_t) :: factor
      real(wp), allocatable :: basis(:, :), shape(:, :)
      real(wp) :: size_all, size_part
      integer :: i, info, j, s

      call factor%factor(model%stiffness, info)
      if (info /= 0) call factor%factor(add_matrices(1.0_wp, model%stiffness, reference_shift(model), model%mass), info)
      if (info /= 0) then
         call raise(error, "the static correction was not found: the stiffness is not positive semidefinite")
         return
      end if
      basis = reduced%basis
      do j = 1, size(model%mesh_direction, 2)
         do s = 1, size(model%rotor%shaft)
            allocate (shape(model%mass%rows, 1), source=0.0_wp)
            associate (first => model%numbering%first(s), last => model%numbering%first(s + 1) - 1)
               shape(first:last, 1) = model%mesh_direction(first:last, j)
            end associate
            if (any(abs(shape) > 0.0_wp)) then
               shape(:, 1) = factor%solve(shape(:, 1))
               size_all = norm_of(model, shape(:, 1))
               call remove_span(shape(:, 1), model, basis)
               size_part = norm_of(model, shape(:, 1))
               if (size_part > least_part*size_all) call append(basis, [(i, i=1, size(basis, 1))], shape/size_part)
            end if
            deallocate (shape)
         end do
      end do
      reduced = new_reduced(model, basis)
   end subroutine add_static_correction

   !> sqrt(xᵀ M x).
   function norm_of(model, x) result(norm)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: x(:)
      real(wp) :: norm

      norm = sqrt(dot_product(x, model%mass%times(x)))
   end function norm_of

   !> Make `x` M-orthogonal to the columns of `basis`, which need not be orthogonal to each other.
   subroutine remove_span(x, model, basis)
      real(wp), intent(inout) :: x(:)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :)

      type(eigenpairs_t) :: frame
      real(wp), allocatable :: orthonormal(:, :), momentum(:)
      integer :: j, pass

      ! Eigenvectors with respect to the projected mass make the basis orthonormal.
      frame = dense_modes(model%stiffness%congruence(basis), model%mass%congruence(basis))
      orthonormal = product_of(basis, frame%vector)
      do pass = 1, 2
         do j = 1, size(orthonormal, 2)
            momentum = model%mass%times(x)
            x = x - dot_product(orthonormal(:, j), momentum)*orthonormal(:, j)
         end do
      end do
   end subroutine remove_span

   !> The second level: of the modes of `old`, with meshes closed or open, the first `kept` in the order `sorting`.
   subroutine second_level(reduced, old, kept, meshed, sorting, error)
      type(reduced_t), intent(out) :: reduced
      type(reduced_t), intent(in) :: old
      integer, intent(in) :: kept
      logical, intent(in) :: meshed
      integer, intent(in) :: sorting
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs

      if (kept < 1 .or. kept > size(old%load)) then
         call raise(error, to_text(kept)//" modes on the second level: 1 to the "//to_text(size(old%load))//" of the first")
         return
      end if
      if (meshed) then
         pairs = dense_modes(old%closed_stiffness(), old%mass)
      else
         pairs = dense_modes(old%stiffness, old%mass)
      end if
      if (pairs%status /= modes_found) then
         call raise(error, "the modes of the reduced model were not found")
         return
      end if
      reduced = select_modes(old, pairs%vector, kept, sorting)
   end subroutine second_level

   !> The first `kept` columns of `shapes` (p, m) in the order `sorting` as a model. With several meshes d is the largest
   !> of the meshes' (in the sense of the order).
   function select_modes(old, shapes, kept, sorting) result(reduced)
      type(reduced_t), intent(in) :: old
      real(wp), intent(in) :: shapes(:, :)
      integer, intent(in) :: kept, sorting
      type(reduced_t) :: reduced

      real(wp) :: d(size(old%mesh_direction, 2)), key(size(shapes, 2))
      integer :: chosen(size(shapes, 2)), i, j, moved

      do i = 1, size(shapes, 2)
         chosen(i) = i
         d = matmul(shapes(:, i), old%mesh_direction)
         key(i) = 0.0_wp
         if (sorting == sort_absolute) key(i) = maxval(abs(d))
         if (sorting == sort_signed) key(i) = maxval(d)
         if (sorting == sort_frequency .or. size(d) == 0) key(i) = -i
      end do
      if (sorting /= sort_frequency .and. size(d) > 0) where (abs(key) < least_d*maxval(abs(key))) key = 0.0_wp
      do i = 2, size(chosen)
         moved = chosen(i)
         j = i - 1
         do while (j >= 1)
            if (key(chosen(j)) >= key(moved)) exit
            chosen(j + 1) = chosen(j)
            j = j - 1
         end do
         chosen(j + 1) = moved
      end do
      reduced = transformed(old, shapes(:, chosen(:kept)))
   end function select_modes

end module razy_rotor_synthesis
