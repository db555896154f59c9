!! Shapes of equal natural frequencies, made unique.
!!
!! Equal shafts, and the two planes of a shaft on isotropic bearings, have equal frequencies; any combination of their shapes is a
!! shape, and which of them an eigensolver gives is an accident of rounding. Here the space of such shapes gets the basis that
!! makes the quadratic forms
!!
!!     1. sum over shafts s of s times the kinetic energy on shaft s,
!!     2. sum over motions k (axial, torsion, bending in xy, bending in xz) of k times the kinetic energy in k,
!!     3. sum over nodes of the place of the node in its shaft times the kinetic energy of the node
!!
!! diagonal one after the other, each in the spaces that the ones before leave together, in ascending order: shapes on single shafts
!! and in single planes first, where the space has such. Frequencies apart by less than `equal` count as equal. Where modes are
!! to be chosen by d = wᵀ t of the meshes, -sum d² comes before these, so that as few shapes as possible move the meshes.
module razy_rotor_whirl_degenerate
   use razy_core_kinds, only: wp
   use razy_eigen_spectrum, only: first_of_equal
   use razy_linalg_dense, only: product_of, symmetric_part
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_generalised, only: eigenpairs_t, orient
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_modes, only: motion_of
   implicit none(type, external)
   private

   public :: least_d, separate_degenerate

   !> Eigenvalues omega² apart by less than this share of their size, or by the second share of the largest, are equal.
   real(wp), parameter :: equal = 1.0e-7_wp, rounding = 1.0e-12_wp
   !> Values of a form, which lie between 1 and the number of shafts, motions or nodes, apart by less are equal.
   real(wp), parameter :: equal_form = 1.0e-5_wp
   !> Values of d below this share of the norm of all are zero but for rounding.
   real(wp), parameter :: least_d = 1.0e-7_wp
   integer, parameter :: forms = 3

contains

   !> Make the shapes of `pairs` unique, in coordinates of the model or, for a choice by d, in those of `basis` (n, p). `first`: of
   !> each mode the first of equal frequency.
   subroutine separate_degenerate(pairs, model, basis, first)
      type(eigenpairs_t), intent(inout) :: pairs
      type(rotor_model_t), intent(in) :: model
      real(wp), contiguous, intent(in), optional :: basis(:, :)
      integer, intent(out), optional :: first(:)

      real(wp) :: tolerance(0:forms)
      integer :: equals(size(pairs%value)), i

      tolerance = equal_form
      tolerance(0) = (least_d*norm2(matmul(transpose(model%mesh_direction), in_model(pairs%vector, basis))))**2
      equals = first_of_equal(cmplx(pairs%value, kind=wp), equal, rounding*maxval(abs(pairs%value)))
      do i = 1, size(equals)
         associate (n => count(equals == i))
            if (n > 1) call separate(pairs%vector, model, i, i + n - 1, merge(0, 1, present(basis)), tolerance, basis)
         end associate
      end do
      call orient(pairs%vector, in_model(pairs%vector, basis))
      if (present(first)) first = equals
   end subroutine separate_degenerate

   !> Columns `first` to `last` by the forms from number `form` on, whose values are equal within `tolerance`.
   recursive subroutine separate(vector, model, first, last, form, tolerance, basis)
      real(wp), contiguous, intent(inout) :: vector(:, :)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: first, last, form
      real(wp), intent(in) :: tolerance(0:)
      real(wp), contiguous, intent(in), optional :: basis(:, :)

      real(wp), allocatable :: matrix(:, :), rotated(:, :), value(:)
      integer :: equals(last - first + 1), i, info, m

      m = last - first + 1
      rotated = vector(:, first:last)
      matrix = form_of(in_model(rotated, basis), model, form)
      allocate (value(m))
      call symmetric_eigen(matrix, value, info)
      if (info /= 0) return
      vector(:, first:last) = product_of(rotated, matrix)
      if (form == forms) return
      equals = first_of_equal(cmplx(value, kind=wp), 0.0_wp, tolerance(form))
      do i = 1, m
         associate (n => count(equals == i))
            if (n > 1) call separate(vector, model, first + i - 1, first + i + n - 2, form + 1, tolerance, basis)
         end associate
      end do
   end subroutine separate

   !> The columns in coordinates of the model.
   function in_model(vector, basis) result(shape)
      real(wp), contiguous, intent(in) :: vector(:, :)
      real(wp), contiguous, intent(in), optional :: basis(:, :)
      real(wp), allocatable :: shape(:, :)

      shape = vector
      if (present(basis)) shape = product_of(basis, vector)
   end function in_model

   !> The form, from 0, (m, m) in the space of the columns (n, m). The mass matrix does not couple what the forms take apart, except
   !> neighbouring nodes in the third, whose terms are halved between them.
   function form_of(vector, model, form) result(matrix)
      real(wp), contiguous, intent(in) :: vector(:, :)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: form
      real(wp), allocatable :: matrix(:, :)

      real(wp), allocatable :: momentum(:), weight(:)
      integer :: i, j, m

      m = size(vector, 2)
      if (form == 0) then
         associate (d => matmul(transpose(vector), model%mesh_direction))
            matrix = -matmul(d, transpose(d))
         end associate
         return
      end if
      allocate (matrix(m, m), weight(size(vector, 1)))
      associate (numbering => model%numbering)
         if (form == 1) weight = real(numbering%shaft, wp)
         if (form == 2) weight = [(real(motion_of(numbering%kind(i)), wp), i=1, numbering%n)]
         if (form == 3) weight = real(numbering%node, wp)
      end associate
      do j = 1, m
         momentum = weight*model%mass%times(vector(:, j))
         do i = 1, m
            matrix(i, j) = dot_product(vector(:, i), momentum)
         end do
      end do
      matrix = symmetric_part(matrix)
   end function form_of

end module razy_rotor_whirl_degenerate
