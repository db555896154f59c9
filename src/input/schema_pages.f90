!! Markdown documentation of a schema: one table for each group, so that the pages of the manual cannot differ from the code.
module razy_input_schema_pages
   use razy_core_scanner, only: newline
   use razy_input_schema, only: group_spec_t, key_spec_t, type_integer, type_logical, type_real
   use razy_input_value, only: allowed_text, count_text
   implicit none(type, external)
   private

   public :: group_page, group_table

contains

   !> Heading, meaning, how often the group may stand, and the table of its keys.
   pure function group_page(spec) result(page)
      type(group_spec_t), intent(in) :: spec
      character(:), allocatable :: page
      character(:), allocatable :: times

      times = "Optional"
      if (spec%required) times = "Required"
      if (spec%repeatable) times = times//", any number of times."
      if (.not. spec%repeatable) times = times//", once."
      page = "# `&"//spec%name//"`"//newline//newline//spec%doc//newline//newline//times//newline//newline//group_table(spec)
   end function group_page

   !> The table of the keys of a group.
   pure function group_table(spec) result(table)
      type(group_spec_t), intent(in) :: spec
      character(:), allocatable :: table
      integer :: k

      table = "| key | type | values | unit | default | allowed | meaning |"//newline//"|---|---|---|---|---|---|---|"//newline
      do k = 1, size(spec%keys)
         table = table//key_row(spec%keys(k))//newline
      end do
   end function group_table

   pure function key_row(spec) result(row)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: row
      character(:), allocatable :: default

      default = "optional"
      if (allocated(spec%default)) default = "`"//spec%default//"`"
      if (spec%required) default = "required"
      row = "| `"//spec%name//"` | "//type_text(spec)//" | "//count_text(spec)//" | "//cell(spec%unit)//" | "//cell(default)// &
            " | "//cell(allowed_text(spec))//" | "//cell(spec%doc)//" |"
   end function key_row

   pure function type_text(spec) result(text)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: text

      select case (spec%type)
      case (type_real)
         text = "real"
      case (type_integer)
         text = "integer"
      case (type_logical)
         text = "logical"
      case default
         text = "string"
      end select
   end function type_text

   !> Text for a cell of a table: the bars escaped, a dash for nothing.
   pure function cell(text) result(escaped)
      character(*), intent(in) :: text
      character(:), allocatable :: escaped
      integer :: i

      escaped = ""
      do i = 1, len(text)
         if (text(i:i) == "|") escaped = escaped//"\"
         escaped = escaped//text(i:i)
      end do
      if (len(escaped) == 0) escaped = "-"
   end function cell

end module razy_input_schema_pages
