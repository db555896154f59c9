!! How far special points may be off by the errors of a Runge-Kutta method: where they are with tolerances ten times as large.
module razy_study_follow_uncertainty
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_rest, only: find_rest
   use razy_orbits_branch_point, only: point_t
   use razy_orbits_sensitivity, only: locate_again
   use razy_study_follow_family, only: case_family_t
   use razy_study_follow_sensitivities, only: moves
   implicit none(type, external)
   private

   public :: find_errors

contains

   !> The errors of the special points of branches, in the unit of the parameter; NaN where it cannot be said. `exact` has none.
   subroutine find_errors(problem, branch)
      type(problem_t), intent(inout) :: problem
      type(branch_t), intent(inout) :: branch(:)

      real(wp) :: least, value
      logical :: found
      integer :: b, i

      if (.not. problem%resolution > 0.0_wp) return
      call loosen(10.0_wp)
      do b = 1, size(branch)
         problem%periods = branch(b)%periods
         do i = 1, branch(b)%count
            associate (point => branch(b)%point(i))
               if (any(point%label == ["  ", "EP", "UZ"])) cycle
               found = any(point%label == moves)
               if (found) call locate_again(problem, point, point%orbit%u, value, found)
               if (point%label == "HB") call rest_again(branch(b)%point(i - 1), point, value, found)
               ! A rest errs by what led to it, too.
               least = merge(point%error, 0.0_wp, point%label == "HB")
               point%error = ieee_value(value, ieee_quiet_nan)
               if (found) point%error = max(least, abs(value - problem%value_of(point%orbit)))
            end associate
         end do
      end do
      call loosen(1.0_wp)

   contains

      !> The rest into which a motion shrinks, found again.
      subroutine rest_again(last, at, value, found)
         type(point_t), intent(in) :: last, at
         real(wp), intent(out) :: value
         logical, intent(out) :: found

         type(orbit_t) :: again

         value = 0.0_wp
         call problem%begin_as(last%orbit)
         call find_rest(problem, last%orbit, at%orbit%u - last%orbit%u, again, found)
         if (found) value = problem%value_of(again)
      end subroutine rest_again

      !> Machines to come are followed with so much larger tolerances.
      subroutine loosen(factor)
         real(wp), intent(in) :: factor

         select type (family => problem%map%family)
         type is (case_family_t)
            family%looser = factor
         end select
         call problem%map%keep([integer ::], [integer ::], [integer ::])
      end subroutine loosen

   end subroutine find_errors

end module razy_study_follow_uncertainty
