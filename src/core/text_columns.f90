!! Named columns of numbers from a text file: comma-separated.
!!
!! The first line has names; each further line has as many real numbers, separated by commas. Blank lines and lines that
!! begin with `#` are passed over; names may be in double quotes, and a unit in brackets behind a name does not belong to it, but
!! is to be one that is asked for.
module razy_core_text_columns
   use razy_core_error, only: error_t, refuse
   use razy_core_kinds, only: wp
   use razy_core_number, only: number_ok, parse_real, to_text
   use razy_core_text, only: did_you_mean, excerpt, lower, newline, string_t
   use razy_core_text_file, only: read_text_file
   implicit none(type, external)
   private

   public :: read_text_columns

   !> No machine has larger numbers, as in an input.
   real(wp), parameter :: largest = 1.0e30_wp

contains

   !> Read the columns `names` of a text file into `values` (rows, columns); a name such as `value [N or N m]` says which units may
   !> be given there.
   !>
   !> Errors, with the line where there are lines: no such file, column or unit, what is no number up to 1e30, lines of unequal
   !> lengths.
   subroutine read_text_columns(file, names, values, error)
      character(*), intent(in) :: file
      type(string_t), intent(in) :: names(:)
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: words(:), header(:)
      character(:), allocatable :: text
      integer, allocatable :: column(:)
      integer :: line, next, place, row, rows

      call read_text_file(file, text, error)
      if (allocated(error)) return
      rows = count([(text(place:place) == newline, place=1, len(text))]) + 1
      allocate (values(rows, size(names)))
      row = 0
      line = 0
      place = 1
      do while (place <= len(text))
         line = line + 1
         next = index(text(place:), newline)
         next = merge(place + next, len(text) + 2, next > 0)
         call split(text(place:next - 2), words)
         place = next
         if (size(words) == 0) cycle
         if (.not. allocated(header)) then
            call move_alloc(words, header)
            call find_columns(file, line, header, names, column, error)
         else if (size(words) /= size(header)) then
            call refuse(error, at(file, line), to_text(size(words))//" values, but the first line names "// &
                        to_text(size(header))//" columns")
         else
            row = row + 1
            call read_row(file, line, words, header, column, values(row, :), error)
         end if
         if (allocated(error)) return
      end do
      values = values(:row, :)
   end subroutine read_text_columns

   !> `file:line`.
   pure function at(file, line) result(origin)
      character(*), intent(in) :: file
      integer, intent(in) :: line
      character(:), allocatable :: origin

      origin = file//":"//to_text(line)
   end function at

   !> The words between the commas of a line, without blanks around them; none of a blank line or a comment.
   subroutine split(line, words)
      character(*), intent(in) :: line
      type(string_t), allocatable, intent(out) :: words(:)

      integer :: i, length, start

      length = 0
      if (len_trim(line) > 0) length = 1 + count([(line(i:i) == ",", i=1, len(line))])
      if (index(adjustl(line), "#") == 1) length = 0
      allocate (words(length))
      start = 1
      do i = 1, length
         length = index(line(start:), ",") - 1
         if (length < 0) length = len(line) - start + 1
         words(i)%text = trim(adjustl(line(start:start + length - 1)))
         start = start + length + 1
      end do
   end subroutine split

   !> Where the columns that are asked for stand in the header.
   subroutine find_columns(file, line, header, names, column, error)
      character(*), intent(in) :: file
      integer, intent(in) :: line
      type(string_t), intent(inout) :: header(:)
      type(string_t), intent(in) :: names(:)
      integer, allocatable, intent(out) :: column(:)
      type(error_t), allocatable, intent(out) :: error

      type(string_t) :: unit(size(header))
      character(:), allocatable :: name, units
      integer :: i, k

      do i = 1, size(header)
         call take_apart(header(i)%text, name, unit(i)%text)
         header(i)%text = name
      end do
      allocate (column(size(names)), source=0)
      do k = 1, size(names)
         call take_apart(names(k)%text, name, units)
         do i = 1, size(header)
            if (lower(header(i)%text) /= lower(name)) cycle
            if (column(k) > 0) then
               call refuse(error, at(file, line), "two columns '"//excerpt(name)//"'")
            else if (len(unit(i)%text)*len(units) > 0 .and. index(" or "//units//" or ", " or "//unit(i)%text//" or ") == 0) then
               call refuse(error, at(file, line), "column '"//excerpt(name)//"' is in "//excerpt(unit(i)%text)//", not in "//units)
            end if
            if (allocated(error)) return
            column(k) = i
         end do
         if (column(k) > 0) cycle
         call refuse(error, at(file, line), "no column '"//excerpt(name)//"'; "//did_you_mean(name, header, "columns"))
         return
      end do
   end subroutine find_columns

   !> A name without quotes, and the unit in brackets behind it, if there is one.
   pure subroutine take_apart(word, name, unit)
      character(*), intent(in) :: word
      character(:), allocatable, intent(out) :: name, unit

      integer :: bracket

      name = word
      unit = ""
      if (len(name) > 1) then
         if (name(1:1) == '"' .and. name(len(name):) == '"') name = name(2:len(name) - 1)
      end if
      bracket = index(name, "[")
      if (bracket < 2 .or. index(name, "]", back=.true.) /= len(name)) return
      unit = trim(adjustl(name(bracket + 1:len(name) - 1)))
      name = trim(name(:bracket - 1))
   end subroutine take_apart

   subroutine read_row(file, line, words, header, column, row, error)
      character(*), intent(in) :: file
      integer, intent(in) :: line, column(:)
      type(string_t), intent(in) :: words(:), header(:)
      real(wp), intent(out) :: row(:)
      type(error_t), allocatable, intent(out) :: error

      integer :: k, status

      do k = 1, size(column)
         associate (word => words(column(k)))
            call parse_real(word%text, row(k), status)
            if (status /= number_ok) row(k) = huge(row(k))
            if (abs(row(k)) <= largest) cycle
            call refuse(error, at(file, line), "column '"//excerpt(header(column(k))%text)//"' has '"//excerpt(word%text)// &
                        "', which is no real number up to 1e30")
         end associate
         return
      end do
   end subroutine read_row

end module razy_core_text_columns
