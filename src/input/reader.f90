!! What an input says, before any schema is applied: entries, one for each `&group`, each `key = words` and each `--set`.
!!
!! A text is Fortran namelists. Accepted: `&name ... /` and `&name ... &end`, any case, comments after `!`, words separated
!! by commas, blanks or line ends, both quotes (the quote doubled stands for itself), repeat counts `3*0.0`, subscripts
!! `key(2)` and `key(2:3)`. Stricter than Fortran's own reading, on purpose: text between groups, strings over several lines,
!! null values and complex numbers are errors.
module razy_input_reader
   use razy_core_error, only: complaint, error_t, from_option, raise, refuse
   use razy_core_kinds, only: i8
   use razy_core_number, only: number_ok, parse_integer, to_text
   use razy_core_text, only: excerpt, lower, string_t, text_code
   use razy_input_scanner, only: longest_list, scanner_t, separators, the_end, word_t
   implicit none(type, external)
   private

   public :: path_t, entry_t, entries_t, read_entries, read_path, read_words, indexed, pick

   !> Characters of a group's name, as Fortran has it: every entry has a copy of it.
   integer, parameter :: longest_name = 63
   !> Path to a value, `group(index)%key(element)`, in lower case; index and element are 0 where they are not given.
   type :: path_t
      character(:), allocatable :: group, key
      integer :: index = 0, element = 0
   end type path_t

   !> `&group` (without key), `key = words` in it, or `--set group%key=words`.
   type :: entry_t
      !> For entries of the file with the number of the group among those of its name
      type(path_t) :: path
      !> Last element; the first one is that of the path
      integer :: last = 0
      !> 0 for the command line
      integer :: line = 0
      type(word_t), allocatable :: words(:)
      !> The words from the command line, which only the type of the key tells apart; not allocated for an entry of the file
      character(:), allocatable :: option
   end type entry_t

   !> All entries of a text in their order, then those of the command line. `file` is the name for messages.
   type :: entries_t
      character(:), allocatable :: file
      type(entry_t), allocatable :: list(:)
   end type entries_t

