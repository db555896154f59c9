!! Motion of any machine by a Runge-Kutta method, step by step, with one of three treatments of what is not smooth (THEORY 3).
!!
!! `event`: the end of each branch is found on the dense output of the step (razy_integrate_runge_kutta_locate), the motion goes
!! there, impacts and the branches that follow are settled (razy_integrate_runge_kutta_resolve), and the method starts anew
!! with nothing remembered but a step that served in the same mode before. Impacts that accumulate are carried to the end of
!! their sequence (razy_integrate_runge_kutta_bounces). `switching`: the branch is looked up in every right-hand side;
!! `smoothing`: there are none. With these two, changes of branch are seen at the ends of steps only: their times are late by
!! up to a step.
!!
!! A piece that observers see is one step, or the part of it before an event; `outcome%pieces` counts starts anew. Contact forces
!! are those of the laws and constraints, without the impulses of impacts.
module razy_integrate_runge_kutta
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_contact_contact_law, only: branch_sticking
   use razy_integrate_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, status_blow_up, &
                                        status_chatter, status_event_limit, status_no_contact_forces, status_ok, &
                                        status_step_limit, status_step_underflow
   use razy_integrate_runge_kutta_bounces, only: bounces_t
   use razy_integrate_runge_kutta_doubts, only: step_doubts_t
   use razy_integrate_runge_kutta_locate, only: locator_t
   use razy_integrate_runge_kutta_memory, only: step_memory_t
   use razy_integrate_runge_kutta_resolve, only: resolution_t
   use razy_integrate_runge_kutta_view, only: view_t
   use razy_integrate_stepper, only: stepper_t
   use razy_integrate_mode, only: treat_by_events, treat_by_smoothing, treat_by_switching
   use razy_machine_machine, only: machine_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: new_runge_kutta, runge_kutta_t

   type, extends(integrator_t) :: runge_kutta_t
      type(method_t) :: method
      type(view_t) :: view
      type(locator_t) :: locator
      type(resolution_t) :: resolution
      type(bounces_t) :: bounces
      type(step_memory_t) :: memory
      type(step_doubts_t) :: doubts
      !> Time from which the field counts, s (sum of both), and the time of the state z since then.
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp, tau = 0.0_wp
      real(wp), allocatable :: z(:), z_next(:)
      !> Branches that observers are shown, and those that follow.
      integer, allocatable :: shown(:), following(:)
      !> Whether the method starts anew, and events without time between them so far.
      logical :: anew = .true., opening = .true.
      integer :: standing = 0
      real(wp) :: t_end = 0.0_wp
   contains
      procedure :: prepare
      procedure :: run
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: branch_now
      procedure :: interval
      procedure :: final_state
   end type runge_kutta_t

   !> The field's time starts again after this angle of the fastest excitation, so that its rounding stays small.
   real(wp), parameter :: longest_angle = 30.0_wp
   !> A state beyond is a blow-up; a step below this part of the motion is an underflow.
   real(wp), parameter :: largest = 1.0e100_wp, least_step = 1.0e-6_wp*epsilon(1.0_wp)
   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> An event before this part of a step is looked for again in a shorter step.
   real(wp), parameter :: least_share = 0.125_wp
   !> Part of a step that may be made along its slope: the square is rounding.
   real(wp), parameter :: along_slope = 1.0e-8_wp

