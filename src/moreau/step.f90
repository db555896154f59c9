!! One step of the Moreau–Jean scheme with theta-method, in the coordinates of the system, where M = 1.
!!
!! With v_θ = v + θ Δv and q_θ = q + θ h v_θ, a step of length h from (q, v) is
!!
!!     Δv + h B v_θ + h K q_θ = h f(t + θh) - h Σ w_j F_j(s_j⁺, s_j'⁺) + Σ w λ,    q⁺ = q + h v_θ,  v⁺ = v + Δv,
!!
!! where F_j are the compliant laws and λ the impulses of rigid contacts and friction elements. A rigid side takes part if its gap
!! is closed in the middle of the step, g + h u/2 <= 0, or was so in the last one, so that rounding does not open contacts at rest;
!! it obeys 0 <= u⁺ + ε u ⟂ λ >= 0. Friction obeys Coulomb's law in s'⁺, with the coefficient of the speed and branch at the start.
!! Source: Jean, Comput. Methods Appl. Mech. Engrg. 177 (1999) 235–257; Acary and Brogliato, Numerical Methods for Nonsmooth
!! Dynamical Systems, Springer (2008), 10.
!!
!! A side that is parting when the step begins, u > 0, but pressed, comes back within the step and does no work: u⁺ + u >= 0 then
!! takes the place of u⁺ + ε u >= 0. So u⁺ + u <= 0 wherever λ > 0, and impulses never add energy (no friction, stops
!! that do not move). Without friction there always are impulses, as Σ ε u λ >= Σ u λ = 0 for all that are without effect
!! (razy_linalg_complementarity_friction); a body squeezed between moving stops, or jammed with friction, may have none.
!!
!! Compliant laws take s and s' at the end of the step: an elastic force that grows with s then takes at least the energy that
!! it stores, U(s⁺) - U(s) <= F(s⁺) (s⁺ - s), however stiff it is, and a stiff damper stops the motion; their order is 1. The
!! equations are solved by Newton's method in Δv, with a problem of impulses in every round. If branches go on changing (a force
!! that jumps has no solution at the jump itself) they are kept after some rounds.
module razy_moreau_step
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_active_sides, only: find_sides, set_up, side_t
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_impact, only: coefficient
   use razy_hybrid_system, only: system_t
   use razy_linalg_complementarity_friction, only: solve_impact
   use razy_linalg_complementarity_gauss_seidel, only: sweep_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   use razy_linalg_dense, only: identity
   use razy_linalg_lapack, only: dgetrf, dgetrs
   implicit none(type, external)
   private

   public :: moreau_step_t

   !> With 1/2 smooth motion has an error of order 2, and impulses add no energy.
   real(wp), parameter :: theta = 0.5_wp

   !> The scheme: the last step with both its ends, and the matrices of its equations.
   type :: moreau_step_t
      real(wp) :: h = 0.0_wp
      !> Excitation from the start of the step, and s, s' and branches of the contacts as they were looked at last; no contact acts.
      type(dynamics_t) :: dynamics
      !> Δv of the step and the size of its terms (m).
      real(wp), allocatable :: dv(:), terms(:)
      !> Of each contact: force F at start and end.
      real(wp), allocatable :: force0(:), force1(:)
      integer(i8) :: rounds = 0, factorisations = 0, impacts = 0
      !> State at the start of the step (2m).
      real(wp), allocatable, private :: z0(:)
      !> Of each contact: s, s' and branch at the start; impulse along w in the step, and the largest one that friction can give.
      real(wp), allocatable, private :: s0(:), rate0(:), impulse(:), bound(:)
      integer, allocatable, private :: branch0(:)
      !> Contacts whose laws are forces: neither rigid nor friction.
      integer, allocatable :: compliant(:)
      !> Sides that take part (the first `sides`), and friction elements.
      type(side_t), allocatable, private :: side(:)
      integer, private :: sides = 0
      integer, allocatable, private :: friction(:)
      !> Slopes of the compliant laws and step of which `factor` (m, m) is; factor⁻¹ w (m, contacts).
      real(wp), allocatable, private :: stiffness(:), damping(:), factor(:, :), response(:, :)
      integer, allocatable, private :: pivot(:)
      real(wp), private :: h_of_factor = -1.0_wp
   contains
      procedure :: begin
      procedure :: take
   end type moreau_step_t

   !> Rounds of Newton's method before branches are kept, and at all; change of Δv, by kinetic energy, that ends it.
   integer, parameter :: free_rounds = 8, most_rounds = 60
   real(wp), parameter :: converged = 1.0e-12_wp
   !> A sliding velocity below this part of its terms is none, and an impulse of friction within it is at its bound.
   real(wp), parameter :: standing = 1.0e-12_wp
   !> Of a sum of speeds.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
   !> Sweeps from the impulses of the last step that are tried before pivots.
   integer, parameter :: few_sweeps = 16

