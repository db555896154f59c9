!! A branch of periodic motions over a parameter, by pseudo-arclength, with the points at which the motion changes its kind.
!!
!! Labels are those of AUTO's users: LP fold, PD period doubling, TR torus (Neimark-Sacker), BP branch point; and, of motions
!! with contacts, GR grazing (a contact touches its bound, or leaves it, with no speed), ST and SL (sticking begins or ends),
!! CH another change of the contact sequence; EP an end of the range, UZ a value of the user's, MX no motion further on. LP and BP
!! are roots of det ∂(P - x)/∂x, PD of det(∂P/∂x + I), TR of |μ| - 1 along the branch, where every value is that of a motion found
!! to rounding. A change of the sequence is where the propagator, which decides every contact to rounding, begins to find another.
module razy_orbits_branch
   use razy_contact_friction_law, only: branch_backward, branch_forward
   use razy_core_kinds, only: wp
   use razy_orbits_halves, only: falls_to_part, find_half
   use razy_orbits_identity, only: find_between, part_way
   use razy_orbits_orbit, only: orbit_t, problem_t, was_stopped
   use razy_orbits_point, only: between, complete_point, complete_point_at, find_tangent, kink, length, point_t, reach, step
   use razy_orbits_section, only: carry, find_quiet, is_quiet
   use razy_orbits_special, only: find_change, find_root, is_crossing, value_of
   use razy_orbits_touch, only: find_touch, find_touch_beside, is_hard, touch_round
   implicit none(type, external)
   private

   public :: branch_t

   type :: branch_t
      !> Points 1 to `count` along the branch; periods of the excitation in one of the motion.
      type(point_t), allocatable :: point(:)
      integer :: count = 0, periods = 1
      !> The branch that it begins on, 0: it was found by itself.
      integer :: parent = 0
      !> Whether it begins where its parent ends as a stop is touched.
      logical :: from_touch = .false.
      !> Why it ends, in words; whether it has come back to its first motion.
      character(:), allocatable :: ending
      logical :: closed = .false.
      !> Whether a change of the sequence in the last step was not located.
      logical, private :: lost = .false.
   contains
      procedure :: follow
      procedure :: search_between
      procedure, private :: add
      procedure, private :: search
      procedure, private :: search_smooth
   end type branch_t

   !> Steps in scaled unknowns, the largest for motions with and without events.
   real(wp), parameter :: first_step = 2.0e-3_wp, largest_step = 5.0e-3_wp, largest_smooth = 0.05_wp, least_step = 1.0e-9_wp
   !> So many steps in a row that may turn by any angle do not get past a jump; changes of the sequence looked for in one step.
   integer, parameter :: most_creeping = 20, most_changes = 40
   !> Steps no longer than this may come past a change of the sequence that is not located, if no touch is there.
   real(wp), parameter :: least_lost = 1.0e-4_wp
   !> Past such a change what is so many times as far off is another piece of the branch.
   real(wp), parameter :: far_off = 30.0_wp
   !> Up to where on its last step to a doubling a branch is searched.
   real(wp), parameter :: nearly_there = 0.5_wp
   !> A branch of fewer points is not closed.
   integer, parameter :: least_closed = 3
   !> Special points nearer than this, relative to the state, are one.
   real(wp), parameter :: coincident = 1.0e-8_wp
   !> Motions on both sides of a change of contacts that are farther apart than this, relative to the state, are no neighbours.
   real(wp), parameter :: jump = 1.0e-5_wp

