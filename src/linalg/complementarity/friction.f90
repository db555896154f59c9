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
!! there is one ε for all and no friction, as then Σ u_N⁻ λ_N = 0. Else there may be none; this is a status.
!! A solution need not be the only one: only G λ is unique without friction (parallel stops share an impulse in many ways), and
!! with friction that is not small there can be several motions.
module razy_linalg_complementarity_friction
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_lemke, only: complementarity_ray, complementarity_solved, solve_complementarity
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual, target_of
   use razy_linalg_complementarity_gauss_seidel, only: sweep_impact
   implicit none(type, external)
   private

   public :: impact_effort_t, solve_impact
   public :: impact_solved, impact_swept, impact_none, impact_not_found

   !> How a problem ended: solved by pivots; solved by sweeps, as pivots failed; proved unsolvable (ray, where the properties
   !> above hold) and not solved by sweeps either; not found by either for rounding or too many steps.
   integer, parameter :: impact_solved = 0, impact_swept = 1, impact_none = 2, impact_not_found = 3

   !> Residual of the laws up to which impulses are accepted, and sweeps tried where pivots fail.
   real(wp), parameter :: accepted = 1.0e6_wp*epsilon(1.0_wp)
   integer, parameter :: most_sweeps = 20000

   !> What a solution took: pivots, sweeps, and its residual.
   type :: impact_effort_t
      integer :: pivots = 0, sweeps = 0
      real(wp) :: residual = 0.0_wp
   end type impact_effort_t

contains

   !> Impulses (n + m) by Lemke's method and, if that fails, by sweeps that start without impulse.
   pure subroutine solve_impact(problem, impulse, status, effort)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(out) :: impulse(:)
      integer, intent(out) :: status
      type(impact_effort_t), intent(out) :: effort

      integer :: ended

      call pivot_impact(problem, impulse, ended, effort%pivots)
      effort%residual = impact_residual(problem, impulse)
      status = impact_solved
      if (ended == complementarity_solved .and. effort%residual <= accepted) return
      impulse = 0.0_wp
      call sweep_impact(problem, accepted, most_sweeps, impulse, effort%residual, effort%sweeps)
      status = impact_swept
      if (effort%residual <= accepted) return
      status = merge(impact_none, impact_not_found, ended == complementarity_ray)
   end subroutine solve_impact

   !> Impulses (n + m) by Lemke's method; `status` is that of razy_linalg_complementarity_lemke.
   pure subroutine pivot_impact(problem, impulse, status, pivots)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(out) :: impulse(:)
      integer, intent(out) :: status, pivots

      real(wp), allocatable :: matrix(:, :)
      real(wp), dimension(size(impulse) + 2*size(problem%limit)) :: q, z, w
      integer :: k, m, n, plus, minus, speed

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
      impulse = z(:n + m)
      impulse(n + 1:) = impulse(n + 1:) - z(minus + 1:speed)
   end subroutine pivot_impact

end module razy_linalg_complementarity_friction
