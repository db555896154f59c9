!! The exact propagator: motion of a piecewise-linear machine from event to event in closed form.
!!
!! Between two changes of the contact state nothing is integrated; the next change is found with proof that none was before
!! it (razy_integrate_search). The state carries over an event unchanged, but for the jumps of velocity at impacts of rigid
!! contacts (razy_integrate_jumps); the phases of excitation are formed anew from the time, which is kept in two doubles, so
!! that errors do not grow with the number of pieces.
module razy_integrate_exact
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_integrate_contact_state, only: contact_state_t, contact_states_t
   use razy_integrate_contact_states, only: attach, state_index
   use razy_integrate_cursor, only: move_to
   use razy_integrate_exact_view, only: contact_of, direction_of, end_state, exact_view_t, place, state_at, sums_of, &
                                        turn_after, value_at
   use razy_integrate_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, &
                                        status_blow_up, status_chatter, status_event_limit, status_no_contact_forces, &
                                        status_no_modes, status_ok
   use razy_integrate_jumps, only: jumps_t
   use razy_integrate_search, only: exit_t, first_exit, search_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: exact_t

   !> The bound of a switching function that was crossed, and the side on which the motion had been.
   type :: crossed_t
      integer :: contact = 0, function = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp
   end type crossed_t

   !> The propagator with what it keeps from run to run.
   type, extends(integrator_t) :: exact_t
      type(contact_states_t) :: states
      type(search_t) :: search
      !> The piece under way; the search's probe holds the amplitudes at its end.
      type(exact_view_t) :: view
      type(jumps_t) :: jumps
      real(wp), allocatable :: z(:)
      integer, allocatable :: branch(:)
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
      procedure :: contact_sums
   end type exact_t

   !> Pieces are begun anew after this angle of the fastest exponent, so that its rounding stays below 1e-13.
   real(wp), parameter :: longest_angle = 1.0e3_wp
   !> A growing term grows by less than the exponential of this in a piece; a state beyond `largest` is a blow-up.
   real(wp), parameter :: longest_growth = 50.0_wp, largest = 1.0e100_wp

