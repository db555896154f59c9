!! The points between two motions of a branch at which the motion changes its kind.
!!
!! Labels are those of AUTO's users: LP fold, PD period doubling, TR torus (Neimark-Sacker), BP branch point; and, of motions
!! with contacts, GR grazing (a contact touches its bound, or leaves it, with no speed), ST and SL (sticking begins or ends),
!! CH another change of the contact sequence; EP an end of the range, UZ a value of the user's, MX no motion further on. LP and BP
!! are roots of det ∂(P - x)/∂x, PD of det(∂P/∂x + I), TR of |μ| - 1 along the branch, where every value is that of a motion found
!! to rounding. A change of the sequence is where the propagator, which decides every contact to rounding, begins to find another.
module razy_orbits_branch_within_step
   use razy_core_kinds, only: wp
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_endings, only: jump
   use razy_orbits_branch_place, only: coincident
   use razy_orbits_branch_point, only: kink, length, point_t
   use razy_orbits_branch_special, only: find_change, find_root, is_crossing, name_change, value_of
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: search_between, search_step

   !> Changes of the sequence looked for in one step.
   integer, parameter :: most_changes = 40

contains

   !> Only the special points between two motions, with tangents and all that is asked of them.
   subroutine search_between(branch, problem, a, b)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b

      logical :: explained

      branch%count = 0
      call search_step(branch, problem, a, b, explained)
   end subroutine search_between

   !> What happens between two points of the branch: changes of the sequence one after the other, and on each side what else does.
   !> `explained`: that is all which happens. Not `smooth`: the changes alone.
   subroutine search_step(branch, problem, here, next, explained, smooth)
      type(branch_t), intent(inout) :: branch
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
            count = branch%count
            call branch%add(at)
            if (branch%count > count) then
               begins = left%orbit
            else if (begins%sequence%is_like(right%orbit%sequence)) then
               branch%count = count - 1
            else
               ! What several changes at one place make of what was before them.
               call name_change(problem, begins, at%orbit, branch%point(count)%label, branch%point(count)%contact)
               if (branch%point(count)%label /= "GR") branch%point(count)%touches = .false.
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
         call search_smooth(branch, problem, from, to, explained)
      end subroutine between_changes

   end subroutine search_step

   !> Folds, branch points, doublings and tori between two points with the same sequence. They stay `explained` if the number of
   !> multipliers outside the unit circle changes as they say: by one at each, at a torus by two.
   subroutine search_smooth(branch, problem, a, b, explained)
      type(branch_t), intent(inout) :: branch
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
            if (found) call branch%add(torus)
            if (found) located = located + 2
         end if
         if (i <= count) call branch%add(along(i))
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

end module razy_orbits_branch_within_step
