!! Moreau–Jean time stepping: motion with rigid unilateral contacts, Newton's restitution and Coulomb friction, one contact or
!! many, without finding events; compliant laws as implicit forces (razy_moreau_step).
!!
!! The step is fixed. Pieces are the steps; events are changes of a contact's status, at the ends of steps: a rigid contact is
!! closed in a step if it has an impulse there. Known properties: order 1 as soon as there are impacts, 2 with θ = 1/2 on smooth
!! motion. With θ = 1/2, constant loads, no friction and no compliant laws the energy never grows for ε in [0, 1] (Acary, Z. Angew.
!! Math. Mech. 96 (2016) 585–603). An accumulation of impacts is passed within a few steps and ends in rest. Contact is kept on
!! the level of velocities: a gap that is closed stays where it was when it closed, up to h|u|/2 beyond the surface, and a
!! penetration at the start is not undone.
!!
!! What observers see: within a step of length h displacements are the parabola q(τ) = q + v τ + θ (Δv/h) τ², velocities the line
!! v + (Δv/h) τ; with θ = 1/2 the second is the rate of the first. So the jump of an impact is spread over its step. Excitation
!! is exact. Contact forces, known as means over steps (rigid contacts, friction) or at their ends (compliant laws), are joined by
!! lines.
module razy_moreau_moreau
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, qp, wp
   use razy_core_tone, only: add_time
   use razy_linalg_lapack, only: dpotrf
   use razy_machine_machine, only: machine_t, mass_complaint, observe_contact_force
   use razy_moreau_state, only: moreau_step_t
   use razy_moreau_step, only: begin_steps, guess_first_forces, take_step
   use razy_motion_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, status_beyond_law, &
                                     status_blow_up, status_event_limit, status_no_contact_forces, status_ok
   implicit none(type, external)
   private

   public :: moreau_t

   !> The integrator. `step` (h, s), `theta` in [1/2, 1] are to be set before `prepare`.
   type, extends(integrator_t) :: moreau_t
      real(wp) :: step = 0.0_wp, theta = 0.5_wp
      type(moreau_step_t), private :: scheme
      !> The piece as it is shown: time of its start (sum of both) and length, s; state (n) there, the derivative of velocity;
      !> contact forces (contacts) and their rates.
      real(wp), private :: time = 0.0_wp, time_low = 0.0_wp, duration = 0.0_wp
      real(wp), allocatable, private :: q(:), v(:), acceleration(:), force(:), force_rate(:)
   contains
      procedure :: prepare
      procedure :: run
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: interval
      procedure :: final_state
   end type moreau_t

   !> A state beyond this is a blow-up; a last step shorter than this part of a step is none.
   real(wp), parameter :: largest = 1.0e100_wp, shortest = 1.0e-9_wp
   !> Rates below this part of their terms are rounding.
   real(wp), parameter :: rounding = 64*epsilon(1.0_wp)

