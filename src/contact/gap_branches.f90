!! What laws of a gap have in common: how a guard is bounded by an edge, and in which branch a motion starts.
!!
!! Their switching function 1 is the contact variable s; functions 2 and 3, where a side parts at zero force, have the sign of
!! F: positive while the upper side pushes, negative while the lower one does.
module razy_contact_gap_branches
   use razy_contact_contact_law, only: branch_lower_parting, branch_open, branch_upper_parting, contact_law_t, guard_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: bound, gap_branch, is_on

contains

   !> Bound a function from above (direction > 0) or below, and name the branch beyond.
   pure subroutine bound(guard, direction, value, beyond)
      type(guard_t), intent(inout) :: guard
      real(wp), intent(in) :: direction, value
      integer, intent(in) :: beyond

      if (direction > 0.0_wp) then
         guard%upper = value
         guard%above = beyond
      else
         guard%lower = value
         guard%below = beyond
      end if
   end subroutine bound

   !> The branch in which a motion with `s` and its rate starts. On an edge the rate decides, then `open`.
   pure function gap_branch(law, s, rate) result(branch)
      class(contact_law_t), intent(in) :: law
      real(wp), intent(in) :: s, rate
      integer :: branch

      real(wp) :: push
      integer :: f, parting

      branch = branch_open
      associate (edge => law%guard(1, branch_open))
         if (edge%above /= 0 .and. (s > edge%upper .or. (is_on(s, edge%upper) .and. rate > 0.0_wp))) branch = edge%above
         if (edge%below /= 0 .and. (s < edge%lower .or. (is_on(s, edge%lower) .and. rate < 0.0_wp))) branch = edge%below
      end associate
      if (branch == branch_open) return
      do f = 2, law%functions
         push = law%slope(1, f)*s + law%slope(2, f)*rate + law%constant(f)
         parting = max(law%guard(f, branch)%above, law%guard(f, branch)%below)
         if (parting == branch_upper_parting .and. push < 0.0_wp) branch = parting
         if (parting == branch_lower_parting .and. push > 0.0_wp) branch = parting
      end do
   end function gap_branch

   pure function is_on(value, edge) result(on)
      real(wp), intent(in) :: value, edge
      logical :: on

      on = .not. (value < edge .or. value > edge)
   end function is_on

end module razy_contact_gap_branches
