!! What the Moreau–Jean scheme holds, and a machine's contacts as it sees them: rigid sides, friction elements, compliant laws.
!!
!! A rigid side is a gap g = direction (s - edge) >= 0 with the velocity u = direction s'; one contact may have two. A friction
!! element has a set-valued force against its sliding velocity s'. All other laws are forces that depend on s and s'.
module razy_moreau_state
   use razy_contact_friction_law, only: branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_linalg_complementarity_impact, only: impact_problem_t
   use razy_machine_machine, only: contact_t, machine_t
   implicit none(type, external)
   private

   public :: contact_kinds_t, excitation_t, excite, friction_coefficient, moreau_step_t, new_contact_kinds
   public :: new_impulse_work, rigid_side_t

   !> One side of a rigid contact: its number in the machine, which side, and the branch of the law when it is closed.
   type :: rigid_side_t
      integer :: contact = 0, closed = 0
      real(wp) :: direction = 0.0_wp, edge = 0.0_wp, restitution = 0.0_wp
   end type rigid_side_t

   !> Contacts by kind: rigid sides, and numbers of the friction elements and of the compliant contacts.
   type :: contact_kinds_t
      type(rigid_side_t), allocatable :: side(:)
      integer, allocatable :: friction(:), compliant(:)
      !> Whether all compliant laws are affine in each branch.
      logical :: piecewise_linear = .true.
   end type contact_kinds_t

   !> What changes with time alone: loads (n), parts of s and s' of all contacts (with offset and drive).
   type :: excitation_t
      real(wp), allocatable :: load(:), s(:), rate(:)
   end type excitation_t

   !> The problem of impulses, kept from step to step: directions are those of the sides `active`, then all friction elements.
   type :: impulse_work_t
      type(impact_problem_t) :: problem
      !> Sides that take part (the first `count`), and those of which `problem` is.
      integer :: count = 0
      integer, allocatable :: active(:), listed(:)
      !> Of each direction: contact, sign and impulse.
      integer, allocatable :: contact(:)
      real(wp), allocatable :: sign(:), impulse(:)
      !> Factorisation of which the matrix of the problem is.
      integer(i8) :: factorisation = -1
   end type impulse_work_t

   !> The scheme with its machine, the state at both ends of the last step, and the matrices of its equations.
   type :: moreau_step_t
      type(machine_t) :: machine
      type(contact_kinds_t) :: kinds
      real(wp) :: theta = 0.5_wp, h = 0.0_wp
      !> Directions of all contacts (n, contacts).
      real(wp), allocatable :: w(:, :)
      !> Displacements and velocities (n) at the start and at the end of the step.
      real(wp), allocatable :: q0(:), v0(:), q1(:), v1(:)
      !> Of each contact: branch and force F at start and end; impulse along w in the step, and the largest one
      !> that friction can give; excitation at start, θ and end (allocatable: below a polymorphic object gfortran 12 frees only the
      !> first of components of one type).
      integer, allocatable :: branch0(:), branch1(:)
      real(wp), allocatable :: force0(:), force1(:), impulse(:), bound(:)
      type(excitation_t), allocatable :: start, inner, finish
      type(impulse_work_t) :: work
      !> Slopes of the compliant laws and step of which `factor` (n, n) is; factor⁻¹ w and wᵀ factor⁻¹ w of all contacts.
      real(wp), allocatable :: stiffness(:), damping(:), factor(:, :), response(:, :), delassus(:, :)
      integer, allocatable :: pivot(:)
      real(wp) :: h_of_factor = -1.0_wp
      integer(i8) :: rounds = 0, factorisations = 0, impacts = 0
   end type moreau_step_t

contains

   !> Sort the contacts of a machine.
   pure subroutine new_contact_kinds(kinds, machine)
      type(contact_kinds_t), intent(out) :: kinds
      type(machine_t), intent(in) :: machine

      integer :: j

      allocate (kinds%side(0), kinds%friction(0), kinds%compliant(0))
      do j = 1, size(machine%contact)
         associate (law => machine%contact(j)%law, open => machine%contact(j)%law%branch(branch_open)%guard(1))
            if (law%impacts) then
               if (open%below /= 0) kinds%side = [kinds%side, rigid_side_t(j, open%below, 1.0_wp, open%lower, law%restitution)]
               if (open%above /= 0) kinds%side = [kinds%side, rigid_side_t(j, open%above, -1.0_wp, open%upper, law%restitution)]
            else if (law%of_normal) then
               kinds%friction = [kinds%friction, j]
            else
               kinds%compliant = [kinds%compliant, j]
               kinds%piecewise_linear = kinds%piecewise_linear .and. law%piecewise_linear
            end if
         end associate
      end do
   end subroutine new_contact_kinds

   !> Room for any set of active sides.
   pure subroutine new_impulse_work(work, kinds)
      type(impulse_work_t), intent(out) :: work
      type(contact_kinds_t), intent(in) :: kinds

      integer :: most

      most = size(kinds%side) + size(kinds%friction)
      allocate (work%active(size(kinds%side)), work%listed(size(kinds%side)), work%contact(most), source=0)
      allocate (work%sign(most), work%impulse(most), source=0.0_wp)
   end subroutine new_impulse_work

   !> Loads and excitation of the contacts `tau` after the time `time + time_low`, s.
   pure subroutine excite(machine, time, time_low, tau, now)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: time, time_low, tau
      type(excitation_t), intent(inout) :: now

      complex(wp) :: turn
      real(wp) :: at, at_low, cosine, sine
      integer :: j, t

      at = time
      at_low = time_low
      call add_time(at, at_low, tau)
      now%load = machine%load
      now%s = machine%contact%offset
      now%rate = machine%contact%drive
      do t = 1, size(machine%tone)
         call machine%tone(t)%phasor(at, at_low, cosine, sine)
         turn = cmplx(cosine, sine, wp)
         now%load = now%load + real(machine%harmonic_load(:, t)*turn)
         do j = 1, size(machine%contact)
            now%s(j) = now%s(j) + real(machine%contact(j)%error(t)*turn)
            now%rate(j) = now%rate(j) - machine%tone(t)%omega*aimag(machine%contact(j)%error(t)*turn)
         end do
      end do
   end subroutine excite

   !> Coefficient of friction of an element that is in `branch` and slides with `rate`: the static one where it sticks.
   pure function friction_coefficient(contact, branch, rate) result(coefficient)
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: branch
      real(wp), intent(in) :: rate
      real(wp) :: coefficient

      if (branch == branch_sticking) then
         coefficient = contact%law%branch(branch_sticking)%force_guard%upper
      else
         coefficient = contact%law%force(branch_forward, 0.0_wp, abs(rate), 1.0_wp)
      end if
   end function friction_coefficient

end module razy_moreau_state
