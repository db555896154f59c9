!! Eigenvalues and shapes of y'' + B y' + (diag(squared) + C) y = 0: a machine in its undamped modes, whose omega² are
!! `squared`, with whatever damping, gyroscopic and circulatory matrices.
!!
!! In the state (S y, y'), S = diag(max(omega_i, floor)), the first-order matrix
!!
!!     A = ( 0, S; -(diag(squared) + C) S⁻¹, -B )
!!
!! is nearly skew-symmetric where B and C are small. Errors of its eigenvalues are roundings of the largest omega, not of its
!! square.
module razy_eigen_damped
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: rising_order
   use razy_linalg_eigen, only: right_eigen
   implicit none(type, external)
   private

   public :: damped_eigen, modal_scaling

   !> Smallest frequency of the scaling as a share of the largest, for rigid-body modes.
   real(wp), parameter :: floor_share = 1.0e-6_wp

contains

   !> S, rad/s, from `squared`, (rad/s)² (n each).
   pure function modal_scaling(squared) result(scaling)
      real(wp), intent(in) :: squared(:)
      real(wp), allocatable :: scaling(:)

      scaling = sqrt(max(squared, floor_share**2*maxval([0.0_wp, abs(squared)])))
      if (.not. any(scaling > 0.0_wp)) scaling = 1.0_wp
   end function modal_scaling

   !> Eigenvalues with imaginary part >= 0, 1/s and rad/s, in the order of their imaginary parts, equal ones by the real part;
   !> if asked for, their shapes S y (n, values) of unit length. `damping` is B, `cross` C (n, n), none if not given. `info`
   !> is LAPACK's: 0 is success.
   subroutine damped_eigen(squared, damping, value, info, cross, shape)
      real(wp), intent(in) :: squared(:), damping(:, :)
      complex(wp), allocatable, intent(out) :: value(:)
      integer, intent(out) :: info
      real(wp), intent(in), optional :: cross(:, :)
      complex(wp), allocatable, intent(out), optional :: shape(:, :)

      complex(wp), allocatable :: all(:), vector(:, :)
      real(wp), allocatable :: state(:, :)
      integer, allocatable :: order(:)
      integer :: i, n

      n = size(squared)
      allocate (state(2*n, 2*n), source=0.0_wp)
      allocate (all(2*n))
      associate (scaling => modal_scaling(squared))
         do i = 1, n
            state(i, n + i) = scaling(i)
            state(n + i, i) = -squared(i)/scaling(i)
            if (present(cross)) state(n + 1:, i) = state(n + 1:, i) - cross(:, i)/scaling(i)
         end do
      end associate
      state(n + 1:, n + 1:) = -damping
      if (present(shape)) then
         allocate (vector(2*n, 2*n))
         call right_eigen(state, all, info, vector)
      else
         call right_eigen(state, all, info)
      end if
      if (info /= 0) all = (0.0_wp, -1.0_wp)
      order = pack([(i, i=1, 2*n)], all%im >= 0.0_wp)
      order = order(rising_order(all(order)%re))
      order = order(rising_order(all(order)%im))
      value = all(order)
      if (.not. present(shape)) return
      allocate (shape(n, size(order)))
      do i = 1, size(order)
         shape(:, i) = vector(:n, order(i))/max(norm2(abs(vector(:n, order(i)))), tiny(1.0_wp))
      end do
   end subroutine damped_eigen

end module razy_eigen_damped
