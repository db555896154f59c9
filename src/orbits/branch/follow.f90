!! A branch of periodic motions is followed over a parameter, by pseudo-arclength: steps along it, their lengths, where it ends
!! (what happens in each step, and what the labels are: razy_orbits_branch_within_step).
module razy_orbits_branch_follow
   use razy_core_kinds, only: wp
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_endings, only: end_at_slip, grows_without_bound, least_step
   use razy_orbits_branch_finish, only: end_ahead, end_at_doubling, end_at_rest, end_where_touched, end_with, touch_ahead
   use razy_orbits_branch_halves, only: falls_to_part, find_half
   use razy_orbits_branch_point, only: complete_point_at, find_tangent, kink, length, point_t, reach, step
   use razy_orbits_branch_within_step, only: search_step
   use razy_orbits_periodic_identity, only: find_between
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t, was_stopped
   use razy_orbits_periodic_section, only: carry, find_quiet, is_quiet
   use razy_orbits_touch, only: touch_round
   implicit none(type, external)
   private

   public :: follow_branch

   !> Steps in scaled unknowns, the largest for motions with and without events.
   real(wp), parameter :: first_step = 2.0e-3_wp, largest_step = 2.0e-2_wp, largest_smooth = 0.05_wp
   !> So many steps in a row that may turn by any angle do not get past a jump.
   integer, parameter :: most_creeping = 20
   !> Past such a change what is so many times as far off is another piece of the branch.
   real(wp), parameter :: far_off = 30.0_wp
   !> A branch of fewer points is not closed.
   integer, parameter :: least_closed = 3

