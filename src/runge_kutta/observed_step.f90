!! A step of a Runge-Kutta method, or a moment, as observers see it: the state at any time of it by the dense output,
!! observables and their turns.
!!
!! Values are those of the dense output; rates are those of the right-hand side at that state, so that both are continuous from step
!! to step. Turns are looked for between `probes` points, and are not proved to be all. Of an observable that is a sum of
!! displacements, rates and accelerations at the ends of the step mostly say that it does not turn; else its own polynomial is
!! looked at.
module razy_runge_kutta_observed_step
   use razy_core_kinds, only: wp
   use razy_hybrid_mode, only: constrained, idle
   use razy_hybrid_system, only: system_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_machine_machine, only: observe_contact_force, observe_in_plane, observe_linear
   use razy_motion_integrator, only: glimpse_t
   use razy_runge_kutta_event_finder, only: monotone_sign
   use razy_runge_kutta_methods_dense_output, only: path_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_runge_kutta_right_hand_side, only: right_hand_side_t, treat_by_events
   implicit none(type, external)
   private

   public :: observed_step_t

   !> The part [0, duration] of the stepper's step, with the state at its end (2m); `moment`: no step, but that state.
   type :: observed_step_t
      real(wp) :: duration = 0.0_wp
      real(wp), allocatable :: z_stop(:)
      logical :: moment = .false.
      !> State looked at last (2m).
      real(wp), allocatable, private :: z(:)
      !> The path of an observable that is a sum of displacements, if turns are looked for on it, and the rounding in its rate.
      type(path_t), private :: path
      logical, private :: on_path = .false.
      real(wp), private :: noise = 0.0_wp
   contains
      procedure :: make_room
      procedure :: look
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
   end type observed_step_t

   integer, parameter :: probes = 8
   real(wp), parameter :: eps = epsilon(1.0_wp), longest_angle = 0.5_wp
   !> Rounding of a sum in units of its largest term.
   real(wp), parameter :: rounding = 16*eps

