!! The value of one key: its words, what they say as numbers, and whether the key's specification allows them.
module razy_input_value
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_core_number, only: number_malformed, number_not_finite, number_ok, parse_integer, parse_logical, parse_real, &
                               to_text
   use razy_core_text, only: join, nearest_name, newline, position_of, quoted, text_code
   use razy_input_reader, only: entry_t, indexed, read_words
   use razy_input_scanner, only: word_bare, word_gap, word_string, word_t, words_text
   use razy_input_schema, only: key_spec_t, type_integer, type_logical, type_real, type_string
   implicit none(type, external)
   private

   public :: value_t, allows, allowed_text, count_text

   !> The elements of a value, none where there is neither value nor default.
   type :: value_t
      type(word_t), allocatable :: words(:)
      !> Line of the last entry that gave some of it; 0 for the command line
      integer :: line = 0
   contains
      procedure :: set_default
      procedure :: enter
      procedure :: check
      procedure :: put
      procedure :: as_written
      procedure :: as_namelist
   end type value_t

   !> No machine has larger numbers, nor smaller ones where 0 is not allowed; products of them stay within those of the computer.
   real(wp), parameter :: largest = 1.0e30_wp, smallest = 1.0e-30_wp

contains

   !> Take the key's default; a `problem` is a mistake in the schema.
   pure subroutine set_default(self, spec, problem)
      class(value_t), intent(inout) :: self
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable, intent(out) :: problem

      allocate (self%words(0))
      if (.not. allocated(spec%default)) return
      call option_words(spec, spec%default, self%words, problem)
      if (.not. allocated(problem)) call self%check(spec, problem)
   end subroutine set_default

   !> Put the words of an entry in their places. One of the command line replaces what is there; in the file nothing may be
   !> given twice.
   pure subroutine enter(self, spec, item, problem)
      class(value_t), intent(inout) :: self
      type(key_spec_t), intent(in) :: spec
      type(entry_t), intent(in) :: item
      character(:), allocatable, intent(out) :: problem
      type(word_t), allocatable :: words(:)
      character(:), allocatable :: twice
      integer :: first

      twice = "is given twice, first in line "//to_text(self%line)
      self%line = item%line
      if (allocated(item%option)) then
         call option_words(spec, item%option, words, problem)
         if (item%last > 0 .and. size(words) /= 1) problem = "one element takes one value"
      else
         words = item%words
      end if
      words%given = .true.
      if (item%last == 0) then
         if (any(self%words%given) .and. .not. allocated(item%option)) problem = twice
         call move_alloc(words, self%words)
         return
      end if
      first = item%path%element
      call lengthen(self, item%last)
      if (any(self%words(first:item%last)%given) .and. .not. allocated(item%option)) problem = twice
      if (.not. allocated(problem)) self%words(first:item%last) = words
   end subroutine enter

   !> Make room for more elements, which are gaps.
   pure subroutine lengthen(self, length)
      type(value_t), intent(inout) :: self
      integer, intent(in) :: length
      type(word_t) :: gap
      integer :: i

      if (length > size(self%words)) self%words = [self%words, (gap, i=size(self%words) + 1, length)]
   end subroutine lengthen

   !> Find what the words say. `problem` is allocated, and says what is allowed, when that does not fit.
   pure subroutine check(self, spec, problem)
      class(value_t), intent(inout) :: self
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: meant
      integer :: count, gap, i

      count = size(self%words)
      gap = findloc(self%words%kind, word_gap, dim=1)
      if (gap > 0) then
         problem = indexed(spec%name, gap)//" is missing"
      else if (count == 0) then
         if (spec%required) problem = "is required, "//allowed_text(spec)
      else
         do i = 1, count
            call check_word(spec, self%words(i), problem)
            if (allocated(problem)) exit
         end do
         if (.not. allocated(problem)) then
            if (count >= spec%least .and. count <= spec%most) return
            problem = ""
            if (count > 1) problem = "has "//to_text(count)//" values, "
         end if
         problem = problem//"must be "//allowed_text(spec)
         if (i > count) return
         meant = nearest_name(self%words(i)%text, spec%choices)
         if (len(meant) > 0) problem = problem//"; did you mean '"//meant//"'?"
      end if
   end subroutine check

   !> Find what one word says; a choice is spelt as in the schema then. `reason` is allocated when it does not fit, and empty
   !> when what is allowed says enough.
   pure subroutine check_word(spec, word, reason)
      type(key_spec_t), intent(in) :: spec
      type(word_t), intent(inout) :: word
      character(:), allocatable, intent(out) :: reason
      character(*), parameter :: not_in_names = '/%(),"'//"'"
      integer, parameter :: longest_name = 63
      integer :: choice, status, whole
      logical :: ok, truth

      ok = .false.
      status = number_malformed
      select case (spec%type)
      case (type_real)
         if (word%kind == word_bare) call parse_real(word%text, word%number, status)
         if (status == number_not_finite) reason = "is not a finite number, "
         ok = status == number_ok .and. allows(spec, word%number)
         if (status == number_ok .and. abs(word%number) > largest) reason = "is beyond 1e30, "
         if (status == number_ok .and. too_small(spec, word%number)) reason = "is less than 1e-30, "
      case (type_integer)
         if (word%kind == word_bare) call parse_integer(word%text, whole, status)
         if (status == number_not_finite) reason = "is beyond the range of integers, "
         if (status == number_ok) word%number = whole
         ok = status == number_ok .and. allows(spec, word%number)
      case (type_logical)
         if (word%kind == word_bare) call parse_logical(word%text, truth, ok)
         if (ok) word%number = merge(1.0_wp, 0.0_wp, truth)
      case default
         if (word%kind /= word_string) then
            reason = "text stands in quotes, "
         else if (size(spec%choices) > 0) then
            choice = position_of(word%text, spec%choices)
            ok = choice > 0
            if (ok) word%text = spec%choices(choice)%text
         else if (spec%name == "name") then
            ok = verify(word%text, " ") == 1 .and. len_trim(word%text) == len(word%text) .and. len(word%text) <= longest_name &
                 .and. scan(word%text, not_in_names) == 0
         else
            ok = .true.
         end if
         word%number = real(text_code(word%text), wp)
      end select
      if (.not. ok .and. .not. allocated(reason)) reason = ""
   end subroutine check_word

   !> Whether a number is one that machines have, keeps the limits of its key, and is whole for an integer.
   pure logical function allows(spec, number)
      type(key_spec_t), intent(in) :: spec
      real(wp), intent(in) :: number

      allows = ieee_is_finite(number) .and. abs(number) <= largest
      if (.not. allows) return
      allows = number >= spec%low .and. number <= spec%high
      if (spec%open_below) allows = allows .and. number > spec%low .and. .not. too_small(spec, number)
      if (spec%type == type_integer) allows = allows .and. abs(number) <= huge(1) .and. .not. abs(number - anint(number)) > 0.0_wp
   end function allows

   pure logical function too_small(spec, number)
      type(key_spec_t), intent(in) :: spec
      real(wp), intent(in) :: number

      too_small = spec%open_below .and. number > 0.0_wp .and. number < smallest
   end function too_small

   !> Set element i to a number that the key allows, or add it.
   pure subroutine put(self, i, number)
      class(value_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: number

      call lengthen(self, i)
      self%words(i) = word_t(kind=word_bare, given=.true., number=number)
   end subroutine put

   !> What the user gave, in one line; the default where nothing was given.
   pure function as_written(self, spec) result(text)
      class(value_t), intent(in) :: self
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text
      integer :: i

      text = ""
      do i = 1, size(self%words)
         if (any(self%words%given) .and. .not. self%words(i)%given) cycle
         if (len(text) > 0) text = text//", "
         if (allocated(self%words(i)%text)) then
            text = text//words_text(self%words(i:i))
         else
            text = text//element_text(self%words(i), spec)
         end if
      end do
   end function as_written

   !> `key = value, value`, in as many lines as it needs.
   pure function as_namelist(self, spec) result(text)
      class(value_t), intent(in) :: self
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text
      !> Longest line, unless a single string is longer
      integer, parameter :: width = 132
      character(*), parameter :: indent = "   "
      character(:), allocatable :: element, line
      integer :: i

      text = ""
      line = indent//spec%name//" ="
      do i = 1, size(self%words)
         element = element_text(self%words(i), spec)
         if (i < size(self%words)) element = element//","
         if (i > 1 .and. len(line) + 1 + len(element) > width) then
            text = text//line//newline
            line = indent//indent//element
         else
            line = line//" "//element
         end if
      end do
      text = text//line
   end function as_namelist

   !> An element in namelist syntax, which reads back to the same bits.
   pure function element_text(word, spec) result(text)
      type(word_t), intent(in) :: word
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text

      select case (spec%type)
      case (type_string)
         text = quoted(word%text)
      case (type_logical)
         text = trim(merge(".true. ", ".false.", word%number > 0.0_wp))
      case (type_integer)
         text = to_text(nint(word%number))
      case default
         text = to_text(word%number)
      end select
   end function element_text

   !> Words written outside of a file, on the command line or as a default: namelist syntax, and for a string key also
   !> bare text, with a comma between values where the key may have several. With a `problem` comes the text as one word.
   pure subroutine option_words(spec, text, words, problem)
      type(key_spec_t), intent(in) :: spec
      character(*), intent(in) :: text
      type(word_t), allocatable, intent(out) :: words(:)
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: rest
      integer :: comma, i

      rest = trim(adjustl(text))
      if (spec%type /= type_string .or. scan(rest, '"'//"'") == 1) then
         call read_words(rest, words, problem)
         if (.not. allocated(problem)) return
         deallocate (words)
         allocate (words(1))
         words(1)%kind = word_bare
         words(1)%text = rest
         return
      end if
      allocate (words(merge(1, 1 + count([(rest(i:i) == ",", i=1, len(rest))]), spec%most == 1)))
      do i = 1, size(words)
         comma = len(rest) + 1
         if (i < size(words)) comma = index(rest, ",")
         words(i)%kind = word_string
         words(i)%text = trim(rest(:comma - 1))
         rest = adjustl(rest(comma + 1:))
      end do
   end subroutine option_words

   !> What a key may be: `a positive real number in m`, `one of 'exact', 'rk4'`.
   pure function allowed_text(spec) result(text)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text
      character(:), allocatable :: high, low
      logical :: above, below, single

      single = spec%most == 1
      select case (spec%type)
      case (type_logical)
         text = ".true. or .false."
         if (.not. single) text = count_text(spec)//" of "//text
      case (type_string)
         if (size(spec%choices) > 0) then
            text = "one"
            if (.not. single) text = count_text(spec)
            text = text//" of '"//join(spec%choices, "', '")//"'"
         else if (spec%name == "name") then
            text = "a name of 1 to 63 characters without quotes / % ( ) , and without blanks at its ends"
         else
            text = "a text in quotes"
            if (.not. single) text = count_text(spec)//" texts in quotes"
         end if
      case default
         text = "real number"
         if (spec%type == type_integer) text = "integer"
         above = spec%low > -huge(1.0_wp)
         below = spec%high < huge(1.0_wp)
         if (.not. below .and. abs(spec%low) <= 0.0_wp) then
            text = trim(merge("positive   ", "nonnegative", spec%open_below))//" "//text
            above = .false.
         end if
         if (single) then
            text = trim(merge("an", "a ", text(1:1) == "i"))//" "//text
         else
            text = count_text(spec)//" "//text//"s"
         end if
         if (above) low = element_text(word_t(number=spec%low), spec)
         if (below) high = element_text(word_t(number=spec%high), spec)
         if (above .and. below .and. .not. spec%open_below) then
            text = text//" from "//low//" to "//high
         else
            if (above) text = text//trim(merge(" above    ", " not below", spec%open_below))//" "//low
            if (above .and. below) text = text//" and"
            if (below) text = text//" not above "//high
         end if
         if (len(spec%unit) > 0) text = text//" in "//spec%unit
      end select
   end function allowed_text

   !> Number of values a key may have: `1`, `2`, `1 to 64`.
   pure function count_text(spec) result(text)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text

      text = to_text(spec%least)
      if (spec%most > spec%least) text = text//" to "//to_text(spec%most)
   end function count_text

end module razy_input_value
