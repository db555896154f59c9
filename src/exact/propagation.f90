!! Motion in one contact state after another in closed form: what the exact propagator keeps, and how it follows one state to the
!! next event.
module razy_exact_propagation
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_exact_contact_state, only: contact_state_t, contact_states_t
   use razy_exact_contact_states, only: attach_states => attach
   use razy_exact_closed_form_cursor_moves, only: move_to
   use razy_exact_piece_view, only: exact_view_t
   use razy_motion_integrator, only: piece_t
   use razy_exact_search_search, only: exit_t, first_exit, search_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: propagation_t

   !> What is kept from run to run.
   type :: propagation_t
      type(contact_states_t) :: states
      type(search_t) :: search
      !> The piece under way; the search's probe holds the amplitudes at its end.
      type(exact_view_t) :: view
      !> State (2m), and the branch of each contact.
      real(wp), allocatable :: z(:)
      integer, allocatable :: branch(:)
   contains
      procedure :: attach
      procedure :: follow
      procedure :: has_blown_up
      procedure :: is_spent
   end type propagation_t

   !> Pieces are begun anew after this angle of the fastest exponent, so that its rounding stays below 1e-13.
   real(wp), parameter :: longest_angle = 1.0e3_wp
   !> A growing term grows by less than the exponential of this in a piece; a state beyond `largest` is a blow-up.
   real(wp), parameter :: longest_growth = 50.0_wp, largest = 1.0e100_wp

contains

   !> Take a machine.
   subroutine attach(self, machine, keep_all, error)
      class(propagation_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      call attach_states(self%states, machine, keep_all, error)
      if (allocated(error)) return
      if (allocated(self%z)) deallocate (self%z, self%branch)
      allocate (self%z(2*self%states%coupled%m), self%branch(size(machine%contact)))
      call self%view%attach(self%states%coupled%m, size(machine%tone))
   end subroutine attach

   !> Whether the state has left the range in which it means something.
   pure function has_blown_up(self)
      class(propagation_t), intent(in) :: self
      logical :: has_blown_up

      has_blown_up = .not. all(abs(self%z) <= largest)
   end function has_blown_up

   !> Whether the search has made as many steps as it may.
   pure function is_spent(self)
      class(propagation_t), intent(in) :: self
      logical :: is_spent

      is_spent = self%search%steps >= self%search%most_steps
   end function is_spent

   !> Follow a state from the time of `piece` to its end, at most for `most`, s.
   subroutine follow(self, state, most, t_end, piece, found)
      class(propagation_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state
      real(wp), intent(in) :: most, t_end
      type(piece_t), intent(inout) :: piece
      type(exit_t), intent(out) :: found

      real(wp) :: longest, fastest

      fastest = state%response%turning
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
      piece%last = piece%last .and. found%watched == 0 .and. .not. found%tau < longest
      piece%contact = 0
      if (found%watched == 0) return
      piece%contact = state%contact(found%watched)
      piece%branch = state%next(found%watched)
   end subroutine follow

end module razy_exact_propagation
