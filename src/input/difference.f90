!! Where two effective inputs (razy_input_effective) differ first, in words that name group and key.
!!
!! Such a text has a line `&group`, lines `   key = values`, the rest of long values on lines indented further, and `/`.
module razy_input_difference
   use razy_core_scanner, only: newline
   implicit none(type, external)
   private

   public :: first_difference

   !> One assignment, or the end of the text: group with its number among those of its name, key, values.
   type :: assignment_t
      character(:), allocatable :: group, key, values
   end type assignment_t

   !> Longer values are cut.
   integer, parameter :: longest = 60

contains

   !> The first difference, as `&group key = value, there: value`; empty if there is none.
   pure function first_difference(here, there) result(text)
      character(*), intent(in) :: here, there
      character(:), allocatable :: text

      type(assignment_t) :: mine, other
      integer :: place, other_place

      text = ""
      if (here == there .and. len(here) == len(there)) return
      place = 1
      other_place = 1
      do
         call next_assignment(here, place, mine)
         call next_assignment(there, other_place, other)
         if (mine%group /= other%group) then
            text = shown(mine, "the end of the input")//", there: "//shown(other, "the end of the input")
         else if (mine%key /= other%key) then
            text = shown(mine, "nothing more")//", there: "//shown(other, "nothing more")
         else if (mine%values /= other%values) then
            text = shown(mine, "")//", there: "//cut(other%values)
         else if (len(mine%group) == 0) then
            text = "the order or form of the groups"
         end if
         if (len(text) > 0) return
      end do
   end function first_difference

   !> The assignment that begins at or after `place`, which moves behind it; its group is empty at the end. The head of a
   !> group counts as an assignment without key.
   pure subroutine next_assignment(text, place, assignment)
      character(*), intent(in) :: text
      integer, intent(inout) :: place
      type(assignment_t), intent(inout) :: assignment

      character(:), allocatable :: line
      integer :: equals

      if (.not. allocated(assignment%group)) assignment%group = ""
      assignment%key = ""
      assignment%values = ""
      do
         if (place > len(text)) then
            assignment%group = ""
            return
         end if
         line = line_at(text, place)
         place = place + len(line) + 1
         if (line == "/" .or. len_trim(line) == 0) cycle
         if (line(1:1) == "&") then
            assignment%group = trim(line)//number_of(text, place, trim(line))
            return
         end if
         equals = index(line, "=")
         assignment%key = trim(adjustl(line(:equals - 1)))
         assignment%values = trim(adjustl(line(equals + 1:)))
         do while (place <= len(text))
            line = line_at(text, place)
            if (verify(line, " ") <= 4) exit
            assignment%values = assignment%values//" "//trim(adjustl(line))
            place = place + len(line) + 1
         end do
         return
      end do
   end subroutine next_assignment

   !> The line that begins at `place`, without its end.
   pure function line_at(text, place) result(line)
      character(*), intent(in) :: text
      integer, intent(in) :: place
      character(:), allocatable :: line

      integer :: length

      length = index(text(place:), newline) - 1
      if (length < 0) length = len(text) - place + 1
      line = text(place:place + length - 1)
   end function line_at

   !> `(2)` if the line before `place` is the second that opens this group, and so on; empty for the first.
   pure function number_of(text, place, opening) result(number)
      character(*), intent(in) :: text, opening
      integer, intent(in) :: place
      character(:), allocatable :: number

      character(12) :: digits
      integer :: at, n

      n = 0
      at = 1
      do while (at < place)
         if (line_at(text, at) == opening) n = n + 1
         at = at + len(line_at(text, at)) + 1
      end do
      number = ""
      if (n < 2) return
      write (digits, "(i0)") n
      number = "("//trim(digits)//")"
   end function number_of

   pure function shown(assignment, nothing) result(text)
      type(assignment_t), intent(in) :: assignment
      character(*), intent(in) :: nothing
      character(:), allocatable :: text

      text = assignment%group
      if (len(text) == 0) text = nothing
      if (len(assignment%key) > 0) text = text//" "//assignment%key//" = "//cut(assignment%values)
   end function shown

   pure function cut(values) result(text)
      character(*), intent(in) :: values
      character(:), allocatable :: text

      text = values
      if (len(text) > longest) text = text(:longest)//"..."
   end function cut

end module razy_input_difference
