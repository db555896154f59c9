!! Results as a table of named columns: what the outcome and the observers of a motion hand over, and what the packets of a
!! sweep, its checkpoint and the result files go through column by column. A number more is one more call of `add`.
!!
!! The name of a column is the path of its dataset in a result file, such as `/point/steps`; a column whose name does not begin
!! with `/` is kept in the checkpoint of a sweep and not written into files. Values are one number or text, or an array along
!! dimensions, which are named by paths too: that of another column, which is then the scale of the dimension, or one of their
!! own for a dimension without coordinates.
!!
!! In a sweep a table is what one point yields, a row of the whole: single values become arrays over the points, lists along a
!! dimension ragged arrays, `fixed` lists, which are of one length at all points, arrays with two dimensions.
!!
!! A table is filled by the same calls in the same order each time. After `rewind` they only renew the values of the columns
!! that are there.
module razy_core_table
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, string_t, texts_of
   implicit none(type, external)
   private

   public :: attribute_t, column_t, common_unit, group_of, table_t

   !> What else is said of a column: a text, texts or integers.
   type :: attribute_t
      character(:), allocatable :: name
      type(string_t), allocatable :: texts(:)
      integer, allocatable :: numbers(:)
      logical :: is_list = .false.
   end type attribute_t

   !> A column: one of `reals`, `integers`, `texts` is allocated, the values one after the other, first dimension fastest.
   type :: column_t
      character(:), allocatable :: name, unit, long_name
      !> Names of the dimensions and extents along them; none of a single value.
      type(string_t), allocatable :: along(:)
      integer(i8), allocatable :: extent(:)
      !> In a sweep a list of the same length at all points.
      logical :: fixed = .false.
      !> Bits of an integer in a file.
      integer :: bits = 64
      real(wp), allocatable :: reals(:)
      integer(i8), allocatable :: integers(:)
      type(string_t), allocatable :: texts(:)
      type(attribute_t), allocatable :: attribute(:)
   contains
      procedure :: is_stored
      procedure :: is_ragged
   end type column_t

   !> The table; columns 1 to `count` are valid.
   type :: table_t
      type(column_t), allocatable :: column(:)
      integer :: count = 0
      !> Column that was filled last.
      integer, private :: at = 0
   contains
      procedure :: rewind => rewind_table
      procedure :: place_of
      procedure :: stack
      procedure, private :: begin, add_real, add_reals, add_real_table, add_real_cube, add_integer, add_integers, &
         add_integer_table, add_long, add_longs, add_bytes, add_text, add_texts, note_text, note_texts, note_numbers
      !> add(name, values, unit, long_name, along): `along` names the dimensions of an array.
      generic :: add => add_real, add_reals, add_real_table, add_real_cube, add_integer, add_integers, add_integer_table, &
         add_long, add_longs, add_bytes, add_text, add_texts
      !> note(attribute, value): say more of the column that was added last.
      generic :: note => note_text, note_texts, note_numbers
      procedure :: note_meanings
      procedure :: note_group
   end type table_t

