!! The period of a machine's excitation.
module razy_machine_excitation
   use razy_core_kinds, only: wp
   use razy_core_tone, only: tone_t
   use razy_machine_machine, only: machine_t
   use razy_machine_period, only: common_period
   implicit none(type, external)
   private

   public :: excitation_period

contains

   !> The shortest time after which all tones that act on the machine are back in phase, s; 0 if there are none, or no such time.
   pure function excitation_period(machine) result(period)
      type(machine_t), intent(in) :: machine
      real(wp) :: period

      type(tone_t), allocatable :: acting(:)
      logical :: acts(size(machine%tone))
      integer :: j, t

      do t = 1, size(acts)
         acts(t) = any(abs(machine%harmonic_load(:, t)) > 0.0_wp)
         do j = 1, size(machine%contact)
            acts(t) = acts(t) .or. abs(machine%contact(j)%error(t)) > 0.0_wp
         end do
         acts(t) = acts(t) .and. machine%tone(t)%hertz > 0.0_wp
      end do
      acting = pack(machine%tone, acts)
      period = common_period(acting)
   end function excitation_period

end module razy_machine_excitation
