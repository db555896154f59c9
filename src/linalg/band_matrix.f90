!! Square real matrices in a band about the diagonal, symmetric or not, and solutions with what they make: K + D s + M s² with
!! s real or complex, by LAPACK's factors with row interchanges.
module razy_linalg_band_matrix
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgbmv, dgbtrf, dgbtrs, zgbtrf, zgbtrs
   use razy_linalg_banded, only: bandwidth, narrow_order
   use razy_linalg_sparse, only: csr_t, entries_t, new_csr
   implicit none(type, external)
   private

   public :: band_lu_t, band_t, complex_band_lu_t, dense_band, find_band, negative_eigenvalues, new_band, quadratic_inertia, &
             quadratic_pivots

   !> Entry (i, j) is `entry(width + 1 + i - j, j)`, i and j no more than `width` apart.
   type :: band_t
      integer :: width = 0
      real(wp), allocatable :: entry(:, :)
   contains
      procedure :: add_times
   end type band_t

   !> Factors of a real matrix in a band.
   type :: band_lu_t
      private
      integer :: width = 0
      real(wp), allocatable :: band(:, :)
      integer, allocatable :: pivot(:)
   contains
      procedure :: factor => factor_real
      procedure :: solve => solve_real
   end type band_lu_t

   !> The same of a complex one.
   type :: complex_band_lu_t
      private
      integer :: width = 0
      complex(wp), allocatable :: band(:, :)
      integer, allocatable :: pivot(:)
   contains
      procedure :: factor => factor_complex
      procedure :: solve => solve_complex
   end type complex_band_lu_t