contains

   !> The motion begins at z (2m), with the contacts in these branches.
   subroutine begin(self, system, z, branch)
      class(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:)
      integer, intent(in) :: branch(:)

      real(wp) :: none(size(branch))
      integer :: i
      logical :: compliant(size(branch)), of_normal(size(branch))

      do i = 1, size(branch)
         associate (law => system%machine%contact(i)%law)
            of_normal(i) = law%of_normal
            compliant(i) = .not. (law%impacts .or. law%of_normal)
         end associate
      end do
      self%friction = pack([(i, i=1, size(branch))], of_normal)
      self%compliant = pack([(i, i=1, size(branch))], compliant)
      call self%dynamics%make_room(system, 0.0_wp)
      self%dynamics%mode%branch = branch
      call self%dynamics%excitation%begin(system%machine%tone, 0.0_wp, 0.0_wp)
      if (allocated(self%side)) deallocate (self%side)
      allocate (self%side(2*size(branch)))
      none = 0.0_wp
      self%impulse = none
      self%bound = none
      self%stiffness = none
      self%damping = none
      self%h = 0.0_wp
      self%h_of_factor = -1.0_wp
      self%force1 = none
      call self%dynamics%look_at_contacts(system, 0.0_wp, z)
      call end_forces(self, system)
      self%rounds = 0
      self%factorisations = 0
      self%impacts = 0
   end subroutine begin

   !> One step of length h, s, from z (2m), which becomes its end, and from where `dynamics%excitation` has begun. Not `found`: no
   !> impulses obey the laws, or Newton's method does not converge.
   subroutine take(self, system, h, z, found)
      class(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: found

      real(wp), dimension(system%m) :: next, rest
      real(wp) :: none(size(self%bound)), change
      integer, allocatable :: turns(:)
      integer :: before(size(self%bound)), j, round
      logical :: first, nowhere(2, size(self%bound)), piecewise_linear

      first = .not. self%h > 0.0_wp
      self%h = h
      self%z0 = z
      self%dv = 0.0_wp*z(:system%m)
      self%force0 = self%force1
      associate (dynamics => self%dynamics)
         call dynamics%look_at_contacts(system, 0.0_wp, z)
         self%s0 = dynamics%s
         self%rate0 = dynamics%rate
         self%branch0 = dynamics%mode%branch
         none = 0.0_wp
         nowhere = .false.
         call find_sides(system%machine%contact, self%s0 + 0.5_wp*h*self%rate0, self%rate0, none, none, self%branch0, nowhere, &
                         nowhere(1, :), self%side, self%sides)
         do j = 1, size(none)
            if (system%machine%contact(j)%law%impacts) dynamics%mode%branch(j) = branch_open
         end do
         do j = 1, self%sides
            dynamics%mode%branch(self%side(j)%contact) = self%side(j)%closed
         end do
         call dynamics%accelerate(system, theta*h, middle(self), rest)
         rest = h*rest
         call look_at_end(self, system, .true.)
         piecewise_linear = all([(system%machine%contact(j)%law%piecewise_linear .or. .not. any(self%compliant == j), &
                                  j=1, size(none))])
         do round = 1, most_rounds
            self%rounds = self%rounds + 1
            call newton_round(self, system, rest, next, found)
            if (.not. found) return
            change = norm2(next - self%dv)
            self%dv = next
            before = dynamics%mode%branch
            call look_at_end(self, system, round < free_rounds)
            found = change <= converged*(norm2(z(system%m + 1:)) + norm2(self%dv)) &
                    .or. (piecewise_linear .and. all(dynamics%mode%branch(self%compliant) == before(self%compliant)))
            if (.not. found) cycle
            ! Friction that turns round comes through rest, where it may stick with more than it slides with.
            turns = pack(self%friction, self%branch0(self%friction) /= branch_sticking &
                         .and. self%rate0(self%friction)*dynamics%rate(self%friction) < 0.0_wp)
            if (size(turns) == 0) exit
            self%branch0(turns) = branch_sticking
         end do
         if (.not. found) return
         call look_at_end(self, system, .true.)
      end associate
      z = state_after(self)
      call end_branches(self, system)
      call end_forces(self, system)
      if (first) call guess_first_forces(self, system)
   end subroutine take

   !> The state (2m) at θh without forces.
   pure function middle(self) result(z)
      type(moreau_step_t), intent(in) :: self
      real(wp) :: z(size(self%z0))

      associate (m => size(self%dv))
         z = self%z0
         z(:m) = z(:m) + theta*self%h*z(m + 1:)
      end associate
   end function middle

   !> The state (2m) at the end of the step with Δv as it is.
   pure function state_after(self) result(z)
      type(moreau_step_t), intent(in) :: self
      real(wp) :: z(size(self%z0))

      associate (m => size(self%dv))
         z(:m) = self%z0(:m) + self%h*(self%z0(m + 1:) + theta*self%dv)
         z(m + 1:) = self%z0(m + 1:) + self%dv
      end associate
   end function state_after

   !> Look at s and s' at the end of the step, and if it is `free` choose the branches of the compliant laws by them.
   subroutine look_at_end(self, system, free)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: free

      integer :: i, j

      associate (dynamics => self%dynamics)
         call dynamics%look_at_contacts(system, self%h, state_after(self))
         if (.not. free) return
         do i = 1, size(self%compliant)
            j = self%compliant(i)
            dynamics%mode%branch(j) = system%machine%contact(j)%law%initial_branch(dynamics%s(j), dynamics%rate(j))
         end do
      end associate
   end subroutine look_at_end

   !> Δv with the compliant laws linearised about the one before, and the impulses that belong to it. Not `found`: the matrix is
   !> singular, or no impulses obey the laws.
   subroutine newton_round(self, system, rest, next, found)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rest(:)
      real(wp), intent(out) :: next(:)
      logical, intent(out) :: found

      real(wp), dimension(size(self%bound)) :: k, b
      integer :: i, info

      k = 0.0_wp
      b = 0.0_wp
      next = rest
      associate (dynamics => self%dynamics)
         dynamics%force = 0.0_wp
         do i = 1, size(self%compliant)
            associate (j => self%compliant(i))
               associate (contact => system%machine%contact(j), branch => dynamics%mode%branch(j), w => system%w(:, j))
                  dynamics%force(j) = contact%law%force(branch, dynamics%s(j), dynamics%rate(j), contact%normal)
                  call contact%law%slopes(branch, dynamics%s(j), dynamics%rate(j), contact%normal, k(j), b(j))
                  next = next - self%h*w*(dynamics%force(j) - slope(self, k(j), b(j))*dot_product(w, self%dv))
               end associate
            end associate
         end do
      end associate
      found = .true.
      if (abs(self%h - self%h_of_factor) > 0.0_wp .or. any(abs(k - self%stiffness) > 0.0_wp) &
          .or. any(abs(b - self%damping) > 0.0_wp)) call factorise(self, system, k, b, found)
      if (.not. found) return
      call dgetrs("N", size(next), 1, self%factor, size(next), self%pivot, next, size(next), info)
      self%terms = abs(next)
      call add_impulses(self, system, next, found)
   end subroutine newton_round

   !> dF/d(wᵀΔv) of a compliant law.
   pure function slope(self, stiffness, damping)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: stiffness, damping
      real(wp) :: slope

      slope = theta*self%h*stiffness + damping
   end function slope

   !> Factors of 1 + θh B + θ²h² K + Σ h (dF/dΔv) w wᵀ, and what impulses do.
   subroutine factorise(self, system, k, b, found)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: k(:), b(:)
      logical, intent(out) :: found

      real(wp) :: part
      integer :: i, info, j

      self%h_of_factor = self%h
      self%stiffness = k
      self%damping = b
      self%factorisations = self%factorisations + 1
      part = theta*self%h
      associate (m => system%m, w => system%w)
         self%factor = identity(m) + part*system%coupled%damping + part**2*system%coupled%stiffness
         do j = 1, size(k)
            if (.not. (abs(k(j)) > 0.0_wp .or. abs(b(j)) > 0.0_wp)) cycle
            do i = 1, m
               self%factor(:, i) = self%factor(:, i) + self%h*slope(self, k(j), b(j))*w(i, j)*w(:, j)
            end do
         end do
         self%pivot = [(0, i=1, m)]
         call dgetrf(m, m, self%factor, m, self%pivot, info)
         found = info == 0
         if (.not. found) then
            self%h_of_factor = -1.0_wp
            return
         end if
         self%response = w
         call dgetrs("N", m, size(k), self%factor, m, self%pivot, self%response, m, info)
      end associate
   end subroutine factorise

   !> Add the effect of the impulses of rigid sides and friction to Δv. They are looked for from those of the last step. Not
   !> `found`: none obey the laws.
   subroutine add_impulses(self, system, dv, found)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: dv(:)
      logical, intent(out) :: found

      type(impact_problem_t) :: problem
      real(wp), allocatable :: impulse(:), response(:, :)
      real(wp) :: residual
      integer :: i, n, sweeps

      found = .true.
      n = self%sides
      if (n + size(self%friction) == 0) then
         self%impulse = 0.0_wp
         return
      end if
      associate (side => self%side(:n), friction => self%friction)
         call set_up(system%w, side, friction, problem)
         response = self%response(:, [side%contact, friction])
         do i = 1, n
            response(:, i) = side(i)%direction*response(:, i)
            problem%restitution(i) = merge(1.0_wp, system%machine%contact(side(i)%contact)%law%restitution, side(i)%before > 0.0_wp)
         end do
         problem%delassus = matmul(transpose(problem%direction), response)
         problem%before = side%before
         impulse = [max(0.0_wp, side%direction*self%impulse(side%contact)), self%impulse(friction)]
         self%impulse = 0.0_wp
         self%bound = 0.0_wp
         call press_friction(self, system, problem)
         if (n == 0 .and. .not. any(problem%limit > 0.0_wp)) return
         ! What moves without the contact's coordinates goes with s'.
         problem%drift = matmul(dv - self%dv, problem%direction) &
                         + [side%direction*self%dynamics%rate(side%contact), self%dynamics%rate(friction)]
         call sweep_impact(problem, max(4, size(impulse))*epsilon(1.0_wp), few_sweeps, impulse, residual, sweeps)
         if (residual > max(4, size(impulse))*epsilon(1.0_wp)) then
            call solve_impact(problem, impulse, found)
            if (.not. found) return
         end if
         do i = 1, n
            associate (j => side(i)%contact)
               self%impulse(j) = self%impulse(j) + side(i)%direction*impulse(i)
            end associate
         end do
         self%impulse(friction) = impulse(n + 1:)
         self%bound(friction) = [(impulse_bound(problem, i, impulse), i=1, size(friction))]
         dv = dv + matmul(response, impulse)
         self%terms = self%terms + matmul(abs(response), abs(impulse))
      end associate
   end subroutine add_impulses

   !> Coefficients and given bounds of friction under the sides that take part and compliant forces.
   subroutine press_friction(self, system, problem)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(impact_problem_t), intent(inout) :: problem

      real(wp) :: mu, normal
      integer :: j, k

      associate (mode => self%dynamics%mode, side => self%side(:self%sides))
         do k = 1, size(self%friction)
            j = self%friction(k)
            if (.not. mode%in_play(system, j)) cycle
            associate (contact => system%machine%contact(j))
               mu = coefficient(contact, self%rate0(j), merge(huge(1.0_wp), -1.0_wp, self%branch0(j) == branch_sticking))
               normal = contact%normal
               if (contact%normal_of > 0) normal = normal + abs(self%dynamics%force(contact%normal_of))
               problem%limit(k) = self%h*mu*max(0.0_wp, normal)
               ! Rounding of speeds that both ends have together is no slip.
               if (self%branch0(j) == branch_sticking .and. problem%limit(k) > 0.0_wp) then
                  problem%limit(k) = problem%limit(k) + rounding*dot_product(abs(system%w(:, j)), &
                                                                             abs(self%z0(system%m + 1:)) + self%terms) &
                                     /max(problem%delassus(self%sides + k, self%sides + k), tiny(1.0_wp))
               end if
               problem%coefficient(k, :) = merge(mu, 0.0_wp, side%contact == contact%normal_of)
            end associate
         end do
      end associate
   end subroutine press_friction

   !> Branches of rigid contacts and friction at the end of the step.
   subroutine end_branches(self, system)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      real(wp) :: terms
      integer :: i, j

      associate (branch => self%dynamics%mode%branch, rate => self%dynamics%rate, m => system%m)
         do i = 1, self%sides
            associate (side => self%side(i))
               branch(side%contact) = branch_open
            end associate
         end do
         do i = 1, self%sides
            associate (side => self%side(i))
               if (.not. side%direction*self%impulse(side%contact) > 0.0_wp) cycle
               branch(side%contact) = side%closed
               if (self%branch0(side%contact) /= side%closed) self%impacts = self%impacts + 1
            end associate
         end do
         do i = 1, size(self%friction)
            j = self%friction(i)
            terms = dot_product(abs(system%w(:, j)), abs(self%z0(m + 1:)) + abs(self%z0(m + 1:) + self%dv) + self%terms) &
                    + abs(rate(j) - dot_product(system%w(:, j), self%z0(m + 1:) + self%dv))
            branch(j) = merge(branch_forward, branch_backward, rate(j) > 0.0_wp)
            if (abs(rate(j)) <= standing*terms .or. abs(self%impulse(j)) < (1.0_wp - standing)*self%bound(j)) then
               branch(j) = branch_sticking
            end if
         end do
      end associate
   end subroutine end_branches

   !> Forces at the end of the step: of compliant laws in their state, of others the mean over the step.
   subroutine end_forces(self, system)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: i, j

      if (self%h > 0.0_wp) self%force1 = -self%impulse/self%h
      associate (dynamics => self%dynamics)
         do i = 1, size(self%compliant)
            j = self%compliant(i)
            associate (contact => system%machine%contact(j))
               self%force1(j) = contact%law%force(dynamics%mode%branch(j), dynamics%s(j), dynamics%rate(j), contact%normal)
            end associate
         end do
      end associate
   end subroutine end_forces

   !> After the first step: forces of contacts that were closed at its start, where no scheme knows them, are as at its end.
   pure subroutine guess_first_forces(self, system)
      type(moreau_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: j

      do j = 1, size(self%force0)
         if (any(self%compliant == j)) cycle
         if (system%machine%contact(j)%law%branch(self%branch0(j))%closed) self%force0(j) = self%force1(j)
      end do
   end subroutine guess_first_forces

end module razy_moreau_step
