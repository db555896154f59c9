!! Derivatives by time of a motion in its mode, as many as are asked for: y⁽ⁿ⁺²⁾ follows from
!!
!!     y'' = S f - B y' - K y - Σ_j w_j F_j
!!
!! derived n times, with the forces of constraints from w_cᵀ y⁽ⁿ⁺²⁾ + e_c⁽ⁿ⁺²⁾ = 0. With it goes the size of the terms, in whose
!! rounding a derivative is 0. Of laws that are not piecewise linear, and of varying stiffness, that of y'' is the last
!! that is known; where tones are swept or directions turn none.
module razy_hybrid_derivatives
   use razy_core_kinds, only: wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_kinematics, only: kinematics_t
   use razy_hybrid_mode, only: affine, constrained, idle, lawful, press_of
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: derivatives_t, differentiate, response_to

   type :: derivatives_t
      !> The highest that is known of y and s.
      integer :: highest = 2
      !> y⁽ⁿ⁾ (m, 0:highest), s⁽ⁿ⁾ (contacts, 0:highest).
      real(wp), allocatable :: y(:, :), s(:, :)
      !> F⁽ⁿ⁾ and, of friction, N⁽ⁿ⁾ (contacts, 0:highest - 2).
      real(wp), allocatable :: force(:, :), normal(:, :)
      !> Size of the terms of y⁽ⁿ⁾, its norm (0:highest), and of e⁽ⁿ⁾ (contacts, 0:highest).
      real(wp), allocatable :: size(:), error(:, :)
   end type derivatives_t

   !> Of forces, in units of the size of the terms of the acceleration.
   real(wp), parameter :: rounding_of_terms = 256*epsilon(1.0_wp)

