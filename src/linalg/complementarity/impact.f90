!! The planar problem of impacts and friction: impulses of unilateral contacts and of Coulomb friction.
!!
!! There are n normal and m tangential directions w with the relative velocities u = drift + G λ, where λ are impulses and
!! G = Wᵀ M⁻¹ W is the Delassus matrix. The laws are those of Moreau, Newton and Coulomb, on the level of impulses:
!!
!!     0 <= λ_i  ⟂  u_i + ε_i u_i⁻ >= 0                                          normal directions
!!     |λ_k| <= r_k = limit_k + Σ_i μ_ki λ_i,   λ_k = -r_k sign(u_k) if u_k /= 0     tangential directions
!!
!! Sources: Moreau, in Nonsmooth Mechanics and Applications, CISM 302 (1988); Glocker, Set-Valued Force Laws, Springer (2001).
!! How it is solved: razy_linalg_complementarity_friction and razy_linalg_complementarity_gauss_seidel.
module razy_linalg_complementarity_impact
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: impact_problem_t, impact_residual, impulse_bound, target_of

   !> A problem of n normal and m tangential directions, the normal ones first.
   type :: impact_problem_t
      !> G (n + m, n + m), 1/kg, positive semidefinite, and the directions it is formed of, if the caller keeps them here.
      real(wp), allocatable :: delassus(:, :), direction(:, :)
      !> Velocities without any impulse (n + m), m/s.
      real(wp), allocatable :: drift(:)
      !> Velocities u⁻ before the impact and coefficients of restitution (n).
      real(wp), allocatable :: before(:), restitution(:)
      !> Friction in each tangential direction: coefficients of the normal impulses (m, n), and the largest impulse without
      !> any of these (m), N s: a given normal force times coefficient and time; neither is negative.
      real(wp), allocatable :: coefficient(:, :), limit(:)
   end type impact_problem_t

contains

   !> Right side (n + m) of the laws: drift + ε u⁻ for normal, drift for tangential directions.
   pure function target_of(problem) result(q)
      type(impact_problem_t), intent(in) :: problem
      real(wp) :: q(size(problem%drift))

      integer :: n

      n = size(problem%before)
      q = problem%drift
      q(:n) = q(:n) + problem%restitution*problem%before
   end function target_of

   !> Largest friction impulse in the tangential direction k under the impulses λ.
   pure function impulse_bound(problem, k, impulse) result(bound)
      type(impact_problem_t), intent(in) :: problem
      integer, intent(in) :: k
      real(wp), intent(in) :: impulse(:)
      real(wp) :: bound

      bound = problem%limit(k) + dot_product(problem%coefficient(k, :), max(0.0_wp, impulse(:size(problem%before))))
   end function impulse_bound

   !> How far impulses λ are from obeying the laws: the largest |λ_i - projection(λ_i - u_i/G_ii)| G_ii, or distance from the
   !> bounds where G_ii = 0, m/s, divided by the largest term of the velocities.
   pure function impact_residual(problem, impulse) result(residual)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: impulse(:)
      real(wp) :: residual

      real(wp) :: u(size(impulse)), largest, g, bound
      integer :: i, n

      n = size(problem%before)
      u = target_of(problem)
      largest = maxval(abs(problem%drift))
      if (n > 0) largest = max(largest, maxval(abs(problem%restitution*problem%before)))
      do i = 1, size(impulse)
         largest = max(largest, maxval(abs(problem%delassus(:, i)*impulse(i))))
         u = u + problem%delassus(:, i)*impulse(i)
      end do
      residual = 0.0_wp
      do i = 1, size(impulse)
         g = problem%delassus(i, i)
         if (i <= n) then
            residual = max(residual, abs(g*impulse(i) - max(0.0_wp, g*impulse(i) - u(i))))
         else
            bound = g*impulse_bound(problem, i - n, impulse)
            residual = max(residual, abs(g*impulse(i) - max(-bound, min(bound, g*impulse(i) - u(i)))))
         end if
      end do
      if (largest > 0.0_wp) residual = residual/largest
   end function impact_residual

end module razy_linalg_complementarity_impact
