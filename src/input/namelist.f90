!! Text to raw document: Fortran namelists with repeated groups, in the order of the file, before any schema is applied.
!!
!! Accepted: `&name ... /` and `&name ... &end`, any case, comments after `!`, values separated by commas, blanks or line ends,
!! both quotes (the quote doubled stands for itself), repeat counts `3*0.0`, subscripts `key(2)` and `key(2:3)`.
!! Stricter than Fortran's own reading, on purpose: text between groups, strings over several lines, null values and
!! complex numbers are errors.
module razy_input_namelist
   use razy_core_error, only: complaint, error_t, from_option, raise
   use razy_core_number, only: number_ok, parse_integer, to_text
   use razy_core_scanner, only: scanner_t
   use razy_core_text, only: lower
   use razy_input_token, only: longest_list, parse_tokens, token_t
   implicit none(type, external)
   private

   public :: entry_t, raw_group_t, raw_document_t
   public :: parse_namelist, append_group, append_entry, group_label, origin_of

   !> One `key = values`, or one value set from the command line.
   type :: entry_t
      !> Lower case
      character(:), allocatable :: key
      integer :: line = 0
      !> Subscripts; 0 when the key has none
      integer :: first = 0, last = 0
      type(token_t), allocatable :: values(:)
      !> Values as written on the command line; not allocated for an entry of the file
      character(:), allocatable :: option
   end type entry_t

   !> One `&name ... /`; line 0 when the command line made it.
   type :: raw_group_t
      !> Lower case
      character(:), allocatable :: name
      integer :: line = 0
      type(entry_t), allocatable :: entries(:)
   end type raw_group_t

   !> All groups of a text in their order; `file` is the name used in messages.
   type :: raw_document_t
      character(:), allocatable :: file
      type(raw_group_t), allocatable :: groups(:)
   end type raw_document_t

