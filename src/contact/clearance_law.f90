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
!!
!! Damping may act in the clearance as well, with one constant b (Kahraman and Singh, J. Sound Vib. 142 (1990)):
!!
!!     F = k g(s) + b s',
!!
!! or it may be limited by the force of the spring, so that F is neither adhesive nor jumps at touch: with the deformation p
!!
!!     F = k p + min(max(b p', -k p), k p).
module razy_contact_clearance_law
   use razy_contact_contact_law, only: branch_t
   use razy_contact_gap_law, only: add_side, branch_lower, branch_open, branch_upper, closed_and_parting, gap_law_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   implicit none(type, external)
   private

   public :: clearance_law_t, clearance_side_t, new_clearance_law, vary_stiffness
   public :: damp_always, limit_damping

   !> From a closed branch to that in which its damping is at the limit.
   integer, parameter :: to_limit = 4

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

   !> Switching functions: 1 is s, the others the force of a side that parts at zero force, and what it is short of the limit.
   type, extends(gap_law_t) :: clearance_law_t
   contains
      procedure :: energy
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

      integer :: i

      law%piecewise_linear = .true.
      call add_elastic_side(law, upper, 1.0_wp, part_at_zero_force)
      call add_elastic_side(law, lower, -1.0_wp, part_at_zero_force)
      if (.not. present(inner)) return
      law%branch(branch_open)%stiffness = inner
      where (law%branch%closed) law%branch%offset = law%branch%offset + inner*[(law%edge(i), i=1, size(law%branch))]
   end function new_clearance_law

   !> Let damping b, N s/m (N m s/rad), act in all branches of a law that has none.
   pure subroutine damp_always(law, damping)
      type(clearance_law_t), intent(inout) :: law
      real(wp), intent(in) :: damping

      law%steady_damping = damping
      law%branch%damping = damping
   end subroutine damp_always

   !> Limit the damping of sides that part at zero force by the force of the spring: F = k p + b p' as long as b p' <= k p, and
   !> 2 k p in a branch of its own, in which a contact begins.
   pure subroutine limit_damping(law)
      type(clearance_law_t), intent(inout) :: law

      integer :: closed, f, i

      law%smoothable = .false.
      law%branch = [law%branch, (branch_t(), i=1, 2)]
      law%plain = size(law%branch)
      do closed = branch_upper, branch_lower
         associate (limited => law%branch(closed + to_limit), piece => law%branch(closed))
            if (.not. law%parts(closed)) cycle
            law%functions = law%functions + 1
            f = law%functions
            law%slope(:, f) = [piece%stiffness, -piece%damping]
            law%constant(f) = piece%offset
            limited%name = "limited"//trim(piece%name(len("closed") + 1:))
            limited%closed = .true.
            limited%side = piece%side
            limited%stiffness = 2*piece%stiffness
            limited%offset = 2*piece%offset
            associate (out => -real(piece%side, wp))
               call piece%guard(f)%bound(out, 0.0_wp, closed + to_limit)
               call limited%guard(f)%bound(-out, 0.0_wp, closed)
               call law%branch(branch_open)%guard(1)%bound(-out, law%edge(closed), closed + to_limit)
            end associate
         end associate
      end do
   end subroutine limit_damping

   !> Add levels, at which the stiffness and all forces are those of the law times `factor` (levels): a level for each number of
   !> pairs of teeth in mesh, the first one with `pairs` of them; with 0 of them, for each row of a table, of which it is the last.
   pure subroutine vary_stiffness(law, factor, pairs)
      type(clearance_law_t), intent(inout) :: law
      real(wp), intent(in) :: factor(:)
      integer, intent(in) :: pairs

      type(branch_t) :: varied
      integer :: b, level

      do level = 1, size(factor)
         do b = 1, law%plain
            varied = law%branch(b)
            if (varied%name /= "" .and. pairs == 0) then
               varied%name = trim(varied%name)//", row "//to_text(merge(level - 1, size(factor), level > 1))
            else if (varied%name /= "") then
               varied%name = trim(varied%name)//", "//to_text(pairs + level - 1)// &
                             trim(merge(" pair ", " pairs", pairs + level == 2))//" in mesh"
            end if
            varied%stiffness = factor(level)*varied%stiffness
            varied%damping = law%steady_damping + factor(level)*(varied%damping - law%steady_damping)
            varied%offset = factor(level)*varied%offset
            where (varied%guard%below /= 0) varied%guard%below = varied%guard%below + level*law%plain
            where (varied%guard%above /= 0) varied%guard%above = varied%guard%above + level*law%plain
            law%branch = [law%branch, varied]
         end do
      end do
   end subroutine vary_stiffness

   pure subroutine add_elastic_side(law, side, direction, part_at_zero_force)
      type(clearance_law_t), intent(inout) :: law
      type(clearance_side_t), intent(in) :: side
      real(wp), intent(in) :: direction
      logical, intent(in) :: part_at_zero_force

      integer :: closed

      if (.not. side%present) return
      associate (offset => direction*side%jump - side%stiffness*side%edge)
         if (part_at_zero_force .and. side%damping > 0.0_wp) then
            call add_side(law, direction, side%edge, side%jump > 0.0_wp, closed, [side%stiffness, side%damping], offset)
         else
            call add_side(law, direction, side%edge, .true., closed)
         end if
         law%branch(closed)%stiffness = side%stiffness
         law%branch(closed)%damping = side%damping
         law%branch(closed)%offset = offset
      end associate
   end subroutine add_elastic_side

   !> Stored on the side that is closed, from its edge on, J.
   pure function energy(self, branch, s)
      class(clearance_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      energy = 0.0_wp
      associate (piece => self%branch(branch - merge(to_limit, 0, modulo(branch - 1, self%plain) >= closed_and_parting)), &
                 edge => self%edge(branch))
         if (piece%closed) energy = (s - edge)*(0.5_wp*piece%stiffness*(s + edge) + piece%offset)
      end associate
   end function energy

   !> The force within the clearance and what each side adds to it, switched on by a smoothed step of its penetration.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(clearance_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      associate (unused => normal, open => self%branch(branch_open)%guard(1))
         stiffness = self%branch(branch_open)%stiffness
         force = stiffness*s + self%steady_damping*rate
         damping = self%steady_damping
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
         more%damping = more%damping - self%steady_damping
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
