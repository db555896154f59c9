!! One step of the Moreau–Jean scheme with theta-method.
!!
!! With v_θ = v + θ Δv and q_θ = q + θ h v_θ, a step of length h from (q, v) is
!!
!!     M Δv + h B v_θ + h K q_θ = h f(t + θh) - h Σ w_j F_j(s_j⁺, s_j'⁺) + Σ w λ,    q⁺ = q + h v_θ,  v⁺ = v + Δv,
!!
!! where F_j are the compliant laws and λ the impulses of rigid contacts and friction elements. A rigid side takes part if its gap
!! is closed in the middle of the step, g + h u/2 <= 0, or was so in the last one. It then obeys 0 <= u⁺ + ε u ⟂ λ >= 0 (with
!! ε = 1 if u > 0: razy_moreau_impulses); friction obeys Coulomb's law in s'⁺. Source: Jean, Comput. Methods Appl. Mech.
!! Engrg. 177 (1999) 235–257; Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer (2008), 10.
!!
!! Compliant laws take s and s' at the end of the step: an elastic force that grows with s then takes at least the energy that
!! it stores, U(s⁺) - U(s) <= F(s⁺) (s⁺ - s), however stiff it is, and a stiff damper stops the motion; their order is 1. The
!! equations are solved by Newton's method in Δv, with a problem of impulses in every round. If branches go on changing (a force
!! that jumps has no solution at the jump itself) they are kept after some rounds.
module razy_moreau_step
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgetrf, dgetrs
   use razy_moreau_impulses, only: add_impulses
   use razy_moreau_state, only: excitation_t, excite, moreau_step_t, new_contact_kinds, new_impulse_work
   implicit none(type, external)
   private

   public :: begin_steps, guess_first_forces, take_step

   !> Rounds of Newton's method before branches are kept, and at all; change of Δv, by kinetic energy, that ends it.
   integer, parameter :: free_rounds = 8, most_rounds = 60
   real(wp), parameter :: converged = 1.0e-12_wp
   !> A sliding velocity below this part of its terms is none, and an impulse of friction within it is at its bound.
   real(wp), parameter :: standing = 1.0e-12_wp

