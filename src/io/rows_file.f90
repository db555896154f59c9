!! The file of a sweep: rows of many points, each a table with the same columns (razy_core_table), of numbers.
!!
!! It is begun with the number of rows and the lengths of its ragged columns, filled row by row, and committed; no more than some
!! thousand values of a column are in memory. Single values of all rows lie along the dimension `point` of the top group of their
!! path; a ragged column `/a/b/x` along its dimension, and row i, from 0, has the values offset(i):offset(i + 1) of it, with
!! `/a/b/offset`.
module razy_io_rows_file
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: column_t, group_of, table_t
   use razy_core_text, only: append_text, string_t
   use razy_io_hdf5_column, only: reserve_column, write_part
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_result_file, only: begin_result, result_header_t
   implicit none(type, external)
   private

   public :: rows_file_t

   !> Values of a dataset that are still to be written, and those that are.
   type :: pile_t
      character(:), allocatable :: path
      real(wp), allocatable :: reals(:)
      integer(i8), allocatable :: integers(:)
      integer(i8) :: waiting = 0, rows = 0
      !> Values in a row of the dataset.
      integer(i8) :: width = 1
   contains
      procedure :: put => put_values
      procedure :: flush => flush_pile
   end type pile_t

   !> A file of rows that is being written: `begin`, `append` for each row, then `commit`; after an error `discard`.
   type :: rows_file_t
      type(hdf5_file_t), private :: file
      integer(i8), private :: rows = 0, written = 0
      !> One for each column of a row, and, where it is the first of its dimension, the offsets; lengths promised and there.
      type(pile_t), allocatable, private :: pile(:), offset(:)
      integer(i8), allocatable, private :: promised(:), length(:)
   contains
      procedure :: begin => begin_rows
      procedure :: append => append_row
      procedure :: commit => commit_rows
      procedure :: discard => discard_rows
      procedure, private :: begin_ragged
   end type rows_file_t

   !> Values that wait before they are written.
   integer(i8), parameter :: most_waiting = 131072

