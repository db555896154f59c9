!! Text: lower case, quoting, lists, and the nearest known name for a misspelt one.
module razy_core_text
   use razy_core_kinds, only: i8
   implicit none(type, external)
   private

   public :: letters, name_characters, newline, string_t
   public :: lower, quoted, excerpt, append_text, join, position_of, edit_distance, nearest_name, did_you_mean
   public :: texts_of, text_code

   !> What a name begins with, and what may follow.
   character(*), parameter :: letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
   character(*), parameter :: name_characters = letters//"0123456789_"
   character(*), parameter :: newline = achar(10)

   !> One element of a list of texts of different lengths.
   type :: string_t
      character(:), allocatable :: text
   end type string_t

   !> Characters of what the user wrote that a message quotes at most.
   integer, parameter :: most_quoted = 80
   !> Longer texts are no misspelt names.
   integer, parameter :: longest_misspelt = 200
   !> Characters of a list of known names.
   integer, parameter :: longest_list = 240

contains

   !> `text` with the letters A-Z in lower case.
   pure function lower(text) result(small)
      character(*), intent(in) :: text
      character(len(text)) :: small
      integer :: i

      do i = 1, len(text)
         small(i:i) = text(i:i)
         if (text(i:i) >= "A" .and. text(i:i) <= "Z") small(i:i) = achar(iachar(text(i:i)) + 32)
      end do
   end function lower

   !> `text` as a namelist string: in single quotes, and after one inside another, or what `after` says.
   pure function quoted(text, after) result(written)
      character(*), intent(in) :: text
      character(*), intent(in), optional :: after
      character(:), allocatable :: more, written
      integer :: at, next

      more = "'"
      if (present(after)) more = after
      written = "'"
      at = 1
      do
         next = at + index(text(at:), "'")
         if (next == at) exit
         written = written//text(at:next - 1)//more
         at = next
      end do
      written = written//text(at:)//"'"
   end function quoted

   !> `text`, or its beginning when it is too long for a message.
   pure function excerpt(text) result(cut)
      character(*), intent(in) :: text
      character(:), allocatable :: cut

      cut = text
      if (len(text) > most_quoted) cut = text(:most_quoted - 3)//"..."
   end function excerpt

   !> Add a text at the end of a list. (gfortran 12 cuts texts in `[list, string_t(text)]`.)
   pure subroutine append_text(list, text)
      type(string_t), allocatable, intent(inout) :: list(:)
      character(*), intent(in) :: text
      type(string_t), allocatable :: longer(:)
      integer :: i

      allocate (longer(size(list) + 1))
      do i = 1, size(list)
         call move_alloc(list(i)%text, longer(i)%text)
      end do
      longer(size(longer))%text = text
      call move_alloc(longer, list)
   end subroutine append_text

   !> The texts one after the other with `separator` between them.
   pure function join(list, separator) result(joined)
      type(string_t), intent(in) :: list(:)
      character(*), intent(in) :: separator
      character(:), allocatable :: joined
      integer :: i

      joined = ""
      do i = 1, size(list)
         if (i > 1) joined = joined//separator
         joined = joined//list(i)%text
      end do
   end function join

   !> A list of these texts without their trailing blanks.
   pure function texts_of(values) result(texts)
      character(*), intent(in) :: values(:)
      type(string_t), allocatable :: texts(:)

      integer :: i

      allocate (texts(size(values)))
      do i = 1, size(values)
         texts(i)%text = trim(values(i))
      end do
   end function texts_of

   !> Place of `text` in `list` without regard to case; 0 when it is not there.
   pure integer function position_of(text, list)
      character(*), intent(in) :: text
      type(string_t), intent(in) :: list(:)

      do position_of = 1, size(list)
         if (len(list(position_of)%text) /= len(text)) cycle
         if (lower(list(position_of)%text) == lower(text)) return
      end do
      position_of = 0
   end function position_of

   !> A number by which a text is told from others: two that differ have the same by chance only, one in 2**53. Trailing blanks do
   !> not count.
   pure integer(i8) function text_code(text) result(code)
      character(*), intent(in) :: text

      integer :: i

      code = 0
      do i = 1, len_trim(text)
         code = iand(257*code + iachar(text(i:i)), 2_i8**53 - 1)
      end do
   end function text_code

   !> Number of insertions, deletions, replacements and swaps of neighbours that lead from `a` to `b`
   !> (optimal string alignment: no part is edited twice).
   pure integer function edit_distance(a, b) result(distance)
      character(*), intent(in) :: a, b
      integer :: row(0:len(b)), above(0:len(b)), second_above(0:len(b))
      integer :: i, j, replaced

      above = [(j, j=0, len(b))]
      second_above = above
      row = above
      do i = 1, len(a)
         row(0) = i
         do j = 1, len(b)
            replaced = above(j - 1) + merge(0, 1, a(i:i) == b(j:j))
            row(j) = min(above(j) + 1, row(j - 1) + 1, replaced)
            if (i > 1 .and. j > 1) then
               if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) row(j) = min(row(j), second_above(max(j - 2, 0)) + 1)
            end if
         end do
         second_above = above
         above = row
      end do
      distance = row(len(b))
   end function edit_distance

   !> The known name that was probably meant: within a third of the letters, else the only one that begins with what was written,
   !> or has it behind a %; case does not matter; empty when nothing is near.
   pure function nearest_name(name, known) result(best)
      character(*), intent(in) :: name
      type(string_t), intent(in) :: known(:)
      character(:), allocatable :: best
      !> Shorter names begin too many others
      integer, parameter :: least_part = 3
      integer :: begun, distance, i, least
      logical :: part

      best = ""
      least = huge(0)
      begun = 0
      if (len(name) > longest_misspelt) return
      do i = 1, size(known)
         if (len(known(i)%text) > longest_misspelt) cycle
         distance = edit_distance(lower(name), lower(known(i)%text))
         if (distance <= max(1, (len(name) + 1)/3)) then
            if (distance < least) best = known(i)%text
            least = min(distance, least)
            cycle
         end if
         part = index(lower(known(i)%text), lower(name)) == 1 .or. index(lower(known(i)%text)//" ", "%"//lower(name)//" ") > 0
         if (part .and. len(name) >= least_part) then
            begun = begun + 1
            if (least == huge(0)) best = known(i)%text
         end if
      end do
      if (least == huge(0) .and. begun > 1) best = ""
   end function nearest_name

   !> Advice for a misspelt name: `did you mean 'x'?`, else the list `known <things>: a, b, c`.
   pure function did_you_mean(name, known, things) result(advice)
      character(*), intent(in) :: name
      type(string_t), intent(in) :: known(:)
      !> What the names are, in the plural
      character(*), intent(in) :: things
      character(:), allocatable :: advice
      integer :: i

      advice = nearest_name(name, known)
      if (len(advice) > 0) then
         advice = "did you mean '"//advice//"'?"
      else if (size(known) > 0) then
         advice = "known "//things//": "//excerpt(known(1)%text)
         do i = 2, size(known)
            if (len(advice) + len(excerpt(known(i)%text)) > longest_list) exit
            advice = advice//", "//excerpt(known(i)%text)
         end do
         if (i <= size(known)) advice = advice//", and others"
      else
         advice = "there are no "//things
      end if
   end function did_you_mean

end module razy_core_text
