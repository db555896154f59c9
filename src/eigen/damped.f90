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
   use razy_eigen_path, only: eigen_path_t
   use razy_linalg_dense, only: rising_order
   use razy_linalg_eigen, only: right_eigen
   implicit none(type, external)
   private

   public :: damped_eigen, modal_scaling

contains

   !> S, rad/s, from `squared`, (rad/s)² (n each).
   pure function modal_scaling(squared) result(scaling)
      real(wp), intent(in) :: squared(:)
      real(wp), allocatable :: scaling(:)

      scaling = sqrt(abs(squared))
      where (.not. scaling > 0.0_wp) scaling = minval(scaling, mask=scaling > 0.0_wp)
      if (.not. maxval(scaling) < huge(1.0_wp)) scaling = 1.0_wp
   end function modal_scaling

   !> Eigenvalues with imaginary part >= 0, 1/s and rad/s, in the order of their imaginary parts, equal ones by the real part;
   !> if asked for, their shapes S y (n, values) of unit length. `damping` is B, `cross` C (n, n), none if not given. With
   !> `path` and shapes, they are found from those at values of `parameter` before, if these are near. `info` is LAPACK's: 0 is
   !> success.
   subroutine damped_eigen(squared, damping, value, info, cross, shape, path, parameter)
      real(wp), intent(in) :: squared(:), damping(:, :)
      complex(wp), allocatable, intent(out) :: value(:)
      integer, intent(out) :: info
      real(wp), intent(in), optional :: cross(:, :), parameter
      complex(wp), allocatable, intent(out), optional :: shape(:, :)
      type(eigen_path_t), intent(inout), optional :: path

      complex(wp), allocatable :: all(:), left(:, :), vector(:, :)
      real(wp), allocatable :: scaling(:), state(:, :), stiffness(:, :)
      integer, allocatable :: order(:)
      integer :: i, n
      logical :: followed, found

      n = size(squared)
      info = 0
      scaling = modal_scaling(squared)
      allocate (stiffness(n, n), source=0.0_wp)
      if (present(cross)) stiffness = cross
      do i = 1, n
         stiffness(i, i) = stiffness(i, i) + squared(i)
      end do
      followed = .false.
      found = .false.
      if (present(path)) then
         followed = path%known >= 0
         if (followed) call path%advance(parameter, scaling, damping, stiffness, found)
      end if
      if (found) then
         all = path%value(:, 1)
         vector = spread(scaling, 2, n)*path%right(:, :, 1)
      else
         ! Vectors that are not allocated are not asked for.
         if (present(shape)) allocate (vector(2*n, 2*n))
         if (followed) allocate (left(2*n, 2*n))
         allocate (all(2*n))
         allocate (state(2*n, 2*n), source=0.0_wp)
         do i = 1, n
            state(i, n + i) = scaling(i)
            state(n + 1:, i) = -stiffness(:, i)/scaling(i)
         end do
         state(n + 1:, n + 1:) = -damping
         ! Slow motions after fast ones, of whose rounding they would have a share otherwise.
         order = rising_order(-norm2(state, dim=2))
         call right_eigen(state(order, order), all, info, vector, left)
         if (allocated(vector)) vector(order, :) = vector
         if (allocated(left)) left(order, :) = left
         if (info /= 0) all = (0.0_wp, -1.0_wp)
      end if
      order = pack([(i, i=1, size(all))], all%im >= 0.0_wp)
      order = order(rising_order(all(order)%re))
      order = order(rising_order(all(order)%im))
      value = all(order)
      if (followed .and. .not. found) then
         call path%start(parameter, scaling, damping, value, vector(:n, order)/spread(scaling, 2, size(order)), &
                         conjg(left(n + 1:, order)))
      end if
      if (.not. present(shape)) return
      allocate (shape(n, size(order)))
      do i = 1, size(order)
         shape(:, i) = vector(:n, order(i))/max(norm2(abs(vector(:n, order(i)))), tiny(1.0_wp))
      end do
   end subroutine damped_eigen

end module razy_eigen_damped
