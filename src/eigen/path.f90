!! Eigenvalues and vectors of Q(λ) = λ² + λ B + K over a parameter, all at once by Newton's method from those at the values before.
!!
!! If all 2n eigenvalues λ_i differ, with right and left vectors y and w and wᵀ (2λ + B) y = 1, then Q⁻¹(s) = Σ y_i w_iᵀ/(s - λ_i).
!! So what is nearly a pair, with Q(λ_j) y_j = r_j, is corrected by
!!
!!     λ_j ← λ_j - w_jᵀ r_j,     y_j ← y_j - Σ_{i≠j} y_i w_iᵀ r_j/(λ_j - λ_i),
!!
!! and left vectors alike with transposed matrices. The error is about squared in each round. As long as corrections are small
!! beside the distances of the eigenvalues, none is found twice, and so none is missed; their sum, the trace of -B, is a check.
module razy_eigen_path
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: eigen_path_t

   !> So often values in succession may be too far apart, or eigenvalues equal, before no more is tried.
   integer, parameter :: rounds = 5, most_misses = 10
   !> Shares of other vectors in a correction, squared: of one that is the last, and of one that belongs to another problem.
   real(wp), parameter :: last = 1.0e-7_wp**2, large = 0.3_wp**2
   !> Error of the sum of the eigenvalues as a share of the sum of their moduli.
   real(wp), parameter :: rounding = 1.0e-12_wp
   !> Extrapolation goes less far than so many steps.
   real(wp), parameter :: farthest = 1.5_wp

   !> Eigenvalues with imaginary part > 0, right and left vectors in columns: at the last value of the parameter (1), at the one
   !> before (2), and under way (3).
   type :: eigen_path_t
      !> At so many values they are known in succession; -1: they cannot be followed, because some are real or too often equal.
      integer :: known = 0
      integer, private :: misses = 0
      real(wp) :: parameter(2) = 0.0_wp
      complex(wp), allocatable :: value(:, :), right(:, :, :), left(:, :, :)
      !> Kept because memory given back and taken again in each round costs a sixth of the time.
      complex(wp), allocatable, private :: work(:, :, :)
   contains
      procedure :: start
      procedure :: advance
      procedure, private :: keep
   end type eigen_path_t

