!! The period of the excitation: the shortest time after which all tones are back in phase.
module razy_machine_period
   use razy_core_kinds, only: wp
   use razy_core_tone, only: tone_t
   implicit none(type, external)
   private

   public :: common_period

   !> The period is looked for up to so many periods of the first tone.
   integer, parameter :: most_turns = 1000
   !> Turns that are whole within this are whole: the rounding of a frequency over so many turns, with room.
   real(wp), parameter :: rounding = 64*most_turns*epsilon(1.0_wp)

contains

   !> Period, s; 0 if there is no tone, or no common period.
   pure real(wp) function common_period(tone) result(period)
      type(tone_t), intent(in) :: tone(:)

      real(wp) :: turns(size(tone))
      integer :: k

      period = 0.0_wp
      if (size(tone) == 0) return
      do k = 1, most_turns
         turns = k*(tone%hertz/tone(1)%hertz)
         if (any(abs(turns - anint(turns)) > rounding*max(1.0_wp, turns/k))) cycle
         period = k/tone(1)%hertz
         return
      end do
   end function common_period

end module razy_machine_period
