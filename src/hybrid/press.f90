!! The signs of the forces of compliant contacts that press friction: within a mode each stays as it is, so that its equations are
!! linear, and where it would change is a guard.
module razy_hybrid_press
   use razy_core_kinds, only: wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: choose_press, may_pull

contains

   !> Choose the signs of the mode that begins at (tau, z).
   subroutine choose_press(dynamics, system, tau, z)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      real(wp) :: a(system%m), force
      integer :: by, j
      logical :: pushes_up

      do j = 1, size(dynamics%mode%press)
         dynamics%mode%press(j) = 0
         by = system%machine%contact(j)%normal_of
         if (by == 0) cycle
         associate (law => system%machine%contact(by)%law, branch => dynamics%mode%branch(by))
            if (law%branch(branch)%constraint .or. .not. law%piecewise_linear) cycle
            if (may_pull(system, dynamics%mode, j)) then
               call dynamics%excitation%look(system%machine%tone, tau)
               call dynamics%look_at_contact(system, by, z)
               force = law%force(branch, dynamics%s(by), dynamics%rate(by), 0.0_wp)
               if (.not. abs(force) > 0.0_wp) then
                  ! At rest without a force: the sign that it will have.
                  call dynamics%accelerate(system, tau, z, a)
                  force = law%branch(branch)%stiffness*dynamics%rate(by) &
                          + law%branch(branch)%damping*dynamics%second_rate(system, by, a)
               end if
               pushes_up = force > 0.0_wp
            else
               ! The sign of its side, also where it comes to press at zero force.
               pushes_up = law%branch(branch)%side > 0
            end if
            dynamics%mode%press(j) = merge(1, -1, pushes_up)
         end associate
      end do
   end subroutine choose_press

   !> Whether the force that presses friction element j may change its sign: that of a damped contact which does not part there.
   pure function may_pull(system, mode, j)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      integer, intent(in) :: j
      logical :: may_pull

      may_pull = .false.
      associate (by => system%machine%contact(j)%normal_of)
         if (by == 0) return
         associate (law => system%machine%contact(by)%law, branch => mode%branch(by))
            may_pull = law%piecewise_linear .and. law%branch(branch)%damping > 0.0_wp .and. .not. law%branch(branch)%constraint &
                       .and. .not. law%parts(branch)
         end associate
      end associate
   end function may_pull

end module razy_hybrid_press
