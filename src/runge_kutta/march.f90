!! The way of a Runge-Kutta method along a motion, from event to event: time, state, accepted steps, and the events found in them.
!!
!! The field's time is counted anew from every event, and after some radians of the fastest excitation, so that its rounding stays
!! small. The first step after an event is one that served first in the same mode before (razy_runge_kutta_memory).
module razy_runge_kutta_march
   use razy_core_kinds, only: wp
   use razy_core_tone, only: add_time
   use razy_motion_integrator, only: outcome_t, status_blow_up, status_ok, status_step_limit, status_step_underflow
   use razy_hybrid_mode, only: treat_by_events
   use razy_hybrid_accumulation, only: bounces_t
   use razy_runge_kutta_doubts, only: step_doubts_t
   use razy_runge_kutta_locate, only: locator_t
   use razy_runge_kutta_memory, only: step_memory_t
   use razy_runge_kutta_sticking, only: sticking_t
   use razy_runge_kutta_view, only: view_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: march_t

   type :: march_t
      type(method_t) :: method
      type(view_t) :: view
      type(locator_t) :: locator
      type(bounces_t) :: bounces
      type(sticking_t) :: sticking
      type(step_memory_t) :: memory
      type(step_doubts_t) :: doubts
      !> Time from which the field counts, s (sum of both), and the time of the state z since then.
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp, tau = 0.0_wp
      real(wp), allocatable :: z(:)
      !> Whether the method starts anew, and whether it has done so in this step.
      logical :: anew = .true., opening = .true.
      !> Steps made in this mode since, and how many were made in it the last time (0: not known).
      integer :: made = 0, expected = 0
      real(wp) :: t_end = 0.0_wp
   contains
      procedure :: remaining
      procedure :: start_field
      procedure :: begin_mode
      procedure :: end_opening
      procedure :: advance
   end type march_t

   !> The field's time starts again after this angle of the fastest excitation.
   real(wp), parameter :: longest_angle = 30.0_wp
   !> A step below this part of the motion is an underflow.
   real(wp), parameter :: least_step = 1.0e-6_wp*epsilon(1.0_wp)
   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Growth of the first step of a mode from visit to visit that pays.
   real(wp), parameter :: worth_a_refusal = 1.15_wp
   !> An event before this part of a step is looked for again in a shorter step.
   real(wp), parameter :: least_share = 0.125_wp
   !> Part of a step that may be made along its slope: the square is rounding.
   real(wp), parameter :: along_slope = 1.0e-8_wp

