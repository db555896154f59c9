!! Paths to a value of an input: `group%key`, `group(2)%key`, `group%key(3)`, in any case.
module razy_input_path
   use razy_core_number, only: number_ok, parse_integer, to_text
   use razy_core_text, only: is_name, lower
   implicit none(type, external)
   private

   public :: path_t, parse_path, path_text

   !> The parts of a path in lower case; 0 stands for an index or element that is not given.
   type :: path_t
      character(:), allocatable :: group
      integer :: index = 0
      character(:), allocatable :: key
      integer :: element = 0
   end type path_t

contains

   !> Read a path; `ok` is false when `text` is not of the form of a path.
   pure subroutine parse_path(text, path, ok)
      character(*), intent(in) :: text
      type(path_t), intent(out) :: path
      logical, intent(out) :: ok
      integer :: percent

      path%group = ""
      path%key = ""
      percent = index(text, "%")
      ok = percent > 0
      if (.not. ok) return
      call parse_part(text(:percent - 1), path%group, path%index, ok)
      if (ok) call parse_part(text(percent + 1:), path%key, path%element, ok)
   end subroutine parse_path

   !> Read `name` or `name(number)`.
   pure subroutine parse_part(text, name, number, ok)
      character(*), intent(in) :: text
      character(:), allocatable, intent(out) :: name
      integer, intent(out) :: number
      logical, intent(out) :: ok
      character(:), allocatable :: part
      integer :: parenthesis, status

      part = lower(trim(adjustl(text)))
      number = 0
      status = number_ok
      parenthesis = index(part, "(")
      name = part
      if (parenthesis > 0) then
         name = trim(part(:parenthesis - 1))
         call parse_integer(trim(adjustl(part(parenthesis + 1:len(part) - 1))), number, status)
         if (number < 1 .or. index(part, ")") /= len(part)) status = number_ok + 1
      end if
      ok = is_name(name) .and. status == number_ok
   end subroutine parse_part

   !> A path as text.
   pure function path_text(group, index, key, element) result(text)
      character(*), intent(in) :: group, key
      !> Left out when 0
      integer, intent(in) :: index, element
      character(:), allocatable :: text

      text = group
      if (index > 0) text = text//"("//to_text(index)//")"
      text = text//"%"//key
      if (element > 0) text = text//"("//to_text(element)//")"
   end function path_text

end module razy_input_path
