!! Values from the command line, `GROUP%KEY=VALUE` or `GROUP(2)%KEY=VALUE`, put into a raw document before it is checked.
module razy_input_override
   use razy_core_error, only: complaint, error_t, from_option, raise
   use razy_input_namelist, only: append_entry, append_group, entry_t, raw_document_t, raw_group_t
   use razy_core_number, only: to_text
   use razy_input_path, only: parse_path, path_t
   use razy_input_schema, only: group_at, group_names, group_spec_t, key_at, key_names
   use razy_core_text, only: did_you_mean, string_t
   implicit none(type, external)
   private

   public :: apply_overrides, parse_override

contains

   !> Apply the overrides in their order; of two for the same key the later one holds.
   !> A group that is absent and not repeatable is made at the end of the document.
   pure subroutine apply_overrides(document, schema, overrides, error)
      type(raw_document_t), intent(inout) :: document
      type(group_spec_t), intent(in) :: schema(:)
      type(string_t), intent(in) :: overrides(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(overrides)
         call apply_override(document, schema, overrides(i)%text, error)
         if (allocated(error)) return
      end do
   end subroutine apply_overrides

   pure subroutine apply_override(document, schema, text, error)
      type(raw_document_t), intent(inout) :: document
      type(group_spec_t), intent(in) :: schema(:)
      character(*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error
      type(path_t) :: path
      type(entry_t) :: item
      type(raw_group_t) :: group
      character(:), allocatable :: label, problem
      integer :: key, spec, target

      call parse_override(text, path, item, error)
      if (allocated(error)) return
      label = path%group
      if (path%index > 0) label = label//"("//to_text(path%index)//")"
      spec = group_at(schema, path%group)
      if (spec == 0) then
         problem = "there is no such group; "//did_you_mean(path%group, group_names(schema), "groups")
      else
         key = key_at(schema(spec), path%key)
         if (key == 0) then
            problem = "there is no such key; "//did_you_mean(path%key, key_names(schema(spec)), "keys")
         else if (item%first > schema(spec)%keys(key)%most) then
            problem = "the highest subscript of '"//path%key//"' is "//to_text(schema(spec)%keys(key)%most)
         else
            call find_target(document, schema(spec), path, target, problem)
         end if
      end if
      if (allocated(problem)) then
         call raise(error, complaint(from_option, label, path%key, item%option, problem))
         return
      end if
      if (target == 0) then
         group%name = path%group
         allocate (group%entries(0))
         call append_group(document, group)
         target = size(document%groups)
      end if
      call append_entry(document%groups(target), item)
   end subroutine apply_override

   !> Split `GROUP%KEY=VALUE`, without looking at the value.
   pure subroutine parse_override(text, path, item, error)
      character(*), intent(in) :: text
      type(path_t), intent(out) :: path
      type(entry_t), intent(out) :: item
      type(error_t), allocatable, intent(out) :: error
      integer :: equals
      logical :: ok

      equals = index(text, "=")
      call parse_path(text(:max(equals - 1, 0)), path, ok)
      if (.not. ok) then
         call raise(error, complaint(from_option, "", "", "", "'"//text//"' must be GROUP%KEY=VALUE or GROUP(n)%KEY=VALUE"))
         return
      end if
      item%key = path%key
      item%first = path%element
      item%last = path%element
      item%option = trim(adjustl(text(equals + 1:)))
   end subroutine parse_override

   !> Index of the group which a path means; 0 when it has to be made.
   pure subroutine find_target(document, spec, path, target, problem)
      type(raw_document_t), intent(in) :: document
      type(group_spec_t), intent(in) :: spec
      type(path_t), intent(in) :: path
      integer, intent(out) :: target
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: times
      integer :: count, i

      target = 0
      count = 0
      do i = 1, size(document%groups)
         if (document%groups(i)%name /= path%group) cycle
         count = count + 1
         if (count == max(path%index, 1)) target = i
      end do
      times = to_text(count)//" times"
      if (count == 1) times = "once"
      if (count == 0 .and. .not. spec%repeatable .and. path%index <= 1) return
      if (count == 0) then
         problem = "the input has no group &"//path%group
      else if (path%index > count) then
         problem = "the input has &"//path%group//" "//times//", the index must be 1"
         if (count > 1) problem = problem//" to "//to_text(count)
      else if (path%index == 0 .and. count > 1 .and. spec%repeatable) then
         problem = "the input has &"//path%group//" "//times//", give an index: "//path%group//"(1)%"//path%key//" to "// &
                   path%group//"("//to_text(count)//")%"//path%key
      end if
   end subroutine find_target

end module razy_input_override