contains

   !> Time left, s.
   pure function remaining(self) result(time)
      class(march_t), intent(in) :: self
      real(wp) :: time

      time = ((self%t_end - self%time) - self%time_low) - self%tau
   end function remaining

   !> Make one accepted step, unless the stepper has `made` one, and look for an event in it: `found`, or else `last`, if it ends
   !> with the motion. The view is that of the step, or of the part of it before the event.
   subroutine advance(self, made, found, last, outcome)
      class(march_t), intent(inout) :: self
      logical, intent(in) :: made
      logical, intent(out) :: found, last
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: theta
      logical :: dense

      found = .false.
      if (.not. made) then
         call self%start_field()
         call self%view%field%start_step(self%tau)
      end if
      call take_step(self, made, last, outcome)
      if (outcome%status /= status_ok) return
      outcome%steps = outcome%steps + 1
      self%made = self%made + 1
      dense = .false.
      associate (view => self%view, field => self%view%field, stepper => self%view%stepper)
         if (field%treatment == treat_by_events) then
            call self%locator%find(field, stepper, self%tau, self%z, found, theta, dense)
            if (found .and. theta < least_share .and. .not. polished(stepper)) call shorten(self, found, theta, dense)
            call self%doubts%of_turns(self%locator, field, self%method, stepper, self%z, self%time + self%tau, self%opening, found)
         end if
         call self%end_opening(stepper%h, stepper%h_next)
         last = last .and. .not. found .and. .not. stepper%h < self%remaining()
         view%start = self%tau
         view%z_start = self%z
         view%h = stepper%h
         view%dense = dense
         view%moment = .false.
         view%steps = 1
         view%duration = stepper%h
         if (found) then
            view%duration = theta*stepper%h
            call stepper%at(theta, view%z_stop)
            if (polished(stepper) .and. .not. stepper%fine_at(theta)) call polish(self)
         else
            view%z_stop = stepper%z_end
            call field%keep_constraints(self%tau + stepper%h, view%z_stop)
            if (field%treatment == treat_by_events) call self%locator%keep_at_rest(field, view%z_stop)
         end if
      end associate
   end subroutine advance

   !> Whether the last step to an event is made anew: it pays where a step costs little and dense output is of lower order.
   pure logical function polished(stepper)
      type(stepper_t), intent(in) :: stepper

      polished = stepper%adaptive .and. .not. stepper%implicit .and. stepper%dense_order < stepper%order
   end function polished

   !> Count the field's time from now if the method starts anew, or if it has run long enough.
   subroutine start_field(self)
      class(march_t), intent(inout) :: self

      if (.not. self%anew .and. self%tau*self%view%fastest < longest_angle) return
      call add_time(self%time, self%time_low, self%tau)
      call self%bounces%count_from(self%tau)
      self%tau = 0.0_wp
      call self%view%field%start_piece(self%time, self%time_low)
   end subroutine start_field

   !> If the method starts anew: take the mode, the slope and the guards, and propose a step, that of the last time if there is one.
   subroutine begin_mode(self, outcome)
      class(march_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: h, rest

      if (.not. self%anew) return
      call self%start_field()
      self%anew = .false.
      self%opening = .true.
      outcome%pieces = outcome%pieces + 1
      associate (field => self%view%field, stepper => self%view%stepper)
         call field%start_step(self%tau)
         rest = self%remaining()
         call stepper%enter(field)
         call self%memory%enter(field%branch, h, self%expected)
         self%made = 0
         if (.not. stepper%adaptive .or. .not. h > 0.0_wp) call stepper%first_step(field, self%tau, self%z, rest, h)
         stepper%h_next = h
         call stepper%begin(field, self%tau, self%z)
         if (self%sticking%watching) call self%sticking%begin(field, self%tau, min(h, rest), self%z)
         if (field%treatment /= treat_by_events) return
         self%locator%guards%delta = 1.0e-5_wp*min(h, rest)
         call self%locator%start(field, self%tau, self%z, stepper%dz_end)
      end associate
   end subroutine begin_mode

   !> Remember the first step h of a mode, or the one that follows it, h_next, if that is shorter or so much longer that it is worth
   !> a refusal.
   pure subroutine end_opening(self, h, h_next)
      class(march_t), intent(inout) :: self
      real(wp), intent(in) :: h, h_next

      if (self%opening) call self%memory%keep_step(merge(h, h_next, h_next > h .and. h_next < worth_a_refusal*h))
      self%opening = .false.
   end subroutine end_opening

   !> Try steps until one is accepted, unless one was `made`; `last`: it ends with the motion.
   subroutine take_step(self, made, last, outcome)
      class(march_t), intent(inout) :: self
      logical, intent(in) :: made
      logical, intent(out) :: last
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: h, rest
      logical :: accepted, again, failed

      associate (field => self%view%field, stepper => self%view%stepper)
         rest = self%remaining()
         h = stepper%h_next
         if (self%sticking%watching) h = min(h, self%sticking%longest)
         if (field%treatment == treat_by_events) call self%locator%advance()
         if (made) then
            last = .false.
            call stepper%accept(field)
            return
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
            again = .false.
            if (accepted .and. self%sticking%watching) call self%sticking%passes_over(field, self%tau, stepper%z_end, h, again)
            if (again) then
               call stepper%restart()
            else
               if (accepted) return
               h = stepper%h_next
            end if
            if (h <= least_step*self%t_end) outcome%status = merge(status_blow_up, status_step_underflow, failed)
            if (outcome%status /= status_ok) return
         end do
      end associate
   end subroutine take_step

   !> An event early in a long step is found again in a shorter one: a polynomial over the whole step would lose digits there.
   subroutine shorten(self, found, theta, dense)
      class(march_t), intent(inout) :: self
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
      class(march_t), intent(inout) :: self

      real(wp) :: g(self%locator%guards%count), rate(self%locator%guards%count), h, rest, whole
      integer :: i, round
      logical :: accepted, failed

      associate (view => self%view, stepper => self%view%stepper, guards => self%locator%guards)
         whole = view%h
         h = view%duration
         if (.not. h > 0.0_wp) return
         do round = 1, 4
            call stepper%leap(view%field, self%tau, self%z, h, accepted)
            if (.not. accepted) exit
            view%h = h
            view%duration = h
            view%dense = .false.
            view%z_stop = stepper%z_end
            call guards%look(view%field, self%tau + h, view%z_stop, g, rate)
            i = self%locator%first
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

end module razy_runge_kutta_march
