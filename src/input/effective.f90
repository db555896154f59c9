!! The effective input as text: every group of the input with every value, defaults included.
!!
!! It is valid for Fortran's own namelist reading, and reading it back gives the same bits and the same text.
module razy_input_effective
   use razy_input_document, only: document_t
   use razy_core_scanner, only: newline
   use razy_input_value, only: element_text, value_t
   implicit none(type, external)
   private

   public :: effective_text

   !> Longest line, unless a single string is longer.
   integer, parameter :: width = 132
   character(*), parameter :: indent = "   "

contains

   !> Groups in the order of the input, keys in the order of the schema; keys without value are left out.
   pure function effective_text(document) result(text)
      type(document_t), intent(in) :: document
      character(:), allocatable :: text
      integer :: i, k

      text = ""
      if (.not. allocated(document%instances)) return
      do i = 1, size(document%instances)
         associate (instance => document%instances(i), spec => document%schema(document%instances(i)%spec))
            text = text//"&"//spec%name//newline
            do k = 1, size(spec%keys)
               if (instance%values(k)%count() > 0) text = text//assignment_text(spec%keys(k)%name, instance%values(k))
            end do
            text = text//"/"//newline
         end associate
      end do
   end function effective_text

   !> `key = value, value`, in as many lines as it needs.
   pure function assignment_text(name, value) result(text)
      character(*), intent(in) :: name
      type(value_t), intent(in) :: value
      character(:), allocatable :: text
      character(:), allocatable :: element
      integer :: i, column

      text = indent//name//" ="
      column = len(text)
      do i = 1, value%count()
         element = element_text(value, i)
         if (i < value%count()) element = element//","
         if (column + 1 + len(element) > width .and. i > 1) then
            text = text//newline//indent//indent//element
            column = 2*len(indent) + len(element)
         else
            text = text//" "//element
            column = column + 1 + len(element)
         end if
      end do
      text = text//newline
   end function assignment_text

end module razy_input_effective
