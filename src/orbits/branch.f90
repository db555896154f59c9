!! A branch of periodic motions over a parameter, by pseudo-arclength, with the points at which the motion changes its kind.
!!
!! Labels are those of AUTO's users: LP fold, PD period doubling, TR torus (Neimark-Sacker), BP branch point; and, of motions
!! with contacts, GR grazing (a contact touches its bound, or leaves it, with no speed), ST and SL (sticking begins or ends),
!! CH another change of the contact sequence; EP an end of the range, UZ a value of the user's, MX no motion further on. LP and BP
!! are roots of det ∂(P - x)/∂x, PD of det(∂P/∂x + I), TR of |μ| - 1 along the branch, where every value is that of a motion found
!! to rounding. A change of the sequence is where the propagator, which decides every contact to rounding, begins to find another.
module razy_orbits_branch
   use razy_core_kinds, only: wp
   use razy_orbits_endings, only: end_at_half, end_at_jump, end_at_slip, end_at_touch, grows_without_bound, jump, &
                                  least_step
   use razy_orbits_halves, only: falls_to_part, find_half
   use razy_orbits_periodic_identity, only: find_between
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t, was_stopped
   use razy_orbits_periodic_rest, only: find_rest, find_way_to_rest
   use razy_orbits_periodic_section, only: carry, find_quiet, is_quiet
   use razy_orbits_place, only: are_one, coincident, place_of
   use razy_orbits_point, only: between, complete_point, complete_point_at, find_tangent, kink, length, point_t, reach, step
   use razy_orbits_special, only: find_change, find_root, is_crossing, name_change, value_of
   use razy_orbits_touch, only: is_hard, touch_round
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
      !> Steps in which other multipliers come across the unit circle, or contacts change, than special points say.
      integer :: unexplained = 0
   contains
      procedure :: follow
      procedure :: search_between
      procedure, private :: add
      procedure, private :: search
      procedure, private :: search_smooth
   end type branch_t

   !> Steps in scaled unknowns, the largest for motions with and without events.
   real(wp), parameter :: first_step = 2.0e-3_wp, largest_step = 2.0e-2_wp, largest_smooth = 0.05_wp
   !> So many steps in a row that may turn by any angle do not get past a jump; changes of the sequence looked for in one step.
   integer, parameter :: most_creeping = 20, most_changes = 40
   !> Past such a change what is so many times as far off is another piece of the branch.
   real(wp), parameter :: far_off = 30.0_wp
   !> Up to where on its last step to a doubling a branch is searched, and for changes of contacts only.
   real(wp), parameter :: nearly_there(*) = [0.5_wp, 0.99_wp]
   !> A branch of fewer points is not closed.
   integer, parameter :: least_closed = 3

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
      integer :: creeping, last
      logical :: easy, ends, explained, found, ok

      self%periods = problem%periods
      call problem%begin_as(start)
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
         call end_at_slip(problem, here, h, at, found)
         if (found) then
            self%ending = "friction that has stuck all the time begins to slide"
            call self%add(at)
            return
         end if
         call step(problem, here, h, low, high, next, ok)
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
            call shorten(problem%reason)
            cycle
         end if
         call end_at_rest(self, problem, here, next, found, ok)
         if (found) return
         if (.not. ok) then
            call shorten("the motion shrinks to rest")
            cycle
         end if
         p = next%orbit%u(size(next%orbit%u))
         if (p <= low .or. p >= high) then
            if (p < low .or. p > high) call reach(problem, here, next, merge(low, high, p < low), ok)
            if (.not. ok) then
               call shorten(problem%reason)
               cycle
            end if
            call end_with(self, problem, here, next, next, "the end of the range")
            return
         end if
         call find_half(problem, here, next, at, ends, ok)
         if (.not. ok) then
            call shorten(problem%reason)
            cycle
         end if
         if (ends) then
            call end_at_doubling(self, problem, here, at)
            return
         end if
         call find_between(problem, self%point(1)%orbit, here%orbit%u, next%orbit, at%orbit, self%closed)
         self%closed = self%closed .and. self%count > least_closed
         if (self%closed) call complete_point_at(problem, at, next%orbit%u - here%orbit%u, self%closed)
         if (self%closed) then
            call end_with(self, problem, here, at, at, "the first motion again: the branch is closed")
            return
         end if
         last = self%count
         call self%search(problem, here, next, explained)
         if (.not. explained) then
            if (h <= kink) then
               call touch_ahead(self, problem, last, found)
               if (found) return
            end if
            if (h > kink .or. norm2(next%orbit%u - here%orbit%u) > far_off*h) then
               self%count = last
               call shorten("the motion jumps to another piece of the branch")
               cycle
            end if
            self%unexplained = self%unexplained + 1
         end if
         call end_where_touched(self, problem, last, found)
         if (found) return
         call self%add(next)
         call problem%tell("branch", self%count, problem%value_of(next%orbit))
         if (grows_without_bound(self%point(:self%count))) then
            self%point(self%count)%label = "EP"
            self%ending = "the motion grows without bound"
            return
         end if
         last = size(here%tangent)
         easy = next%orbit%rounds <= 5 .and. dot_product(here%tangent, next%tangent) > 0.99_wp
         if (easy) h = min(1.6_wp*h, largest*max(1.0_wp, norm2(next%orbit%u(:last - 1))))
         ! Around a fold beside a grazing steps are as short, but grow.
         creeping = merge(0, creeping + merge(0, 1, easy), length(here, next) >= max(kink, 10*next%orbit%correction))
         ok = creeping < most_creeping
         if (.not. ok) self%ending = "the motion jumps: only ever smaller steps come to another"
         if (.not. ok .and. 10*next%orbit%correction > length(here, next)) self%ending = &
            "the motion is not known to less than a step"
         if (next%orbit%rounds > 7) h = h/2
         here = next
         found = is_quiet(problem, here%orbit)
         if (ok .and. .not. found) call move_section(problem, here)
      end do
      found = .false.
      if (.not. ok) call end_ahead(self, problem, here, found)
      if (found) return
      self%point(self%count)%label = merge("EP", "MX", ok)
      if (.not. problem%is_stopped()) return
      self%point(self%count)%label = "EP"
      self%ending = was_stopped

   contains

      !> Try a shorter step, if there is one; else the branch ends for this reason.
      subroutine shorten(reason)
         character(*), intent(in) :: reason

         h = h/4
         ok = h > least_step
         if (.not. ok) self%ending = reason
      end subroutine shorten

   end subroutine follow

   !> End with a motion, and with what happens from `here` to `next`, which is it or just before it.
   subroutine end_with(self, problem, here, next, at, ending)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next, at
      character(*), intent(in) :: ending

      logical :: explained

      call self%search(problem, here, next, explained)
      if (.not. explained) self%unexplained = self%unexplained + 1
      call self%add(at)
      self%point(self%count)%label = "EP"
      self%ending = ending
   end subroutine end_with

   !> End where the motion has shrunk to rest between `here` and `next`; not `ok`: that is nearer than a step of this length shows.
   subroutine end_at_rest(self, problem, here, next, found, ok)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next
      logical, intent(out) :: found, ok

      real(wp), allocatable :: way(:)
      type(point_t) :: at

      call find_way_to_rest(problem, here%orbit, next%orbit, way, found)
      ok = .not. found
      if (ok) return
      call find_rest(problem, here%orbit, way, at%orbit, found)
      if (found) found = at%orbit%sequence%count == here%orbit%sequence%count
      if (.not. found) return
      at%tangent = here%tangent
      at%label = "HB"
      at%error = at%orbit%correction*problem%range
      call self%add(at)
      self%ending = "the motion shrinks to rest"
   end subroutine end_at_rest

   !> End with a doubling of a motion of half the period, and what happens from `here` on. At it det ∂(P - x)/∂x is 0, of whatever
   !> sign.
   subroutine end_at_doubling(self, problem, here, at)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, at

      type(point_t) :: from, next
      integer :: i
      logical :: explained, ok

      from = here
      do i = 1, size(nearly_there)
         call between(problem, here, at, nearly_there(i)*length(here, at), next, ok)
         if (ok) call complete_point(problem, here, next, ok)
         if (ok) ok = .not. falls_to_part(problem, here, next)
         if (.not. ok) exit
         call self%search(problem, from, next, explained, smooth=i == 1)
         if (.not. explained) self%unexplained = self%unexplained + 1
         from = next
      end do
      call self%add(at)
      self%point(self%count)%label = "EP"
      self%ending = "a doubling of a motion of half the period"
   end subroutine end_at_doubling

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

   !> The end of a branch beyond whose last motion, `here`, none was found, if it is known why.
   subroutine end_ahead(self, problem, here, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      logical, intent(out) :: found

      type(point_t) :: at

      call touch_ahead(self, problem, self%count, found, hard=.true.)
      if (found) return
      associate (last => self%point(self%count))
         if (self%count > 1) call end_at_half(problem, self%point(self%count - 1), last, at, found)
      end associate
      if (found) then
         self%ending = "a motion of half the period, as that touches a stop"
         call self%add(at)
         return
      end if
      call touch_ahead(self, problem, self%count, found)
      if (found) return
      call end_at_jump(problem, here, self%point(self%count), found)
      if (found) self%ending = "the motion jumps where its contacts change"
   end subroutine end_ahead

   !> The end of a branch, after so many of its points, at the touch of a stop whose force jumps; with `here` only if it is at these
   !> unknowns, with `hard` only of one whose force jumps by itself, not by its damping.
   subroutine touch_ahead(self, problem, count, found, here, hard)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: count
      logical, intent(out) :: found
      real(wp), intent(in), optional :: here(:)
      logical, intent(in), optional :: hard

      type(point_t) :: at
      integer :: before

      call end_at_touch(problem, self%point(:count), at, before, found, here)
      if (found .and. present(hard)) found = is_hard(problem%map%by%system%machine, at%contact, 0.0_wp)
      if (.not. found) return
      self%count = before
      self%ending = "a stop whose force jumps is touched with no speed"
      call self%add(at)
   end subroutine touch_ahead

   !> The same where the first change behind point number `last` is such a touch, though motions next to it follow each other.
   subroutine end_where_touched(self, problem, last, found)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: last
      logical, intent(out) :: found

      type(point_t) :: at
      integer :: i

      found = .false.
      do i = last + 1, self%count
         at = self%point(i)
         if (at%label /= "GR" .or. at%contact == 0) cycle
         if (.not. is_hard(problem%map%by%system%machine, at%contact, 0.0_wp)) cycle
         call touch_ahead(self, problem, i - 1, found, at%orbit%u)
         if (found) return
      end do
   end subroutine end_where_touched

   !> Begin a motion of a branch in the middle of its longest smooth piece; where that fails it stays as it is.
   subroutine move_section(problem, here)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: here

      real(wp), parameter :: beside = 1.0e-6_wp
      real(wp), allocatable :: guide(:), to(:)
      real(wp) :: later, phase
      type(point_t) :: moved
      logical :: ok

      phase = here%orbit%phase
      later = find_quiet(problem, here%orbit)
      call carry(problem, here%orbit%u + beside*here%tangent, phase, later, guide, ok)
      if (ok) call carry(problem, here%orbit%u, phase, later, to, ok)
      if (.not. ok) return
      guide = (guide - to)/norm2(guide - to)
      problem%map%phase = problem%phase_after(phase, later)
      call correct(problem, to, guide, moved%orbit, ok)
      if (ok) call complete_point_at(problem, moved, guide, ok)
      if (ok) ok = norm2(moved%orbit%u - to) <= kink*norm2(to)
      if (ok) here = moved
      call problem%begin_as(here%orbit)
   end subroutine move_section

   subroutine add(self, point)
      class(branch_t), intent(inout) :: self
      type(point_t), intent(in) :: point

      type(point_t), allocatable :: more(:)

      if (self%count > 0) then
         if (are_one(self%point(self%count), point)) then
            self%point(self%count) = place_of(self%point(self%count), point)
            return
         end if
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
   !> `explained`: that is all which happens. Not `smooth`: the changes alone.
   subroutine search(self, problem, here, next, explained, smooth)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next
      logical, intent(out) :: explained
      logical, intent(in), optional :: smooth

      type(orbit_t) :: begins
      type(point_t) :: at, from, left, right
      integer :: change, count
      logical :: located

      explained = .true.
      from = here
      begins = here%orbit
      do change = 1, most_changes
         if (from%orbit%sequence%is_like(next%orbit%sequence)) exit
         call find_change(problem, from, next, left, at, right, located)
         ! Where the motion itself jumps the step has come to another piece of the branch, as past the touch of a rigid stop.
         associate (most => max(merge(jump, kink, located), 10*problem%resolution))
            explained = explained .and. norm2(right%orbit%u - left%orbit%u) <= most*norm2(here%orbit%u)
         end associate
         if (.not. explained) exit
         if (change == 1 .or. length(from, left) > coincident*norm2(left%orbit%u)) call between_changes(left)
         ! Along a whole step the bounces before a contact stays closed may become others, though none is new.
         if (.not. left%orbit%sequence%is_like(right%orbit%sequence)) then
            count = self%count
            call self%add(at)
            if (self%count > count) then
               begins = left%orbit
            else if (begins%sequence%is_like(right%orbit%sequence)) then
               self%count = count - 1
            else
               ! What several changes at one place make of what was before them.
               call name_change(problem, begins, at%orbit, self%point(count)%label, self%point(count)%contact)
            end if
         end if
         from = right
      end do
      call between_changes(next)

   contains

      subroutine between_changes(to)
         type(point_t), intent(in) :: to

         if (present(smooth)) then
            if (.not. smooth) return
         end if
         call self%search_smooth(problem, from, to, explained)
      end subroutine between_changes

   end subroutine search

   !> Folds, branch points, doublings and tori between two points with the same sequence. They stay `explained` if the number of
   !> multipliers outside the unit circle changes as they say: by one at each, at a torus by two.
   subroutine search_smooth(self, problem, a, b, explained)
      class(branch_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      logical, intent(inout) :: explained

      type(point_t) :: along(0:3), torus
      logical :: crossed(2), found, turned
      integer :: change, count, i, kind, located

      crossed = [(value_of(problem, a%orbit, kind)*value_of(problem, b%orbit, kind) < 0.0_wp, kind=1, 2)]
      ! A branch that loses a symmetry turns where that of symmetric motions crosses it, and no multiplier leaves the circle there.
      associate (n => size(a%tangent))
         turned = .not. crossed(1) .and. a%tangent(n)*b%tangent(n) < 0.0_wp
      end associate
      if (turned) turned = is_crossing(problem, a, b)
      crossed(1) = crossed(1) .or. turned
      located = 0
      count = 0
      do kind = 1, 2
         if (.not. crossed(kind)) cycle
         associate (point => along(count + 1))
            call find_root(problem, a, b, kind, point, found)
            if (.not. found) cycle
            point%label = "PD"
            if (kind == 1) point%label = merge("BP", "LP", is_crossing(problem, a, b))
            if ((point%label == "LP" .or. turned .and. kind == 1) .and. .not. turns(a%orbit, point%orbit, b%orbit)) cycle
            ! Where two branches cross the tangent of neither is that of the derivatives.
            if (point%label == "BP") point%tangent = (b%orbit%u - a%orbit%u)/norm2(b%orbit%u - a%orbit%u)
            point%turns = point%label == "BP" .and. turned
         end associate
         if (.not. turned .or. kind == 2) located = located + 1
         count = count + 1
      end do
      if (count == 2) then
         if (length(a, along(2)) < length(a, along(1))) along(1:2) = along(2:1:-1)
      end if
      along(0) = a
      along(count + 1) = b
      do i = 1, count + 1
         if (least_change(along(i - 1)%orbit, along(i)%orbit) > merge(1, 0, crossed(1)) + merge(1, 0, crossed(2)) - count) then
            call find_root(problem, along(i - 1), along(i), 3, torus, found)
            if (found) torus%label = "TR"
            if (found) call self%add(torus)
            if (found) located = located + 2
         end if
         if (i <= count) call self%add(along(i))
      end do
      change = least_change(a%orbit, b%orbit)
      explained = explained .and. (change <= located .and. modulo(located - change, 2) == 0 &
                                   .or. a%orbit%outside() < a%orbit%outside(most=.true.) &
                                   .or. b%orbit%outside() < b%orbit%outside(most=.true.))

   contains

      !> At least so many multipliers come across the circle: of some it cannot be said on which side they are.
      pure integer function least_change(from, to)
         type(orbit_t), intent(in) :: from, to

         least_change = max(from%outside() - to%outside(most=.true.), to%outside() - from%outside(most=.true.), 0)
      end function least_change

      !> Whether the parameter turns by more than rounding: a linear machine has motions of every size at the same one.
      pure logical function turns(from, at, to)
         type(orbit_t), intent(in) :: from, at, to

         associate (n => size(at%u))
            turns = max(abs(at%u(n) - from%u(n)), abs(at%u(n) - to%u(n))) > 10*max(from%correction, at%correction, to%correction)
         end associate
      end function turns

   end subroutine search_smooth

end module razy_orbits_branch
