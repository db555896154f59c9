!! Invariant subspaces of a large real operator for its eigenvalues of largest modulus, by ARPACK (implicitly restarted Arnoldi
!! method), with what is known already deflated, so that copies of multiple eigenvalues can be looked for again.
module razy_linalg_arnoldi
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dnaupd, dneupd
   implicit none(type, external)
   private

   public :: enlarge_space, operator_t

   integer, parameter :: most_restarts = 300
   !> Vectors of the method beside those wanted.
   integer, parameter :: spare = 20

   !> y = T x (n each).
   type, abstract :: operator_t
   contains
      procedure(apply), deferred :: apply
   end type operator_t

   abstract interface
      subroutine apply(self, x, y)
         import :: operator_t, wp
         implicit none(type, external)
         class(operator_t), intent(in) :: self
         real(wp), intent(in) :: x(:)
         real(wp), intent(out) :: y(:)
      end subroutine apply
   end interface

contains

   !> Add to the orthonormal basis `space` (n, k) of an invariant subspace the directions of the `wanted` next eigenvalues, one more
   !> or less if that would part a conjugate pair. `start` (n) is a vector to begin with, relative errors are less than `tolerance`.
   !> Not `found`: fewer can be wanted, or they did not converge.
   subroutine enlarge_space(operator, space, wanted, start, tolerance, found)
      class(operator_t), intent(in) :: operator
      real(wp), allocatable, intent(inout) :: space(:, :)
      integer, intent(in) :: wanted
      real(wp), intent(in) :: start(:), tolerance
      logical, intent(out) :: found

      real(wp), allocatable :: basis(:, :), residual(:), workd(:, :), workl(:)
      real(wp) :: error, imaginary(wanted + 1), real_part(wanted + 1)
      real(wp), allocatable :: workev(:)
      logical, allocatable :: select(:)
      integer :: ido, info, iparam(11), ipntr(14), n, width

      n = size(start)
      width = min(n - size(space, 2), 2*wanted + spare)
      found = .false.
      if (wanted < 1 .or. wanted > width - 2) return
      allocate (basis(n, width), workd(n, 3), workl(3*width*(width + 2)), workev(3*width), select(width))
      residual = start
      call deflate(space, residual)
      iparam = 0
      iparam([1, 3, 7]) = [1, most_restarts, 1]
      ipntr = 0
      error = tolerance
      ido = 0
      info = 1
      do
         call dnaupd(ido, "I", n, "LM", wanted, error, residual, width, basis, n, iparam, ipntr, workd, workl, size(workl), info)
         if (abs(ido) /= 1) exit
         associate (x => workd(:, 1 + ipntr(1)/n), y => workd(:, 1 + ipntr(2)/n))
            call operator%apply(x, y)
            call deflate(space, y)
         end associate
      end do
      if (info /= 0 .or. iparam(5) < wanted) return
      call dneupd(.true., "P", select, real_part, imaginary, basis, n, 0.0_wp, 0.0_wp, workev, "I", n, "LM", wanted, error, &
                  residual, width, basis, n, iparam, ipntr, workd, workl, size(workl), info)
      found = info == 0
      if (.not. found) return
      ! Half of a pair alone at the end spans nothing invariant.
      associate (kept => iparam(5) - merge(1, 0, abs(sum(imaginary(:iparam(5)))) > 0.0_wp))
         space = reshape([space, basis(:, :kept)], [n, size(space, 2) + kept])
      end associate
   end subroutine enlarge_space

   !> x - U Uᵀ x, twice, because once leaves rounding behind.
   pure subroutine deflate(space, x)
      real(wp), intent(in) :: space(:, :)
      real(wp), intent(inout) :: x(:)

      integer :: pass

      if (size(space, 2) == 0) return
      do pass = 1, 2
         x = x - matmul(space, matmul(x, space))
      end do
   end subroutine deflate

end module razy_linalg_arnoldi
