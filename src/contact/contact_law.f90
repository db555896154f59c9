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
!! A law numbers its branches itself, from 1, and names them. Where its stiffness has levels, as that of gear teeth has with the
!! number of pairs in mesh, every branch comes again for each level.
module razy_contact_contact_law
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   implicit none(type, external)
   private

   public :: branch_t, contact_law_t, guard_t, most_functions, same_slopes

   !> Switching functions that a law may have: s, and for each side a force and its limit.
   integer, parameter :: most_functions = 5

   !> Bounds of one function in one branch and the branches that follow; 0 means unbounded.
   type :: guard_t
      real(wp) :: lower = 0.0_wp, upper = 0.0_wp
      integer :: below = 0, above = 0
   contains
      procedure :: bound
   end type guard_t

   !> One branch, with the name that results give it.
   type :: branch_t
      character(40) :: name = ""
      !> Whether the contact is closed; one that is parting, whose surfaces relax without force, is not.
      logical :: closed = .false.
      !> On which side of s it is closed or parting: +1 the upper, -1 the lower, 0 none.
      integer :: side = 0
      !> Whether F is a constraint force; whether a motion that comes here has left what is known of the law.
      logical :: constraint = .false., outside = .false.
      !> F = stiffness*s + damping*s' + offset.
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp, offset = 0.0_wp
      !> Guards on the switching functions, and on a constraint force (per normal force with `of_normal`).
      type(guard_t) :: guard(most_functions), force_guard
   end type branch_t

   !> A law. What is data here describes the branches; where the force in them is not affine it is the extension's.
   type, abstract :: contact_law_t
      !> Whether F is affine in every branch, as `branch` says (per normal force with `of_normal`), or a constraint force; only then
      !> are the coefficients of any meaning.
      logical :: piecewise_linear = .false.
      !> All branches: `plain` of them, then again for each level.
      type(branch_t), allocatable :: branch(:)
      integer :: plain = 0
      !> The branch of a contact that nothing closes or stretches, and the one with all of it closed, on the upper side if there
      !> are two.
      integer :: home = 1, shut = 1
      !> Switching functions in use; `slope` holds alpha and beta of each, `constant` its gamma. The first is s in laws with a gap.
      integer :: functions = 1
      real(wp) :: slope(2, most_functions) = 0.0_wp, constant(most_functions) = 0.0_wp
      !> Whether F is in proportion to a normal force: friction.
      logical :: of_normal = .false.
      !> Part of the damping in every branch that stays where the stiffness of teeth varies, N s/m.
      real(wp) :: steady_damping = 0.0_wp
      !> Whether s' jumps when the motion arrives at a constraint, and Newton's coefficient of restitution, in [0, 1].
      logical :: impacts = .false.
      real(wp) :: restitution = 0.0_wp
      !> Whether s is counted from a place that the motion sets: from a branch that slides it comes to `home` at the bound there.
      logical :: remembers = .false.
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
      !> The branch at a level, of a branch at any.
      procedure :: at_level
      !> Energy stored at s in a branch, J.
      procedure :: energy
      !> Numbers and names of the branches, as attributes of results have them.
      procedure :: meanings
   end type contact_law_t

   !> Rounding of a constant of a switching function, and of its bound.
   real(wp), parameter :: of_constant = 16*epsilon(1.0_wp)

contains

   !> The branch at a level, of a branch at any; level 0 is the mean one.
   elemental integer function at_level(self, branch, level)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch, level

      at_level = 1 + modulo(branch - 1, self%plain) + self%plain*level
   end function at_level

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

   !> The branch in which a motion with `s` and its rate starts: from that of an open contact on, as long as a bound is
   !> passed, or reached and about to be.
   pure function initial_branch(self, s, rate) result(branch)
      class(contact_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      real(wp) :: slope, value
      integer :: f, next, round

      branch = self%home
      do round = 1, self%plain
         next = 0
         do f = 1, self%functions
            value = self%slope(1, f)*s + self%slope(2, f)*rate + self%constant(f)
            slope = merge(0.0_wp, self%slope(1, f)*rate, abs(self%slope(2, f)) > 0.0_wp)
            associate (guard => self%branch(branch)%guard(f))
               if (guard%below /= 0 .and. passed(value - guard%lower, slope)) next = guard%below
               if (guard%above /= 0 .and. passed(guard%upper - value, -slope)) next = guard%above
            end associate
         end do
         if (next == 0) return
         branch = next
      end do

   contains

      pure logical function passed(g, rate)
         real(wp), intent(in) :: g, rate

         passed = g < 0.0_wp .or. (.not. g > 0.0_wp .and. rate < 0.0_wp)
      end function passed

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
         slope = merge(0.0_wp, self%slope(1, f)*rate, abs(self%slope(2, f)) > 0.0_wp .or. abs(rate) <= noise_rate)
         noise = abs(self%slope(1, f))*noise_s + abs(self%slope(2, f))*noise_rate + of_constant*abs(self%constant(f))
         associate (guard => self%branch(branch)%guard(f))
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

      associate (others => self%branch(branch)%guard(2:self%functions))
         parts = any(others%below /= 0 .or. others%above /= 0)
      end associate
   end function parts

   !> Of a law that stores none.
   pure function energy(self, branch, s)
      class(contact_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      associate (u1 => self%impacts, u2 => branch, u3 => s)
         energy = 0.0_wp
      end associate
   end function energy

   !> "1 = open, 2 = closed (upper side)"; branches without a name are never entered.
   pure function meanings(self) result(text)
      class(contact_law_t), intent(in) :: self
      character(:), allocatable :: text

      integer :: b

      text = ""
      do b = 1, size(self%branch)
         if (self%branch(b)%name == "") cycle
         if (text /= "") text = text//", "
         text = text//to_text(b)//" = "//trim(self%branch(b)%name)
      end do
   end function meanings

   !> Whether two piecewise-linear laws have the same stiffness, damping and switching slopes, so that the same modes serve
   !> both.
   pure function same_slopes(a, b) result(same)
      class(contact_law_t), intent(in) :: a, b
      logical :: same

      same = a%piecewise_linear .and. b%piecewise_linear .and. a%functions == b%functions .and. size(a%branch) == size(b%branch)
      if (same) same = all(abs(a%branch%stiffness - b%branch%stiffness) <= 0.0_wp) .and. &
                       all(abs(a%branch%damping - b%branch%damping) <= 0.0_wp) .and. all(abs(a%slope - b%slope) <= 0.0_wp) .and. &
                       all(a%branch%constraint .eqv. b%branch%constraint) .and. (a%of_normal .eqv. b%of_normal)
      if (same .and. a%of_normal) same = .not. any(abs(a%branch%offset - b%branch%offset) > 0.0_wp)
   end function same_slopes

end module razy_contact_contact_law
