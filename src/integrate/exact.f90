!! The exact propagator: motion of a piecewise-linear machine from event to event in closed form.
!!
!! Between two changes of the contact state nothing is integrated; the next change is found with proof that none was before
!! it (razy_integrate_search). The state carries over an event unchanged, the phases of excitation are formed anew from the
!! time, which is kept in two doubles, so that errors do not grow with the number of pieces.
module razy_integrate_exact
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_integrate_contact_states, only: attach, contact_states_t, state_index
   use razy_integrate_cursor, only: cursor_t, move_to, reserve, set_state, state_of
   use razy_integrate_observer, only: observer_slot_t, piece_t
   use razy_integrate_search, only: exit_t, first_exit, search_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: exact_t, outcome_t, status_meanings
   public :: status_ok, status_event_limit, status_chatter, status_blow_up, status_no_modes

   !> How a run ended.
   integer, parameter :: status_ok = 0, status_event_limit = 1, status_chatter = 2, status_blow_up = 3, status_no_modes = 4
   character(*), parameter :: status_meanings(0:4) = [character(24) :: "ok", "event limit reached", "chatter limit reached", &
                                                                                                   "blow-up", "eigenproblem failed"]

   !> Result and counters of a run.
   type :: outcome_t
      integer :: status = status_ok
      !> Time reached, s.
      real(wp) :: time = 0.0_wp
      integer(i8) :: events = 0, steps = 0, halvings = 0, pieces = 0
      !> Contact states known at the end.
      integer :: states = 0
   end type outcome_t

   !> The bound of a switching function that was crossed, and the side on which the motion had been.
   type :: crossed_t
      integer :: function = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp
   end type crossed_t

   !> The propagator with what it keeps from run to run.
   type :: exact_t
      type(contact_states_t) :: states
      type(search_t) :: search
      type(cursor_t) :: start
      real(wp), allocatable :: z(:), cosine(:), sine(:)
      integer, allocatable :: branch(:)
   contains
      procedure :: prepare
      procedure :: run
   end type exact_t

   !> Pieces are begun anew after this angle of the fastest exponent, so that its rounding stays below 1e-13.
   real(wp), parameter :: longest_angle = 1.0e3_wp
   !> A growing term grows by less than the exponential of this in a piece; a state beyond `largest` is a blow-up.
   real(wp), parameter :: longest_growth = 50.0_wp, largest = 1.0e100_wp

contains

   !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
   subroutine prepare(self, machine, keep_all, error)
      class(exact_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: m

      call attach(self%states, machine, keep_all, error)
      if (allocated(error)) return
      m = self%states%coupled%m
      if (allocated(self%z)) deallocate (self%z, self%cosine, self%sine, self%branch)
      allocate (self%z(2*m), self%cosine(size(machine%tone)), self%sine(size(machine%tone)), self%branch(size(machine%contact)))
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      type(piece_t) :: piece
      type(exit_t) :: found
      type(crossed_t) :: crossed
      integer :: i, standing, switched
      integer(i8) :: steps, halvings

      steps = self%search%steps
      halvings = self%search%halvings
      call begin(self)
      standing = 0
      switched = 0
      do while (piece%time < t_end)
         i = state_index(self%states, self%branch)
         if (i == 0) outcome%status = status_no_modes
         if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         if (outcome%status /= status_ok) exit
         call next_piece(self, i, switched, crossed, t_end, piece, found)
         outcome%pieces = outcome%pieces + 1
         call show(observers, piece)
         call state_of(self%search%probe, piece%state%response, self%z)
         standing = merge(standing + 1, 0, found%watched > 0 .and. .not. piece%duration > 0.0_wp)
         call add_time(piece%time, piece%time_low, piece%duration)
         if (piece%last) piece%time = t_end
         switched = 0
         if (found%watched == 0) cycle
         switched = piece%contact
         crossed = crossed_t(piece%state%function(found%watched), piece%state%watched(found%watched)%side, &
                             piece%state%watched(found%watched)%bound)
         self%branch(switched) = piece%branch
         outcome%events = outcome%events + 1
         if (standing > 8*size(self%branch) + 8) outcome%status = status_chatter
         if (outcome%events >= most_events .and. piece%time < t_end) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
      end do
      outcome%time = piece%time
      outcome%steps = self%search%steps - steps
      outcome%halvings = self%search%halvings - halvings
      outcome%states = self%states%count
   end subroutine run

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

   !> Follow state i from the time of `piece` to its end; `switched` is the contact that has just crossed the bound `crossed`,
   !> and so starts on it.
   subroutine next_piece(self, i, switched, crossed, t_end, piece, found)
      class(exact_t), intent(inout), target :: self
      integer, intent(in) :: i, switched
      type(crossed_t), intent(in) :: crossed
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(exit_t), intent(out) :: found

      real(wp) :: longest, fastest
      integer :: t

      piece%state => self%states%state(i)
      associate (state => self%states%state(i))
         do t = 1, size(self%cosine)
            call self%states%machine%tone(t)%phasor(piece%time, piece%time_low, self%cosine(t), self%sine(t))
         end do
         call reserve(self%start, state%response)
         call set_state(self%start, state%response, self%z, self%cosine, self%sine)
         piece%start => self%start
         piece%finish => self%search%probe
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
         state%watched%from_zero = .false.
         if (switched > 0) then
            do t = 1, size(state%watched)
               state%watched(t)%from_zero = state%contact(t) == switched .and. state%function(t) == crossed%function &
                                            .and. state%watched(t)%side*crossed%side < 0.0_wp &
                                            .and. .not. abs(state%watched(t)%bound - crossed%bound) > 0.0_wp
            end do
         end if
         self%search%level = state%level
         self%search%resolution = spacing(piece%time)
         call first_exit(self%search, state%response, state%switching, self%start, 0.0_wp, longest, state%watched, found)
         state%level = self%search%level
         if (found%watched == 0) call move_to(self%start, state%response, found%tau, self%search%probe)
         piece%duration = found%tau
         piece%last = piece%last .and. found%watched == 0
         piece%contact = 0
         if (found%watched == 0) return
         piece%contact = state%contact(found%watched)
         piece%branch = state%next(found%watched)
      end associate
   end subroutine next_piece

   subroutine show(observers, piece)
      type(observer_slot_t), intent(in) :: observers(:)
      type(piece_t), intent(in) :: piece

      integer :: i

      do i = 1, size(observers)
         call observers(i)%observer%piece(piece)
      end do
   end subroutine show

end module razy_integrate_exact
