!! Where two effective inputs differ first, in words that name group and key.
module razy_input_difference
   use razy_core_error, only: error_t
   use razy_core_text, only: excerpt, string_t
   use razy_input_reader, only: entries_t, indexed, read_entries
   use razy_input_scanner, only: words_text
   implicit none(type, external)
   private

   public :: first_difference

contains

   !> The first difference, as `&group key = value, there: value`; empty if there is none.
   pure function first_difference(here, there) result(text)
      character(*), intent(in) :: here, there
      character(:), allocatable :: text
      type(entries_t) :: mine, other
      type(error_t), allocatable :: error
      character(:), allocatable :: value
      integer :: i, place

      text = ""
      if (here == there .and. len(here) == len(there)) return
      call read_entries(mine, here, "here", [string_t ::], error)
      if (.not. allocated(error)) call read_entries(other, there, "there", [string_t ::], error)
      if (.not. allocated(error)) then
         do i = 1, max(size(mine%list), size(other%list))
            text = statement(mine, i)
            value = statement(other, i)
            if (text == value) cycle
            ! what is there of the same key is told by its value alone
            place = index(text, " = ")
            if (place > 0 .and. index(value, text(:place + 2)) == 1) value = value(place + 3:)
            text = excerpt(text)//", there: "//excerpt(value)
            return
         end do
      end if
      text = "the order or form of the groups"
   end function first_difference

   !> What entry i says: `&load(2)` or `&load(2) value = 1.0`.
   pure function statement(said, i) result(text)
      type(entries_t), intent(in) :: said
      integer, intent(in) :: i
      character(:), allocatable :: text

      text = "the end of the input"
      if (i > size(said%list)) return
      associate (path => said%list(i)%path)
         text = "&"//indexed(path%group, merge(path%index, 0, path%index > 1))
         if (len(path%key) > 0) text = text//" "//path%key//" = "//words_text(said%list(i)%words)
      end associate
   end function statement

end module razy_input_difference
