!! The last points of a branch: what happens up to its end, and the end itself, in words.
module razy_orbits_branch_finish
   use razy_core_kinds, only: wp
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_endings, only: end_at_half, end_at_jump, end_at_touch
   use razy_orbits_branch_halves, only: falls_to_part
   use razy_orbits_branch_point, only: between, complete_point, length, point_t
   use razy_orbits_branch_within_step, only: search_step
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_rest, only: find_rest, find_way_to_rest
   use razy_orbits_touch, only: is_hard
   implicit none(type, external)
   private

   public :: end_ahead, end_at_doubling, end_at_rest, end_where_touched, end_with, touch_ahead

   !> Up to where on its last step to a doubling a branch is searched, and for changes of contacts only.
   real(wp), parameter :: nearly_there(*) = [0.5_wp, 0.99_wp]

contains

   !> End with a motion, and with what happens from `here` to `next`, which is it or just before it.
   subroutine end_with(branch, problem, here, next, at, ending)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next, at
      character(*), intent(in) :: ending

      logical :: explained

      call search_step(branch, problem, here, next, explained)
      if (.not. explained) branch%unexplained = branch%unexplained + 1
      call branch%add(at)
      branch%point(branch%count)%label = "EP"
      branch%ending = ending
   end subroutine end_with

   !> End where the motion has shrunk to rest between `here` and `next`; not `ok`: that is nearer than a step of this length shows.
   subroutine end_at_rest(branch, problem, here, next, found, ok)
      type(branch_t), intent(inout) :: branch
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
      call branch%add(at)
      branch%ending = "the motion shrinks to rest"
   end subroutine end_at_rest

   !> End with a doubling of a motion of half the period, and what happens from `here` on. At it det ∂(P - x)/∂x is 0, of whatever
   !> sign.
   subroutine end_at_doubling(branch, problem, here, at)
      type(branch_t), intent(inout) :: branch
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
         call search_step(branch, problem, from, next, explained, smooth=i == 1)
         if (.not. explained) branch%unexplained = branch%unexplained + 1
         from = next
      end do
      call branch%add(at)
      branch%point(branch%count)%label = "EP"
      branch%ending = "a doubling of a motion of half the period"
   end subroutine end_at_doubling

   !> The end of a branch beyond whose last motion, `here`, none was found, if it is known why.
   subroutine end_ahead(branch, problem, here, found)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      logical, intent(out) :: found

      type(point_t) :: at

      call touch_ahead(branch, problem, branch%count, found, hard=.true.)
      if (found) return
      associate (last => branch%point(branch%count))
         if (branch%count > 1) call end_at_half(problem, branch%point(branch%count - 1), last, at, found)
      end associate
      if (found) then
         branch%ending = "a motion of half the period, as that touches a stop"
         call branch%add(at)
         return
      end if
      call touch_ahead(branch, problem, branch%count, found)
      if (found) return
      call end_at_jump(problem, here, branch%point(branch%count), found)
      if (found) branch%ending = "the motion jumps where its contacts change"
   end subroutine end_ahead

   !> The end of a branch, after so many of its points, at the touch of a stop whose force jumps; with `here` only if it is at these
   !> unknowns, with `hard` only of one whose force jumps by itself, not by its damping.
   subroutine touch_ahead(branch, problem, count, found, here, hard)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: count
      logical, intent(out) :: found
      real(wp), intent(in), optional :: here(:)
      logical, intent(in), optional :: hard

      type(point_t) :: at
      integer :: before

      call end_at_touch(problem, branch%point(:count), at, before, found, here)
      if (found .and. present(hard)) found = is_hard(problem%map%by%system%machine, at%contact, 0.0_wp)
      if (.not. found) return
      branch%count = before
      branch%ending = "a stop whose force jumps is touched with no speed"
      call branch%add(at)
   end subroutine touch_ahead

   !> The same where the first change behind point number `last` is such a touch, though motions next to it follow each other.
   subroutine end_where_touched(branch, problem, last, found)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: last
      logical, intent(out) :: found

      type(point_t) :: at
      integer :: i

      found = .false.
      do i = last + 1, branch%count
         at = branch%point(i)
         if (at%label /= "GR" .or. at%contact == 0) cycle
         if (.not. is_hard(problem%map%by%system%machine, at%contact, 0.0_wp)) cycle
         call touch_ahead(branch, problem, i - 1, found, at%orbit%u)
         if (found) return
      end do
   end subroutine end_where_touched

end module razy_orbits_branch_finish