contains

   !> Take over a machine's start: state, branches, forces of the compliant laws.
   subroutine begin_steps(self)
      type(moreau_step_t), intent(inout) :: self

      real(wp) :: rate, s
      integer :: j, n, contacts

      n = size(self%machine%load)
      contacts = size(self%machine%contact)
      call new_contact_kinds(self%kinds, self%machine)
      call new_impulse_work(self%work, self%kinds)
      self%q1 = self%machine%displacement
      self%v1 = self%machine%velocity
      self%q0 = self%q1
      self%v0 = self%v1
      if (allocated(self%w)) deallocate (self%w, self%response, self%delassus, self%factor, self%pivot, self%branch1)
      if (allocated(self%force1)) deallocate (self%force1, self%impulse, self%bound, self%stiffness, self%damping)
      allocate (self%w(n, contacts), self%response(n, contacts), self%delassus(contacts, contacts))
      allocate (self%factor(n, n), self%pivot(n), self%branch1(contacts))
      allocate (self%force1(contacts), self%impulse(contacts), self%bound(contacts), source=0.0_wp)
      allocate (self%stiffness(contacts), self%damping(contacts), source=0.0_wp)
      self%h_of_factor = -1.0_wp
      if (.not. allocated(self%start)) allocate (self%start, self%inner, self%finish)
      call excite(self%machine, 0.0_wp, 0.0_wp, 0.0_wp, self%finish)
      do j = 1, contacts
         self%w(:, j) = self%machine%contact(j)%w
         call contact_at(self, j, self%q1, self%v1, s, rate)
         self%branch1(j) = self%machine%contact(j)%law%initial_branch(s, rate)
      end do
      self%branch0 = self%branch1
      self%h = 0.0_wp
      call end_forces(self)
      self%force0 = self%force1
      self%rounds = 0
      self%factorisations = 0
      self%impacts = 0
   end subroutine begin_steps

   !> s and s' of contact j at the end of the step, where the motion has q and v (n each).
   pure subroutine contact_at(self, j, q, v, s, rate)
      type(moreau_step_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: q(:), v(:)
      real(wp), intent(out) :: s, rate

      s = dot_product(self%w(:, j), q) + self%finish%s(j)
      rate = dot_product(self%w(:, j), v) + self%finish%rate(j)
   end subroutine contact_at

   !> One step of length h, s, from the time `time + time_low`; it starts where the last one ended. Not `found`: no
   !> impulses obey the laws, or Newton's method does not converge.
   subroutine take_step(self, time, time_low, h, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_low, h
      logical, intent(out) :: found

      type(excitation_t), allocatable :: spare
      real(wp) :: dv(size(self%q1)), next(size(self%q1)), rest(size(self%q1)), change
      integer :: branch(size(self%branch1)), before(size(self%branch1)), round

      self%h = h
      self%q0 = self%q1
      self%v0 = self%v1
      self%branch0 = self%branch1
      self%force0 = self%force1
      call move_alloc(self%start, spare)
      call move_alloc(self%finish, self%start)
      call move_alloc(spare, self%finish)
      call excite(self%machine, time, time_low, self%theta*h, self%inner)
      call excite(self%machine, time, time_low, h, self%finish)

      rest = h*(self%inner%load - matmul(self%machine%damping, self%v0) &
                - matmul(self%machine%stiffness, self%q0 + self%theta*h*self%v0))
      dv = 0.0_wp
      branch = self%branch0
      call implicit_branches(self, dv, branch)
      do round = 1, most_rounds
         self%rounds = self%rounds + 1
         call newton_round(self, rest, dv, branch, next, found)
         if (.not. found) return
         change = energy_norm(self, next - dv)
         dv = next
         before = branch
         if (round < free_rounds) call implicit_branches(self, dv, branch)
         if (change <= converged*(energy_norm(self, self%v0) + energy_norm(self, dv))) exit
         if (self%kinds%piecewise_linear .and. all(branch == before)) exit
         if (round == most_rounds) found = .false.
      end do
      if (.not. found) return
      self%q1 = self%q0 + h*(self%v0 + self%theta*dv)
      self%v1 = self%v0 + dv
      call implicit_branches(self, dv, branch)
      self%branch1 = branch
      call end_branches(self)
      call end_forces(self)
   end subroutine take_step

   !> Branches of the compliant laws in the step.
   pure subroutine implicit_branches(self, dv, branch)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: dv(:)
      integer, intent(inout) :: branch(:)

      real(wp) :: s, rate
      integer :: i

      do i = 1, size(self%kinds%compliant)
         associate (j => self%kinds%compliant(i))
            call contact_at(self, j, self%q0 + self%h*(self%v0 + self%theta*dv), self%v0 + dv, s, rate)
            branch(j) = self%machine%contact(j)%law%initial_branch(s, rate)
         end associate
      end do
   end subroutine implicit_branches

   !> Δv with the compliant laws linearised about `dv`, and the impulses that belong to it. Not `found`: the
   !> matrix is singular, or no impulses obey the laws.
   subroutine newton_round(self, rest, dv, branch, next, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: rest(:), dv(:)
      integer, intent(in) :: branch(:)
      real(wp), intent(out) :: next(:)
      logical, intent(out) :: found

      real(wp) :: k(size(branch)), b(size(branch)), force(size(branch)), s, rate
      integer :: i, info

      k = 0.0_wp
      b = 0.0_wp
      force = 0.0_wp
      next = rest
      do i = 1, size(self%kinds%compliant)
         associate (j => self%kinds%compliant(i))
            call contact_at(self, j, self%q0 + self%h*(self%v0 + self%theta*dv), self%v0 + dv, s, rate)
            force(j) = self%machine%contact(j)%law%force(branch(j), s, rate, self%machine%contact(j)%normal)
            call self%machine%contact(j)%law%slopes(branch(j), s, rate, self%machine%contact(j)%normal, k(j), b(j))
            next = next - self%h*self%w(:, j)*(force(j) - slope(self, k(j), b(j))*dot_product(self%w(:, j), dv))
         end associate
      end do
      found = .true.
      if (abs(self%h - self%h_of_factor) > 0.0_wp .or. any(abs(k - self%stiffness) > 0.0_wp) &
          .or. any(abs(b - self%damping) > 0.0_wp)) call factorise(self, k, b, found)
      if (.not. found) return
      call dgetrs("N", size(next), 1, self%factor, size(next), self%pivot, next, size(next), info)
      call add_impulses(self, force, branch, next, found)
   end subroutine newton_round

   !> dF/d(wᵀΔv) of a compliant law.
   pure function slope(self, stiffness, damping)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: stiffness, damping
      real(wp) :: slope

      slope = self%theta*self%h*stiffness + damping
   end function slope

   !> Factors of M + θh B + θ²h² K + Σ h (dF/dΔv) w wᵀ, and what impulses do.
   subroutine factorise(self, k, b, found)
      type(moreau_step_t), intent(inout) :: self
      real(wp), intent(in) :: k(:), b(:)
      logical, intent(out) :: found

      real(wp) :: part
      integer :: i, j, n, info

      n = size(self%q1)
      self%h_of_factor = self%h
      self%stiffness = k
      self%damping = b
      self%factorisations = self%factorisations + 1
      part = self%theta*self%h
      self%factor = self%machine%mass + part*self%machine%damping + part**2*self%machine%stiffness
      do j = 1, size(k)
         if (.not. (abs(k(j)) > 0.0_wp .or. abs(b(j)) > 0.0_wp)) cycle
         do i = 1, n
            self%factor(:, i) = self%factor(:, i) + self%h*slope(self, k(j), b(j))*self%w(i, j)*self%w(:, j)
         end do
      end do
      call dgetrf(n, n, self%factor, n, self%pivot, info)
      found = info == 0
      if (.not. found) then
         self%h_of_factor = -1.0_wp
         return
      end if
      self%response = self%w
      call dgetrs("N", n, size(k), self%factor, n, self%pivot, self%response, n, info)
      self%delassus = matmul(transpose(self%w), self%response)
   end subroutine factorise

   pure function energy_norm(self, v) result(norm)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: v(:)
      real(wp) :: norm

      norm = sqrt(abs(dot_product(v, matmul(self%machine%mass, v))))
   end function energy_norm

   !> Branches of rigid contacts and friction at the end of the step.
   subroutine end_branches(self)
      type(moreau_step_t), intent(inout) :: self

      real(wp) :: rate, s, terms
      integer :: i, j

      self%branch1(self%kinds%side%contact) = branch_open
      do i = 1, size(self%kinds%side)
         associate (side => self%kinds%side(i))
            if (side%direction*self%impulse(side%contact) > 0.0_wp) self%branch1(side%contact) = side%closed
            if (self%branch1(side%contact) == side%closed .and. self%branch0(side%contact) /= side%closed) then
               self%impacts = self%impacts + 1
            end if
         end associate
      end do
      do i = 1, size(self%kinds%friction)
         j = self%kinds%friction(i)
         call contact_at(self, j, self%q1, self%v1, s, rate)
         terms = dot_product(abs(self%w(:, j)), abs(self%v0) + abs(self%v1)) + abs(self%finish%rate(j))
         self%branch1(j) = merge(branch_forward, branch_backward, rate > 0.0_wp)
         if (abs(rate) <= standing*terms .or. abs(self%impulse(j)) < (1.0_wp - standing)*self%bound(j)) then
            self%branch1(j) = branch_sticking
         end if
      end do
   end subroutine end_branches

   !> Forces at the end of the step: of compliant laws in their state, of others the mean over the step.
   subroutine end_forces(self)
      type(moreau_step_t), intent(inout) :: self

      real(wp) :: rate, s
      integer :: i

      if (self%h > 0.0_wp) self%force1 = -self%impulse/self%h
      do i = 1, size(self%kinds%compliant)
         associate (j => self%kinds%compliant(i))
            call contact_at(self, j, self%q1, self%v1, s, rate)
            self%force1(j) = self%machine%contact(j)%law%force(self%branch1(j), s, rate, self%machine%contact(j)%normal)
         end associate
      end do
   end subroutine end_forces

   !> After the first step: forces of contacts that were closed at its start, where no scheme knows them, are as at its end.
   pure subroutine guess_first_forces(self)
      type(moreau_step_t), intent(inout) :: self

      integer :: j

      do j = 1, size(self%force0)
         if (any(self%kinds%compliant == j)) cycle
         if (self%machine%contact(j)%law%branch(self%branch0(j))%closed) self%force0(j) = self%force1(j)
      end do
   end subroutine guess_first_forces

end module razy_moreau_step
