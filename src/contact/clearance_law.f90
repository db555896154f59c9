!! The piecewise-linear contact law with clearance: stops, two-sided stops and gear meshes.
!!
!! For the contact variable s (a gap, or a mesh deformation) the restoring force is
!!
!!     F = k_i s                                         for lower <= s <= upper,
!!     F = k_u (s - upper) + k_i upper + b_u s' + j_u    for s > upper,
!!     F = k_l (s - lower) + k_i lower + b_l s' - j_l    for s < lower,
!!
!! with the slope within the clearance k_i = 0 but for a gear mesh that has one ((4.58); Comparin and Singh,
!! J. Sound Vib. 134 (1989)).
!!
!! A one-sided stop has s = gap, lower = 0 and no upper side; a two-sided stop lower = -clearance, upper = clearance
!! (source thesis, 2); a gear mesh s = d, lower = -backlash, upper = 0 (4.1). With damping there are two rules for the loss of
!! contact (chapter 2): at zero deformation, where the force may have turned adhesive, or at zero force (3.28), after which
!! the surfaces relax without force until the deformation is gone. A side with a jump j > 0 of the force at touch, such as a
!! spring that is switched on when it is already stretched (source thesis, (3.44)-(3.47)), is left at zero deformation too.
module razy_contact_clearance_law
   use razy_contact_contact_law, only: branch_lower, branch_lower_parting, branch_open, branch_t, branch_upper, &
                                       branch_upper_parting, contact_law_t, with_pairs
   use razy_core_kinds, only: pi, wp
   implicit none(type, external)
   private

   public :: clearance_law_t, clearance_side_t, new_clearance_law, vary_stiffness

   !> One side of a law; a side that is not present never touches.
   type :: clearance_side_t
      logical :: present = .false.
      !> Value of s at which the side touches, m (rad).
      real(wp) :: edge = 0.0_wp
      !> N/m (N m/rad) and N s/m (N m s/rad).
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp
      !> Force at touch without damping, N (N m), not negative.
      real(wp) :: jump = 0.0_wp
   end type clearance_side_t

   !> Switching functions: 1 is s, 2 and 3 the force of a side that parts at zero force.
   type, extends(contact_law_t) :: clearance_law_t
   contains
      procedure :: smoothed
   end type clearance_law_t

