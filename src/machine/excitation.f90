!! The period of what acts on a machine.
module razy_machine_excitation
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: machine_t
   use razy_machine_period, only: excitation_period
   implicit none(type, external)
   private

   public :: period_of_loads

contains

   !> Common period of the tones that act on the machine, s; 0 if there is none. A tone without amplitude does not count.
   pure function period_of_loads(machine) result(period)
      type(machine_t), intent(in) :: machine
      real(wp) :: period

      logical :: acts(size(machine%tone))
      integer :: j, t

      do t = 1, size(acts)
         acts(t) = any(abs(machine%harmonic_load(:, t)) > 0.0_wp)
         do j = 1, size(machine%contact)
            acts(t) = acts(t) .or. abs(machine%contact(j)%error(t)) > 0.0_wp
         end do
         acts(t) = acts(t) .and. machine%tone(t)%hertz > 0.0_wp
      end do
      period = excitation_period(pack(machine%tone, acts))
   end function period_of_loads

end module razy_machine_excitation
