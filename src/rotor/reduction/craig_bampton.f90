!! Reduction after Craig and Bampton (AIAA J. 6 (1968)): static shapes of unit displacements of nodes with bearings or gears, and
!! modes of each shaft with these nodes fixed. Housings keep their coordinates.
module razy_rotor_reduction_craig_bampton
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_generalised, only: eigenpairs_t, first_modes, modes_found
   use razy_linalg_sparse, only: csr_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: append, new_reduced, reduced_t
   use razy_rotor_whirl_modes, only: reference_shift
   implicit none(type, external)
   private

   public :: craig_bampton, interface_coordinates

contains

   !> The Craig-Bampton model: all coordinates of nodes with bearings or gears, and `count` modes of each shaft with these fixed.
   subroutine craig_bampton(reduced, model, count, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count
      type(error_t), allocatable, intent(out) :: error

      type(band_factor_t) :: factor
      type(eigenpairs_t) :: pairs
      type(csr_t) :: inner_stiffness
      logical, allocatable :: fixed(:)
      real(wp), allocatable :: basis(:, :), column(:), shape(:, :)
      integer, allocatable :: inner(:), rim(:)
      integer :: i, info, j, kept, n, s

      n = model%mass%rows
      fixed = interface_coordinates(model)
      allocate (basis(n, 0), shape(n, 1))
      do s = 1, size(model%rotor%shaft)
         associate (first => model%numbering%first(s), last => model%numbering%first(s + 1) - 1)
            inner = pack([(i, i=first, last)],.not. fixed(first:last))
            rim = pack([(i, i=first, last)], fixed(first:last))
         end associate
         kept = merge(0, count, model%rotor%shaft(s)%rigid)
         if (kept < 0 .or. kept > size(inner)) then
            call raise(error, to_text(count)//" modes of shaft "//to_text(s)//": 0 to its "//to_text(size(inner))// &
                       " coordinates between bearings and gears")
            return
         end if
         inner_stiffness = model%shaft_stiffness%extract(inner)
         call factor%factor(inner_stiffness, info)
         if (info /= 0) call raise(error, "shaft "//to_text(s)//" moves freely with its bearings and gears held")
         if (allocated(error)) return
         do j = 1, size(rim)
            shape(:, 1) = 0.0_wp
            shape(rim(j), 1) = 1.0_wp
            column = model%shaft_stiffness%times(shape(:, 1))
            shape(inner, 1) = -factor%solve(column(inner))
            call append(basis, [(i, i=1, n)], shape)
         end do
         if (kept == 0) cycle
         pairs = first_modes(inner_stiffness, model%mass%extract(inner), kept, -reference_shift(model))
         if (pairs%status /= modes_found) call raise(error, "modes of shaft "//to_text(s)//" were not found")
         if (allocated(error)) return
         call append(basis, inner, pairs%vector)
      end do
      reduced = new_reduced(model, basis)
   end subroutine craig_bampton

   !> Which coordinates (n) belong to nodes with bearings or gears, or to housings.
   pure function interface_coordinates(model) result(fixed)
      type(rotor_model_t), intent(in) :: model
      logical, allocatable :: fixed(:)

      integer :: at(6), gear, i
      integer :: ends(12)

      fixed = model%rotor%shaft(model%numbering%shaft)%rigid
      do i = 1, size(model%rotor%bearing)
         ends = model%numbering%ends(model%rotor%bearing(i))
         fixed(pack(ends, ends > 0)) = .true.
      end do
      do i = 1, size(model%rotor%mesh)
         do gear = 1, 2
            at = model%numbering%of(model%rotor%mesh(i)%shaft(gear), model%rotor%mesh(i)%node(gear))
            fixed(pack(at, at > 0)) = .true.
         end do
      end do
   end function interface_coordinates

end module razy_rotor_reduction_craig_bampton
