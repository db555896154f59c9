!! How a piece ends: in an event that the transition settles, with bounds that are crossed and no more, or open.
module razy_exact_ending
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, move_to
   use razy_exact_closed_form_rows, only: value_of
   use razy_exact_crossings, only: crossings_t
   use razy_exact_search_search, only: exit_t, leaves_too, search_t, soon
   use razy_exact_solution, only: solution_t
   use razy_hybrid_flow, only: ends_crossed, ends_in_event, ends_open
   use razy_hybrid_guards, only: of_force
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: find_ending, waits

contains

   !> How the piece ends. Where nothing is held and the guard that was left, with those that leave with it, changes a branch and no
   !> more, they are crossed; what is rounding in the functions of this mode is kept after a piece of no length. At a time at which
   !> something was settled all is. `one_by_one`: others are crossed after this one.
   subroutine find_ending(solution, found, settled, one_by_one, search, crossings, transition, ending)
      type(solution_t), intent(in) :: solution
      type(exit_t), intent(in) :: found
      logical, intent(in) :: settled, one_by_one
      type(search_t), intent(inout) :: search
      type(crossings_t), intent(inout) :: crossings
      type(transition_t), intent(inout) :: transition
      integer, intent(out) :: ending

      integer :: i

      ending = merge(ends_in_event, ends_open, found%watched > 0)
      call crossings%end_piece(stands=found%watched > 0 .and. .not. (settled .or. found%tau > 0.0_wp))
      if (found%watched == 0) return
      if (.not. solution%crosses(found%watched) .or. transition%accumulation%landing) return
      if (settled .and. .not. found%tau > 0.0_wp) return
      call crossings%add(solution%entry(found%watched), solution%watched(found%watched))
      if (search%leaving > 1 .and. found%tau > 0.0_wp .and. .not. one_by_one) then
         do i = 1, size(solution%watched)
            if (.not. solution%watched(i)%f1 < 0.0_wp) cycle
            if (.not. crossings%can_add(solution%entry(i))) cycle
            if (.not. leaves_too(search, solution%response, solution%switching, solution%watched(i))) cycle
            if (.not. solution%crosses(i)) return
            call crossings%add(solution%entry(i), solution%watched(i))
         end do
      end if
      ending = ends_crossed
      call crossings%hand_over(transition%contact, transition%branch, transition%changes)
      if (crossings%standing > 0) call crossings%take_noise(solution%entry, solution%watched)
   end subroutine find_ending

   !> Whether the force that was found at its limit is there to rounding up to the break of the excitation at `break`, s: it goes
   !> the way that it has after that.
   logical function waits(solution, start, found, break, looker)
      type(solution_t), intent(in) :: solution
      type(amplitudes_t), intent(in) :: start
      type(exit_t), intent(in) :: found
      real(wp), intent(in) :: break
      type(amplitudes_t), intent(inout) :: looker

      integer :: i

      associate (watched => solution%watched(found%watched))
         waits = (break - found%tau)*solution%response%fastest <= soon
         if (waits) waits = solution%entry(found%watched)%function == of_force
         do i = 1, 2
            if (.not. waits) return
            call move_to(start, solution%response, found%tau + 0.5_wp*i*(break - found%tau), looker)
            waits = watched%side*(value_of(solution%switching, solution%response, looker, watched%form, 0) - watched%bound) &
                    >= -watched%noise
         end do
      end associate
   end function waits

end module razy_exact_ending
