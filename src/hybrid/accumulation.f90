!! Accumulations of impacts (Zeno): impacts of a rigid contact that follow each other ever faster until it is at rest.
!!
!! Between impacts of a sequence with the restitution ρ < 1 under a relative acceleration -a that hardly changes, the speed after
!! impact n is u_n = ρ u_(n-1), the height of the flight u_n²/(2a), and all flights that are still to come take
!! T = Σ 2 u_n ρ^k/a = 2 u_n/(a (1 - ρ)). ρ is ε of a contact that is alone; where several work together it is not, and is measured.
!! A sequence is cut short when its flights are below the rounding of the first one's height (u_n² <= eps u_1²), or of the gap
!! itself: the speed of the gap is taken out by an impulse, the contact is held closed, and the end of the sequence is
!! reported T later. What is neglected is then below rounding of the path. The contact presses m (a T - u_n) in all that is still
!! to come and m a T while it is held, so friction that slides under it takes back its part of the impulse m u_n as well. Friction
!! that acts only while the contact is closed (`only_with`) begins at the end of the sequence: what sliding would give in T is taken
!! back at once.
!!
!! A flight lower than 16 roundings of the gap cannot be followed: its end is found too late, and so too fast. A contact that
!! would take one ends its sequence here, whatever the ratio, also where the impact of another one has thrown it up.
!!
!! A body that two others squeeze goes to and fro between them, and the speeds of both gaps fall by the same ratio, whatever pulls;
!! so it is where one of the two impacts has no restitution.
!! When the flights can no longer be followed, what is still to come is given at once: all impulses from one impact of a contact to
!! its next fall by the ratio ρ, also those of friction that stops at some impacts and is set in motion by others, so what they
!! change comes once more times ρ/(1 - ρ). In the limit no gap has a speed; what is left of them is taken out as above.
module razy_hybrid_accumulation
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_active_sides, only: find_sides, set_up, side_t
   use razy_hybrid_at_rest, only: is_held, take_out
   use razy_hybrid_dynamics, only: accelerate_unconstrained, dynamics_t
   use razy_hybrid_guards, only: guards_t, lowest_flight
   use razy_hybrid_impact, only: are_jammed, strike
   use razy_hybrid_saltation, only: saltation_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_complementarity_friction, only: solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t
   implicit none(type, external)
   private

   public :: accumulation_t

   type :: accumulation_t
      !> Whether sequences are on their way to their ends, and when the first of these is, s from now.
      logical :: landing = .false.
      real(wp) :: rest = huge(1.0_wp)
      !> Time since the last impact of every contact (contacts), s; above 0 for what has had none.
      real(wp), allocatable :: since(:)
      !> Whose sequences these are (contacts), and their ends, s from now.
      logical, allocatable, private :: whose(:)
      real(wp), allocatable, private :: ends(:)
      !> The last impacts of every contact (contacts): number in the sequence, first and last speed, last ratio; the direction in
      !> which the gap opens; time between the last one and that before it, s; numbers of these two among the impacts of all
      !> contacts, and how many there were.
      integer, allocatable, private :: count(:)
      real(wp), allocatable, private :: first(:), last(:), ratio(:), way(:), flight(:)
      integer(i8), allocatable, private :: number(:, :)
      integer(i8), private :: impacts = 0
      !> y' after these two impacts (m, 2, contacts).
      real(wp), allocatable, private :: speed(:, :, :)
   contains
      procedure :: begin
      procedure :: pass
      procedure :: follow
      procedure :: confirm
      procedure :: land
   end type accumulation_t

   !> Ratios of one sequence differ by less than this part.
   real(wp), parameter :: steady = 0.01_wp
   !> Impacts in turn that are tried.
   integer, parameter :: most_in_turn = 20000
   !> Flights between two others that are shorter than so many roundings of the gap are not followed.
   real(wp), parameter :: shortest = 64.0_wp
   !> Among impacts in turn those slower than this part of the fastest have no restitution, and what is slower than this part of
   !> these is at rest.
   real(wp), parameter :: at_rest = 1.0e-6_wp

