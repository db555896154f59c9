!! Events in doubt in a step of the Moreau–Jean scheme (razy_integrate_doubts).
!!
!! Displacements within a step are a parabola, so a gap is taken to be known to h |Δs'|/8, by which the parabola differs from its
!! chord. Counted are gaps that turn nearer than that to a bound, or beyond it, between ends on the same side; ends on opposite
!! sides of an open gap; and impacts that are slower than what the free motion adds to the velocity within the step: a touch of
!! which the step does not know whether there is one, or one of an accumulation.
module razy_integrate_moreau_doubts
   use razy_core_kinds, only: wp
   use razy_integrate_doubts, only: across, doubts_t, turned_near
   use razy_integrate_moreau_state, only: moreau_step_t
   implicit none(type, external)
   private

   public :: doubt_moreau_step

contains

   !> Count the doubts of the last step, which started at `time`, s.
   pure subroutine doubt_moreau_step(doubts, step, time)
      type(doubts_t), intent(inout) :: doubts
      type(moreau_step_t), intent(in) :: step
      real(wp), intent(in) :: time

      integer :: i, j

      do j = 1, size(step%machine%contact)
         associate (law => step%machine%contact(j)%law)
            if (law%of_normal) cycle
            if (across(step%branch0(j), step%branch1(j))) then
               call doubts%add(time)
            else if (step%branch0(j) == step%branch1(j)) then
               if (turned(step, j)) call doubts%add(time)
            end if
         end associate
      end do
      do i = 1, step%work%count
         associate (side => step%kinds%side(step%work%active(i)))
            j = side%contact
            if (step%branch1(j) /= side%closed .or. step%branch0(j) == side%closed) cycle
            if (abs(step%work%problem%before(i)) < abs(step%work%free(j))) call doubts%add(time)
         end associate
      end do
   end subroutine doubt_moreau_step

   !> Whether s of contact j turns near a bound of its branch.
   pure function turned(step, j)
      type(moreau_step_t), intent(in) :: step
      integer, intent(in) :: j
      logical :: turned

      real(wp) :: rate(2), s(2)

      rate = [dot_product(step%w(:, j), step%v0) + step%start%rate(j), dot_product(step%w(:, j), step%v1) + step%finish%rate(j)]
      turned = .false.
      if (.not. rate(1)*rate(2) < 0.0_wp) return
      s = [dot_product(step%w(:, j), step%q0) + step%start%s(j), dot_product(step%w(:, j), step%q1) + step%finish%s(j)]
      turned = turned_near(step%machine%contact(j)%law, step%branch0(j), step%h, s, rate, step%h*abs(rate(2) - rate(1))/8)
   end function turned

end module razy_integrate_moreau_doubts
