!! Motion of any machine by a Runge-Kutta method, step by step, with one of three treatments of what is not smooth
!! (source thesis, 3.3).
!!
!! `event`: the end of each mode is found on the dense output of the step (razy_runge_kutta_event_finder), the motion goes
!! there, the transition says what follows, and the method starts anew with nothing remembered but a step that served in the
!! same mode before. `switching`: the branch is looked up in every right-hand side; `smoothing`: there are none. With these
!! two, changes of branch are seen at the ends of steps only: their times are late by up to a step, and what happens between
!! is not seen.
!!
!! A piece that observers see is one step, or the part of one before an event; `outcome%pieces` counts starts anew. Contact
!! forces are those of the laws and constraints, without the impulses of impacts.
module razy_runge_kutta_runge_kutta
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_flow, only: ends_in_event, ends_noted, ends_open, flow_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: glimpse_t, outcome_t, piece_t, status_blow_up, status_ok, &
                                     status_step_underflow
   use razy_motion_method, only: method_t
   use razy_runge_kutta_event_finder, only: event_finder_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_runge_kutta_methods_variation, only: carry
   use razy_runge_kutta_observed_step, only: observed_step_t
   use razy_runge_kutta_right_hand_side, only: treat_by_events, treat_by_smoothing, treat_by_switching
   use razy_runge_kutta_visits, only: long, visits_t
   implicit none(type, external)
   private

   public :: new_runge_kutta, runge_kutta_t

   type, extends(flow_t) :: runge_kutta_t
      type(method_t), private :: method
      type(stepper_t), private :: stepper
      type(event_finder_t), private :: finder
      type(observed_step_t), private :: seen
      type(visits_t), private :: visits
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
      procedure :: interval
   end type runge_kutta_t

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> A step below this part of the motion is an underflow.
   real(wp), parameter :: least_step = 1.0e-6_wp*eps
   !> Part of the way to an expected event that a step goes.
   real(wp), parameter :: beyond = 1.05_wp
   !> Steps ahead in which the end of a mode is looked for; part of the way there, and of the step that may go beyond it, that are
   !> left to go where none may go as far: steps become shorter towards what is not smooth.
   real(wp), parameter :: ahead = 4.0_wp, left_of_way = 0.3_wp, left_of_closing = 0.95_wp
   !> An event before this part of a step is looked for again in a shorter step.
   real(wp), parameter :: least_share = 0.125_wp
   !> Part of a step that may be made along its slope: the square is rounding.
   real(wp), parameter :: along_slope = 1.0e-8_wp
   !> Angle of the fastest excitation between points that resolve the motion.
   real(wp), parameter :: longest_angle = 0.5_wp