contains

   !> Follow the branch through a motion, corrected and with all its derivatives, towards where `guide` (unknowns) points, while the
   !> parameter, in its scale, is within `low` and `high`, for at most `most` points. Its first step is no longer than `away`, the
   !> distance of the motion from the branch that it begins on.
   subroutine follow_branch(branch, problem, start, guide, low, high, most, away)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: start
      real(wp), intent(in) :: guide(:), low, high
      integer, intent(in) :: most
      real(wp), intent(in), optional :: away

      type(point_t) :: at, here, next
      real(wp) :: h, largest, p
      integer :: creeping, last
      logical :: easy, ends, explained, found, ok

      branch%periods = problem%periods
      call problem%begin_as(start)
      here%orbit = start
      call find_tangent(problem, here, guide, ok)
      call branch%add(here)
      h = first_step
      if (present(away)) h = min(away, h)
      creeping = 0
      branch%ending = "the most points"
      do while (ok .and. branch%count < most)
         ! In a range that is narrower than the parameter's unit so many more of them.
         largest = merge(largest_smooth, largest_step, here%orbit%sequence%count == 0)
         associate (slope => abs(here%tangent(size(here%tangent))))
            if (h*slope > largest*(high - low)) h = largest*(high - low)/slope
         end associate
         call end_at_slip(problem, here, h, at, found)
         if (found) then
            branch%ending = "friction that has stuck all the time begins to slide"
            call branch%add(at)
            return
         end if
         call step(problem, here, h, low, high, next, ok)
         if (ok) ok = .not. falls_to_part(problem, here, next)
         if (.not. ok .or. .not. here%orbit%sequence%is_like(next%orbit%sequence)) then
            call pass_touch(branch, problem, here, found)
            if (found) then
               ok = .true.
               h = first_step
               cycle
            end if
            ! From farther off the touch of a ring all round is a change like others, which a method of steps finds to its errors.
            if (problem%has_rings() .and. ok .and. here%orbit%sequence%count + next%orbit%sequence%count == 0 &
                .and. h > first_step) then
               call shorten("a ring is touched all round")
               cycle
            end if
         end if
         if (.not. ok) then
            call shorten(problem%reason)
            cycle
         end if
         call end_at_rest(branch, problem, here, next, found, ok)
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
            call end_with(branch, problem, here, next, next, "the end of the range")
            return
         end if
         call find_half(problem, here, next, at, ends, ok)
         if (.not. ok) then
            call shorten(problem%reason)
            cycle
         end if
         if (ends) then
            call end_at_doubling(branch, problem, here, at)
            return
         end if
         call find_between(problem, branch%point(1)%orbit, here%orbit%u, next%orbit, at%orbit, branch%closed)
         branch%closed = branch%closed .and. branch%count > least_closed
         if (branch%closed) call complete_point_at(problem, at, next%orbit%u - here%orbit%u, branch%closed)
         if (branch%closed) then
            call end_with(branch, problem, here, at, at, "the first motion again: the branch is closed")
            return
         end if
         last = branch%count
         call search_step(branch, problem, here, next, explained)
         if (.not. explained) then
            if (h <= kink) then
               call touch_ahead(branch, problem, last, found)
               if (found) return
            end if
            if (h > kink .or. norm2(next%orbit%u - here%orbit%u) > far_off*h) then
               branch%count = last
               call shorten("the motion jumps to another piece of the branch")
               cycle
            end if
            branch%unexplained = branch%unexplained + 1
         end if
         call end_where_touched(branch, problem, last, found)
         if (found) return
         call branch%add(next)
         call problem%tell("branch", branch%count, problem%value_of(next%orbit))
         if (grows_without_bound(branch%point(:branch%count))) then
            branch%point(branch%count)%label = "EP"
            branch%ending = "the motion grows without bound"
            return
         end if
         last = size(here%tangent)
         easy = next%orbit%rounds <= 5 .and. dot_product(here%tangent, next%tangent) > 0.99_wp
         if (easy) h = min(1.6_wp*h, largest*max(1.0_wp, norm2(next%orbit%u(:last - 1))))
         ! Around a fold beside a grazing steps are as short, but grow.
         creeping = merge(0, creeping + merge(0, 1, easy), length(here, next) >= max(kink, 10*next%orbit%correction))
         ok = creeping < most_creeping
         if (.not. ok) branch%ending = "the motion jumps: only ever smaller steps come to another"
         if (.not. ok .and. 10*next%orbit%correction > length(here, next)) branch%ending = &
            "the motion is not known to less than a step"
         if (next%orbit%rounds > 7) h = h/2
         here = next
         found = is_quiet(problem, here%orbit)
         if (ok .and. .not. found) call move_section(problem, here)
      end do
      found = .false.
      if (.not. ok) call end_ahead(branch, problem, here, found)
      if (found) return
      branch%point(branch%count)%label = merge("EP", "MX", ok)
      if (.not. problem%is_stopped()) return
      branch%point(branch%count)%label = "EP"
      branch%ending = was_stopped

   contains

      !> Try a shorter step, if there is one; else the branch ends for this reason.
      subroutine shorten(reason)
         character(*), intent(in) :: reason

         h = h/4
         ok = h > least_step
         if (.not. ok) branch%ending = reason
      end subroutine shorten

   end subroutine follow_branch

   !> Where the motion touches a ring all round right ahead of `here`, that is the next point, and one beyond it becomes `here`.
   subroutine pass_touch(branch, problem, here, found)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: here
      logical, intent(out) :: found

      real(wp), allocatable :: u(:)
      type(point_t) :: at, beyond

      found = branch%count > 1 .and. problem%has_rings()
      if (.not. found) return
      at = here
      call touch_round(problem, branch%point(branch%count - 1)%orbit, here%orbit, u, at%contact, beyond%orbit, found)
      if (found) call complete_point_at(problem, beyond, beyond%orbit%u - u, found)
      if (.not. found) return
      at%orbit%u = u
      at%label = "GR"
      at%touches = .true.
      call branch%add(at)
      call branch%add(beyond)
      here = beyond
   end subroutine pass_touch

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

end module razy_orbits_branch_follow
