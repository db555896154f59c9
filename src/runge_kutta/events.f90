!! What happens between the steps of a Runge-Kutta method: the start of a motion, events and what follows them, changes of branch
!! seen at the ends of steps, and how observers are told.
!!
!! A change of branch ends a piece; others at the same time are shown as pieces of no duration.
module razy_runge_kutta_events
   use razy_core_kinds, only: wp
   use razy_core_tone, only: add_time
   use razy_contact_contact_law, only: branch_sticking
   use razy_hybrid_field, only: field_t
   use razy_motion_integrator, only: observer_slot_t, outcome_t, piece_t, show_piece, status_chatter, status_no_contact_forces, &
                                     status_ok
   use razy_hybrid_mode, only: treat_by_events, treat_by_switching
   use razy_runge_kutta_march, only: march_t
   use razy_hybrid_transition, only: resolution_t
   implicit none(type, external)
   private

   public :: events_t

   type :: events_t
      type(resolution_t) :: resolution
      real(wp), allocatable :: z_next(:)
      !> Workspace: y'' (m).
      real(wp), allocatable, private :: a(:)
      !> Branches that observers are shown, and those that follow.
      integer, allocatable :: shown(:), following(:)
      !> Events without time between them so far.
      integer :: standing = 0
   contains
      procedure :: attach
      procedure :: begin
      procedure :: end_by_event
      procedure :: end_by_step
   end type events_t

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(events_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      if (allocated(self%z_next)) deallocate (self%z_next, self%a, self%shown, self%following)
      allocate (self%z_next(2*field%m), self%a(field%m), source=0.0_wp)
      allocate (self%shown(size(field%branch)), self%following(size(field%branch)), source=1)
      call self%resolution%attach(field)
   end subroutine attach

   !> State and branches at the time 0, made consistent: out of rigid stops, impacts of what approaches, sticking or sliding.
   subroutine begin(self, march, piece, observers, outcome)
      class(events_t), intent(inout) :: self
      type(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      logical :: moved

      march%time = 0.0_wp
      march%time_low = 0.0_wp
      march%tau = 0.0_wp
      self%standing = 0
      march%anew = .true.
      call march%memory%forget()
      call march%bounces%forget()
      associate (field => march%view%field, guards => march%locator%guards)
         call field%first_state(march%z)
         call march%doubts%begin(field)
         guards%delta = 1.0e-9_wp*march%t_end
         guards%count = 0
         call guards%measure(field, 0.0_wp, march%z, .true.)
         if (field%treatment == treat_by_events) then
            call self%resolution%push_out(field, guards, 0.0_wp, march%z, moved)
            if (self%resolution%found) then
               march%locator%hit = .false.
               call self%resolution%settle(field, guards, march%locator%hit, 0.0_wp, march%z)
            end if
            if (.not. self%resolution%found) then
               outcome%status = status_no_contact_forces
               return
            end if
            self%following = field%branch
            call after_impacts(self, march, outcome)
            self%shown = field%branch
            march%view%z_stop = march%z
            if (self%resolution%impacts > 0) call show_changes(self, march, piece, observers, outcome, 1)
         end if
         call field%enter_mode()
         self%shown = field%branch
      end associate
   end subroutine begin

   !> The end of a step with the treatment `event`: settle what was found there, and show the step.
   subroutine end_by_event(self, march, found, piece, observers, outcome)
      class(events_t), intent(inout) :: self
      type(march_t), intent(inout) :: march
      logical, intent(in) :: found
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: tau
      logical :: landed

      associate (view => march%view, field => march%view%field)
         tau = march%tau + view%duration
         landed = march%bounces%landing .and. .not. tau < march%bounces%tau
         if (.not. found .and. .not. landed) then
            call show_piece(observers, piece)
            march%tau = tau
            march%z = view%z_stop
            return
         end if
         self%shown = field%branch
         self%z_next = view%z_stop
         self%resolution%changes = 0
         self%resolution%impacts = 0
         self%resolution%impacted = .false.
         if (found) then
            call self%resolution%settle(field, march%locator%guards, march%locator%hit, tau, self%z_next)
            if (.not. self%resolution%found) outcome%status = status_no_contact_forces
         end if
         self%following = field%branch
         if (landed) then
            call march%bounces%report(field, tau, self%resolution)
            outcome%accumulations = outcome%accumulations + march%bounces%landed
         end if
         field%branch = self%shown
         call field%enter_mode()
         if (self%resolution%changes > 0) then
            piece%contact = self%resolution%contact(1)
            piece%branch = self%resolution%branch(1)
            outcome%events = outcome%events + 1
         end if
         call show_piece(observers, piece)
         self%standing = merge(self%standing + 1, 0, view%duration <= 4*eps*(march%time + tau))
         if (self%standing > 8*size(field%branch) + 8 .and. outcome%status == status_ok) outcome%status = status_chatter
         march%tau = tau
         march%z = self%z_next
         view%z_stop = march%z
         view%start = tau
         field%branch = self%following
         call field%enter_mode()
         call after_impacts(self, march, outcome)
         self%shown = field%branch
         call show_changes(self, march, piece, observers, outcome, 2)
         march%anew = .true.
      end associate
   end subroutine end_by_event

   !> Count impacts, and carry those that have accumulated to the end of their sequence.
   subroutine after_impacts(self, march, outcome)
      class(events_t), intent(inout) :: self
      type(march_t), intent(inout) :: march
      type(outcome_t), intent(inout) :: outcome

      logical :: gathered

      outcome%impacts = outcome%impacts + self%resolution%impacts
      call march%bounces%gather(march%view%field, march%locator%guards, self%resolution, march%tau, march%z, gathered)
      if (.not. self%resolution%found) outcome%status = status_no_contact_forces
      if (gathered) march%view%z_stop = march%z
   end subroutine after_impacts

   !> Show changes of branch from number `first` on as pieces of no duration.
   subroutine show_changes(self, march, piece, observers, outcome, first)
      class(events_t), intent(inout) :: self
      type(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome
      integer, intent(in) :: first

      integer :: i

      march%view%moment = .true.
      march%view%duration = 0.0_wp
      piece%time = march%time
      piece%time_low = march%time_low
      call add_time(piece%time, piece%time_low, march%tau)
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
   subroutine end_by_step(self, march, piece, observers, outcome)
      class(events_t), intent(inout) :: self
      type(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: j

      associate (view => march%view, field => march%view%field)
         if (field%treatment == treat_by_switching .and. march%sticking%sticks) then
            call field%accelerate(march%tau + view%duration, view%z_stop, self%a)
            field%evaluations = field%evaluations + 1
         end if
         call field%look_at_contacts(march%tau + view%duration, view%z_stop)
         self%resolution%changes = 0
         do j = 1, size(self%shown)
            associate (law => field%machine%contact(j)%law)
               self%following(j) = law%initial_branch(field%s(j), field%rate(j))
               ! Sticking within the band, unless with more than friction can hold.
               if (law%constraint(branch_sticking) .and. field%treatment == treat_by_switching) self%following(j) = field%branch(j)
            end associate
         end do
         call march%doubts%of_ends(field, march%method, view%stepper, self%shown, self%following, march%z, march%time + march%tau)
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
         march%tau = march%tau + view%duration
         march%z = view%z_stop
         if (self%resolution%changes < 1) return
         self%shown = self%following
         view%start = march%tau
         do j = 2, self%resolution%changes
            view%moment = .true.
            piece%time = march%time
            piece%time_low = march%time_low
            call add_time(piece%time, piece%time_low, march%tau)
            piece%duration = 0.0_wp
            piece%contact = self%resolution%contact(j)
            piece%branch = self%following(piece%contact)
            outcome%events = outcome%events + 1
            call show_piece(observers, piece)
         end do
      end associate
   end subroutine end_by_step

end module razy_runge_kutta_events
