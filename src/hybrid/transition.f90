!! What happens at an event of the hybrid system, whatever moves it between events:
!!
!! 1. Rigid sides that touch with approaching speeds, together with all that touch already and the friction that they press, form
!!    one impact (razy_hybrid_impact).
!! 2. Sides that touch and friction elements that rest after that are candidates for constraints: accelerations say which of them
!!    separate, slide, or stay closed and stick (razy_hybrid_active_sides), and further derivatives where these are 0
!!    (razy_hybrid_ties).
!! 3. Impacts that accumulate are carried to the end of their sequence (razy_hybrid_accumulation).
!!
!! Where no contact impacts or holds a constraint, branches follow one another, and that is all.
module razy_hybrid_transition
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_accumulation, only: accumulation_t
   use razy_hybrid_active_sides, only: assume, choose, either_way, find_sides, side_t, weakens
   use razy_hybrid_derivatives, only: derivatives_t, differentiate
   use razy_hybrid_dynamics, only: accelerate_unconstrained, dynamics_t
   use razy_hybrid_excitation, only: excitation_t
   use razy_hybrid_guards, only: guards_t, of_force, of_press
   use razy_hybrid_impact, only: impact_derivative_t, push_apart, strike
   use razy_hybrid_mode, only: lawful
   use razy_hybrid_press, only: choose_press
   use razy_hybrid_saltation, only: saltation_t
   use razy_hybrid_system, only: system_t
   use razy_hybrid_ties, only: break_ties, noise_of, tie_t
   implicit none(type, external)
   private

   public :: transition_t

   type :: transition_t
      !> The mode that follows the last event, and its guards.
      type(dynamics_t) :: dynamics
      type(guards_t) :: guards
      type(accumulation_t) :: accumulation
      !> Derivatives across events, if they are wanted.
      type(saltation_t) :: saltation
      !> Whether admissible impulses and forces were found.
      logical :: found = .true.
      !> Contacts whose branch has changed or that had an impact (the first `changes`), and the branches that follow. Branches that
      !> were passed in no time come first, then all others in the order of their contacts.
      integer :: changes = 0
      integer, allocatable :: contact(:), branch(:)
      !> Impacts, and ends of accumulations.
      integer :: impacts = 0, landed = 0
      !> Rigid sides that touch (the first `sides`).
      integer, private :: sides = 0
      type(side_t), allocatable, private :: side(:)
      !> Branches that follow, and those before the event; friction elements that rest; constraints that have been let go of. Where
      !> friction that weakens as it begins to slide has come to its limit, the branch that it would slide in, else 0.
      integer, allocatable, private :: next(:), before(:), yielding(:)
      logical, allocatable, private :: resting(:), let_go(:)
      !> Contacts on what an event moves or what is joined with it; all others stay as they are, whose forces may not be unique.
      logical, allocatable, private :: stirred(:)
      !> Contacts that were let go of at the event before and whose guard is left again at once: what holds them is rounding.
      logical, allocatable, private :: again(:)
      !> Edges that were left (lower and upper, contacts).
      logical, allocatable, private :: left(:, :)
   contains
      procedure :: make_room
      procedure :: begin
      procedure :: start_piece
      procedure :: restart
      procedure :: settle
      procedure :: note
   end type transition_t

   !> Decisions at one event, for each contact and one more: more of them go round.
   integer, parameter :: most_rounds = 4
   !> Branches that one contact may pass in no time, with the one that holds.
   integer, parameter :: most_passed = 9

