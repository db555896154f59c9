!! Words, names and blanks in a text of namelists, one after the other.
!!
!! Words are separated by commas, blanks or line ends; both quotes make a string (the quote doubled stands for itself), which is on
!! one line; `3*0.0` is three words. Comments go from `!` to the end of the line.
module razy_input_scanner
   use razy_core_kinds, only: wp
   use razy_core_number, only: number_ok, parse_integer, to_text
   use razy_core_text, only: letters, name_characters, newline, quoted
   implicit none(type, external)
   private

   public :: longest_list, scanner_t, separators, the_end, word_bare, word_gap, word_string, word_t, words_text

   !> Kinds of word: a gap in a list; a number or anything else without quotes; a string in quotes.
   integer, parameter :: word_gap = 0, word_bare = 1, word_string = 2
   !> Most words of one key, and the highest subscript.
   integer, parameter :: longest_list = 10000
   !> A text that is read has no control characters; one stands behind its end.
   character(*), parameter :: the_end = achar(0), blanks = " "//achar(9)//newline
   !> What ends a bare word, and what may follow any word.
   character(*), parameter :: delimiters = blanks//the_end//',/!=()&;"'//"'", separators = blanks//the_end//",/!&"

   !> One element of a value.
   type :: word_t
      integer :: kind = word_gap
      !> As written, a string without its quotes; not allocated for a number that a sweep put
      character(:), allocatable :: text
      !> Whether the user gave it, in the file or by `--set`, or a sweep put it; else it is a default
      logical :: given = .false.
      !> What it says, once it is checked: a real, an integer, 1 for true and 0 for false; by the number of a text it is told from
      !> others
      real(wp) :: number = 0.0_wp
   end type word_t

   !> A place in a text, and the group and key that are read there.
   type :: scanner_t
      character(:), allocatable :: text
      integer :: at = 1, line = 1
      character(:), allocatable :: group, key
      !> What is wrong; allocated means failed
      character(:), allocatable :: problem
   contains
      procedure :: next
      procedure :: found
      procedure :: skip_blanks
      procedure :: take_name
      procedure :: scan_words
   end type scanner_t

