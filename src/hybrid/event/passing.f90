!! Branches that compliant contacts pass at an event in no time, and what a law remembers of the branch that it comes from.
module razy_hybrid_event_passing
   use razy_core_kinds, only: wp
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: most_passed, transition_t
   implicit none(type, external)
   private

   public :: pass_branches, remember

contains

   !> Let compliant contacts go on to further branches, as long as s and s' are beyond those that they are in.
   subroutine pass_branches(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: branch, j, round
      logical :: further

      do round = 1, most_passed - 1
         further = .false.
         do j = 1, size(self%next)
            associate (law => system%machine%contact(j)%law)
               if (law%impacts .or. law%of_normal) cycle
               branch = law%branch_beyond(self%next(j), self%dynamics%s(j), self%dynamics%rate(j), self%guards%on_s(j), &
                                          self%guards%on_rate(j))
            end associate
            if (branch == 0) cycle
            if (self%next(j) /= self%before(j)) call self%note(j, self%next(j))
            call remember(self, system, j, self%next(j), branch)
            self%next(j) = branch
            further = .true.
         end do
         if (.not. further) exit
      end do
   end subroutine pass_branches

   !> Contact j comes from a branch to the next: where its law remembers, and it ceases to slide, s is at the bound that it slid at.
   !> The derivatives of a motion do not know of that.
   subroutine remember(self, system, j, from, next)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j, from, next

      real(wp) :: edge
      integer :: t

      associate (law => system%machine%contact(j)%law, error => system%gap(j)%error, s => self%dynamics%s(j))
         if (.not. law%remembers .or. from == next .or. next /= law%home) return
         edge = merge(law%branch(next)%guard(1)%upper, law%branch(next)%guard(1)%lower, law%branch(next)%guard(1)%above == from)
         t = maxloc(abs(error), 1)
         call self%dynamics%excitation%shift(t, (edge - s)/error(t)%re)
         s = edge
         self%saltation%defined = .false.
      end associate
   end subroutine remember

end module razy_hybrid_event_passing
