!! Accelerations and contact forces of a machine in a mode (razy_hybrid_mode), at any time of a piece and state z = (y, y'):
!!
!!     y'' = S f - B y' - K y - Σ_j w_j F_j.
!!
!! Where contacts are then, and how they move, is razy_hybrid_kinematics.
module razy_hybrid_dynamics
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: new_constraints
   use razy_hybrid_kinematics, only: kinematics_t
   use razy_hybrid_mode, only: affine, constrained, idle, mode_t, press_of
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: accelerate_unconstrained, dynamics_t

   type, extends(kinematics_t) :: dynamics_t
      type(mode_t) :: mode
      !> Force F and normal force of each contact, as they were looked at last (contacts).
      real(wp), allocatable :: force(:), normal(:)
      !> Whether friction that is not given sticks, and where it does (contacts).
      logical, allocatable :: sticks(:)
      real(wp), allocatable :: stuck(:)
      !> Sharpness of smoothed jumps, if the mode has smoothed laws.
      real(wp) :: sharpness = 0.0_wp
   contains
      procedure :: make_room
      procedure :: aim
      procedure :: speed_gained
      procedure :: accelerate
      procedure, non_overridable :: look_at_force
      procedure :: normal_of
      procedure :: is_in_play
      procedure :: slopes_of
      procedure :: keep_constraints
      procedure :: stiffened
   end type dynamics_t

   !> What is rounding of a sum, in parts of its terms.
   real(wp), parameter :: negligible = 16*epsilon(1.0_wp)

contains

   !> Make room for a system; `sharpness` > 0 smooths its laws.
   subroutine make_room(self, system, sharpness)
      class(dynamics_t), intent(out) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: sharpness

      associate (contacts => size(system%machine%contact))
         call self%mode%make_room(contacts, sharpness > 0.0_wp)
         self%sharpness = sharpness
         call self%take_directions(system)
         allocate (self%force(contacts), self%normal(contacts), self%stuck(contacts), source=0.0_wp)
         allocate (self%sticks(contacts), source=.false.)
      end associate
   end subroutine make_room

   !> Turn the directions of constraints in a plane as they are at z and the time looked at last.
   subroutine aim(self, system, z)
      class(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:)

      integer :: i

      if (.not. system%curved) return
      associate (held => self%mode%constraints)
         do i = 1, held%count
            call self%look_at_contact(system, held%contact(i), z)
         end do
         if (held%count > 0) call new_constraints(held, self%w, (held%contact), (held%sliding), (held%row), (held%sign))
      end associate
   end subroutine aim

   !> y'' (m) without any contact at z and the time looked at last.
   pure subroutine free_acceleration(self, system, z, a)
      type(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp), contiguous, intent(in) :: z(:)
      real(wp), contiguous, intent(out) :: a(:)

      integer :: i, j, m, t

      m = system%m
      a = system%load
      do t = 1, size(system%omega)
         associate (phasor => self%excitation%phasor(t))
            do i = 1, m
               a(i) = a(i) + (system%harmonic(i, t)%re*phasor%re - system%harmonic(i, t)%im*phasor%im)
            end do
         end associate
      end do
      associate (k => system%coupled%stiffness, b => system%coupled%damping)
         do j = 1, m
            !$omp simd
            do i = system%first(j), system%last(j)
               a(i) = a(i) - (k(i, j)*z(j) + b(i, j)*z(m + j))
            end do
         end do
      end associate
      if (.not. allocated(system%coupled%by_speed)) return
      a = a - system%coupled%by_speed%times(self%speed_gained(system), 0, z(:m), z(m + 1:))
   end subroutine free_acceleration

   !> By what the speed is more than at time 0 at the time looked at last, rad/s.
   pure function speed_gained(self, system) result(speed)
      class(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp) :: speed

      speed = system%machine%acceleration*self%excitation%now()
   end function speed_gained

   !> y'' (m) at (tau, z); leaves s, s' and forces of the contacts that act, and the forces of constraints. It is no number
   !> where the forces of constraints do not exist.
   subroutine accelerate(self, system, tau, z, a)
      class(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: a(:)

      call accelerate_unconstrained(self, system, tau, z, a)
      call self%aim(system, z)
      if (self%mode%constraints%count > 0) call add_constraint_forces(self, system, a)
   end subroutine accelerate

   !> The same without the forces of constraints.
   subroutine accelerate_unconstrained(self, system, tau, z, a)
      type(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: a(:)

      integer :: i, j, k

      call self%excitation%look(system%machine%tone, tau)
      call free_acceleration(self, system, z, a)
      self%force = 0.0_wp
      do k = 1, self%mode%acts
         j = self%mode%acting(k)
         call self%look_at_force(system, j, z)
         do i = 1, system%m
            a(i) = a(i) - self%w(i, j)*self%force(j)
         end do
      end do
   end subroutine accelerate_unconstrained

   !> s, s' and force of contact j, which acts and is held by no constraint, at z and the time looked at last; of what presses it,
   !> if that is a contact, the force is known.
   subroutine look_at_force(self, system, j, z)
      class(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)

      real(wp) :: unused_1, unused_2

      call self%look_at_contact(system, j, z)
      associate (law => system%machine%contact(j)%law, branch => self%mode%branch(j))
         if (self%mode%does(j) == affine) then
            self%force(j) = law%branch(branch)%stiffness*self%s(j) + law%branch(branch)%damping*self%rate(j) &
                            + law%branch(branch)%offset
         else
            if (law%of_normal) self%normal(j) = self%normal_of(system, j)
            if (self%mode%smoothed) then
               call law%smoothed(self%s(j), self%rate(j), self%normal(j), self%sharpness, self%force(j), unused_1, unused_2)
            else
               self%force(j) = law%force(branch, self%s(j), self%rate(j), self%normal(j))
            end if
            self%force(j) = self%stiffened(system, j, self%force(j), self%rate(j))
         end if
      end associate
   end subroutine look_at_force

   !> Add to a (m) the forces that keep the constraints, and the friction that they press. What is held leaves no rounding.
   subroutine add_constraint_forces(self, system, a)
      type(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: a(:)

      real(wp) :: force(self%mode%constraints%count), wanted(self%mode%constraints%count), phi(self%mode%constraints%couplings)
      real(wp) :: terms(system%m)
      integer :: i, j
      logical :: found

      associate (constraints => self%mode%constraints, contact => system%machine%contact)
         do i = 1, constraints%count
            wanted(i) = self%second_rate(system, constraints%contact(i), a)
         end do
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = contact(j)%law%force(self%mode%branch(j), self%s(j), self%rate(j), 1.0_wp)
         end do
         call constraints%solve(wanted, phi, force, found)
         if (.not. found) force = ieee_value(1.0_wp, ieee_quiet_nan)
         terms = abs(a)
         do i = 1, constraints%count
            j = constraints%contact(i)
            self%force(j) = force(i)
            terms = terms + abs(self%w(:, j)*force(i))
            a = a - self%w(:, j)*force(i)
         end do
         where (abs(a) <= negligible*terms) a = 0.0_wp
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
            if (.not. contact(j)%law%of_normal) cycle
            self%normal(j) = self%normal_of(system, j)
            if (contact(j)%normal_of == 0) cycle
            if (self%mode%does(contact(j)%normal_of) /= constrained) cycle
            self%normal(j) = self%normal(j) + abs(self%force(contact(j)%normal_of))
         end do
      end associate
   end subroutine add_constraint_forces

   !> Normal force of friction element j without that of a rigid contact, N, from the forces looked at last.
   pure function normal_of(self, system, j) result(normal)
      class(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp) :: normal

      associate (contact => system%machine%contact(j))
         normal = contact%normal
         if (contact%normal_of > 0) then
            if (all(self%mode%does(contact%normal_of) /= [constrained, idle])) then
               associate (force => self%force(contact%normal_of))
                  normal = normal + press_of(self%mode%press(j), force)*force
               end associate
            end if
         end if
         if (.not. self%is_in_play(system, j)) normal = 0.0_wp
      end associate
   end function normal_of

   !> Whether friction element j is in play; a smoothed law that it goes with is in no branch but that of s and s'.
   pure function is_in_play(self, system, j) result(is)
      class(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      logical :: is

      is = .true.
      if (.not. self%mode%smoothed) then
         is = self%mode%in_play(system, j)
      else if (system%machine%contact(j)%only_with > 0) then
         associate (with => system%machine%contact(j)%only_with)
            associate (law => system%machine%contact(with)%law)
               is = law%branch(law%initial_branch(self%s(with), self%rate(with)))%closed
            end associate
         end associate
      end if
   end function is_in_play

   !> Slopes of the force of contact j at its s, s' and normal force looked at last.
   subroutine slopes_of(self, system, j, stiffness, damping)
      class(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: unused

      associate (law => system%machine%contact(j)%law)
         if (self%mode%smoothed) then
            call law%smoothed(self%s(j), self%rate(j), self%normal(j), self%sharpness, unused, stiffness, damping)
         else
            call law%slopes(self%mode%branch(j), self%s(j), self%rate(j), self%normal(j), stiffness, damping)
         end if
         stiffness = self%stiffened(system, j, stiffness, 0.0_wp)
         damping = self%stiffened(system, j, damping, 1.0_wp)
      end associate
   end subroutine slopes_of

   !> The force of contact j, or a slope of it, at the time looked at last, of that with the mean stiffness, where this varies by
   !> harmonics; s', or its slope, is `rate`.
   pure function stiffened(self, system, j, force, rate) result(varied)
      class(dynamics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: force, rate
      real(wp) :: varied

      varied = force
      if (.not. allocated(system%machine%contact(j)%modulation)) return
      associate (c => system%machine%contact(j)%modulation, e => self%excitation%phasor, &
                 steady => system%machine%contact(j)%law%steady_damping*rate)
         varied = (1 + sum(c%re*e%re - c%im*e%im))*(force - steady) + steady
      end associate
   end function stiffened

   !> Bring z at `tau` back to the constraints of the mode, which rounding has left: s of rigid contacts at its edge, s' = 0.
   subroutine keep_constraints(self, system, tau, z)
      class(dynamics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: change(self%mode%constraints%count)
      integer :: i, j

      associate (constraints => self%mode%constraints, m => system%m)
         self%sticks = self%sticks .and. self%mode%does == constrained
         if (constraints%count == 0) return
         call self%excitation%look(system%machine%tone, tau)
         call self%aim(system, z)
         do i = 1, constraints%count
            j = constraints%contact(i)
            call self%look_at_contact(system, j, z)
            change(i) = 0.0_wp
            if (.not. system%machine%contact(j)%law%impacts) then
               if (system%curved .or. system%given(j)) cycle
               ! What friction holds does not creep by what rounding adds up to.
               if (self%sticks(j)) change(i) = self%stuck(j) - self%s(j)
               self%stuck(j) = self%s(j) + change(i)
               self%sticks(j) = .true.
               cycle
            end if
            associate (edge => system%machine%contact(j)%law%branch(branch_open)%guard(1))
               change(i) = merge(edge%upper, edge%lower, edge%above == self%mode%branch(j)) - self%s(j)
            end associate
         end do
         call constraints%displace(self%w, change, z(:m))
         call constraints%displace(self%w, -self%rate(constraints%contact(:constraints%count)), z(m + 1:))
      end associate
   end subroutine keep_constraints

end module razy_hybrid_dynamics
