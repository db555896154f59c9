!! Where a branch meets motions of a part of its periods: the doubling that it goes through, and steps that fall onto such motions.
module razy_orbits_branch_halves
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_identity, only: doubled, least_part, part_way, parts
   use razy_orbits_periodic_multipliers, only: find_multipliers
   use razy_orbits_periodic_newton, only: complete, correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: complete_point_at, point_t
   use razy_orbits_branch_special, only: value_of
   implicit none(type, external)
   private

   public :: falls_to_part, find_half

   !> Secants by which a doubling is found.
   integer, parameter :: most_secants = 20

contains

   !> Where, between two points, the branch of an even number of periods goes through a motion of half as many, at its doubling: it
   !> then comes back along itself, begun half a period later. What it misses after half the period changes its sign there. Not
   !> `ok`: it does so, but that motion has no doubling, as where it touches a stop, or a change has come past the half.
   subroutine find_half(problem, here, next, at, found, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next
      type(point_t), intent(out) :: at
      logical, intent(out) :: found, ok

      real(wp), allocatable :: after(:), before(:), guess(:)
      real(wp) :: longest
      integer :: periods

      before = part_way(problem, here%orbit, 2)
      after = part_way(problem, next%orbit, 2)
      found = .false.
      ok = .not. turns_round(before, after)
      if (ok) return
      problem%reason = "the next motion has half the period"
      if (.not. is_across(problem, here%orbit, before, next%orbit, after)) return
      guess = here%orbit%u + norm2(before)/(norm2(before) + norm2(after))*(next%orbit%u - here%orbit%u)
      longest = norm2(next%orbit%u - here%orbit%u)
      periods = problem%periods
      problem%periods = max(1, periods/2)
      if (problem%is_autonomous()) guess(size(guess) - 1) = 0.5_wp*guess(size(guess) - 1)
      call find_doubling(problem, [guess(:problem%order()), guess(size(guess))], longest, at, found)
      problem%periods = periods
      if (found) call problem%evaluate(doubled(problem, at%orbit%u), .true., at%orbit, found)
      if (found) call complete(problem, at%orbit, found)
      ok = found
      if (.not. found) return
      at%tangent = here%tangent
   end subroutine find_half

   !> The doubling of a motion near `guess`, no farther from it than `longest`: along its branch, by secants.
   subroutine find_doubling(problem, guess, longest, at, found)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: guess(:), longest
      type(point_t), intent(out) :: at
      logical, intent(out) :: found

      real(wp) :: before, change, row(size(guess)), s, value
      type(point_t) :: from
      integer :: i

      row = [spread(0.0_wp, 1, size(guess) - 1), 1.0_wp]
      call correct(problem, guess, row, from%orbit, found)
      if (found) call complete_point_at(problem, from, row, found)
      if (.not. found) return
      found = norm2(from%orbit%u - guess) <= longest
      before = value_of(problem, from%orbit, 2)
      change = sign(1.0e-3_wp*longest, before)
      s = 0.0_wp
      do i = 1, most_secants
         if (.not. found) return
         s = s + change
         at%orbit%column = from%orbit%column
         call correct(problem, from%orbit%u + s*from%tangent, from%tangent, at%orbit, found)
         if (found) call find_multipliers(problem, at%orbit)
         if (.not. found) return
         if (abs(change) <= 1.0e-14_wp) exit
         value = value_of(problem, at%orbit, 2)
         found = abs(value - before) > 0.0_wp
         if (found) change = -value*change/(value - before)
         before = value
         found = found .and. abs(s + change) <= longest
      end do
      found = found .and. abs(change) <= 1.0e-10_wp .and. norm2(at%orbit%u - guess) <= longest
   end subroutine find_doubling

   !> Whether a step from a motion has left its branch for that of a motion of half as many periods, or of another part of them.
   logical function falls_to_part(problem, here, next) result(falls)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here, next

      real(wp), allocatable :: before(:), after(:)
      integer :: i

      falls = .false.
      do i = 1, size(parts)
         before = part_way(problem, here%orbit, parts(i))
         after = part_way(problem, next%orbit, parts(i))
         ! What is no larger than the error of the motion is no difference.
         falls = size(after) > 0 .and. norm2(after) < max(least_part*norm2(before), 10*next%orbit%correction)
         ! Through a motion of half the period the branch goes where the parameter turns; else the step has come to its other side.
         associate (last => size(here%tangent))
            if (parts(i) == 2) falls = falls .or. (is_across(problem, here%orbit, before, next%orbit, after) .and. &
                                                   here%tangent(last)*next%tangent(last) > 0.0_wp)
         end associate
         if (.not. falls) cycle
         problem%reason = "the next motion has "//trim(merge("half the period ", "a shorter period", parts(i) == 2))
         return
      end do
   end function falls_to_part

   !> Whether two motions, which after half the period are so far from their starts, lie on two sides of one of half the period, so
   !> that their halves are as many changes of contacts, or those of the other half. If one change has passed the half it cannot be
   !> said.
   logical function is_across(problem, a, half_of_a, b, half_of_b)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: a, b
      real(wp), intent(in) :: half_of_a(:), half_of_b(:)

      integer :: both

      is_across = turns_round(half_of_a, half_of_b)
      if (.not. is_across) return
      both = changes_in_half(a) + changes_in_half(b)
      is_across = both == 2*changes_in_half(a) .or. both == a%sequence%count

   contains

      pure integer function changes_in_half(orbit)
         type(orbit_t), intent(in) :: orbit

         associate (changes => orbit%sequence)
            changes_in_half = count(changes%time(:changes%count) < (orbit%phase/problem%periods + 0.5_wp)*orbit%duration)
         end associate
      end function changes_in_half

   end function is_across

   pure logical function turns_round(a, b)
      real(wp), intent(in) :: a(:), b(:)

      turns_round = min(size(a), size(b)) > 0
      if (turns_round) turns_round = dot_product(a, b) < 0.0_wp
   end function turns_round

end module razy_orbits_branch_halves
