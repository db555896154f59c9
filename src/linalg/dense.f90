!! Products of dense matrices by BLAS, whatever their size: no temporary arrays on the stack.
module razy_linalg_dense
   use razy_core_kinds, only: wp
   use razy_linalg_band_lapack, only: dgemm
   implicit none(type, external)
   private

   public :: congruence_of, product_of

contains

   !> Vᵀ A V.
   function congruence_of(matrix, basis) result(projected)
      real(wp), contiguous, intent(in) :: matrix(:, :), basis(:, :)
      real(wp), allocatable :: projected(:, :)

      real(wp), allocatable :: image(:, :)
      integer :: m, p

      p = size(basis, 1)
      m = size(basis, 2)
      image = product_of(matrix, basis)
      allocate (projected(m, m))
      if (p*m > 0) call dgemm("T", "N", m, m, p, 1.0_wp, basis, p, image, p, 0.0_wp, projected, m)
   end function congruence_of

   !> A B.
   function product_of(a, b) result(c)
      real(wp), contiguous, intent(in) :: a(:, :), b(:, :)
      real(wp), allocatable :: c(:, :)

      allocate (c(size(a, 1), size(b, 2)))
      if (size(a)*size(b) == 0) then
         c = 0.0_wp
         return
      end if
      call dgemm("N", "N", size(a, 1), size(b, 2), size(a, 2), 1.0_wp, a, size(a, 1), b, size(b, 1), 0.0_wp, c, size(c, 1))
   end function product_of

end module razy_linalg_dense
