!! The excitation of a machine along a smooth piece of motion: the phasors of its tones, right to rounding at the start of the
!! piece however long the motion has lasted (razy_core_tone), and turned from there to any time of it.
module razy_hybrid_excitation
   use razy_core_kinds, only: pi, wp
   use razy_core_tone, only: tone_t
   implicit none(type, external)
   private

   public :: excitation_t

   !> e^{iφ} (tones) at the start of the piece, and phasors E with their first and second derivatives by time at the time `tau`
   !> looked at last, s after it.
   type :: excitation_t
      complex(wp), allocatable :: start(:), phasor(:), rate(:), bend(:)
      type(tone_t), allocatable, private :: tone(:)
      real(wp), private :: time = 0.0_wp, tau = 0.0_wp
   contains
      procedure :: begin
      procedure :: look
      procedure :: now
   end type excitation_t

contains

   !> A piece begins at `time + time_low`, s.
   pure subroutine begin(self, tone, time, time_low)
      class(excitation_t), intent(inout) :: self
      type(tone_t), intent(in) :: tone(:)
      real(wp), intent(in) :: time, time_low

      real(wp) :: cosine, sine
      integer :: t

      if (allocated(self%start)) then
         if (size(self%start) /= size(tone)) deallocate (self%start, self%phasor, self%rate, self%bend)
      end if
      if (.not. allocated(self%start)) allocate (self%start(size(tone)), self%phasor(size(tone)), &
                                                 self%rate(size(tone)), self%bend(size(tone)))
      do t = 1, size(tone)
         call tone(t)%phasor(time, time_low, cosine, sine)
         self%start(t) = cmplx(cosine, sine, wp)
      end do
      self%tone = tone
      self%time = time
      self%tau = -1.0_wp
   end subroutine begin

   !> Look at the time `tau` of the piece.
   pure subroutine look(self, tau)
      class(excitation_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      complex(wp) :: turn
      real(wp) :: angle
      integer :: t

      if (.not. abs(tau - self%tau) > 0.0_wp) return
      self%tau = tau
      do t = 1, size(self%tone)
         associate (tone => self%tone(t))
            turn = self%start(t)
            if (abs(tau) > 0.0_wp) then
               angle = tone%omega*tau
               if (tone%is_swept()) angle = 2*pi*(tone%hertz + tone%sweep*(self%time + 0.5_wp*tau))*tau
               turn = turn*cmplx(cos(angle), sin(angle), wp)
            end if
            call tone%look(self%time + tau, turn, self%phasor(t), self%rate(t), self%bend(t))
         end associate
      end do
   end subroutine look

   !> The time looked at last, s.
   pure function now(self) result(time)
      class(excitation_t), intent(in) :: self
      real(wp) :: time

      time = self%time + self%tau
   end function now

end module razy_hybrid_excitation
