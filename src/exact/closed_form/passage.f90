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
      !> How often the motion under way has come here over the state.
      integer :: uses = 0
      !> From all amplitudes of one mode to terms and rigid modes of the other (length, length).
      real(wp), allocatable, private :: matrix(:, :)
   contains
      procedure :: pass
   end type passage_t

   !> What the way over the state takes beside its products, measured in products of two numbers.
   real(wp), parameter :: besides = 100.0_wp

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

      passed = from%nx == 0 .and. to%nx == 0 .and. pays(self%uses, 2.0_wp*from%m, real(from%length, wp), real(to%length, wp))
      if (.not. passed) self%uses = self%uses + 1
      if (.not. passed) return
      if (.not. allocated(self%matrix)) self%matrix = passage_between(from, to)
      call product(to%length, from%length, self%matrix, last%x, start%x)
      call set_excitation(start, to, phasor)
   end subroutine pass

   !> Whether so many passages over the state could have saved more products of two numbers than the matrix costs.
   elemental logical function pays(uses, states, from, to)
      integer, intent(in) :: uses
      real(wp), intent(in) :: states, from, to

      pays = uses*(states*(from + to) + besides - from*to) > states*from*to
   end function pays

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
      do j = 1, from%length
         call product(to%length, 2*to%m, to%into, state(:, j), matrix(:, j))
      end do
   end function passage_between

end module razy_exact_closed_form_passage
