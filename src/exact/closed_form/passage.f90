!! From the amplitudes at the end of a piece in one mode to those at the start of the next in another, without the state between.
!!
!! The state z is a linear function of the first, and the second of z (razy_exact_closed_form_response): their product is one matrix
!! of the size of one of them. It is made when the motion has passed so often that this pays; of another excitation only its
!! columns are made anew.
module razy_exact_closed_form_passage
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, enter_terms, set_excitation
   use razy_exact_closed_form_response, only: response_t
   use razy_linalg_blocks, only: product
   implicit none(type, external)
   private

   public :: passage_t, pays

   type :: passage_t
      !> From all amplitudes of one mode to terms and rigid modes of the other (rows, columns); whether it is of this excitation,
      !> and whether its columns of terms are those of any.
      real(wp), allocatable, private :: matrix(:, :)
      logical :: ready = .false.
      logical, private :: lasting = .false.
      !> As long as the tally of passages (razy_exact_tally) has been forgotten so often, it is known to pay.
      integer :: pays_in = 0
   contains
      procedure :: pass
      procedure :: renew
      procedure :: numbers
   end type passage_t

   !> What the way over the state takes beside its products, measured in products of two numbers.
   real(wp), parameter :: besides = 100.0_wp
   !> So many more passages are expected for each that there was.
   real(wp), parameter :: to_come = 8.0_wp

contains

   !> Put `start` at the start of a piece in the response `to` under the tones' phasors (tones), from `last`, the end of a piece in
   !> the response `from`. Between dense parts there is no way but over the state.
   pure subroutine pass(self, from, last, to, phasor, start)
      class(passage_t), intent(inout) :: self
      type(response_t), intent(in) :: from, to
      type(amplitudes_t), intent(in) :: last
      complex(wp), contiguous, intent(in) :: phasor(:)
      type(amplitudes_t), intent(inout) :: start

      real(wp) :: y(to%rows)

      if (.not. self%ready) call make_matrix(self, from, to)
      call product(to%rows, from%columns, self%matrix, last%x, y)
      call enter_terms(to, y, start%x)
      call set_excitation(start, to, phasor)
   end subroutine pass

   !> Numbers that it holds.
   elemental integer(i8) function numbers(self)
      class(passage_t), intent(in) :: self

      numbers = 0
      if (allocated(self%matrix)) numbers = size(self%matrix, kind=i8)
   end function numbers

   !> The excitation is another.
   elemental subroutine renew(self)
      class(passage_t), intent(inout) :: self

      self%ready = .false.
   end subroutine renew

   !> Whether after so many passages over the state those to come could save more products of two numbers than the matrix costs.
   elemental logical function pays(uses, from, to)
      integer, intent(in) :: uses
      type(response_t), intent(in) :: from, to

      pays = from%nx == 0 .and. to%nx == 0
      if (.not. pays) return
      associate (states => 2.0_wp*from%m, columns => real(from%columns, wp), rows => real(to%rows, wp))
         pays = to_come*uses*(states*(columns + rows) + besides - columns*rows) > states*columns*rows
      end associate
   end function pays

   !> into' (from - constant' - tones').
   pure subroutine make_matrix(self, from, to)
      class(passage_t), intent(inout) :: self
      type(response_t), intent(in) :: from, to

      real(wp) :: state(2*from%m)
      integer :: j, t
      logical :: kept, lasts

      ! Driven terms stand last, and are others for another excitation.
      lasts = from%driven%count == 0 .and. to%driven%count == 0
      kept = lasts .and. self%lasting
      if (kept) kept = all(shape(self%matrix) == [to%rows, from%columns])
      if (.not. kept) then
         if (allocated(self%matrix)) deallocate (self%matrix)
         allocate (self%matrix(to%rows, from%columns))
      end if
      do j = 1, from%columns
         t = merge(j, j - from%filled, j <= from%filled) - from%terms
         if (kept .and. (t <= 0 .or. j > from%one)) cycle
         state = from%from(:, j)
         if (j == from%one) state = (state - to%from(:, to%one)) + (from%origin - to%origin)
         if (j < from%one .and. t >= 1 .and. t <= to%tones) then
            state = state - to%from(:, merge(0, to%filled, j <= from%filled) + to%terms + t)
         end if
         call product(to%rows, 2*to%m, to%into, state, self%matrix(:, j))
      end do
      self%lasting = lasts
      self%ready = .true.
   end subroutine make_matrix

end module razy_exact_closed_form_passage
