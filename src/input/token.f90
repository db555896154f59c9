!! The values of a namelist key as written: strings, numbers, logicals, words, with repeat counts expanded.
module razy_input_token
   use razy_core_number, only: number_ok, parse_integer, parse_logical, to_text
   use razy_core_scanner, only: scanner_t
   use razy_core_text, only: quoted
   implicit none(type, external)
   private

   public :: token_t, parse_tokens, parse_values, tokens_text
   public :: token_string, token_number, token_logical, token_word, longest_list

   !> Kinds of value: quoted string, what begins like a number, logical, any other unquoted word.
   integer, parameter :: token_string = 1, token_number = 2, token_logical = 3, token_word = 4
   !> Most values of one key, and the highest subscript.
   integer, parameter :: longest_list = 10000

   !> One value; a string without its quotes.
   type :: token_t
      integer :: kind = 0
      character(:), allocatable :: text
   end type token_t

contains

   !> Read a list of values that is a text of its own, as it follows `=`.
   pure subroutine parse_values(text, values, problem)
      character(*), intent(in) :: text
      type(token_t), allocatable, intent(out) :: values(:)
      character(:), allocatable, intent(out) :: problem
      type(scanner_t) :: scanner

      scanner%text = text
      call parse_tokens(scanner, values, problem)
      if (.not. allocated(problem) .and. .not. scanner%at_end()) problem = "found "//scanner%found()//" among the values"
   end subroutine parse_values

   !> Read values up to the next key, `/`, `&` or the end of the text.
   pure subroutine parse_tokens(scanner, values, problem)
      type(scanner_t), intent(inout) :: scanner
      type(token_t), allocatable, intent(out) :: values(:)
      character(:), allocatable, intent(out) :: problem
      type(token_t) :: token
      type(token_t), allocatable :: longer(:)
      integer :: count, times
      logical :: at_key, separated

      allocate (values(4))
      count = 0
      separated = .false.
      do
         call scanner%skip_blanks()
         if (scanner%at_end() .or. scanner%next() == "/" .or. scanner%next() == "&") exit
         call scanner%look_for_key(at_key)
         if (at_key) exit
         if (scanner%next() == ",") then
            if (separated .or. count == 0) then
               problem = "a value is missing before ,"
               return
            end if
            separated = .true.
            scanner%at = scanner%at + 1
            cycle
         end if
         call parse_token(scanner, token, times, problem)
         if (allocated(problem)) return
         if (count + times > longest_list) then
            problem = "there are more than "//to_text(longest_list)//" values"
            return
         end if
         if (count + times > size(values)) then
            allocate (longer(2*(count + times)))
            longer(:count) = values(:count)
            call move_alloc(longer, values)
         end if
         values(count + 1:count + times) = token
         count = count + times
         separated = .false.
      end do
      if (count == 0) problem = "a value is missing"
      values = values(:count)
   end subroutine parse_tokens

   !> Read one value, `times` of it where it has a repeat count.
   pure subroutine parse_token(scanner, token, times, problem)
      type(scanner_t), intent(inout) :: scanner
      type(token_t), intent(out) :: token
      integer, intent(out) :: times
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: word
      integer :: star, status
      logical :: ok, value

      times = 1
      call scanner%take_word(word)
      star = index(word, "*")
      if (star > 1 .and. verify(word(:max(star - 1, 0)), "0123456789") == 0) then
         call parse_integer(word(:star - 1), times, status)
         word = word(star + 1:)
         if (status /= number_ok .or. times < 1 .or. times > longest_list) then
            problem = "a repeat count must be from 1 to "//to_text(longest_list)
            return
         end if
      end if
      if (len(word) == 0 .and. (scanner%next() == '"' .or. scanner%next() == "'")) then
         token%kind = token_string
         call scanner%take_string(token%text, ok)
         if (.not. ok) then
            problem = "the string is not closed on its line"
            return
         end if
      else if (len(word) == 0) then
         problem = "found "//scanner%found()//" where a value must stand"
         return
      else
         token%text = word
         call parse_logical(word, value, ok)
         token%kind = token_word
         if (ok) token%kind = token_logical
         if (scan(word, "0123456789") > 0 .and. scan(word, "+-.0123456789") == 1) token%kind = token_number
      end if
      if (.not. scanner%at_separator()) problem = "found "//scanner%found()//" where a separator must follow the value"
   end subroutine parse_token

   !> The values in one line, strings in quotes.
   pure function tokens_text(values) result(text)
      type(token_t), intent(in) :: values(:)
      character(:), allocatable :: text
      integer :: i

      text = ""
      do i = 1, size(values)
         if (i > 1) text = text//", "
         if (values(i)%kind == token_string) then
            text = text//quoted(values(i)%text)
         else
            text = text//values(i)%text
         end if
      end do
   end function tokens_text

end module razy_input_token