contains

   !> Take a machine; refused with an error if one of its laws is not piecewise linear.
   subroutine prepare(self, machine, keep_all, error)
      class(exact_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: j

      do j = 1, size(machine%contact)
         if (machine%contact(j)%law%piecewise_linear) cycle
         call raise(error, "the exact propagator cannot follow contact '"//machine%contact(j)%name// &
                    "', whose law is not piecewise linear")
         return
      end do
      call attach(self%states, machine, keep_all, error)
      if (.not. allocated(error) .and. self%states%jumps) call self%jumps%attach(machine, keep_all, error)
      if (allocated(error)) return
      if (allocated(self%z)) deallocate (self%z, self%branch)
      allocate (self%z(2*self%states%coupled%m), self%branch(size(machine%contact)))
      call self%view%attach(self%states%coupled%m, size(machine%tone))
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      integer(i8) :: steps, halvings

      steps = self%search%steps
      halvings = self%search%halvings
      if (self%states%jumps) then
         call run_with_jumps(self, t_end, most_events, observers, outcome)
      else
         call run_without_jumps(self, t_end, most_events, observers, outcome)
      end if
      outcome%steps = self%search%steps - steps
      outcome%halvings = self%search%halvings - halvings
      outcome%states = self%states%count
   end subroutine run

   !> Motion whose state is continuous: one event ends a piece, and those at the same time follow in pieces of no length.
   subroutine run_without_jumps(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(piece_t) :: piece
      type(exit_t) :: found
      type(crossed_t) :: crossed
      integer :: i, standing

      call begin(self)
      piece%by => self
      standing = 0
      do while (piece%time < t_end)
         i = state_index(self%states, self%branch)
         if (i == 0) outcome%status = status_no_modes
         if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         if (outcome%status /= status_ok) exit
         call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
         call mark(self%states%state(i), crossed)
         call follow(self, self%states%state(i), huge(1.0_wp), t_end, piece, found)
         outcome%pieces = outcome%pieces + 1
         call show_piece(observers, piece)
         call end_state(self%states%state(i), self%search%probe, self%z)
         standing = merge(standing + 1, 0, found%watched > 0 .and. .not. piece%duration > 0.0_wp)
         call add_time(piece%time, piece%time_low, piece%duration)
         if (piece%last) piece%time = t_end
         crossed%contact = 0
         if (found%watched == 0) cycle
         associate (watched => self%states%state(i)%watched(found%watched))
            crossed = crossed_t(piece%contact, self%states%state(i)%function(found%watched), watched%side, watched%bound)
         end associate
         self%branch(piece%contact) = piece%branch
         outcome%events = outcome%events + 1
         if (standing > 8*size(self%branch) + 8) outcome%status = status_chatter
         if (outcome%events >= most_events .and. piece%time < t_end) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
      end do
      outcome%time = piece%time
   end subroutine run_without_jumps

   !> State and branches at the time 0.
   subroutine begin(self)
      class(exact_t), intent(inout) :: self

      real(wp) :: s, rate
      integer :: j, m

      m = self%states%coupled%m
      associate (machine => self%states%machine)
         self%z(:m) = matmul(self%states%coupled%to_coupled, machine%displacement)
         self%z(m + 1:) = matmul(self%states%coupled%to_coupled, machine%velocity)
         do j = 1, size(machine%contact)
            associate (contact => machine%contact(j))
               s = dot_product(contact%w, machine%displacement) + contact%offset + sum(real(contact%error))
               rate = dot_product(contact%w, machine%velocity) - sum(self%states%omega*aimag(contact%error))
               self%branch(j) = contact%law%initial_branch(s, rate)
            end associate
         end do
      end associate
   end subroutine begin

   !> The function that has just crossed its bound starts on it.
   pure subroutine mark(state, crossed)
      type(contact_state_t), intent(inout) :: state
      type(crossed_t), intent(in) :: crossed

      integer :: t

      state%watched%from_zero = .false.
      state%watched%floor = 0.0_wp
      if (crossed%contact == 0) return
      do t = 1, size(state%watched)
         state%watched(t)%from_zero = state%contact(t) == crossed%contact .and. state%function(t) == crossed%function &
                                      .and. state%watched(t)%side*crossed%side < 0.0_wp &
                                      .and. .not. abs(state%watched(t)%bound - crossed%bound) > 0.0_wp
      end do
   end subroutine mark

   !> Follow a state from the time of `piece` to its end, at most for `most`, s.
   subroutine follow(self, state, most, t_end, piece, found)
      class(exact_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state
      real(wp), intent(in) :: most, t_end
      type(piece_t), intent(inout) :: piece
      type(exit_t), intent(out) :: found

      real(wp) :: longest, fastest

      fastest = state%basis%fastest
      if (size(self%states%omega) > 0) fastest = max(fastest, maxval(self%states%omega))
      longest = (t_end - piece%time) - piece%time_low
      piece%last = longest*fastest <= longest_angle
      if (.not. piece%last) longest = longest_angle/fastest
      if (state%response%growing) then
         ! Growth is looked at again before a blow-up can pass the range of the numbers.
         longest = min(longest, longest_growth/maxval(real(state%response%exponent)))
         piece%last = piece%last .and. .not. piece%time + longest < t_end
      end if
      piece%last = piece%last .and. longest < most
      longest = min(longest, most)
      self%search%level = state%level
      call first_exit(self%search, state%response, state%switching, self%view%start, 0.0_wp, longest, state%watched, found)
      state%level = self%search%level
      if (found%watched == 0) call move_to(self%view%start, state%response, found%tau, self%search%probe)
      piece%duration = found%tau
      self%view%duration = found%tau
      piece%last = piece%last .and. found%watched == 0
      piece%contact = 0
      if (found%watched == 0) return
      piece%contact = state%contact(found%watched)
      piece%branch = state%next(found%watched)
   end subroutine follow

   !> Motion with impacts or friction: events at the same time are settled together.
   subroutine run_with_jumps(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(piece_t) :: piece
      real(wp) :: duration
      integer :: i, standing
      logical :: found

      piece%by => self
      standing = 0
      duration = 0.0_wp
      call self%jumps%begin(delta_of(self, 0, t_end), self%z, found)
      if (.not. found) outcome%status = status_no_contact_forces
      self%branch = self%jumps%field%branch
      outcome%impacts = self%jumps%impacts
      if (found .and. self%jumps%impacts > 0) call show_changes(self, 1, piece, observers, outcome)
      do while (outcome%status == status_ok .and. piece%time < t_end)
         call choose_state(self, i, outcome)
         if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         if (outcome%events >= most_events) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
         call self%jumps%start_piece(piece%time, piece%time_low, duration, delta_of(self, i, t_end - piece%time), self%z)
         call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
         call next_event(self, self%states%state(i), t_end, piece, observers, outcome)
         duration = piece%duration
         standing = merge(standing + 1, 0, duration <= 4*epsilon(1.0_wp)*piece%time)
         call add_time(piece%time, piece%time_low, duration)
         if (piece%last) piece%time = t_end
         self%branch = self%jumps%field%branch
         if (outcome%status == status_ok) call show_changes(self, 2, piece, observers, outcome)
         if (standing > 8*size(self%branch) + 8 .and. outcome%status == status_ok) outcome%status = status_chatter
      end do
      outcome%time = piece%time
   end subroutine run_with_jumps

   !> The number of the state of the field's branches.
   subroutine choose_state(self, i, outcome)
      class(exact_t), intent(inout) :: self
      integer, intent(out) :: i
      type(outcome_t), intent(inout) :: outcome

      i = state_index(self%states, self%branch, self%jumps%press, self%jumps%field%constraints)
      if (i > 0) return
      outcome%status = merge(status_no_modes, status_no_contact_forces, self%states%state(self%states%count)%held%found)
   end subroutine choose_state

   !> Time over which rates of constraint forces are taken, s, in state i (0: none yet) with `rest` to go.
   pure function delta_of(self, i, rest) result(delta)
      class(exact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: rest
      real(wp) :: delta

      delta = rest
      if (i > 0) delta = min(delta, 1.0_wp/max(self%states%state(i)%basis%fastest, tiny(1.0_wp)))
      if (size(self%states%omega) > 0) delta = min(delta, 1.0_wp/maxval(self%states%omega))
      delta = 1.0e-5_wp*delta
   end function delta_of

   !> The piece that begins, and the event at its end: `self%z` and the field's branches are those after it.
   subroutine next_event(self, state, t_end, piece, observers, outcome)
      class(exact_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(exit_t) :: found
      real(wp) :: most
      logical :: lands, settled

      associate (jumps => self%jumps)
         call jumps%prepare_search(self%z, state%contact, state%function, state%next, state%fixed, state%watched)
         most = huge(1.0_wp)
         if (jumps%bounces%landing) most = max(jumps%bounces%tau, 0.0_wp)
         call follow(self, state, most, t_end, piece, found)
         call jumps%take_sizes(state%contact, state%function, state%watched)
         call end_state(state, self%search%probe, self%z)
         outcome%pieces = outcome%pieces + 1
         lands = .not. piece%duration < most
         jumps%resolution%changes = 0
         piece%contact = 0
         if (found%watched > 0) then
            call jumps%cross(state%contact(found%watched), state%function(found%watched), state%next(found%watched), &
                             piece%duration, self%z, settled)
         else if (lands) then
            call jumps%cross(0, 0, 0, piece%duration, self%z, settled)
         else
            call show_piece(observers, piece)
            return
         end if
         if (.not. settled) outcome%status = status_no_contact_forces
         if (jumps%resolution%changes > 0) then
            piece%contact = jumps%resolution%contact(1)
            piece%branch = jumps%resolution%branch(1)
            outcome%events = outcome%events + 1
         end if
         outcome%impacts = outcome%impacts + jumps%impacts
         outcome%accumulations = outcome%accumulations + jumps%landed
         call show_piece(observers, piece)
      end associate
   end subroutine next_event

   !> Show changes of branch from number `first` on as pieces of no duration in the state that follows them.
   subroutine show_changes(self, first, piece, observers, outcome)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: first
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: i, k

      if (self%jumps%resolution%changes < first) return
      call choose_state(self, i, outcome)
      if (outcome%status /= status_ok) return
      call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
      piece%duration = 0.0_wp
      piece%last = .false.
      do k = first, self%jumps%resolution%changes
         piece%contact = self%jumps%resolution%contact(k)
         piece%branch = self%jumps%resolution%branch(k)
         outcome%events = outcome%events + 1
         call show_piece(observers, piece)
      end do
   end subroutine show_changes

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = value_at(self%view, self%states%state(self%view%now), self%search%probe, form, tau)
   end function value

   !> Value, size and direction of observable `form` at `tau`, from up to four derivatives.
   subroutine glimpse(self, form, tau, seen)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      call direction_of(self%view, self%states%state(self%view%now), self%search%probe, form, tau, seen)
   end subroutine glimpse

   !> The next root of the observable's rate, found with the proof that none was before it.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      call turn_after(self%view, self%states%state(self%view%now), form, tau, tau_end, direction, turned, found, tau_found, value)
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: z(size(self%z))

      call state_at(self%view, self%states%state(self%view%now), self%search%probe, tau, z)
      call to_coordinates(self, z, displacement, velocity)
   end subroutine state

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call to_coordinates(self, self%z, displacement, velocity)
   end subroutine final_state

   pure subroutine to_coordinates(self, z, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)

      associate (coupled => self%states%coupled)
         displacement = matmul(z(:coupled%m), coupled%project)
         velocity = matmul(z(coupled%m + 1:), coupled%project)
      end associate
   end subroutine to_coordinates

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      call contact_of(self%view, self%states, self%search%probe, j, tau, s, rate, force)
   end subroutine contact

   !> Integrals of what contact j does from `tau` to the end of the piece, where they are known in closed form.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      call sums_of(self%view, self%states, self%search%probe, j, tau, largest, impulse, work, known)
   end subroutine contact_sums

   !> Branch of contact j.
   pure function branch_now(self, j) result(branch)
      class(exact_t), intent(in) :: self
      integer, intent(in) :: j
      integer :: branch

      branch = self%branch(j)
   end function branch_now

   !> The step of the search, or less, so that a turn of the fastest term has at least 25 points.
   pure function interval(self)
      class(exact_t), intent(in) :: self
      real(wp) :: interval

      associate (state => self%states%state(self%view%now))
         interval = scale(1.0_wp, -max(state%level, exponent(state%response%fastest) + 2))
      end associate
   end function interval

end module razy_integrate_exact
