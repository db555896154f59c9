!! Motion of any machine by a Runge-Kutta method, step by step, with one of three treatments of what is not smooth
!! (source thesis, 3.3).
!!
!! `event`: the end of each branch is found on the dense output of the step (razy_runge_kutta_locate), the motion goes
!! there, impacts and the branches that follow are settled (razy_hybrid_transition), and the method starts anew
!! with nothing remembered but a step that served in the same mode before. Impacts that accumulate are carried to the end of
!! their sequence (razy_hybrid_accumulation). `switching`: the branch is looked up in every right-hand side;
!! `smoothing`: there are none. With these two, changes of branch are seen at the ends of steps only: their times are late by
!! up to a step.
!!
!! A piece that observers see is one step or some in a row, or the part of one before an event; `outcome%pieces` counts starts
!! anew. Contact forces are those of the laws and constraints, without the impulses of impacts.
module razy_runge_kutta_runge_kutta
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_motion_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t, piece_t, status_blow_up, &
                                     status_event_limit, status_ok
   use razy_runge_kutta_events, only: events_t
   use razy_runge_kutta_glide, only: glide, largest
   use razy_runge_kutta_march, only: march_t
   use razy_hybrid_mode, only: treat_by_events, treat_by_smoothing, treat_by_switching
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: new_runge_kutta, runge_kutta_t

   type, extends(integrator_t) :: runge_kutta_t
      type(march_t) :: march
      type(events_t) :: events
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

contains

   !> The integrator for a method that razy_motion_method has checked.
   subroutine new_runge_kutta(self, method)
      type(runge_kutta_t), intent(inout) :: self
      type(method_t), intent(in) :: method

      self%march%method = method
   end subroutine new_runge_kutta

   !> Take a machine.
   subroutine prepare(self, machine, keep_all, error)
      class(runge_kutta_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      associate (field => self%march%view%field)
         call field%attach(machine, keep_all, error)
         if (allocated(error)) return
         field%treatment = treat_by_events
         if (self%march%method%treatment == "switching") field%treatment = treat_by_switching
         if (self%march%method%treatment == "smoothing") field%treatment = treat_by_smoothing
         field%sharpness = self%march%method%sharpness
         field%band = self%march%method%band
         if (allocated(self%march%z)) deallocate (self%march%z)
         allocate (self%march%z(2*field%m), source=0.0_wp)
         call self%march%locator%attach(field)
         call self%events%attach(field)
         call self%march%bounces%attach(field)
         call self%march%view%stepper%prepare(self%march%method, 2*field%m)
         call self%march%sticking%attach(field, self%march%view%stepper%adaptive)
      end associate
      call self%march%view%attach()
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
      self%march%t_end = t_end
      self%march%view%field%evaluations = 0
      self%march%view%field%jacobians = 0
      call self%march%view%stepper%prepare(self%march%method, size(self%march%z))
      call self%events%begin(self%march, piece, observers, outcome)
      do while (outcome%status == status_ok .and. self%march%remaining() > 0.0_wp)
         if (outcome%events >= most_events) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
         call next_piece(self, piece, observers, outcome)
      end do
      outcome%time = self%march%time + (self%march%time_low + self%march%tau)
      if (outcome%status == status_ok) outcome%time = t_end
      outcome%evaluations = self%march%view%field%evaluations
      outcome%jacobians = self%march%view%field%jacobians
      outcome%rejected = self%march%view%stepper%rejected_steps
      outcome%doubts = self%march%doubts%count
      outcome%doubt_time = self%march%doubts%first
   end subroutine run

   !> Steps far from any event, and then one accepted step and what ends it.
   subroutine next_piece(self, piece, observers, outcome)
      class(runge_kutta_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      logical :: found, last, made

      call self%march%begin_mode(outcome)
      call glide(self%march, piece, observers, outcome, made)
      if (.not. all(abs(self%march%z) <= largest)) outcome%status = status_blow_up
      if (outcome%status /= status_ok) return
      call self%march%advance(made, found, last, outcome)
      if (outcome%status /= status_ok) return
      associate (view => self%march%view)
         piece%time = self%march%time
         piece%time_low = self%march%time_low
         call add_time(piece%time, piece%time_low, self%march%tau)
         piece%duration = view%duration
         piece%contact = 0
         piece%last = last
         if (view%field%treatment == treat_by_events) then
            call self%events%end_by_event(self%march, found, piece, observers, outcome)
         else
            call self%events%end_by_step(self%march, piece, observers, outcome)
         end if
      end associate
      if (piece%last .and. outcome%status == status_ok) then
         self%march%time = self%march%t_end
         self%march%time_low = 0.0_wp
         self%march%tau = 0.0_wp
      end if
   end subroutine next_piece

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = self%march%view%value(form, tau)
   end function value

   !> Value, size and direction of observable `form` at `tau`.
   subroutine glimpse(self, form, tau, seen)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      call self%march%view%glimpse(form, tau, seen)
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
         call self%march%view%next_turn(form, tau, tau_end, direction, found, tau_found, value)
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(runge_kutta_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: time, z(size(self%march%z))

      call self%march%view%state_at(tau, time, z)
      call self%march%view%field%to_coordinates(z, displacement, velocity)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(runge_kutta_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp) :: a(self%march%view%field%m), time, z(size(self%march%z))

      call self%march%view%state_at(tau, time, z)
      associate (field => self%march%view%field)
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

      branch = self%events%shown(j)
   end function branch_now

   !> The step: natural times are the steps'.
   pure function interval(self)
      class(runge_kutta_t), intent(in) :: self
      real(wp) :: interval

      interval = self%march%view%h
   end function interval

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(runge_kutta_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call self%march%view%field%to_coordinates(self%march%z, displacement, velocity)
   end subroutine final_state

end module razy_runge_kutta_runge_kutta