contains

   !> The integrator for a method that razy_motion_method has checked.
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

      real(wp) :: sharpness

      sharpness = merge(self%method%sharpness, 0.0_wp, self%method%treatment == "smoothing")
      call self%take(machine, keep_all, .false., sharpness, error)
      if (allocated(error)) return
      associate (rhs => self%stepper%rhs)
         rhs%treatment = treat_by_events
         if (self%method%treatment == "switching") rhs%treatment = treat_by_switching
         if (self%method%treatment == "smoothing") rhs%treatment = treat_by_smoothing
         self%finds_events = rhs%treatment == treat_by_events
         rhs%band = self%method%band
         call rhs%dynamics%make_room(self%system, sharpness)
         call self%finder%make_room(size(self%hit))
         call self%seen%make_room(self%system)
         call self%stepper%prepare(self%method, size(self%z))
      end associate
   end subroutine prepare

   !> If the mode is new: slope and guards there, and a step to begin with, that of the last time if there is one.
   subroutine enter(self, t_end, outcome)
      class(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: h, rest

      if (self%starting) then
         call self%visits%forget()
         self%finder%near_misses = 0
         call self%stepper%prepare(self%method, size(self%z))
      end if
      associate (stepper => self%stepper, rhs => self%stepper%rhs, guards => self%transition%guards)
         call rhs%dynamics%excitation%shift_like(self%transition%dynamics%excitation)
         call rhs%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
         if (.not. self%anew) return
         outcome%pieces = outcome%pieces + 1
         rest = self%remaining(t_end)
         rhs%dynamics%mode%branch = self%transition%dynamics%mode%branch
         rhs%dynamics%sticks = self%transition%dynamics%sticks
         rhs%dynamics%stuck = self%transition%dynamics%stuck
         if (self%finds_events) rhs%dynamics%mode%press = self%transition%dynamics%mode%press
         call rhs%enter(self%system)
         stepper%rough = self%finds_events .and. acts_curved(self)
         call stepper%restart()
         call self%visits%recall(rhs%dynamics%mode%branch)
         h = self%visits%known(self%visits%now)%opening
         if (.not. stepper%adaptive .or. .not. h > 0.0_wp) call stepper%first_step(self%system, self%z, rest, h)
         stepper%h_next = h
         call stepper%begin(self%system, self%z)
         if (.not. self%finds_events) return
         guards%delta = 1.0e-5_wp*min(h, rest)
         call guards%list(self%system, rhs%dynamics%mode)
         call self%finder%begin(self%system, rhs%dynamics, guards, self%z, stepper%dz_end)
      end associate
   end subroutine enter

   !> Whether a curved law other than friction's acts in the mode.
   pure function acts_curved(self) result(any_does)
      type(runge_kutta_t), intent(in) :: self
      logical :: any_does

      integer :: k

      any_does = .false.
      associate (mode => self%stepper%rhs%dynamics%mode)
         do k = 1, mode%acts
            associate (contact => self%system%machine%contact(mode%acting(k)))
               any_does = any_does .or. .not. (contact%law%of_normal .or. (contact%law%piecewise_linear &
                                                                           .and. .not. allocated(contact%frame)))
            end associate
         end do
      end associate
   end function acts_curved

   !> Make one accepted step, and look for an event in it.
   subroutine advance(self, t_end, longest, piece, ending, outcome)
      class(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: t_end, longest
      type(piece_t), intent(inout) :: piece
      integer, intent(out) :: ending
      type(outcome_t), intent(inout) :: outcome

      ending = ends_open
      if (self%finds_events) call self%finder%advance(self%transition%guards)
      call take_step(self, t_end, longest, piece%last, outcome)
      if (outcome%status /= status_ok) return
      outcome%steps = outcome%steps + 1
      associate (stepper => self%stepper, seen => self%seen, finder => self%finder)
         if (self%finds_events) then
            call finder%find(self%system, self%transition%guards, stepper, self%hit)
            if (finder%found .and. finder%theta < least_share .and. .not. polished(stepper)) call shorten(self, t_end)
         end if
         call self%visits%keep(stepper%h, stepper%h_next)
         piece%last = piece%last .and. .not. finder%found .and. .not. stepper%h < self%remaining(t_end)
         seen%moment = .false.
         seen%duration = stepper%h
         if (finder%found) then
            ending = ends_in_event
            seen%duration = finder%theta*stepper%h
            call stepper%output%at(finder%theta, seen%z_stop)
            if (polished(stepper) .and. .not. stepper%fine_at(finder%theta)) call polish(self)
            self%transition%dynamics%excitation = stepper%rhs%dynamics%excitation
         else
            seen%z_stop = stepper%z_end
            call stepper%rhs%dynamics%keep_constraints(self%system, stepper%h, seen%z_stop)
            if (self%finds_events) call finder%keep_at_rest(self%system, self%transition%guards, seen%z_stop)
            if (.not. seen%duration < longest) self%transition%dynamics%excitation = stepper%rhs%dynamics%excitation
         end if
         piece%duration = seen%duration
         self%z = seen%z_stop
      end associate
      if (.not. self%finds_events) call note_changes(self, ending)
   end subroutine advance

   !> Whether the last step to an event is made anew: it pays where a step costs little and dense output is of lower order.
   pure logical function polished(stepper)
      type(stepper_t), intent(in) :: stepper

      polished = stepper%adaptive .and. .not. stepper%implicit .and. stepper%tableau%dense_order < stepper%tableau%order
   end function polished

   !> Try steps of at most `longest` until one is accepted; `last`: it ends with the motion.
   subroutine take_step(self, t_end, longest, last, outcome)
      type(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: t_end, longest
      logical, intent(out) :: last
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: h, rest, way
      logical :: accepted, failed

      associate (stepper => self%stepper, visits => self%visits, known => self%visits%known(self%visits%now))
         rest = self%remaining(t_end)
         h = stepper%h_next
         way = long
         if (self%finds_events .and. stepper%adaptive) way = self%finder%expected(self%transition%guards, ahead*h)
         do
            h = min(h, merge(beyond*way, max(0.5_wp*way, way - max(left_of_way*way, left_of_closing*known%closing)), &
                             way <= known%closing))
            last = h >= rest*(1.0_wp - 4*eps)
            if (last) h = rest
            if (longest <= h) then
               h = longest
               last = .false.
            end if
            call self%budget%spend(rest)
            outcome%status = self%budget%status
            if (outcome%status /= status_ok) return
            stepper%plain = stepper%rough .and. (visits%opening .or. h > way)
            call stepper%attempt(self%system, self%z, h, accepted, failed)
            if (stepper%rough .and. h > way) call visits%learn_closing(accepted, stepper%h_next)
            if (accepted) return
            h = stepper%h_next
            if (h <= least_step*t_end) outcome%status = merge(status_blow_up, status_step_underflow, failed)
            if (outcome%status /= status_ok) return
         end do
      end associate
   end subroutine take_step

   !> An event early in a long step is found again in a shorter one: a polynomial over the whole step would lose digits there.
   subroutine shorten(self, t_end)
      type(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: t_end

      real(wp) :: h
      logical :: accepted, failed

      associate (stepper => self%stepper, theta => self%finder%theta)
         h = 2*theta*stepper%h
         if (.not. h > least_step*t_end) return
         call stepper%restart()
         call stepper%attempt(self%system, self%z, h, accepted, failed)
         if (.not. accepted) then
            call stepper%restart()
            call stepper%attempt(self%system, self%z, 0.5_wp*h/theta, accepted, failed)
         end if
         call self%finder%find(self%system, self%transition%guards, stepper, self%hit)
      end associate
   end subroutine shorten

   !> Where the dense output is of lower order than the method: step to the event by the method itself. What is left of the way is
   !> done along the slope there if its square is rounding, and by another step if not.
   subroutine polish(self)
      type(runge_kutta_t), intent(inout) :: self

      real(wp), dimension(self%transition%guards%count) :: g, rate
      real(wp) :: h, rest, whole
      integer :: i, round
      logical :: accepted, failed

      associate (seen => self%seen, stepper => self%stepper, guards => self%transition%guards)
         whole = stepper%h
         h = seen%duration
         if (.not. h > 0.0_wp) return
         i = self%finder%first
         do round = 1, 4
            call stepper%leap(self%system, self%z, h, accepted)
            if (.not. accepted) exit
            seen%duration = h
            seen%z_stop = stepper%z_end
            call guards%look(self%system, stepper%rhs%dynamics, h, seen%z_stop, g, rate)
            if (.not. abs(g(i)) < 0.1_wp*h*abs(rate(i))) return
            rest = -g(i)/rate(i)
            if (abs(rest) <= along_slope*h) then
               seen%duration = h + rest
               seen%z_stop = stepper%z_end + rest*stepper%dz_end
               return
            end if
            h = h + rest
         end do
         if (accepted) return
         ! The shorter step was refused: the dense output of the whole one has to do.
         call stepper%restart()
         call stepper%attempt(self%system, self%z, whole, accepted, failed)
         call stepper%prepare_dense(self%system)
         call stepper%output%at(seen%duration/whole, seen%z_stop)
      end associate
   end subroutine polish

   !> Without events: branches that have changed since the last step, as the transition's changes.
   subroutine note_changes(self, ending)
      type(runge_kutta_t), intent(inout) :: self
      integer, intent(inout) :: ending

      integer :: branch, j

      associate (rhs => self%stepper%rhs, dynamics => self%stepper%rhs%dynamics, transition => self%transition, &
                 tau => self%seen%duration)
         call dynamics%look_at_contacts(self%system, tau, self%z)
         transition%changes = 0
         do j = 1, size(self%branch)
            associate (law => self%system%machine%contact(j)%law)
               branch = law%initial_branch(dynamics%s(j), dynamics%rate(j))
               ! Sticking within the band, unless with more than friction can hold: as at the end of the step.
               if (law%of_normal .and. rhs%treatment == treat_by_switching) branch = dynamics%mode%branch(j)
            end associate
            if (branch /= transition%dynamics%mode%branch(j)) call transition%note(j, branch)
            transition%dynamics%mode%branch(j) = branch
         end do
         if (transition%changes > 0) ending = ends_noted
      end associate
   end subroutine note_changes

   !> The piece is this moment.
   subroutine stand(self, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      associate (unused => outcome, rhs => self%stepper%rhs)
         call rhs%dynamics%excitation%shift_like(self%transition%dynamics%excitation)
         call rhs%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
         rhs%dynamics%mode%branch = self%transition%dynamics%mode%branch
         call rhs%enter(self%system)
         self%seen%moment = .true.
         self%seen%duration = 0.0_wp
         self%seen%z_stop = self%z
      end associate
   end subroutine stand

   !> Carry the tangents through the step, or the part of it before the event.
   subroutine transport(self)
      class(runge_kutta_t), intent(inout) :: self

      call carry(self%stepper, self%system, self%seen%duration, self%tangent)
   end subroutine transport

   !> Counters of right-hand sides and refused steps.
   subroutine finish(self, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      associate (stepper => self%stepper)
         outcome%evaluations = stepper%rhs%evaluations
         outcome%jacobians = stepper%rhs%jacobians
         outcome%factorisations = stepper%radau%factorisations
         outcome%rejected = stepper%rejected_steps
      end associate
      outcome%near_misses = self%finder%near_misses
   end subroutine finish

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = self%seen%value(self%system, self%stepper, form, tau)
   end function value

   !> Value, size and direction of observable `form` at `tau`.
   subroutine glimpse(self, form, tau, seen)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      call self%seen%glimpse(self%system, self%stepper, form, tau, seen)
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
         call self%seen%next_turn(self%system, self%stepper, form, tau, tau_end, direction, found, tau_found, value)
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: z(size(self%z))

      call self%seen%look(self%system, self%stepper, tau, z)
      call self%system%to_coordinates(z, displacement, velocity)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp) :: z(size(self%z))

      call self%seen%look(self%system, self%stepper, tau, z)
      force = self%stepper%rhs%force_of(self%system, j, tau, z)
      s = self%stepper%rhs%dynamics%s(j)
      rate = self%stepper%rhs%dynamics%rate(j)
   end subroutine contact

   !> The step, or less, where what excites a machine that rests or is held is faster than its motion.
   pure function interval(self)
      class(runge_kutta_t), intent(in) :: self
      real(wp) :: interval

      interval = min(self%stepper%h, longest_angle/max(self%system%fastest, tiny(1.0_wp)))
   end function interval

end module razy_runge_kutta_runge_kutta
