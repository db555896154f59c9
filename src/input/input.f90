!! A validated input: the groups and values of a namelist file that a schema allows. For `count`, `given` and `get` see
!! `razy_input_document`.
!!
!! Everything is checked when it is read, and numbers are stored as numbers, so that `get` costs a few comparisons of names.
module razy_input_input
   use razy_input_document, only: document_t
   use razy_input_effective, only: effective_text
   use razy_core_error, only: complaint, error_t, raise
   use razy_input_key_reader, only: read_key
   use razy_core_kinds, only: wp
   use razy_input_namelist, only: append_entry, append_group, entry_t, parse_namelist, raw_document_t, raw_group_t
   use razy_input_override, only: apply_overrides, parse_override
   use razy_input_path, only: path_t
   use razy_input_schema, only: group_spec_t, key_spec_t
   use razy_input_slot, only: locate_slot, put_slot, slot_t
   use razy_core_text, only: append_text, lower, string_t
   use razy_core_text_file, only: clean_text, read_text_file
   use razy_input_validation, only: validate
   use razy_input_value, only: allowed_text, value_t
   implicit none(type, external)
   private

   public :: input_t, read_input, read_input_text, peek

   !> The input; made by `read_input`, changed only by `put`.
   type, extends(document_t) :: input_t
   contains
      procedure :: find_name
      procedure :: names
      procedure :: complain
      procedure :: locate
      procedure :: locate_value
      procedure :: put
      procedure :: value_of
      procedure :: unit_of
      procedure :: effective
   end type input_t

