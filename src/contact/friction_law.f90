!! Dry friction: Coulomb's with a static and a kinetic coefficient, falling with the speed of sliding (source thesis, 2 and 3).
!!
!! The contact variable's rate s' is the velocity of sliding, and with the normal force N
!!
!!     F = μ(|s'|) N sign s',   μ(v) = μ_k + (μ_s - μ_k)/(1 + δ v)    (3.23), (3.32).
!!
!! or, after Stribeck, with an exponential and a viscous part,
!!
!!     μ(v) = μ_k + (μ_s - μ_k) e^(-δ v) + η v.
!!
!! With δ = 0 it is Coulomb's: kinetic μ_k while sliding, static μ_s while sticking. The thesis's belt has μ_k = 0, δ = 3 s/m.
!! Sticking is a constraint: s' stays 0 and F is what keeps it so, as long as |F| <= μ_s N. Where others hold what would slide, F
!! is at that limit, and s' stays 0 without a constraint: friction is strained.
module razy_contact_friction_law
   use razy_contact_contact_law, only: contact_law_t, guard_t
   use razy_core_kinds, only: pi, wp
   implicit none(type, external)
   private

   public :: branch_backward, branch_forward, branch_sticking, friction_law_t, new_friction_law, strained_backward, strained_forward

   integer, parameter :: branch_forward = 1, branch_backward = 2, branch_sticking = 3, strained_forward = 4, strained_backward = 5

   !> Switching function: s'.
   type, extends(contact_law_t) :: friction_law_t
      !> μ_s, μ_k, and δ and η, s/m (s/rad).
      real(wp) :: static = 0.0_wp, kinetic = 0.0_wp, decay = 0.0_wp, viscous = 0.0_wp
      logical, private :: exponential = .false.
   contains
      procedure :: initial_branch
      procedure :: force
      procedure :: slopes
      procedure :: smoothed
   end type friction_law_t

contains

   !> A law from its coefficients, 0 <= kinetic <= static, and decay >= 0 and viscous >= 0, s/m (s/rad).
   pure function new_friction_law(static, kinetic, decay, exponential, viscous) result(law)
      real(wp), intent(in) :: static, kinetic, decay
      logical, intent(in), optional :: exponential
      real(wp), intent(in), optional :: viscous
      type(friction_law_t) :: law

      law%static = static
      law%kinetic = kinetic
      law%decay = decay
      if (present(exponential)) law%exponential = exponential
      if (present(viscous)) law%viscous = viscous
      ! With one kinetic coefficient the force is linear in the normal force.
      law%piecewise_linear = .not. (decay > 0.0_wp .and. static > kinetic .or. law%viscous > 0.0_wp)
      law%slope(2, 1) = 1.0_wp
      law%of_normal = .true.
      law%plain = 3
      allocate (law%branch(5))
      law%branch%closed = .true.
      law%branch%name = [character(17) :: "sliding forward", "sliding backward", "sticking", "strained forward", &
                         "strained backward"]
      associate (forward => law%branch(branch_forward), backward => law%branch(branch_backward), &
                 sticks => law%branch(branch_sticking))
         forward%offset = kinetic
         forward%guard(1) = guard_t(lower=0.0_wp, below=branch_sticking)
         backward%offset = -kinetic
         backward%guard(1) = guard_t(upper=0.0_wp, above=branch_sticking)
         law%branch(strained_forward:)%offset = [static, -static]
         sticks%constraint = .true.
         sticks%force_guard = guard_t(-static, static, branch_backward, branch_forward)
      end associate
   end function new_friction_law

   !> The branch in which a motion starts, by the rate alone.
   pure function initial_branch(self, s, rate) result(branch)
      class(friction_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate
      integer :: branch

      associate (u1 => self%of_normal, u2 => s)
         branch = branch_sticking
         if (rate > 0.0_wp) branch = branch_forward
         if (rate < 0.0_wp) branch = branch_backward
      end associate
   end function initial_branch

   !> F in a branch, N (N m); 0 where it sticks, because F is then a constraint force, which the integrator knows.
   pure function force(self, branch, s, rate, normal)
      class(friction_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      real(wp) :: coefficient, slope, way

      force = self%branch(branch)%offset*normal
      associate (unused => s)
         if (branch > branch_backward) return
         way = merge(1.0_wp, -1.0_wp, branch == branch_forward)
         call evaluate(self, way*rate, coefficient, slope)
         force = way*coefficient*normal
      end associate
   end function force

   !> dF/ds and dF/ds' in a branch.
   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(friction_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: coefficient, slope

      stiffness = 0.0_wp
      damping = 0.0_wp
      associate (unused => s)
         if (branch /= branch_forward .and. branch /= branch_backward) return
         call evaluate(self, merge(rate, -rate, branch == branch_forward), coefficient, slope)
         damping = slope*normal
      end associate
   end subroutine slopes

   !> μ(v) and its derivative. A step that looks a little beyond v = 0 sees the smooth continuation of the branch, up to where
   !> the falling part has doubled.
   pure subroutine evaluate(self, v, coefficient, slope)
      class(friction_law_t), intent(in) :: self
      real(wp), intent(in) :: v
      real(wp), intent(out) :: coefficient, slope

      real(wp) :: at, falling, falls

      coefficient = self%kinetic + self%viscous*v
      slope = self%viscous
      if (.not. self%decay > 0.0_wp) return
      at = max(v, -merge(log(2.0_wp), 0.5_wp, self%exponential)/self%decay)
      falls = merge(1.0_wp, 1.0_wp + self%decay*at, self%exponential)
      falling = (self%static - self%kinetic)/falls
      if (self%exponential) falling = falling*exp(-self%decay*at)
      coefficient = coefficient + falling
      if (.not. at > v) slope = slope - self%decay*falling/falls
   end subroutine evaluate

   !> F = μ(|s'|) N (2/π) atan(sharpness s') and its slopes.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(friction_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      real(wp) :: coefficient, share, slope

      associate (unused => s)
         call evaluate(self, abs(rate), coefficient, slope)
         share = 2*atan(sharpness*rate)/pi
         force = normal*coefficient*share
         stiffness = 0.0_wp
         damping = normal*(slope*abs(share) + coefficient*2*sharpness/(pi*(1.0_wp + (sharpness*rate)**2)))
      end associate
   end subroutine smoothed

end module razy_contact_friction_law