contains

   !> Those of the entries that are `wanted`.
   pure subroutine pick(said, wanted, part)
      type(entries_t), intent(in) :: said
      logical, intent(in) :: wanted(:)
      type(entries_t), intent(out) :: part

      integer :: i
      integer, allocatable :: places(:)

      places = pack([(i, i=1, size(wanted))], wanted)
      part%file = said%file
      allocate (part%list(size(places)))
      do i = 1, size(places)
         part%list(i) = said%list(places(i))
      end do
   end subroutine pick

   !> Read a text of namelists, whose lines end with a line feed (see `read_text_file`), and options `GROUP%KEY=VALUE` or
   !> `GROUP(2)%KEY=VALUE`. Errors: `file:line: &group key: problem`.
   pure subroutine read_entries(self, text, file, options, error)
      type(entries_t), intent(out) :: self
      character(*), intent(in) :: text, file
      type(string_t), intent(in) :: options(:)
      type(error_t), allocatable, intent(out) :: error
      type(scanner_t) :: scanner
      integer :: equals, i, n
      logical :: ok

      self%file = file
      ! one more for an entry that is wrong
      n = 1 + size(options)
      do i = 1, len(text)
         if (scan(text(i:i), "&=") == 1) n = n + 1
      end do
      allocate (self%list(n))
      n = 0
      scanner%text = text//the_end
      do
         call scanner%skip_blanks()
         if (scanner%next() == the_end) exit
         call read_group(scanner, self%list, n)
         if (.not. allocated(scanner%problem)) cycle
         call raise(error, complaint(file//":"//to_text(scanner%line), scanner%group, scanner%key, "", scanner%problem))
         return
      end do
      call number_groups(self%list(:n))
      if (n == 0) call refuse(error, file, "there is no namelist group (&name ... /)")
      do i = 1, size(options)
         if (allocated(error)) return
         n = n + 1
         associate (item => self%list(n), option => options(i)%text)
            equals = index(option//"=", "=")
            call read_path(option(:equals - 1), item%path, ok)
            item%last = item%path%element
            item%option = trim(adjustl(option(equals + 1:)))
            if (ok .and. equals <= len(option)) cycle
            call refuse(error, from_option, "'"//excerpt(option)//"' must be GROUP%KEY=VALUE or GROUP(n)%KEY=VALUE")
         end associate
      end do
      if (n < size(self%list)) self%list = self%list(:n)
   end subroutine read_entries

   !> Read one group: its head and its entries follow the first `n` of the list.
   pure subroutine read_group(scanner, list, n)
      type(scanner_t), intent(inout) :: scanner
      type(entry_t), intent(inout) :: list(:)
      integer, intent(inout) :: n
      character(:), allocatable :: name
      integer :: head

      scanner%group = ""
      scanner%key = ""
      if (scanner%next() /= "&") then
         scanner%problem = "found "//scanner%found()//" outside of a group (&name ... /): / ends a group, ! begins a comment"
         return
      end if
      scanner%at = scanner%at + 1
      call scanner%take_name(name)
      if (lower(name) == "end") then
         scanner%problem = "&end without a group"
      else if (len(name) == 0 .or. scan(scanner%next(), separators) == 0) then
         scanner%problem = "found "//scanner%found()//" where the name of a group must follow &"
      else if (len(name) > longest_name) then
         scanner%problem = "the name &"//excerpt(name)//" has more than "//to_text(longest_name)//" characters"
      end if
      if (allocated(scanner%problem)) return
      scanner%group = lower(name)
      head = n + 1
      list(head)%path%group = scanner%group
      list(head)%path%key = ""
      list(head)%line = scanner%line
      n = head
      do
         call scanner%skip_blanks()
         scanner%key = ""
         select case (scanner%next())
         case ("/")
            scanner%at = scanner%at + 1
            return
         case ("&")
            scanner%at = scanner%at + 1
            call scanner%take_name(name)
            if (lower(name) == "end") return
            scanner%problem = "this group is not closed by / before &"//excerpt(name)//" in line "//to_text(scanner%line)
            exit
         case (the_end)
            scanner%problem = "this group is not closed by /"
            exit
         case default
            n = n + 1
            list(n)%path = list(head)%path
            call read_entry(scanner, list(n))
            if (allocated(scanner%problem)) return
         end select
      end do
      scanner%line = list(head)%line
   end subroutine read_group

   !> Number the groups of each name, and their keys with them.
   pure subroutine number_groups(list)
      type(entry_t), intent(inout) :: list(:)
      integer(i8), allocatable :: code(:)
      integer, allocatable :: heads(:)
      integer :: i

      heads = pack([(i, i=1, size(list))], [(len(list(i)%path%key) == 0, i=1, size(list))])
      code = [(text_code(list(heads(i))%path%group), i=1, size(heads))]
      do i = 1, size(heads)
         list(heads(i))%path%index = count(code(:i) == code(i))
      end do
      do i = 2, size(list)
         if (len(list(i)%path%key) > 0) list(i)%path%index = list(i - 1)%path%index
      end do
   end subroutine number_groups

   !> Read `key = words` or `key(first:last) = words`.
   pure subroutine read_entry(scanner, item)
      type(scanner_t), intent(inout) :: scanner
      type(entry_t), intent(inout) :: item

      item%line = scanner%line
      call take_part(scanner, item%path%key, item%path%element, item%last)
      scanner%key = item%path%key
      if (allocated(scanner%problem)) return
      if (len(scanner%key) == 0) then
         scanner%problem = "found "//scanner%found()//" where a key (key = value) or / must stand"
      else if (scanner%next() /= "=") then
         scanner%problem = "found "//scanner%found()//" where = must follow the key"
      else
         scanner%at = scanner%at + 1
         call scanner%scan_words(item%words)
         if (allocated(scanner%problem) .or. item%last == 0) return
         if (size(item%words) == item%last - item%path%element + 1) return
         scanner%problem = "there must be as many values as the subscript names elements"
      end if
   end subroutine read_entry

   !> Read a path that is a text of its own; `ok` is false when it is not of the form of a path.
   pure subroutine read_path(text, path, ok)
      character(*), intent(in) :: text
      type(path_t), intent(out) :: path
      logical, intent(out) :: ok
      type(scanner_t) :: scanner
      integer :: last(2)

      scanner%text = text//the_end
      call scanner%skip_blanks()
      call take_part(scanner, path%group, path%index, last(1))
      ok = len(path%group) > 0 .and. scanner%next() == "%"
      if (ok) scanner%at = scanner%at + 1
      call scanner%skip_blanks()
      call take_part(scanner, path%key, path%element, last(2))
      ok = ok .and. len(path%key) > 0 .and. scanner%next() == the_end .and. .not. allocated(scanner%problem) &
           .and. all(last == [path%index, path%element])
   end subroutine read_path

   !> Take `name`, `name(first)` or `name(first:last)`, in lower case, and blanks behind it; what is not there is empty or 0.
   pure subroutine take_part(scanner, name, first, last)
      type(scanner_t), intent(inout) :: scanner
      character(:), allocatable, intent(out) :: name
      integer, intent(out) :: first, last
      character(:), allocatable :: text
      integer :: colon, length, status(2)

      first = 0
      last = 0
      call scanner%take_name(name)
      name = lower(name)
      call scanner%skip_blanks()
      if (len(name) == 0 .or. scanner%next() /= "(") return
      length = index(scanner%text(scanner%at:), ")")
      text = scanner%text(scanner%at + 1:scanner%at + length - 2)
      scanner%at = scanner%at + length
      if (index(text, ":") == 0) text = text//":"//text
      colon = index(text, ":")
      call parse_integer(trim(adjustl(text(:colon - 1))), first, status(1))
      call parse_integer(trim(adjustl(text(colon + 1:))), last, status(2))
      if (any(status /= number_ok) .or. first < 1 .or. last < first .or. last > longest_list) then
         scanner%problem = "the subscript must be (n) or (n:m) with 1 <= n <= m <= "//to_text(longest_list)
      end if
      call scanner%skip_blanks()
   end subroutine take_part

   !> Read words that are a text of their own, as they follow `=`.
   pure subroutine read_words(text, words, problem)
      character(*), intent(in) :: text
      type(word_t), allocatable, intent(out) :: words(:)
      character(:), allocatable, intent(out) :: problem
      type(scanner_t) :: scanner

      scanner%text = text//the_end
      call scanner%scan_words(words)
      if (.not. allocated(scanner%problem) .and. scanner%next() /= the_end) then
         scanner%problem = "found "//scanner%found()//" among the values"
      end if
      call move_alloc(scanner%problem, problem)
   end subroutine read_words

   !> `name(number)`, or only the name when the number is 0.
   pure function indexed(name, number) result(text)
      character(*), intent(in) :: name
      integer, intent(in) :: number
      character(:), allocatable :: text

      text = name
      if (number > 0) text = name//"("//to_text(number)//")"
   end function indexed

end module razy_input_reader
