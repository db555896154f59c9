!! From the amplitudes at the end of a piece in one mode to those at the start of the next in another, without the state between.
!!
!! The state z is a linear function of the first, and the second of z (razy_exact_closed_form_response): their product is one matrix
!! of the size of one of them. It is made when the motion has passed so often that this pays.
module razy_exact_closed_form_passage
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, set_excitation
   use razy_exact_closed_form_response, only: response_t
   use razy_linalg_blocks, only: product
   implicit none(type, external)
   private

   public :: passage_t

   type :: passage_t
      !> How often the motion under way has come here.
      integer :: uses = 0
      !> From all amplitudes of one mode to terms and rigid modes of the other (length, length).
      real(wp), allocatable, private :: matrix(:, :)
   contains
      procedure :: pass
   end type passage_t

contains

   !> Put `start` at the start of a piece in the response `to` under the tones' phasors (tones), from `last`, the end of a piece in
   !> the response `from`; not `passed`: from the state it takes no longer.
   subroutine pass(self, from, last, to, phasor, start, passed)
      class(passage_t), intent(inout) :: self
      type(response_t), intent(in) :: from, to
      type(amplitudes_t), intent(in) :: last
      complex(wp), intent(in) :: phasor(:)
      type(amplitudes_t), intent(inout) :: start
      logical, intent(out) :: passed

      self%uses = self%uses + 1
      ! The matrix costs as much as so many ways over the state, and more than half of the way where there are dense states.
      passed = self%uses > to%length .and. from%nx == 0 .and. to%nx == 0
      if (.not. passed) return
      if (.not. allocated(self%matrix)) self%matrix = passage_between(from, to)
      call product(to%length, from%length, self%matrix, last%x, start%x)
      call set_excitation(start, to, phasor)
   end subroutine pass

   !> into' (from - constant' - tones').
   pure function passage_between(from, to) result(matrix)
      type(response_t), intent(in) :: from, to
      real(wp) :: matrix(to%length, from%length)

      real(wp) :: state(2*from%m, from%length)
      integer :: j

      state = from%from
      state(:, from%one) = state(:, from%one) - to%from(:, to%one)
      do j = 1, to%tones
         associate (re => from%terms + j, im => from%filled + from%terms + j, n => to%terms + j)
            state(:, re) = state(:, re) - to%from(:, n)
            state(:, im) = state(:, im) - to%from(:, to%filled + n)
         end associate
      end do
      matrix = matmul(to%into, state)
   end function passage_between

end module razy_exact_closed_form_passage
