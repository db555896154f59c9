!! What happens at an event of the hybrid system, whatever moves it between events:
!!
!! 1. The guards that were left say which branches follow (razy_hybrid_event_left_guards).
!! 2. Rigid sides that touch with approaching speeds, together with all that touch already and the friction that they press, form
!!    one impact (razy_hybrid_event_touching).
!! 3. Compliant contacts may pass further branches in no time (razy_hybrid_event_passing).
!! 4. Sides that touch and friction elements that rest after that are candidates for constraints: which of them hold is decided
!!    for all together (razy_hybrid_event_holding).
!! 5. Impacts that accumulate are carried to the end of their sequence (razy_hybrid_accumulation).
!!
!! Where no contact impacts or holds a constraint, branches follow one another, and that is all.
module razy_hybrid_event_settle
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: side_t
   use razy_hybrid_event_holding, only: slide_out_of_play, sort_friction, take_forces
   use razy_hybrid_event_impulses, only: given_speed
   use razy_hybrid_event_left_guards, only: find_at_limit, keep_open, take_hits
   use razy_hybrid_event_passing, only: pass_branches, remember
   use razy_hybrid_event_touching, only: push_out, take_impact, touch
   use razy_hybrid_excitation, only: excitation_t
   use razy_hybrid_guards, only: of_press
   use razy_hybrid_press, only: choose_press
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: restart, settle, settle_start, start_piece