contains

   !> Read all groups of `text`. Errors: `file:line: &group: what is wrong`.
   pure subroutine parse_namelist(text, file, document, error)
      !> Lines end with a line feed (see `read_text_file`)
      character(*), intent(in) :: text
      character(*), intent(in) :: file
      type(raw_document_t), intent(out) :: document
      type(error_t), allocatable, intent(out) :: error
      type(scanner_t) :: scanner
      type(raw_group_t) :: group
      character(:), allocatable :: key, problem
      integer :: line

      document%file = file
      allocate (document%groups(0))
      scanner%text = text
      do
         call scanner%skip_blanks()
         if (scanner%at_end()) exit
         call parse_group(scanner, group, line, key, problem)
         if (allocated(problem)) then
            call raise(error, complaint(file//":"//to_text(line), group%name, key, "", problem))
            return
         end if
         call append_group(document, group)
      end do
      if (size(document%groups) == 0) call raise(error, complaint(file, "", "", "", "there is no namelist group (&name ... /)"))
   end subroutine parse_namelist

   !> Read one group; `problem` is allocated when that fails and then belongs to `line` and `key` (empty: to the group).
   pure subroutine parse_group(scanner, group, line, key, problem)
      type(scanner_t), intent(inout) :: scanner
      type(raw_group_t), intent(out) :: group
      integer, intent(out) :: line
      character(:), allocatable, intent(out) :: key
      character(:), allocatable, intent(out) :: problem
      type(entry_t) :: item
      character(:), allocatable :: name
      integer :: started

      started = scanner%line
      line = started
      key = ""
      group%name = ""
      group%line = started
      allocate (group%entries(0))
      if (scanner%next() /= "&") then
         problem = "found "//scanner%found()//" outside of a group (&name ... /); a comment begins with !"
         return
      end if
      scanner%at = scanner%at + 1
      call scanner%take_name(name)
      if (len(name) == 0 .or. lower(name) == "end" .or. .not. scanner%at_separator()) then
         problem = "found "//scanner%found()//" where the name of a group must follow &"
         if (lower(name) == "end") problem = "&end without a group"
         return
      end if
      group%name = lower(name)
      do
         call scanner%skip_blanks()
         line = scanner%line
         if (scanner%at_end()) exit
         select case (scanner%next())
         case ("/")
            scanner%at = scanner%at + 1
            return
         case ("&")
            scanner%at = scanner%at + 1
            call scanner%take_name(name)
            if (lower(name) == "end") return
            problem = "this group is not closed by / before &"//name//" in line "//to_text(scanner%line)
            line = started
            return
         case default
            call parse_entry(scanner, item, problem)
            line = scanner%line
            if (allocated(problem)) then
               key = item%key
               return
            end if
            call append_entry(group, item)
         end select
      end do
      line = started
      problem = "this group is not closed by /"
   end subroutine parse_group

   !> Read `key = values` or `key(first:last) = values`.
   pure subroutine parse_entry(scanner, item, problem)
      type(scanner_t), intent(inout) :: scanner
      type(entry_t), intent(out) :: item
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: name

      item%line = scanner%line
      call scanner%take_name(name)
      item%key = lower(name)
      if (len(name) == 0) then
         problem = "found "//scanner%found()//" where a key (key = value) or / must stand"
         return
      end if
      call scanner%skip_blanks()
      if (scanner%next() == "(") then
         call parse_subscript(scanner, item, problem)
         if (allocated(problem)) return
         call scanner%skip_blanks()
      end if
      if (scanner%next() /= "=") then
         problem = "found "//scanner%found()//" where = must follow the key"
         return
      end if
      scanner%at = scanner%at + 1
      call parse_tokens(scanner, item%values, problem)
      if (allocated(problem)) return
      if (item%first > 0 .and. size(item%values) /= item%last - item%first + 1) then
         problem = "there must be as many values as the subscript names elements"
      end if
   end subroutine parse_entry

   !> Read `(n)` or `(n:m)`.
   pure subroutine parse_subscript(scanner, item, problem)
      type(scanner_t), intent(inout) :: scanner
      type(entry_t), intent(inout) :: item
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: text
      integer :: colon, length, status(2)

      length = index(scanner%text(scanner%at:), ")")
      text = scanner%text(scanner%at + 1:scanner%at + length - 2)
      colon = index(text, ":")
      if (colon == 0) text = text//":"//text
      colon = index(text, ":")
      call parse_integer(trim(adjustl(text(:colon - 1))), item%first, status(1))
      call parse_integer(trim(adjustl(text(colon + 1:))), item%last, status(2))
      if (any(status /= number_ok) .or. item%first < 1 .or. item%last < item%first .or. item%last > longest_list) then
         problem = "the subscript must be (n) or (n:m) with 1 <= n <= m <= "//to_text(longest_list)
         return
      end if
      scanner%at = scanner%at + length
   end subroutine parse_subscript

   !> Add a group at the end.
   pure subroutine append_group(document, group)
      type(raw_document_t), intent(inout) :: document
      type(raw_group_t), intent(in) :: group
      type(raw_group_t), allocatable :: longer(:)
      integer :: count, i

      count = size(document%groups)
      allocate (longer(count + 1))
      do i = 1, count
         call move_alloc(document%groups(i)%name, longer(i)%name)
         call move_alloc(document%groups(i)%entries, longer(i)%entries)
         longer(i)%line = document%groups(i)%line
      end do
      longer(count + 1) = group
      call move_alloc(longer, document%groups)
   end subroutine append_group

   !> Add an entry at the end.
   pure subroutine append_entry(group, item)
      type(raw_group_t), intent(inout) :: group
      type(entry_t), intent(in) :: item
      type(entry_t), allocatable :: longer(:)
      integer :: count

      count = size(group%entries)
      allocate (longer(count + 1))
      longer(:count) = group%entries
      longer(count + 1) = item
      call move_alloc(longer, group%entries)
   end subroutine append_entry

   !> Name of a group for messages, with its index where the name is repeated: `load(2)`.
   pure function group_label(document, group) result(label)
      type(raw_document_t), intent(in) :: document
      !> Index among all groups
      integer, intent(in) :: group
      character(:), allocatable :: label
      integer :: before, i, total

      label = document%groups(group)%name
      before = 0
      total = 0
      do i = 1, size(document%groups)
         if (document%groups(i)%name /= label) cycle
         total = total + 1
         if (i <= group) before = before + 1
      end do
      if (total > 1) label = label//"("//to_text(before)//")"
   end function group_label

   !> `file:line`, or the command line's option for what has no line.
   pure function origin_of(document, line) result(origin)
      type(raw_document_t), intent(in) :: document
      integer, intent(in) :: line
      character(:), allocatable :: origin

      origin = from_option
      if (line > 0) origin = document%file//":"//to_text(line)
   end function origin_of

end module razy_input_namelist
