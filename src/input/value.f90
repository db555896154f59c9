!! One key's values, converted once and checked against the key's specification.
module razy_input_value
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_core_number, only: number_not_finite, number_ok, parse_integer, parse_logical, parse_real, to_text
   use razy_input_schema, only: key_spec_t, type_integer, type_logical, type_real, type_string
   use razy_core_text, only: append_text, join, nearest_name, position_of, quoted, string_t
   use razy_input_token, only: parse_values, token_logical, token_number, token_string, token_t, token_word
   implicit none(type, external)
   private

   public :: value_t, convert, option_tokens, allowed_text, count_text, element_text, within

   !> Values of one key; the array of the key's type is allocated, with no elements when there is no value.
   type :: value_t
      !> Whether the user gave it, in the file or by `--set`, or a sweep put it
      logical :: given = .false.
      !> Line in the file; 0 when it came from the command line or by default
      integer :: line = 0
      !> As the user wrote it; not allocated once a sweep changed it, or for a default
      character(:), allocatable :: text
      real(wp), allocatable :: reals(:)
      integer, allocatable :: integers(:)
      logical, allocatable :: logicals(:)
      type(string_t), allocatable :: strings(:)
   contains
      procedure :: count => value_count
   end type value_t

contains

   !> Number of values.
   pure integer function value_count(self)
      class(value_t), intent(in) :: self

      value_count = 0
      if (allocated(self%reals)) value_count = size(self%reals)
      if (allocated(self%integers)) value_count = size(self%integers)
      if (allocated(self%logicals)) value_count = size(self%logicals)
      if (allocated(self%strings)) value_count = size(self%strings)
   end function value_count

   !> Convert and check `tokens`; `problem` is allocated, and says what is allowed, when they do not fit `spec`.
   !> No tokens at all make a value without elements.
   pure subroutine convert(spec, tokens, value, problem)
      type(key_spec_t), intent(in) :: spec
      type(token_t), intent(in) :: tokens(:)
      type(value_t), intent(out) :: value
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: advice, reason
      integer :: i

      select case (spec%type)
      case (type_real)
         allocate (value%reals(size(tokens)))
      case (type_integer)
         allocate (value%integers(size(tokens)))
      case (type_logical)
         allocate (value%logicals(size(tokens)))
      case default
         allocate (value%strings(size(tokens)))
      end select
      advice = ""
      do i = 1, size(tokens)
         call convert_element(spec, tokens(i), i, value, reason)
         if (.not. allocated(reason)) cycle
         advice = nearest_name(tokens(i)%text, spec%choices)
         if (len(advice) > 0) advice = "; did you mean '"//advice//"'?"
         exit
      end do
      if (.not. allocated(reason) .and. size(tokens) > 0 .and. (size(tokens) < spec%least .or. size(tokens) > spec%most)) then
         reason = ""
         if (size(tokens) > 1) reason = "has "//to_text(size(tokens))//" values, "
      end if
      if (allocated(reason)) problem = reason//"must be "//allowed_text(spec)//advice
   end subroutine convert

   !> Convert one value; `reason` is allocated when it does not fit, and empty when what is allowed says enough.
   pure subroutine convert_element(spec, token, i, value, reason)
      type(key_spec_t), intent(in) :: spec
      type(token_t), intent(in) :: token
      integer, intent(in) :: i
      type(value_t), intent(inout) :: value
      character(:), allocatable, intent(out) :: reason
      integer :: status
      logical :: ok

      ok = .false.
      status = number_ok
      select case (spec%type)
      case (type_real)
         if (token%kind /= token_string) call parse_real(token%text, value%reals(i), status)
         ok = token%kind /= token_string .and. status == number_ok
         if (status == number_not_finite) reason = "is not a finite number, "
         if (ok) ok = within(spec, value%reals(i))
      case (type_integer)
         if (token%kind == token_number) call parse_integer(token%text, value%integers(i), status)
         ok = token%kind == token_number .and. status == number_ok
         if (status == number_not_finite) reason = "is beyond the range of integers, "
         if (ok) ok = within(spec, real(value%integers(i), wp))
      case (type_logical)
         if (token%kind == token_logical) call parse_logical(token%text, value%logicals(i), ok)
      case default
         if (token%kind == token_string) then
            call convert_string(spec, token%text, value%strings(i)%text, ok)
         else
            reason = "text stands in quotes, "
         end if
      end select
      if (.not. ok .and. .not. allocated(reason)) reason = ""
   end subroutine convert_element

   !> Check a string; a choice is stored as the schema spells it.
   pure subroutine convert_string(spec, text, stored, ok)
      type(key_spec_t), intent(in) :: spec
      character(*), intent(in) :: text
      character(:), allocatable, intent(out) :: stored
      logical, intent(out) :: ok
      character(*), parameter :: not_in_names = '/%(),"'//"'"
      integer, parameter :: longest_name = 63
      integer :: choice

      ok = .true.
      stored = text
      if (size(spec%choices) > 0) then
         choice = position_of(text, spec%choices)
         ok = choice > 0
         if (ok) stored = spec%choices(choice)%text
      else if (spec%is_name) then
         ok = len(text) > 0 .and. len(text) <= longest_name .and. scan(text, not_in_names) == 0
         if (ok) ok = adjustl(text) == text .and. len_trim(text) == len(text)
      end if
   end subroutine convert_string

   !> Whether a number is finite and keeps the limits of its key.
   pure logical function within(spec, number)
      type(key_spec_t), intent(in) :: spec
      real(wp), intent(in) :: number

      within = ieee_is_finite(number)
      if (.not. within) return
      within = number >= spec%low .and. number <= spec%high
      if (spec%open_below) within = within .and. number > spec%low
   end function within

   !> Values written outside of a file, on the command line or as a default: namelist syntax, and for a string key also
   !> bare text, with a comma between values where the key may have several. With a `problem` comes the text as one word.
   pure subroutine option_tokens(spec, text, tokens, problem)
      type(key_spec_t), intent(in) :: spec
      character(*), intent(in) :: text
      type(token_t), allocatable, intent(out) :: tokens(:)
      character(:), allocatable, intent(out) :: problem
      type(string_t), allocatable :: parts(:)
      character(:), allocatable :: rest
      integer :: comma, i

      rest = trim(adjustl(text))
      allocate (parts(0))
      if (spec%type /= type_string .or. scan(rest, '"'//"'") == 1) then
         call parse_values(rest, tokens, problem)
         if (.not. allocated(problem)) return
         deallocate (tokens)
      else
         do
            comma = index(rest, ",")
            if (comma == 0 .or. spec%most == 1) exit
            call append_text(parts, trim(rest(:comma - 1)))
            rest = adjustl(rest(comma + 1:))
         end do
      end if
      call append_text(parts, trim(rest))
      allocate (tokens(size(parts)))
      do i = 1, size(parts)
         tokens(i)%kind = token_string
         if (allocated(problem)) tokens(i)%kind = token_word
         call move_alloc(parts(i)%text, tokens(i)%text)
      end do
   end subroutine option_tokens

   !> What a key may be: `a positive real number in m`, `one of 'exact', 'rk4'`.
   pure function allowed_text(spec) result(text)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text
      logical :: single

      single = spec%most == 1
      select case (spec%type)
      case (type_logical)
         text = ".true. or .false."
         if (.not. single) text = count_text(spec)//" of "//text
      case (type_string)
         if (size(spec%choices) > 0) then
            text = choices_text(spec%choices)
            if (single) text = "one of "//text
            if (.not. single) text = count_text(spec)//" of "//text
         else if (spec%is_name) then
            text = "a name of 1 to 63 characters without quotes / % ( ) , and without blanks at its ends"
         else
            text = "a text in quotes"
            if (.not. single) text = count_text(spec)//" texts in quotes"
         end if
      case default
         text = number_text(spec, single)
      end select
   end function allowed_text

   !> What a numeric key may be.
   pure function number_text(spec, single) result(text)
      type(key_spec_t), intent(in) :: spec
      logical, intent(in) :: single
      character(:), allocatable :: text
      logical :: above, below

      text = "real number"
      if (spec%type == type_integer) text = "integer"
      if (.not. single) text = text//"s"
      above = spec%low > -huge(1.0_wp)
      below = spec%high < huge(1.0_wp)
      if (above .and. spec%low >= 0.0_wp .and. spec%low <= 0.0_wp .and. .not. below) then
         if (spec%open_below) text = "positive "//text
         if (.not. spec%open_below) text = "nonnegative "//text
         above = .false.
      end if
      if (.not. single) then
         text = count_text(spec)//" "//text
      else if (spec%type == type_integer .and. text(1:1) == "i") then
         text = "an "//text
      else
         text = "a "//text
      end if
      if (above .and. spec%open_below) text = text//" above "//limit_text(spec, spec%low)
      if (above .and. .not. spec%open_below .and. below) text = text//" from "//limit_text(spec, spec%low)
      if (above .and. .not. spec%open_below .and. .not. below) text = text//" not below "//limit_text(spec, spec%low)
      if (above .and. spec%open_below .and. below) text = text//" and"
      if (below .and. (.not. above .or. spec%open_below)) text = text//" not above "//limit_text(spec, spec%high)
      if (below .and. above .and. .not. spec%open_below) text = text//" to "//limit_text(spec, spec%high)
      if (len(spec%unit) > 0) text = text//" in "//spec%unit
   end function number_text

   !> A limit as the type of the key writes it.
   pure function limit_text(spec, limit) result(text)
      type(key_spec_t), intent(in) :: spec
      real(wp), intent(in) :: limit
      character(:), allocatable :: text

      text = to_text(limit)
      if (spec%type == type_integer) text = to_text(nint(limit))
   end function limit_text

   !> Number of values a key may have: `1`, `2`, `1 to 64`.
   pure function count_text(spec) result(text)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text

      text = to_text(spec%least)
      if (spec%most > spec%least) text = text//" to "//to_text(spec%most)
   end function count_text

   !> The choices in quotes with commas between them.
   pure function choices_text(choices) result(text)
      type(string_t), intent(in) :: choices(:)
      character(:), allocatable :: text

      text = "'"//join(choices, "', '")//"'"
   end function choices_text

   !> One of the values in namelist syntax.
   pure function element_text(value, i) result(text)
      type(value_t), intent(in) :: value
      integer, intent(in) :: i
      character(:), allocatable :: text

      text = ""
      if (allocated(value%reals)) text = to_text(value%reals(i))
      if (allocated(value%integers)) text = to_text(value%integers(i))
      if (allocated(value%logicals)) text = trim(merge(".true. ", ".false.", value%logicals(i)))
      if (allocated(value%strings)) text = quoted(value%strings(i)%text)
   end function element_text

end module razy_input_value