contains

   !> The mode at the time 0 and z there, made consistent, if `events` do that: out of rigid stops, impacts of what approaches,
   !> sticking or sliding. Rates of forces are differences over `delta`, s.
   subroutine settle_start(self, system, events, time, delta, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: events
      real(wp), intent(in) :: time, delta
      real(wp), intent(inout) :: z(:)

      integer :: j

      call clear(self)
      self%energy = 0.0_wp
      self%most = 0.0_wp
      call self%accumulation%begin(system%m, size(self%next))
      associate (dynamics => self%dynamics)
         call dynamics%excitation%shift_like(excitation_t())
         call dynamics%excitation%begin(system%machine%tone, time, 0.0_wp)
         call dynamics%look_at_contacts(system, 0.0_wp, z)
         dynamics%sticks = .false.
         self%guards%delta = delta
         self%guards%count = 0
         call self%guards%measure(system, 0.0_wp, z, .true., self%dynamics%excitation%now())
         dynamics%mode%branch = [(system%machine%contact(j)%law%initial_branch(dynamics%s(j), dynamics%rate(j)), &
                                  j=1, size(dynamics%mode%branch))]
         ! What is beyond the end of a table by rounding begins at its end.
         do j = 1, size(dynamics%mode%branch)
            associate (law => system%machine%contact(j)%law, branch => dynamics%mode%branch(j))
               if (law%branch(branch)%outside) branch = law%initial_branch( &
                                                        dynamics%s(j) - law%branch(branch)%side*self%guards%on_s(j), &
                                                        dynamics%rate(j) - law%branch(branch)%side*self%guards%on_rate(j))
            end associate
         end do
         if (.not. events) return
         call dynamics%mode%enter(system)
         call push_out(self, system, z)
         if (.not. self%found) return
         call resolve(self, system, 0.0_wp, z)
         call follow_impacts(self, system, 0.0_wp, z)
         call choose_press(self%dynamics, system, 0.0_wp, z)
      end associate
   end subroutine settle_start

   !> A piece starts at `time + time_low`, s, in the mode, with the state z, which is brought back to the constraints.
   subroutine start_piece(self, system, time, time_low, delta, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time, time_low, delta
      real(wp), intent(inout) :: z(:)

      call self%dynamics%excitation%begin(system%machine%tone, time, time_low)
      self%guards%delta = delta
      call self%dynamics%keep_constraints(system, 0.0_wp, z)
      call self%guards%list(system, self%dynamics%mode)
      call self%guards%measure(system, 0.0_wp, z, .false., self%dynamics%excitation%now())
   end subroutine start_piece

   !> Forces and given motions may have jumped at `time + time_low`, s: impacts, and the mode that follows. Rates of forces are
   !> differences over `delta`, s.
   subroutine restart(self, system, time, time_low, delta, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time, time_low, delta
      real(wp), intent(inout) :: z(:)

      call clear(self)
      call self%dynamics%mode%enter(system)
      call start_piece(self, system, time, time_low, delta, z)
      call resolve(self, system, 0.0_wp, z)
      call follow_impacts(self, system, 0.0_wp, z)
      call choose_press(self%dynamics, system, 0.0_wp, z)
   end subroutine restart

   !> The event at (tau, z) of the piece that `dynamics` began, where the guards `hit` (at least as many as there are) were left:
   !> jumps of z, the mode that follows, and what has changed.
   subroutine settle(self, system, hit, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      logical :: left(size(hit)), others, turned(self%guards%count)
      integer :: i

      call clear(self)
      left = hit
      call find_at_limit(self, system, tau, z, left)
      associate (guard => self%guards%entry(:self%guards%count), press => self%dynamics%mode%press)
         turned = hit(:size(guard)) .and. guard%function == of_press
         others = any(hit(:size(guard)) .and. guard%function /= of_press)
         do i = 1, size(guard)
            if (turned(i)) press(guard(i)%contact) = -press(guard(i)%contact)
         end do
      end associate
      if (any(turned) .and. .not. others) return
      if (others) call resolve(self, system, tau, z, left)
      call follow_impacts(self, system, tau, z)
      call choose_press(self%dynamics, system, tau, z)
   end subroutine settle

   !> Nothing has happened yet.
   pure subroutine clear(self)
      type(transition_t), intent(inout) :: self

      self%found = .true.
      self%changes = 0
      self%impacts = 0
      self%landed = 0
   end subroutine clear

   !> Take up the impacts of the event, and land those whose sequences end now.
   subroutine follow_impacts(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: came(size(self%arriving))
      logical :: landed(size(self%next))
      integer :: j

      if (.not. self%found) return
      if (self%impacts > 0) then
         came = self%arriving
         call cut_short(self, system, tau, z)
         ! The end of a sequence is right to the speed of the lowest flight, whose square is rounding.
         self%energy = max(self%energy, given_speed(self%dynamics, system, came, tau, z)**2)
      end if
      if (.not. self%accumulation%landing .or. self%accumulation%rest > 0.0_wp) return
      associate (branch => self%dynamics%mode%branch, n => self%changes)
         call self%accumulation%land(system, branch, landed)
         self%landed = count(landed)
         do j = 1, size(landed)
            if (landed(j) .and. all(self%contact(:n) /= j .or. self%branch(:n) /= branch(j))) call self%note(j, branch(j))
         end do
      end associate
   end subroutine follow_impacts

   !> Where the event's impacts end sequences, z loses the speeds of their gaps and the mode is settled again. The changes that are
   !> noted stay those of the event.
   subroutine cut_short(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer, dimension(size(self%contact)) :: branch, contact
      integer, dimension(size(self%next)) :: before
      integer :: changes, impacts, round
      logical :: touching(2, size(self%next))
      type(side_t) :: side(self%sides)

      before = self%before
      side = self%side(:self%sides)
      contact = self%contact
      branch = self%branch
      changes = self%changes
      impacts = self%impacts
      do round = 1, size(side)
         call self%accumulation%follow(system, self%dynamics, self%guards, before, side, tau, self%arriving, z, &
                                       self%saltation, touching)
         if (.not. any(touching)) exit
         call resolve(self, system, tau, z, touching=touching)
         self%contact = contact
         self%branch = branch
         self%changes = changes
         self%impacts = impacts
         call self%accumulation%confirm(system, self%dynamics%mode%branch)
         if (.not. self%found) exit
         ! Where that holds one, the flight of another may be too low, which it was not beside one that flew too.
         side%before = 0.0_wp
         side%first = 0.0_wp
         side%after = side%direction*self%dynamics%rate(side%contact)
      end do
   end subroutine cut_short

   !> Impacts and the branches that follow at (tau, z), where the guards `hit` were left; without, branches and state are made
   !> consistent. Edges that are `touching` (lower and upper, contacts) do so whatever the gap.
   subroutine resolve(self, system, tau, z, hit, touching)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(in), optional :: hit(:), touching(:, :)

      real(wp) :: struck(2*system%m)
      integer :: j

      associate (dynamics => self%dynamics, guards => self%guards)
         self%before = dynamics%mode%branch
         self%next = dynamics%mode%branch
         self%resting = .false.
         self%stirred = .not. (present(hit) .or. present(touching))
         if (present(hit)) then
            do j = 1, guards%count
               if (hit(j)) self%stirred(guards%entry(j)%contact) = .true.
            end do
         end if
         if (present(touching)) self%stirred = any(touching, 1)
         self%again = self%let_go .and. .not. tau > 0.0_wp
         self%let_go = .false.
         self%yielding = 0
         self%impacts = 0
         self%sides = 0
         call guards%measure(system, tau, z, .false., dynamics%excitation%now())
         self%left = .false.
         if (present(touching)) self%left = touching
         if (present(hit)) call take_hits(self, system, hit, tau, z)
         call dynamics%look_at_contacts(system, tau, z)
         if (present(hit)) call keep_open(self, system, tau, z)
         do j = 1, size(self%next)
            call remember(self, system, j, self%before(j), self%next(j))
         end do
         self%changes = 0
         dynamics%mode%press = 0
         if (.not. system%constrained) then
            call pass_branches(self, system)
            dynamics%mode%branch = self%next
         else
            call touch(self, system)
            self%arriving = z(system%m + 1:)
            self%most = max(self%most, dot_product(self%arriving, self%arriving))
            if (any(self%side(:self%sides)%before < 0.0_wp)) then
               call take_impact(self, system, z)
               if (.not. self%found) return
               call dynamics%look_at_contacts(system, tau, z)
            end if
            call sort_friction(self, system)
            call pass_branches(self, system)
            call take_forces(self, system, tau, z)
            if (.not. self%found) return
            call slide_out_of_play(self, system)
            call dynamics%mode%enter(system)
            struck = z
            call dynamics%keep_constraints(system, tau, z)
            ! What closes without an impact has no speed.
            self%energy = max(self%energy, sum((z(system%m + 1:) - struck(system%m + 1:))**2))
         end if
         associate (side => self%side(:self%sides))
            do j = 1, size(self%next)
               if (dynamics%mode%branch(j) == self%before(j) .and. .not. any(side%contact == j .and. side%before < 0.0_wp) &
                   .and. .not. any(self%contact(:self%changes) == j)) cycle
               call self%note(j, dynamics%mode%branch(j))
            end do
         end associate
      end associate
   end subroutine resolve

end module razy_hybrid_event_settle