contains

   !> Begin a file with the columns of `table`, and room for `rows` rows with the columns of `row`, whose values do not count;
   !> `lengths` are those of its ragged columns over all rows.
   subroutine begin_rows(self, path, header, table, row, rows, lengths, error)
      class(rows_file_t), intent(inout) :: self
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(table_t), intent(in) :: table, row
      integer(i8), intent(in) :: rows, lengths(:)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: along(:)
      integer :: i

      call begin_result(self%file, path, header, table, error)
      if (allocated(error)) return
      self%rows = rows
      self%written = 0
      self%promised = [(merge(lengths(i), 0_i8, row%column(i)%is_stored() .and. row%column(i)%is_ragged()), i=1, row%count)]
      if (allocated(self%pile)) deallocate (self%pile, self%offset, self%length)
      allocate (self%pile(row%count), self%offset(row%count))
      allocate (self%length(row%count), source=0_i8)
      do i = 1, row%count
         associate (column => row%column(i), pile => self%pile(i))
            if (.not. column%is_stored()) cycle
            call pile%put(column, 0_i8)
            pile%path = column%name
            if (column%is_ragged()) then
               if (first_along(row, i) == i) call self%begin_ragged(i, column%along(1)%text, error)
               if (.not. allocated(error)) call reserve_column(self%file, column, column%along, lengths(i:i), error)
            else
               pile%width = product(column%extent)
               along = column%along
               call append_text(along, column%name(:index(column%name(2:), "/") + 1)//"point")
               call reserve_column(self%file, column, along, [column%extent, rows], error)
            end if
         end associate
         if (allocated(error)) exit
      end do
      if (allocated(error)) call self%discard()
   end subroutine begin_rows

   !> Number of the first column with the dimension of ragged column i.
   pure integer function first_along(row, i) result(first)
      type(table_t), intent(in) :: row
      integer, intent(in) :: i

      do first = 1, i - 1
         associate (other => row%column(first))
            if (.not. other%is_stored() .or. .not. other%is_ragged()) cycle
            if (other%along(1)%text == row%column(i)%along(1)%text) return
         end associate
      end do
   end function first_along

   !> Make the dataset of the offsets of a ragged dimension.
   subroutine begin_ragged(self, i, dimension, error)
      class(rows_file_t), intent(inout) :: self
      integer, intent(in) :: i
      character(*), intent(in) :: dimension
      type(error_t), allocatable, intent(out) :: error

      type(table_t) :: offset

      call offset%add(group_of(dimension)//"offset", [0_i8], "1", "row i, from 0, has offset[i]:offset[i+1]", &
                      group_of(dimension)//"boundary")
      call reserve_column(self%file, offset%column(1), offset%column(1)%along, [self%rows + 1], error)
      self%offset(i)%path = offset%column(1)%name
      call self%offset(i)%put(offset%column(1), 1_i8)
   end subroutine begin_ragged

   !> Write the row that follows.
   subroutine append_row(self, row, error)
      class(rows_file_t), intent(inout) :: self
      type(table_t), intent(in) :: row
      type(error_t), allocatable, intent(out) :: error

      type(column_t) :: last
      integer(i8) :: n
      integer :: i

      do i = 1, row%count
         if (.not. allocated(self%pile(i)%path)) cycle
         associate (column => row%column(i))
            n = product(column%extent)
            if (.not. column%is_ragged() .and. n /= self%pile(i)%width) then
               call raise(error, self%file%path//": "//column%name//" has not got as many values as it was made for")
               return
            end if
            call self%pile(i)%put(column, n)
            if (self%pile(i)%waiting >= most_waiting) call self%pile(i)%flush(self%file, error)
            if (allocated(error)) return
            if (.not. column%is_ragged()) cycle
            self%length(i) = self%length(i) + n
            if (.not. allocated(self%offset(i)%path)) cycle
            last%integers = self%length(i:i)
            call self%offset(i)%put(last, 1_i8)
            if (self%offset(i)%waiting >= most_waiting) call self%offset(i)%flush(self%file, error)
            if (allocated(error)) return
         end associate
      end do
      self%written = self%written + 1
   end subroutine append_row

   !> Write what waits, and give the complete file its name; after an `error`, or where it is not complete, it is discarded.
   subroutine commit_rows(self, overwrite, error)
      class(rows_file_t), intent(inout) :: self
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(inout) :: error

      integer :: i

      if (.not. allocated(error)) then
         if (self%written /= self%rows .or. any(self%length /= self%promised)) then
            call raise(error, self%file%path//": has not got as many rows or values as it was made for")
         end if
         do i = 1, size(self%pile)
            if (.not. allocated(error)) call self%pile(i)%flush(self%file, error)
            if (.not. allocated(error)) call self%offset(i)%flush(self%file, error)
         end do
      end if
      if (allocated(error)) then
         call self%discard()
      else
         call self%file%commit(overwrite, error)
      end if
   end subroutine commit_rows

   subroutine discard_rows(self)
      class(rows_file_t), intent(inout) :: self

      call self%file%discard()
   end subroutine discard_rows

   !> Append the first `n` values of a column.
   subroutine put_values(self, column, n)
      class(pile_t), intent(inout) :: self
      type(column_t), intent(in) :: column
      integer(i8), intent(in) :: n

      associate (last => self%waiting + n)
         if (allocated(column%reals)) then
            if (.not. allocated(self%reals)) allocate (self%reals(1024))
            if (last > size(self%reals, kind=i8)) call resize(self%reals, 2*last)
            self%reals(self%waiting + 1:last) = column%reals(:n)
         else
            if (.not. allocated(self%integers)) allocate (self%integers(1024))
            if (last > size(self%integers, kind=i8)) call resize(self%integers, 2*last)
            self%integers(self%waiting + 1:last) = column%integers(:n)
         end if
      end associate
      self%waiting = self%waiting + n
   end subroutine put_values

   !> Write the values that wait.
   subroutine flush_pile(self, file, error)
      class(pile_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error

      if (self%waiting == 0) return
      if (allocated(self%reals)) then
         call write_part(file, self%path, self%rows, self%reals(:self%waiting), error)
      else
         call write_part(file, self%path, self%rows, self%integers(:self%waiting), error)
      end if
      self%rows = self%rows + self%waiting/self%width
      self%waiting = 0
   end subroutine flush_pile

end module razy_io_rows_file
