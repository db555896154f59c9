!! Impulses of a planar impact with friction from a guess, by Newton's method on the set of directions that act.
!!
!! In each round every direction is in one state of the laws of razy_linalg_complementarity_impact, as λ - u/G_ii of the last
!! impulses says: a normal one open (λ = 0) or closed (u = -ε u⁻), a tangential one at a bound (λ = ±r) or sticking (u = 0).
!! The linear equations of these states give the next impulses. This is the semismooth Newton method, or primal-dual active sets
!! (Hintermüller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865–888; for contact with friction Alart and Curnier, Comput. Methods
!! Appl. Mech. Engrg. 92 (1991) 353–375): one round from a guess with the right states, which the last step's impulses nearly
!! always have, and fast from near ones; from far it may cycle, and redundant contacts make the equations singular. So
!! it is tried for a few rounds, and what it finds counts only if it obeys the laws.
module razy_linalg_complementarity_active_set
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual, impulse_bound, target_of
   use razy_linalg_lapack, only: dgetrf, dgetrs
   implicit none(type, external)
   private

   public :: follow_active_set

   !> States of a direction: no impulse, velocity given, at the upper or lower bound of friction.
   integer, parameter :: inactive = 0, active = 1, forward = 2, backward = 3
   integer, parameter :: most_rounds = 8

contains

   !> Improve `impulse` (n + m) until its residual is at most `tolerance`, or for some rounds; `residual` is that of the result.
   subroutine follow_active_set(problem, tolerance, impulse, residual)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: tolerance
      real(wp), intent(inout) :: impulse(:)
      real(wp), intent(out) :: residual

      integer :: last(size(impulse)), round, state(size(impulse))
      logical :: solved

      last = -1
      residual = huge(1.0_wp)
      do round = 1, most_rounds
         state = states_at(problem, impulse)
         if (all(state == last)) exit
         call solve_states(problem, state, impulse, solved)
         if (.not. solved) exit
         residual = impact_residual(problem, impulse)
         if (residual <= tolerance) return
         last = state
      end do
      residual = impact_residual(problem, impulse)
   end subroutine follow_active_set

   !> The state of each direction under these impulses.
   pure function states_at(problem, impulse) result(state)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: impulse(:)
      integer :: state(size(impulse))

      real(wp) :: bound, u(size(impulse)), x
      integer :: i, n

      n = size(problem%before)
      u = target_of(problem) + matmul(problem%delassus, impulse)
      do i = 1, size(impulse)
         x = problem%delassus(i, i)*impulse(i) - u(i)
         if (i <= n) then
            state(i) = merge(active, inactive, x > 0.0_wp)
         else
            bound = problem%delassus(i, i)*impulse_bound(problem, i - n, impulse)
            state(i) = active
            if (x >= bound) state(i) = forward
            if (x <= -bound) state(i) = backward
            if (.not. bound > 0.0_wp) state(i) = inactive
         end if
      end do
   end function states_at

   !> The impulses that the states ask for; not `solved` if their equations are singular.
   subroutine solve_states(problem, state, impulse, solved)
      type(impact_problem_t), intent(in) :: problem
      integer, intent(in) :: state(:)
      real(wp), intent(inout) :: impulse(:)
      logical, intent(out) :: solved

      real(wp) :: matrix(size(state), size(state)), right(size(state)), sign
      integer :: i, info, n, pivot(size(state))

      n = size(problem%before)
      matrix = 0.0_wp
      right = 0.0_wp
      associate (q => target_of(problem))
         do i = 1, size(state)
            select case (state(i))
            case (active)
               matrix(i, :) = problem%delassus(i, :)
               right(i) = -q(i)
            case (inactive)
               matrix(i, i) = 1.0_wp
            case default
               sign = merge(1.0_wp, -1.0_wp, state(i) == forward)
               matrix(i, i) = 1.0_wp
               matrix(i, :n) = -sign*problem%coefficient(i - n, :)
               right(i) = sign*problem%limit(i - n)
            end select
         end do
      end associate
      call dgetrf(size(state), size(state), matrix, size(state), pivot, info)
      solved = info == 0
      if (.not. solved) return
      call dgetrs("N", size(state), 1, matrix, size(state), pivot, right, size(state), info)
      solved = all(ieee_is_finite(right))
      if (solved) impulse = right
   end subroutine solve_states

end module razy_linalg_complementarity_active_set
