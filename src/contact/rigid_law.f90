!! Rigid stops with Newton's restitution (source thesis, (2.1)-(2.10) and Signorini's condition (3.21)).
!!
!! Open, there is no force; a closed side is a constraint: s stays at its edge, and F is what keeps it there, positive on the
!! upper side and negative on the lower. It ends where F would pull. Where the motion arrives at an edge with a rate s', that
!! becomes -restitution s' at once. Where both edges are one, s cannot move: impacts follow each other in no time until s' = 0,
!! whatever the restitution, and of the sides that one acts whose force pushes.
module razy_contact_rigid_law
   use razy_contact_gap_law, only: add_side, branch_open, gap_law_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: new_rigid_law, rigid_law_t, rigid_side_t

   !> One side of a law; a side that is not present never touches.
   type :: rigid_side_t
      logical :: present = .false.
      !> Value of s at which the side touches, m (rad).
      real(wp) :: edge = 0.0_wp
   end type rigid_side_t

   !> Switching function: s.
   type, extends(gap_law_t) :: rigid_law_t
   contains
      procedure :: initial_branch
   end type rigid_law_t

contains

   !> A law from its sides and the coefficient of restitution, in [0, 1].
   pure function new_rigid_law(lower, upper, restitution) result(law)
      type(rigid_side_t), intent(in) :: lower, upper
      real(wp), intent(in) :: restitution
      type(rigid_law_t) :: law

      law%piecewise_linear = .true.
      law%impacts = .true.
      law%restitution = restitution
      law%smoothable = .false.
      call add_rigid_side(law, upper, 1.0_wp)
      call add_rigid_side(law, lower, -1.0_wp)
      if (lower%present .and. upper%present .and. .not. upper%edge > lower%edge) law%restitution = 0.0_wp
   end function new_rigid_law

   pure subroutine add_rigid_side(law, side, direction)
      type(rigid_law_t), intent(inout) :: law
      type(rigid_side_t), intent(in) :: side
      real(wp), intent(in) :: direction

      integer :: closed

      if (.not. side%present) return
      call add_side(law, direction, side%edge, .false., closed)
      law%branch(closed)%constraint = .true.
      call law%branch(closed)%force_guard%bound(-direction, 0.0_wp, branch_open)
   end subroutine add_rigid_side

   !> The branch in which a motion with `s` and its rate starts: closed on (or beyond) an edge unless the rate leads away. With
   !> a rate into the edge that is an impact at the start.
   pure function initial_branch(self, s, rate) result(branch)
      class(rigid_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      branch = branch_open
      associate (edge => self%branch(branch_open)%guard(1))
         if (edge%below /= 0 .and. s <= edge%lower .and. rate <= 0.0_wp) branch = edge%below
         if (edge%above /= 0 .and. s >= edge%upper .and. rate >= 0.0_wp) branch = edge%above
      end associate
   end function initial_branch

end module razy_contact_rigid_law