contains

   !> Read words up to the next key, `/`, `&` or the end of the text.
   pure subroutine scan_words(scanner, words)
      class(scanner_t), intent(inout) :: scanner
      type(word_t), allocatable, intent(out) :: words(:)
      type(word_t) :: word
      character(:), allocatable :: name
      integer :: at, count, line, times
      logical :: at_key, separated

      allocate (words(4))
      count = 0
      separated = .false.
      do
         call scanner%skip_blanks()
         if (scan(scanner%next(), "/&"//the_end) == 1) exit
         ! a name with = or ( behind it is the next key, and is left for whoever reads that
         at = scanner%at
         line = scanner%line
         call scanner%take_name(name)
         call scanner%skip_blanks()
         at_key = len(name) > 0 .and. scan(scanner%next(), "=(") == 1
         scanner%at = at
         scanner%line = line
         if (at_key) exit
         if (scanner%next() == ",") then
            if (separated .or. count == 0) then
               scanner%problem = "a value is missing before ,"
               return
            end if
            separated = .true.
            scanner%at = scanner%at + 1
            cycle
         end if
         call scan_word(scanner, word, times)
         if (count + times > longest_list) scanner%problem = "there are more than "//to_text(longest_list)//" values"
         if (allocated(scanner%problem)) return
         if (count + times > size(words)) words = [words, spread(word, 1, count + times)]
         words(count + 1:count + times) = word
         count = count + times
         separated = .false.
      end do
      if (count == 0) scanner%problem = "a value is missing"
      words = words(:count)
   end subroutine scan_words

   !> Read one word, `times` of it where it has a repeat count.
   pure subroutine scan_word(scanner, word, times)
      type(scanner_t), intent(inout) :: scanner
      type(word_t), intent(out) :: word
      integer, intent(out) :: times
      integer :: length, star, status

      times = 1
      length = scan(scanner%text(scanner%at:), delimiters) - 1
      word%text = scanner%text(scanner%at:scanner%at + length - 1)
      scanner%at = scanner%at + length
      star = index(word%text, "*")
      if (star > 1 .and. verify(word%text(:max(star - 1, 0)), "0123456789") == 0) then
         call parse_integer(word%text(:star - 1), times, status)
         word%text = word%text(star + 1:)
         if (status /= number_ok .or. times < 1 .or. times > longest_list) then
            times = 0
            scanner%problem = "a repeat count must be from 1 to "//to_text(longest_list)
            return
         end if
      end if
      word%kind = word_bare
      if (len(word%text) == 0 .and. scan(scanner%next(), '"'//"'") == 1) then
         word%kind = word_string
         call take_string(scanner, word%text)
      else if (len(word%text) == 0) then
         scanner%problem = "found "//scanner%found()//" where a value must stand"
      end if
      if (allocated(scanner%problem) .or. scan(scanner%next(), separators) == 1) return
      scanner%problem = "found "//scanner%found()//" where a separator must follow the value"
   end subroutine scan_word

   !> Take the string that begins with the quote here, on one line; the quote written twice stands for itself.
   pure subroutine take_string(scanner, string)
      type(scanner_t), intent(inout) :: scanner
      character(:), allocatable, intent(out) :: string
      character(1) :: quote
      integer :: length

      quote = scanner%next()
      string = ""
      do
         scanner%at = scanner%at + 1
         length = scan(scanner%text(scanner%at:), quote//newline//the_end) - 1
         string = string//scanner%text(scanner%at:scanner%at + length - 1)
         scanner%at = scanner%at + length
         if (scanner%next() /= quote) then
            scanner%problem = "the string is not closed on its line"
            return
         end if
         scanner%at = scanner%at + 1
         if (scanner%next() /= quote) exit
         string = string//quote
      end do
   end subroutine take_string

   !> Take a name; empty unless there is one here.
   pure subroutine take_name(scanner, name)
      class(scanner_t), intent(inout) :: scanner
      character(:), allocatable, intent(out) :: name
      integer :: length

      length = 0
      if (scan(scanner%next(), letters) == 1) length = verify(scanner%text(scanner%at:), name_characters) - 1
      name = scanner%text(scanner%at:scanner%at + length - 1)
      scanner%at = scanner%at + length
   end subroutine take_name

   !> Go on to what is neither blank nor comment.
   pure subroutine skip_blanks(scanner)
      class(scanner_t), intent(inout) :: scanner

      do
         if (scanner%next() == "!") scanner%at = scanner%at + scan(scanner%text(scanner%at:), newline//the_end) - 1
         if (scan(scanner%next(), blanks) == 0) return
         if (scanner%next() == newline) scanner%line = scanner%line + 1
         scanner%at = scanner%at + 1
      end do
   end subroutine skip_blanks

   !> The character at the place.
   pure character(1) function next(self)
      class(scanner_t), intent(in) :: self

      next = self%text(self%at:self%at)
   end function next

   !> What stands here, for a message.
   pure function found(self) result(text)
      class(scanner_t), intent(in) :: self
      character(:), allocatable :: text
      integer, parameter :: longest = 24
      integer :: length

      length = min(longest, scan(self%text(self%at:), blanks//the_end) - 1)
      text = "'"//self%text(self%at:self%at + length - 1)//"'"
      if (length > 0) return
      text = "a blank"
      if (self%next() == newline) text = "the end of the line"
      if (self%next() == the_end) text = "the end of the text"
   end function found

   !> Words in one line, strings in quotes.
   pure function words_text(words) result(text)
      type(word_t), intent(in) :: words(:)
      character(:), allocatable :: text
      integer :: i

      text = ""
      do i = 1, size(words)
         if (i > 1) text = text//", "
         if (words(i)%kind == word_string) then
            text = text//quoted(words(i)%text)
         else
            text = text//words(i)%text
         end if
      end do
   end function words_text

end module razy_input_scanner
