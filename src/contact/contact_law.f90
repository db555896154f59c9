!! What every contact law is to an integrator: branches, the force in each, and what ends a branch.
!!
!! A law gives the restoring force F of a contact variable s (gap, mesh deformation, or the sliding of a friction element)
!! and its rate s'; the machine is acted on by -w F. A **branch** is one smooth piece of the law. It holds as long as every
!! **switching function** f = alpha s + beta s' + gamma stays within its **guard**; what leaves a bound says which branch
!! follows.
!!
!! In a **constraint** branch (a closed rigid stop, a sticking friction element) F is whatever keeps s' (and for a stop s)
!! as it is; there a guard on F itself says when the branch ends. A law with **impacts** reverses s' by Newton's rule,
!! s'+ = -restitution s'-, when the motion arrives at such a branch (source thesis, (2.1)-(2.10)).
!!
!! In laws of a gap the switching function 1 is s; functions 2 and 3, where a side parts at zero force, have the sign of F: positive
!! while the upper side pushes, negative while the lower one does.
!!
!! Of a gear mesh whose stiffness switches between that of one and that of two pairs of teeth each branch has a variant for each.
module razy_contact_contact_law
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: branch_t, contact_law_t, guard_t, same_slopes
   public :: branch_open, branch_upper, branch_lower, branch_upper_parting, branch_lower_parting
   public :: branch_forward, branch_backward, branch_sticking, branch_meanings, branches
   public :: is_closed, plain_branch, with_pairs

   !> Branches of all laws, as results name them.
   integer, parameter :: branch_open = 1, branch_upper = 2, branch_lower = 3, branch_upper_parting = 4, branch_lower_parting = 5, &
                         branch_forward = 6, branch_backward = 7, branch_sticking = 8
   !> Branches 1 to 5 with one pair of teeth in mesh are 9 to 13, with two 14 to 18.
   integer, parameter :: varied = 5, branches = 8 + 2*varied
   character(*), parameter :: branch_meanings = "1 = open, 2 = closed (upper side), 3 = closed (lower side), "// &
                              "4 = parting (upper side), 5 = parting (lower side), "// &
                              "6 = sliding forward, 7 = sliding backward, 8 = sticking, "// &
                              "9 to 13 = 1 to 5 with one pair of teeth in mesh, 14 to 18 = 1 to 5 with two"

   !> F = stiffness*s + damping*s' + offset.
   type :: branch_t
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp, offset = 0.0_wp
   end type branch_t

   !> Bounds of one switching function in one branch and the branches that follow; 0 means unbounded.
   type :: guard_t
      real(wp) :: lower = 0.0_wp, upper = 0.0_wp
      integer :: below = 0, above = 0
   contains
      procedure :: bound
   end type guard_t

   !> A law. What is data here describes the branches; where the force in them is not affine it is the extension's.
   type, abstract :: contact_law_t
      !> Whether F is affine in every branch, as `branch` says (per normal force with `of_normal`), or a constraint force; only then
      !> is `branch` of any meaning.
      logical :: piecewise_linear = .false.
      type(branch_t) :: branch(branches)
      !> Functions in use; `slope` holds alpha and beta of each, `constant` its gamma. The first is s in laws with a gap.
      integer :: functions = 1
      real(wp) :: slope(2, 3) = 0.0_wp, constant(3) = 0.0_wp
      !> Guards (function, branch).
      type(guard_t) :: guard(3, branches)
      !> Branches in which F is a constraint force, and the guard on F there (per normal force with `of_normal`).
      logical :: constraint(branches) = .false., of_normal = .false.
      type(guard_t) :: force_guard(branches)
      !> Whether s' jumps when the motion arrives at a constraint, and Newton's coefficient of restitution, in [0, 1].
      logical :: impacts = .false.
      real(wp) :: restitution = 0.0_wp
      !> Whether there is a smoothed form.
      logical :: smoothable = .true.
   contains
      !> Branch in which a motion with s and s' starts.
      procedure :: initial_branch
      !> F in a branch, N (N m); `normal` is the normal force of a friction element.
      procedure :: force
      !> dF/ds and dF/ds' in a branch.
      procedure :: slopes
      !> F and its slopes with every jump smoothed: H(x) = 1/2 + atan(sharpness x)/pi, sign x = 2 atan(sharpness x)/pi
      !> (source thesis, (3.40)-(3.43)).
      procedure :: smoothed
      !> The branch that follows at once where a bound has been crossed.
      procedure :: branch_beyond
      !> Whether a closed branch has a bound besides that of s.
      procedure :: parts
   end type contact_law_t

   !> Rounding of a constant of a switching function, and of its bound.
   real(wp), parameter :: of_constant = 16*epsilon(1.0_wp)

