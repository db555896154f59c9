!! The exact propagator's way through a motion with impacts or friction: events at the same time are settled together.
module razy_exact_exact_jumps
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_exact_contact_states, only: state_index
   use razy_exact_piece_view, only: end_state, place
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, status_blow_up, &
                                     status_chatter, status_event_limit, status_no_contact_forces, status_no_modes, &
                                     status_ok, status_step_limit
   use razy_exact_jumps, only: jumps_t
   use razy_exact_propagation, only: propagation_t
   use razy_exact_search_search, only: exit_t
   implicit none(type, external)
   private

   public :: run_with_jumps

contains

   !> Run from 0 to `t_end`, s, showing every piece to the observers as one of the integrator `by`.
   subroutine run_with_jumps(self, jumps, by, t_end, most_events, observers, outcome)
      type(propagation_t), intent(inout), target :: self
      type(jumps_t), intent(inout) :: jumps
      class(integrator_t), pointer, intent(in) :: by
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(piece_t) :: piece
      real(wp) :: duration
      integer :: i, standing
      logical :: found

      piece%by => by
      standing = 0
      duration = 0.0_wp
      call jumps%begin(delta_of(self, 0, t_end), self%z, found)
      if (.not. found) outcome%status = status_no_contact_forces
      self%branch = jumps%field%branch
      outcome%impacts = jumps%impacts
      if (found .and. jumps%impacts > 0) call show_changes(self, jumps, 1, piece, observers, outcome)
      do while (outcome%status == status_ok .and. piece%time < t_end)
         call choose_state(self, jumps, i, outcome)
         if (self%has_blown_up()) outcome%status = status_blow_up
         if (self%is_spent()) outcome%status = status_step_limit
         if (outcome%events >= most_events) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
         call jumps%start_piece(piece%time, piece%time_low, duration, delta_of(self, i, t_end - piece%time), self%z)
         call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
         call next_event(self, jumps, i, t_end, piece, observers, outcome)
         duration = piece%duration
         standing = merge(standing + 1, 0, duration <= 4*epsilon(1.0_wp)*piece%time)
         call add_time(piece%time, piece%time_low, duration)
         if (piece%last) piece%time = t_end
         self%branch = jumps%field%branch
         if (outcome%status == status_ok) call show_changes(self, jumps, 2, piece, observers, outcome)
         if (standing > 8*size(self%branch) + 8 .and. outcome%status == status_ok) outcome%status = status_chatter
      end do
      outcome%time = piece%time
   end subroutine run_with_jumps

   !> The number of the state of the field's branches.
   subroutine choose_state(self, jumps, i, outcome)
      type(propagation_t), intent(inout) :: self
      type(jumps_t), intent(in) :: jumps
      integer, intent(out) :: i
      type(outcome_t), intent(inout) :: outcome

      i = state_index(self%states, self%branch, jumps%press, jumps%field%constraints)
      if (i > 0) return
      outcome%status = merge(status_no_modes, status_no_contact_forces, self%states%state(self%states%count)%held%found)
   end subroutine choose_state

   !> Time over which rates of constraint forces are taken, s, in state i (0: none yet) with `rest` to go.
   pure function delta_of(self, i, rest) result(delta)
      type(propagation_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: rest
      real(wp) :: delta

      delta = rest
      if (i > 0) delta = min(delta, 1.0_wp/max(self%states%state(i)%basis%fastest, tiny(1.0_wp)))
      if (size(self%states%omega) > 0) delta = min(delta, 1.0_wp/maxval(self%states%omega))
      delta = 1.0e-5_wp*delta
   end function delta_of

   !> The piece that begins in state i, and the event at its end: `self%z` and the field's branches are those after it.
   subroutine next_event(self, jumps, i, t_end, piece, observers, outcome)
      type(propagation_t), intent(inout), target :: self
      type(jumps_t), intent(inout) :: jumps
      integer, intent(in) :: i
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(exit_t) :: found
      real(wp) :: most
      logical :: lands, settled

      associate (state => self%states%state(i))
         call jumps%prepare_search(self%z, state%contact, state%function, state%next, state%fixed, state%watched)
         most = huge(1.0_wp)
         if (jumps%bounces%landing) most = max(jumps%bounces%tau, 0.0_wp)
         call self%follow(state, most, t_end, piece, found)
         call jumps%take_sizes(state%contact, state%function, state%watched)
         call end_state(state, self%search%probe, self%z)
      end associate
      outcome%pieces = outcome%pieces + 1
      lands = .not. piece%duration < most
      jumps%resolution%changes = 0
      piece%contact = 0
      if (found%watched > 0) then
         associate (state => self%states%state(i), j => found%watched)
            call jumps%cross(state%contact(j), state%function(j), state%next(j), piece%duration, self%z, settled)
         end associate
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
   end subroutine next_event

   !> Show changes of branch from number `first` on as pieces of no duration in the state that follows them.
   subroutine show_changes(self, jumps, first, piece, observers, outcome)
      type(propagation_t), intent(inout), target :: self
      type(jumps_t), intent(in) :: jumps
      integer, intent(in) :: first
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: i, k

      if (jumps%resolution%changes < first) return
      call choose_state(self, jumps, i, outcome)
      if (outcome%status /= status_ok) return
      call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
      piece%duration = 0.0_wp
      piece%last = .false.
      do k = first, jumps%resolution%changes
         piece%contact = jumps%resolution%contact(k)
         piece%branch = jumps%resolution%branch(k)
         outcome%events = outcome%events + 1
         call show_piece(observers, piece)
      end do
   end subroutine show_changes

end module razy_exact_exact_jumps