contains

   !> Begin with eigenvalues and vectors known from elsewhere; `damping` is B (n, n), and `scaling` (n) what `advance` says.
   subroutine start(self, parameter, scaling, damping, value, right, left)
      class(eigen_path_t), intent(inout) :: self
      real(wp), intent(in) :: parameter, scaling(:), damping(:, :)
      complex(wp), intent(in) :: value(:), right(:, :), left(:, :)

      integer :: n

      n = size(scaling)
      self%known = -1
      if (size(value) /= n .or. .not. all(value%im > 0.0_wp) .or. self%misses == most_misses) return
      self%known = 0
      if (.not. allocated(self%value)) then
         allocate (self%value(n, 3), self%right(n, n, 3), self%left(n, n, 3), self%work(n, n, 5), source=(0.0_wp, 0.0_wp))
      end if
      self%value(:, 3) = value
      self%right(:, :, 3) = right
      self%left(:, :, 3) = left
      call self%keep(parameter, scaling, damping)
   end subroutine start

   !> Let those under way be the last ones, right vectors with unit length, left ones with wᵀ (2λ + B) y = 1. Where that is 0, the
   !> matrix is defective: nothing is known then.
   pure subroutine keep(self, parameter, scaling, damping)
      class(eigen_path_t), intent(inout) :: self
      real(wp), intent(in) :: parameter, scaling(:), damping(:, :)

      complex(wp) :: factor(size(scaling))
      integer :: j

      self%parameter = [parameter, self%parameter(1)]
      self%value(:, 2) = self%value(:, 1)
      self%right(:, :, 2) = self%right(:, :, 1)
      self%left(:, :, 2) = self%left(:, :, 1)
      self%value(:, 1) = self%value(:, 3)
      associate (value => self%value(:, 1), right => self%right(:, :, 3), left => self%left(:, :, 3), image => self%work(:, :, 1))
         image = matmul(damping, right)
         factor = [(sum(left(:, j)*(image(:, j) + 2*value(j)*right(:, j))), j=1, size(scaling))]
         self%known = merge(min(self%known + 1, 2), 0, all(abs(factor) > epsilon(1.0_wp)))
         if (self%known == 0) return
         do j = 1, size(scaling)
            associate (length => norm2(scaling*abs(right(:, j))))
               self%right(:, j, 1) = right(:, j)*(1/length)
               self%left(:, j, 1) = left(:, j)*(length/factor(j))
            end associate
         end do
      end associate
   end subroutine keep

   !> Go on to `parameter`, where `damping` is B and `stiffness` K (n, n). If not `found`, the last ones stay what they are. Right
   !> vectors have unit length once multiplied by `scaling` (n).
   subroutine advance(self, parameter, scaling, damping, stiffness, found)
      class(eigen_path_t), intent(inout) :: self
      real(wp), intent(in) :: parameter, scaling(:), damping(:, :), stiffness(:, :)
      logical, intent(out) :: found

      real(wp) :: share, sum_of_values, weight
      integer :: i, round

      found = .false.
      if (self%known < 1) return
      weight = 0.0_wp
      associate (step => parameter - self%parameter(1), before => self%parameter(1) - self%parameter(2))
         if (self%known == 2 .and. abs(step) < farthest*abs(before)) weight = step/before
      end associate
      associate (value => self%value, right => self%right, left => self%left, work => self%work)
         value(:, 3) = value(:, 1) + weight*(value(:, 1) - value(:, 2))
         right(:, :, 3) = right(:, :, 1) + weight*(right(:, :, 1) - right(:, :, 2))
         left(:, :, 3) = left(:, :, 1) + weight*(left(:, :, 1) - left(:, :, 2))
         do round = 1, rounds
            call correct(right(:, :, 3), value(:, 3), left(:, :, 3), damping, stiffness, work, share)
            found = share < last
            if (found .or. .not. share < large) exit
            call correct(left(:, :, 3), value(:, 3), right(:, :, 3), transpose(damping), transpose(stiffness), work, share)
            if (.not. share < large) exit
         end do
         sum_of_values = 2*sum(value(:, 3)%re) + sum([(damping(i, i), i=1, size(scaling))])
         found = found .and. abs(sum_of_values) <= rounding*sum(abs(value(:, 3)))
      end associate
      self%misses = merge(0, self%misses + 1, found)
      if (found) call self%keep(parameter, scaling, damping)
   end subroutine advance

   !> One round for the right vectors x, with `other` the left ones, or for left vectors with right ones and transposed matrices.
   !> `share` is the square of the largest part that another vector has in a correction, or of an eigenvalue's relative change; if
   !> too large, nothing changes.
   pure subroutine correct(x, value, other, b, k, work, share)
      complex(wp), intent(inout) :: x(:, :), value(:), work(:, :, :)
      complex(wp), intent(in) :: other(:, :)
      real(wp), intent(in) :: b(:, :), k(:, :)
      real(wp), intent(out) :: share

      complex(wp), dimension(size(value)) :: gap, length, new
      integer :: j

      associate (residual => work(:, :, 1), rows => work(:, :, 2), own => work(:, :, 3), mirrored => work(:, :, 4), &
                 image => work(:, :, 5))
         residual = matmul(k, x)
         image = matmul(b, x)
         do j = 1, size(value)
            length(j) = sum(other(:, j)*(image(:, j) + 2*value(j)*x(:, j)))
            residual(:, j) = residual(:, j) + value(j)*(image(:, j) + value(j)*x(:, j))
         end do
         rows = transpose(other)
         own = matmul(rows, residual)
         rows = conjg(rows)
         mirrored = matmul(rows, residual)
         share = 0.0_wp
         do j = 1, size(value)
            gap = length*(value - value(j))
            gap(j) = length(j)*value(j)
            call divide(own(:, j), gap, share)
            new(j) = value(j) - own(j, j)*value(j)
            own(j, j) = (0.0_wp, 0.0_wp)
            call divide(mirrored(:, j), conjg(length)*(conjg(value) - value(j)), share)
         end do
         if (.not. share < large) return
         value = new
         image = matmul(x, own)
         rows = conjg(x)
         residual = matmul(rows, mirrored)
         x = x + image + residual
      end associate
   end subroutine correct

   !> Divide the parts of a correction by the distances of the eigenvalues, if they are small beside these.
   pure subroutine divide(part, gap, share)
      complex(wp), intent(inout) :: part(:)
      complex(wp), intent(in) :: gap(:)
      real(wp), intent(inout) :: share

      real(wp), dimension(size(part)) :: distance, size_of_part

      distance = gap%re**2 + gap%im**2
      size_of_part = part%re**2 + part%im**2
      if (all(size_of_part < large*distance)) then
         part = part*conjg(gap)*(1/distance)
         share = max(share, maxval(size_of_part/distance))
      else
         share = huge(share)
      end if
   end subroutine divide

end module razy_eigen_path
