!! The second level of a reduction (source thesis, 4.2.2): modes of the reduced model on its bearings with meshes open (A, (4.67))
!! or closed (B, (4.74)); those kept are the first in the order of |d|, d = wᵀ t, of d itself (which depends on the sign of the
!! shapes, here with the largest displacement or rotation of a node positive), or of the frequency. Shapes of equal frequencies,
!! which equal shafts have, are arbitrary combinations; they are chosen so that as few of them as possible move the meshes.
module razy_rotor_reduction_second_level
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_eigen_spectrum, only: first_of_equal
   use razy_linalg_dense, only: product_of, rising_order
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_generalised, only: eigenpairs_t, modes_found, orient
   use razy_rotor_reduction_reduced, only: reduced_t, transformed
   implicit none(type, external)
   private

   public :: second_level, sort_absolute, sort_signed, sort_frequency

   !> Orders of the second level: |d| falling, d falling, frequency rising.
   integer, parameter :: sort_absolute = 1, sort_signed = 2, sort_frequency = 3
   !> Values of d below this share of the largest are zero but for rounding; such modes go by frequency.
   real(wp), parameter :: least_d = 1.0e-9_wp
   !> Eigenvalues omega² apart by less than this share of their size, or by the second share of the largest, are equal.
   real(wp), parameter :: equal = 1.0e-7_wp, rounding = 1.0e-14_wp

contains

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
      pairs = old%modes(meshed)
      if (pairs%status /= modes_found) call raise(error, "the modes of the reduced model were not found")
      if (allocated(error)) return
      call gather_deformation(pairs, old)
      reduced = select_modes(old, pairs%vector, kept, sorting)
   end subroutine second_level

   !> Turn shapes of equal eigenvalues into each other so that the first of them has most of the meshes' deformation, the second
   !> most of the rest, and so on: the eigenvectors of sum d dᵀ. Signs are those of displacements, not of coordinates of `old`,
   !> which for equal shafts are any combination of each other.
   subroutine gather_deformation(pairs, old)
      type(eigenpairs_t), intent(inout) :: pairs
      type(reduced_t), intent(in) :: old

      real(wp), allocatable :: d(:, :), form(:, :), turned(:, :), value(:)
      integer :: first(size(pairs%value)), i, info, last

      first = first_of_equal(cmplx(pairs%value, kind=wp), equal, rounding*maxval(abs(pairs%value)))
      do i = 1, size(first)
         last = i + count(first == i) - 1
         if (last <= i) cycle
         d = matmul(transpose(pairs%vector(:, i:last)), old%mesh_direction)
         form = -matmul(d, transpose(d))
         value = form(1, :)
         call symmetric_eigen(form, value, info)
         if (info /= 0) cycle
         turned = product_of(pairs%vector(:, i:last), form)
         pairs%vector(:, i:last) = turned
      end do
      call orient(pairs%vector, product_of(old%basis, pairs%vector))
   end subroutine gather_deformation

   !> The first `kept` columns of `shapes` (p, m) in the order `sorting` as a model. With several meshes d is the largest
   !> of the meshes' (in the sense of the order).
   function select_modes(old, shapes, kept, sorting) result(reduced)
      type(reduced_t), intent(in) :: old
      real(wp), intent(in) :: shapes(:, :)
      integer, intent(in) :: kept, sorting
      type(reduced_t) :: reduced

      real(wp) :: d(size(old%mesh_direction, 2)), key(size(shapes, 2))
      integer :: chosen(size(shapes, 2)), i

      do i = 1, size(shapes, 2)
         d = matmul(shapes(:, i), old%mesh_direction)
         key(i) = 0.0_wp
         if (sorting == sort_absolute) key(i) = maxval(abs(d))
         if (sorting == sort_signed) key(i) = maxval(d)
         if (sorting == sort_frequency .or. size(d) == 0) key(i) = -i
      end do
      if (sorting /= sort_frequency .and. size(d) > 0) where (abs(key) < least_d*maxval(abs(key))) key = 0.0_wp
      chosen = rising_order(-key)
      reduced = transformed(old, shapes(:, chosen(:kept)))
   end function select_modes

end module razy_rotor_reduction_second_level
