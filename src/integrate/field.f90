!! The right-hand side of a machine's motion, z' = f(t, z) with z = (y, y') in coupled coordinates (razy_machine_coupled):
!!
!!     y'' = a - Σ_j w_j F_j(s_j, s_j'),
!!
!! with a and s_j of razy_integrate_kinematics. The branches of all contacts are `branch`, entered by `enter_mode`; what a law
!! does in a branch is the law's, and constraint forces are those of razy_integrate_constraints. With the treatment
!! `switching` the branches are looked up in every right-hand side (friction sticks within a band); with `smoothing` every
!! law is its smoothed form.
module razy_integrate_field
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_contact_contact_law, only: branch_lower_parting, branch_open, branch_sticking, branch_upper_parting
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_integrate_constraints, only: constraints_t, new_constraints
   use razy_integrate_kinematics, only: kinematics_t
   use razy_machine_machine, only: machine_t, observe_contact_force
   implicit none(type, external)
   private

   public :: field_t, treat_by_events, treat_by_smoothing, treat_by_switching

   integer, parameter :: treat_by_events = 1, treat_by_switching = 2, treat_by_smoothing = 3

   !> What a contact does in a mode: nothing, an affine force, the law's force, a constraint force.
   integer, parameter :: idle = 0, affine = 1, lawful = 2, constrained = 3

   type, extends(kinematics_t) :: field_t
      !> What is done about jumps; sharpness of smoothed ones, half width of the band of sticking in switched ones.
      integer :: treatment = treat_by_events
      real(wp) :: sharpness = 0.0_wp, band = 0.0_wp
      integer, allocatable :: branch(:)
      !> Right-hand sides and Jacobian matrices formed so far.
      integer(i8) :: evaluations = 0, jacobians = 0
      !> What each contact does; contacts that act, friction last.
      integer, allocatable :: does(:), acting(:)
      integer :: acts = 0
      type(constraints_t) :: constraints
      !> Workspace: force and normal force (contacts each).
      real(wp), allocatable :: force(:), normal(:)
   contains
      procedure :: attach
      procedure :: first_state
      procedure :: enter_mode
      procedure :: derivative
      procedure :: accelerate
      procedure :: jacobian
      procedure :: observed
      procedure :: observed_rate
      procedure :: observed_size
      procedure :: keep_constraints
      procedure :: normal_of
      procedure, private :: add_forces
   end type field_t

contains

   !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
   subroutine attach(self, machine, keep_all, error)
      class(field_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: contacts

      call self%take(machine, keep_all, error)
      if (allocated(error)) return
      contacts = size(machine%contact)
      if (allocated(self%branch)) deallocate (self%branch, self%force, self%normal, self%does, self%acting)
      allocate (self%branch(contacts), source=branch_open)
      allocate (self%does(contacts), self%acting(contacts), source=idle)
      allocate (self%force(contacts), self%normal(contacts), source=0.0_wp)
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

   !> Make ready for the branches as they are.
   subroutine enter_mode(self)
      class(field_t), intent(inout) :: self

      integer :: held(size(self%branch)), sliding(size(self%branch)), row(size(self%branch))
      real(wp) :: sign(size(self%branch))
      integer :: i, j, n, pass

      n = 0
      self%force = 0.0_wp
      do j = 1, size(self%branch)
         associate (law => self%machine%contact(j)%law, branch => self%branch(j))
            self%does(j) = lawful
            if (self%treatment == treat_by_smoothing) cycle
            if (law%constraint(branch)) then
               self%does(j) = constrained
               n = n + 1
               held(n) = j
            else if (law%impacts .or. branch == branch_open) then
               self%does(j) = idle
            else if (law%piecewise_linear .and. .not. law%of_normal) then
               self%does(j) = affine
            end if
         end associate
      end do
      self%acts = 0
      do pass = 1, 2
         do j = 1, size(self%branch)
            if (self%does(j) /= affine .and. self%does(j) /= lawful) cycle
            if (self%machine%contact(j)%law%of_normal .neqv. pass == 2) cycle
            self%acts = self%acts + 1
            self%acting(self%acts) = j
         end do
      end do
      i = 0
      do j = 1, size(self%branch)
         if (self%does(j) /= lawful .or. .not. self%machine%contact(j)%law%of_normal) cycle
         associate (by => self%machine%contact(j)%normal_of)
            if (by == 0) cycle
            if (self%does(by) /= constrained) cycle
            i = i + 1
            sliding(i) = j
            row(i) = findloc(held(:n), by, 1)
            sign(i) = merge(1.0_wp, -1.0_wp, self%machine%contact(by)%law%force_guard(self%branch(by))%below /= 0)
         end associate
      end do
      call new_constraints(self%constraints, self%w, held(:n), sliding(:i), row(:i), sign(:i))
   end subroutine enter_mode

   !> z' (2m) at (tau, z).
   subroutine derivative(self, tau, z, dz)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: dz(:)

      integer :: i

      self%evaluations = self%evaluations + 1
      do i = 1, self%m
         dz(i) = z(self%m + i)
      end do
      call self%accelerate(tau, z, dz(self%m + 1:))
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

   !> Normal force of friction element j without that of a rigid contact, N.
   pure function normal_of(self, j) result(normal)
      class(field_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp) :: normal

      integer :: branch

      associate (contact => self%machine%contact(j))
         normal = contact%normal
         if (contact%normal_of > 0) then
            if (self%does(contact%normal_of) /= constrained .and. self%does(contact%normal_of) /= idle) then
               normal = normal + abs(self%force(contact%normal_of))
            end if
         end if
         if (contact%only_with == 0) return
         branch = self%branch(contact%only_with)
         if (self%treatment == treat_by_smoothing) then
            branch = self%machine%contact(contact%only_with)%law%initial_branch(self%s(contact%only_with), &
                                                                                self%rate(contact%only_with))
         end if
         select case (branch)
         case (branch_open, branch_upper_parting, branch_lower_parting)
            normal = 0.0_wp
         case default
         end select
      end associate
   end function normal_of

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

   !> df/dz (2m, 2m) at (tau, z).
   subroutine jacobian(self, tau, z, matrix)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: matrix(:, :)

      real(wp) :: a(self%m)
      integer :: i, m

      m = self%m
      self%jacobians = self%jacobians + 1
      call self%accelerate(tau, z, a)
      matrix = 0.0_wp
      do i = 1, m
         matrix(i, m + i) = 1.0_wp
      end do
      matrix(m + 1:, :m) = -self%coupled%stiffness
      matrix(m + 1:, m + 1:) = -self%coupled%damping
      do i = 1, self%acts
         call add_slopes(self, self%acting(i), matrix)
      end do
      if (self%constraints%count > 0) call constrain(self, matrix)
   end subroutine jacobian

   !> Add the slopes of contact j, whose forces `accelerate` has left, to the matrix df/dz.
   subroutine add_slopes(self, j, matrix)
      class(field_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: damping, per_normal, stiffness
      integer :: i, m

      m = self%m
      associate (contact => self%machine%contact(j))
         call slopes_of(self, j, stiffness, damping)
         do i = 1, m
            matrix(m + 1:, i) = matrix(m + 1:, i) - stiffness*self%w(:, j)*self%w(i, j)
            matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - damping*self%w(:, j)*self%w(i, j)
         end do
         if (.not. contact%law%of_normal .or. contact%normal_of == 0 .or. .not. abs(self%normal(j)) > 0.0_wp) return
         associate (by => contact%normal_of)
            if (self%does(by) == constrained .or. self%does(by) == idle) return
            per_normal = self%force(j)/self%normal(j)*sign(1.0_wp, self%force(by))
            call slopes_of(self, by, stiffness, damping)
            do i = 1, m
               matrix(m + 1:, i) = matrix(m + 1:, i) - per_normal*stiffness*self%w(:, j)*self%w(i, by)
               matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - per_normal*damping*self%w(:, j)*self%w(i, by)
            end do
         end associate
      end associate
   end subroutine add_slopes

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

   !> Take out of the rows y'' of df/dz what the constraint forces, with the friction that they press, let not happen.
   subroutine constrain(self, matrix)
      class(field_t), intent(in) :: self
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: force(self%constraints%count), phi(self%constraints%couplings)
      integer :: i, j, k
      logical :: found

      associate (constraints => self%constraints, m => self%m)
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = self%machine%contact(j)%law%force(self%branch(j), self%s(j), self%rate(j), 1.0_wp)
         end do
         do k = 1, 2*m
            call constraints%solve(matmul(matrix(m + 1:, k), self%w(:, constraints%contact)), phi, force, found)
            if (.not. found) return
            matrix(m + 1:, k) = matrix(m + 1:, k) - matmul(self%w(:, constraints%contact), force)
            do i = 1, constraints%couplings
               matrix(m + 1:, k) = matrix(m + 1:, k) &
                                   - self%w(:, constraints%sliding(i))*(phi(i)*constraints%sign(i)*force(constraints%row(i)))
            end do
         end do
      end associate
   end subroutine constrain

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

   !> Observable `form` at (tau, z).
   function observed(self, form, tau, z) result(value)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau, z(:)
      real(wp) :: value

      real(wp) :: a(self%m)
      integer :: i, t

      associate (observable => self%machine%observable(form))
         if (observable%kind == observe_contact_force) then
            call self%accelerate(tau, z, a)
            value = 0.0_wp
            associate (j => observable%contact)
               if (self%does(j) /= idle) value = self%machine%contact(j)%force_sign*self%force(j)
            end associate
            return
         end if
         call self%look_at_time(tau)
         value = observable%constant
         do i = 1, self%m
            value = value + (self%on_y(i, form)*z(i) + self%on_v(i, form)*z(self%m + i))
         end do
         do t = 1, size(self%omega)
            value = value + real(observable%error(t))*self%c(t) - aimag(observable%error(t))*self%d(t)
         end do
      end associate
   end function observed

   !> Rate of observable `form` at (tau, z), and the size of the terms that it is the sum of; a constraint force's is a
   !> difference over `delta`, s, along the motion.
   subroutine observed_rate(self, form, tau, z, delta, rate, size_of)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau, z(:), delta
      real(wp), intent(out) :: rate, size_of

      real(wp) :: a(self%m)
      integer :: i, t

      associate (observable => self%machine%observable(form), m => self%m)
         a = 0.0_wp
         if (observable%kind == observe_contact_force .or. any(abs(self%on_v(:, form)) > 0.0_wp)) call self%accelerate(tau, z, a)
         if (observable%kind == observe_contact_force) then
            call force_rate(self, observable%contact, tau, z, a, delta, rate, size_of)
            return
         end if
         call self%look_at_time(tau)
         rate = 0.0_wp
         size_of = 0.0_wp
         do i = 1, m
            rate = rate + (self%on_y(i, form)*z(m + i) + self%on_v(i, form)*a(i))
            size_of = size_of + (abs(self%on_y(i, form)*z(m + i)) + abs(self%on_v(i, form)*a(i)))
         end do
         do t = 1, size(self%omega)
            rate = rate - self%omega(t)*(real(observable%error(t))*self%d(t) + aimag(observable%error(t))*self%c(t))
            size_of = size_of + self%omega(t)*abs(observable%error(t))
         end do
      end associate
   end subroutine observed_rate

   !> Rate of the reported force of contact j at (tau, z), where `accelerate` has left a and the forces: by the slopes of a
   !> compliant law, else as a difference over `delta` along the motion.
   subroutine force_rate(self, j, tau, z, a, delta, rate, size_of)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau, z(:), a(:), delta
      real(wp), intent(out) :: rate, size_of

      real(wp) :: b(self%m), damping, moved(2*self%m), now, stiffness

      rate = 0.0_wp
      size_of = 0.0_wp
      if (self%does(j) == idle) return
      associate (sign_of => self%machine%contact(j)%force_sign, m => self%m)
         if (self%does(j) /= constrained .and. .not. self%machine%contact(j)%law%of_normal) then
            call slopes_of(self, j, stiffness, damping)
            rate = sign_of*(stiffness*self%rate(j) + damping*self%second_rate(j, a))
            size_of = abs(stiffness)*norm2(self%w(:, j))*norm2(z(m + 1:)) + abs(damping)*norm2(self%w(:, j))*norm2(a)
            return
         end if
         now = self%force(j)
         moved(:m) = z(:m) + delta*z(m + 1:)
         moved(m + 1:) = z(m + 1:) + delta*a
         call self%accelerate(tau + delta, moved, b)
         rate = sign_of*(self%force(j) - now)/delta
         size_of = abs(rate) + 8*abs(now)/delta
      end associate
   end subroutine force_rate

   !> Size of the terms that observable `form` is the sum of at z, where `observed` has just been asked.
   function observed_size(self, form, z) result(size_of)
      class(field_t), intent(in) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: z(:)
      real(wp) :: size_of

      real(wp) :: damping, stiffness

      associate (observable => self%machine%observable(form), m => self%m)
         if (observable%kind /= observe_contact_force) then
            size_of = abs(observable%constant) + sum(abs(observable%error)) + sum(abs(self%on_y(:, form)*z(:m))) &
                      + sum(abs(self%on_v(:, form)*z(m + 1:)))
            return
         end if
         size_of = 0.0_wp
         associate (j => observable%contact)
            if (self%does(j) == idle) return
            size_of = abs(self%force(j))
            if (self%does(j) == constrained) return
            call slopes_of(self, j, stiffness, damping)
            size_of = size_of + abs(stiffness)*(abs(self%machine%contact(j)%offset) + norm2(self%w(:, j))*norm2(z(:m))) &
                      + abs(damping)*norm2(self%w(:, j))*norm2(z(m + 1:))
         end associate
      end associate
   end function observed_size

end module razy_integrate_field
