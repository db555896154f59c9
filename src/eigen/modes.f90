!! Modes of the linear machine M q'' + B q' + K q = 0.
!!
!! Undamped: K φ = λ M φ with φᵀ M φ = 1, λ = ω². With M = L Lᵀ it is the symmetric problem of L⁻¹ K L⁻ᵀ, whose computed
!! values err by some rounding units of the largest λ. Damped: det(s² M + s B + K) = 0.
!!
!! The share of coordinate i in mode φ is φ_i (M φ)_i. The shares of a mode add up to 1, and for a diagonal M they are the
!! parts of its kinetic energy; the shares of a coordinate in all modes add up to 1 too. With mass coupling a share can be
!! negative.
module razy_eigen_modes
   use razy_core_kinds, only: pi, wp
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_lapack, only: dgeev, dpotrf, dtrsm
   implicit none(type, external)
   private

   public :: damped_eigenvalues, energy_shares, hertz, modes_t, natural_modes
   public :: modes_ok, modes_no_mass, modes_failed

   !> Outcomes: done; the mass matrix is not positive definite; LAPACK did not converge.
   integer, parameter :: modes_ok = 0, modes_no_mass = 1, modes_failed = 2

   !> Modes as columns of `shape` (n, n), M-orthonormal; their `value` λ = ω² (n), 1/s².
   type :: modes_t
      real(wp), allocatable :: value(:), shape(:, :)
   end type modes_t

contains

   !> Undamped modes, frequencies ascending; the largest component of each shape is positive.
   subroutine natural_modes(modes, mass, stiffness, status)
      type(modes_t), intent(out) :: modes
      real(wp), intent(in) :: mass(:, :), stiffness(:, :)
      integer, intent(out) :: status

      real(wp) :: factor(size(mass, 1), size(mass, 1))
      integer :: info, k, n

      n = size(mass, 1)
      allocate (modes%value(n), modes%shape(n, n))
      call reduce(mass, stiffness, factor, modes%shape, status)
      if (status /= modes_ok) return
      modes%shape = 0.5_wp*(modes%shape + transpose(modes%shape))
      call symmetric_eigen(modes%shape, modes%value, info)
      if (info /= 0) status = modes_failed
      if (info /= 0) return
      call dtrsm("L", "L", "T", "N", n, n, 1.0_wp, factor, n, modes%shape, n)
      do k = 1, n
         if (modes%shape(maxloc(abs(modes%shape(:, k)), dim=1), k) < 0.0_wp) modes%shape(:, k) = -modes%shape(:, k)
      end do
   end subroutine natural_modes

   !> L and L⁻¹ A L⁻ᵀ.
   subroutine reduce(mass, matrix, factor, reduced, status)
      real(wp), intent(in) :: mass(:, :), matrix(:, :)
      real(wp), intent(out) :: factor(:, :), reduced(:, :)
      integer, intent(out) :: status

      integer :: info, n

      n = size(mass, 1)
      factor = mass
      reduced = matrix
      status = modes_ok
      call dpotrf("L", n, factor, n, info)
      if (info /= 0) status = modes_no_mass
      if (info /= 0) return
      call dtrsm("L", "L", "N", "N", n, n, 1.0_wp, factor, n, reduced, n)
      call dtrsm("R", "L", "T", "N", n, n, 1.0_wp, factor, n, reduced, n)
   end subroutine reduce

   !> All 2n eigenvalues s (1/s) of the damped machine, by rising modulus; a conjugate pair has Im > 0 first.
   subroutine damped_eigenvalues(values, mass, damping, stiffness, status)
      complex(wp), allocatable, intent(out) :: values(:)
      real(wp), intent(in) :: mass(:, :), damping(:, :), stiffness(:, :)
      integer, intent(out) :: status

      real(wp), allocatable :: factor(:, :), k(:, :), b(:, :), state(:, :), re(:), im(:), work(:)
      complex(wp) :: value
      real(wp) :: left(1, 1), right(1, 1)
      integer :: i, info, j, n

      n = size(mass, 1)
      allocate (factor(n, n), k(n, n), b(n, n), values(2*n), re(2*n), im(2*n), work(16*n))
      call reduce(mass, stiffness, factor, k, status)
      if (status == modes_ok) call reduce(mass, damping, factor, b, status)
      if (status /= modes_ok) return
      allocate (state(2*n, 2*n), source=0.0_wp)
      do i = 1, n
         state(i, n + i) = 1.0_wp
      end do
      state(n + 1:, :n) = -k
      state(n + 1:, n + 1:) = -b
      call dgeev("N", "N", 2*n, state, 2*n, re, im, left, 1, right, 1, work, size(work), info)
      if (info /= 0) status = modes_failed
      if (info /= 0) return
      do i = 1, 2*n
         value = cmplx(re(i), im(i), wp)
         do j = i - 1, 1, -1
            if (abs(values(j)) <= abs(value)) exit
            values(j + 1) = values(j)
         end do
         values(j + 1) = value
      end do
   end subroutine damped_eigenvalues

   !> Shares (coordinate, mode) of the coordinates in the modes.
   pure function energy_shares(modes, mass) result(share)
      type(modes_t), intent(in) :: modes
      real(wp), intent(in) :: mass(:, :)
      real(wp) :: share(size(mass, 1), size(modes%value))

      share = modes%shape*matmul(mass, modes%shape)
   end function energy_shares

   !> Natural frequency, Hz, of λ = ω²; negative for an unstable λ < 0.
   elemental function hertz(value)
      real(wp), intent(in) :: value
      real(wp) :: hertz

      hertz = sign(sqrt(abs(value)), value)/(2*pi)
   end function hertz

end module razy_eigen_modes
