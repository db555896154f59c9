!! Markdown documentation of a schema: one table for each group, so that the pages of the manual cannot differ from the code.
module schema_pages
   use razy_core_text, only: newline
   use razy_input_schema, only: group_spec_t, key_spec_t
   use razy_input_value, only: allowed_text, count_text
   implicit none(type, external)
   private

   public :: group_page

contains

   !> Heading, meaning, how often the group may stand, and the table of its keys.
   pure function group_page(spec) result(page)
      type(group_spec_t), intent(in) :: spec
      character(:), allocatable :: page
      character(*), parameter :: gap = newline//newline
      integer :: k

      page = "# `&"//spec%name//"`"//gap//spec%doc//gap//"Optional"// &
             trim(merge(", any number of times.", ", once.               ", spec%repeatable))//gap// &
             "| key | type | values | unit | default | allowed | meaning |"//newline//"|---|---|---|---|---|---|---|"//newline
      do k = 1, size(spec%keys)
         page = page//key_row(spec%keys(k))//newline
      end do
   end function group_page

   pure function key_row(spec) result(row)
      type(key_spec_t), intent(in) :: spec
      character(:), allocatable :: row
      !> In the order of the `type_` constants
      character(*), parameter :: types(4) = [character(7) :: "real", "integer", "logical", "string"]
      character(:), allocatable :: default

      default = "optional"
      if (allocated(spec%default)) default = "`"//spec%default//"`"
      if (spec%required) default = "required"
      row = "| `"//spec%name//"` | "//trim(types(spec%type))//" | "//count_text(spec)//" | "//cell(spec%unit)//" | "// &
            cell(default)//" | "//cell(allowed_text(spec))//" | "//cell(spec%doc)//" |"
   end function key_row

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

end module schema_pages
