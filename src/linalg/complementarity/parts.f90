!! Impulses of many contacts: a problem of razy_linalg_complementarity_impact with a guess, such as the impulses of the last step.
!!
!! Sweeps (razy_linalg_complementarity_gauss_seidel) come first. Where contacts act on each other little, as blocks that are
!! joined by springs do within a short step, a few are enough, and one if nothing has changed. What they do not settle is
!! divided into parts that have no effect on each other, which is so if they share no body. A part is followed from its guess
!! by Newton's method (razy_linalg_complementarity_active_set), as a pile that rests or slides, and failing that solved by
!! pivots (razy_linalg_complementarity_friction), whose known properties are those of each part. Where impulses are not unique
!! they are such as the guess leads to.
module razy_linalg_complementarity_parts
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_active_set, only: follow_active_set
   use razy_linalg_complementarity_friction, only: impact_effort_t, impact_solved, impact_swept, solve_impact
   use razy_linalg_complementarity_gauss_seidel, only: sweep_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impact_residual
   use razy_linalg_pattern, only: connected_sets
   implicit none(type, external)
   private

   public :: continue_impact, parts_of

   !> Sweeps that are tried.
   integer, parameter :: few_sweeps = 16

contains

   !> Impulses (n + m), which hold the guess before; `status` and `effort` as of `solve_impact`, pivots and sweeps added up.
   subroutine continue_impact(problem, impulse, status, effort)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(inout) :: impulse(:)
      integer, intent(out) :: status
      type(impact_effort_t), intent(out) :: effort

      integer :: part(size(impulse)), k

      status = impact_solved
      call sweep_impact(problem, settled(size(impulse)), few_sweeps, impulse, effort%residual, effort%sweeps)
      if (effort%residual <= settled(size(impulse))) return
      part = parts_of(problem)
      do k = 1, maxval(part)
         call solve_part(problem, part == k, impulse, status, effort)
         if (status /= impact_solved .and. status /= impact_swept) return
      end do
      effort%residual = impact_residual(problem, impulse)
   end subroutine continue_impact

   !> Residual at which n directions have settled: a sum's rounding, which grows with its terms.
   pure function settled(n) result(residual)
      integer, intent(in) :: n
      real(wp) :: residual

      residual = max(4, n)*epsilon(1.0_wp)
   end function settled

   !> One part by itself, unless sweeps have settled it.
   subroutine solve_part(problem, member, impulse, status, effort)
      type(impact_problem_t), intent(in) :: problem
      logical, intent(in) :: member(:)
      real(wp), intent(inout) :: impulse(:)
      integer, intent(out) :: status
      type(impact_effort_t), intent(inout) :: effort

      type(impact_problem_t) :: small
      type(impact_effort_t) :: own
      real(wp), allocatable :: found(:)
      real(wp) :: residual
      integer, allocatable :: normal(:), tangential(:), all(:)
      integer :: i, n

      n = size(problem%before)
      normal = pack([(i, i=1, n)], member(:n))
      tangential = pack([(i, i=1, size(problem%limit))], member(n + 1:))
      all = [normal, n + tangential]
      small%delassus = problem%delassus(all, all)
      small%drift = problem%drift(all)
      small%before = problem%before(normal)
      small%restitution = problem%restitution(normal)
      small%coefficient = problem%coefficient(tangential, normal)
      small%limit = problem%limit(tangential)
      status = impact_solved
      found = impulse(all)
      if (impact_residual(small, found) <= settled(size(found))) return
      call follow_active_set(small, settled(size(found)), found, residual)
      if (residual <= settled(size(found))) then
         impulse(all) = found
         return
      end if
      call solve_impact(small, found, status, own)
      effort%pivots = effort%pivots + own%pivots
      effort%sweeps = effort%sweeps + own%sweeps
      impulse(all) = found
   end subroutine solve_part

   !> For each direction (n + m) the number, from 1, of the part it belongs to: directions that move each other, or of which one
   !> gives the normal force of the other.
   pure function parts_of(problem) result(part)
      type(impact_problem_t), intent(in) :: problem
      integer :: part(size(problem%drift))

      logical :: joined(size(part), size(part))
      integer :: n

      n = size(problem%before)
      joined = abs(problem%delassus) > 0.0_wp
      joined(n + 1:, :n) = joined(n + 1:, :n) .or. problem%coefficient > 0.0_wp
      part = connected_sets(joined)
   end function parts_of

end module razy_linalg_complementarity_parts
