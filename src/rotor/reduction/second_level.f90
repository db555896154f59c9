!! The second level of a reduction (source thesis, 4.2.2): modes of the reduced model on its bearings with meshes open (A, (4.67))
!! or closed (B, (4.74)); those kept are the first in the order of |d|, d = wᵀ t, of d itself (which depends on the sign of the
!! shapes, here with the largest displacement or rotation of a node positive), or of the frequency. Shapes of equal frequencies,
!! which equal shafts and round ones have, are arbitrary combinations; they are made unique (`degenerate`), and where only that
!! decides which of them is kept the user is told.
module razy_rotor_reduction_second_level
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: decimal, to_text
   use razy_linalg_dense, only: rising_order
   use razy_linalg_generalised, only: eigenpairs_t, modes_found
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t, transformed
   use razy_rotor_whirl_degenerate, only: least_d, separate_degenerate
   implicit none(type, external)
   private

   public :: second_level, sort_absolute, sort_signed, sort_frequency

   !> Orders of the second level: |d| falling, d falling, frequency rising.
   integer, parameter :: sort_absolute = 1, sort_signed = 2, sort_frequency = 3
   !> Keys apart by less than this share of the largest are equal.
   real(wp), parameter :: equal_key = 1.0e-9_wp

contains

   !> The second level: of the modes of `old`, with meshes closed or open, the first `kept` in the order `sorting`. `caution` where
   !> others could be kept as well.
   subroutine second_level(reduced, old, model, kept, meshed, sorting, caution, error)
      type(reduced_t), intent(out) :: reduced
      type(reduced_t), intent(in) :: old
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: kept
      logical, intent(in) :: meshed
      integer, intent(in) :: sorting
      character(:), allocatable, intent(out) :: caution
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: d(:)
      integer :: first(size(old%load)), chosen(size(old%load)), alike(size(old%load)), parts

      if (kept < 1 .or. kept > size(old%load)) then
         call raise(error, to_text(kept)//" modes on the second level: 1 to the "//to_text(size(old%load))//" of the first")
         return
      end if
      pairs = old%modes(meshed)
      if (pairs%status /= modes_found) call raise(error, "the modes of the reduced model were not found")
      if (allocated(error)) return
      call separate_degenerate(pairs, model, old%basis, first)
      d = deformations(matmul(transpose(pairs%vector), old%mesh_direction), sorting == sort_signed)
      chosen = rising_order(merge(real(first, wp), -d, sorting == sort_frequency))
      reduced = transformed(old, pairs%vector(:, chosen(:kept)))
      alike = merge(1, 0, first == first(chosen(kept)) .and. abs(d - d(chosen(kept))) <= 0.0_wp)
      parts = sum(alike(chosen(:kept)))
      if (parts < sum(alike)) caution = "&reduction kept = "//to_text(kept)//": "//to_text(parts)//" of "//to_text(sum(alike))// &
                                        " modes of "//decimal(sqrt(abs(pairs%value(chosen(kept))))/(2*pi), 1)//" Hz that move "// &
                                        "the meshes alike: which, is a choice; "//to_text(kept - parts)//" and "// &
                                        to_text(kept - parts + sum(alike))//" part none"
   end subroutine second_level

   !> What modes are sorted by: the largest of the meshes' |d|, or d where `signed`, the same number for those that are equal but
   !> for rounding, so for all without meshes. `by_mesh` (modes, meshes).
   pure function deformations(by_mesh, signed) result(d)
      real(wp), intent(in) :: by_mesh(:, :)
      logical, intent(in) :: signed
      real(wp), allocatable :: d(:)

      integer :: falling(size(by_mesh, 1)), i

      d = maxval(merge(by_mesh, abs(by_mesh), signed), 2)
      where (abs(d) < least_d*norm2(by_mesh)) d = 0.0_wp
      falling = rising_order(-d)
      do i = 2, size(d)
         if (d(falling(i - 1)) - d(falling(i)) <= equal_key*maxval(abs(d))) d(falling(i)) = d(falling(i - 1))
      end do
   end function deformations

end module razy_rotor_reduction_second_level
