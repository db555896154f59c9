!! Moreau–Jean time stepping: motion with rigid unilateral contacts, Newton's restitution and Coulomb friction, one contact or
!! many, without finding events; compliant laws as implicit forces (razy_moreau_step).
!!
!! The step is fixed. Pieces are the steps; events are changes of a contact's status, noted at the ends of steps: a rigid contact is
!! closed in a step if it has an impulse there. Known properties: order 1 as soon as there are impacts, 2 on smooth
!! motion. With constant loads, no friction and no compliant laws the energy never grows for ε in [0, 1] (Acary, Z. Angew.
!! Math. Mech. 96 (2016) 585–603). An accumulation of impacts is passed within a few steps and ends in rest. Contact is kept on
!! the level of velocities: a gap that is closed stays where it was when it closed, up to h|u|/2 beyond the surface, and a
!! penetration at the start is not undone.
!!
!! What observers see: within a step of length h displacements are the parabola q(τ) = q + v τ + (Δv/2h) τ², velocities its
!! rate, the line v + (Δv/h) τ. So the jump of an impact is spread over its step. Excitation
!! is exact. Contact forces, known as means over steps (rigid contacts, friction) or at their ends (compliant laws), are joined by
!! lines.
module razy_moreau_moreau
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_hybrid_flow, only: ends_noted, ends_open, flow_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_machine_machine, only: machine_t, observe_contact_force
   use razy_moreau_step, only: moreau_step_t
   use razy_motion_integrator, only: glimpse_t, outcome_t, piece_t, status_no_contact_forces, status_ok
   implicit none(type, external)
   private

   public :: moreau_t

   !> The integrator. `step` (h, s) is to be set before `prepare`.
   type, extends(flow_t) :: moreau_t
      real(wp) :: step = 0.0_wp
      type(moreau_step_t), private :: scheme
      !> The piece as it is shown: its length, s; state (2m) at its start and derivative of velocity (m); contact forces (contacts)
      !> and their rates.
      real(wp), private :: duration = 0.0_wp
      real(wp), allocatable, private :: start(:), acceleration(:), force(:), force_rate(:)
   contains
      procedure :: prepare
      procedure :: enter
      procedure :: advance
      procedure :: stand
      procedure :: finish
      procedure :: transport
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: contact_sums
      procedure :: interval
   end type moreau_t

   !> A last step shorter than this part of a step is none.
   real(wp), parameter :: shortest = 1.0e-9_wp
   !> Rates below this part of their terms are rounding.
   real(wp), parameter :: rounding = 64*epsilon(1.0_wp)

