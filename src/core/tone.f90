!! A tone: one frequency of excitation, and its phase at any time to rounding; or a waveform (razy_core_waveform).
!!
!! Over 1e4 periods the rounding of omega*t alone costs 1e-11 rad. So a tone keeps its frequency in cycles per
!! second as an unevaluated sum of two doubles, multiplies it with a time that is such a sum as well, and
!! subtracts the whole turns before the angle is formed. (Dekker, Numer. Math. 18 (1971) 224–242.)
!!
!! A swept tone has a frequency that changes at a constant rate, φ = 2π(f t + r t²/2). Such tones come in threes, e^{iφ} and its
!! first and second derivative by time, the derivatives over the power of `omega` that makes their moduli about 1: what is
!! proportional to a speed or an acceleration then has constant coefficients, too.
module razy_core_tone
   use razy_core_kinds, only: qp, wp
   use razy_core_waveform, only: waveform_t
   implicit none(type, external)
   private

   public :: tone_t, tone_from_hertz, tone_from_waveform, add_time, jumps_until, rate_of, swept_tones, time_to_break

   !> One frequency of excitation.
   type :: tone_t
      !> Angular frequency, rad/s; of a swept tone the largest of the motion.
      real(wp) :: omega = 0.0_wp
      !> Frequency in Hz: `hertz + hertz_low`; of a swept tone that at time 0.
      real(wp) :: hertz = 0.0_wp, hertz_low = 0.0_wp
      !> `hertz` in two halves of 26 bits, whose products with such halves are exact.
      real(wp) :: upper = 0.0_wp, lower = 0.0_wp
      !> Rate of the frequency, Hz/s, and which derivative of e^{iφ} a swept tone is.
      real(wp) :: sweep = 0.0_wp
      integer :: derivative = 0
      !> What acts instead of e^{iφ}; `hertz` is then the frequency with which it comes again, 0 if it does not.
      type(waveform_t), allocatable :: waveform
   contains
      procedure :: is_swept
      procedure :: ramps
      procedure :: bends
      procedure :: phasor
      procedure :: excitation
      procedure :: moved
      procedure :: swept
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

   !> The tone that a waveform is.
   pure function tone_from_waveform(waveform) result(tone)
      type(waveform_t), intent(in) :: waveform
      type(tone_t) :: tone

      tone = tone_from_hertz(waveform%hertz)
      tone%omega = waveform%omega
      tone%waveform = waveform
   end function tone_from_waveform

   !> The three tones of the frequency hertz + sweep t, Hz, in a motion that ends at `t_end`, s.
   pure function swept_tones(hertz, sweep, t_end) result(tones)
      real(qp), intent(in) :: hertz, sweep
      real(wp), intent(in) :: t_end
      type(tone_t) :: tones(3)

      tones = tone_from_hertz(hertz)
      tones%sweep = real(sweep, wp)
      tones%omega = two_pi*real(max(abs(hertz), abs(hertz + sweep*t_end)), wp)
      tones%derivative = [0, 1, 2]
   end function swept_tones

   elemental logical function is_swept(self)
      class(tone_t), intent(in) :: self

      is_swept = abs(self%sweep) > 0.0_wp
   end function is_swept

   !> Whether E does not turn but is a straight line between breaks.
   elemental logical function ramps(self)
      class(tone_t), intent(in) :: self

      ramps = .false.
      if (allocated(self%waveform)) ramps = self%waveform%ramps
   end function ramps

   !> Whether it is such a line that bends.
   elemental logical function bends(self)
      class(tone_t), intent(in) :: self

      bends = .false.
      if (self%ramps()) bends = self%waveform%curved
   end function bends

   !> The coefficients of df/dt for those of f = Re Σ_t c_t E_t (tones), which has no second derivative of a swept e^{iφ}.
   pure function rate_of(tone, coefficient) result(rate)
      type(tone_t), intent(in) :: tone(:)
      complex(wp), intent(in) :: coefficient(:)
      complex(wp) :: rate(size(tone))

      integer :: t

      rate = cmplx(0.0_wp, tone%omega, wp)*coefficient
      where (tone%is_swept()) rate = (0.0_wp, 0.0_wp)
      where (tone%ramps()) rate = cmplx(0.0_wp, -tone%omega*real(coefficient), wp)
      do t = 2, size(tone)
         if (tone(t)%is_swept() .and. tone(t)%derivative > 0) rate(t) = tone(t)%omega*coefficient(t - 1)
      end do
   end function rate_of

   !> E, dE/dt and d²E/dt² of a swept tone at `time`, s, where e^{iφ} is `turn`.
   pure function swept(self, time, turn) result(phasor)
      class(tone_t), intent(in) :: self
      real(wp), intent(in) :: time
      complex(wp), intent(in) :: turn
      complex(wp) :: phasor(0:2)

      complex(wp) :: derivative(0:4)
      real(wp) :: change, omega

      omega = two_pi*(self%hertz + self%sweep*time)
      change = two_pi*self%sweep
      derivative = turn*[(1.0_wp, 0.0_wp), cmplx(0.0_wp, omega, wp), cmplx(-omega**2, change, wp), &
                         cmplx(-3*omega*change, -omega**3, wp), cmplx(omega**4 - 3*change**2, -6*omega**2*change, wp)]
      phasor = derivative(self%derivative:self%derivative + 2)/self%omega**self%derivative
   end function swept

   !> Cosine and sine of φ, 2 pi f t without sweep, at the time `time + time_low`, s, right to rounding however many turns that is.
   pure subroutine phasor(self, time, time_low, cosine, sine)
      class(tone_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      real(wp), intent(out) :: cosine, sine

      real(wp) :: turns, rest, time_upper, time_lower, angle

      if (self%is_swept()) then
         associate (t => real(time, qp) + time_low)
            angle = two_pi*fraction_of((real(self%hertz, qp) + self%hertz_low + 0.5_qp*self%sweep*t)*t)
         end associate
         cosine = cos(angle)
         sine = sin(angle)
         return
      end if
      call split(time, time_upper, time_lower)
      turns = self%hertz*time
      rest = ((self%upper*time_upper - turns) + self%upper*time_lower + self%lower*time_upper) + self%lower*time_lower
      rest = rest + self%hertz*time_low + self%hertz_low*time
      angle = two_pi*((turns - anint(turns)) + rest)
      cosine = cos(angle)
      sine = sin(angle)
   end subroutine phasor

   !> E at the time `time + time_low`, s; of a waveform at a break what follows it.
   pure function excitation(self, time, time_low)
      class(tone_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      complex(wp) :: excitation

      real(wp) :: cosine, sine

      if (allocated(self%waveform)) then
         excitation = self%waveform%phasor(time, time_low)
      else
         call self%phasor(time, time_low, cosine, sine)
         excitation = cmplx(cosine, sine, wp)
      end if
   end function excitation

   !> E of a tone that is not swept, `tau` s after it was `from`, no break between.
   elemental function moved(self, from, tau)
      class(tone_t), intent(in) :: self
      complex(wp), intent(in) :: from
      real(wp), intent(in) :: tau
      complex(wp) :: moved

      associate (angle => self%omega*tau)
         if (self%ramps()) then
            moved = cmplx(from%re + angle*from%im, from%im, wp)
         else
            moved = from*cmplx(cos(angle), sin(angle), wp)
         end if
      end associate
   end function moved

   !> The time from `time + time_low` to the next break of a waveform, s.
   pure function time_to_break(tone, time, time_low) result(rest)
      type(tone_t), intent(in) :: tone(:)
      real(wp), intent(in) :: time, time_low
      real(wp) :: rest

      integer :: t

      rest = huge(rest)
      do t = 1, size(tone)
         if (allocated(tone(t)%waveform)) rest = min(rest, tone(t)%waveform%rest(time, time_low))
      end do
   end function time_to_break

   !> How many jumps of waveforms that come again there are up to a time, s.
   pure integer function jumps_until(tone, time) result(jumps)
      type(tone_t), intent(in) :: tone(:)
      real(wp), intent(in) :: time

      integer :: t

      jumps = 0
      do t = 1, size(tone)
         if (allocated(tone(t)%waveform)) jumps = jumps + tone(t)%waveform%jumps_until(time)
      end do
   end function jumps_until

   !> Turns less the whole ones.
   elemental function fraction_of(turns) result(rest)
      real(qp), intent(in) :: turns
      real(wp) :: rest

      rest = real(turns - anint(turns), wp)
   end function fraction_of

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