contains

   !> A law from its sides. `part_at_zero_force` chooses the rule for the loss of a damped contact; it cannot be had with a slope
   !> `inner` k_i, N/m (N m/rad), within the clearance, since the force then does not vanish there.
   pure function new_clearance_law(lower, upper, part_at_zero_force, inner) result(law)
      type(clearance_side_t), intent(in) :: lower, upper
      logical, intent(in) :: part_at_zero_force
      real(wp), intent(in), optional :: inner
      type(clearance_law_t) :: law

      law%piecewise_linear = .true.
      law%slope(1, 1) = 1.0_wp
      if (present(inner)) law%branch(branch_open)%stiffness = inner
      if (upper%present) call add_side(law, upper, 1.0_wp, part_at_zero_force)
      if (lower%present) call add_side(law, lower, -1.0_wp, part_at_zero_force)
   end function new_clearance_law

   !> Add the branches with one and with two pairs of teeth in mesh, whose forces are those of the law times `factor`.
   pure subroutine vary_stiffness(law, factor)
      type(clearance_law_t), intent(inout) :: law
      real(wp), intent(in) :: factor(2)

      integer :: branch, f, pairs

      do pairs = 1, 2
         do branch = branch_open, branch_lower_parting
            associate (varied => law%branch(with_pairs(branch, pairs)), plain => law%branch(branch))
               varied = branch_t(factor(pairs)*plain%stiffness, factor(pairs)*plain%damping, factor(pairs)*plain%offset)
            end associate
            do f = 1, law%functions
               associate (guard => law%guard(f, with_pairs(branch, pairs)))
                  guard = law%guard(f, branch)
                  if (guard%below /= 0) guard%below = with_pairs(guard%below, pairs)
                  if (guard%above /= 0) guard%above = with_pairs(guard%above, pairs)
               end associate
            end do
         end do
      end do
   end subroutine vary_stiffness

   pure subroutine add_side(law, side, direction, part_at_zero_force)
      type(clearance_law_t), intent(inout) :: law
      type(clearance_side_t), intent(in) :: side
      real(wp), intent(in) :: direction
      logical, intent(in) :: part_at_zero_force

      integer :: closed, parting, f

      closed = merge(branch_upper, branch_lower, direction > 0.0_wp)
      parting = merge(branch_upper_parting, branch_lower_parting, direction > 0.0_wp)
      law%branch(closed) = branch_t(side%stiffness, side%damping, &
                                    direction*side%jump - (side%stiffness - law%branch(branch_open)%stiffness)*side%edge)
      call law%guard(1, branch_open)%bound(direction, side%edge, closed)
      if (.not. part_at_zero_force .or. .not. side%damping > 0.0_wp) then
         call law%guard(1, closed)%bound(-direction, side%edge, branch_open)
         return
      end if
      if (side%jump > 0.0_wp) call law%guard(1, closed)%bound(-direction, side%edge, branch_open)
      law%functions = law%functions + 1
      f = law%functions
      law%slope(:, f) = [side%stiffness, side%damping]
      law%constant(f) = law%branch(closed)%offset
      call law%guard(f, closed)%bound(-direction, 0.0_wp, parting)
      call law%guard(f, parting)%bound(direction, 0.0_wp, closed)
      call law%guard(1, parting)%bound(-direction, side%edge, branch_open)
   end subroutine add_side

   !> The force within the clearance and what each side adds to it, switched on by a smoothed step of its penetration.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(clearance_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      associate (unused => normal, open => self%guard(1, branch_open))
         stiffness = self%branch(branch_open)%stiffness
         force = stiffness*s
         damping = 0.0_wp
         if (open%above /= 0) call add_smoothed(beyond(open%above), self%parts(open%above), s, rate, s - open%upper, sharpness, &
                                                force, stiffness, damping)
         if (open%below /= 0) call add_smoothed(beyond(open%below), self%parts(open%below), s, rate, s - open%lower, -sharpness, &
                                                force, stiffness, damping)
      end associate

   contains

      !> What a branch has more than the open one.
      pure function beyond(branch) result(more)
         integer, intent(in) :: branch
         type(branch_t) :: more

         more = self%branch(branch)
         more%stiffness = more%stiffness - self%branch(branch_open)%stiffness
      end function beyond

   end subroutine smoothed

   !> Add an affine force that is switched on as x passes 0, upwards for a positive sharpness; one of a side that `parts` at zero
   !> force is switched on as force/stiffness does so, too.
   pure subroutine add_smoothed(piece, parts, s, rate, x, sharpness, force, stiffness, damping)
      type(branch_t), intent(in) :: piece
      logical, intent(in) :: parts
      real(wp), intent(in) :: s, rate, x, sharpness
      real(wp), intent(inout) :: force, stiffness, damping

      real(wp) :: full, pressed, share, slope, turned

      full = piece%stiffness*s + piece%damping*rate + piece%offset
      share = 0.5_wp + atan(sharpness*x)/pi
      slope = sharpness/(pi*(1.0_wp + (sharpness*x)**2))
      pressed = 1.0_wp
      turned = 0.0_wp
      if (parts) then
         associate (sharp => sharpness/piece%stiffness)
            pressed = 0.5_wp + atan(sharp*full)/pi
            turned = sharp*full/(pi*(1.0_wp + (sharp*full)**2))
         end associate
      end if
      force = force + share*pressed*full
      stiffness = stiffness + share*(pressed + turned)*piece%stiffness + slope*pressed*full
      damping = damping + share*(pressed + turned)*piece%damping
   end subroutine add_smoothed

end module razy_contact_clearance_law
