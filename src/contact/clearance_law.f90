!! The piecewise-linear contact law with clearance: stops, two-sided stops and gear meshes.
!!
!! For the contact variable s (a gap, or a mesh deformation) the restoring force is
!!
!!     F = 0                           for lower <= s <= upper,
!!     F = k_u (s - upper) + b_u s'    for s > upper,
!!     F = k_l (s - lower) + b_l s'    for s < lower.
!!
!! A one-sided stop has s = gap, lower = 0 and no upper side; a two-sided stop lower = -clearance, upper = clearance
!! (THEORY 2); a gear mesh s = d, lower = -backlash, upper = 0 (THEORY 4). With damping there are two rules for the loss of
!! contact (THEORY 1): at zero deformation, where the force may have turned adhesive, or at zero force (3.28), after which
!! the surfaces relax without force until the deformation is gone.
!!
!! A branch is one smooth piece of the law. It holds as long as every switching function f = alpha s + beta s' + gamma
!! stays within its bounds; what leaves a bound says which branch follows.
module razy_contact_clearance_law
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: branch_t, clearance_law_t, clearance_side_t, guard_t, new_clearance_law, same_slopes
   public :: branch_open, branch_upper, branch_lower, branch_upper_parting, branch_lower_parting, branch_meanings

   !> Branches of the law, as results name them.
   integer, parameter :: branch_open = 1, branch_upper = 2, branch_lower = 3, branch_upper_parting = 4, branch_lower_parting = 5
   character(*), parameter :: branch_meanings = "1 = open, 2 = closed (upper side), 3 = closed (lower side), "// &
                              "4 = parting (upper side), 5 = parting (lower side)"

   !> One side of a law; a side that is not present never touches.
   type :: clearance_side_t
      logical :: present = .false.
      !> Value of s at which the side touches, m (rad).
      real(wp) :: edge = 0.0_wp
      !> N/m (N m/rad) and N s/m (N m s/rad).
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp
   end type clearance_side_t

   !> F = stiffness*s + damping*s' + offset.
   type :: branch_t
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp, offset = 0.0_wp
   end type branch_t

   !> Bounds of one switching function in one branch and the branches that follow; 0 means unbounded.
   type :: guard_t
      real(wp) :: lower = 0.0_wp, upper = 0.0_wp
      integer :: below = 0, above = 0
   end type guard_t

   !> The law: branches, switching functions (1: s; 2 and 3: force of the upper and the lower side), guards.
   type :: clearance_law_t
      type(branch_t) :: branch(5)
      !> Functions in use; `slope` holds alpha and beta of each, `constant` its gamma.
      integer :: functions = 1
      real(wp) :: slope(2, 3) = 0.0_wp, constant(3) = 0.0_wp
      !> Guards (function, branch).
      type(guard_t) :: guard(3, 5)
   contains
      procedure :: initial_branch
   end type clearance_law_t

contains

   !> A law from its sides. `part_at_zero_force` chooses the rule for the loss of a damped contact.
   pure function new_clearance_law(lower, upper, part_at_zero_force) result(law)
      type(clearance_side_t), intent(in) :: lower, upper
      logical, intent(in) :: part_at_zero_force
      type(clearance_law_t) :: law

      law%slope(1, 1) = 1.0_wp
      if (upper%present) call add_side(law, upper, 1.0_wp, part_at_zero_force)
      if (lower%present) call add_side(law, lower, -1.0_wp, part_at_zero_force)
   end function new_clearance_law

   pure subroutine add_side(law, side, direction, part_at_zero_force)
      type(clearance_law_t), intent(inout) :: law
      type(clearance_side_t), intent(in) :: side
      real(wp), intent(in) :: direction
      logical, intent(in) :: part_at_zero_force

      integer :: closed, parting, f

      closed = merge(branch_upper, branch_lower, direction > 0.0_wp)
      parting = merge(branch_upper_parting, branch_lower_parting, direction > 0.0_wp)
      law%branch(closed) = branch_t(side%stiffness, side%damping, -side%stiffness*side%edge)
      call bound(law%guard(1, branch_open), direction, side%edge, closed)
      if (.not. part_at_zero_force .or. .not. side%damping > 0.0_wp) then
         call bound(law%guard(1, closed), -direction, side%edge, branch_open)
         return
      end if
      law%functions = law%functions + 1
      f = law%functions
      law%slope(:, f) = [side%stiffness, side%damping]
      law%constant(f) = -side%stiffness*side%edge
      call bound(law%guard(f, closed), -direction, 0.0_wp, parting)
      call bound(law%guard(f, parting), direction, 0.0_wp, closed)
      call bound(law%guard(1, parting), -direction, side%edge, branch_open)
   end subroutine add_side

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
   pure function initial_branch(self, s, rate) result(branch)
      class(clearance_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      real(wp) :: force
      integer :: f, parting

      branch = branch_open
      associate (edge => self%guard(1, branch_open))
         if (edge%above /= 0 .and. (s > edge%upper .or. (is_on(s, edge%upper) .and. rate > 0.0_wp))) branch = edge%above
         if (edge%below /= 0 .and. (s < edge%lower .or. (is_on(s, edge%lower) .and. rate < 0.0_wp))) branch = edge%below
      end associate
      if (branch == branch_open) return
      do f = 2, self%functions
         force = self%slope(1, f)*s + self%slope(2, f)*rate + self%constant(f)
         parting = max(self%guard(f, branch)%above, self%guard(f, branch)%below)
         if (parting == branch_upper_parting .and. force < 0.0_wp) branch = parting
         if (parting == branch_lower_parting .and. force > 0.0_wp) branch = parting
      end do
   end function initial_branch

   pure function is_on(value, edge) result(on)
      real(wp), intent(in) :: value, edge
      logical :: on

      on = .not. (value < edge .or. value > edge)
   end function is_on

   !> Whether two laws have the same stiffness, damping and switching slopes, so that the same modes serve both.
   pure function same_slopes(a, b) result(same)
      type(clearance_law_t), intent(in) :: a, b
      logical :: same

      same = a%functions == b%functions
      same = same .and. .not. any(abs(a%branch%stiffness - b%branch%stiffness) > 0.0_wp)
      same = same .and. .not. any(abs(a%branch%damping - b%branch%damping) > 0.0_wp)
      same = same .and. .not. any(abs(a%slope - b%slope) > 0.0_wp)
   end function same_slopes

end module razy_contact_clearance_law