contains

   !> No impact yet, of so many contacts on m coordinates.
   subroutine begin(self, m, contacts)
      class(accumulation_t), intent(out) :: self
      integer, intent(in) :: m, contacts

      allocate (self%count(contacts), source=0)
      allocate (self%number(2, contacts), source=0_i8)
      allocate (self%speed(m, 2, contacts), self%first(contacts), self%last(contacts), self%ratio(contacts), self%way(contacts), &
                self%flight(contacts), self%ends(contacts), source=0.0_wp)
      allocate (self%since(contacts), source=tiny(1.0_wp))
      allocate (self%whose(contacts), source=.false.)
   end subroutine begin

   !> Time passes, s.
   pure subroutine pass(self, duration)
      class(accumulation_t), intent(inout) :: self
      real(wp), intent(in) :: duration

      self%since = self%since + duration
      if (.not. self%landing) return
      self%ends = self%ends - duration
      self%rest = self%rest - duration
   end subroutine pass

   !> Follow the impact, now, at `tau` of the piece and z, of the rigid sides that touched: those that are hit, and those that were
   !> closed and are thrown up by it. Before it contacts were in the branches `was` (contacts). Where sequences end here, on the
   !> edges `touching` (lower and upper, contacts), z is left without the speeds of their gaps.
   subroutine follow(self, system, dynamics, guards, was, side, tau, arriving, z, saltation, touching)
      class(accumulation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: was(:)
      type(side_t), intent(inout) :: side(:)
      real(wp), intent(in) :: tau, arriving(:)
      real(wp), intent(inout) :: z(:)
      type(saltation_t), intent(inout) :: saltation
      logical, intent(out) :: touching(:, :)

      real(wp) :: a(system%m), pull, way(size(self%count))
      integer, allocatable :: list(:)
      integer :: i, j
      logical :: ending(size(self%count)), held(size(self%count)), jammed(size(side)), low

      ending = .false.
      call dynamics%accelerate(system, tau, z, a)
      do i = 1, size(side)
         if (.not. side(i)%before < 0.0_wp) cycle
         call take_up(self, side(i)%contact, -side(i)%before, side(i)%after, side(i)%direction, z(system%m + 1:))
      end do
      do i = 1, size(side)
         j = side(i)%contact
         pull = -side(i)%direction*dynamics%second_rate(system, j, a)
         ! Where another one's impacts come between, its rounding counts as well: without loss this one would fly for ever.
         low = pull > 0.0_wp .and. side(i)%after**2 <= 2*pull*lowest_flight* &
               max(guards%on_s(j), maxval(guards%on_s, system%feels == system%feels(j) .and. self%number(2, :) > self%number(1, j)))
         associate (restitution => system%machine%contact(j)%law%restitution)
            if (side(i)%before < 0.0_wp) then
               call end_squeezed(self, system, dynamics, guards, side, j, a, tau, arriving, z, ending, saltation%defined)
               if (ending(j) .or. .not. side(i)%after > 0.0_wp) cycle
               if (.not. ended(self, j, pull, low, alone(self, system, dynamics%mode%branch, j), restitution)) cycle
            else
               if (side(i)%before > 0.0_wp .or. .not. side(i)%after > 0.0_wp .or. .not. low) cycle
               call end_squeezed(self, system, dynamics, guards, side, j, a, tau, arriving, z, ending, saltation%defined)
               if (ending(j)) cycle
               self%ratio(j) = restitution
            end if
         end associate
         ending(j) = .true.
         self%way(j) = side(i)%direction
         self%whose(j) = .true.
         self%ends(j) = 0.0_wp
         if (self%ratio(j) < 1.0_wp) self%ends(j) = 2*side(i)%after/(pull*(1.0_wp - self%ratio(j)))
         self%count(j) = 0
      end do
      touching(1, :) = ending .and. self%way > 0.0_wp
      touching(2, :) = ending .and. .not. self%way > 0.0_wp
      if (.not. any(ending)) return
      call dynamics%look_at_contacts(system, tau, z)
      jammed = are_jammed(dynamics%w, side) .or. stays(guards, side)
      way = self%way
      do j = 1, size(held)
         ! What is jammed or stays is held, whichever of its sides or of others holds it in this mode.
         held(j) = .not. ending(j) .and. (any(side%contact == j .and. jammed) &
                                          .or. (is_held(system, dynamics%mode%branch, was, j) .and. &
                                                .not. any(side%contact == j .and. side%after > 16*guards%on_rate(j))))
         if (held(j)) way(j) = merge(1.0_wp, -1.0_wp, system%machine%contact(j)%law%branch(dynamics%mode%branch(j))%side < 0)
      end do
      list = [pack([(j, j=1, size(ending))], ending), pack([(j, j=1, size(held))], held)]
      call take_out(system, dynamics, list, count(ending), way(list), self%ends(list), z(system%m + 1:), saltation)
   end subroutine follow

   !> Add contact j and those whose impacts alternate with its own to those whose sequences are `ending` now (contacts): those on a
   !> `side` that was open and touches, if impacts in turn take all speeds. Where friction has a part in it, or is pressed by stops,
   !> that does not tell: there, if all speeds fall by the same ratio and the next flights are rounding, y'
   !> of z gets what all impacts still to come give, without what accelerations `a` (m) give in the same time, unless friction would
   !> turn round by that, and derivatives are no longer `defined`.
   subroutine end_squeezed(self, system, dynamics, guards, side, j, a, tau, arriving, z, ending, defined)
      type(accumulation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(in) :: guards
      type(side_t), intent(inout) :: side(:)
      integer, intent(in) :: j
      real(wp), intent(in) :: a(:), tau, arriving(:)
      real(wp), intent(inout) :: z(:)
      logical, intent(inout) :: ending(:), defined

      real(wp) :: to_come(system%m), later
      integer :: k
      logical :: all_of_them(size(self%count)), coupled(size(self%count)), in_turn(size(side)), pressed, recent(size(self%count))

      all_of_them = .false.
      ! Friction that a stop presses couples what is not seen to be.
      pressed = any(system%machine%contact%normal_of > 0)
      coupled = pressed .or. system%feels == system%feels(j)
      recent = coupled .and. self%number(2, :) > self%number(1, j)
      in_turn = recent(side%contact) .and. .not. side%held .and. (side%contact == j .or. side%first >= 0.0_wp)
      if (self%number(1, j) > 0 .and. .not. pressed .and. count(in_turn) > 1) then
         call follow_in_turn(system, dynamics, guards, tau, arriving, in_turn, side, z, self%way, all_of_them)
      end if
      if (.not. any(all_of_them)) then
         if (self%count(j) == 0 .or. self%ratio(j) >= 1.0_wp) return
         if (.not. any([(system%machine%contact(k)%law%of_normal .and. coupled(k), k=1, size(coupled))])) return
         all_of_them = self%count > 0 .and. recent .and. self%ratio > 0.0_wp .and. &
                       abs(self%ratio - self%ratio(j)) <= steady*self%ratio(j)
         if (count(all_of_them) < 2) return
         if (any(all_of_them .and. self%ratio**2*self%last*self%flight > shortest*guards%on_s)) return
         ! From impact to impact of what is hit now: j may be thrown up by it.
         k = maxloc(self%number(2, :), dim=1, mask=all_of_them)
         to_come = (z(system%m + 1:) - self%speed(:, 1, k) - a*self%flight(k))*(self%ratio(k)/(1.0_wp - self%ratio(k)))
         do k = 1, size(self%count)
            if (system%machine%contact(k)%normal_of == 0) cycle
            associate (rate => dynamics%rate(k))
               later = rate + dot_product(dynamics%w(:, k), to_come)
               if (rate*later < 0.0_wp .and. abs(later) > max(steady*abs(rate), guards%on_rate(k))) return
            end associate
         end do
         z(system%m + 1:) = z(system%m + 1:) + to_come
         defined = .false.
      end if
      ending = ending .or. all_of_them
      self%whose = self%whose .or. all_of_them
      self%ends = merge(0.0_wp, self%ends, all_of_them)
      self%count = merge(0, self%count, all_of_them)
   end subroutine end_squeezed

   !> Whether a side was held and stays so in the impacts, to rounding.
   elemental logical function stays(guards, side)
      type(guards_t), intent(in) :: guards
      type(side_t), intent(in) :: side

      stays = side%held .and. side%after <= 16*guards%on_rate(side%contact)
   end function stays

   !> The contacts whose sequences are `ending`, as impacts in turn bring them to rest before a flight can be followed, with the
   !> `way` in which their gaps open (contacts), y' after these and so the speeds of the sides `touching`; y' is `arriving` (m)
   !> before the first of them, and in z as if all were hit at once. Gaps are unknowns of their own here, which can be told apart
   !> however small they are. Forces only have time to part what touches. None is ending unless all sides are that take part
   !> `in_turn`.
   subroutine follow_in_turn(system, dynamics, guards, tau, arriving, in_turn, touching, z, way, ending)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: tau, arriving(:)
      logical, intent(in) :: in_turn(:)
      type(side_t), intent(inout) :: touching(:)
      real(wp), intent(inout) :: z(:), way(:)
      logical, intent(inout) :: ending(:)

      type(side_t) :: all_sides(2*size(guards%on_s))
      real(wp), dimension(size(guards%on_s)) :: noise, rate
      real(wp), dimension(system%m) :: a, change, y
      real(wp) :: slow
      real(wp), allocatable :: force(:), gap(:), time(:)
      type(impact_problem_t) :: blow, pressing
      logical, allocatable :: hit(:)
      integer, allocatable :: who(:)
      integer :: i, k, n, round
      logical :: found

      rate = dynamics%rate - matmul(z(system%m + 1:) - arriving, system%w)
      call find_sides(system%machine%contact, dynamics%s, rate, spread(huge(1.0_wp), 1, size(rate)), guards%on_rate, &
                      dynamics%mode%branch, spread(spread(.false., 1, size(rate)), 1, 2), spread(.false., 1, size(rate)), &
                      all_sides, n)
      associate (side => all_sides(:n))
         associate (low => shortest*guards%on_s(side%contact))
            gap = max(0.0_wp, side%direction*(dynamics%s(side%contact) - side%edge))
            slow = at_rest*maxval(abs(side%before), mask=gap <= low)
            noise = max(guards%on_rate, at_rest*slow)
            hit = spread(.false., 1, n)
            y = arriving
            do round = 1, most_in_turn
               time = gap/max(-side%before, tiny(1.0_wp))
               k = minloc(time, 1, mask=side%before < 0.0_wp)
               if (k == 0) exit
               if (.not. any(abs(side%before) > 0.0_wp .and. max(gap, gap + side%before*time(k)) <= low)) exit
               gap = max(0.0_wp, gap + side%before*time(k))
               gap(k) = 0.0_wp
               who = pack([(i, i=1, n)], gap <= 0.0_wp .and. .not. abs(side%before) > 0.0_wp)
               call accelerate_unconstrained(dynamics, system, tau, [z(:system%m), y], a)
               pressing = impact_problem_t()
               call set_up(system%w, side(who), [integer ::], pressing)
               pressing%drift = [(side(who(i))%direction*dynamics%second_rate(system, side(who(i))%contact, a), i=1, size(who))]
               force = pressing%drift
               call solve_impact(pressing, force, found)
               who = [pack(who, force > 0.0_wp), k]
               call strike(system%machine%contact, system%w, rate, noise, side, who, abs(side%before) < slow, blow, change, found)
               if (.not. found) exit
               y = y + change
               hit(who) = hit(who) .or. abs(side(who)%after - side(who)%before) > 0.0_wp
               side%before = side%after
            end do
            hit = hit .and. (gap <= 0.0_wp .and. .not. abs(side%before) > 0.0_wp .or. round > most_in_turn)
            hit = hit .and. all([(any(hit .and. side%contact == touching(i)%contact) .or. .not. in_turn(i), i=1, size(touching))])
            ending(pack(side%contact, hit)) = .true.
         end associate
         if (any(hit)) z(system%m + 1:) = y
         call dynamics%look_at_contacts(system, tau, z)
         if (.not. any(hit)) return
         way(pack(side%contact, hit)) = pack(side%direction, hit)
         do i = 1, size(touching)
            k = findloc(side%contact == touching(i)%contact .and. side%closed == touching(i)%closed, .true., 1)
            touching(i)%after = side(k)%after
         end do
      end associate
   end subroutine follow_in_turn

   !> An impact of contact j before which the gap closes with speed v and after which it opens with speed u, in this direction of s,
   !> and y' is `speed` (m). Impacts without restitution are counted by v.
   pure subroutine take_up(self, j, v, u, way, speed)
      type(accumulation_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: v, u, way, speed(:)

      real(wp) :: pace, ratio

      self%impacts = self%impacts + 1
      self%number(:, j) = [self%number(2, j), self%impacts]
      self%speed(:, 1, j) = self%speed(:, 2, j)
      self%speed(:, 2, j) = speed
      self%way(j) = way
      self%flight(j) = self%since(j)
      self%since(j) = 0.0_wp
      pace = merge(u, v, u > 0.0_wp)
      ratio = 0.0_wp
      if (self%count(j) > 0) ratio = pace/self%last(j)
      if (ratio >= 1.0_wp .or. (self%count(j) > 1 .and. abs(ratio - self%ratio(j)) > steady*self%ratio(j))) self%count(j) = 0
      if (self%count(j) == 0) self%first(j) = pace
      self%count(j) = self%count(j) + 1
      self%ratio(j) = ratio
      self%last(j) = pace
   end subroutine take_up

   !> Whether no other contact has an impact, or is held, between the impacts of contact j.
   pure function alone(self, system, branch, j)
      type(accumulation_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:), j
      logical :: alone

      integer :: i

      alone = all([(i == j .or. .not. ((self%count(i) > 0 .and. self%number(2, i) > self%number(1, j)) .or. self%whose(i) &
                                       .or. system%machine%contact(i)%law%branch(branch(i))%constraint), i=1, size(branch))])
   end function alone

   !> Whether the sequence of contact j is to end; `pull` closes the gap, `low`: the flight is rounding of s. Of a contact that is
   !> alone, `single`, the ratio is the restitution, unless friction makes it another: the last one measured has lost half of its
   !> digits.
   function ended(self, j, pull, low, single, restitution)
      type(accumulation_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: pull, restitution
      logical, intent(in) :: low, single
      logical :: ended

      ended = .false.
      if (self%count(j) == 0 .or. .not. pull > 0.0_wp) return
      if (self%count(j) < 3) then
         if (low) self%ratio(j) = restitution
         ended = low
         return
      end if
      if (.not. low .and. self%last(j)**2 > epsilon(1.0_wp)*self%first(j)**2) return
      if (single .and. abs(self%ratio(j) - restitution) <= steady*restitution) self%ratio(j) = restitution
      ended = low .or. self%ratio(j) < 1.0_wp
   end function ended

   !> Keep of the sequences that are ending only those whose contacts are held closed in their branches (contacts).
   pure subroutine confirm(self, system, branch)
      class(accumulation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)

      integer :: j

      do j = 1, size(branch)
         self%whose(j) = self%whose(j) .and. system%machine%contact(j)%law%branch(branch(j))%constraint
      end do
      self%landing = any(self%whose)
      self%rest = minval([huge(1.0_wp), self%ends], mask=[.true., self%whose])
   end subroutine confirm

   !> The contacts (contacts) whose sequences end now, held closed in their branches (contacts).
   pure subroutine land(self, system, branch, landed)
      class(accumulation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)
      logical, intent(out) :: landed(:)

      call self%confirm(system, branch)
      landed = self%whose .and. .not. self%ends > 0.0_wp
      self%whose = self%whose .and. .not. landed
      call self%confirm(system, branch)
   end subroutine land

end module razy_hybrid_accumulation
