!! The impulses of rigid contacts and friction in a step of the Moreau–Jean scheme.
!!
!! A rigid side takes part if its gap is closed in the middle of the step, g + h u/2 <= 0, or if it was closed in the last step, so
!! that rounding does not open contacts at rest. Friction has the coefficient of the speed and branch at the start of the step.
!!
!! A side that is parting when the step begins, u > 0, but pressed, comes back within the step and does no work: u⁺ + u >= 0 then
!! takes the place of u⁺ + ε u >= 0. So u⁺ + u <= 0 wherever λ > 0, and impulses never add energy (theta = 1/2, no friction, stops
!! that do not move). Without friction there always are impulses, as Σ ε u λ >= Σ u λ = 0 for all that are without effect
!! (razy_linalg_complementarity_friction); a body squeezed between moving stops, or jammed with friction, may have none.
module razy_integrate_moreau_impulses
   use razy_contact_contact_law, only: branch_lower, branch_upper
   use razy_core_kinds, only: wp
   use razy_integrate_moreau_state, only: friction_coefficient, moreau_step_t
   use razy_linalg_complementarity_friction, only: impact_effort_t, impact_solved, impact_swept, solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   implicit none(type, external)
   private

   public :: add_impulses

contains

   !> Add the effect of the impulses of rigid sides and friction to Δv; `force` and `branch` (contacts) are those of the
   !> compliant laws. Not `found`: no impulses obey the laws.
   subroutine add_impulses(self, force, branch, dv, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: force(:)
      integer, intent(in) :: branch(:)
      real(wp), intent(inout) :: dv(:)
      logical, intent(out) :: found

      real(wp) :: free(size(dv)), middle
      logical :: active(size(self%kinds%side))
      integer :: i

      free = dv
      do i = 1, size(active)
         associate (side => self%kinds%side(i))
            middle = dot_product(self%w(:, side%contact), self%q0 + 0.5_wp*self%h*self%v0) &
                     + self%start%s(side%contact) + 0.5_wp*self%h*self%start%rate(side%contact)
            active(i) = side%direction*(middle - side%edge) <= 0.0_wp .or. self%branch0(side%contact) == side%closed
         end associate
      end do
      call solve_for(self, force, branch, pack([(i, i=1, size(active))], active), free, dv, found)
   end subroutine add_impulses

   !> Δv from that without impulses, `free`, and the impulses of the sides `active` and of friction.
   subroutine solve_for(self, force, branch, active, free, dv, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: force(:), free(:)
      integer, intent(in) :: branch(:), active(:)
      real(wp), intent(out) :: dv(:)
      logical, intent(out) :: found

      type(impact_problem_t) :: problem
      type(impact_effort_t) :: effort
      integer :: contact(size(active) + size(self%kinds%friction)), i, n, outcome
      real(wp) :: direction(size(contact)), impulse(size(contact))

      found = .true.
      dv = free
      self%impulse = 0.0_wp
      self%bound = 0.0_wp
      call bound_friction(self, force, branch, active, problem)
      n = size(active)
      if (n == 0 .and. .not. any(problem%limit > 0.0_wp)) return
      contact = [self%kinds%side(active)%contact, self%kinds%friction]
      direction = 1.0_wp
      direction(:n) = self%kinds%side(active)%direction
      problem%delassus = self%delassus(contact, contact)
      do i = 1, size(contact)
         problem%delassus(:, i) = direction*problem%delassus(:, i)*direction(i)
      end do
      problem%drift = direction*(matmul(self%v0 + free, self%w(:, contact)) + self%finish%rate(contact))
      problem%before = direction(:n)*(matmul(self%v0, self%w(:, contact(:n))) + self%start%rate(contact(:n)))
      problem%restitution = merge(1.0_wp, self%kinds%side(active)%restitution, problem%before > 0.0_wp)
      call solve_impact(problem, impulse, outcome, effort)
      found = outcome == impact_solved .or. outcome == impact_swept
      if (.not. found) return
      do i = 1, size(contact)
         self%impulse(contact(i)) = self%impulse(contact(i)) + direction(i)*impulse(i)
         dv = dv + direction(i)*impulse(i)*self%response(:, contact(i))
         if (i > n) self%bound(contact(i)) = impulse_bound(problem, i - n, impulse)
      end do
   end subroutine solve_for

   !> Coefficients and given bounds of friction under the sides `active` and compliant forces.
   pure subroutine bound_friction(self, force, branch, active, problem)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: force(:)
      integer, intent(in) :: branch(:), active(:)
      type(impact_problem_t), intent(out) :: problem

      real(wp) :: rate, mu, normal
      integer :: k

      allocate (problem%coefficient(size(self%kinds%friction), size(active)), problem%limit(size(self%kinds%friction)))
      do k = 1, size(self%kinds%friction)
         associate (j => self%kinds%friction(k), contact => self%machine%contact(self%kinds%friction(k)))
            problem%coefficient(k, :) = 0.0_wp
            problem%limit(k) = 0.0_wp
            if (contact%only_with > 0) then
               if (.not. touching(self, contact%only_with, branch, active)) cycle
            end if
            rate = dot_product(self%w(:, j), self%v0) + self%start%rate(j)
            mu = friction_coefficient(contact, self%branch0(j), rate)
            normal = contact%normal
            if (contact%normal_of > 0) normal = normal + abs(force(contact%normal_of))
            problem%limit(k) = self%h*mu*max(0.0_wp, normal)
            problem%coefficient(k, :) = merge(mu, 0.0_wp, self%kinds%side(active)%contact == contact%normal_of)
         end associate
      end do
   end subroutine bound_friction

   !> Whether contact j is closed in the step: a rigid one takes part, a compliant one is neither open nor parting.
   pure function touching(self, j, branch, active)
      type(moreau_step_t), intent(in) :: self
      integer, intent(in) :: j, branch(:), active(:)
      logical :: touching

      if (self%machine%contact(j)%law%impacts) then
         touching = any(self%kinds%side(active)%contact == j)
      else
         touching = branch(j) == branch_upper .or. branch(j) == branch_lower
      end if
   end function touching

end module razy_integrate_moreau_impulses
