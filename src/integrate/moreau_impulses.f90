!! The impulses of rigid contacts and friction in a step of the Moreau–Jean scheme.
!!
!! A rigid side takes part if its gap is closed in the middle of the step, g + h u/2 <= 0, or if it was closed in the last step
!! and would be so at the end of this one without impulses; so rounding does not open a contact at rest. If it is parting when the step
!! begins, u > 0, but pressed, it comes back within the step and does no work: u⁺ + u >= 0 then takes the place of
!! u⁺ + ε u >= 0. So u⁺ + u <= 0 wherever λ > 0, and impulses never add energy (theta = 1/2, stops that do not move), and without
!! friction there always are impulses, as Σ ε u λ >= Σ u λ = 0 for all that are without effect
!! (razy_linalg_complementarity_friction); a body squeezed between moving stops, or jammed with friction, may have none. Friction has the
!! coefficient of the speed and branch at the start of the step.
module razy_integrate_moreau_impulses
   use razy_core_kinds, only: wp
   use razy_integrate_moreau_state, only: friction_coefficient, moreau_step_t
   use razy_linalg_complementarity_friction, only: impact_effort_t, impact_solved, impact_swept, solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   implicit none(type, external)
   private

   public :: add_impulses

contains

   !> Add the effect of the impulses of rigid sides and friction to Δv; `force` (contacts) are the compliant forces. Not `found`:
   !> no impulses obey the laws.
   subroutine add_impulses(self, force, dv, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: force(:)
      real(wp), intent(inout) :: dv(:)
      logical, intent(out) :: found

      type(impact_problem_t) :: problem
      type(impact_effort_t) :: effort
      integer, allocatable :: active(:), contact(:)
      real(wp), allocatable :: direction(:), impulse(:)
      integer :: i, n, outcome

      found = .true.
      self%impulse = 0.0_wp
      self%bound = 0.0_wp
      call choose_active(self, force, dv, active, problem)
      n = size(active)
      contact = [self%kinds%side(active)%contact, self%kinds%friction]
      direction = [self%kinds%side(active)%direction, [(1.0_wp, i=1, size(self%kinds%friction))]]
      if (n == 0 .and. .not. any(problem%limit > 0.0_wp)) return
      problem%delassus = self%delassus(contact, contact)
      do i = 1, size(contact)
         problem%delassus(:, i) = direction*problem%delassus(:, i)*direction(i)
      end do
      problem%drift = direction*(matmul(self%v0 + dv, self%w(:, contact)) + self%finish%rate(contact))
      problem%before = direction(:n)*(matmul(self%v0, self%w(:, contact(:n))) + self%start%rate(contact(:n)))
      problem%restitution = merge(1.0_wp, self%kinds%side(active)%restitution, problem%before > 0.0_wp)
      allocate (impulse(size(contact)))
      call solve_impact(problem, impulse, outcome, effort)
      found = outcome == impact_solved .or. outcome == impact_swept
      if (.not. found) return
      do i = 1, size(contact)
         self%impulse(contact(i)) = self%impulse(contact(i)) + direction(i)*impulse(i)
         dv = dv + direction(i)*impulse(i)*self%response(:, contact(i))
         if (i > n) self%bound(contact(i)) = impulse_bound(problem, i - n, impulse)
      end do
   end subroutine add_impulses

   !> The rigid sides that take part, and the bounds of friction under them; `dv` (n) is Δv without impulses.
   pure subroutine choose_active(self, force, dv, active, problem)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: force(:), dv(:)
      integer, allocatable, intent(out) :: active(:)
      type(impact_problem_t), intent(out) :: problem

      real(wp) :: gap, rate, mu, normal
      logical :: closed(size(self%kinds%side))
      integer :: i, k

      do i = 1, size(closed)
         associate (side => self%kinds%side(i))
            gap = side%direction*(dot_product(self%w(:, side%contact), self%q0) + self%start%s(side%contact) - side%edge)
            rate = side%direction*(dot_product(self%w(:, side%contact), self%v0) + self%start%rate(side%contact))
            closed(i) = gap + 0.5_wp*self%h*rate <= 0.0_wp
            if (closed(i) .or. self%branch0(side%contact) /= side%closed) cycle
            gap = side%direction*(dot_product(self%w(:, side%contact), self%q0 + self%h*(self%v0 + self%theta*dv)) &
                                  + self%finish%s(side%contact) - side%edge)
            closed(i) = gap <= 0.0_wp
         end associate
      end do
      active = pack([(i, i=1, size(closed))], closed)
      allocate (problem%coefficient(size(self%kinds%friction), size(active)), problem%limit(size(self%kinds%friction)))
      do k = 1, size(self%kinds%friction)
         associate (j => self%kinds%friction(k), contact => self%machine%contact(self%kinds%friction(k)))
            rate = dot_product(self%w(:, j), self%v0) + self%start%rate(j)
            mu = friction_coefficient(contact, self%branch0(j), rate)
            normal = contact%normal
            if (contact%normal_of > 0) normal = normal + abs(force(contact%normal_of))
            problem%limit(k) = self%h*mu*max(0.0_wp, normal)
            problem%coefficient(k, :) = merge(mu, 0.0_wp, self%kinds%side(active)%contact == contact%normal_of)
         end associate
      end do
   end subroutine choose_active

end module razy_integrate_moreau_impulses
