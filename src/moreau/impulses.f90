!! The impulses of rigid contacts and friction in a step of the Moreau–Jean scheme.
!!
!! A rigid side takes part if its gap is closed in the middle of the step, g + h u/2 <= 0, or if it was closed in the last step, so
!! that rounding does not open contacts at rest. Friction has the coefficient of the speed and branch at the start of the step.
!!
!! A side that is parting when the step begins, u > 0, but pressed, comes back within the step and does no work: u⁺ + u >= 0 then
!! takes the place of u⁺ + ε u >= 0. So u⁺ + u <= 0 wherever λ > 0, and impulses never add energy (theta = 1/2, no friction, stops
!! that do not move). Without friction there always are impulses, as Σ ε u λ >= Σ u λ = 0 for all that are without effect
!! (razy_linalg_complementarity_friction); a body squeezed between moving stops, or jammed with friction, may have none.
!!
!! The last step's impulses are where the next ones are looked for (razy_linalg_complementarity_parts), and the matrix of the
!! problem is kept as long as the same sides take part.
module razy_moreau_impulses
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_friction, only: impact_effort_t, impact_solved, impact_swept
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   use razy_linalg_complementarity_parts, only: continue_impact
   use razy_moreau_state, only: friction_coefficient, moreau_step_t
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

      type(impact_effort_t) :: effort
      integer :: i, j, n, outcome

      found = .true.
      call list_directions(self)
      associate (work => self%work, problem => self%work%problem, impulse => self%work%impulse(:self%work%count &
                                                                                               + size(self%kinds%friction)))
         n = work%count
         do i = 1, size(impulse)
            j = work%contact(i)
            impulse(i) = work%sign(i)*self%impulse(j)
            if (i <= n) impulse(i) = max(0.0_wp, impulse(i))
         end do
         self%impulse = 0.0_wp
         self%bound = 0.0_wp
         call bound_friction(self, force, branch)
         if (n == 0 .and. .not. any(problem%limit > 0.0_wp)) return
         call find_velocities(self, dv)
         call continue_impact(problem, impulse, outcome, effort)
         found = outcome == impact_solved .or. outcome == impact_swept
         if (.not. found) return
         do i = 1, size(impulse)
            j = work%contact(i)
            if (i > n) self%bound(j) = impulse_bound(problem, i - n, impulse)
            if (.not. abs(impulse(i)) > 0.0_wp) cycle
            self%impulse(j) = self%impulse(j) + work%sign(i)*impulse(i)
            dv = dv + work%sign(i)*impulse(i)*self%response(:, j)
         end do
      end associate
   end subroutine add_impulses

   !> List the sides that take part, and form the matrix of the problem if they or the factors are not those of the last one.
   subroutine list_directions(self)
      type(moreau_step_t), intent(inout) :: self

      real(wp) :: middle
      integer :: i, k, n

      associate (work => self%work, problem => self%work%problem, friction => self%kinds%friction)
         n = 0
         do i = 1, size(self%kinds%side)
            associate (side => self%kinds%side(i))
               middle = dot_product(self%w(:, side%contact), self%q0) + self%start%s(side%contact) &
                        + 0.5_wp*self%h*(dot_product(self%w(:, side%contact), self%v0) + self%start%rate(side%contact))
               if (side%direction*(middle - side%edge) > 0.0_wp .and. self%branch0(side%contact) /= side%closed) cycle
            end associate
            n = n + 1
            work%active(n) = i
         end do
         if (n == work%count .and. work%factorisation == self%factorisations) then
            if (all(work%active(:n) == work%listed(:n))) return
         end if
         work%count = n
         work%listed(:n) = work%active(:n)
         work%factorisation = self%factorisations
         do i = 1, n
            work%contact(i) = self%kinds%side(work%active(i))%contact
            work%sign(i) = self%kinds%side(work%active(i))%direction
         end do
         do i = 1, size(friction)
            work%contact(n + i) = friction(i)
            work%sign(n + i) = 1.0_wp
         end do
         call size_problem(problem, n, size(friction))
         do k = 1, n + size(friction)
            do i = 1, n + size(friction)
               problem%delassus(i, k) = work%sign(i)*self%delassus(work%contact(i), work%contact(k))*work%sign(k)
            end do
         end do
      end associate
   end subroutine list_directions

   !> Room for n normal and m tangential directions.
   pure subroutine size_problem(problem, n, m)
      type(impact_problem_t), intent(inout) :: problem
      integer, intent(in) :: n, m

      if (allocated(problem%drift)) then
         if (size(problem%before) == n .and. size(problem%limit) == m) return
         deallocate (problem%delassus, problem%drift, problem%before, problem%restitution, problem%coefficient, problem%limit)
      end if
      allocate (problem%delassus(n + m, n + m), problem%drift(n + m), problem%before(n), problem%restitution(n), &
                problem%coefficient(m, n), problem%limit(m))
   end subroutine size_problem

   !> Velocities of the problem: before the step, and after it with Δv alone.
   pure subroutine find_velocities(self, dv)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: dv(:)

      real(wp) :: before
      integer :: i

      associate (work => self%work, problem => self%work%problem)
         do i = 1, size(problem%drift)
            associate (j => work%contact(i))
               before = dot_product(self%v0, self%w(:, j))
               problem%drift(i) = work%sign(i)*(before + dot_product(dv, self%w(:, j)) + self%finish%rate(j))
               if (i > work%count) cycle
               before = work%sign(i)*(before + self%start%rate(j))
               problem%before(i) = before
               problem%restitution(i) = 1.0_wp
               if (.not. before > 0.0_wp) problem%restitution(i) = self%kinds%side(work%active(i))%restitution
            end associate
         end do
      end associate
   end subroutine find_velocities

   !> Coefficients and given bounds of friction under the active sides and compliant forces.
   pure subroutine bound_friction(self, force, branch)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: force(:)
      integer, intent(in) :: branch(:)

      real(wp) :: rate, mu, normal
      integer :: i, k

      associate (problem => self%work%problem, work => self%work)
         do k = 1, size(self%kinds%friction)
            associate (j => self%kinds%friction(k), contact => self%machine%contact(self%kinds%friction(k)))
               problem%coefficient(k, :) = 0.0_wp
               problem%limit(k) = 0.0_wp
               if (contact%only_with > 0) then
                  if (.not. touching(self, contact%only_with, branch)) cycle
               end if
               rate = dot_product(self%w(:, j), self%v0) + self%start%rate(j)
               mu = friction_coefficient(contact, self%branch0(j), rate)
               normal = contact%normal
               if (contact%normal_of > 0) normal = normal + abs(force(contact%normal_of))
               problem%limit(k) = self%h*mu*max(0.0_wp, normal)
               do i = 1, work%count
                  if (work%contact(i) == contact%normal_of) problem%coefficient(k, i) = mu
               end do
            end associate
         end do
      end associate
   end subroutine bound_friction

   !> Whether contact j is closed in the step: a rigid one takes part, a compliant one is neither open nor parting.
   pure function touching(self, j, branch)
      type(moreau_step_t), intent(in) :: self
      integer, intent(in) :: j, branch(:)
      logical :: touching

      if (self%machine%contact(j)%law%impacts) then
         touching = any(self%work%contact(:self%work%count) == j)
      else
         touching = self%machine%contact(j)%law%branch(branch(j))%closed
      end if
   end function touching

end module razy_moreau_impulses
