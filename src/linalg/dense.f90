!! Dense matrices and vectors: products by BLAS, whatever their size (no temporary arrays on the stack), and small helpers.
module razy_linalg_dense
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgemm, dtrsm
   implicit none(type, external)
   private

   public :: add_outer, congruence_of, felt, identity, is_symmetric, lower_inverse, make_orthonormal, product_of, rising_order, &
             symmetric_part, transposed_product

   !> Smaller than this part of the largest entry, an entry is a rounding error.
   real(wp), parameter :: rounding = 1.0e-14_wp
   !> A sum that is less than this part of its terms is none.
   real(wp), parameter :: rounding_of_sum = 16*epsilon(1.0_wp)

   !> Products of vectors without what is rounding: what a mode feels of a force, and a form of a mode. Loads on other bodies would
   !> move one that is at rest otherwise.
   interface felt
      module procedure felt_real, felt_complex
   end interface felt

contains

   !> a b, or 0 where its terms cancel.
   pure real(wp) function felt_real(a, b) result(felt)
      real(wp), intent(in) :: a(:), b(:)

      felt = dot_product(a, b)
      if (abs(felt) <= rounding_of_sum*dot_product(abs(a), abs(b))) felt = 0.0_wp
   end function felt_real

   !> a b, neither conjugate, or 0 where its terms cancel.
   pure complex(wp) function felt_complex(a, b) result(felt)
      complex(wp), intent(in) :: a(:), b(:)

      felt = sum(a*b)
      if (abs(felt) <= rounding_of_sum*dot_product(abs(a%re) + abs(a%im), abs(b%re) + abs(b%im))) felt = (0.0_wp, 0.0_wp)
   end function felt_complex

   !> Vᵀ A V.
   function congruence_of(matrix, basis) result(projected)
      real(wp), contiguous, intent(in) :: matrix(:, :), basis(:, :)
      real(wp), allocatable :: projected(:, :)

      projected = transposed_product(basis, product_of(matrix, basis))
   end function congruence_of

   !> A B.
   function product_of(a, b) result(c)
      real(wp), contiguous, intent(in) :: a(:, :), b(:, :)
      real(wp), allocatable :: c(:, :)

      allocate (c(size(a, 1), size(b, 2)), source=0.0_wp)
      if (size(a)*size(b) == 0) return
      call dgemm("N", "N", size(a, 1), size(b, 2), size(a, 2), 1.0_wp, a, size(a, 1), b, size(b, 1), 0.0_wp, c, size(c, 1))
   end function product_of

   !> Aᵀ B.
   function transposed_product(a, b) result(c)
      real(wp), contiguous, intent(in) :: a(:, :), b(:, :)
      real(wp), allocatable :: c(:, :)

      allocate (c(size(a, 2), size(b, 2)), source=0.0_wp)
      if (size(a)*size(b) == 0) return
      call dgemm("T", "N", size(a, 2), size(b, 2), size(a, 1), 1.0_wp, a, size(a, 1), b, size(b, 1), 0.0_wp, c, size(c, 1))
   end function transposed_product

   !> A + k w wᵀ in place of A (n, n), with w (n): what a spring k along w adds to a stiffness matrix.
   pure subroutine add_outer(matrix, k, w)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(in) :: k, w(:)

      integer :: i

      do i = 1, size(w)
         matrix(:, i) = matrix(:, i) + k*w*w(i)
      end do
   end subroutine add_outer

   !> I (n, n).
   pure function identity(n) result(matrix)
      integer, intent(in) :: n
      real(wp), allocatable :: matrix(:, :)

      integer :: i

      allocate (matrix(n, n), source=0.0_wp)
      do i = 1, n
         matrix(i, i) = 1.0_wp
      end do
   end function identity

   !> L⁻¹, L the lower triangle of `factor` (n, n).
   function lower_inverse(factor) result(inverse)
      real(wp), contiguous, intent(in) :: factor(:, :)
      real(wp), allocatable :: inverse(:, :)

      inverse = identity(size(factor, 1))
      call dtrsm("L", "L", "N", "N", size(factor, 1), size(factor, 1), 1.0_wp, factor, size(factor, 1), inverse, size(factor, 1))
   end function lower_inverse

   !> Whether `matrix` (n, n) is its transpose but for rounding.
   pure logical function is_symmetric(matrix)
      real(wp), intent(in) :: matrix(:, :)

      is_symmetric = all(abs(matrix - transpose(matrix)) <= rounding*maxval(abs(matrix)))
   end function is_symmetric

   !> (A + Aᵀ)/2, symmetric to the last bit.
   pure function symmetric_part(matrix) result(symmetric)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), allocatable :: symmetric(:, :)

      symmetric = 0.5_wp*(matrix + transpose(matrix))
   end function symmetric_part

   !> The places of the keys in rising order; equal keys stay as they come. Insertion, for lists that are short or nearly sorted.
   pure function rising_order(key) result(order)
      real(wp), intent(in) :: key(:)
      integer :: order(size(key))

      integer :: i, j

      do i = 1, size(key)
         j = i - 1
         do while (j >= 1)
            if (key(order(j)) <= key(i)) exit
            order(j + 1) = order(j)
            j = j - 1
         end do
         order(j + 1) = i
      end do
   end function rising_order

   !> Make the columns (p, m) orthonormal in the `metric` (p, p), one after the other, twice because once leaves rounding behind.
   pure subroutine make_orthonormal(columns, metric)
      real(wp), intent(inout) :: columns(:, :)
      real(wp), intent(in) :: metric(:, :)

      integer :: i, pass

      do i = 1, size(columns, 2)
         do pass = 1, 2
            associate (momentum => matmul(metric, columns(:, i)))
               columns(:, i) = columns(:, i) - matmul(columns(:, :i - 1), matmul(momentum, columns(:, :i - 1)))
            end associate
            columns(:, i) = columns(:, i)/sqrt(dot_product(columns(:, i), matmul(metric, columns(:, i))))
         end do
      end do
   end subroutine make_orthonormal

end module razy_linalg_dense
