!! The right-hand side of a machine's motion, z' = f(t, z) with z = (y, y') in coupled coordinates (razy_machine_coupled):
!!
!!     y'' = a - Σ_j w_j F_j(s_j, s_j'),
!!
!! with a and s_j of razy_hybrid_kinematics. The branches of all contacts are `branch`, entered by `enter_mode`; what a law
!! does in a branch is the law's, and constraint forces are those of razy_hybrid_constraints. With the treatment
!! `switching` the branches are looked up in every right-hand side (friction sticks within a band); with `smoothing` every
!! law is its smoothed form.
module razy_hybrid_field
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_contact_contact_law, only: branch_open, branch_sticking
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_mode, only: affine, constrained, mode_t, treat_by_smoothing, treat_by_switching
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: field_t

   type, extends(mode_t) :: field_t
      !> Sharpness of smoothed jumps, half width of the band of sticking in switched ones.
      real(wp) :: sharpness = 0.0_wp, band = 0.0_wp
      !> Right-hand sides and Jacobian matrices formed so far.
      integer(i8) :: evaluations = 0, jacobians = 0
   contains
      procedure :: attach
      procedure :: first_state
      procedure :: derivative
      procedure :: accelerate
      procedure :: keep_constraints
      procedure :: slopes_of
      procedure, private :: add_forces
   end type field_t

contains

   !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
   subroutine attach(self, machine, keep_all, error)
      class(field_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      call self%take(machine, keep_all, error)
      if (allocated(error)) return
      call self%make_room()
      self%evaluations = 0
      self%jacobians = 0
   end subroutine attach

   !> z (2m) at the time 0, and the branches there.
   subroutine first_state(self, z)
      class(field_t), intent(inout) :: self
      real(wp), intent(out) :: z(:)

      integer :: j

      z(:self%m) = matmul(self%coupled%to_coupled, self%machine%displacement)
      z(self%m + 1:) = matmul(self%coupled%to_coupled, self%machine%velocity)
      call self%start_piece(0.0_wp, 0.0_wp)
      call self%look_at_contacts(0.0_wp, z)
      do j = 1, size(self%branch)
         self%branch(j) = self%machine%contact(j)%law%initial_branch(self%s(j), self%rate(j))
      end do
      call self%enter_mode()
   end subroutine first_state

   !> z' (2m) at (tau, z).
   subroutine derivative(self, tau, z, dz)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: dz(:)

      integer :: i, j

      self%evaluations = self%evaluations + 1
      do i = 1, self%m
         dz(i) = z(self%m + i)
      end do
      if (self%folded) then
         call self%look_at_time(tau)
         call self%forcing(dz(self%m + 1:))
         do j = 1, 2*self%m
            do i = 1, self%m
               dz(self%m + i) = dz(self%m + i) - self%matrix(i, j)*z(j)
            end do
         end do
      else
         call self%accelerate(tau, z, dz(self%m + 1:))
      end if
   end subroutine derivative

   !> y'' (m) at (tau, z); leaves the forces of all contacts in the workspace. Not counted as a right-hand side.
   subroutine accelerate(self, tau, z, a)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: a(:)

      integer :: i

      if (self%loaded .or. self%acts + self%constraints%count > 0 .or. self%treatment == treat_by_switching) then
         call self%look_at_time(tau)
      end if
      do i = 1, self%acts
         call self%look_at_contact(self%acting(i), z)
      end do
      if (self%treatment == treat_by_switching) call switch_branches(self, z)
      call self%free_acceleration(z, a)
      call self%add_forces(a)
      if (self%treatment /= treat_by_switching) return
      do while (slipping(self))
         call self%enter_mode()
         do i = 1, self%acts
            call self%look_at_contact(self%acting(i), z)
         end do
         call self%free_acceleration(z, a)
         call self%add_forces(a)
      end do
   end subroutine accelerate

   !> Add to a (m) what the contacts do at the s and s' of the workspace.
   subroutine add_forces(self, a)
      class(field_t), intent(inout) :: self
      real(wp), intent(inout) :: a(:)

      real(wp) :: force, unused_1, unused_2
      integer :: i, j, k

      do k = 1, self%acts
         j = self%acting(k)
         associate (contact => self%machine%contact(j))
            if (self%does(j) == affine) then
               force = contact%law%branch(self%branch(j))%stiffness*self%s(j) &
                       + contact%law%branch(self%branch(j))%damping*self%rate(j) + contact%law%branch(self%branch(j))%offset
            else
               if (contact%law%of_normal) self%normal(j) = self%normal_of(j)
               if (self%treatment == treat_by_smoothing) then
                  call contact%law%smoothed(self%s(j), self%rate(j), self%normal(j), self%sharpness, force, unused_1, unused_2)
               else
                  force = contact%law%force(self%branch(j), self%s(j), self%rate(j), self%normal(j))
               end if
            end if
         end associate
         self%force(j) = force
         do i = 1, self%m
            a(i) = a(i) - self%w(i, j)*force
         end do
      end do
      if (self%constraints%count > 0) call add_constraint_forces(self, a)
   end subroutine add_forces

   subroutine add_constraint_forces(self, a)
      class(field_t), intent(inout) :: self
      real(wp), intent(inout) :: a(:)

      real(wp) :: force(self%constraints%count), wanted(self%constraints%count), phi(self%constraints%couplings)
      integer :: i, j
      logical :: found

      associate (constraints => self%constraints)
         do i = 1, constraints%count
            wanted(i) = self%second_rate(constraints%contact(i), a)
         end do
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = self%machine%contact(j)%law%force(self%branch(j), self%s(j), self%rate(j), 1.0_wp)
         end do
         call constraints%solve(wanted, phi, force, found)
         if (.not. found) force = ieee_value(1.0_wp, ieee_quiet_nan)
         do i = 1, constraints%count
            j = constraints%contact(i)
            self%force(j) = force(i)
            a = a - self%w(:, j)*force(i)
         end do
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            associate (press => constraints%sign(i)*force(constraints%row(i)))
               self%normal(j) = self%normal(j) + press
               self%force(j) = self%force(j) + phi(i)*press
               a = a - self%w(:, j)*(phi(i)*press)
            end associate
         end do
         do i = 1, constraints%count
            j = constraints%contact(i)
            if (self%machine%contact(j)%law%of_normal) self%normal(j) = self%normal_of(j)
         end do
         do i = 1, constraints%count
            j = constraints%contact(i)
            if (.not. self%machine%contact(j)%law%of_normal) cycle
            associate (by => self%machine%contact(j)%normal_of)
               if (by == 0) cycle
               if (self%does(by) == constrained) self%normal(j) = self%normal(j) + abs(self%force(by))
            end associate
         end do
      end associate
   end subroutine add_constraint_forces

   !> Look up the branches that the state z is in (`switching`): friction sticks within the band.
   subroutine switch_branches(self, z)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: z(:)

      integer :: branch, i, j
      logical :: changed

      changed = .false.
      do j = 1, size(self%branch)
         call self%look_at_contact(j, z)
         associate (law => self%machine%contact(j)%law)
            branch = law%initial_branch(self%s(j), self%rate(j))
            if (law%constraint(branch_sticking) .and. abs(self%rate(j)) <= self%band) branch = branch_sticking
         end associate
         changed = changed .or. branch /= self%branch(j)
         self%branch(j) = branch
      end do
      if (.not. changed) return
      call self%enter_mode()
      do i = 1, self%acts
         call self%look_at_contact(self%acting(i), z)
      end do
   end subroutine switch_branches

   !> Let slide what sticks with more than friction can hold (`switching`).
   function slipping(self) result(any_did)
      class(field_t), intent(inout) :: self
      logical :: any_did

      integer :: i, j

      any_did = .false.
      do i = 1, self%constraints%count
         j = self%constraints%contact(i)
         associate (guard => self%machine%contact(j)%law%force_guard(branch_sticking))
            if (guard%above /= 0 .and. self%force(j) > guard%upper*self%normal(j)) then
               self%branch(j) = guard%above
               any_did = .true.
            else if (guard%below /= 0 .and. self%force(j) < guard%lower*self%normal(j)) then
               self%branch(j) = guard%below
               any_did = .true.
            end if
         end associate
      end do
   end function slipping

   !> Slopes of the force of contact j at the s and s' of the workspace.
   subroutine slopes_of(self, j, stiffness, damping)
      class(field_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: unused

      associate (law => self%machine%contact(j)%law)
         if (self%treatment == treat_by_smoothing) then
            call law%smoothed(self%s(j), self%rate(j), self%normal(j), self%sharpness, unused, stiffness, damping)
         else
            call law%slopes(self%branch(j), self%s(j), self%rate(j), self%normal(j), stiffness, damping)
         end if
      end associate
   end subroutine slopes_of

   !> Bring z back to the constraints of the mode, which rounding has left: s of rigid contacts at its edge, s' = 0.
   subroutine keep_constraints(self, tau, z)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: change(self%constraints%count)
      integer :: i, j

      if (self%constraints%count == 0) return
      call self%look_at_time(tau)
      associate (constraints => self%constraints)
         do i = 1, constraints%count
            j = constraints%contact(i)
            call self%look_at_contact(j, z)
            change(i) = 0.0_wp
            if (.not. self%machine%contact(j)%law%impacts) cycle
            associate (edge => self%machine%contact(j)%law%guard(1, branch_open))
               change(i) = merge(edge%upper, edge%lower, edge%above == self%branch(j)) - self%s(j)
            end associate
         end do
         call constraints%displace(self%w, change, z(:self%m))
         call constraints%displace(self%w, -self%rate(constraints%contact), z(self%m + 1:))
      end associate
   end subroutine keep_constraints

end module razy_hybrid_field