contains

   !> The integrator for a method that razy_machine_method has checked.
   subroutine new_runge_kutta(self, method)
      type(runge_kutta_t), intent(inout) :: self
      type(method_t), intent(in) :: method

      self%method = method
   end subroutine new_runge_kutta

   !> Take a machine.
   subroutine prepare(self, machine, keep_all, error)
      class(runge_kutta_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      associate (field => self%view%field)
         call field%attach(machine, keep_all, error)
         if (allocated(error)) return
         field%treatment = treat_by_events
         if (self%method%treatment == "switching") field%treatment = treat_by_switching
         if (self%method%treatment == "smoothing") field%treatment = treat_by_smoothing
         field%sharpness = self%method%sharpness
         field%band = self%method%band
         if (allocated(self%z)) deallocate (self%z, self%z_next, self%shown, self%following)
         allocate (self%z(2*field%m), self%z_next(2*field%m), source=0.0_wp)
         allocate (self%shown(size(field%branch)), self%following(size(field%branch)), source=1)
         call self%locator%attach(field)
         call self%resolution%attach(field)
         call self%bounces%attach(field)
         call self%view%stepper%prepare(self%method, 2*field%m)
      end associate
      call self%view%attach()
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(runge_kutta_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      type(piece_t) :: piece

      piece%by => self
      self%t_end = t_end
      self%view%field%evaluations = 0
      self%view%field%jacobians = 0
      call self%view%stepper%prepare(self%method, size(self%z))
      call begin(self, piece, observers, outcome)
      do while (outcome%status == status_ok .and. remaining(self) > 0.0_wp)
         if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         if (outcome%events >= most_events) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
         call next_piece(self, piece, observers, outcome)
      end do
      outcome%time = self%time + (self%time_low + self%tau)
      if (outcome%status == status_ok) outcome%time = t_end
      outcome%evaluations = self%view%field%evaluations
      outcome%jacobians = self%view%field%jacobians
      outcome%rejected = self%view%stepper%rejected_steps
      outcome%doubts = self%doubts%count
      outcome%doubt_time = self%doubts%first
   end subroutine run

   !> Time left, s.
   pure function remaining(self) result(time)
      type(runge_kutta_t), intent(in) :: self
      real(wp) :: time

      time = ((self%t_end - self%time) - self%time_low) - self%tau
   end function remaining

   !> State and branches at the time 0, made consistent: out of rigid stops, impacts of what approaches, sticking or sliding.
   subroutine begin(self, piece, observers, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      logical :: moved

      self%time = 0.0_wp
      self%time_low = 0.0_wp
      self%tau = 0.0_wp
      self%standing = 0
      self%anew = .true.
      call self%memory%forget()
      call self%bounces%forget()
      associate (field => self%view%field, guards => self%locator%guards)
         call field%first_state(self%z)
         call self%doubts%begin(field)
         guards%delta = 1.0e-9_wp*self%t_end
         guards%count = 0
         call guards%measure(field, 0.0_wp, self%z, .true.)
         if (field%treatment == treat_by_events) then
            call self%resolution%push_out(field, guards, 0.0_wp, self%z, moved)
            if (self%resolution%found) then
               self%locator%hit = .false.
               call self%resolution%settle(field, guards, self%locator%hit, 0.0_wp, self%z)
            end if
            if (.not. self%resolution%found) then
               outcome%status = status_no_contact_forces
               return
            end if
            self%following = field%branch
            call after_impacts(self, outcome)
            self%shown = field%branch
            self%view%z_stop = self%z
            if (self%resolution%impacts > 0) call show_changes(self, piece, observers, outcome, 1)
         end if
         call field%enter_mode()
         self%shown = field%branch
      end associate
   end subroutine begin

   !> One accepted step and what ends it.
   subroutine next_piece(self, piece, observers, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: theta
      logical :: dense, found, last

      call start_field(self)
      call self%view%field%start_step(self%tau)
      call take_step(self, last, outcome)
      if (outcome%status /= status_ok) return
      outcome%steps = outcome%steps + 1
      found = .false.
      dense = .false.
      associate (view => self%view, field => self%view%field, stepper => self%view%stepper)
         if (field%treatment == treat_by_events) then
            call self%locator%find(field, stepper, self%tau, self%z, found, theta, dense)
            if (found .and. theta < least_share .and. .not. polished(stepper)) call shorten(self, found, theta, dense)
            call self%doubts%of_turns(self%locator, field, self%method, stepper, self%z, self%time + self%tau)
         end if
         if (self%opening) call self%memory%keep(field%branch, stepper%h_next)
         self%opening = .false.
         last = last .and. .not. stepper%h < remaining(self)
         view%start = self%tau
         view%z_start = self%z
         view%h = stepper%h
         view%dense = dense
         view%moment = .false.
         view%duration = stepper%h
         if (found) then
            view%duration = theta*stepper%h
            call stepper%at(theta, view%z_stop)
            if (polished(stepper)) call polish(self)
         else
            view%z_stop = stepper%z_end
            call field%keep_constraints(self%tau + stepper%h, view%z_stop)
            if (field%treatment == treat_by_events) call self%locator%keep_at_rest(field, view%z_stop)
         end if
         piece%time = self%time
         piece%time_low = self%time_low
         call add_time(piece%time, piece%time_low, self%tau)
         piece%duration = view%duration
         piece%contact = 0
         piece%last = last .and. .not. found
         if (field%treatment == treat_by_events) then
            call end_by_event(self, found, piece, observers, outcome)
         else
            call end_by_step(self, piece, observers, outcome)
         end if
      end associate
      if (piece%last .and. outcome%status == status_ok) then
         self%time = self%t_end
         self%time_low = 0.0_wp
         self%tau = 0.0_wp
      end if
   end subroutine next_piece

   !> Whether the last step to an event is made anew: it pays where a step costs little and dense output is of lower order.
   pure logical function polished(stepper)
      type(stepper_t), intent(in) :: stepper

      polished = stepper%adaptive .and. .not. stepper%implicit .and. stepper%dense_order < stepper%order
   end function polished

   !> Count the field's time from now if the method starts anew, or if it has run long enough.
   subroutine start_field(self)
      class(runge_kutta_t), intent(inout) :: self

      if (.not. self%anew .and. self%tau*self%view%fastest < longest_angle) return
      call add_time(self%time, self%time_low, self%tau)
      call self%bounces%count_from(self%tau)
      self%tau = 0.0_wp
      call self%view%field%start_piece(self%time, self%time_low)
   end subroutine start_field

   !> Try steps until one is accepted; `last`: it ends with the motion.
   subroutine take_step(self, last, outcome)
      class(runge_kutta_t), intent(inout) :: self
      logical, intent(out) :: last
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: h, rest
      logical :: accepted, failed

      associate (field => self%view%field, stepper => self%view%stepper)
         rest = remaining(self)
         h = stepper%h_next
         if (self%anew) then
            outcome%pieces = outcome%pieces + 1
            call stepper%restart()
            h = self%memory%step(field%branch)
            if (.not. stepper%adaptive .or. .not. h > 0.0_wp) call stepper%first_step(field, self%tau, self%z, rest, h)
            if (field%treatment == treat_by_events) then
               self%locator%guards%delta = 1.0e-5_wp*min(h, rest)
               call self%locator%start(field, self%tau, self%z)
            end if
            self%anew = .false.
            self%opening = .true.
         else if (field%treatment == treat_by_events) then
            call self%locator%advance()
         end if
         do
            last = h >= rest*(1.0_wp - 4*eps)
            if (last) h = rest
            if (self%bounces%landing .and. self%bounces%tau - self%tau <= h) then
               h = max(self%bounces%tau - self%tau, 0.0_wp)
               last = .false.
            end if
            if (stepper%accepted_steps + stepper%rejected_steps >= self%method%most_steps) outcome%status = status_step_limit
            if (outcome%status /= status_ok) return
            call stepper%attempt(field, self%tau, self%z, h, accepted, failed)
            if (accepted) return
            h = stepper%h_next
            if (h <= least_step*self%t_end) outcome%status = merge(status_blow_up, status_step_underflow, failed)
            if (outcome%status /= status_ok) return
         end do
      end associate
   end subroutine take_step

   !> An event early in a long step is found again in a shorter one: a polynomial over the whole step would lose digits there.
   subroutine shorten(self, found, theta, dense)
      class(runge_kutta_t), intent(inout) :: self
      logical, intent(inout) :: found, dense
      real(wp), intent(inout) :: theta

      real(wp) :: h
      logical :: accepted, failed

      associate (stepper => self%view%stepper)
         h = 2*theta*stepper%h
         if (.not. h > least_step*self%t_end) return
         call stepper%restart()
         call stepper%attempt(self%view%field, self%tau, self%z, h, accepted, failed)
         if (.not. accepted) then
            call stepper%restart()
            call stepper%attempt(self%view%field, self%tau, self%z, 0.5_wp*h/theta, accepted, failed)
         end if
         call self%locator%find(self%view%field, stepper, self%tau, self%z, found, theta, dense)
      end associate
   end subroutine shorten

   !> Where the dense output is of lower order than the method: step to the event by the method itself. What is left of the way is
   !> done along the slope there if its square is rounding, and by another step if not.
   subroutine polish(self)
      class(runge_kutta_t), intent(inout) :: self

      real(wp) :: g(self%locator%guards%count), rate(self%locator%guards%count), h, rest, whole
      integer :: i, round
      logical :: accepted, failed

      associate (view => self%view, stepper => self%view%stepper, guards => self%locator%guards)
         whole = view%h
         h = view%duration
         if (.not. h > 0.0_wp) return
         do round = 1, 4
            call stepper%restart()
            call stepper%attempt(view%field, self%tau, self%z, h, accepted, failed)
            if (.not. accepted) exit
            view%h = h
            view%duration = h
            view%dense = .false.
            view%z_stop = stepper%z_end
            call guards%look(view%field, self%tau + h, view%z_stop, g, rate)
            i = minloc(g, dim=1, mask=self%locator%hit(:size(g)))
            if (.not. abs(g(i)) < 0.1_wp*h*abs(rate(i))) return
            rest = -g(i)/rate(i)
            if (abs(rest) <= along_slope*h) then
               view%duration = h + rest
               view%z_stop = stepper%z_end + rest*stepper%dz_end
               return
            end if
            h = h + rest
         end do
         if (accepted) return
         ! The shorter step was refused: the dense output of the whole one has to do.
         call stepper%restart()
         call stepper%attempt(view%field, self%tau, self%z, whole, accepted, failed)
         view%h = whole
         call stepper%prepare_dense(view%field, self%tau, self%z)
         view%dense = .true.
         call stepper%at(view%duration/whole, view%z_stop)
      end associate
   end subroutine polish

   !> The end of a step with the treatment `event`: settle what was found there, and show the step.
   subroutine end_by_event(self, found, piece, observers, outcome)
      class(runge_kutta_t), intent(inout) :: self
      logical, intent(in) :: found
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: tau
      logical :: landed

      associate (view => self%view, field => self%view%field)
         tau = self%tau + view%duration
         landed = self%bounces%landing .and. .not. tau < self%bounces%tau
         if (.not. found .and. .not. landed) then
            call show_piece(observers, piece)
            self%tau = tau
            self%z = view%z_stop
            return
         end if
         self%shown = field%branch
         self%z_next = view%z_stop
         self%resolution%changes = 0
         self%resolution%impacts = 0
         self%resolution%impacted = .false.
         if (found) then
            call self%resolution%settle(field, self%locator%guards, self%locator%hit, tau, self%z_next)
            if (.not. self%resolution%found) outcome%status = status_no_contact_forces
         end if
         self%following = field%branch
         if (landed) then
            call self%bounces%report(field, tau, self%resolution)
            outcome%accumulations = outcome%accumulations + self%bounces%landed
         end if
         field%branch = self%shown
         call field%enter_mode()
         if (self%resolution%changes > 0) then
            piece%contact = self%resolution%contact(1)
            piece%branch = self%resolution%branch(1)
            outcome%events = outcome%events + 1
         end if
         call show_piece(observers, piece)
         self%standing = merge(self%standing + 1, 0, view%duration <= 4*eps*(self%time + tau))
         if (self%standing > 8*size(field%branch) + 8 .and. outcome%status == status_ok) outcome%status = status_chatter
         self%tau = tau
         self%z = self%z_next
         view%z_stop = self%z
         view%start = tau
         field%branch = self%following
         call field%enter_mode()
         call after_impacts(self, outcome)
         self%shown = field%branch
         call show_changes(self, piece, observers, outcome, 2)
         self%anew = .true.
      end associate
   end subroutine end_by_event

   !> Count impacts, and carry those that have accumulated to the end of their sequence.
   subroutine after_impacts(self, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      logical :: gathered

      outcome%impacts = outcome%impacts + self%resolution%impacts
      call self%bounces%gather(self%view%field, self%locator%guards, self%resolution, self%tau, self%z, gathered)
      if (.not. self%resolution%found) outcome%status = status_no_contact_forces
      if (gathered) self%view%z_stop = self%z
   end subroutine after_impacts

   !> Show changes of branch from number `first` on as pieces of no duration.
   subroutine show_changes(self, piece, observers, outcome, first)
      class(runge_kutta_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome
      integer, intent(in) :: first

      integer :: i

      self%view%moment = .true.
      self%view%duration = 0.0_wp
      piece%time = self%time
      piece%time_low = self%time_low
      call add_time(piece%time, piece%time_low, self%tau)
      do i = first, self%resolution%changes
         piece%duration = 0.0_wp
         piece%last = .false.
         piece%contact = self%resolution%contact(i)
         piece%branch = self%resolution%branch(i)
         outcome%events = outcome%events + 1
         call show_piece(observers, piece)
      end do
   end subroutine show_changes

   !> The end of a step with the treatments that look at nothing inside it: branches that have changed since the last.
   subroutine end_by_step(self, piece, observers, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: j

      associate (view => self%view, field => self%view%field)
         call field%look_at_contacts(self%tau + view%duration, view%z_stop)
         self%resolution%changes = 0
         do j = 1, size(self%shown)
            associate (law => field%machine%contact(j)%law)
               self%following(j) = law%initial_branch(field%s(j), field%rate(j))
               if (law%constraint(branch_sticking) .and. field%treatment == treat_by_switching &
                   .and. abs(field%rate(j)) <= field%band) self%following(j) = branch_sticking
            end associate
         end do
         call self%doubts%of_ends(field, self%method, view%stepper, self%shown, self%following, self%z, self%time + self%tau)
         do j = 1, size(self%shown)
            if (self%following(j) == self%shown(j)) cycle
            self%resolution%changes = self%resolution%changes + 1
            self%resolution%contact(self%resolution%changes) = j
         end do
         if (self%resolution%changes > 0) then
            piece%contact = self%resolution%contact(1)
            piece%branch = self%following(piece%contact)
            outcome%events = outcome%events + 1
         end if
         call show_piece(observers, piece)
         self%tau = self%tau + view%duration
         self%z = view%z_stop
         if (self%resolution%changes < 1) return
         self%shown = self%following
         view%start = self%tau
         do j = 2, self%resolution%changes
            view%moment = .true.
            piece%time = self%time
            piece%time_low = self%time_low
            call add_time(piece%time, piece%time_low, self%tau)
            piece%duration = 0.0_wp
            piece%contact = self%resolution%contact(j)
            piece%branch = self%following(piece%contact)
            outcome%events = outcome%events + 1
            call show_piece(observers, piece)
         end do
      end associate
   end subroutine end_by_step

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = self%view%value(form, tau)
   end function value

   !> Value, size and direction of observable `form` at `tau`.
   subroutine glimpse(self, form, tau, seen)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      call self%view%glimpse(form, tau, seen)
   end subroutine glimpse

   !> The next turn of an observable, by probes of the dense output.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      associate (unused => turned)
         call self%view%next_turn(form, tau, tau_end, direction, found, tau_found, value)
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: time, z(size(self%z))

      call self%view%state_at(tau, time, z)
      call self%view%field%to_coordinates(z, displacement, velocity)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp) :: a(self%view%field%m), time, z(size(self%z))

      call self%view%state_at(tau, time, z)
      associate (field => self%view%field)
         call field%accelerate(time, z, a)
         force = field%machine%contact(j)%force_sign*field%force(j)
         call field%look_at_contacts(time, z)
         s = field%s(j)
         rate = field%rate(j)
      end associate
   end subroutine contact

   !> Branch of contact j.
   pure function branch_now(self, j) result(branch)
      class(runge_kutta_t), intent(in) :: self
      integer, intent(in) :: j
      integer :: branch

      branch = self%shown(j)
   end function branch_now

   !> The step: natural times are the steps'.
   pure function interval(self)
      class(runge_kutta_t), intent(in) :: self
      real(wp) :: interval

      interval = self%view%h
   end function interval

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(runge_kutta_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call self%view%field%to_coordinates(self%z, displacement, velocity)
   end subroutine final_state

end module razy_integrate_runge_kutta
