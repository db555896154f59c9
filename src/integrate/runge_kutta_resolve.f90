!! What follows an event: impacts of all contacts that touch, and then the branches that fit the accelerations.
!!
!! 1. Rigid sides that touch with approaching speeds, together with all that touch already and the friction that they press, form
!!    one impact by Newton's, Moreau's and Coulomb's laws (razy_linalg_complementarity_impact).
!! 2. Sides that touch and friction elements that rest after that are candidates for constraints: the same problem for
!!    accelerations and forces says which of them separate, slide, or stay closed and stick.
!! 3. A constraint whose force is on its bound and about to leave it is let go at once.
!! A finite friction force gives no impulse: only friction pressed by a rigid contact takes part in an impact.
module razy_integrate_runge_kutta_resolve
   use razy_contact_contact_law, only: branch_backward, branch_forward, branch_open, branch_sticking
   use razy_core_kinds, only: wp
   use razy_integrate_field, only: field_t
   use razy_integrate_runge_kutta_guards, only: guards_t
   use razy_linalg_complementarity_friction, only: impact_effort_t, impact_solved, impact_swept, solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t
   implicit none(type, external)
   private

   public :: resolution_t

   !> A side of a rigid contact that touches: contact, branch when closed, direction of its gap in s, bound, speed u of the gap
   !> before and after the impact, whether it is still a candidate for a constraint.
   type :: side_t
      integer :: contact = 0, closed = 0
      real(wp) :: direction = 0.0_wp, edge = 0.0_wp, before = 0.0_wp, after = 0.0_wp, impulse = 0.0_wp
      logical :: candidate = .false., released = .false.
   end type side_t

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
   contains
      procedure :: attach
      procedure :: settle
      procedure :: push_out
      procedure :: note
   end type resolution_t

   !> Branches that one contact may pass in no time, with the one that holds.
   integer, parameter :: most_passed = 9
   !> Smaller accelerations, in parts of the largest term, are rounding.
   real(wp), parameter :: rounding = 1.0e4_wp*epsilon(1.0_wp)

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: n

      n = size(field%branch)
      if (allocated(self%contact)) deallocate (self%contact, self%branch, self%impacted, self%speed, self%side, self%next, &
                                               self%direction, self%before, self%resting, self%let_go)
      allocate (self%contact(most_passed*n), self%branch(most_passed*n), self%next(n), self%before(n), source=0)
      allocate (self%impacted(n), self%resting(n), self%let_go(n), source=.false.)
      allocate (self%speed(n), self%direction(n), source=0.0_wp)
      allocate (self%side(2*n))
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
      call find_sides(self, field, guards, hit)
      if (any(self%side(:self%sides)%before < 0.0_wp)) call strike(self, field, guards, z)
      if (.not. self%found) return
      call field%look_at_contacts(tau, z)
      call sort_friction(self, field, guards)
      self%changes = 0
      do round = 1, most_passed - 1
         if (.not. further(self, field, guards)) exit
      end do
      do round = 1, 2*size(self%next) + 1
         call choose_branches(self, field, tau, z)
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

   !> Add a change to the list.
   pure subroutine note(self, j, branch)
      class(resolution_t), intent(inout) :: self
      integer, intent(in) :: j, branch

      self%changes = self%changes + 1
      self%contact(self%changes) = j
      self%branch(self%changes) = branch
   end subroutine note

   !> Branches beyond the guards hit; friction that has come to rest does so to the last bit.
   subroutine take_hits(self, field, guards, hit, tau, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer :: i, j

      do i = 1, guards%count
         if (.not. hit(i)) cycle
         j = guards%entry(i)%contact
         associate (law => field%machine%contact(j)%law, next => guards%entry(i)%next)
            if (guards%entry(i)%function == 0) then
               self%next(j) = next
               self%let_go(j) = .true.
            else if (law%impacts) then
               cycle
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

   !> The rigid sides that touch, with their speeds (0 for rounding).
   subroutine find_sides(self, field, guards, hit)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(guards_t), intent(in) :: guards
      logical, intent(in) :: hit(:)

      integer :: j

      self%sides = 0
      do j = 1, size(self%next)
         if (.not. field%machine%contact(j)%law%impacts) cycle
         associate (open => field%machine%contact(j)%law%guard(1, branch_open))
            if (open%below /= 0) call look_at_side(open%below, 1.0_wp, open%lower)
            if (open%above /= 0) call look_at_side(open%above, -1.0_wp, open%upper)
         end associate
      end do

   contains

      subroutine look_at_side(closed, direction, edge)
         integer, intent(in) :: closed
         real(wp), intent(in) :: direction, edge

         logical :: touching
         integer :: i

         touching = self%before(j) == closed .or. direction*(field%s(j) - edge) <= guards%on_s(j)
         do i = 1, guards%count
            if (hit(i)) touching = touching .or. (guards%entry(i)%contact == j .and. guards%entry(i)%next == closed)
         end do
         if (.not. touching) return
         self%sides = self%sides + 1
         associate (side => self%side(self%sides))
            side = side_t(j, closed, direction, edge)
            side%before = direction*field%rate(j)
            if (abs(side%before) <= guards%on_rate(j)) side%before = 0.0_wp
            side%after = side%before
            side%candidate = .not. side%before > 0.0_wp
            side%released = self%let_go(j) .and. self%before(j) == closed
         end associate
      end subroutine look_at_side

   end subroutine find_sides

   !> The impact of all sides that touch; impulses act in the directions of their gaps.
   subroutine strike(self, field, guards, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards
      real(wp), intent(inout) :: z(:)

      type(impact_problem_t) :: problem
      type(impact_effort_t) :: effort
      integer :: friction(size(self%next)), i, k, m, n, outcome
      real(wp) :: d(field%m, self%sides + size(self%next)), impulse(self%sides + size(self%next))

      n = self%sides
      m = 0
      do i = 1, size(self%next)
         if (.not. field%machine%contact(i)%law%constraint(branch_sticking)) cycle
         if (.not. any(self%side(:n)%contact == field%machine%contact(i)%normal_of)) cycle
         m = m + 1
         friction(m) = i
         d(:, n + m) = field%w(:, i)
      end do
      do i = 1, n
         d(:, i) = self%side(i)%direction*field%w(:, self%side(i)%contact)
      end do
      problem%delassus = matmul(transpose(d(:, :n + m)), d(:, :n + m))
      problem%before = self%side(:n)%before
      problem%drift = [self%side(:n)%before, field%rate(friction(:m))]
      allocate (problem%restitution(n), problem%coefficient(m, n), problem%limit(m))
      problem%limit = 0.0_wp
      do i = 1, n
         problem%restitution(i) = field%machine%contact(self%side(i)%contact)%law%restitution
         do k = 1, m
            problem%coefficient(k, i) = merge(coefficient(field, friction(k), guards), 0.0_wp, &
                                              field%machine%contact(friction(k))%normal_of == self%side(i)%contact)
         end do
      end do
      call solve_impact(problem, impulse(:n + m), outcome, effort)
      self%found = outcome == impact_solved .or. outcome == impact_swept
      if (.not. self%found) return
      z(field%m + 1:) = z(field%m + 1:) + matmul(d(:, :n + m), impulse(:n + m))
      do i = 1, n
         associate (side => self%side(i))
            side%after = side%before + dot_product(problem%delassus(i, :), impulse(:n + m))
            if (abs(side%after) <= guards%on_rate(side%contact)) side%after = 0.0_wp
            side%candidate = .not. side%after > 0.0_wp
            side%released = .false.
            self%let_go(side%contact) = .false.
            if (side%before < 0.0_wp) then
               self%impacted(side%contact) = .true.
               self%speed(side%contact) = side%after
               self%direction(side%contact) = side%direction
               self%impacts = self%impacts + 1
            end if
         end associate
      end do
      self%let_go = self%let_go .and. .not. field%machine%contact%normal_of > 0
   end subroutine strike

   !> Coefficient of friction of element j at the rate it has: the static one if it rests.
   function coefficient(field, j, guards) result(mu)
      type(field_t), intent(in) :: field
      integer, intent(in) :: j
      type(guards_t), intent(in) :: guards
      real(wp) :: mu

      associate (law => field%machine%contact(j)%law)
         mu = law%force_guard(branch_sticking)%upper
         if (abs(field%rate(j)) > guards%on_rate(j)) mu = law%force(branch_forward, 0.0_wp, abs(field%rate(j)), 1.0_wp)
      end associate
   end function coefficient

   !> Which friction elements slide and which rest.
   subroutine sort_friction(self, field, guards)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(guards_t), intent(in) :: guards

      integer :: j

      do j = 1, size(self%next)
         if (.not. field%machine%contact(j)%law%constraint(branch_sticking)) cycle
         if (abs(field%rate(j)) <= guards%on_rate(j)) then
            self%resting(j) = .not. self%let_go(j)
         else
            self%resting(j) = .false.
            self%next(j) = merge(branch_forward, branch_backward, field%rate(j) > 0.0_wp)
         end if
      end do
   end subroutine sort_friction

   !> Whether a compliant contact has to go on to a further branch: on the bound of a guard and about to cross it.
   function further(self, field, guards)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(guards_t), intent(in) :: guards
      logical :: further

      real(wp) :: noise, rate, value
      integer :: f, j

      further = .false.
      do j = 1, size(self%next)
         associate (law => field%machine%contact(j)%law)
            if (law%impacts .or. law%constraint(branch_sticking)) cycle
            do f = 1, law%functions
               value = law%slope(1, f)*field%s(j) + law%slope(2, f)*field%rate(j) + law%constant(f)
               rate = law%slope(1, f)*field%rate(j)
               if (abs(law%slope(2, f)) > 0.0_wp .or. abs(field%rate(j)) <= guards%on_rate(j)) rate = 0.0_wp
               noise = abs(law%slope(1, f))*guards%on_s(j) + abs(law%slope(2, f))*guards%on_rate(j) &
                       + 16*epsilon(1.0_wp)*abs(law%constant(f))
               associate (guard => law%guard(f, self%next(j)))
                  if (guard%below /= 0 .and. beyond(value - guard%lower, rate)) then
                     call pass(guard%below)
                  else if (guard%above /= 0 .and. beyond(guard%upper - value, -rate)) then
                     call pass(guard%above)
                  end if
               end associate
            end do
         end associate
      end do

   contains

      subroutine pass(branch)
         integer, intent(in) :: branch

         if (self%next(j) /= self%before(j)) call note(self, j, self%next(j))
         self%next(j) = branch
         further = .true.
      end subroutine pass

      pure function beyond(g, g_rate)
         real(wp), intent(in) :: g, g_rate
         logical :: beyond

         beyond = (g < -noise .and. .not. g_rate > 0.0_wp) .or. (g <= noise .and. g_rate < 0.0_wp)
      end function beyond

   end function further

   !> The field's branches from what is certain and, for the candidates, from the problem of accelerations.
   subroutine choose_branches(self, field, tau, z)
      type(resolution_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      real(wp), allocatable :: d(:, :), forces(:), u(:)
      integer, allocatable :: normal(:), tangent(:)
      type(impact_problem_t) :: problem
      type(impact_effort_t) :: effort
      real(wp) :: a(field%m), least
      integer :: i, k, n, outcome

      normal = pack([(i, i=1, self%sides)], self%side(:self%sides)%candidate .and. .not. self%side(:self%sides)%released)
      tangent = pack([(i, i=1, size(self%next))], self%resting)
      n = size(normal)
      do i = 1, size(self%next)
         if (field%machine%contact(i)%law%impacts) self%next(i) = branch_open
         if (self%resting(i)) self%next(i) = branch_sticking
      end do
      do i = n, 1, -1
         self%next(self%side(normal(i))%contact) = self%side(normal(i))%closed
      end do
      field%branch = self%next
      if (n + size(tangent) == 0) return
      allocate (d(field%m, n + size(tangent)), forces(n + size(tangent)), u(n + size(tangent)))
      do i = 1, n
         d(:, i) = self%side(normal(i))%direction*field%w(:, self%side(normal(i))%contact)
      end do
      d(:, n + 1:) = field%w(:, tangent)
      call set_up(self, field, tau, z, d, normal, tangent, a, problem)
      call solve_impact(problem, forces, outcome, effort)
      self%found = outcome == impact_solved .or. outcome == impact_swept
      if (.not. self%found) return
      u = problem%drift + matmul(problem%delassus, forces)
      least = rounding*(maxval(abs(problem%drift)) + maxval(matmul(abs(problem%delassus), abs(forces))))
      do i = n, 1, -1
         associate (contact => self%side(normal(i))%contact)
            if (u(i) > least .and. self%next(contact) == self%side(normal(i))%closed) self%next(contact) = branch_open
            if (forces(i) > 0.0_wp) self%next(contact) = self%side(normal(i))%closed
         end associate
      end do
      do k = 1, size(tangent)
         if (u(n + k) > least) self%next(tangent(k)) = branch_forward
         if (u(n + k) < -least) self%next(tangent(k)) = branch_backward
      end do
      field%branch = self%next
   end subroutine choose_branches

   !> The problem of accelerations of the candidates with directions d: normal ones `normal` (numbers of sides), and tangential
   !> ones `tangent` (contacts).
   subroutine set_up(self, field, tau, z, d, normal, tangent, a, problem)
      type(resolution_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), d(:, :)
      integer, intent(in) :: normal(:), tangent(:)
      real(wp), intent(out) :: a(:)
      type(impact_problem_t), intent(out) :: problem

      real(wp) :: phi
      integer :: i, j, k, n

      n = size(normal)
      call field%enter_mode()
      call field%look_at_contacts(tau, z)
      call field%free_acceleration(z, a)
      problem%delassus = matmul(transpose(d), d)
      allocate (problem%drift(n + size(tangent)), problem%before(n), problem%restitution(n))
      allocate (problem%coefficient(size(tangent), n), problem%limit(size(tangent)))
      problem%before = 0.0_wp
      problem%restitution = 0.0_wp
      do k = 1, field%acts
         j = field%acting(k)
         associate (contact => field%machine%contact(j))
            if (contact%law%of_normal) field%normal(j) = field%normal_of(j)
            field%force(j) = contact%law%force(field%branch(j), field%s(j), field%rate(j), field%normal(j))
            a = a - field%w(:, j)*field%force(j)
            do i = 1, n
               if (contact%normal_of /= self%side(normal(i))%contact) cycle
               phi = contact%law%force(field%branch(j), field%s(j), field%rate(j), 1.0_wp)
               problem%delassus(:, i) = problem%delassus(:, i) - phi*matmul(field%w(:, j), d)
            end do
         end associate
      end do
      do i = 1, n
         problem%drift(i) = self%side(normal(i))%direction*field%second_rate(self%side(normal(i))%contact, a)
      end do
      do k = 1, size(tangent)
         j = tangent(k)
         problem%drift(n + k) = field%second_rate(j, a)
         associate (mu => field%machine%contact(j)%law%force_guard(branch_sticking)%upper)
            problem%limit(k) = mu*max(0.0_wp, field%normal_of(j))
            do i = 1, n
               problem%coefficient(k, i) = merge(mu, 0.0_wp, field%machine%contact(j)%normal_of == self%side(normal(i))%contact)
            end do
         end associate
      end do
   end subroutine set_up

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
      type(guards_t), intent(inout) :: guards
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: moved

      type(impact_problem_t) :: problem
      type(impact_effort_t) :: effort
      real(wp), allocatable :: d(:, :), shift(:)
      logical :: hit(guards%count)
      integer :: i, n, outcome

      hit = .false.
      call field%look_at_contacts(tau, z)
      self%before = branch_open
      call find_sides(self, field, guards, hit)
      n = self%sides
      moved = .false.
      self%found = .true.
      if (n == 0) return
      allocate (d(field%m, n), shift(n), problem%coefficient(0, n), problem%limit(0))
      allocate (problem%before(n), problem%restitution(n), source=0.0_wp)
      allocate (problem%drift(n))
      do i = 1, n
         associate (side => self%side(i))
            d(:, i) = side%direction*field%w(:, side%contact)
            problem%drift(i) = side%direction*(field%s(side%contact) - side%edge)
            moved = moved .or. problem%drift(i) < -guards%on_s(side%contact)
         end associate
      end do
      if (.not. moved) return
      problem%delassus = matmul(transpose(d), d)
      call solve_impact(problem, shift, outcome, effort)
      self%found = outcome == impact_solved .or. outcome == impact_swept
      if (self%found) z(:field%m) = z(:field%m) + matmul(d, shift)
   end subroutine push_out

end module razy_integrate_runge_kutta_resolve
