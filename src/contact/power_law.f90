!! Contact laws with a power of the deformation: Hunt and Crossley's, and Hertz's (source thesis, (2.14)-(2.18)).
!!
!! With the deformation p of a side (p = s - upper, or lower - s) the force that pushes the surfaces apart is
!!
!!     λ = k pⁿ (1 + (3/2) α p')    for p > 0, (2.14)-(2.15),
!!
!! and F = λ on the upper side, -λ on the lower. Hertz's law (2.16)-(2.18) is α = 0, n = 3/2, with k from `hertz_stiffness`.
!! The force vanishes with p, so it neither jumps at touch nor pulls at the end of a free impact. If a load tears the
!! surfaces apart faster than 2/(3α), λ turns adhesive; the rule of parting at zero force ends the contact there.
!!
!! Within a step an integrator looks a little beyond p = 0. There pⁿ is continued as the polynomial for a whole n, which
!! keeps the order of the integrator, and as -|p|ⁿ else, which keeps the derivatives that pⁿ has at 0. No more can be kept: for
!! n = 3/2 the fourth derivative of the motion is unbounded at touch, and a step of length h that ends or begins there
!! errs by O(h^(n+2)) whatever its order; step control has to see to it.
module razy_contact_power_law
   use razy_contact_gap_law, only: add_side, branch_lower, branch_upper, gap_law_t
   use razy_core_kinds, only: pi, wp
   implicit none(type, external)
   private

   public :: hertz_stiffness, new_power_law, power_law_t, power_side_t

   !> One side of a law; a side that is not present never touches.
   type :: power_side_t
      logical :: present = .false.
      !> Value of s at which the side touches, m (rad).
      real(wp) :: edge = 0.0_wp
      !> k, N/mⁿ (N m/radⁿ), and n, from 1 to 10.
      real(wp) :: stiffness = 0.0_wp, exponent = 1.5_wp
      !> Hysteresis α, s/m (s/rad).
      real(wp) :: hysteresis = 0.0_wp
   end type power_side_t

   !> m (rad) and m/s (rad/s), further than anything moves.
   real(wp), parameter :: farthest = 1.0e20_wp

   !> Switching functions: 1 is s; 2 and 3, of sides that part at zero force, ±(1 + (3/2) α p').
   type, extends(gap_law_t) :: power_law_t
      type(power_side_t) :: lower, upper
   contains
      procedure :: energy
      procedure :: force
      procedure :: slopes
      procedure :: smoothed
   end type power_law_t

contains

   !> A law from its sides. `part_at_zero_force` chooses the rule for the loss of a contact with hysteresis.
   pure function new_power_law(lower, upper, part_at_zero_force) result(law)
      type(power_side_t), intent(in) :: lower, upper
      logical, intent(in) :: part_at_zero_force
      type(power_law_t) :: law

      law%lower = lower
      law%upper = upper
      call add_curved_side(law, upper, 1.0_wp, part_at_zero_force)
      call add_curved_side(law, lower, -1.0_wp, part_at_zero_force)
   end function new_power_law

   !> Stiffness of Hertz's law for spheres of radii r1, r2 (m), Young's moduli e1, e2 (Pa) and Poisson's ratios nu1, nu2,
   !> N/m^(3/2) (2.17)-(2.18). An infinite radius is a plane, a negative one a hollow; not both planes.
   pure function hertz_stiffness(r1, r2, e1, nu1, e2, nu2) result(k)
      real(wp), intent(in) :: r1, r2, e1, nu1, e2, nu2
      real(wp) :: k

      associate (theta_1 => 4*(1 - nu1**2)/e1, theta_2 => 4*(1 - nu2**2)/e2)
         k = 16/(3*(theta_1 + theta_2))*sqrt(1/(1/r1 + 1/r2))
      end associate
   end function hertz_stiffness

   pure subroutine add_curved_side(law, side, direction, part_at_zero_force)
      type(power_law_t), intent(inout) :: law
      type(power_side_t), intent(in) :: side
      real(wp), intent(in) :: direction
      logical, intent(in) :: part_at_zero_force

      integer :: closed

      if (.not. side%present) return
      ! The force vanishes at zero deformation as well, so both rules end the contact there.
      if (part_at_zero_force .and. side%hysteresis > 0.0_wp) then
         call add_side(law, direction, side%edge, .true., closed, [0.0_wp, 1.5_wp*side%hysteresis], direction)
      else
         call add_side(law, direction, side%edge, .true., closed)
      end if
   end subroutine add_curved_side

   !> Stored on the side that is closed, k pⁿ⁺¹/(n + 1), J.
   pure function energy(self, branch, s)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      energy = 0.0_wp
      if (branch == branch_upper) energy = stored(self%upper, s - self%upper%edge)
      if (branch == branch_lower) energy = stored(self%lower, self%lower%edge - s)

   contains

      pure real(wp) function stored(side, p)
         type(power_side_t), intent(in) :: side
         real(wp), intent(in) :: p

         stored = side%stiffness*abs(p)**(side%exponent + 1)/(side%exponent + 1)
      end function stored

   end function energy

   !> F in a branch, N (N m).
   pure function force(self, branch, s, rate, normal)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      real(wp) :: of_s, of_rate

      associate (unused => normal)
         call evaluate(self, branch, s, rate, force, of_s, of_rate)
      end associate
   end function force

   !> dF/ds and dF/ds' in a branch.
   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: f

      associate (unused => normal)
         call evaluate(self, branch, s, rate, f, stiffness, damping)
      end associate
   end subroutine slopes

   !> F, dF/ds and dF/ds' in a branch.
   pure subroutine evaluate(self, branch, s, rate, f, stiffness, damping)
      class(power_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate
      real(wp), intent(out) :: f, stiffness, damping

      f = 0.0_wp
      stiffness = 0.0_wp
      damping = 0.0_wp
      select case (branch)
      case (branch_upper)
         call push(self%upper, s - self%upper%edge, rate, f, stiffness, damping)
      case (branch_lower)
         call push(self%lower, self%lower%edge - s, -rate, f, stiffness, damping)
         f = -f
      case default
         return
      end select
   end subroutine evaluate

   !> λ and its derivatives with respect to p and p'. A trial step that is much too long may ask with any numbers: beyond
   !> `farthest` they count as that, so that the answer is huge but finite, and the step is refused for its error.
   pure subroutine push(side, deformation, deformation_rate, force, stiffness, damping)
      type(power_side_t), intent(in) :: side
      real(wp), intent(in) :: deformation, deformation_rate
      real(wp), intent(out) :: force, stiffness, damping

      real(wp) :: factor, p, power, slope

      associate (n => side%exponent, c => 1.5_wp*side%hysteresis)
         p = max(-farthest, min(farthest, deformation))
         if (abs(n - 1.5_wp) > 0.0_wp) then
            slope = side%stiffness*abs(p)**(n - 1)
         else
            slope = side%stiffness*sqrt(abs(p))
         end if
         power = slope*p
         slope = n*slope
         if (p < 0.0_wp .and. .not. abs(modulo(n, 2.0_wp)) > 0.0_wp) then
            power = -power
            slope = -slope
         end if
         factor = 1 + c*max(-farthest, min(farthest, deformation_rate))
         force = power*factor
         stiffness = slope*factor
         damping = power*c
      end associate
   end subroutine push

   !> Sum of both sides, each continued beyond p = 0 and switched on by a smoothed step of p.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(power_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      force = 0.0_wp
      stiffness = 0.0_wp
      damping = 0.0_wp
      associate (unused => normal)
         if (self%upper%present) call add(self%upper, self%parts(branch_upper), s - self%upper%edge, rate, 1.0_wp, sharpness, &
                                          force, stiffness, damping)
         if (self%lower%present) call add(self%lower, self%parts(branch_lower), self%lower%edge - s, -rate, -1.0_wp, sharpness, &
                                          force, stiffness, damping)
      end associate

   end subroutine smoothed

   !> Add a side with deformation p that acts in `direction`; if it `parts` at zero force, it is switched on by p (1 + c p') too.
   pure subroutine add(side, parts, p, rate, direction, sharpness, force, stiffness, damping)
      type(power_side_t), intent(in) :: side
      logical, intent(in) :: parts
      real(wp), intent(in) :: p, rate, direction, sharpness
      real(wp), intent(inout) :: force, stiffness, damping

      real(wp) :: f, k, b, factor, pressed, share, slope

      call push(side, p, rate, f, k, b)
      if (parts) then
         factor = 1 + 1.5_wp*side%hysteresis*rate
         pressed = 0.5_wp + atan(sharpness*p*factor)/pi
         slope = f*sharpness/(pi*(1.0_wp + (sharpness*p*factor)**2))
         f = pressed*f
         k = pressed*k + slope*factor
         b = pressed*b + slope*1.5_wp*side%hysteresis*p
      end if
      share = 0.5_wp + atan(sharpness*p)/pi
      force = force + direction*share*f
      stiffness = stiffness + share*k + sharpness*f/(pi*(1.0_wp + (sharpness*p)**2))
      damping = damping + share*b
   end subroutine add

end module razy_contact_power_law
