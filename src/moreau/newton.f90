!! Newton's method for the compliant laws in a step of the Moreau–Jean scheme (razy_moreau_step).
module razy_moreau_newton
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dgetrf, dgetrs
   use razy_moreau_impulses, only: add_impulses
   use razy_moreau_state, only: moreau_step_t
   implicit none(type, external)
   private

   public :: implicit_branches, newton_round

contains

   !> Branches of the compliant laws in the step.
   pure subroutine implicit_branches(self, dv, branch)
      type(moreau_step_t), intent(in) :: self
      real(wp), intent(in) :: dv(:)
      integer, intent(inout) :: branch(:)

      real(wp) :: s, rate
      integer :: i

      do i = 1, size(self%kinds%compliant)
         associate (j => self%kinds%compliant(i))
            call implicit_contact(self, j, dv, s, rate)
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
            call implicit_contact(self, j, dv, s, rate)
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

   !> s and s' of contact j at the end of the step.
   pure subroutine implicit_contact(self, j, dv, s, rate)
      type(moreau_step_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: dv(:)
      real(wp), intent(out) :: s, rate

      s = dot_product(self%w(:, j), self%q0 + self%h*(self%v0 + self%theta*dv)) + self%finish%s(j)
      rate = dot_product(self%w(:, j), self%v0 + dv) + self%finish%rate(j)
   end subroutine implicit_contact

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

end module razy_moreau_newton
