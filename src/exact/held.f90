!! What contacts that hold constraints bring into the closed form of a mode: the speeds with which what is held is driven, its
!! errors, its forces and the friction under these (razy_exact_constrained_motion).
module razy_exact_held
   use razy_core_kinds, only: wp
   use razy_exact_constrained_motion, only: constrained_motion_t
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: add_reactions, coefficients, drives, errors_of

contains

   !> Speeds with which what is held is driven (constraints).
   pure function drives(system, mode) result(drive)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp) :: drive(mode%constraints%count)

      integer :: i

      drive = [(system%machine%contact(mode%constraints%contact(i))%drive, i=1, size(drive))]
   end function drives

   !> Coefficients of the friction that constraints press (couplings).
   pure function coefficients(system, mode) result(phi)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp) :: phi(mode%constraints%couplings)

      integer :: i

      do i = 1, size(phi)
         associate (j => mode%constraints%sliding(i))
            phi(i) = system%machine%contact(j)%law%branch(mode%branch(j))%offset
         end associate
      end do
   end function coefficients

   !> Phasors of the errors of what is held (n, tones).
   pure function errors_of(system, constrained) result(error)
      type(system_t), intent(in) :: system
      type(constrained_motion_t), intent(in) :: constrained
      complex(wp) :: error(constrained%n, size(system%omega))

      integer :: i

      do i = 1, constrained%n
         error(i, :) = system%machine%contact(constrained%contact(i))%error
      end do
   end function errors_of

   !> Add constraint forces, and the friction under them, to the forces of all contacts; load (m) and phasors (m, tones) are
   !> those of the mode without constraints.
   subroutine add_reactions(constrained, system, mode, load, harmonic, force)
      type(constrained_motion_t), intent(in) :: constrained
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp), intent(in) :: load(:)
      complex(wp), intent(in) :: harmonic(:, :)
      type(linear_form_t), intent(inout) :: force(:)

      real(wp) :: k(system%m, system%m), b(system%m, system%m)
      integer :: i

      call mode%matrices(system, k, b)
      do i = 1, constrained%n
         force(constrained%contact(i)) = constrained%reaction(i, k, b, load, harmonic, errors_of(system, constrained), &
                                                              system%turning)
      end do
      do i = 1, size(constrained%sliding)
         call force(constrained%sliding(i))%add(constrained%share(i), force(constrained%contact(constrained%row(i))))
      end do
   end subroutine add_reactions

end module razy_exact_held
