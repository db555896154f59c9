!! Rigid stops with Newton's restitution (source thesis, (2.1)-(2.10) and Signorini's condition (3.21)).
!!
!! Open, there is no force; a closed side is a constraint: s stays at its edge, and F is what keeps it there, positive on the
!! upper side and negative on the lower. It ends where F would pull. Where the motion arrives at an edge with a rate s', that
!! becomes -restitution s' at once. Where both edges are one, s cannot move: impacts follow each other in no time until s' = 0,
!! and a side whose force would pull gives over to the other.
module razy_contact_rigid_law
   use razy_contact_contact_law, only: branch_lower, branch_open, branch_upper, contact_law_t
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
   type, extends(contact_law_t) :: rigid_law_t
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
      law%slope(1, 1) = 1.0_wp
      if (upper%present) then
         law%constraint(branch_upper) = .true.
         call law%guard(1, branch_open)%bound(1.0_wp, upper%edge, branch_upper)
         call law%force_guard(branch_upper)%bound(-1.0_wp, 0.0_wp, branch_open)
      end if
      if (lower%present) then
         law%constraint(branch_lower) = .true.
         call law%guard(1, branch_open)%bound(-1.0_wp, lower%edge, branch_lower)
         call law%force_guard(branch_lower)%bound(1.0_wp, 0.0_wp, branch_open)
      end if
      if (.not. (lower%present .and. upper%present)) return
      if (upper%edge > lower%edge) return
      law%restitution = 0.0_wp
      call law%force_guard(branch_upper)%bound(-1.0_wp, 0.0_wp, branch_lower)
      call law%force_guard(branch_lower)%bound(1.0_wp, 0.0_wp, branch_upper)
   end function new_rigid_law

   !> The branch in which a motion with `s` and its rate starts: closed on (or beyond) an edge unless the rate leads away. With
   !> a rate into the edge that is an impact at the start.
   pure function initial_branch(self, s, rate) result(branch)
      class(rigid_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      branch = branch_open
      associate (edge => self%guard(1, branch_open))
         if (edge%below /= 0 .and. s <= edge%lower .and. rate <= 0.0_wp) branch = edge%below
         if (edge%above /= 0 .and. s >= edge%upper .and. rate >= 0.0_wp) branch = edge%above
      end associate
   end function initial_branch

end module razy_contact_rigid_law