contains

   !> The derivatives up to number `highest` of the motion at (tau, z) in the mode of `dynamics`; `seen` are lengths of y and y', to
   !> whose rounding z is known.
   subroutine differentiate(self, system, dynamics, tau, z, seen, highest)
      type(derivatives_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:), seen(2)
      integer, intent(in) :: highest

      integer :: contacts, j, n

      contacts = size(dynamics%s)
      allocate (self%y(system%m, 0:highest), self%s(contacts, 0:highest), self%force(contacts, 0:highest - 2), &
                self%normal(contacts, 0:highest - 2), self%size(0:highest), self%error(contacts, 0:highest), source=0.0_wp)
      self%y(:, 0) = z(:system%m)
      self%y(:, 1) = z(system%m + 1:)
      call dynamics%accelerate(system, tau, z, self%y(:, 2))
      call dynamics%look_at_contacts(system, tau, z)
      self%s(:, 0) = dynamics%s
      self%s(:, 1) = dynamics%rate
      self%force(:, 0) = dynamics%force
      self%normal(:, 0) = dynamics%normal
      do n = 0, highest
         do j = 1, contacts
            self%error(j, n) = sum(system%omega**n*abs(system%gap(j)%error))
         end do
      end do
      self%size(:1) = max(seen, [norm2(self%y(:, 0)), norm2(self%y(:, 1))])
      self%size(2) = size_of(self, system, dynamics, 0)
      call derive_s(self, system, dynamics, 2)
      do n = 1, highest - 2
         if (.not. is_known(system, dynamics, n)) exit
         call derive(self, system, dynamics, n)
         self%size(n + 2) = size_of(self, system, dynamics, n)
         self%highest = n + 2
         call derive_s(self, system, dynamics, n + 2)
      end do
   end subroutine differentiate

   !> Whether derivative n of the forces in the mode is known.
   pure function is_known(system, dynamics, n)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: n
      logical :: is_known

      integer :: j, k

      is_known = .not. (any(system%machine%tone%is_swept()) .or. system%curved)
      if (n == 1) return
      do k = 1, dynamics%mode%acts
         j = dynamics%mode%acting(k)
         is_known = is_known .and. system%machine%contact(j)%law%piecewise_linear &
                    .and. .not. allocated(system%machine%contact(j)%modulation)
      end do
   end function is_known

   !> s⁽ⁿ⁾ of all contacts, n > 1.
   pure subroutine derive_s(self, system, contacts, n)
      type(derivatives_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      class(kinematics_t), intent(in) :: contacts
      integer, intent(in) :: n

      integer :: j

      do j = 1, size(self%s, 1)
         self%s(j, n) = dot_product(contacts%w(:, j), self%y(:, n)) &
                        + contacts%excitation%rate(system%machine%tone, system%gap(j)%error, n)
         if (n == 2) self%s(j, n) = self%s(j, n) + contacts%bend(j) + system%machine%contact(j)%drive_rate
      end do
   end subroutine derive_s

   !> Derivative n > 0 of the acceleration, and of the forces.
   subroutine derive(self, system, dynamics, n)
      type(derivatives_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      integer, intent(in) :: n

      real(wp) :: a(system%m), damping, share, stiffness
      integer :: i, j, k

      a = -matmul(system%coupled%stiffness, self%y(:, n)) - matmul(system%coupled%damping, self%y(:, n + 1))
      a = a + [(dynamics%excitation%rate(system%machine%tone, system%harmonic(i, :), n), i=1, system%m)]
      if (allocated(system%coupled%by_speed)) then
         ! Leibniz's rule, in derivatives by the speed, of which tables have three.
         share = 1.0_wp
         do k = 0, min(n, 3)
            a = a - share*system%coupled%by_speed%times(dynamics%speed_gained(system), k, self%y(:, n - k), self%y(:, n - k + 1))
            share = share*system%machine%acceleration*(n - k)/(k + 1)
         end do
      end if
      do k = 1, dynamics%mode%acts
         j = dynamics%mode%acting(k)
         associate (contact => system%machine%contact(j), branch => dynamics%mode%branch(j))
            if (contact%law%of_normal) call derive_normal(self, system, dynamics, j, n)
            if (dynamics%mode%does(j) == affine) then
               self%force(j, n) = contact%law%branch(branch)%stiffness*self%s(j, n) &
                                  + contact%law%branch(branch)%damping*self%s(j, n + 1)
            else
               self%force(j, n) = contact%law%force(branch, dynamics%s(j), dynamics%rate(j), 1.0_wp)*self%normal(j, n)
               if (.not. contact%law%of_normal .or. .not. contact%law%piecewise_linear) then
                  call dynamics%slopes_of(system, j, stiffness, damping)
                  self%force(j, n) = self%force(j, n) + stiffness*self%s(j, n) + damping*self%s(j, n + 1)
               end if
               if (allocated(contact%modulation)) then
                  self%force(j, n) = self%force(j, n) + dynamics%excitation%rate(system%machine%tone, contact%modulation, n) &
                                     *(contact%law%force(branch, dynamics%s(j), dynamics%rate(j), 1.0_wp) &
                                       - contact%law%steady_damping*dynamics%rate(j))
               end if
            end if
         end associate
         a = a - dynamics%w(:, j)*self%force(j, n)
      end do
      if (dynamics%mode%constraints%count > 0) call hold(self, system, dynamics, n, a)
      self%y(:, n + 2) = a
   end subroutine derive

   !> N⁽ⁿ⁾ of friction element j, without that of a rigid contact. A force that is rounding yet will press on its side.
   pure subroutine derive_normal(self, system, dynamics, j, n)
      type(derivatives_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: j, n

      real(wp) :: way

      self%normal(j, n) = 0.0_wp
      associate (by => system%machine%contact(j)%normal_of)
         if (by == 0 .or. .not. dynamics%mode%in_play(system, j)) return
         if (any(dynamics%mode%does(by) == [constrained, idle])) return
         way = self%force(by, 0)
         if (abs(way)*system%reach(by) <= rounding_of_terms*self%size(2)) then
            way = real(system%machine%contact(by)%law%branch(dynamics%mode%branch(by))%side, wp)
         end if
         self%normal(j, n) = press_of(dynamics%mode%press(j), way)*self%force(by, n)
      end associate
   end subroutine derive_normal

   !> Add to derivative n of the acceleration, a (m), the forces that keep the constraints, and the friction that they press.
   subroutine hold(self, system, dynamics, n, a)
      type(derivatives_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: n
      real(wp), intent(inout) :: a(:)

      real(wp) :: error(dynamics%mode%constraints%count)
      real(wp), allocatable :: force(:), friction(:)
      integer :: i

      associate (constraints => dynamics%mode%constraints)
         error = [(dynamics%excitation%rate(system%machine%tone, system%gap(constraints%contact(i))%error, n + 2), &
                   i=1, constraints%count)]
         call give_way(system, dynamics, error, a, force, friction)
         self%force(constraints%contact, n) = force
         do i = 1, constraints%couplings
            associate (j => constraints%sliding(i))
               self%normal(j, n) = self%normal(j, n) + constraints%sign(i)*force(constraints%row(i))
               self%force(j, n) = self%force(j, n) + friction(i)
            end associate
         end do
         do i = 1, constraints%count
            associate (j => constraints%contact(i), by => system%machine%contact(constraints%contact(i))%normal_of)
               if (.not. system%machine%contact(j)%law%of_normal) cycle
               call derive_normal(self, system, dynamics, j, n)
               if (by == 0) cycle
               if (dynamics%mode%does(by) /= constrained) cycle
               ! By its side: its force may be rounding of either sign yet.
               self%normal(j, n) = self%normal(j, n) &
                                   + system%machine%contact(by)%law%branch(dynamics%mode%branch(by))%side*self%force(by, n)
            end associate
         end do
      end associate
   end subroutine hold

   !> What constraints make of an acceleration a (m) where their e'' are `error` (constraints): their forces (constraints),
   !> and those of the friction that they press (couplings).
   subroutine give_way(system, dynamics, error, a, force, friction)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      real(wp), intent(in) :: error(:)
      real(wp), intent(inout) :: a(:)
      real(wp), allocatable, intent(out) :: force(:), friction(:)

      real(wp) :: phi(dynamics%mode%constraints%couplings)
      integer :: i
      logical :: found

      associate (constraints => dynamics%mode%constraints)
         allocate (force(constraints%count), friction(constraints%couplings))
         do i = 1, constraints%couplings
            associate (j => constraints%sliding(i))
               phi(i) = system%machine%contact(j)%law%force(dynamics%mode%branch(j), dynamics%s(j), dynamics%rate(j), 1.0_wp)
            end associate
         end do
         call constraints%solve(matmul(a, dynamics%w(:, constraints%contact)) + error, phi, force, found)
         if (.not. found) force = 0.0_wp
         friction = phi*constraints%sign*force(constraints%row)
         a = a - matmul(dynamics%w(:, constraints%contact), force) - matmul(dynamics%w(:, constraints%sliding), friction)
      end associate
   end subroutine give_way

   !> The acceleration (m) that a force in direction d (m) gives in the mode of `dynamics`.
   function response_to(system, dynamics, d) result(a)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      real(wp), intent(in) :: d(:)
      real(wp) :: a(system%m)

      real(wp), allocatable :: force(:), friction(:)
      real(wp) :: still(dynamics%mode%constraints%count)

      a = d
      still = 0.0_wp
      if (size(still) > 0) call give_way(system, dynamics, still, a, force, friction)
   end function response_to

   !> Size of the terms of y⁽ⁿ⁺²⁾, with what has come into them from the lower derivatives.
   pure function size_of(self, system, dynamics, n) result(total)
      type(derivatives_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: n
      real(wp) :: total

      real(wp) :: reach
      integer :: j, t

      total = norm2(system%coupled%stiffness)*self%size(n) + norm2(system%coupled%damping)*self%size(n + 1)
      if (n == 0) total = total + norm2(system%load)
      do t = 1, size(system%omega)
         total = total + system%omega(t)**n*norm2(abs(system%harmonic(:, t)))
      end do
      do j = 1, size(dynamics%mode%branch)
         reach = system%reach(j)
         associate (law => system%machine%contact(j)%law)
            select case (dynamics%mode%does(j))
            case (affine)
               associate (piece => law%branch(dynamics%mode%branch(j)))
                  total = total + reach*(abs(piece%stiffness)*(reach*self%size(n) + self%error(j, n)) &
                                         + abs(piece%damping)*(reach*self%size(n + 1) + self%error(j, n + 1)))
                  if (n == 0) total = total + reach*abs(piece%offset)
               end associate
            case (lawful)
               total = total + reach*abs(self%force(j, n))
            case (constrained)
               total = total + self%error(j, n + 2)/reach
            case default
               cycle
            end select
         end associate
      end do
   end function size_of

end module razy_hybrid_derivatives
