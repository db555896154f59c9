!! Complementarity between bounds: w = M z + q, lower <= z <= upper, and
!! w >= 0 where z = lower, w <= 0 where z = upper, w = 0 between.
!!
!! It is brought to the standard form: z = lower + x (z = upper - x without a lower bound, z = x - x' without any) and, for a
!! second bound, one more unknown for the negative part of w. The enlarged matrix is positive semidefinite if M is, copositive
!! if M is and every lower bound is finite, and then keeps the properties of razy_linalg_complementarity_lemke. Coulomb friction
!! under a given normal force is of this form: sliding velocity w, friction force z between its bounds.
module razy_linalg_complementarity_box
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_lemke, only: complementarity_not_finite, complementarity_solved, solve_complementarity
   implicit none(type, external)
   private

   public :: solve_box_complementarity

contains

   !> Solve the problem. `matrix` (n, n), `q` (n); `lower` <= `upper` (n), finite or infinite; `z`, `w` (n) are zero unless `status`
   !> is `complementarity_solved`; bounds that cross or are no numbers give `complementarity_not_finite`.
   pure subroutine solve_box_complementarity(matrix, q, lower, upper, z, w, status, pivots)
      real(wp), intent(in) :: matrix(:, :), q(:), lower(:), upper(:)
      real(wp), intent(out) :: z(:), w(:)
      integer, intent(out) :: status, pivots

      real(wp), allocatable :: large(:, :), right(:), x(:), slack(:), factor(:), base(:)
      integer, allocatable :: variable(:)
      logical :: below(size(q)), above(size(q))
      integer :: i, j, k, m, n

      n = size(q)
      z = 0.0_wp
      w = 0.0_wp
      pivots = 0
      status = complementarity_not_finite
      if (any(ieee_is_nan(lower)) .or. any(ieee_is_nan(upper))) return
      if (.not. (all(lower <= upper) .and. all(lower < huge(1.0_wp)) .and. all(upper > -huge(1.0_wp)))) return
      below = ieee_is_finite(lower)
      above = ieee_is_finite(upper)
      base = merge(lower, merge(upper, 0.0_wp, above), below)

      ! x(k) moves the unknown variable(k) by factor(k).
      variable = [(i, i=1, n), pack([(i, i=1, n)],.not. (below .or. above))]
      m = size(variable)
      allocate (factor(m))
      factor(:n) = merge(-1.0_wp, 1.0_wp, above .and. .not. below)
      factor(n + 1:) = -1.0_wp
      k = count(below .and. above)
      allocate (large(m + k, m + k), source=0.0_wp)
      allocate (right(m + k), x(m + k), slack(m + k))
      do j = 1, m
         large(:m, j) = factor*matrix(variable, variable(j))*factor(j)
      end do
      right(:m) = factor*(q(variable) + matmul(matrix(variable, :), base))
      k = m
      do i = 1, n
         if (.not. (below(i) .and. above(i))) cycle
         k = k + 1
         large(i, k) = 1.0_wp
         large(k, i) = -1.0_wp
         right(k) = upper(i) - lower(i)
      end do
      call solve_complementarity(large, right, x, slack, status, pivots)
      if (status /= complementarity_solved) return
      z = base
      do j = 1, m
         z(variable(j)) = z(variable(j)) + factor(j)*x(j)
      end do
      k = m
      w = factor(:n)*slack(:n)
      do i = 1, n
         if (.not. (below(i) .and. above(i))) cycle
         k = k + 1
         w(i) = slack(i) - x(k)
         z(i) = min(z(i), upper(i))
      end do
   end subroutine solve_box_complementarity

end module razy_linalg_complementarity_box
