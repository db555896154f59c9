!! Results of several points in one array of 64-bit words, as they travel from a rank to rank 0.
!!
!! Layout, for each result: number of its point, 1 if the point has more to yield, number of integers, number of reals, the
!! integers, the bits of the reals.
module razy_sweep_packet
   use razy_core_kinds, only: i8, wp
   use razy_sweep_task, only: point_result_t
   implicit none(type, external)
   private

   public :: packet_t

   integer(i8), parameter :: n_head = 4

   !> A buffer that is used again: only its first `length` words are valid. Reading goes on at `cursor`.
   type :: packet_t
      integer(i8), allocatable :: words(:)
      integer(i8) :: length = 0
      integer(i8), private :: cursor = 0
   contains
      procedure :: clear
      procedure :: resize
      procedure :: set
      procedure :: put
      procedure :: get
      procedure :: at_end
   end type packet_t

contains

   !> Empty the packet; the buffer stays.
   elemental subroutine clear(self)
      class(packet_t), intent(inout) :: self

      self%length = 0
      self%cursor = 0
   end subroutine clear

   !> Give the packet `length` words, of which those that were valid are kept, and start reading at the first.
   pure subroutine resize(self, length)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(in) :: length
      integer(i8), allocatable :: more(:)
      integer(i8) :: kept

      if (.not. allocated(self%words)) allocate (self%words(0))
      if (length > size(self%words, kind=i8)) then
         kept = self%length
         allocate (more(max(length, 2*kept, 64_i8)))
         more(:kept) = self%words(:kept)
         call move_alloc(more, self%words)
      end if
      self%length = length
      self%cursor = 0
   end subroutine resize

   !> Make the packet consist of these words.
   pure subroutine set(self, words)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(in) :: words(:)

      call self%clear()
      call self%resize(size(words, kind=i8))
      self%words(:size(words)) = words
   end subroutine set

   !> Append the result of a point.
   pure subroutine put(self, point, result)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(in) :: result
      integer(i8) :: i, start

      start = self%length
      call self%resize(start + n_head + result%n_integers + result%n_reals)
      self%words(start + 1:start + n_head) = [point, merge(1_i8, 0_i8, result%continues), result%n_integers, result%n_reals]
      start = start + n_head
      do i = 1, result%n_integers
         self%words(start + i) = result%integers(i)
      end do
      start = start + result%n_integers
      do i = 1, result%n_reals
         self%words(start + i) = transfer(result%reals(i), 0_i8)
      end do
   end subroutine put

   !> Take out the result of the next point; not to be called `at_end`.
   pure subroutine get(self, point, result)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(out) :: point
      type(point_result_t), intent(inout) :: result
      integer(i8) :: i, start

      start = self%cursor
      point = self%words(start + 1)
      call result%clear()
      result%continues = self%words(start + 2) == 1
      call result%reserve(self%words(start + 3), self%words(start + 4))
      result%n_integers = self%words(start + 3)
      result%n_reals = self%words(start + 4)
      start = start + n_head
      do i = 1, result%n_integers
         result%integers(i) = self%words(start + i)
      end do
      start = start + result%n_integers
      do i = 1, result%n_reals
         result%reals(i) = transfer(self%words(start + i), 0.0_wp)
      end do
      self%cursor = start + result%n_reals
   end subroutine get

   !> All points have been taken out.
   elemental logical function at_end(self)
      class(packet_t), intent(in) :: self

      at_end = self%cursor >= self%length
   end function at_end

end module razy_sweep_packet
