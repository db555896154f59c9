!! The first touch of a rigid stop, or of one whose force jumps: a grazing beyond which motions hit it, and the map has a square
!! root.
!!
!! On the side without the impact nothing is singular: of a motion of the branch the gap at its smallest, where it turns, is a
!! smooth function along the branch, and the grazing its root. The branch comes so near to it that a secant finds it to rounding.
!!
!! In a ring a whirl may touch, or part, all round at once: neither side has an event, and a motion that comes between has many.
!! What is left of the gap, or of the penetration, is smooth along the branch on either side and leads to the touch likewise.
module razy_orbits_touch
   use razy_contact_contact_law, only: contact_law_t
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_flow, only: flow_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_machine_machine, only: is_ring, machine_t
   use razy_motion_integrator, only: observer_slot_t, observer_t, piece_t
   use razy_observe_event_log, only: event_log_t
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: find_touch, find_touch_again, find_touch_beside, gaps_at, is_hard, near_touch, touch_round

   !> The smallest gap, to the lower and the upper edge, at which each contact that is looked at turns round, m or rad; huge where
   !> it does not (2, contacts). Of rings the smallest gap or penetration.
   type, extends(observer_t) :: gaps_t
      real(wp), allocatable :: smallest(:, :)
      logical, allocatable :: looks(:)
      !> Contacts whose branch the piece before ended: at an edge that one leaves its gap may have no speed but rounding.
      logical, allocatable :: left(:)
      !> Rate of each contact's displacement at the end of the piece before; 0 at first.
      real(wp), allocatable :: before(:)
   contains
      procedure :: piece
   end type gaps_t

   !> A touch farther ahead than this, in scaled unknowns, is not why the branch ends here.
   real(wp), parameter :: ahead = 1.0e-3_wp
   !> From motions that hit the stop: how far off in the parameter, in its scale, one without the impact is looked for, and in
   !> scaled unknowns at most; the share of the way to the touch that is taken at once, and how often.
   real(wp), parameter :: beside(*) = [0.0_wp, 1.0e-5_wp, -1.0e-5_wp, 1.0e-4_wp, -1.0e-4_wp, 1.0e-3_wp, -1.0e-3_wp]
   real(wp), parameter :: near = 1.0e-2_wp, share_of_way = 0.9_wp
   integer, parameter :: most_shares = 12
   !> How far the gap is opened from them at least, in scaled unknowns.
   real(wp), parameter :: least_opening = 1.0e-6_wp
   !> So often the first and the last look at a flight are halved.
   integer, parameter :: most_halves = 12
   !> So near to the touch, relative to the unknowns, it is there.
   real(wp), parameter :: least = 1.0e-10_wp
   !> Gaps of this part of the displacements are rounding.
   real(wp), parameter :: rounding = 1.0e-12_wp

