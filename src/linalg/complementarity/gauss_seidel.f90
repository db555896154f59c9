!! Impulses of a planar impact with friction by projected Gauss–Seidel sweeps.
!!
!! Each direction in turn gets the impulse that its law asks for while the others stay. Known convergence: if all bounds of
!! friction are given (coefficients zero or no friction at all), this is coordinate descent on a convex quadratic function
!! between bounds, which converges for every symmetric positive semidefinite G with positive diagonal, in the end linearly (Luo and
!! Tseng, SIAM J. Control Optim. 30 (1992) 408–425). With friction pressed by contacts it converges for small coefficients
!! (the step is then a contraction) and usually otherwise, without proof: Jourdan, Alart and Jean, Comput. Methods Appl.
!! Mech. Engrg. 155 (1998) 31–47. Impulses that are not unique depend on the start; the velocities without friction do not.
module razy_linalg_complementarity_gauss_seidel
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual, impulse_bound, target_of
   implicit none(type, external)
   private

   public :: sweep_impact

   !> Most sweeps between two looks at the residual.
   integer, parameter :: sweeps_a_look = 16

contains

   !> Improve `impulse` (n + m), which gives the start, by at least one sweep, until the residual of the laws is at most
   !> `tolerance`, `most_sweeps` are done or nothing moves. `residual` is that of the result, `sweeps` the number done.
   !>
   !> `others` holds for each direction its velocity without its own impulse and follows every change: what rests costs nothing,
   !> and a direction that no other acts on gets the same impulse from any start, to the last bit.
   pure subroutine sweep_impact(problem, tolerance, most_sweeps, impulse, residual, sweeps)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: most_sweeps
      real(wp), intent(inout) :: impulse(:)
      real(wp), intent(out) :: residual
      integer, intent(out) :: sweeps

      real(wp) :: others(size(impulse)), bound, change, g, largest, moved, next
      integer :: i, n

      n = size(problem%before)
      others = target_of(problem)
      largest = maxval(abs(others))
      do i = 1, size(impulse)
         if (abs(impulse(i)) > 0.0_wp) call act(problem, i, impulse(i), others)
      end do
      residual = huge(1.0_wp)
      do sweeps = 1, most_sweeps
         moved = 0.0_wp
         do i = 1, size(impulse)
            g = problem%delassus(i, i)
            if (.not. g > 0.0_wp) cycle
            next = -others(i)/g
            if (i <= n) then
               next = max(0.0_wp, next)
            else
               bound = impulse_bound(problem, i - n, impulse)
               next = max(-bound, min(bound, next))
            end if
            change = next - impulse(i)
            if (.not. abs(change) > 0.0_wp) cycle
            moved = max(moved, g*abs(change))
            call act(problem, i, change, others)
            impulse(i) = next
         end do
         if (moved > tolerance*largest .and. modulo(sweeps, sweeps_a_look) > 0 .and. sweeps < most_sweeps) cycle
         residual = impact_residual(problem, impulse)
         if (residual <= tolerance .or. .not. moved > 0.0_wp) return
      end do
      sweeps = most_sweeps
   end subroutine sweep_impact

   !> What a change of impulse i does to the others.
   pure subroutine act(problem, i, change, others)
      type(impact_problem_t), intent(in) :: problem
      integer, intent(in) :: i
      real(wp), intent(in) :: change
      real(wp), intent(inout) :: others(:)

      real(wp) :: own

      own = others(i)
      others = others + problem%delassus(:, i)*change
      others(i) = own
   end subroutine act

end module razy_linalg_complementarity_gauss_seidel