contains

   !> Read and check `file`. The message of an error is one line: `file:line: &group(2) key = value: what is allowed`.
   subroutine read_input(self, file, schema, overrides, error)
      type(input_t), intent(out) :: self
      character(*), intent(in) :: file
      type(group_spec_t), intent(in) :: schema(:)
      !> `GROUP%KEY=VALUE` or `GROUP(2)%KEY=VALUE`, applied in this order before the check
      type(string_t), intent(in) :: overrides(:)
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: text

      call read_text_file(file, text, error)
      if (.not. allocated(error)) call read_input_text(self, text, file, schema, overrides, error)
   end subroutine read_input

   !> As `read_input`, from text; `file` is the name for messages.
   pure subroutine read_input_text(self, text, file, schema, overrides, error)
      type(input_t), intent(out) :: self
      character(*), intent(in) :: text, file
      type(group_spec_t), intent(in) :: schema(:)
      type(string_t), intent(in) :: overrides(:)
      type(error_t), allocatable, intent(out) :: error
      type(raw_document_t) :: raw
      character(:), allocatable :: clean

      call clean_text(text, file, clean, error)
      if (.not. allocated(error)) call parse_namelist(clean, file, raw, error)
      if (.not. allocated(error)) call apply_overrides(raw, schema, overrides, error)
      if (.not. allocated(error)) call validate(raw, schema, self%document_t, error)
   end subroutine read_input_text

   !> Only one text of a file, before the schema is known: the value of `key` in the first `group`, checked against `key`
   !> alone. `value` is empty when the key is optional and not there.
   pure subroutine peek(text, file, group, key, overrides, value, error)
      character(*), intent(in) :: text, file
      !> Lower case
      character(*), intent(in) :: group
      !> A string key
      type(key_spec_t), intent(in) :: key
      !> Those for other keys are only checked for their form
      type(string_t), intent(in) :: overrides(:)
      character(:), allocatable, intent(out) :: value
      type(error_t), allocatable, intent(out) :: error
      type(raw_document_t) :: raw
      type(raw_group_t) :: created
      type(entry_t) :: item
      type(value_t) :: found
      type(path_t) :: path
      character(:), allocatable :: clean
      integer :: g, i

      value = ""
      call clean_text(text, file, clean, error)
      if (.not. allocated(error)) call parse_namelist(clean, file, raw, error)
      if (allocated(error)) return
      do g = 1, size(raw%groups)
         if (raw%groups(g)%name == group) exit
      end do
      do i = 1, size(overrides)
         call parse_override(overrides(i)%text, path, item, error)
         if (allocated(error)) return
         if (path%group /= group .or. path%key /= key%name .or. path%index > 1) cycle
         if (g > size(raw%groups)) then
            created%name = group
            allocate (created%entries(0))
            call append_group(raw, created)
         end if
         call append_entry(raw%groups(g), item)
      end do
      if (g > size(raw%groups)) then
         if (key%required) call raise(error, complaint(file, group, key%name, "", "is required, "//allowed_text(key)))
         return
      end if
      call read_key(raw, g, key, found, error)
      if (allocated(error)) return
      if (.not. allocated(found%strings)) return
      if (size(found%strings) > 0) value = found%strings(1)%text
   end subroutine peek

   !> The group with this name, in any case: `group` and `index` for `get`; `index` is 0 when there is none.
   pure subroutine find_name(self, name, group, index, name_space)
      class(input_t), intent(in) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: group
      integer, intent(out) :: index
      integer, intent(in), optional :: name_space
      integer :: i
      character(:), allocatable :: own

      group = ""
      index = 0
      do i = 1, size(self%instances)
         associate (spec => self%schema(self%instances(i)%spec))
            if (present(name_space)) then
               if (spec%name_space /= name_space) cycle
            end if
            own = name_in(self, i)
            if (len(own) == 0 .or. lower(own) /= lower(name)) cycle
            group = spec%name
            index = self%instances(i)%number
            return
         end associate
      end do
   end subroutine find_name

   !> All names of one kind of group, or of all groups when `group` is empty; for `did_you_mean`.
   pure function names(self, group) result(list)
      class(input_t), intent(in) :: self
      character(*), intent(in) :: group
      type(string_t), allocatable :: list(:)
      character(:), allocatable :: own
      integer :: i

      allocate (list(0))
      do i = 1, size(self%instances)
         if (len(group) > 0 .and. self%schema(self%instances(i)%spec)%name /= group) cycle
         own = name_in(self, i)
         if (len(own) > 0) call append_text(list, own)
      end do
   end function names

   !> The name of an instance; empty when it has none.
   pure function name_in(self, i) result(name)
      class(input_t), intent(in) :: self
      integer, intent(in) :: i
      character(:), allocatable :: name
      integer :: k

      name = ""
      associate (item => self%instances(i), keys => self%schema(self%instances(i)%spec)%keys)
         do k = 1, size(keys)
            if (.not. keys(k)%is_name) cycle
            if (size(item%values(k)%strings) > 0) name = item%values(k)%strings(1)%text
         end do
      end associate
   end function name_in

   !> An error about a value, for what only the scene can check: `file:line: &group(2) key = value: allowed`.
   pure subroutine complain(self, error, group, index, key, allowed)
      class(input_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: group
      integer, intent(in) :: index
      !> Empty for the group as a whole
      character(*), intent(in) :: key
      !> What is allowed; not a part of `error`
      character(*), intent(in) :: allowed
      integer :: i, k, s

      call self%find(group, index, key, s, i, k)
      if (i > 0) then
         call raise(error, self%message(i, k, allowed))
      else
         call raise(error, complaint(self%file, group, key, "", allowed))
      end if
   end subroutine complain

   !> Find a real value by its path, for `put`. The message of an error has no place before it: it belongs to whatever
   !> holds the path.
   pure subroutine locate(self, path, slot, error)
      class(input_t), intent(in) :: self
      !> `rotation%speed_rpm`, `load(2)%value`, `gear_mesh%radius(2)`
      character(*), intent(in) :: path
      type(slot_t), intent(out) :: slot
      type(error_t), allocatable, intent(out) :: error

      call locate_slot(self%document_t, path, slot, error)
   end subroutine locate

   !> Find the real value whose path is the text of a key of this input; an error names that key.
   subroutine locate_value(self, group, index, key, slot, error)
      class(input_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      type(slot_t), intent(out) :: slot
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: path, problem

      call self%get(group, index, key, path)
      if (.not. allocated(path)) path = ""
      call self%locate(path, slot, error)
      if (.not. allocated(error)) return
      problem = error%message
      call self%complain(error, group, index, key, problem)
   end subroutine locate_value

   !> Change a value; refused, and left as it was, when the key's limits do not allow it.
   pure subroutine put(self, slot, value, error)
      class(input_t), intent(inout) :: self
      type(slot_t), intent(in) :: slot
      !> In the unit of the key
      real(wp), intent(in) :: value
      type(error_t), allocatable, intent(out) :: error

      call put_slot(self%document_t, slot, value, error)
   end subroutine put

   !> The present value at a slot; `fallback` when the key has none.
   pure real(wp) function value_of(self, slot, fallback)
      class(input_t), intent(in) :: self
      type(slot_t), intent(in) :: slot
      real(wp), intent(in) :: fallback

      value_of = fallback
      associate (value => self%instances(slot%instance)%values(slot%key))
         if (slot%whole) then
            if (slot%element <= size(value%integers)) value_of = value%integers(slot%element)
         else
            if (slot%element <= size(value%reals)) value_of = value%reals(slot%element)
         end if
      end associate
   end function value_of

   !> Unit of a slot; empty for a pure number.
   pure function unit_of(self, slot) result(unit)
      class(input_t), intent(in) :: self
      type(slot_t), intent(in) :: slot
      character(:), allocatable :: unit

      unit = self%schema(self%instances(slot%instance)%spec)%keys(slot%key)%unit
   end function unit_of

   !> The effective input as text: every group with every value, defaults included; reading it back gives the same input.
   pure function effective(self) result(text)
      class(input_t), intent(in) :: self
      character(:), allocatable :: text

      text = effective_text(self%document_t)
   end function effective

end module razy_input_input
