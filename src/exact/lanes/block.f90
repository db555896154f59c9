!! Motions side by side: what of each is needed for its next smooth piece, the lane as the first index.
!!
!! All lanes of a block are in the same mode of machines with the same matrices, and came there through the same guard
!! (razy_exact_lanes_gates). Numbers of all of them are arguments of their own, those of each lane stand here.
module razy_exact_lanes_block
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: block_t, lanes, make_room

   !> Motions side by side: as many numbers as the widest vectors have.
   integer, parameter :: lanes = 8

   type :: block_t
      !> Amplitudes of the mode before at its end, then of the mode at the end of the piece: real parts of terms, imaginary parts,
      !> rigid modes, their rates (lanes, amplitudes); those at the start of the piece.
      real(wp), allocatable :: state(:, :), start(:, :)
      !> Cosine and sine of each tone at the start of the piece, then at its end (lanes, tones).
      real(wp), allocatable :: cosine(:, :), sine(:, :)
      !> What the mode and the gate have of each motion (razy_exact_lanes_gates), and its tones (lanes, numbers).
      real(wp), allocatable :: own(:, :), through(:, :), tone(:, :)
      !> Time at the start, s (sum of both), and what may pass before the motion leaves the lanes, s.
      real(wp), dimension(lanes) :: time = 0.0_wp, time_low = 0.0_wp, rest = 0.0_wp
      !> Duration of the piece, s; the guard that ends it, 0: the piece is for the propagator of one motion; stretches looked at.
      real(wp), dimension(lanes) :: tau = 0.0_wp, left = 0.0_wp, stretches = 0.0_wp
   end type block_t

contains

   !> Room for so many amplitudes, tones, and numbers of a mode and of a gate.
   pure subroutine make_room(self, amplitudes, tones, own, through)
      type(block_t), intent(inout) :: self
      integer, intent(in) :: amplitudes, tones, own, through

      if (allocated(self%state)) then
         if (size(self%state, 2) >= amplitudes .and. size(self%cosine, 2) == tones .and. size(self%own, 2) >= own &
             .and. size(self%through, 2) >= through) return
         deallocate (self%state, self%start, self%cosine, self%sine, self%own, self%through, self%tone)
      end if
      allocate (self%state(lanes, amplitudes), self%start(lanes, amplitudes), self%cosine(lanes, tones), self%sine(lanes, tones), &
                self%own(lanes, own), self%through(lanes, through), self%tone(lanes, 5*tones), source=0.0_wp)
   end subroutine make_room

end module razy_exact_lanes_block