contains

   !> Make room for a system.
   subroutine make_room(self, system)
      class(observed_step_t), intent(out) :: self
      type(system_t), intent(in) :: system

      allocate (self%z(2*system%m), self%z_stop(2*system%m), source=0.0_wp)
   end subroutine make_room

   !> The state z (2m) at `tau`.
   subroutine look(self, system, stepper, tau, z)
      class(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: z(:)

      if (self%moment .or. tau >= self%duration) then
         z = self%z_stop
      else if (tau <= 0.0_wp) then
         z = stepper%z_start(:2*system%m)
      else
         call stepper%prepare_dense(system)
         call stepper%output%at(tau/stepper%h, z)
      end if
   end subroutine look

   !> Value of observable `form` at `tau`.
   function value(self, system, stepper, form, tau)
      class(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      call self%look(system, stepper, tau, self%z)
      associate (observable => system%machine%observable(form), rhs => stepper%rhs)
         if (observable%kind == observe_in_plane) then
            call rhs%dynamics%excitation%look(system%machine%tone, tau)
            associate (j => observable%contact)
               call rhs%dynamics%look_at_contact(system, j, self%z)
               value = merge(rhs%dynamics%rate(j), rhs%dynamics%s(j), system%machine%contact(j)%law%of_normal)
            end associate
         else if (observable%kind == observe_contact_force) then
            value = rhs%force_of(system, observable%contact, tau, self%z)
         else
            call rhs%dynamics%excitation%look(system%machine%tone, tau)
            value = system%observed(form)%value(self%z, rhs%dynamics%excitation%phasor)
         end if
      end associate
   end function value

   !> Rate of observable `form` at `tau`, and the rounding in it; a constraint force's is a difference along the motion.
   subroutine rate_of(self, system, stepper, form, tau, rate, noise)
      type(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rate, noise

      real(wp) :: dz(2*system%m)
      logical :: accelerated

      call self%look(system, stepper, tau, self%z)
      associate (m => system%m, observable => system%machine%observable(form), sum_of => system%observed(form), &
                 rhs => stepper%rhs)
         dz(:m) = self%z(m + 1:)
         dz(m + 1:) = 0.0_wp
         accelerated = observable%kind == observe_contact_force .or. sum_of%of_rates
         if (observable%kind == observe_in_plane) accelerated = system%machine%contact(observable%contact)%law%of_normal
         if (accelerated) call rhs%accelerate(system, tau, self%z, dz(m + 1:))
         if (observable%kind == observe_in_plane) then
            call rhs%dynamics%excitation%look(system%machine%tone, tau)
            associate (j => observable%contact)
               call rhs%dynamics%look_at_contact(system, j, self%z)
               rate = rhs%dynamics%rate(j)
               if (accelerated) rate = rhs%dynamics%second_rate(system, j, dz(m + 1:))
               noise = system%reach(j)*norm2(dz)
            end associate
         else if (observable%kind == observe_contact_force) then
            call force_rate(system, rhs, observable%contact, tau, self%z, dz(m + 1:), 1.0e-5_wp*stepper%h, rate, noise)
         else
            call rhs%dynamics%excitation%look(system%machine%tone, tau)
            rate = sum_of%rate(dz) + rhs%dynamics%excitation%rate(system%machine%tone, sum_of%error, 1)
            noise = sum_of%size_of_rate(dz, system%omega)
         end if
      end associate
      noise = rounding*noise
   end subroutine rate_of

   !> Rate of the reported force of contact j at (tau, z), where `accelerate` has left a and the forces: by the slopes of a
   !> compliant law, else as a difference over `delta`, s, along the motion; and the size of its terms.
   subroutine force_rate(system, rhs, j, tau, z, a, delta, rate, size_of)
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      integer, intent(in) :: j
      real(wp), intent(in) :: tau, z(:), a(:), delta
      real(wp), intent(out) :: rate, size_of

      real(wp) :: b(system%m), damping, moved(2*system%m), now, stiffness

      rate = 0.0_wp
      size_of = 0.0_wp
      associate (contact => system%machine%contact(j), dynamics => rhs%dynamics, m => system%m, length => system%reach(j))
         if (dynamics%mode%does(j) == idle) return
         if (dynamics%mode%does(j) /= constrained .and. .not. contact%law%of_normal) then
            call dynamics%slopes_of(system, j, stiffness, damping)
            rate = contact%force_sign*(stiffness*dynamics%rate(j) + damping*dynamics%second_rate(system, j, a))
            size_of = abs(stiffness)*length*norm2(z(m + 1:)) + abs(damping)*length*norm2(a)
            return
         end if
         now = dynamics%force(j)
         moved(:m) = z(:m) + delta*z(m + 1:)
         moved(m + 1:) = z(m + 1:) + delta*a
         call rhs%accelerate(system, tau + delta, moved, b)
         rate = contact%force_sign*(dynamics%force(j) - now)/delta
         size_of = abs(rate) + 8*abs(now)/delta
      end associate
   end subroutine force_rate

   !> Size of the terms that observable `form` is the sum of at the state looked at last, where `value` has just been asked.
   function size_of(self, system, rhs, form) result(total)
      type(observed_step_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(in) :: rhs
      integer, intent(in) :: form
      real(wp) :: total

      real(wp) :: damping, stiffness

      associate (observable => system%machine%observable(form), m => system%m, j => system%machine%observable(form)%contact)
         if (observable%kind == observe_linear) total = system%observed(form)%size(self%z)
         if (observable%kind == observe_in_plane) total = system%reach(j)*norm2(self%z)
         if (observable%kind /= observe_contact_force) return
         total = 0.0_wp
         if (rhs%dynamics%mode%does(j) == idle) return
         total = abs(rhs%dynamics%force(j))
         if (rhs%dynamics%mode%does(j) == constrained) return
         call rhs%dynamics%slopes_of(system, j, stiffness, damping)
         associate (length => system%reach(j))
            total = total + abs(stiffness)*(abs(system%gap(j)%constant) + length*norm2(self%z(:m))) &
                    + abs(damping)*length*norm2(self%z(m + 1:))
         end associate
      end associate
   end function size_of

   !> Value, size and direction of observable `form` at `tau`; a rate of rounding is looked at again a little later.
   subroutine glimpse(self, system, stepper, form, tau, seen)
      class(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp), parameter :: later(*) = [0.0_wp, 1.0e-4_wp, 1.0e-2_wp, 0.1_wp, 1.0_wp]
      real(wp) :: noise, rate
      integer :: k

      seen%value = self%value(system, stepper, form, tau)
      seen%size = size_of(self, system, stepper%rhs, form)
      if (self%moment) return
      do k = 1, size(later)
         call rate_of(self, system, stepper, form, tau + later(k)*(self%duration - tau), rate, noise)
         if (.not. abs(rate) > noise) cycle
         seen%direction = nint(sign(1.0_wp, rate))
         return
      end do
   end subroutine glimpse

   !> The first time after `tau` at which the rate of observable `form`, of the sign of `direction` so far, changes sign.
   subroutine next_turn(self, system, stepper, form, tau, tau_end, direction, found, tau_found, value)
      class(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      type(bracketed_root_t) :: root
      real(wp) :: a, b, noise, rate, rate_a
      integer :: k, n

      found = .false.
      tau_found = tau_end
      value = 0.0_wp
      if (self%moment) return
      self%on_path = stepper%rhs%treatment == treat_by_events .and. .not. system%observed(form)%of_rates &
                     .and. system%machine%observable(form)%kind == observe_linear
      if (self%on_path) then
         if (steady(self, system, stepper, form, direction)) return
         call stepper%prepare_dense(system)
         call stepper%output%follow(system%observed(form)%on_y, system%m, self%path)
      end if
      n = max(1, ceiling(max(probes*(tau_end - tau)/stepper%h, system%fastest*(tau_end - tau)/longest_angle)))
      a = tau
      do k = 1, n
         b = merge(tau_end, tau + (tau_end - tau)*(real(k, wp)/n), k == n)
         call look_at_rate(self, system, stepper, form, b, rate, noise)
         found = direction*rate < -noise
         if (found) exit
         a = b
      end do
      if (.not. found) return
      call look_at_rate(self, system, stepper, form, a, rate_a, noise)
      ! It keeps its sign at the start, whatever rounding says there.
      call root%start(a, max(direction*rate_a, tiny(1.0_wp)), b, direction*rate)
      do while (.not. root%done())
         call look_at_rate(self, system, stepper, form, root%trial, rate, noise)
         call root%take(merge(0.0_wp, direction*rate, abs(rate) <= noise))
      end do
      tau_found = root%best
      value = self%value(system, stepper, form, tau_found)
   end subroutine next_turn

   !> Rate of observable `form` at `tau` where turns are looked for, and the rounding in it.
   subroutine look_at_rate(self, system, stepper, form, tau, rate, noise)
      type(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rate, noise

      real(wp) :: unused

      if (.not. self%on_path) then
         call rate_of(self, system, stepper, form, tau, rate, noise)
         return
      end if
      noise = self%noise
      associate (excitation => stepper%rhs%dynamics%excitation)
         call excitation%look(system%machine%tone, tau)
         call self%path%look(tau/stepper%h, rate, unused)
         rate = rate + excitation%rate(system%machine%tone, system%observed(form)%error, 1)
      end associate
   end subroutine look_at_rate

   !> Whether observable `form`, a sum of displacements, moves in `direction` through all of the step, by its rates and
   !> accelerations at both ends.
   function steady(self, system, stepper, form, direction)
      type(observed_step_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: form, direction
      logical :: steady

      real(wp) :: bend(2), rate(2), total(2)

      associate (m => system%m, excitation => stepper%rhs%dynamics%excitation)
         call excitation%look(system%machine%tone, 0.0_wp)
         call look_at_end(stepper%z_start(m + 1:2*m), stepper%dz_start(m + 1:), 1)
         call excitation%look(system%machine%tone, stepper%h)
         call look_at_end(stepper%z_end(m + 1:), stepper%dz_end(m + 1:), 2)
      end associate
      self%noise = rounding*maxval(total)
      steady = minval(direction*rate) > self%noise .and. monotone_sign(stepper%h, rate(1), rate(2), bend(1), bend(2)) == direction

   contains

      subroutine look_at_end(v, a, i)
         real(wp), intent(in) :: v(:), a(:)
         integer, intent(in) :: i

         associate (sum_of => system%observed(form), excitation => stepper%rhs%dynamics%excitation)
            rate(i) = sum_of%rate(v) + excitation%rate(system%machine%tone, sum_of%error, 1)
            bend(i) = dot_product(sum_of%on_y, a) + excitation%rate(system%machine%tone, sum_of%error, 2)
            total(i) = sum_of%size_of_rate(v, system%omega)
         end associate
      end subroutine look_at_end

   end function steady

end module razy_runge_kutta_observed_step
