!! A place in a text of namelists, and what can be taken from there: blanks and comments, names, strings, words.
module razy_core_scanner
   use razy_core_text, only: letters
   implicit none(type, external)
   private

   public :: scanner_t, tab, newline

   character(*), parameter :: tab = achar(9), newline = achar(10)
   !> What ends an unquoted value.
   character(*), parameter :: delimiters = " "//tab//newline//',/!=()&;"'//"'"

   !> The text and the place reached in it; lines end with `newline`.
   type :: scanner_t
      character(:), allocatable :: text
      integer :: at = 1
      integer :: line = 1
   contains
      procedure :: at_end
      procedure :: next
      procedure :: skip_blanks
      procedure :: take_name
      procedure :: take_word
      procedure :: take_string
      procedure :: look_for_key
      procedure :: at_separator
      procedure :: found
   end type scanner_t

contains

   pure logical function at_end(self)
      class(scanner_t), intent(in) :: self

      at_end = self%at > len(self%text)
   end function at_end

   !> The character at the place reached; a newline at the end of the text.
   pure character(1) function next(self)
      class(scanner_t), intent(in) :: self

      next = newline
      if (.not. self%at_end()) next = self%text(self%at:self%at)
   end function next

   !> Go on to what is neither blank nor comment.
   pure subroutine skip_blanks(self)
      class(scanner_t), intent(inout) :: self
      integer :: length

      do while (.not. self%at_end())
         select case (self%next())
         case (" ", tab)
            self%at = self%at + 1
         case (newline)
            self%at = self%at + 1
            self%line = self%line + 1
         case ("!")
            length = index(self%text(self%at:), newline) - 1
            if (length < 0) length = len(self%text) + 1 - self%at
            self%at = self%at + length
         case default
            return
         end select
      end do
   end subroutine skip_blanks

   !> Take letters, digits and underscores; empty unless they begin with a letter here.
   pure subroutine take_name(self, name)
      class(scanner_t), intent(inout) :: self
      character(:), allocatable, intent(out) :: name
      integer :: length

      length = verify(self%text(self%at:), letters//"0123456789_") - 1
      if (length < 0) length = len(self%text) + 1 - self%at
      if (scan(self%next(), letters) == 0) length = 0
      name = self%text(self%at:self%at + length - 1)
      self%at = self%at + length
   end subroutine take_name

   !> Take what stands up to the next delimiter; empty at a delimiter.
   pure subroutine take_word(self, word)
      class(scanner_t), intent(inout) :: self
      character(:), allocatable, intent(out) :: word
      integer :: length

      length = scan(self%text(self%at:), delimiters) - 1
      if (length < 0) length = len(self%text) + 1 - self%at
      word = self%text(self%at:self%at + length - 1)
      self%at = self%at + length
   end subroutine take_word

   !> Take the string that begins with the quote here; the quote written twice stands for itself.
   pure subroutine take_string(self, string, closed)
      class(scanner_t), intent(inout) :: self
      character(:), allocatable, intent(out) :: string
      !> Whether the string ends on its line
      logical, intent(out) :: closed
      character(1) :: quote
      integer :: length

      quote = self%next()
      self%at = self%at + 1
      string = ""
      do
         length = scan(self%text(self%at:), quote//newline) - 1
         closed = length >= 0
         if (closed) closed = self%text(self%at + length:self%at + length) == quote
         if (.not. closed) return
         string = string//self%text(self%at:self%at + length - 1)
         self%at = self%at + length + 1
         if (self%next() /= quote) return
         string = string//quote
         self%at = self%at + 1
      end do
   end subroutine take_string

   !> Whether a key stands here: a name, then `=` or `(`, perhaps after blanks. The place reached does not change.
   pure subroutine look_for_key(self, at_key)
      class(scanner_t), intent(inout) :: self
      logical, intent(out) :: at_key
      character(:), allocatable :: name
      integer :: at, line

      at = self%at
      line = self%line
      call self%take_name(name)
      at_key = len(name) > 0
      if (at_key) then
         call self%skip_blanks()
         at_key = scan(self%next(), "=(") == 1
      end if
      self%at = at
      self%line = line
   end subroutine look_for_key

   !> Whether what stands here separates two values.
   pure logical function at_separator(self)
      class(scanner_t), intent(in) :: self

      at_separator = scan(self%next(), " "//tab//newline//",/!&") == 1
   end function at_separator

   !> What stands here, for a message.
   pure function found(self) result(text)
      class(scanner_t), intent(in) :: self
      character(:), allocatable :: text
      integer, parameter :: longest = 24
      integer :: length

      if (self%at_end()) then
         text = "the end of the text"
         return
      end if
      length = scan(self%text(self%at:), newline//tab//" ") - 1
      if (length == 0) then
         text = "a blank"
         if (self%next() == newline) text = "the end of the line"
         return
      end if
      if (length < 0) length = len(self%text) + 1 - self%at
      text = "'"//self%text(self%at:self%at + min(length, longest) - 1)//"'"
   end function found

end module razy_core_scanner
