!! Impulses of a planar impact with friction as a linear complementarity problem, in the form of Stewart and Trinkle
!! (Int. J. Numer. Methods Engrg. 39 (1996) 2673–2691) with the two directions of sliding of the plane.
!!
!! With λ_T = β⁺ - β⁻ and the speed of sliding σ, the unknowns (λ_N, β⁺, β⁻, σ) >= 0 are complementary to
!!
!!      u_N + ε u_N⁻,    u_T + σ,    -u_T + σ,    limit + Σ μ λ_N - β⁺ - β⁻.
!!
!! The matrix is copositive, xᵀMx = λᵀGλ + σᵀμλ_N >= 0 for x >= 0, and a solution v for the right side 0 consists of impulses
!! without effect, W λ = 0 (a body jammed between stops). Then, without moving walls, qᵀv = Σ ε u_N⁻ λ_N + Σ limit σ. So Lemke's
!! method finds a solution if nothing is jammed, or ε = 0 (Anitescu and Potra, Nonlinear Dynamics 14 (1997) 231–247), or
!! there is one ε for all and no friction, as then Σ u_N⁻ λ_N = 0. Else there may be none.
!! A solution need not be the only one: only G λ is unique without friction (parallel stops share an impulse in many ways), and
!! with friction that is not small there can be several motions.
module razy_linalg_complementarity_friction
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_lemke, only: complementarity_solved, solve_complementarity
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual, target_of
   use razy_linalg_complementarity_gauss_seidel, only: sweep_impact
   implicit none(type, external)
   private

   public :: solve_impact

   !> Residual of the laws up to which impulses are accepted, and sweeps tried where pivots fail.
   real(wp), parameter :: accepted = 1.0e6_wp*epsilon(1.0_wp)
   integer, parameter :: most_sweeps = 20000

contains

   !> Impulses (n + m) by Lemke's method and, if that fails, by sweeps that start without impulse.
   pure subroutine solve_impact(problem, impulse, found)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(out) :: impulse(:)
      logical, intent(out) :: found

      real(wp) :: residual
      integer :: sweeps

      call pivot_impact(problem, impulse, found)
      if (found) found = impact_residual(problem, impulse) <= accepted
      if (found) return
      impulse = 0.0_wp
      call sweep_impact(problem, accepted, most_sweeps, impulse, residual, sweeps)
      found = residual <= accepted
   end subroutine solve_impact

   !> Impulses (n + m) by Lemke's method.
   pure subroutine pivot_impact(problem, impulse, found)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(out) :: impulse(:)
      logical, intent(out) :: found

      real(wp), allocatable :: matrix(:, :)
      real(wp), dimension(size(impulse) + 2*size(problem%limit)) :: q, z, w
      integer :: k, m, n, pivots, plus, minus, speed, status

      n = size(problem%before)
      m = size(problem%limit)
      plus = n
      minus = n + m
      speed = n + 2*m
      allocate (matrix(n + 3*m, n + 3*m), source=0.0_wp)
      matrix(:n + m, :n + m) = problem%delassus
      matrix(:n + m, minus + 1:speed) = -problem%delassus(:, n + 1:)
      matrix(minus + 1:speed, :n + m) = -problem%delassus(n + 1:, :)
      matrix(minus + 1:speed, minus + 1:speed) = problem%delassus(n + 1:, n + 1:)
      q(:n + m) = target_of(problem)
      q(minus + 1:speed) = -q(n + 1:n + m)
      q(speed + 1:) = problem%limit
      do k = 1, m
         matrix(plus + k, speed + k) = 1.0_wp
         matrix(minus + k, speed + k) = 1.0_wp
         matrix(speed + k, plus + k) = -1.0_wp
         matrix(speed + k, minus + k) = -1.0_wp
         matrix(speed + k, :n) = problem%coefficient(k, :)
      end do
      call solve_complementarity(matrix, q, z, w, status, pivots)
      found = status == complementarity_solved
      impulse = z(:n + m)
      impulse(n + 1:) = impulse(n + 1:) - z(minus + 1:speed)
   end subroutine pivot_impact

end module razy_linalg_complementarity_friction