contains

   !> Look in a piece for turns of contacts whose force or rate jumps.
   subroutine piece(self, part)
      class(gaps_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      integer :: j

      if (part%duration > 0.0_wp) call look()
      if (part%contact > 0) self%left(part%contact) = .true.

   contains

      subroutine look()
         real(wp), allocatable :: halves(:), time(:)
         real(wp) :: force, s
         integer :: i, looks

         select type (by => part%by)
         class is (flow_t)
            ! A contact that bounces turns twice soon after an event or before one, the later three times as far off as the sooner.
            looks = max(2, ceiling(part%duration/by%interval()))
            halves = [(0.5_wp**i, i=1, most_halves)]
            time = [0.0_wp, halves(most_halves:1:-1), [(real(i, wp), i=1, looks - 1)], looks - halves, real(looks, wp)]
            time = part%duration/looks*time
            associate (contact => by%system%machine%contact)
               do j = 1, size(contact)
                  if (is_ring(contact(j))) call look_round(contact(j)%law)
                  if (contact(j)%law%branch(by%branch(j))%constraint .or. .not. self%looks(j)) cycle
                  if (.not. self%left(j)) call look_at_event(time(2))
                  do i = merge(3, 2, self%left(j)), size(time)
                     call look_between(time(i - 1), time(i))
                  end do
                  self%left(j) = .false.
                  call part%by%contact(j, part%duration, s, self%before(j), force)
               end do
            end associate
         end select
      end subroutine look

      subroutine look_round(law)
         class(contact_law_t), intent(in) :: law

         real(wp) :: force, rate, s

         call part%by%contact(j, part%duration, s, rate, force)
         self%smallest(2, j) = min(self%smallest(2, j), abs(law%branch(branch_open)%guard(1)%upper - s))
      end subroutine look_round

      !> Friction on the same place turns round as the contact does: no piece has the turn within.
      subroutine look_at_event(soon)
         real(wp), intent(in) :: soon

         real(wp) :: after, force, rate, s

         call part%by%contact(j, soon, s, after, force)
         call part%by%contact(j, 0.0_wp, s, rate, force)
         if (self%before(j)*after > 0.0_wp) return
         if (max(abs(self%before(j)), abs(rate)) < 0.5_wp*abs(after)) call take(s, -after)
      end subroutine look_at_event

      subroutine look_between(low, high)
         real(wp), intent(in) :: low, high

         type(bracketed_root_t) :: root
         real(wp) :: force, rate(2), s

         call part%by%contact(j, low, s, rate(1), force)
         call part%by%contact(j, high, s, rate(2), force)
         if (.not. rate(1)*rate(2) < 0.0_wp) return
         call root%start(low, rate(1), high, rate(2))
         do while (.not. root%done())
            call part%by%contact(j, root%trial, s, rate(2), force)
            call root%take(rate(2))
         end do
         call part%by%contact(j, root%best, s, rate(2), force)
         call take(s, rate(1))
      end subroutine look_between

      !> The gap to an edge, or what is left of the penetration, with no rate, to which it came with this one.
      subroutine take(s, came)
         real(wp), intent(in) :: s, came

         integer :: k

         select type (by => part%by)
         class is (flow_t)
            associate (branch => by%system%machine%contact(j)%law%branch(by%branch(j)), smallest => self%smallest(:, j))
               associate (edge => branch%guard(1))
                  ! The edge of a side is the same from without and from within.
                  k = merge(2, 1, came > 0.0_wp .neqv. branch%side /= 0)
                  if (merge(edge%below, edge%above, came < 0.0_wp) == 0 .and. branch%side /= 0) return
                  if (came < 0.0_wp) smallest(k) = min(smallest(k), s - edge%lower)
                  if (came > 0.0_wp) smallest(k) = min(smallest(k), edge%upper - s)
               end associate
            end associate
         end select
      end subroutine take

   end subroutine piece

   !> Whether s', or the force, that of friction while it is closed too, jumps at an edge of the open contact j that is touched at
   !> this rate.
   pure logical function is_hard(machine, j, rate)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: j
      real(wp), intent(in) :: rate

      is_hard = machine%contact(j)%law%impacts .or. any(machine%contact%only_with == j .and. machine%contact%normal > 0.0_wp)
      if (is_hard .or. machine%contact(j)%law%of_normal) return
      associate (law => machine%contact(j)%law, edge => machine%contact(j)%law%branch(machine%contact(j)%law%home)%guard(1))
         if (edge%above > 0) is_hard = jumps(law, edge%above, edge%upper)
         if (edge%below > 0) is_hard = is_hard .or. jumps(law, edge%below, edge%lower)
      end associate

   contains

      !> Whether the force there is another than that of the open contact, by more than the rounding of what either is a sum of.
      pure logical function jumps(law, beyond, s)
         class(contact_law_t), intent(in) :: law
         integer, intent(in) :: beyond
         real(wp), intent(in) :: s

         associate (force => [law%force(law%home, s, rate, 0.0_wp), law%force(beyond, s, rate, 0.0_wp)], &
                    sides => law%branch([law%home, beyond]))
            jumps = abs(force(2) - force(1)) > 8*epsilon(s)*sum(abs(force) + abs(sides%stiffness*s) + abs(sides%offset))
         end associate
      end function jumps

   end function is_hard

   !> Whether the branch through two motions, one after the other, ends at a touch right ahead: the unknowns and the contact there.
   subroutine find_touch(problem, before, last, u, contact, found)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: before, last
      real(wp), allocatable, intent(out) :: u(:)
      integer, intent(out) :: contact
      logical, intent(out) :: found

      type(orbit_t) :: here, then
      real(wp), allocatable :: now(:), old(:)
      real(wp) :: nearest, share
      integer :: j

      contact = 0
      found = .not. (problem%is_autonomous() .or. abs(before%phase - last%phase) > 0.0_wp)
      if (.not. found) return
      call look_at(problem, before, old)
      call look_at(problem, last, now)
      nearest = ahead
      do j = 1, size(now)
         if (max(old(j), now(j)) >= huge(1.0_wp) .or. old(j) <= now(j)) cycle
         share = now(j)/(old(j) - now(j))
         if (share*norm2(last%u - before%u) > nearest) cycle
         nearest = share*norm2(last%u - before%u)
         contact = j
      end do
      found = contact > 0
      if (.not. found) return
      here = last
      then = before
      call approach(problem, last%u, contact, then, here, u, found)
   end subroutine find_touch

   !> The same of a branch of motions that hit the stop ever more softly: their neighbours without the impact lead to the touch.
   subroutine find_touch_beside(problem, last, u, contact, found)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: last
      real(wp), allocatable, intent(out) :: u(:)
      integer, intent(out) :: contact
      logical, intent(out) :: found

      type(orbit_t) :: before, here
      real(wp) :: opens(size(last%u))
      integer :: i

      contact = 0
      found = .false.
      if (problem%is_autonomous()) return
      call problem%begin_as(last)
      opens = way_to_open(problem, last)
      do i = 1, size(beside)
         call without_impact(problem, last%u + max(abs(beside(i)), least_opening)*opens, beside(i), before, found, last)
         if (found) call without_impact(problem, before%u, 0.1_wp*beside(2), here, found, last)
         if (found) found = max(before%sequence%count, here%sequence%count) < last%sequence%count
         if (.not. found) cycle
         contact = last%sequence%difference(here%sequence)
         found = contact > 0
         if (found) found = is_hard(problem%map%by%system%machine, contact, 1.0_wp)
         if (found) call approach(problem, last%u, contact, before, here, u, found, last)
         if (found) found = norm2(u - last%u) <= 0.5_wp*near
         if (found) return
      end do
   end subroutine find_touch_beside

   !> The unit direction in which the gap of a soft impact opens: its gradient is what the derivatives have in them many times.
   function way_to_open(problem, orbit) result(way)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp) :: way(size(orbit%u))

      type(orbit_t) :: there
      integer :: i
      logical :: ok

      associate (matrix => problem%jacobian(orbit))
         way = matrix(maxloc(sum(matrix**2, 2), 1), :)
         do i = 1, 3
            way = matmul(matmul(matrix, way), matrix)
            way = way/norm2(way)
         end do
      end associate
      call problem%evaluate(orbit%u + least_opening*way, .false., there, ok)
      if (.not. ok .or. there%sequence%count >= orbit%sequence%count) way = -way
   end function way_to_open

   !> A motion without the impact right beside the touch at the unknowns `touch`, to which `last`, a branch's last one, comes with
   !> an impact that others there have not; `found` is false if there is none. With `side` 1 that of a larger parameter is looked
   !> for first, with -1 that of a smaller one.
   subroutine near_touch(problem, touch, last, side, orbit, found)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: touch(:)
      type(orbit_t), intent(in) :: last
      integer, intent(in) :: side
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: found

      real(wp) :: opens(size(touch))
      integer :: i, pass

      ! From the touch itself, then with the gap opened.
      opens = 0.0_wp
      do pass = 1, 2
         do i = 2, size(beside)
            call without_impact(problem, touch + abs(beside(i))*opens, side*beside(i), orbit, found)
            if (found) found = norm2(orbit%u - touch) <= near .and. orbit%sequence%count < last%sequence%count
            if (found) return
         end do
         opens = way_to_open(problem, last)
      end do
   end subroutine near_touch

   !> The touch of this contact near the unknowns `old`, at which it was in a machine that has changed a little, on a branch of
   !> motions without the impact that goes along `tangent`; `here`: one of them beside it.
   subroutine find_touch_again(problem, old, tangent, sequence, contact, u, here, found)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: old(:), tangent(:)
      type(event_log_t), intent(in) :: sequence
      integer, intent(in) :: contact
      real(wp), allocatable, intent(out) :: u(:)
      type(orbit_t), intent(out) :: here
      logical, intent(out) :: found

      integer, allocatable :: edges(:)
      type(orbit_t) :: before, free
      integer :: i

      call problem%go_to(old, found)
      if (.not. found) return
      associate (touched => problem%map%by%system%machine%contact(contact))
         associate (edge => touched%law%branch(touched%law%home)%guard(1))
            edges = pack([2*contact - 1, 2*contact], [edge%below /= 0, edge%above /= 0] .or. is_ring(touched))
         end associate
      end associate
      call problem%map%keep_unchanged(sequence)
      do i = 1, size(beside)
         call without_impact(problem, old + beside(i)*tangent, 0.0_wp, before, found, along=tangent)
         if (found) call without_impact(problem, before%u + 0.1_wp*beside(2)*tangent, 0.0_wp, here, found, along=tangent)
         if (found) found = before%sequence%is_like(here%sequence)
         if (found) call approach(problem, old, contact, before, here, u, found, edges=edges)
         if (found) exit
      end do
      call problem%map%keep([integer ::], [integer ::], [integer ::])
      ! What was kept may have been touched before.
      if (found) call problem%evaluate(here%u, .false., free, found)
      if (found) found = free%sequence%is_like(here%sequence)
   end subroutine find_touch_again

   !> Where a branch of motions without events, of which these are two, touches a ring all round or leaves it: the unknowns and the
   !> contact there, and a motion `beyond`.
   subroutine touch_round(problem, before, last, u, contact, beyond, found)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: before, last
      real(wp), allocatable, intent(out) :: u(:)
      integer, intent(out) :: contact
      type(orbit_t), intent(out) :: beyond
      logical, intent(out) :: found

      class(contact_law_t), allocatable :: law
      type(orbit_t) :: here, then
      real(wp), allocatable :: guess(:), now(:), old(:), slope(:)
      real(wp) :: way
      integer :: i

      contact = 0
      found = .not. problem%is_autonomous() .and. before%sequence%count + last%sequence%count == 0 &
              .and. .not. abs(before%phase - last%phase) > 0.0_wp
      if (.not. found) return
      call look_at(problem, before, old)
      call look_at(problem, last, now)
      found = any(now < old .and. old < huge(1.0_wp))
      if (.not. found) return
      contact = minloc(now/(old - now), 1, now < old .and. old < huge(1.0_wp))
      then = before
      here = last
      call approach(problem, last%u, contact, then, here, u, found)
      if (.not. found) return
      allocate (law, source=problem%map%law_of(contact))
      slope = (u - before%u)/(u(size(u)) - before%u(size(u)))
      way = sign(1.0_wp, u(size(u)) - last%u(size(u)))
      do i = 2, size(beside)
         ! A guess that is not periodic touches and parts many times: first the contact is kept as it is beyond.
         call problem%map%keep([contact], [merge(law%shut, law%home, last%sequence%begins_in(contact) == law%home)], [0])
         guess = u + way*beside(i)*slope
         call without_impact(problem, guess, 0.0_wp, here, found)
         call problem%map%keep([integer ::], [integer ::], [integer ::])
         if (found) call without_impact(problem, here%u, 0.0_wp, beyond, found, last)
         if (found) found = beyond%sequence%count == 0
         if (found) return
      end do
   end subroutine touch_round

   !> From two motions without the impact to the touch, which is not far from the unknowns `old`, from one side, as beyond there
   !> are none, but with `edges` that are kept open. `last` as in `without_impact`.
   subroutine approach(problem, old, contact, before, here, u, found, last, edges)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: old(:)
      integer, intent(in) :: contact
      type(orbit_t), intent(inout) :: before, here
      real(wp), allocatable, intent(out) :: u(:)
      logical, intent(out) :: found
      type(orbit_t), intent(in), optional :: last
      integer, intent(in), optional :: edges(:)

      type(orbit_t) :: next
      real(wp), allocatable :: now(:), then(:)
      real(wp) :: share, way
      integer :: i
      logical :: as_expected

      found = .true.
      way = share_of_way
      do i = 1, most_shares
         if (.not. found) return
         call look_at(problem, before, then, edges)
         call look_at(problem, here, now, edges)
         found = max(then(contact), now(contact)) < huge(1.0_wp) .and. abs(then(contact) - now(contact)) > 0.0_wp
         if (.not. found) return
         ! Of another turn the gap is not what the one before lets expect; a branch may have crept up to the touch by itself.
         as_expected = abs(now(contact) - (1.0_wp - way)*then(contact)) &
                       <= max(0.5_wp*(1.0_wp - share_of_way)*abs(then(contact)), rounding*problem%displacement)
         if (i == 1) as_expected = now(contact) >= 0.0_wp .and. now(contact) <= least*problem%displacement
         share = now(contact)/(then(contact) - now(contact))
         u = here%u + share*(here%u - before%u)
         found = norm2(u - old) <= near
         if (.not. found .or. as_expected .and. norm2(u - here%u) <= least*norm2(u)) return
         ! What is kept open may have come beyond the touch.
         way = merge(share_of_way, 2.0_wp - share_of_way, now(contact) > 0.0_wp)
         call without_impact(problem, here%u + way*(u - here%u), 0.0_wp, next, found, last, here%u - before%u)
         if (found) found = next%sequence%is_like(here%sequence)
         before = here
         here = next
      end do
      found = .false.
   end subroutine approach

   !> The motion near `guess` with the parameter so far `off`, or with what is one `along` a branch, if it has not the contacts of
   !> `last`.
   subroutine without_impact(problem, guess, off, orbit, ok, last, along)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: guess(:), off
      type(orbit_t), intent(out) :: orbit
      logical, intent(out) :: ok
      type(orbit_t), intent(in), optional :: last
      real(wp), intent(in), optional :: along(:)

      real(wp) :: row(size(guess)), start(size(guess))

      row = [spread(0.0_wp, 1, size(guess) - 1), 1.0_wp]
      if (present(along)) row = along/norm2(along)
      start = guess
      start(size(row)) = start(size(row)) + off
      call correct(problem, start, row, orbit, ok)
      if (ok .and. present(last)) ok = .not. orbit%sequence%is_like(last%sequence)
   end subroutine without_impact

   !> The smallest gap of each contact of a motion, `edges` as in `gaps_at`.
   subroutine look_at(problem, orbit, gaps, edges)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp), allocatable, intent(out) :: gaps(:)
      integer, intent(in), optional :: edges(:)

      call problem%begin_as(orbit)
      gaps = minval(reshape(gaps_at(problem, orbit%u, edges), [2, size(problem%map%by%branch)]), 1)
   end subroutine look_at

   !> The smallest gaps, m or rad, of the motion of the unknowns u where it turns, at the map's phase: to the lower and the upper
   !> edge of the first contact, of the second and so on. Edges that are kept open are seen where they are `looked_at`.
   function gaps_at(problem, u, looked_at) result(gaps)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:)
      integer, intent(in), optional :: looked_at(:)
      real(wp), allocatable :: gaps(:)

      type(gaps_t), target :: seen
      type(observer_slot_t) :: slots(1)
      type(return_t) :: back
      real(wp), allocatable :: s(:)
      logical, allocatable :: is_edge(:)
      real(wp) :: duration
      integer :: j
      logical :: ok

      call problem%go_to(u, ok)
      s = problem%scales()
      associate (contact => problem%map%by%system%machine%contact)
         allocate (is_edge(2*size(contact)), seen%looks(size(contact)))
         seen%left = spread(.false., 1, size(contact))
         seen%before = spread(0.0_wp, 1, size(contact))
         do j = 1, size(contact)
            associate (edge => contact(j)%law%branch(contact(j)%law%home)%guard(1))
               is_edge(2*j - 1:2*j) = [edge%below /= 0, edge%above /= 0] .or. is_ring(contact(j))
            end associate
            ! Of a damped stop the derivative of the map jumps, though the force does not.
            seen%looks(j) = is_hard(problem%map%by%system%machine, j, 1.0_wp)
         end do
         if (present(looked_at)) then
            is_edge(looked_at) = .true.
            seen%looks((looked_at + 1)/2) = .true.
         end if
         allocate (seen%smallest(2, size(contact)), source=huge(1.0_wp))
      end associate
      slots(1)%observer => seen
      duration = problem%periods*problem%map%period
      associate (m => problem%states())
         if (ok) call problem%map%go(u(:m)*s(:m), duration, .false., back, slots)
      end associate
      gaps = merge(reshape(seen%smallest, [size(is_edge)]), huge(1.0_wp), is_edge)
   end function gaps_at

end module razy_orbits_touch
