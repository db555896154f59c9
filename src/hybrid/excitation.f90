!! The excitation of a machine along a smooth piece of motion: the phasors of its tones, right to rounding at the start of the
!! piece however long the motion has lasted (razy_core_tone), and turned from there to any time of it.
module razy_hybrid_excitation
   use razy_core_kinds, only: wp
   use razy_core_tone, only: tone_t
   implicit none(type, external)
   private

   public :: excitation_t

   !> Phasors e^{iφ} (tones) at the start of the piece, and at the time `tau` looked at last, s after it.
   type :: excitation_t
      complex(wp), allocatable :: start(:), phasor(:)
      real(wp), private :: tau = 0.0_wp
   contains
      procedure :: begin
      procedure :: look
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
         if (size(self%start) /= size(tone)) deallocate (self%start, self%phasor)
      end if
      if (.not. allocated(self%start)) allocate (self%start(size(tone)), self%phasor(size(tone)))
      do t = 1, size(tone)
         call tone(t)%phasor(time, time_low, cosine, sine)
         self%start(t) = cmplx(cosine, sine, wp)
      end do
      self%tau = -1.0_wp
   end subroutine begin

   !> Look at the time `tau` of the piece; `omega` (tones), rad/s.
   pure subroutine look(self, omega, tau)
      class(excitation_t), intent(inout) :: self
      real(wp), intent(in) :: omega(:), tau

      integer :: t

      if (.not. abs(tau - self%tau) > 0.0_wp) return
      self%tau = tau
      if (.not. abs(tau) > 0.0_wp) then
         self%phasor(:) = self%start
         return
      end if
      do t = 1, size(omega)
         self%phasor(t) = self%start(t)*cmplx(cos(omega(t)*tau), sin(omega(t)*tau), wp)
      end do
   end subroutine look

end module razy_hybrid_excitation
