!! Rows of points as 64-bit words: as they travel from a rank to rank 0, and as they stand in the checkpoint.
!!
!! A row is, column by column: of a ragged list its length; then the values, integers of 8 bits eight to a word. A packet is, for
!! each of its points: number of the point, number of words of its row, these.
module razy_sweep_packet
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: column_t, table_t
   implicit none(type, external)
   private

   public :: count_row, packet_t, unpack_row

   integer(i8), parameter :: n_head = 2
   integer, parameter :: bytes = 8

   !> A buffer that is used again: only its first `length` words are valid. Reading goes on at `cursor`.
   type :: packet_t
      integer(i8), allocatable :: words(:)
      integer(i8) :: length = 0
      integer(i8), private :: cursor = 0
   contains
      procedure :: clear
      procedure :: set_length
      procedure :: put
      procedure :: next
   end type packet_t

contains

   !> Empty the packet; the buffer stays.
   elemental subroutine clear(self)
      class(packet_t), intent(inout) :: self

      self%length = 0
      self%cursor = 0
   end subroutine clear

   !> Give the packet `length` words, of which those that were valid are kept, and start reading at the first.
   pure subroutine set_length(self, length)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(in) :: length

      if (.not. allocated(self%words)) allocate (self%words(64))
      if (length > size(self%words, kind=i8)) call resize(self%words, max(length, 2*self%length))
      self%length = length
      self%cursor = 0
   end subroutine set_length

   !> Append the row of a point.
   pure subroutine put(self, point, row)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(in) :: row

      integer(i8) :: n, start
      integer :: i

      n = sum([(words_of(row%column(i)), i=1, row%count)])
      start = self%length
      call self%set_length(start + n_head + n)
      self%words(start + 1:start + n_head) = [point, n]
      start = start + n_head
      do i = 1, row%count
         n = words_of(row%column(i))
         call pack_column(row%column(i), self%words(start + 1:start + n))
         start = start + n
      end do
   end subroutine put

   !> The next point and where its row stands: words first … last; `point` is 0 at the end.
   pure subroutine next(self, point, first, last)
      class(packet_t), intent(inout) :: self
      integer(i8), intent(out) :: point, first, last

      point = 0
      first = 1
      last = 0
      if (self%cursor >= self%length) return
      point = self%words(self%cursor + 1)
      first = self%cursor + n_head + 1
      last = self%cursor + n_head + self%words(self%cursor + n_head)
      self%cursor = last
   end subroutine next

   !> Words of `n` values of a column.
   elemental integer(i8) function words_for(column, n)
      type(column_t), intent(in) :: column
      integer(i8), intent(in) :: n

      words_for = merge((n + bytes - 1)/bytes, n, column%bits == bytes)
   end function words_for

   !> Words of a column in a row.
   pure integer(i8) function words_of(column)
      type(column_t), intent(in) :: column

      words_of = words_for(column, product(column%extent)) + merge(1_i8, 0_i8, column%is_ragged())
   end function words_of

   pure subroutine pack_column(column, words)
      type(column_t), intent(in) :: column
      integer(i8), intent(inout) :: words(:)

      integer(i8) :: n, start

      n = product(column%extent)
      start = 0
      if (column%is_ragged()) then
         words(1) = n
         start = 1
      end if
      if (allocated(column%reals)) then
         words(start + 1:start + n) = transfer(column%reals, 0_i8, n)
      else if (column%bits == bytes) then
         words(start + 1:) = transfer([int(column%integers(:n), int8), spread(0_int8, 1, bytes)], 0_i8, words_for(column, n))
      else
         words(start + 1:start + n) = column%integers
      end if
   end subroutine pack_column

   !> Find the next column in the words of a row: the extent of its list, and words first … last with its values; `fits` is false if
   !> there are not as many.
   pure subroutine find_column(words, column, extent, first, last, fits)
      integer(i8), intent(in) :: words(:)
      type(column_t), intent(in) :: column
      integer(i8), intent(out) :: extent, first
      integer(i8), intent(inout) :: last
      logical, intent(out) :: fits

      extent = product(column%extent)
      first = last + 1
      if (column%is_ragged()) then
         fits = first <= size(words, kind=i8)
         if (fits) fits = words(first) >= 0 .and. words(first) <= bytes*size(words, kind=i8)
         if (.not. fits) return
         extent = words(first)
         first = first + 1
      end if
      last = first - 1 + words_for(column, extent)
      fits = last <= size(words, kind=i8)
   end subroutine find_column

   !> Fill a row, whose columns are there, from words; `fits` is false if they are not those of such a row.
   pure subroutine unpack_row(words, row, fits)
      integer(i8), intent(in) :: words(:)
      type(table_t), intent(inout) :: row
      logical, intent(out) :: fits

      integer(i8) :: extent, first, last
      integer :: i

      last = 0
      fits = .true.
      do i = 1, row%count
         associate (column => row%column(i))
            call find_column(words, column, extent, first, last, fits)
            if (.not. fits) return
            if (column%is_ragged()) column%extent = [extent]
            call unpack_column(column, words(first:last))
         end associate
      end do
      fits = last == size(words, kind=i8)
   end subroutine unpack_row

   !> Add to the tally of each column the length of its list, or 1 if its integer is not 0; `fits` as for `unpack_row`.
   pure subroutine count_row(words, row, tally, fits)
      integer(i8), intent(in) :: words(:)
      type(table_t), intent(in) :: row
      integer(i8), intent(inout) :: tally(:)
      logical, intent(out) :: fits

      integer(i8) :: extent, first, last
      integer :: i

      last = 0
      fits = .true.
      do i = 1, row%count
         associate (column => row%column(i))
            call find_column(words, column, extent, first, last, fits)
            if (.not. fits) return
            if (column%is_ragged()) then
               tally(i) = tally(i) + extent
            else if (allocated(column%integers)) then
               tally(i) = tally(i) + merge(1, 0, any(words(first:last) /= 0))
            end if
         end associate
      end do
      fits = last == size(words, kind=i8)
   end subroutine count_row

   pure subroutine unpack_column(column, words)
      type(column_t), intent(inout) :: column
      integer(i8), intent(in) :: words(:)

      integer(i8) :: n

      n = product(column%extent)
      if (allocated(column%reals)) then
         column%reals = transfer(words, 0.0_wp, n)
      else if (column%bits == bytes) then
         column%integers = int(transfer(words, 0_int8, n), i8)
      else
         column%integers = words
      end if
   end subroutine unpack_column

end module razy_sweep_packet