contains

   !> Follow the branch through a motion, corrected and with all its derivatives, towards where `guide` (unknowns) points, while the
   !> parameter, in its scale, is within `low` and `high`, for at most `most` points. Its first step is no longer than `away`, the
   !> distance of the motion from the branch that it begins on.
   subroutine follow(self, problem, start, guide, low, high, most, away)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: start
      real(wp), intent(in) :: guide(:), low, high
      integer, intent(in) :: most
      real(wp), intent(in), optional :: away

      type(point_t) :: at, here, next
      real(wp) :: h, largest, p
      integer :: added, creeping, last
      logical :: ends, explained, found, ok

      self%periods = problem%periods
      found = .false.
      problem%map%phase = start%phase
      if (.not. allocated(self%point)) allocate (self%point(64))
      here%orbit = start
      call find_tangent(problem, here, guide, ok)
      call self%add(here)
      h = first_step
      if (present(away)) h = min(away, h)
      creeping = 0
      self%ending = "the most points"
      do while (ok .and. self%count < most)
         ! In a range that is narrower than the parameter's unit so many more of them.
         largest = merge(largest_smooth, largest_step, here%orbit%sequence%count == 0)
         associate (slope => abs(here%tangent(size(here%tangent))))
            if (h*slope > largest*(high - low)) h = largest*(high - low)/slope
         end associate
         call end_at_slip(self, problem, here, h, found)
         if (found) return
         call step(problem, here, h, next, ok)
         if (ok) ok = .not. falls_to_part(problem, here, next)
         if (.not. ok .or. .not. here%orbit%sequence%is_like(next%orbit%sequence)) then
            call pass_touch(self, problem, here, found)
            if (found) then
               ok = .true.
               h = first_step
               cycle
            end if
         end if
         if (.not. ok) then
            h = h/4
            ok = h > least_step
            if (.not. ok) self%ending = problem%reason
            cycle
         end if
         p = next%orbit%u(size(next%orbit%u))
         if (p < low .or. p > high) then
            call reach(problem, here, next, merge(low, high, p < low), ok)
            if (.not. ok) then
               h = h/4
               ok = h > least_step
               cycle
            end if
            call self%search(problem, here, next, explained)
            next%label = "EP"
            call self%add(next)
            self%ending = "the end of the range"
            return
         end if
         call find_half(problem, here, next, at, ends)
         if (ends) then
            ! At the doubling itself det ∂(P - x)/∂x is 0, of whatever sign.
            self%ending = "a doubling of a motion of half the period"
            call between(problem, here, at, nearly_there*length(here, at), next, ok)
            if (ok) call complete_point(problem, here, next, ok)
            if (ok) ok = .not. falls_to_part(problem, here, next)
            if (ok) call self%search(problem, here, next, explained)
            at%label = "EP"
            call self%add(at)
            return
         end if
         call find_between(problem, self%point(1)%orbit, here%orbit%u, next%orbit, at%orbit, self%closed)
         self%closed = self%closed .and. self%count > least_closed
         if (self%closed) call complete_point_at(problem, at, next%orbit%u - here%orbit%u, self%closed)
         if (self%closed) then
            self%ending = "the first motion again: the branch is closed"
            call self%search(problem, here, at, explained)
            at%label = "EP"
            call self%add(at)
            return
         end if
         last = self%count
         call self%search(problem, here, next, explained)
         if (.not. explained) then
            added = self%count
            self%count = last
            if (h > merge(least_lost, kink, self%lost)) then
               h = h/4
               cycle
            end if
            call end_at_touch(self, problem, found)
            if (found) return
            if (norm2(next%orbit%u - here%orbit%u) > far_off*h) then
               h = h/4
               ok = h > least_step
               if (.not. ok) self%ending = "the motion jumps to another piece of the branch"
               cycle
            end if
            self%count = added
         end if
         call end_where_touched(self, problem, last, found)
         if (found) return
         call self%add(next)
         call problem%tell("branch", self%count, problem%value_of(next%orbit))
         last = size(here%tangent)
         if (next%orbit%rounds <= 5 .and. dot_product(here%tangent, next%tangent) > 0.99_wp) then
            h = min(1.6_wp*h, largest*max(1.0_wp, norm2(next%orbit%u(:last - 1))))
         end if
         creeping = merge(creeping + 1, 0, length(here, next) < kink)
         ok = creeping < most_creeping
         if (.not. ok) self%ending = "the motion jumps: only ever smaller steps come to another"
         if (next%orbit%rounds > 7) h = h/2
         here = next
         if (ok .and. .not. is_quiet(problem, here%orbit)) call move_section(problem, here)
      end do
      if (.not. ok) call end_at_touch(self, problem, found)
      if (.not. (ok .or. found)) call end_at_half(self, problem, found)
      if (found) return
      self%point(self%count)%label = merge("EP", "MX", ok)
      if (.not. ok) call name_jump(self, problem, here)
      if (.not. problem%is_stopped()) return
      self%point(self%count)%label = "EP"
      self%ending = was_stopped
   end subroutine follow

   !> Where friction that has stuck all the time begins to slide one way within a step of length h: no motion is there then, as
   !> it comes to stick at another place. That is the branch's last point, or the step shorter.
   subroutine end_at_slip(self, problem, here, h, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(inout) :: h
      logical, intent(out) :: found

      type(point_t) :: at

      found = .false.
      if (size(here%orbit%stuck) == 0) return
      at = here
      call find_edge(problem, here, h, at%contact)
      found = at%contact > 0 .and. h < kink
      if (.not. found) then
         if (at%contact > 0) h = 0.9_wp*h
         return
      end if
      at%orbit%u = here%orbit%u + h*here%tangent
      at%label = "SL"
      self%ending = "friction that has stuck all the time begins to slide"
      call self%add(at)
   end subroutine end_at_slip

   !> How far the tangent leads, up to h, until friction that has stuck all the time slides one way, or until the map jumps by
   !> `missed`, with the contact; 0: it does not.
   subroutine find_edge(problem, here, h, contact, missed)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(inout) :: h
      integer, intent(out) :: contact
      real(wp), intent(in), optional :: missed

      integer :: changed
      real(wp) :: high, middle

      contact = change_at(h)
      if (contact == 0) return
      high = h
      h = 0.0_wp
      do
         middle = 0.5_wp*(h + high)
         if (middle <= h .or. middle >= high .or. high - h <= epsilon(h)*least_step) exit
         changed = change_at(middle)
         if (changed == 0) h = middle
         if (changed > 0) high = middle
         if (changed > 0) contact = changed
      end do

   contains

      integer function change_at(s) result(j)
         real(wp), intent(in) :: s

         type(orbit_t) :: ahead
         integer :: i
         logical :: ok

         j = 0
         call problem%evaluate(here%orbit%u + s*here%tangent, .false., ahead, ok)
         if (.not. ok) return
         if (present(missed)) then
            if (norm2(ahead%residual) < missed) return
            j = here%orbit%sequence%difference(ahead%sequence)
            associate (n => min(here%orbit%sequence%count, ahead%sequence%count))
               ! Of a sequence that stays the contact whose change jumps.
               if (j == 0 .and. n > 0) then
                  j = ahead%sequence%contact(maxloc(abs(ahead%sequence%time(:n) - here%orbit%sequence%time(:n)), 1))
               end if
            end associate
            return
         end if
         associate (stuck => here%orbit%stuck, seen => ahead%sequence)
            i = findloc([(seen%changes_to(stuck(i), branch_forward) > 0 .neqv. &
                          seen%changes_to(stuck(i), branch_backward) > 0, i=1, size(stuck))], .true., 1)
            if (i > 0) j = stuck(i)
         end associate
      end function change_at

   end subroutine find_edge

   !> Where the motion touches a ring all round right ahead of `here`, that is the next point, and one beyond it becomes `here`.
   subroutine pass_touch(self, problem, here, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: here
      logical, intent(out) :: found

      real(wp), allocatable :: u(:)
      type(point_t) :: at, beyond

      found = self%count > 1 .and. problem%has_rings()
      if (.not. found) return
      at = here
      call touch_round(problem, self%point(self%count - 1)%orbit, here%orbit, u, at%contact, beyond%orbit, found)
      if (found) call complete_point_at(problem, beyond, beyond%orbit%u - u, found)
      if (.not. found) return
      at%orbit%u = u
      at%label = "GR"
      call self%add(at)
      call self%add(beyond)
      here = beyond
   end subroutine pass_touch

   !> Where a branch ends as its motion begins to touch a rigid stop, or one whose force jumps, that is its last point; with `here`
   !> only if that is at these unknowns.
   subroutine end_at_touch(self, problem, found, here)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      logical, intent(out) :: found
      real(wp), intent(in), optional :: here(:)

      real(wp), allocatable :: u(:)
      type(point_t) :: at
      integer :: contact, i

      found = self%count > 1
      if (.not. found) return
      associate (last => self%point(self%count)%orbit)
         call find_touch_beside(problem, last, u, contact, found)
         if (.not. found) call find_touch(problem, self%point(self%count - 1)%orbit, last, u, contact, found)
      end associate
      if (found .and. present(here)) found = norm2(u - here) <= kink*norm2(here)
      if (.not. found) return
      ! Steps too short to be looked at may have come past the touch.
      do i = self%count - 1, 1, -1
         if (norm2(self%point(i)%orbit%u - u) > kink) exit
         if (.not. self%point(i)%orbit%sequence%is_like(self%point(self%count)%orbit%sequence)) exit
      end do
      if (i > 0) then
         if (norm2(self%point(i)%orbit%u - u) <= kink) self%count = i
      end if
      at = self%point(self%count)
      at%contact = contact
      at%orbit%u = u
      at%label = "GR"
      self%ending = "a stop whose force jumps is touched with no speed"
      call self%add(at)
   end subroutine end_at_touch

   !> Where a branch ends in a motion of half its periods right ahead, as that touches a stop and a multiplier of it jumps past -1:
   !> what the last motions miss after half the time falls to nothing there, in a straight line.
   subroutine end_at_half(self, problem, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      logical, intent(out) :: found

      real(wp), allocatable :: farther(:), near(:)
      real(wp) :: ahead
      type(point_t) :: at

      found = self%count > 1
      if (.not. found) return
      at = self%point(self%count)
      associate (before => self%point(self%count - 1)%orbit, u => at%orbit%u)
         found = .not. abs(before%phase - at%orbit%phase) > 0.0_wp
         if (.not. found) return
         problem%map%phase = before%phase
         call part_way(problem, before, 2, farther)
         call part_way(problem, at%orbit, 2, near)
         found = norm2(near) < norm2(farther)
         if (found) ahead = norm2(near)/(norm2(farther) - norm2(near))
         if (found) found = norm2(ahead*(u - before%u)) <= kink*norm2(u)
         if (.not. found) return
         u = u + ahead*(u - before%u)
      end associate
      at%label = "EP"
      self%ending = "a motion of half the period, as that touches a stop"
      call self%add(at)
   end subroutine end_at_half

   !> The same where the first change behind point number `last` is such a touch, though motions next to it follow each other.
   subroutine end_where_touched(self, problem, last, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: last
      logical, intent(out) :: found

      type(point_t) :: at
      integer :: count, i

      found = .false.
      count = self%count
      do i = last + 1, count
         at = self%point(i)
         if (at%label /= "GR" .or. at%contact == 0) cycle
         if (.not. is_hard(problem%map%law_of(at%contact))) cycle
         self%count = i - 1
         call end_at_touch(self, problem, found, at%orbit%u)
         if (found) return
         self%count = count
      end do
   end subroutine end_where_touched

   !> Where a branch ends because its map jumps right ahead, as a change of contacts, another one or much earlier, has no motion on
   !> its other side, that is CH.
   subroutine name_jump(self, problem, here)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here

      type(orbit_t) :: ahead
      real(wp) :: h, off(2)
      integer :: i
      logical :: ok

      ! Nearer than a method's errors it may be on either side.
      h = max(10*least_step, problem%resolution)
      do i = 1, 2
         call problem%evaluate(here%orbit%u + 100.0_wp**(i - 1)*h*here%tangent, .false., ahead, ok)
         if (.not. ok) return
         off(i) = norm2(ahead%residual)
      end do
      ! Beside a grazing what is missed has a square root, and elsewhere it is proportional to the step.
      if (off(1) < 0.5_wp*off(2) .or. off(1) < max(jump, 10*problem%resolution)*norm2(here%orbit%u)) return
      associate (at => self%point(self%count))
         at%label = "CH"
         call find_edge(problem, here, h, at%contact, 0.5_wp*off(1))
         if (at%contact > 0) at%orbit%u = here%orbit%u + h*here%tangent
      end associate
      self%ending = "the motion jumps where its contacts change"
   end subroutine name_jump

   !> Begin a motion of a branch in the middle of its longest smooth piece; where that fails it stays as it is.
   subroutine move_section(problem, here)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: here

      real(wp), parameter :: beside = 1.0e-6_wp
      real(wp), allocatable :: guide(:), to(:)
      real(wp) :: later, phase
      type(point_t) :: moved
      logical :: ok

      phase = problem%map%phase
      later = find_quiet(problem, here%orbit)
      call carry(problem, here%orbit%u + beside*here%tangent, phase, later, guide, ok)
      if (ok) call carry(problem, here%orbit%u, phase, later, to, ok)
      if (.not. ok) return
      guide = (guide - to)/norm2(guide - to)
      problem%map%phase = modulo(phase + later, 1.0_wp)
      call problem%correct(to, guide, moved%orbit, ok)
      if (ok) call complete_point_at(problem, moved, guide, ok)
      if (ok) ok = norm2(moved%orbit%u - to) <= kink*norm2(to)
      if (ok) here = moved
      problem%map%phase = here%orbit%phase
   end subroutine move_section

   subroutine add(self, point)
      class(branch_t), intent(inout) :: self
      type(point_t), intent(in) :: point

      type(point_t), allocatable :: more(:)

      if (point%contact > 0 .and. self%count > 0) then
         associate (before => self%point(self%count))
            ! Both sides of a symmetric contact, or both halves of a symmetric motion.
            if (before%contact == point%contact .and. &
                norm2(before%orbit%u - point%orbit%u) < coincident*norm2(point%orbit%u)) return
         end associate
      end if
      if (self%count == size(self%point)) then
         allocate (more(2*self%count))
         more(:self%count) = self%point
         call move_alloc(more, self%point)
      end if
      self%count = self%count + 1
      self%point(self%count) = point
   end subroutine add

   !> Only the special points between two motions, with tangents and all that is asked of them.
   subroutine search_between(self, problem, a, b)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b

      logical :: explained

      self%count = 0
      if (.not. allocated(self%point)) allocate (self%point(8))
      call self%search(problem, a, b, explained)
   end subroutine search_between

   !> What happens between two points of the branch: changes of the sequence one after the other, and on each side what else does.
   !> `explained`: that is all which happens.
   subroutine search(self, problem, here, next, explained)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next
      logical, intent(out) :: explained

      type(point_t) :: at, from, left, right
      integer :: change
      logical :: all_there, found

      explained = .true.
      self%lost = .false.
      from = here
      do change = 1, most_changes
         if (from%orbit%sequence%is_like(next%orbit%sequence)) exit
         call find_change(problem, from, next, left, at, right, found)
         self%lost = .not. found
         explained = explained .and. found
         if (.not. found) exit
         ! Where the motion itself jumps the step has come to another piece of the branch, as past the touch of a rigid stop.
         explained = norm2(right%orbit%u - left%orbit%u) <= max(jump, 10*problem%resolution)*norm2(left%orbit%u)
         if (.not. explained) exit
         call self%search_smooth(problem, from, left, all_there)
         explained = explained .and. all_there
         ! Along a whole step the bounces before a contact stays closed may become others, though none is new.
         if (.not. left%orbit%sequence%is_like(right%orbit%sequence)) call self%add(at)
         from = right
      end do
      call self%search_smooth(problem, from, next, all_there)
      explained = explained .and. all_there
   end subroutine search

   !> Folds, branch points, doublings and tori between two points with the same sequence. They are `explained` if the number of
   !> multipliers outside the unit circle changes as they say: by one at each, at a torus by two.
   subroutine search_smooth(self, problem, a, b, explained)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      logical, intent(out) :: explained

      type(point_t) :: point
      logical :: crossed(3), found
      integer :: change, kind, located

      crossed(:2) = [(value_of(problem, a%orbit, kind)*value_of(problem, b%orbit, kind) < 0.0_wp, kind=1, 2)]
      ! At least so many come across the circle: of some it cannot be said on which side they are.
      change = max(a%orbit%outside() - b%orbit%outside(most=.true.), b%orbit%outside() - a%orbit%outside(most=.true.), 0)
      crossed(3) = change > count(crossed(:2))
      located = 0
      do kind = 1, 3
         if (.not. crossed(kind)) cycle
         call find_root(problem, a, b, kind, point, found)
         if (.not. found) cycle
         select case (kind)
         case (1)
            point%label = merge("BP", "LP", is_crossing(problem, a, b))
            ! Where two branches cross the tangent of neither is that of the derivatives.
            if (point%label == "BP") point%tangent = (b%orbit%u - a%orbit%u)/norm2(b%orbit%u - a%orbit%u)
         case (2)
            point%label = "PD"
         case default
            point%label = "TR"
         end select
         call self%add(point)
         located = located + merge(2, 1, kind == 3)
      end do
      explained = change <= located .and. modulo(located - change, 2) == 0
      explained = explained .or. a%orbit%outside() < a%orbit%outside(most=.true.) &
                  .or. b%orbit%outside() < b%orbit%outside(most=.true.)
   end subroutine search_smooth

end module razy_orbits_branch