contains

   !> Take a machine; all coordinates are followed whatever `keep_all` says.
   subroutine prepare(self, machine, keep_all, error)
      class(moreau_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: mass(:, :)
      integer :: info

      associate (unused => keep_all)
         if (.not. self%step > 0.0_wp) call raise(error, "Moreau-Jean time stepping needs a positive step")
         if (.not. (self%theta >= 0.5_wp .and. self%theta <= 1.0_wp)) then
            call raise(error, "theta of Moreau-Jean time stepping must be from 0.5 to 1")
         end if
         if (allocated(error)) return
         mass = machine%mass
         call dpotrf("L", size(mass, 1), mass, size(mass, 1), info)
         if (info /= 0) call raise(error, mass_complaint(machine, info))
         if (allocated(error)) return
         self%scheme%machine = machine
         self%scheme%theta = self%theta
      end associate
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every step to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(moreau_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      integer(i8) :: k, steps
      real(wp) :: time, time_low, h
      integer :: j
      logical :: found

      call self%budget%begin()
      call begin_steps(self%scheme)
      self%branch = self%scheme%branch1
      steps = max(1_i8, ceiling(t_end/self%step - shortest, i8))
      do k = 1, steps
         call self%budget%spend()
         outcome%status = self%budget%status
         if (outcome%status /= status_ok) exit
         call time_of(k - 1, self%step, time, time_low)
         h = self%step
         if (k == steps) h = (t_end - time) - time_low
         call take_step(self%scheme, time, time_low, h, found)
         if (.not. found) then
            outcome%status = status_no_contact_forces
         else if (.not. (all(abs(self%scheme%q1) <= largest) .and. all(abs(self%scheme%v1) <= largest))) then
            outcome%status = status_blow_up
         end if
         if (outcome%status /= status_ok) exit
         if (k == 1) call guess_first_forces(self%scheme)
         do j = 1, size(self%branch)
            if (self%scheme%machine%contact(j)%law%branch(self%scheme%branch1(j))%outside) outcome%status = status_beyond_law
         end do
         outcome%steps = k
         call view_step(self, time, time_low)
         call show_step(self, k == steps, t_end, observers, outcome)
         if (outcome%events >= most_events .and. k < steps) then
            outcome%status = status_event_limit
         end if
         if (outcome%status /= status_ok) exit
      end do
      outcome%evaluations = self%scheme%rounds
      outcome%factorisations = self%scheme%factorisations
      outcome%impacts = self%scheme%impacts
   end subroutine run

   !> The time k h as the sum of two doubles.
   pure subroutine time_of(k, h, time, time_low)
      integer(i8), intent(in) :: k
      real(wp), intent(in) :: h
      real(wp), intent(out) :: time, time_low

      real(qp) :: product

      product = real(k, qp)*real(h, qp)
      time = real(product, wp)
      time_low = real(product - real(time, qp), wp)
   end subroutine time_of

   !> See the last step, which started at `time + time_low`.
   pure subroutine view_step(self, time, time_low)
      type(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_low

      associate (step => self%scheme)
         self%time = time
         self%time_low = time_low
         self%duration = step%h
         self%q = step%q0
         self%v = step%v0
         self%acceleration = (step%v1 - step%v0)/step%h
         self%force = step%force0
         self%force_rate = (step%force1 - step%force0)/step%h
      end associate
   end subroutine view_step

   !> Show the last step: one piece with the first change of status, and one without length for each further change.
   subroutine show_step(self, last, t_end, observers, outcome)
      class(moreau_t), intent(inout), target :: self
      logical, intent(in) :: last
      real(wp), intent(in) :: t_end
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(piece_t) :: piece
      integer :: changed

      piece%by => self
      piece%time = self%time
      piece%time_low = self%time_low
      piece%duration = self%duration
      do
         changed = findloc(self%branch /= self%scheme%branch1, .true., dim=1)
         piece%contact = changed
         piece%branch = 0
         if (changed > 0) piece%branch = self%scheme%branch1(changed)
         piece%last = last .and. changed == 0
         outcome%pieces = outcome%pieces + 1
         call show_piece(observers, piece)
         if (changed == 0) exit
         outcome%events = outcome%events + 1
         self%branch(changed) = self%scheme%branch1(changed)
         if (.not. (last .or. any(self%branch /= self%scheme%branch1))) exit
         call end_of(self, last, t_end, piece)
      end do
      outcome%time = piece%time + (piece%time_low + piece%duration)
      if (last) outcome%time = t_end
   end subroutine show_step

   !> Make `piece` the end of the last step, of no length.
   pure subroutine end_of(self, last, t_end, piece)
      class(moreau_t), intent(inout) :: self
      logical, intent(in) :: last
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece

      if (last) then
         piece%time = t_end
         piece%time_low = 0.0_wp
      else if (piece%duration > 0.0_wp) then
         call add_time(piece%time, piece%time_low, piece%duration)
      end if
      piece%duration = 0.0_wp
      self%time = piece%time
      self%time_low = piece%time_low
      self%duration = 0.0_wp
      self%q = self%scheme%q1
      self%v = self%scheme%v1
      self%force = self%scheme%force1
      self%acceleration = 0.0_wp*self%v
      self%force_rate = 0.0_wp*self%force
   end subroutine end_of

   !> Displacements (n) at `tau` s after the start of the piece.
   pure function displacement_of(self, tau) result(q)
      class(moreau_t), intent(in) :: self
      real(wp), intent(in) :: tau
      real(wp) :: q(size(self%q))

      q = self%q + tau*(self%v + tau*(self%theta*self%acceleration))
   end function displacement_of

   !> Velocities (n) at `tau`.
   pure function velocity_of(self, tau) result(v)
      class(moreau_t), intent(in) :: self
      real(wp), intent(in) :: tau
      real(wp) :: v(size(self%v))

      v = self%v + tau*self%acceleration
   end function velocity_of

   !> Derivative of `order` 0, 1 or 2 of observable `form` at `tau`, and the size of the terms that it is the sum of.
   pure subroutine observe(self, form, tau, order, value, terms)
      class(moreau_t), intent(in) :: self
      integer, intent(in) :: form, order
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: value, terms

      real(wp) :: q(size(self%q)), v(size(self%v))

      associate (observable => self%scheme%machine%observable(form))
         if (observable%kind == observe_contact_force) then
            call observe_force(self, observable%contact, tau, order, value, terms)
            return
         end if
         select case (order)
         case (0)
            q = displacement_of(self, tau)
            v = velocity_of(self, tau)
         case (1)
            q = self%v + 2*tau*(self%theta*self%acceleration)
            v = self%acceleration
         case default
            q = 2*(self%theta*self%acceleration)
            v = 0.0_wp
         end select
         value = dot_product(observable%on_displacement, q) + dot_product(observable%on_velocity, v)
         terms = dot_product(abs(observable%on_displacement), abs(q)) + dot_product(abs(observable%on_velocity), abs(v))
         if (order == 0) then
            value = value + observable%constant
            terms = terms + abs(observable%constant)
         end if
         call add_tones(self, observable%error, tau, order, value, terms)
      end associate
   end subroutine observe

   !> Add the derivative of Re(Σ error e^{iωt}).
   pure subroutine add_tones(self, error, tau, order, value, terms)
      class(moreau_t), intent(in) :: self
      complex(wp), intent(in) :: error(:)
      real(wp), intent(in) :: tau
      integer, intent(in) :: order
      real(wp), intent(inout) :: value, terms

      real(wp) :: at, at_low, cosine, sine
      complex(wp) :: turn
      integer :: t

      at = self%time
      at_low = self%time_low
      call add_time(at, at_low, tau)
      associate (tone => self%scheme%machine%tone)
         do t = 1, size(tone)
            if (.not. abs(error(t)) > 0.0_wp) cycle
            call tone(t)%phasor(at, at_low, cosine, sine)
            turn = error(t)*cmplx(cosine, sine, wp)*cmplx(0.0_wp, tone(t)%omega, wp)**order
            value = value + real(turn)
            terms = terms + abs(turn)
         end do
      end associate
   end subroutine add_tones

   pure subroutine observe_force(self, j, tau, order, value, terms)
      class(moreau_t), intent(in) :: self
      real(wp), intent(in) :: tau
      integer, intent(in) :: j, order
      real(wp), intent(out) :: value, terms

      select case (order)
      case (0)
         value = self%scheme%machine%contact(j)%force_sign*(self%force(j) + tau*self%force_rate(j))
         terms = abs(self%force(j)) + tau*abs(self%force_rate(j))
      case (1)
         value = self%scheme%machine%contact(j)%force_sign*self%force_rate(j)
         terms = abs(value)
         if (self%duration > 0.0_wp) terms = terms + abs(self%force(j))/self%duration
      case default
         value = 0.0_wp
         terms = 0.0_wp
      end select
   end subroutine observe_force

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      real(wp) :: terms

      call observe(self, form, tau, 0, value, terms)
   end function value

   !> Value, size and direction of observable `form` at `tau`.
   subroutine glimpse(self, form, tau, seen)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp) :: rate, terms
      integer :: order

      call observe(self, form, tau, 0, seen%value, seen%size)
      do order = 1, 2
         call observe(self, form, tau, order, rate, terms)
         if (abs(rate) > rounding*terms) then
            seen%direction = nint(sign(1.0_wp, rate))
            return
         end if
      end do
   end subroutine glimpse

   !> The first time after `tau` at which observable `form` no longer moves in `direction`, if it moves the other way at `tau_end`:
   !> bisection of its rate. Two turns within a step are not seen.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      real(wp) :: before, middle, rate, terms
      integer :: i

      associate (unused => turned)
         before = tau
         tau_found = tau_end
      end associate
      call observe(self, form, tau_end, 1, rate, terms)
      found = direction*rate < -rounding*terms
      if (found) then
         do i = 1, digits(1.0_wp)
            middle = 0.5_wp*(before + tau_found)
            if (.not. (middle > before .and. middle < tau_found)) exit
            call observe(self, form, middle, 1, rate, terms)
            if (direction*rate > 0.0_wp) then
               before = middle
            else
               tau_found = middle
            end if
         end do
      end if
      value = self%value(form, tau_found)
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`.
   subroutine state(self, tau, displacement, velocity)
      class(moreau_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      displacement = displacement_of(self, tau)
      velocity = velocity_of(self, tau)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(moreau_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp) :: terms

      associate (contact => self%scheme%machine%contact(j))
         terms = 0.0_wp
         s = dot_product(contact%w, displacement_of(self, tau)) + contact%offset
         rate = dot_product(contact%w, velocity_of(self, tau)) + contact%drive
         call add_tones(self, contact%error, tau, 0, s, terms)
         call add_tones(self, contact%error, tau, 1, rate, terms)
         force = contact%force_sign*(self%force(j) + tau*self%force_rate(j))
      end associate
   end subroutine contact

   !> The step, s.
   pure function interval(self)
      class(moreau_t), intent(in) :: self
      real(wp) :: interval

      interval = self%step
   end function interval

   !> Displacements and velocities (n each) that the last run ended with.
   subroutine final_state(self, displacement, velocity)
      class(moreau_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      displacement = self%scheme%q1
      velocity = self%scheme%v1
   end subroutine final_state

end module razy_moreau_moreau