contains

   !> The branch with so many pairs of teeth in mesh, 1 or 2, of a branch with any.
   elemental integer function with_pairs(branch, pairs)
      integer, intent(in) :: branch, pairs

      with_pairs = plain_branch(branch) + 8 + varied*(pairs - 1)
   end function with_pairs

   !> A branch without the number of pairs in mesh.
   elemental integer function plain_branch(branch)
      integer, intent(in) :: branch

      plain_branch = branch
      if (branch > 8) plain_branch = 1 + modulo(branch - 9, varied)
   end function plain_branch

   !> Whether a contact in this branch is closed; one that is parting, whose surfaces relax without force, is not.
   elemental logical function is_closed(branch)
      integer, intent(in) :: branch

      is_closed = all(plain_branch(branch) /= [branch_open, branch_upper_parting, branch_lower_parting])
   end function is_closed

   !> Bound a function from above (direction > 0) or below, and name the branch beyond.
   pure subroutine bound(self, direction, value, beyond)
      class(guard_t), intent(inout) :: self
      real(wp), intent(in) :: direction, value
      integer, intent(in) :: beyond

      if (direction > 0.0_wp) then
         self%upper = value
         self%above = beyond
      else
         self%lower = value
         self%below = beyond
      end if
   end subroutine bound

   !> The branch in which a motion with `s` and its rate starts, of a law of a gap. On an edge the rate decides, then `open`.
   pure function initial_branch(self, s, rate) result(branch)
      class(contact_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      real(wp) :: push
      integer :: f, parting

      branch = branch_open
      associate (edge => self%guard(1, branch_open))
         if (edge%above /= 0 .and. (s > edge%upper .or. (.not. s < edge%upper .and. rate > 0.0_wp))) branch = edge%above
         if (edge%below /= 0 .and. (s < edge%lower .or. (.not. s > edge%lower .and. rate < 0.0_wp))) branch = edge%below
      end associate
      if (branch == branch_open) return
      do f = 2, self%functions
         push = self%slope(1, f)*s + self%slope(2, f)*rate + self%constant(f)
         parting = max(self%guard(f, branch)%above, self%guard(f, branch)%below)
         if (parting == branch_upper_parting .and. push < 0.0_wp) branch = parting
         if (parting == branch_lower_parting .and. push > 0.0_wp) branch = parting
      end do
   end function initial_branch

   !> F of a law that is affine in every branch; 0 where it is a constraint force, which the integrator knows.
   pure function force(self, branch, s, rate, normal)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      associate (piece => self%branch(branch), unused => normal)
         force = piece%stiffness*s + piece%damping*rate + piece%offset
      end associate
   end function force

   !> dF/ds and dF/ds' of a law that is affine in every branch.
   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      associate (unused_1 => s, unused_2 => rate, unused_3 => normal)
         stiffness = self%branch(branch)%stiffness
         damping = self%branch(branch)%damping
      end associate
   end subroutine slopes

   !> Of a law without a smoothed form (`smoothable` is false): not a number, so that it cannot be used unseen.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(contact_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      associate (u1 => self%impacts, u2 => s, u3 => rate, u4 => normal, u5 => sharpness)
         force = ieee_value(force, ieee_quiet_nan)
         stiffness = force
         damping = force
      end associate
   end subroutine smoothed

   !> The branch that follows `branch` at once at s and s' with their rounding, as a switching function is beyond a bound, or on it
   !> and about to cross; 0 if there is none. The rate of a function of s' needs s'', so it counts as none.
   pure function branch_beyond(self, branch, s, rate, noise_s, noise_rate) result(next)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, noise_s, noise_rate
      integer :: next

      real(wp) :: noise, slope, value
      integer :: f

      next = 0
      do f = 1, self%functions
         value = self%slope(1, f)*s + self%slope(2, f)*rate + self%constant(f)
         slope = self%slope(1, f)*rate
         if (abs(self%slope(2, f)) > 0.0_wp .or. abs(rate) <= noise_rate) slope = 0.0_wp
         noise = abs(self%slope(1, f))*noise_s + abs(self%slope(2, f))*noise_rate + of_constant*abs(self%constant(f))
         associate (guard => self%guard(f, branch))
            if (guard%below /= 0 .and. beyond(value - guard%lower, slope, noise + of_constant*abs(guard%lower))) then
               next = guard%below
            else if (guard%above /= 0 .and. beyond(guard%upper - value, -slope, noise + of_constant*abs(guard%upper))) then
               next = guard%above
            end if
         end associate
         if (next /= 0) return
      end do
   end function branch_beyond

   !> Whether g is below 0, or 0 and falling.
   pure logical function beyond(g, rate, noise)
      real(wp), intent(in) :: g, rate, noise

      beyond = (g < -noise .and. .not. rate > 0.0_wp) .or. (g <= noise .and. rate < 0.0_wp)
   end function beyond

   !> Whether a closed side has a bound besides that of s: it parts at zero force.
   pure function parts(self, branch)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch
      logical :: parts

      parts = any(self%guard(2:self%functions, branch)%below /= 0 .or. self%guard(2:self%functions, branch)%above /= 0)
   end function parts

   !> Whether two piecewise-linear laws have the same stiffness, damping and switching slopes, so that the same modes serve
   !> both.
   pure function same_slopes(a, b) result(same)
      class(contact_law_t), intent(in) :: a, b
      logical :: same

      same = a%piecewise_linear .and. b%piecewise_linear .and. a%functions == b%functions
      same = same .and. .not. any(abs(a%branch%stiffness - b%branch%stiffness) > 0.0_wp)
      same = same .and. .not. any(abs(a%branch%damping - b%branch%damping) > 0.0_wp)
      same = same .and. .not. any(abs(a%slope - b%slope) > 0.0_wp)
      same = same .and. all(a%constraint .eqv. b%constraint) .and. (a%of_normal .eqv. b%of_normal)
      if (same .and. a%of_normal) same = .not. any(abs(a%branch%offset - b%branch%offset) > 0.0_wp)
   end function same_slopes

end module razy_contact_contact_law