contains

   !> Take a machine.
   subroutine prepare(self, machine, keep_all, error)
      class(moreau_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%step > 0.0_wp) call raise(error, "Moreau-Jean time stepping needs a positive step")
      if (allocated(error)) return
      call self%take(machine, keep_all, .false., 0.0_wp, error)
      self%finds_events = .false.
      self%spreads_impacts = .true.
   end subroutine prepare

   !> The excitation from here on, and the scheme if the motion begins.
   subroutine enter(self, t_end, outcome)
      class(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(inout) :: outcome

      associate (unused_1 => t_end, unused_2 => outcome)
         if (self%starting) call self%scheme%begin(self%system, self%z, self%transition%dynamics%mode%branch)
         call self%scheme%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
      end associate
   end subroutine enter

   !> Make one step, and note the changes of status.
   subroutine advance(self, t_end, longest, piece, ending, outcome)
      class(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: t_end, longest
      type(piece_t), intent(inout) :: piece
      integer, intent(out) :: ending
      type(outcome_t), intent(inout) :: outcome

      integer :: j
      logical :: found

      ending = ends_open
      call self%budget%spend()
      outcome%status = self%budget%status
      if (outcome%status /= status_ok) return
      self%duration = min(self%step, longest)
      piece%last = self%duration >= (1.0_wp - shortest)*self%remaining(t_end) .and. .not. longest < self%remaining(t_end)
      if (piece%last) self%duration = self%remaining(t_end)
      piece%duration = self%duration
      self%start = self%z
      associate (scheme => self%scheme, transition => self%transition)
         call scheme%take(self%system, self%duration, self%z, found)
         if (.not. found) outcome%status = status_no_contact_forces
         if (.not. found) return
         outcome%pieces = outcome%pieces + 1
         outcome%steps = outcome%steps + 1
         self%acceleration = scheme%dv/self%duration
         self%force = scheme%force0
         self%force_rate = (scheme%force1 - scheme%force0)/self%duration
         transition%changes = 0
         do j = 1, size(self%branch)
            associate (branch => scheme%dynamics%mode%branch(j), before => transition%dynamics%mode%branch(j))
               if (branch /= before) call transition%note(j, branch)
               before = branch
            end associate
         end do
         if (transition%changes > 0) ending = ends_noted
      end associate
   end subroutine advance

   !> The piece is this moment.
   subroutine stand(self, outcome)
      class(moreau_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      associate (unused => outcome)
         call self%scheme%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
      end associate
      self%duration = 0.0_wp
      self%start = self%z
      self%acceleration = 0.0_wp*self%acceleration
      self%force = self%scheme%force1
      self%force_rate = 0.0_wp*self%force
   end subroutine stand

   !> The scheme's own counters.
   subroutine finish(self, outcome)
      class(moreau_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      outcome%evaluations = self%scheme%rounds
      outcome%factorisations = self%scheme%factorisations
      outcome%impacts = self%scheme%impacts
   end subroutine finish

   !> No derivatives are carried: impacts within a step have none.
   subroutine transport(self)
      class(moreau_t), intent(inout) :: self

      self%differentiable = .false.
   end subroutine transport

   !> State z (2m) and its rates (2m) at `tau` s after the start of the piece, and the excitation there.
   subroutine look(self, tau, z, rates)
      class(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: z(:), rates(:)

      associate (m => self%system%m, a => self%acceleration, v => self%start(self%system%m + 1:))
         z(:m) = self%start(:m) + tau*(v + tau*(0.5_wp*a))
         z(m + 1:) = v + tau*a
         rates(:m) = z(m + 1:)
         rates(m + 1:) = a
      end associate
      call self%scheme%dynamics%excitation%look(self%system%machine%tone, tau)
   end subroutine look

   !> Observable `form` at `tau`, its rate, and the sizes of the terms that both are the sum of.
   subroutine observe(self, form, tau, value, rate, terms)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: value, rate, terms(2)

      real(wp), dimension(size(self%z)) :: z, rates

      call look(self, tau, z, rates)
      associate (observable => self%system%machine%observable(form), sum_of => self%system%observed(form), &
                 excitation => self%scheme%dynamics%excitation)
         if (observable%kind == observe_contact_force) then
            associate (j => observable%contact, sign => self%system%machine%contact(observable%contact)%force_sign)
               value = sign*(self%force(j) + tau*self%force_rate(j))
               rate = sign*self%force_rate(j)
               terms = [abs(self%force(j)) + tau*abs(rate), abs(rate)]
               if (self%duration > 0.0_wp) terms(2) = terms(2) + abs(self%force(j))/self%duration
            end associate
         else
            value = sum_of%value(z, excitation%phasor)
            rate = sum_of%rate(rates) + excitation%rate(self%system%machine%tone, sum_of%error, 1)
            ! What rests has a velocity that is the rounding of its step.
            associate (step => self%scheme%terms)
               terms = [sum_of%size(z), sum_of%size_of_rate(abs(rates) + [step, step/self%step], self%system%omega)]
            end associate
         end if
      end associate
   end subroutine observe

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      real(wp) :: rate, terms(2)

      call observe(self, form, tau, value, rate, terms)
   end function value

   !> Value, size and direction of observable `form` at `tau`; a rate of rounding is looked at again at the end of the piece.
   subroutine glimpse(self, form, tau, seen)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp) :: rate, terms(2), unused

      call observe(self, form, tau, seen%value, rate, terms)
      seen%size = terms(1)
      if (.not. abs(rate) > rounding*terms(2)) call observe(self, form, self%duration, unused, rate, terms)
      if (abs(rate) > rounding*terms(2)) seen%direction = nint(sign(1.0_wp, rate))
   end subroutine glimpse

   !> The first time after `tau` at which observable `form` no longer moves in `direction`, if it moves the other way at `tau_end`:
   !> a root of its rate. Two turns within a step are not seen.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      type(bracketed_root_t) :: root
      real(wp) :: first, rate, terms(2)

      associate (unused => turned)
         call observe(self, form, tau, value, first, terms)
      end associate
      call observe(self, form, tau_end, value, rate, terms)
      tau_found = tau_end
      found = direction*rate < -rounding*terms(2)
      if (.not. found) return
      ! It keeps its sign at the start, whatever rounding says there.
      call root%start(tau, max(direction*first, tiny(1.0_wp)), tau_end, direction*rate)
      do while (.not. root%done())
         call observe(self, form, root%trial, value, rate, terms)
         call root%take(direction*rate)
      end do
      tau_found = root%best
      value = self%value(form, tau_found)
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp), dimension(size(self%z)) :: z, rates

      call look(self, tau, z, rates)
      call self%system%to_coordinates(z, displacement, velocity)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp), dimension(size(self%z)) :: z, rates

      call look(self, tau, z, rates)
      associate (dynamics => self%scheme%dynamics)
         call dynamics%look_at_contact(self%system, j, z)
         s = dynamics%s(j)
         rate = dynamics%rate(j)
      end associate
      force = self%system%machine%contact(j)%force_sign*(self%force(j) + tau*self%force_rate(j))
   end subroutine contact

   !> Of rigid contacts and friction, whose impulse is that of the step: its force is the same all along, so that the work of an
   !> impact is that of its impulse at the mean of the speeds before and after.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      real(wp) :: rate(2), unused(2)

      known = .not. any(self%scheme%compliant == j)
      if (.not. known) return
      call self%contact(j, tau, unused(1), rate(1), unused(2))
      call self%contact(j, self%duration, unused(1), rate(2), unused(2))
      associate (force => self%scheme%force1(j))
         largest = max(largest, abs(force))
         impulse = impulse + self%system%machine%contact(j)%force_sign*force*(self%duration - tau)
         work = work + force*0.5_wp*(rate(1) + rate(2))*(self%duration - tau)
      end associate
   end subroutine contact_sums

   !> The step, s.
   pure function interval(self)
      class(moreau_t), intent(in) :: self
      real(wp) :: interval

      interval = self%step
   end function interval

end module razy_moreau_moreau
