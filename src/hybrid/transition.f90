!! What follows an event: impacts of all contacts that touch, and then the branches that fit the accelerations.
!!
!! 1. Rigid sides that touch with approaching speeds, together with all that touch already and the friction that they press, form
!!    one impact (razy_hybrid_impact).
!! 2. Sides that touch and friction elements that rest after that are candidates for constraints: accelerations say which of them
!!    separate, slide, or stay closed and stick (razy_hybrid_active_sides).
!! 3. A constraint whose force is on its bound and about to leave it is let go at once.
module razy_hybrid_transition
   use razy_contact_contact_law, only: branch_backward, branch_forward, branch_open, branch_sticking, branches
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_hybrid_passed_branches, only: branch_beyond
   use razy_hybrid_active_sides, only: assume, choose
   use razy_hybrid_impact, only: push_apart, strike
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_touching_sides, only: find_sides, side_t
   implicit none(type, external)
   private

   public :: resolution_t

   !> The outcome of an event and its workspace.
   type :: resolution_t
      !> Whether admissible impulses and forces were found.
      logical :: found = .true.
      !> Contacts whose branch has changed or that had an impact (changes), and the branches that follow. Branches that were passed
      !> in no time come first, then all others in the order of their contacts.
      integer :: changes = 0
      integer, allocatable :: contact(:), branch(:)
      !> Contacts that had an impact in this event, and the speeds of their gaps after it with their directions in s.
      integer :: impacts = 0
      logical, allocatable :: impacted(:)
      real(wp), allocatable :: speed(:), direction(:)
      integer, private :: sides = 0
      type(side_t), allocatable, private :: side(:)
      integer, allocatable, private :: next(:), before(:)
      !> Friction elements that rest; those that have been let go.
      logical, allocatable, private :: resting(:), let_go(:)
      !> Edges that were left (lower and upper, contacts); rounding of s and s' (contacts each).
      logical, allocatable, private :: left(:, :)
      real(wp), allocatable, private :: noise_s(:), noise_rate(:)
      !> Whether no contact impacts, is held, or sticks: branches follow one another, and that is all.
      logical, private :: plain = .false.
   contains
      procedure :: attach
      procedure :: settle
      procedure :: push_out
      procedure :: note
   end type resolution_t

   !> Branches that one contact may pass in no time, with the one that holds.
   integer, parameter :: most_passed = 9

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: i, j, n

      n = size(field%branch)
      if (allocated(self%contact)) deallocate (self%contact, self%branch, self%impacted, self%speed, self%side, self%next, &
                                               self%direction, self%before, self%resting, self%let_go, self%left, self%noise_s, &
                                               self%noise_rate)
      allocate (self%contact(most_passed*n), self%branch(most_passed*n), self%next(n), self%before(n), source=0)
      allocate (self%impacted(n), self%resting(n), self%let_go(n), self%left(2, n), source=.false.)
      allocate (self%speed(n), self%direction(n), self%noise_s(n), self%noise_rate(n), source=0.0_wp)
      allocate (self%side(2*n))
      self%plain = .true.
      do j = 1, n
         associate (law => field%machine%contact(j)%law)
            self%plain = self%plain .and. .not. law%impacts .and. .not. any([(law%constraint(i), i=1, branches)])
         end associate
      end do
   end subroutine attach

   !> Carry out the event at (tau, z) where the guards `hit` were left (all false: make branches and state consistent): jumps
   !> of z, the new mode of the field, and the guards of that.
   subroutine settle(self, field, guards, hit, tau, z)
      class(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(inout) :: guards
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer :: j, round

      self%found = .true.
      self%before = field%branch
      self%next = field%branch
      self%resting = .false.
      self%let_go = .false.
      self%impacted = .false.
      self%impacts = 0
      call guards%measure(field, tau, z, .false.)
      call take_hits(self, field, guards, hit, tau, z)
      if (self%plain) then
         call follow_branches(self, field, guards)
         return
      end if
      call take_sides(self, field, guards)
      if (any(self%side(:self%sides)%before < 0.0_wp)) call take_impact(self, field, z)
      if (.not. self%found) return
      call field%look_at_contacts(tau, z)
      call sort_friction(self, field, guards)
      self%changes = 0
      do round = 1, most_passed - 1
         if (.not. further(self, field)) exit
      end do
      do round = 1, 2*size(self%next) + 1
         call take_forces(self, field, tau, z)
         if (.not. self%found) return
         call field%enter_mode()
         call field%keep_constraints(tau, z)
         call guards%watch(field)
         call guards%measure(field, tau, z, .false.)
         if (.not. let_go_of(self, field, guards, tau, z)) exit
      end do
      do j = 1, size(self%next)
         if (field%branch(j) == self%before(j) .and. .not. self%impacted(j) .and. .not. any(self%contact(:self%changes) == j)) cycle
         call note(self, j, field%branch(j))
      end do
   end subroutine settle

   !> The branches that follow at the s and s' that the field has just looked at, where nothing else can happen.
   subroutine follow_branches(self, field, guards)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards

      integer :: j, round

      do j = 1, size(self%next)
         self%noise_s(j) = guards%on_s(j)
         self%noise_rate(j) = guards%on_rate(j)
      end do
      self%changes = 0
      do round = 1, most_passed - 1
         if (.not. further(self, field)) exit
      end do
      do j = 1, size(self%next)
         field%branch(j) = self%next(j)
         if (self%next(j) == self%before(j) .and. .not. any(self%contact(:self%changes) == j)) cycle
         call note(self, j, self%next(j))
      end do
   end subroutine follow_branches

   !> Add a change to the list.
   pure subroutine note(self, j, branch)
      class(resolution_t), intent(inout) :: self
      integer, intent(in) :: j, branch

      self%changes = self%changes + 1
      self%contact(self%changes) = j
      self%branch(self%changes) = branch
   end subroutine note

   !> Branches beyond the guards hit; friction that has come to rest does so to the last bit, and what has rested until now rested.
   subroutine take_hits(self, field, guards, hit, tau, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer :: i, j

      self%left = .false.
      if (any(hit)) call field%keep_constraints(tau, z)
      do i = 1, guards%count
         if (.not. hit(i)) cycle
         j = guards%entry(i)%contact
         associate (law => field%machine%contact(j)%law, next => guards%entry(i)%next)
            if (guards%entry(i)%function == 0) then
               self%next(j) = next
               self%let_go(j) = .true.
            else if (law%impacts) then
               self%left(merge(1, 2, guards%entry(i)%side > 0.0_wp), j) = .true.
            else if (law%constraint(next)) then
               self%resting(j) = .true.
               call field%look_at_contacts(tau, z)
               z(field%m + 1:) = z(field%m + 1:) - field%w(:, j)*(field%rate(j)/dot_product(field%w(:, j), field%w(:, j)))
            else
               self%next(j) = next
            end if
         end associate
      end do
      call field%look_at_contacts(tau, z)
   end subroutine take_hits

   !> The rigid sides that touch; those whose force has come to 0 are released.
   subroutine take_sides(self, field, guards)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(guards_t), intent(in) :: guards

      integer :: i, j

      do j = 1, size(self%next)
         self%noise_s(j) = guards%on_s(j)
         self%noise_rate(j) = guards%on_rate(j)
      end do
      call find_sides(field%machine%contact, field%s, field%rate, self%noise_s, self%noise_rate, self%before, self%left, &
                      self%side, self%sides)
      do i = 1, self%sides
         associate (side => self%side(i))
            side%released = self%let_go(side%contact) .and. self%before(side%contact) == side%closed
         end associate
      end do
   end subroutine take_sides

   !> The impact of all sides that touch; what it hits may be held again.
   subroutine take_impact(self, field, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(inout) :: z(:)

      real(wp) :: change(field%m)
      integer :: i

      call strike(field%machine%contact, field%w, field%rate, self%noise_rate, self%side(:self%sides), change, self%found)
      if (.not. self%found) return
      z(field%m + 1:) = z(field%m + 1:) + change
      do i = 1, self%sides
         associate (side => self%side(i))
            self%let_go(side%contact) = .false.
            if (.not. side%before < 0.0_wp) cycle
            self%impacted(side%contact) = .true.
            self%speed(side%contact) = side%after
            self%direction(side%contact) = side%direction
            self%impacts = self%impacts + 1
         end associate
      end do
      self%let_go = self%let_go .and. .not. field%machine%contact%normal_of > 0
   end subroutine take_impact

   !> Which friction elements slide and which rest.
   subroutine sort_friction(self, field, guards)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(guards_t), intent(in) :: guards

      integer :: j

      do j = 1, size(self%next)
         if (.not. field%machine%contact(j)%law%constraint(branch_sticking)) cycle
         if (self%let_go(j) .and. self%impacts == 0) cycle
         if (abs(field%rate(j)) <= guards%on_rate(j)) then
            self%resting(j) = .not. self%let_go(j)
         else
            self%resting(j) = .false.
            self%next(j) = merge(branch_forward, branch_backward, field%rate(j) > 0.0_wp)
         end if
      end do
   end subroutine sort_friction

   !> Whether a compliant contact has to go on to a further branch.
   function further(self, field)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      logical :: further

      integer :: branch, j

      further = .false.
      do j = 1, size(self%next)
         associate (law => field%machine%contact(j)%law)
            if (law%impacts .or. law%constraint(branch_sticking)) cycle
            branch = branch_beyond(law, self%next(j), field%s(j), field%rate(j), self%noise_s(j), self%noise_rate(j))
         end associate
         if (branch == 0) cycle
         if (self%next(j) /= self%before(j)) call note(self, j, self%next(j))
         self%next(j) = branch
         further = .true.
      end do
   end function further

   !> The field's branches from what is certain and, for candidates, from problems of accelerations: one, and one more after each
   !> friction element that begins to slide with less than the force of sticking.
   subroutine take_forces(self, field, tau, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      real(wp), dimension(size(self%next)) :: normal, per_normal, second_rate
      integer :: candidates, loose

      associate (contact => field%machine%contact, side => self%side(:self%sides))
         do
            call assume(contact, side, self%resting, self%next, candidates)
            field%branch = self%next
            if (candidates == 0) return
            call accelerations(field, tau, z, second_rate, normal, per_normal)
            call choose(contact, field%w, side, self%resting, second_rate, normal, per_normal, self%next, loose, self%found)
            if (.not. self%found) return
            field%branch = self%next
            if (loose == 0) return
            self%resting(loose) = .false.
         end do
      end associate
   end subroutine take_forces

   !> s'' of all contacts without the constraint forces of the field's branches, normal forces of friction without those, and the
   !> forces of sliding friction per normal force (contacts each).
   subroutine accelerations(field, tau, z, second_rate, normal, per_normal)
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: second_rate(:), normal(:), per_normal(:)

      real(wp) :: a(field%m)
      integer :: j, k

      call field%enter_mode()
      call field%look_at_contacts(tau, z)
      call field%free_acceleration(z, a)
      per_normal = 0.0_wp
      do k = 1, field%acts
         j = field%acting(k)
         associate (law => field%machine%contact(j)%law)
            if (law%of_normal) then
               field%normal(j) = field%normal_of(j)
               per_normal(j) = law%force(field%branch(j), field%s(j), field%rate(j), 1.0_wp)
            end if
            field%force(j) = law%force(field%branch(j), field%s(j), field%rate(j), field%normal(j))
            a = a - field%w(:, j)*field%force(j)
         end associate
      end do
      do j = 1, size(second_rate)
         second_rate(j) = field%second_rate(j, a)
         normal(j) = field%normal_of(j)
      end do
   end subroutine accelerations

   !> Whether a constraint force of the new mode is on its bound and leaving it; then the contact is let go.
   function let_go_of(self, field, guards, tau, z) result(any_did)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(inout) :: guards
      real(wp), intent(in) :: tau, z(:)
      logical :: any_did

      real(wp) :: g(guards%count), rate(guards%count)
      integer :: i, j

      any_did = .false.
      if (.not. guards%forced) return
      call guards%look(field, tau, z, g, rate)
      do i = 1, guards%count
         if (guards%entry(i)%function /= 0) cycle
         if (g(i) > guards%noise(i) .or. .not. rate(i)*guards%delta < -guards%noise(i)) cycle
         j = guards%entry(i)%contact
         if (self%let_go(j)) cycle
         any_did = .true.
         self%let_go(j) = .true.
         self%resting(j) = .false.
         self%next(j) = guards%entry(i)%next
         where (self%side(:self%sides)%contact == j .and. self%side(:self%sides)%closed == field%branch(j)) &
            self%side(:self%sides)%released = .true.
      end do
   end function let_go_of

   !> Move z out of rigid stops that it starts beyond, by the shortest way; `moved` tells whether that was so.
   subroutine push_out(self, field, guards, tau, z, moved)
      class(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: moved

      real(wp) :: change(field%m)

      call field%look_at_contacts(tau, z)
      self%before = branch_open
      self%let_go = .false.
      self%left = .false.
      call take_sides(self, field, guards)
      call push_apart(field%w, field%s, self%noise_s, self%side(:self%sides), change, moved, self%found)
      if (moved .and. self%found) z(:field%m) = z(:field%m) + change
   end subroutine push_out

end module razy_hybrid_transition