contains

   !> Make room for a system; `sharpness` > 0: its laws are smoothed.
   subroutine make_room(self, system, sharpness)
      class(transition_t), intent(out) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: sharpness

      integer :: n

      n = size(system%machine%contact)
      call self%dynamics%make_room(system, sharpness)
      call self%guards%make_room(system)
      allocate (self%contact(most_passed*n), self%branch(most_passed*n), self%next(n), self%before(n), &
                self%yielding(n), source=0)
      allocate (self%resting(n), self%let_go(n), self%again(n), self%stirred(n), self%left(2, n), source=.false.)
      allocate (self%side(2*n))
   end subroutine make_room

   !> The mode at the time 0 and z there, made consistent, if `events` do that: out of rigid stops, impacts of what approaches,
   !> sticking or sliding. Rates of forces are differences over `delta`, s.
   subroutine begin(self, system, events, time, delta, z)
      class(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: events
      real(wp), intent(in) :: time, delta
      real(wp), intent(inout) :: z(:)

      integer :: j

      call clear(self)
      call self%accumulation%begin(system%m, size(self%next))
      associate (dynamics => self%dynamics)
         call dynamics%excitation%shift_like(excitation_t())
         call dynamics%excitation%begin(system%machine%tone, time, 0.0_wp)
         call dynamics%look_at_contacts(system, 0.0_wp, z)
         dynamics%sticks = .false.
         dynamics%mode%branch = [(system%machine%contact(j)%law%initial_branch(dynamics%s(j), dynamics%rate(j)), &
                                  j=1, size(dynamics%mode%branch))]
         if (.not. events) return
         call dynamics%mode%enter(system)
         self%guards%delta = delta
         self%guards%count = 0
         call self%guards%measure(system, 0.0_wp, z, .true., self%dynamics%excitation%now())
         call push_out(self, system, z)
         if (.not. self%found) return
         call resolve(self, system, 0.0_wp, z)
         call follow_impacts(self, system, 0.0_wp, z)
         call choose_press(self%dynamics, system, 0.0_wp, z)
      end associate
   end subroutine begin

   !> A piece starts at `time + time_low`, s, in the mode, with the state z, which is brought back to the constraints.
   subroutine start_piece(self, system, time, time_low, delta, z)
      class(transition_t), intent(inout) :: self
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
      class(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time, time_low, delta
      real(wp), intent(inout) :: z(:)

      call clear(self)
      call self%dynamics%mode%enter(system)
      call self%start_piece(system, time, time_low, delta, z)
      call resolve(self, system, 0.0_wp, z)
      call follow_impacts(self, system, 0.0_wp, z)
      call choose_press(self%dynamics, system, 0.0_wp, z)
   end subroutine restart

   !> The event at (tau, z) of the piece that `dynamics` began, where the guards `hit` (at least as many as there are) were left:
   !> jumps of z, the mode that follows, and what has changed.
   subroutine settle(self, system, hit, tau, z)
      class(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      logical :: left(size(hit)), of_others(self%guards%count)
      integer, allocatable :: turned(:)

      call clear(self)
      left = hit
      call find_at_limit(self, system, tau, z, left)
      associate (entry => self%guards%entry(:size(of_others)), hits => hit(:size(of_others)))
         of_others = entry%function /= of_press
         turned = pack(entry%contact, hits .and. .not. of_others)
         of_others = of_others .and. hits
      end associate
      self%dynamics%mode%press(turned) = -self%dynamics%mode%press(turned)
      if (any(of_others)) then
         call resolve(self, system, tau, z, left)
      else if (size(turned) > 0) then
         return
      end if
      call follow_impacts(self, system, tau, z)
      call choose_press(self%dynamics, system, tau, z)
   end subroutine settle

   !> Where friction has come to its limit, so has that which is there to rounding and goes on: whoever looks for the first does not
   !> see it.
   subroutine find_at_limit(self, system, tau, z, hit)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      logical, intent(inout) :: hit(:)

      real(wp), dimension(self%guards%count) :: g, rate
      logical :: limits(self%guards%count)

      associate (guards => self%guards, n => self%guards%count)
         limits = guards%entry(:n)%of_normal .and. guards%entry(:n)%function == of_force
         if (count(limits) < 2 .or. .not. any(limits .and. hit(:n))) return
         call guards%look(system, self%dynamics, tau, z, g, rate)
         ! A rate is a difference over `delta`.
         hit(:n) = hit(:n) .or. (limits .and. abs(g) <= guards%noise(:n) .and. rate*guards%delta < -guards%noise(:n))
      end associate
   end subroutine find_at_limit

   !> Nothing has happened yet.
   pure subroutine clear(self)
      type(transition_t), intent(inout) :: self

      self%found = .true.
      self%changes = 0
      self%impacts = 0
      self%landed = 0
   end subroutine clear

   !> Add a change to the list.
   pure subroutine note(self, j, branch)
      class(transition_t), intent(inout) :: self
      integer, intent(in) :: j, branch

      self%changes = self%changes + 1
      self%contact(self%changes) = j
      self%branch(self%changes) = branch
   end subroutine note

   !> Take up the impacts of the event, and land those whose sequences end now.
   subroutine follow_impacts(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      logical :: landed(size(self%next))
      integer :: j

      if (.not. self%found) return
      if (self%impacts > 0) call cut_short(self, system, tau, z)
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
      integer :: changes, impacts
      logical :: touching(2, size(self%next))

      call self%accumulation%follow(system, self%dynamics, self%guards, self%before, self%side(:self%sides), tau, z, &
                                    self%saltation, touching)
      if (.not. any(touching)) return
      contact = self%contact
      branch = self%branch
      changes = self%changes
      impacts = self%impacts
      call resolve(self, system, tau, z, touching=touching)
      self%contact = contact
      self%branch = branch
      self%changes = changes
      self%impacts = impacts
      call self%accumulation%confirm(system, self%dynamics%mode%branch)
   end subroutine cut_short

   !> Impacts and the branches that follow at (tau, z), where the guards `hit` were left; without, branches and state are made
   !> consistent. Edges that are `touching` (lower and upper, contacts) do so whatever the gap.
   subroutine resolve(self, system, tau, z, hit, touching)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(in), optional :: hit(:), touching(:, :)

      integer :: j
      logical :: lets_go

      associate (dynamics => self%dynamics, guards => self%guards)
         self%before = dynamics%mode%branch
         self%next = dynamics%mode%branch
         self%resting = .false.
         self%stirred = .not. (present(hit) .or. present(touching))
         if (present(hit)) self%stirred(pack(guards%entry(:guards%count)%contact, hit(:guards%count))) = .true.
         if (present(touching)) self%stirred = any(touching, 1)
         self%again = self%let_go .and. .not. tau > 0.0_wp
         self%let_go = .false.
         self%yielding = 0
         self%impacts = 0
         self%sides = 0
         call guards%measure(system, tau, z, .false., dynamics%excitation%now())
         self%left = .false.
         if (present(touching)) self%left = touching
         lets_go = present(hit)
         if (present(hit)) then
            lets_go = all(guards%entry(:guards%count)%function == of_force .or. .not. hit(:guards%count))
            call take_hits(self, system, hit, tau, z)
         end if
         call dynamics%look_at_contacts(system, tau, z)
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
            if (any(self%side(:self%sides)%before < 0.0_wp)) call take_impact(self, system, z)
            if (.not. self%found) return
            call dynamics%look_at_contacts(system, tau, z)
            call sort_friction(self, system, lets_go)
            call pass_branches(self, system)
            call take_forces(self, system, tau, z)
            if (.not. self%found) return
            call slide_out_of_play(self, system)
            call dynamics%mode%enter(system)
            call dynamics%keep_constraints(system, tau, z)
            call guards%list(system, dynamics%mode)
            call guards%measure(system, tau, z, .false., dynamics%excitation%now())
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

   !> Branches beyond the guards hit; the state is put on their bounds, and friction that has come to rest does so to the last bit.
   subroutine take_hits(self, system, hit, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer :: i, j

      associate (guards => self%guards)
         if (any(hit(:guards%count))) call self%dynamics%keep_constraints(system, tau, z)
         do i = 1, guards%count
            if (.not. hit(i) .or. guards%entry(i)%function == of_press) cycle
            j = guards%entry(i)%contact
            associate (law => system%machine%contact(j)%law, next => guards%entry(i)%next)
               if (guards%entry(i)%function == of_force) then
                  if (law%of_normal) then
                     ! Of several that have come to their limits some may stick on as others slide.
                     if (weakens(system%machine%contact(j), next)) self%yielding(j) = next
                     if (self%yielding(j) /= 0) cycle
                  end if
                  self%next(j) = next
                  self%let_go(j) = .true.
                  cycle
               end if
               if (system%constrained) call put_on_bound(self, system, i, tau, z)
               if (law%impacts) then
                  self%left(merge(1, 2, guards%entry(i)%side > 0.0_wp), j) = .true.
               else if (law%branch(next)%constraint) then
                  self%resting(j) = .true.
               else
                  self%next(j) = next
               end if
            end associate
         end do
         ! That friction left its bound by the forces before says nothing of those after another contact has changed.
         if (any(self%next /= self%before .and. .not. self%let_go)) self%yielding = 0
      end associate
   end subroutine take_hits

   !> Put z on the bound of guard i, where whoever found the event has it: the state is the sum of many terms, and errs by more than
   !> the function does. What is held stays so.
   subroutine put_on_bound(self, system, i, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: i
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: along(system%m), miss, reach

      call self%dynamics%look_at_contacts(system, tau, z)
      associate (guard => self%guards%entry(i), m => system%m, j => self%guards%entry(i)%contact)
         miss = guard%alpha*self%dynamics%s(j) + guard%beta*self%dynamics%rate(j) + guard%gamma - guard%bound
         along = self%dynamics%mode%constraints%free_part(self%dynamics%w, j)
         reach = dot_product(self%dynamics%w(:, j), along)
         if (.not. reach > 0.0_wp) return
         if (abs(guard%alpha) > 0.0_wp) then
            z(:m) = z(:m) - along*(miss/(guard%alpha*reach))
         else
            z(m + 1:) = z(m + 1:) - along*(miss/(guard%beta*reach))
         end if
      end associate
   end subroutine put_on_bound

   !> The rigid sides that touch. What is hit at the same time is stirred as well.
   subroutine touch(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: found, j

      associate (dynamics => self%dynamics, guards => self%guards, n => self%sides)
         call find_sides(system%machine%contact, dynamics%s, dynamics%rate, guards%on_s, guards%on_rate, self%before, self%left, &
                         self%let_go, self%side, n)
         do j = 1, n
            if (self%side(j)%before < 0.0_wp) self%stirred(self%side(j)%contact) = .true.
         end do
         self%stirred = [(any(self%stirred .and. system%feels == system%feels(j)), j=1, size(self%next))]
         found = n
         n = 0
         do j = 1, found
            if (.not. self%stirred(self%side(j)%contact)) cycle
            n = n + 1
            self%side(n) = self%side(j)
         end do
      end associate
   end subroutine touch

   !> The impact of all sides that touch; what it hits may be held again.
   subroutine take_impact(self, system, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: z(:)

      !> Stays unallocated, and so absent, if it is not wanted.
      type(impact_derivative_t), allocatable :: derivative
      real(wp) :: change(system%m), still(system%m)
      integer :: i

      if (self%saltation%wanted) allocate (derivative)
      associate (side => self%side(:self%sides))
         call strike(system%machine%contact, self%dynamics%w, self%dynamics%rate, self%guards%on_rate, side, change, self%found, &
                     derivative)
         if (.not. self%found) return
         z(system%m + 1:) = z(system%m + 1:) + change
         do i = 1, self%sides
            self%let_go(side(i)%contact) = .false.
         end do
         self%let_go = self%let_go .and. .not. system%machine%contact%normal_of > 0
         self%impacts = count(side%before < 0.0_wp)
      end associate
      if (.not. allocated(derivative)) return
      still = 0.0_wp
      self%saltation%defined = self%saltation%defined .and. derivative%defined
      call self%saltation%add_impulses(derivative%effect, derivative%direction, derivative%sign &
                                       *[(self%dynamics%second_rate(system, derivative%contact(i), still), &
                                          i=1, size(derivative%contact))])
   end subroutine take_impact

   !> Which friction elements slide and which rest. Where contacts only let go, speeds stay as they are: what slides at speed 0,
   !> beside others in its direction that stick, sticks again only if it has a given limit, and slid with that.
   subroutine sort_friction(self, system, lets_go)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: lets_go

      integer :: j

      do j = 1, size(self%next)
         if (.not. (system%machine%contact(j)%law%of_normal .and. self%stirred(j))) cycle
         if (self%let_go(j) .and. self%impacts == 0) cycle
         if (lets_go .and. self%impacts == 0 .and. self%before(j) /= branch_sticking .and. &
             (weakens(system%machine%contact(j), self%before(j)) .or. system%machine%contact(j)%normal_of > 0)) cycle
         if (abs(self%dynamics%rate(j)) <= self%guards%on_rate(j)) then
            self%resting(j) = .not. self%let_go(j)
         else
            self%resting(j) = .false.
            self%next(j) = merge(branch_forward, branch_backward, self%dynamics%rate(j) > 0.0_wp)
         end if
      end do
   end subroutine sort_friction

   !> Let compliant contacts go on to further branches, as long as s and s' are beyond those that they are in.
   subroutine pass_branches(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: branch, j, round
      logical :: further

      do round = 1, most_passed - 1
         further = .false.
         do j = 1, size(self%next)
            associate (law => system%machine%contact(j)%law)
               if (law%impacts .or. law%of_normal) cycle
               branch = law%branch_beyond(self%next(j), self%dynamics%s(j), self%dynamics%rate(j), self%guards%on_s(j), &
                                          self%guards%on_rate(j))
            end associate
            if (branch == 0) cycle
            if (self%next(j) /= self%before(j)) call self%note(j, self%next(j))
            call remember(self, system, j, self%next(j), branch)
            self%next(j) = branch
            further = .true.
         end do
         if (.not. further) exit
      end do
   end subroutine pass_branches

   !> Contact j comes from a branch to the next: where its law remembers, and it ceases to slide, s is at the bound that it slid at.
   !> The derivatives of a motion do not know of that.
   subroutine remember(self, system, j, from, next)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j, from, next

      real(wp) :: edge
      integer :: t

      associate (law => system%machine%contact(j)%law, error => system%gap(j)%error, s => self%dynamics%s(j))
         if (.not. law%remembers .or. from == next .or. next /= law%home) return
         edge = merge(law%branch(next)%guard(1)%upper, law%branch(next)%guard(1)%lower, law%branch(next)%guard(1)%above == from)
         t = maxloc(abs(error), 1)
         call self%dynamics%excitation%shift(t, (edge - s)/error(t)%re)
         s = edge
         self%saltation%defined = .false.
      end associate
   end subroutine remember

   !> The branches from what is certain and, for candidates, from problems of accelerations and of further derivatives: one, and one
   !> more after each friction element that begins to slide with less than the force of sticking, and after each contact that does
   !> not leave although its guard was left, as others that did so have changed its force.
   subroutine take_forces(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      real(wp), dimension(size(self%next)) :: noise, normal, per_normal, second_rate
      integer :: candidates, loose, round, tied(size(self%next))
      logical :: returned
      type(tie_t), allocatable :: tie(:)

      associate (contact => system%machine%contact, side => self%side(:self%sides))
         do round = 1, most_rounds*(size(self%next) + 1)
            call assume(contact, side, self%resting, self%stirred, self%next, candidates)
            self%dynamics%mode%branch = self%next
            tied = 0
            loose = 0
            if (candidates > 0) then
               call accelerations(self%dynamics, system, tau, z, self%guards%seen, second_rate, noise, normal, per_normal)
               call choose(contact, self%dynamics%w, side, self%resting, second_rate, noise, normal, per_normal, self%next, &
                           loose, tied, self%found)
               if (.not. self%found) return
               self%dynamics%mode%branch = self%next
            end if
            if (loose == 0) then
               call find_ties(self, system, tau, z, tied, tie, returned)
               if (returned) cycle
               call break_ties(system, self%dynamics, tau, z, self%guards, tie, loose)
               self%next = self%dynamics%mode%branch
               if (loose == 0) return
            end if
            self%resting(loose) = .false.
            self%yielding = 0
         end do
      end associate
   end subroutine take_forces

   !> The contacts that are tied in the mode as it is: those that `choose` says (contacts), and those whose guard was left while
   !> their acceleration is 0. If one of the latter does not leave it is a candidate again: it has `returned`.
   subroutine find_ties(self, system, tau, z, tied, tie, returned)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      integer, intent(in) :: tied(:)
      type(tie_t), allocatable, intent(out) :: tie(:)
      logical, intent(out) :: returned

      type(derivatives_t) :: derivatives
      real(wp) :: inwards, most
      integer :: back, i, j, way

      allocate (tie(0))
      returned = .false.
      associate (branch => self%dynamics%mode%branch, contact => system%machine%contact, side => self%side(:self%sides))
         do i = 1, self%sides
            j = side(i)%contact
            if (.not. (side(i)%candidate .and. side(i)%tied)) cycle
            if (any(side%contact == j .and. side%candidate .and. .not. side%tied .and. side%closed == branch(j))) cycle
            tie = [tie, tie_t(j, side(i)%closed, branch_open, side(i)%direction)]
         end do
         do j = 1, size(tied)
            associate (left => self%yielding(j) /= 0 .and. branch(j) == branch_sticking)
               way = tied(j)
               if (left) way = merge(1, -1, self%yielding(j) == branch_forward)
               if (way == 0) cycle
               if (way == either_way) then
                  tie = [tie, tie_t(j, branch_sticking, branch_forward, 1.0_wp, unpressed=.true.), &
                         tie_t(j, branch_sticking, branch_backward, -1.0_wp, unpressed=.true.)]
                  cycle
               end if
               tie = [tie, tie_t(j, branch_sticking, merge(branch_forward, branch_backward, way > 0), real(way, wp), left)]
            end associate
         end do
         if (.not. any(self%let_go)) return
         call self%dynamics%mode%enter(system)
         call differentiate(derivatives, system, self%dynamics, tau, z, self%guards%seen, 2)
         back = 0
         most = 0.0_wp
         do j = 1, size(tied)
            if (self%again(j) .or. .not. self%let_go(j) .or. contact(j)%law%branch(branch(j))%constraint) cycle
            way = leaves(j)
            inwards = -way*derivatives%s(j, 2)/system%reach(j)
            if (abs(derivatives%s(j, 2)) <= noise_of(derivatives, system, j, 2)) then
               tie = [tie, tie_t(j, self%before(j), branch(j), real(way, wp), left=.true.)]
            else if (inwards > most) then
               most = inwards
               back = j
            end if
         end do
         returned = back > 0
         if (.not. returned) return
         self%let_go(back) = .false.
         self%resting(back) = contact(back)%law%of_normal
         where (side%contact == back .and. side%closed == self%before(back)) side%candidate = .true.
      end associate

   contains

      !> The sign of s in which contact j leaves.
      integer function leaves(j)
         integer, intent(in) :: j

         associate (branch => self%dynamics%mode%branch(j))
            if (system%machine%contact(j)%law%impacts) then
               leaves = merge(1, -1, self%before(j) == system%machine%contact(j)%law%branch(branch_open)%guard(1)%below)
            else
               leaves = merge(1, -1, branch == branch_forward)
            end if
         end associate
      end function leaves

   end subroutine find_ties

   !> Friction that nothing presses does not stick.
   subroutine slide_out_of_play(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: j

      associate (branch => self%dynamics%mode%branch)
         do j = 1, size(branch)
            if (.not. self%resting(j) .or. branch(j) /= branch_sticking .or. self%dynamics%mode%in_play(system, j)) cycle
            branch(j) = branch_forward
            self%next(j) = branch_forward
            self%resting(j) = .false.
         end do
      end associate
   end subroutine slide_out_of_play

   !> s'' of all contacts without the constraint forces of the mode, and its rounding; normal forces of friction without those, and
   !> the forces of sliding friction per normal force (contacts each).
   subroutine accelerations(dynamics, system, tau, z, seen, second_rate, noise, normal, per_normal)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:), seen(2)
      real(wp), intent(out) :: second_rate(:), noise(:), normal(:), per_normal(:)

      type(derivatives_t) :: derivatives
      real(wp) :: a(system%m)
      integer :: j

      call dynamics%mode%enter(system)
      call differentiate(derivatives, system, dynamics, tau, z, seen, 2)
      call accelerate_unconstrained(dynamics, system, tau, z, a)
      per_normal = 0.0_wp
      do j = 1, size(second_rate)
         second_rate(j) = dynamics%second_rate(system, j, a)
         noise(j) = noise_of(derivatives, system, j, 2)
         normal(j) = dynamics%normal_of(system, j)
         associate (law => system%machine%contact(j)%law)
            if (dynamics%mode%does(j) /= lawful .or. .not. law%of_normal) cycle
            per_normal(j) = law%force(dynamics%mode%branch(j), dynamics%s(j), dynamics%rate(j), 1.0_wp)
         end associate
      end do
   end subroutine accelerations

   !> Move z out of rigid stops that it starts beyond, by the shortest way.
   subroutine push_out(self, system, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: z(:)

      real(wp) :: change(system%m)
      logical :: moved

      self%before = branch_open
      self%let_go = .false.
      self%stirred = .true.
      self%left = .false.
      call touch(self, system)
      call push_apart(system%w, self%dynamics%s, self%guards%on_s, self%side(:self%sides), change, moved, self%found)
      if (moved .and. self%found) z(:system%m) = z(:system%m) + change
   end subroutine push_out

end module razy_hybrid_transition
