!! Impulses of a planar impact with friction by projected Gauss–Seidel sweeps.
!!
!! Each direction in turn gets the impulse that its law asks for while the others are held. Known convergence: if all bounds of
!! friction are given (coefficients zero or no friction at all), this is coordinate descent on a convex quadratic function
!! between bounds, which converges for every symmetric positive semidefinite G with positive diagonal, in the end linearly (Luo and
!! Tseng, SIAM J. Control Optim. 30 (1992) 408–425). With friction pressed by contacts it converges for small coefficients
!! (the step is then a contraction) and usually otherwise, without proof: Jourdan, Alart and Jean, Comput. Methods Appl.
!! Mech. Engrg. 155 (1998) 31–47. Impulses that are not unique depend on the start; the velocities without friction do not.
module razy_linalg_complementarity_seidel
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual, impulse_bound, target_of
   implicit none(type, external)
   private

   public :: sweep_impact

   !> Most sweeps between two looks at the residual.
   integer, parameter :: sweeps_a_look = 16

contains

   !> Improve `impulse` (n + m), which gives the start, until the residual of the laws is at most `tolerance`, `most_sweeps` are
   !> done or nothing moves; velocities follow every change, so that what rests costs nothing. `residual` is that
   !> of the result, `sweeps` the number done.
   pure subroutine sweep_impact(problem, tolerance, most_sweeps, impulse, residual, sweeps)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: most_sweeps
      real(wp), intent(inout) :: impulse(:)
      real(wp), intent(out) :: residual
      integer, intent(out) :: sweeps

      real(wp) :: q(size(impulse)), u(size(impulse)), g, bound, largest, moved, next
      integer :: i, n

      n = size(problem%before)
      q = target_of(problem)
      sweeps = 0
      residual = impact_residual(problem, impulse)
      if (.not. residual > tolerance) return
      largest = maxval(abs(q))
      u = q
      do i = 1, size(impulse)
         if (abs(impulse(i)) > 0.0_wp) u = u + problem%delassus(:, i)*impulse(i)
      end do
      do while (residual > tolerance .and. sweeps < most_sweeps)
         moved = 0.0_wp
         do i = 1, size(impulse)
            g = problem%delassus(i, i)
            if (.not. g > 0.0_wp) cycle
            next = impulse(i) - u(i)/g
            if (i <= n) then
               next = max(0.0_wp, next)
            else
               bound = impulse_bound(problem, i - n, impulse)
               next = max(-bound, min(bound, next))
            end if
            if (.not. abs(next - impulse(i)) > 0.0_wp) cycle
            moved = max(moved, g*abs(next - impulse(i)))
            u = u + problem%delassus(:, i)*(next - impulse(i))
            impulse(i) = next
         end do
         sweeps = sweeps + 1
         if (moved <= tolerance*largest .or. modulo(sweeps, sweeps_a_look) == 0 .or. sweeps == most_sweeps) then
            residual = impact_residual(problem, impulse)
            if (.not. moved > 0.0_wp) return
         end if
      end do
   end subroutine sweep_impact

end module razy_linalg_complementarity_seidel
