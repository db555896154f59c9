!! The excitation of a machine along a smooth piece of motion: the phasors of its tones, right to rounding at the start of the
!! piece however long the motion has lasted (razy_core_tone), and turned from there to any time of it.
module razy_hybrid_excitation
   use razy_core_kinds, only: pi, wp
   use razy_core_tone, only: tone_t
   use razy_core_waveform, only: along
   implicit none(type, external)
   private

   public :: excitation_t

   !> e^{iφ} (tones) at the start of the piece, and the phasors E at the time `tau` looked at last, s after it.
   type :: excitation_t
      complex(wp), allocatable :: start(:), phasor(:)
      !> How what ramps bends from the start on (tones).
      complex(wp), allocatable, private :: bend(:)
      !> What tones have been shifted by (tones); not allocated where none has.
      complex(wp), allocatable, private :: shifted(:)
      real(wp), private :: time = 0.0_wp, tau = 0.0_wp
   contains
      procedure :: begin
      procedure :: look
      procedure :: shift
      procedure :: shift_like
      procedure :: rate
      procedure :: turning
      procedure :: now
   end type excitation_t

   !> Angle, rad, up to which the series of cosine and sine that `look` takes are right to rounding.
   real(wp), parameter :: small = 0.08_wp

contains

   !> A piece begins at `time + time_low`, s.
   pure subroutine begin(self, tone, time, time_low)
      class(excitation_t), intent(inout) :: self
      type(tone_t), contiguous, intent(in) :: tone(:)
      real(wp), intent(in) :: time, time_low

      integer :: t

      if (allocated(self%start)) then
         if (size(self%start) /= size(tone)) deallocate (self%start, self%phasor, self%bend)
      end if
      if (.not. allocated(self%start)) allocate (self%start(size(tone)), self%phasor(size(tone)), self%bend(size(tone)))
      do t = 1, size(tone)
         self%start(t) = tone(t)%excitation(time, time_low)
         self%bend(t) = (0.0_wp, 0.0_wp)
         if (tone(t)%bends()) self%bend(t) = tone(t)%waveform%bend(time, time_low)
      end do
      if (allocated(self%shifted)) self%start = self%start + self%shifted
      self%time = time
      self%tau = -1.0_wp
   end subroutine begin

   !> Shift tone number t, a waveform that stands still, from now on.
   pure subroutine shift(self, t, by)
      class(excitation_t), intent(inout) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: by

      if (.not. allocated(self%shifted)) allocate (self%shifted(size(self%start)), source=(0.0_wp, 0.0_wp))
      self%shifted(t) = self%shifted(t) + by
      self%start(t) = self%start(t) + by
      self%phasor(t) = self%phasor(t) + by
   end subroutine shift

   !> Be shifted as another excitation is, from the next piece on.
   pure subroutine shift_like(self, other)
      class(excitation_t), intent(inout) :: self
      type(excitation_t), intent(in) :: other

      if (allocated(self%shifted)) deallocate (self%shifted)
      if (allocated(other%shifted)) self%shifted = other%shifted
   end subroutine shift_like

   !> Look at the time `tau` of the piece, whose tones are still these.
   pure subroutine look(self, tone, tau)
      class(excitation_t), intent(inout) :: self
      type(tone_t), contiguous, intent(in) :: tone(:)
      real(wp), intent(in) :: tau

      complex(wp) :: phasor(0:2)
      real(wp) :: angle, cosine, sine, square
      integer :: t

      if (.not. abs(tau - self%tau) > 0.0_wp) return
      self%tau = tau
      if (.not. abs(tau) > 0.0_wp) self%phasor(:) = self%start
      do t = 1, size(tone)
         if (tone(t)%is_swept()) then
            phasor = swept_phasors(self, tone(t), t)
            self%phasor(t) = phasor(0)
         else if (tone(t)%ramps()) then
            self%phasor(t) = along(self%start(t), self%bend(t), tone(t)%omega*tau)
         else if (abs(tau) > 0.0_wp) then
            angle = tone(t)%omega*tau
            if (abs(angle) <= small) then
               square = angle**2
               cosine = 1 - square*(0.5_wp - square*(1.0_wp/24 - square*(1.0_wp/720 - square*(1.0_wp/40320))))
               sine = angle*(1 - square*(1.0_wp/6 - square*(1.0_wp/120 - square*(1.0_wp/5040 - square*(1.0_wp/362880)))))
            else
               cosine = cos(angle)
               sine = sin(angle)
            end if
            associate (e => self%start(t))
               self%phasor(t) = cmplx(e%re*cosine - e%im*sine, e%re*sine + e%im*cosine, wp)
            end associate
         end if
      end do
   end subroutine look

   !> A derivative by time, of a swept tone at most the second, of Re Σ_t c_t E_t (tones) at the time looked at last.
   pure function rate(self, tone, coefficient, derivative)
      class(excitation_t), intent(in) :: self
      type(tone_t), contiguous, intent(in) :: tone(:)
      complex(wp), intent(in) :: coefficient(:)
      integer, intent(in) :: derivative
      real(wp) :: rate

      complex(wp) :: phasor(0:2)
      real(wp) :: line(3)
      integer :: t

      rate = 0.0_wp
      do t = 1, size(tone)
         associate (c => coefficient(t), e => self%phasor(t), omega => tone(t)%omega)
            if (.not. max(abs(c%re), abs(c%im)) > 0.0_wp) cycle
            if (tone(t)%is_swept()) then
               phasor = swept_phasors(self, tone(t), t)
               rate = rate + real(c*phasor(derivative), wp)
            else if (tone(t)%ramps()) then
               line = [e%im, 2*self%bend(t)%re + 6*omega*self%tau*self%bend(t)%im, 6*self%bend(t)%im]
               if (derivative <= 3) rate = rate + omega**derivative*c%re*line(derivative)
            else if (derivative == 1) then
               rate = rate - omega*(c%re*e%im + c%im*e%re)
            else if (derivative == 2) then
               rate = rate - omega**2*(c%re*e%re - c%im*e%im)
            else
               rate = rate + omega**derivative*real((0.0_wp, 1.0_wp)**derivative*c*e, wp)
            end if
         end associate
      end do
   end function rate

   !> E of tone number t at the time looked at last, and its first and second derivative.
   pure function turning(self, tone, t) result(phasor)
      class(excitation_t), intent(in) :: self
      type(tone_t), contiguous, intent(in) :: tone(:)
      integer, intent(in) :: t
      complex(wp) :: phasor(0:2)

      phasor = self%phasor(t)*cmplx([1.0_wp, 0.0_wp, -tone(t)%omega**2], [0.0_wp, tone(t)%omega, 0.0_wp], wp)
      if (tone(t)%is_swept()) phasor = swept_phasors(self, tone(t), t)
   end function turning

   !> The same of a swept tone.
   pure function swept_phasors(self, tone, t) result(phasor)
      type(excitation_t), intent(in) :: self
      type(tone_t), intent(in) :: tone
      integer, intent(in) :: t
      complex(wp) :: phasor(0:2)

      real(wp) :: angle

      angle = 2*pi*(tone%hertz + tone%sweep*(self%time + 0.5_wp*self%tau))*self%tau
      phasor = tone%swept(self%now(), self%start(t)*cmplx(cos(angle), sin(angle), wp))
   end function swept_phasors

   !> The time looked at last, s.
   pure function now(self) result(time)
      class(excitation_t), intent(in) :: self
      real(wp) :: time

      time = self%time + self%tau
   end function now

end module razy_hybrid_excitation
