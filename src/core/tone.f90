!! A tone: one frequency of excitation, and its phase at any time to rounding.
!!
!! Over 1e4 periods the rounding of omega*t alone costs 1e-11 rad. So a tone keeps its frequency in cycles per
!! second as an unevaluated sum of two doubles, multiplies it with a time that is such a sum as well, and
!! subtracts the whole turns before the angle is formed. (Dekker, Numer. Math. 18 (1971) 224–242.)
module razy_core_tone
   use razy_core_kinds, only: qp, wp
   implicit none(type, external)
   private

   public :: tone_t, tone_from_hertz, tone_from_omega, add_time

   !> One frequency of excitation.
   type :: tone_t
      !> Angular frequency, rad/s.
      real(wp) :: omega = 0.0_wp
      !> Frequency in Hz: `hertz + hertz_low`.
      real(wp) :: hertz = 0.0_wp, hertz_low = 0.0_wp
      !> `hertz` in two halves of 26 bits, whose products with such halves are exact.
      real(wp) :: upper = 0.0_wp, lower = 0.0_wp
   contains
      procedure :: phasor
   end type tone_t

   real(wp), parameter :: two_pi = 6.283185307179586476925_wp
   real(wp), parameter :: splitter = 134217729.0_wp

contains

   !> The tone of `hertz` cycles per second, given in extended precision so that a tooth frequency such as
   !> teeth * rpm / 60 is not rounded on the way.
   elemental function tone_from_hertz(hertz) result(tone)
      real(qp), intent(in) :: hertz
      type(tone_t) :: tone

      tone%hertz = real(hertz, wp)
      tone%hertz_low = real(hertz - real(tone%hertz, qp), wp)
      tone%omega = real(2*acos(-1.0_qp)*hertz, wp)
      call split(tone%hertz, tone%upper, tone%lower)
   end function tone_from_hertz

   !> The tone of angular frequency `omega`, rad/s.
   elemental function tone_from_omega(omega) result(tone)
      real(wp), intent(in) :: omega
      type(tone_t) :: tone

      tone = tone_from_hertz(real(omega, qp)/(2*acos(-1.0_qp)))
      tone%omega = omega
   end function tone_from_omega

   !> Cosine and sine of 2 pi f t at the time `time + time_low`, s, right to rounding however many turns that is.
   pure subroutine phasor(self, time, time_low, cosine, sine)
      class(tone_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      real(wp), intent(out) :: cosine, sine

      real(wp) :: turns, rest, time_upper, time_lower, angle

      call split(time, time_upper, time_lower)
      turns = self%hertz*time
      rest = ((self%upper*time_upper - turns) + self%upper*time_lower + self%lower*time_upper) + self%lower*time_lower
      rest = rest + self%hertz*time_low + self%hertz_low*time
      angle = two_pi*((turns - anint(turns)) + rest)
      cosine = cos(angle)
      sine = sin(angle)
   end subroutine phasor

   !> Add `step` to the time `time + time_low`, s, keeping what rounding would lose (two-sum).
   elemental subroutine add_time(time, time_low, step)
      real(wp), intent(inout) :: time, time_low
      real(wp), intent(in) :: step

      real(wp) :: total, part, rest

      total = time + step
      part = total - time
      rest = (time - (total - part)) + (step - part) + time_low
      time = total + rest
      time_low = rest - (time - total)
   end subroutine add_time

   elemental subroutine split(value, upper, lower)
      real(wp), intent(in) :: value
      real(wp), intent(out) :: upper, lower

      real(wp) :: scaled

      scaled = splitter*value
      upper = scaled - (scaled - value)
      lower = value - upper
   end subroutine split

end module razy_core_tone