contains

   !> The column goes into result files.
   pure logical function is_stored(self)
      class(column_t), intent(in) :: self

      is_stored = index(self%name, "/") == 1
   end function is_stored

   !> In a sweep each point has a list of its own length.
   pure logical function is_ragged(self)
      class(column_t), intent(in) :: self

      is_ragged = size(self%along) == 1 .and. .not. self%fixed
   end function is_ragged

   !> The path of the group that holds `path`, with a slash at its end.
   pure function group_of(path) result(group)
      character(*), intent(in) :: path
      character(:), allocatable :: group

      group = path(:index(path, "/", back=.true.))
   end function group_of

   !> The unit that all have, or `mixed`.
   pure function common_unit(units) result(unit)
      character(*), intent(in) :: units(:)
      character(:), allocatable :: unit

      unit = "1"
      if (size(units) == 0) return
      unit = "mixed"
      if (all(units == units(1))) unit = trim(units(1))
   end function common_unit

   !> Begin to fill the table again.
   elemental subroutine rewind_table(self)
      class(table_t), intent(inout) :: self

      self%at = 0
   end subroutine rewind_table

   !> Number of the column with this name; 0: there is none.
   pure integer function place_of(self, name) result(place)
      class(table_t), intent(in) :: self
      character(*), intent(in) :: name

      do place = self%count, 1, -1
         if (self%column(place)%name == name) return
      end do
   end function place_of

   !> Append the single values of `row` to lists along `along`; all rows have the same columns.
   pure subroutine stack(self, row, along)
      class(table_t), intent(inout) :: self
      type(table_t), intent(in) :: row
      character(*), intent(in) :: along

      integer :: i, k

      self%at = self%count
      do i = 1, row%count
         k = self%place_of(row%column(i)%name)
         if (k == 0) then
            call self%begin(row%column(i)%name, row%column(i)%unit, row%column(i)%long_name)
            self%column(self%at) = row%column(i)
            call set_extent(self%column(self%at), [along], [1_i8])
            cycle
         end if
         associate (list => self%column(k), one => row%column(i))
            list%extent = list%extent + 1
            if (allocated(one%reals)) list%reals = [list%reals, one%reals]
            if (allocated(one%integers)) list%integers = [list%integers, one%integers]
            if (allocated(one%texts)) call append_text(list%texts, one%texts(1)%text)
         end associate
      end do
   end subroutine stack

   !> Go to the next column, and make it if it is not there.
   pure subroutine begin(self, name, unit, long_name)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name

      type(column_t) :: blank
      integer :: i

      self%at = self%at + 1
      if (self%at <= self%count) return
      if (.not. allocated(self%column)) allocate (self%column(32))
      if (self%count == size(self%column)) self%column = [self%column, (blank, i=1, self%count)]
      self%count = self%at
      associate (column => self%column(self%at))
         column%name = name
         column%unit = unit
         if (len_trim(unit) == 0) column%unit = "1"
         column%long_name = long_name
         allocate (column%along(0), column%attribute(0))
         allocate (column%extent(0))
      end associate
   end subroutine begin

   !> Say along which dimensions the column goes.
   pure subroutine set_extent(column, along, extent)
      type(column_t), intent(inout) :: column
      character(*), intent(in) :: along(:)
      integer(i8), intent(in) :: extent(:)

      column%extent = extent
      if (size(column%along) /= size(along)) column%along = texts_of(along)
   end subroutine set_extent

   pure subroutine add_real(self, name, value, unit, long_name)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name
      real(wp), intent(in) :: value

      call self%begin(name, unit, long_name)
      self%column(self%at)%reals = [value]
   end subroutine add_real

   pure subroutine add_reals(self, name, values, unit, long_name, along, fixed)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along
      real(wp), intent(in) :: values(:)
      logical, intent(in), optional :: fixed

      call self%begin(name, unit, long_name)
      call set_extent(self%column(self%at), [along], [size(values, kind=i8)])
      self%column(self%at)%reals = values
      if (present(fixed)) self%column(self%at)%fixed = fixed
   end subroutine add_reals

   pure subroutine add_real_table(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along(2)
      real(wp), intent(in), contiguous :: values(:, :)

      call self%begin(name, unit, long_name)
      call set_extent(self%column(self%at), along, shape(values, i8))
      self%column(self%at)%reals = reshape(values, [size(values)])
   end subroutine add_real_table

   pure subroutine add_real_cube(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along(3)
      real(wp), intent(in), contiguous :: values(:, :, :)

      call self%begin(name, unit, long_name)
      call set_extent(self%column(self%at), along, shape(values, i8))
      self%column(self%at)%reals = reshape(values, [size(values)])
   end subroutine add_real_cube

   pure subroutine add_integer(self, name, value, unit, long_name)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name
      integer, intent(in) :: value

      call self%add_long(name, int(value, i8), unit, long_name)
      self%column(self%at)%bits = 32
   end subroutine add_integer

   pure subroutine add_integers(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along
      integer, intent(in) :: values(:)

      integer(i8), allocatable :: longs(:)

      allocate (longs(size(values)))
      longs(:) = int(values, i8)
      call self%add_longs(name, longs, unit, long_name, along)
      self%column(self%at)%bits = 32
   end subroutine add_integers

   pure subroutine add_integer_table(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along(2)
      integer, intent(in) :: values(:, :)

      call self%add_integers(name, reshape(values, [size(values)]), unit, long_name, along(1))
      call set_extent(self%column(self%at), along, shape(values, i8))
   end subroutine add_integer_table

   pure subroutine add_long(self, name, value, unit, long_name)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name
      integer(i8), intent(in) :: value

      call self%begin(name, unit, long_name)
      self%column(self%at)%integers = [value]
   end subroutine add_long

   pure subroutine add_longs(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along
      integer(i8), intent(in) :: values(:)

      call self%begin(name, unit, long_name)
      call set_extent(self%column(self%at), [along], [size(values, kind=i8)])
      self%column(self%at)%integers = values
   end subroutine add_longs

   pure subroutine add_bytes(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, unit, long_name, along
      integer(int8), intent(in) :: values(:)

      integer(i8), allocatable :: longs(:)

      allocate (longs(size(values)))
      longs(:) = int(values, i8)
      call self%add_longs(name, longs, unit, long_name, along)
      self%column(self%at)%bits = 8
   end subroutine add_bytes

   pure subroutine add_text(self, name, value, unit, long_name)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, value, unit, long_name

      call self%begin(name, unit, long_name)
      self%column(self%at)%texts = texts_of([value])
   end subroutine add_text

   pure subroutine add_texts(self, name, values, unit, long_name, along)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, values(:), unit, long_name, along

      call self%begin(name, unit, long_name)
      call set_extent(self%column(self%at), [along], [size(values, kind=i8)])
      self%column(self%at)%texts = texts_of(values)
   end subroutine add_texts

   pure subroutine note_text(self, name, value)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, value

      type(attribute_t) :: attribute

      attribute%texts = texts_of([value])
      call keep_note(self%column(self%at), name, attribute)
   end subroutine note_text

   pure subroutine note_texts(self, name, values)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name, values(:)

      type(attribute_t) :: attribute

      attribute%texts = texts_of(values)
      attribute%is_list = .true.
      call keep_note(self%column(self%at), name, attribute)
   end subroutine note_texts

   pure subroutine note_numbers(self, name, values)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: values(:)

      type(attribute_t) :: attribute

      attribute%numbers = values
      call keep_note(self%column(self%at), name, attribute)
   end subroutine note_numbers

   !> Say what the values of an integer column mean, in words and as CF has it.
   pure subroutine note_meanings(self, values, words)
      class(table_t), intent(inout) :: self
      integer, intent(in) :: values(:)
      character(*), intent(in) :: words(:)

      character(:), allocatable :: flags, meanings
      integer :: i, k

      if (has_note(self%column(self%at), "meanings")) return
      flags = ""
      meanings = ""
      do i = 1, size(words)
         meanings = meanings//", "//to_text(values(i))//" = "//trim(words(i))
         flags = flags//" "
         do k = 1, len_trim(words(i))
            flags = flags//merge("_", words(i) (k:k), words(i) (k:k) == " ")
         end do
      end do
      call self%note("meanings", meanings(3:))
      call self%note("flag_values", values)
      call self%note("flag_meanings", flags(2:))
   end subroutine note_meanings

   !> Say the same of all columns of a group, such as `/point/`.
   pure subroutine note_group(self, group, name, value)
      class(table_t), intent(inout) :: self
      character(*), intent(in) :: group, name, value

      integer :: i

      do i = 1, self%count
         self%at = i
         if (group_of(self%column(i)%name) == group) call self%note(name, value)
      end do
   end subroutine note_group

   pure logical function has_note(column, name)
      type(column_t), intent(in) :: column
      character(*), intent(in) :: name

      integer :: i

      has_note = any([(column%attribute(i)%name == name, i=1, size(column%attribute))])
   end function has_note

   !> Add an attribute, unless there is one of this name: a row that is filled anew keeps those of the first time.
   pure subroutine keep_note(column, name, attribute)
      type(column_t), intent(inout) :: column
      character(*), intent(in) :: name
      type(attribute_t), intent(inout) :: attribute

      if (has_note(column, name)) return
      attribute%name = name
      column%attribute = [column%attribute, attribute]
   end subroutine keep_note

end module razy_core_table
