!! Sides of rigid contacts that touch: where impacts can happen and constraint forces act.
!!
!! A law with impacts has one or two edges of s, the bounds of its first switching function in the branch open; the gap of a side
!! is direction (s - edge). Nothing here knows how the motion is integrated: s and s' with their rounding are arguments.
module razy_hybrid_touching_sides
   use razy_contact_contact_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: contact_t
   implicit none(type, external)
   private

   public :: find_sides, side_t

   !> A side that touches: contact, branch when closed, direction of its gap in s, edge, speed of the gap before and after the
   !> impact, whether it is still a candidate for a constraint, whether it was let go of as its force came to 0.
   type :: side_t
      integer :: contact = 0, closed = 0
      real(wp) :: direction = 0.0_wp, edge = 0.0_wp, before = 0.0_wp, after = 0.0_wp
      logical :: candidate = .false., released = .false.
   end type side_t

contains

   !> The first `count` of `side` (two a contact): all sides that were closed in `branch` (contacts), whose edge was `left` (lower
   !> and upper one; 2, contacts), or whose gap is not above the rounding of s; speeds below the rounding of s' are 0.
   subroutine find_sides(contact, s, rate, noise_s, noise_rate, branch, left, side, count)
      type(contact_t), intent(in) :: contact(:)
      real(wp), intent(in) :: s(:), rate(:), noise_s(:), noise_rate(:)
      integer, intent(in) :: branch(:)
      logical, intent(in) :: left(:, :)
      type(side_t), intent(inout) :: side(:)
      integer, intent(out) :: count

      integer :: j

      count = 0
      do j = 1, size(contact)
         if (.not. contact(j)%law%impacts) cycle
         associate (open => contact(j)%law%guard(1, branch_open))
            if (open%below /= 0) call look_at_side(j, open%below, 1.0_wp, open%lower, left(1, j))
            if (open%above /= 0) call look_at_side(j, open%above, -1.0_wp, open%upper, left(2, j))
         end associate
      end do

   contains

      subroutine look_at_side(j, closed, direction, edge, left)
         integer, intent(in) :: j, closed
         real(wp), intent(in) :: direction, edge
         logical, intent(in) :: left

         if (.not. (left .or. branch(j) == closed .or. direction*(s(j) - edge) <= noise_s(j))) return
         count = count + 1
         side(count) = side_t(j, closed, direction, edge)
         associate (found => side(count))
            if (abs(rate(j)) > noise_rate(j)) found%before = direction*rate(j)
            found%after = found%before
            found%candidate = .not. found%before > 0.0_wp
         end associate
      end subroutine look_at_side

   end subroutine find_sides

end module razy_hybrid_touching_sides