contains

   !> The rows and columns `order` (n) of a matrix, in a band of `width`, which holds them.
   pure function new_band(matrix, order, width) result(band)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: order(:), width
      type(band_t) :: band

      integer :: i, k, place(size(order))

      band%width = width
      allocate (band%entry(2*width + 1, size(order)), source=0.0_wp)
      place(order) = [(i, i=1, size(order))]
      do i = 1, matrix%rows
         do k = matrix%start(i), matrix%start(i + 1) - 1
            associate (j => place(matrix%column(k)))
               band%entry(width + 1 + place(i) - j, j) = matrix%value(k)
            end associate
         end do
      end do
   end function new_band

   !> The same of a matrix with all its zeros (n, n).
   pure function dense_band(matrix, order, width) result(band)
      real(wp), intent(in) :: matrix(:, :)
      integer, intent(in) :: order(:), width
      type(band_t) :: band

      integer :: i, j

      band%width = width
      allocate (band%entry(2*width + 1, size(order)), source=0.0_wp)
      do j = 1, size(order)
         do i = max(1, j - width), min(size(order), j + width)
            band%entry(width + 1 + i - j, j) = matrix(order(i), order(j))
         end do
      end do
   end function dense_band

   !> An order (n) in which what is not zero in any of three matrices (n, n) is in a narrow band, and its width.
   pure subroutine find_band(a, b, c, order, width)
      real(wp), intent(in) :: a(:, :), b(:, :), c(:, :)
      integer, allocatable, intent(out) :: order(:)
      integer, intent(out) :: width

      type(entries_t) :: entries
      type(csr_t) :: pattern
      integer :: i, j

      do j = 1, size(a, 2)
         do i = 1, size(a, 1)
            if (abs(a(i, j)) + abs(b(i, j)) + abs(c(i, j)) + abs(a(j, i)) + abs(b(j, i)) + abs(c(j, i)) > 0.0_wp) then
               call entries%add(i, j, 1.0_wp)
            end if
         end do
      end do
      pattern = new_csr(entries, size(a, 1), size(a, 1))
      order = narrow_order(pattern)
      width = bandwidth(pattern%extract(order))
   end subroutine find_band

   !> y + A x becomes y (n each).
   subroutine add_times(self, x, y)
      class(band_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: y(:)

      associate (n => size(self%entry, 2), w => self%width)
         if (n > 0) call dgbmv("N", n, n, w, w, 1.0_wp, self%entry, 2*w + 1, x, 1, 1.0_wp, y, 1)
      end associate
   end subroutine add_times

   !> Factor K + s D + s² M, bands of one width; `info` is LAPACK's: 0 is success.
   subroutine factor_real(self, stiffness, damping, mass, s, info)
      class(band_lu_t), intent(out) :: self
      type(band_t), intent(in) :: stiffness, damping, mass
      real(wp), intent(in) :: s
      integer, intent(out) :: info

      integer :: n, w

      w = stiffness%width
      n = size(stiffness%entry, 2)
      self%width = w
      allocate (self%band(3*w + 1, n), self%pivot(n))
      self%band(:w, :) = 0.0_wp
      self%band(w + 1:, :) = stiffness%entry + s*(damping%entry + s*mass%entry)
      call dgbtrf(n, n, w, w, self%band, 3*w + 1, self%pivot, info)
   end subroutine factor_real

   !> A⁻¹ b becomes b (n).
   subroutine solve_real(self, b)
      class(band_lu_t), intent(in) :: self
      real(wp), intent(inout) :: b(:)

      integer :: info

      ! info reports arguments that are wrong, which these are not
      associate (n => size(b), w => self%width)
         call dgbtrs("N", n, w, w, 1, self%band, 3*w + 1, self%pivot, b, n, info)
      end associate
   end subroutine solve_real

   !> Factor K + s D + s² M, bands of one width; `info` is LAPACK's: 0 is success.
   subroutine factor_complex(self, stiffness, damping, mass, s, info)
      class(complex_band_lu_t), intent(out) :: self
      type(band_t), intent(in) :: stiffness, damping, mass
      complex(wp), intent(in) :: s
      integer, intent(out) :: info

      integer :: n, w

      w = stiffness%width
      n = size(stiffness%entry, 2)
      self%width = w
      allocate (self%band(3*w + 1, n), self%pivot(n))
      self%band(:w, :) = 0.0_wp
      self%band(w + 1:, :) = stiffness%entry + s*(damping%entry + s*mass%entry)
      call zgbtrf(n, n, w, w, self%band, 3*w + 1, self%pivot, info)
   end subroutine factor_complex

   !> A⁻¹ B becomes `b` (n, systems).
   subroutine solve_complex(self, b)
      class(complex_band_lu_t), intent(in) :: self
      complex(wp), contiguous, intent(inout) :: b(:, :)

      integer :: info

      associate (n => size(b, 1), w => self%width)
         call zgbtrs("N", n, w, w, size(b, 2), self%band, 3*w + 1, self%pivot, b, n, info)
      end associate
   end subroutine solve_complex

   !> Number of negative eigenvalues of the Hermitian K - w² M + i w G, K and M symmetric and G skew, by the signs of the pivots
   !> (Sylvester's law of inertia).
   pure integer function quadratic_inertia(stiffness, gyroscopic, mass, w) result(negative)
      type(band_t), intent(in) :: stiffness, gyroscopic, mass
      real(wp), intent(in) :: w

      negative = count(real(quadratic_pivots(stiffness, gyroscopic, mass, cmplx(0.0_wp, w, wp)), wp) < 0.0_wp)
   end function quadratic_inertia

   !> Number of negative eigenvalues of a symmetric matrix.
   integer function negative_eigenvalues(matrix) result(negative)
      type(csr_t), intent(in) :: matrix

      type(band_t) :: band
      integer, allocatable :: order(:)

      order = narrow_order(matrix)
      band = new_band(matrix, order, bandwidth(matrix%extract(order)))
      negative = quadratic_inertia(band, band, band, 0.0_wp)
   end function negative_eigenvalues

   !> The pivots (n) of K + s D + s² M, bands of one width, in the factors L U without interchanges. One that vanishes is
   !> replaced by a rounding of the largest entry, as if the matrix had changed by that.
   pure function quadratic_pivots(stiffness, damping, mass, s) result(pivot)
      type(band_t), intent(in) :: stiffness, damping, mass
      complex(wp), intent(in) :: s
      complex(wp), allocatable :: pivot(:)

      complex(wp), allocatable :: band(:, :)
      complex(wp) :: factor
      real(wp) :: least
      integer :: i, j, last

      associate (w => stiffness%width, n => size(stiffness%entry, 2))
         band = stiffness%entry + s*(damping%entry + s*mass%entry)
         least = epsilon(1.0_wp)*maxval([0.0_wp, abs(band%re)])
         allocate (pivot(n))
         do j = 1, n
            if (abs(band(w + 1, j)%re) + abs(band(w + 1, j)%im) < least) band(w + 1, j) = least
            pivot(j) = band(w + 1, j)
            last = min(w, n - j)
            band(w + 2:w + 1 + last, j) = band(w + 2:w + 1 + last, j)/pivot(j)
            do i = 1, last
               factor = band(w + 1 - i, j + i)
               band(w + 2 - i:w + 1 + last - i, j + i) = band(w + 2 - i:w + 1 + last - i, j + i) &
                                                         - factor*band(w + 2:w + 1 + last, j)
            end do
         end do
      end associate
   end function quadratic_pivots

end module razy_linalg_band_matrix
