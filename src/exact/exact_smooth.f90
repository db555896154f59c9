!! The exact propagator's way through a motion whose state is continuous: without impacts and friction.
module razy_exact_exact_smooth
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_exact_contact_state, only: contact_state_t
   use razy_exact_contact_states, only: state_index
   use razy_exact_piece_view, only: end_state, place
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, status_blow_up, &
                                     status_chatter, status_event_limit, status_no_modes, status_ok, status_step_limit
   use razy_exact_propagation, only: propagation_t
   use razy_exact_search_search, only: exit_t
   implicit none(type, external)
   private

   public :: run_without_jumps

   !> The bound of a switching function that was crossed, and the side on which the motion had been.
   type :: crossed_t
      integer :: contact = 0, function = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp
   end type crossed_t

   !> Switching functions that a contact may have.
   integer, parameter :: most_functions = 3

contains

   !> Run from 0 to `t_end`, s, showing every piece to the observers as one of the integrator `by`. One event ends a piece, and
   !> those at the same time follow in pieces of no length.
   subroutine run_without_jumps(self, by, t_end, most_events, observers, outcome)
      type(propagation_t), intent(inout), target :: self
      class(integrator_t), pointer, intent(in) :: by
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      type(piece_t) :: piece
      type(exit_t) :: found
      type(crossed_t) :: crossed
      real(wp) :: noise(most_functions, size(self%branch))
      integer :: before, i, standing

      call begin(self)
      piece%by => by
      standing = 0
      i = 0
      do while (piece%time < t_end)
         before = i
         i = state_index(self%states, self%branch)
         if (i == 0) outcome%status = status_no_modes
         if (self%has_blown_up()) outcome%status = status_blow_up
         if (self%is_spent()) outcome%status = status_step_limit
         if (outcome%status /= status_ok) exit
         call place(self%view, self%states, i, piece%time, piece%time_low, self%z)
         call mark(self%states%state(i), crossed)
         if (standing > 0) call take_noise(self%states%state(i), noise)
         call self%follow(self%states%state(i), huge(1.0_wp), t_end, piece, found)
         outcome%pieces = outcome%pieces + 1
         call show_piece(observers, piece)
         call end_state(self%states%state(i), self%search%probe, self%z)
         standing = merge(standing + 1, 0, found%watched > 0 .and. .not. piece%duration > 0.0_wp)
         if (standing > 0) then
            if (standing == 1) noise = 0.0_wp
            if (standing == 1 .and. before > 0) call note_noise(self%states%state(before), noise)
            call note_noise(self%states%state(i), noise)
         end if
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
      type(propagation_t), intent(inout) :: self

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

   !> Note what is rounding in the functions of a state (function, contact). At the start of the next state their terms may be gone
   !> in which the error was made: of bodies that have just left their stops together, all are near them.
   pure subroutine note_noise(state, noise)
      type(contact_state_t), intent(in) :: state
      real(wp), intent(inout) :: noise(:, :)

      integer :: t

      do t = 1, size(state%watched)
         associate (known => noise(state%function(t), state%contact(t)))
            known = max(known, state%watched(t)%noise)
         end associate
      end do
   end subroutine note_noise

   !> Tell a state that starts at the time at which the one before it did what is rounding in its functions.
   pure subroutine take_noise(state, noise)
      type(contact_state_t), intent(inout) :: state
      real(wp), intent(in) :: noise(:, :)

      integer :: t

      do t = 1, size(state%watched)
         state%watched(t)%floor = noise(state%function(t), state%contact(t))
      end do
   end subroutine take_noise

end module razy_exact_exact_smooth
