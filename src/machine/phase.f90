!! Excitation that does not begin at phase zero: F e^{iωt} p with a phasor p of modulus 1 for each tone.
module razy_machine_phase
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: turn_tones

contains

   !> Turn everything that depends on tone t by the phasor p(t) (tones): loads, excitation of contacts and of observables.
   pure subroutine turn_tones(machine, phasor)
      type(machine_t), intent(inout) :: machine
      complex(wp), intent(in) :: phasor(:)

      integer :: j, t

      do t = 1, size(phasor)
         machine%harmonic_load(:, t) = machine%harmonic_load(:, t)*phasor(t)
         do j = 1, size(machine%contact)
            if (.not. allocated(machine%contact(j)%error)) cycle
            machine%contact(j)%error(t) = machine%contact(j)%error(t)*phasor(t)
         end do
         do j = 1, size(machine%observable)
            if (.not. allocated(machine%observable(j)%error)) cycle
            machine%observable(j)%error(t) = machine%observable(j)%error(t)*phasor(t)
         end do
      end do
   end subroutine turn_tones

end module razy_machine_phase
