!! Branches of the laws of a gap: open, closed on the upper and on the lower side, and parting, where a side lets go at zero force
!! and its surface relaxes.
!!
!! The switching function 1 is s; functions 2 and 3, of sides that part at zero force, have the sign of F: positive while the upper
!! side pushes, negative while the lower one does.
module razy_contact_gap_law
   use razy_contact_contact_law, only: contact_law_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: add_side, branch_lower, branch_lower_parting, branch_open, branch_upper, branch_upper_parting, closed_and_parting, &
             gap_law_t

   integer, parameter :: branch_open = 1, branch_upper = 2, branch_lower = 3, branch_upper_parting = 4, branch_lower_parting = 5
   !> How many these are.
   integer, parameter :: closed_and_parting = 5
   character(*), parameter :: of_branch(*) = [character(20) :: "open", "closed (upper side)", "closed (lower side)", &
                                                                                     "parting (upper side)", "parting (lower side)"]

   type, abstract, extends(contact_law_t) :: gap_law_t
   contains
      !> Where s is when the side of a closed branch touches.
      procedure :: edge
   end type gap_law_t

contains

   !> Add the branches of the side that s reaches in `direction` (+1, -1) at `edge`: closed, and parting from where the function
   !> `slope`*(s, s') + `constant` changes its sign, if there is a `slope`. `leaves_at_edge`: it is left at the edge too.
   pure subroutine add_side(law, direction, edge, leaves_at_edge, closed, slope, constant)
      class(gap_law_t), intent(inout) :: law
      real(wp), intent(in) :: direction, edge
      logical, intent(in) :: leaves_at_edge
      integer, intent(out) :: closed
      real(wp), intent(in), optional :: slope(2), constant

      integer :: f, parting

      if (.not. allocated(law%branch)) then
         allocate (law%branch(closed_and_parting))
         law%plain = closed_and_parting
         law%branch(branch_open)%name = of_branch(branch_open)
         law%slope(1, 1) = 1.0_wp
      end if
      closed = merge(branch_upper, branch_lower, direction > 0.0_wp)
      law%branch(closed)%name = of_branch(closed)
      law%branch(closed)%closed = .true.
      law%branch(closed)%side = nint(direction)
      call law%branch(branch_open)%guard(1)%bound(direction, edge, closed)
      law%shut = merge(branch_upper, closed, law%branch(branch_upper)%closed)
      if (leaves_at_edge) call law%branch(closed)%guard(1)%bound(-direction, edge, branch_open)
      if (.not. present(slope)) return
      parting = closed + 2
      law%branch(parting)%name = of_branch(parting)
      law%branch(parting)%side = nint(direction)
      law%functions = law%functions + 1
      f = law%functions
      law%slope(:, f) = slope
      law%constant(f) = constant
      call law%branch(closed)%guard(f)%bound(-direction, 0.0_wp, parting)
      call law%branch(parting)%guard(f)%bound(direction, 0.0_wp, closed)
      call law%branch(parting)%guard(1)%bound(-direction, edge, branch_open)
   end subroutine add_side

   !> m (rad).
   pure real(wp) function edge(self, branch)
      class(gap_law_t), intent(in) :: self
      integer, intent(in) :: branch

      associate (open => self%branch(branch_open)%guard(1))
         edge = merge(open%upper, open%lower, self%branch(branch)%side > 0)
      end associate
   end function edge

end module razy_contact_gap_law
