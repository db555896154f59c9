!! A Jenkins element: a spring and a slider in series, both without mass (Jenkin, 1922; sums of them are Iwan's models).
!!
!! The variable s is the stretch of the spring. While the slider sticks F = k s; where |F| comes to its limit it slides with
!! F = ±limit, until s' changes its sign. Where the slider then stands is what the law remembers: s is counted anew from there.
module razy_contact_jenkins_law
   use razy_contact_contact_law, only: contact_law_t, guard_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: jenkins_law_t, new_jenkins_law

   !> Switching functions: s and s'.
   type, extends(contact_law_t) :: jenkins_law_t
   contains
      procedure :: energy
   end type jenkins_law_t

   integer, parameter :: sticking = 1, forward = 2, backward = 3

contains

   !> A law from its stiffness, N/m, and the force at which it slides, N, both positive, and the damping beside both, N s/m.
   pure function new_jenkins_law(stiffness, limit, damping) result(law)
      real(wp), intent(in) :: stiffness, limit, damping
      type(jenkins_law_t) :: law

      law%piecewise_linear = .true.
      law%remembers = .true.
      law%smoothable = .false.
      law%functions = 2
      law%slope(:, 1) = [1.0_wp, 0.0_wp]
      law%slope(:, 2) = [0.0_wp, 1.0_wp]
      law%plain = 3
      allocate (law%branch(3))
      law%branch%closed = .true.
      law%branch%damping = damping
      law%branch%name = [character(16) :: "sticking", "sliding forward", "sliding backward"]
      law%branch(sticking)%stiffness = stiffness
      law%branch(sticking)%guard(1) = guard_t(-limit/stiffness, limit/stiffness, backward, forward)
      law%branch(forward)%offset = limit
      law%branch(forward)%guard(2) = guard_t(lower=0.0_wp, below=sticking)
      law%branch(backward)%offset = -limit
      law%branch(backward)%guard(2) = guard_t(upper=0.0_wp, above=sticking)
   end function new_jenkins_law

   !> In the spring, J.
   pure function energy(self, branch, s)
      class(jenkins_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      energy = 0.5_wp*self%branch(sticking)%stiffness*merge(s, self%branch(sticking)%guard(1)%upper, branch == sticking)**2
   end function energy

end module razy_contact_jenkins_law
