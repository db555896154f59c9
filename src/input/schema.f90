!! What an input may say: groups and their keys with type, count, unit, limits and default, written down as a table.
!!
!! A scene's schema grows by `add_group`, after which `add_real` and the like give the group its keys.
!! Defaults are texts in namelist syntax; an unquoted default of a string key stands for itself.
module razy_input_schema
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: append_text, string_t, text_code
   implicit none(type, external)
   private

   public :: key_spec_t, group_spec_t, key_at, group_at
   public :: add_group, add_name, add_real, add_integer, add_logical, add_string
   public :: type_real, type_integer, type_logical, type_string, positive, nonnegative

   integer, parameter :: type_real = 1, type_integer = 2, type_logical = 3, type_string = 4
   !> Rules for numbers
   integer, parameter :: positive = 1, nonnegative = 2

   !> One key of a group. A key `name` is the name of its group: fit for paths, and unique in the input.
   type :: key_spec_t
      !> Name, and meaning in one line
      character(:), allocatable :: name, doc
      !> Code of the name, by which it is found
      integer(i8) :: code = 0
      !> One of the `type_` constants
      integer :: type = 0
      !> Least and most number of values
      integer :: least = 1, most = 1
      logical :: required = .false.
      !> Namelist text; not allocated when there is no default
      character(:), allocatable :: default
      !> Empty for a pure number
      character(:), allocatable :: unit
      !> Limits of a number, included unless `open_below`
      real(wp) :: low = -huge(1.0_wp), high = huge(1.0_wp)
      logical :: open_below = .false.
      !> What a string may be, in any case; empty when it is free
      type(string_t), allocatable :: choices(:)
   end type key_spec_t

   !> One kind of group.
   type :: group_spec_t
      !> Name, and meaning in one line
      character(:), allocatable :: name, doc
      type(key_spec_t), allocatable :: keys(:)
      !> Code of the name, by which it is found
      integer(i8) :: code = 0
      logical :: repeatable = .false.
   end type group_spec_t

contains

   !> Add a group without keys to a schema, which need not be allocated; `name` is a lower-case Fortran name.
   pure subroutine add_group(schema, name, doc, repeatable)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: name, doc
      logical, intent(in), optional :: repeatable
      type(group_spec_t) :: group
      type(group_spec_t), allocatable :: aside(:)
      integer :: g

      group%name = name
      group%code = text_code(name)
      group%doc = doc
      allocate (group%keys(0))
      if (present(repeatable)) group%repeatable = repeatable
      if (.not. allocated(schema)) allocate (schema(0))
      ! Copies of all keys with every group would take most of the start of a program.
      allocate (aside(size(schema)))
      do g = 1, size(aside)
         call move_alloc(schema(g)%keys, aside(g)%keys)
      end do
      schema = [schema, group]
      do g = 1, size(aside)
         call move_alloc(aside(g)%keys, schema(g)%keys)
      end do
   end subroutine add_group

   !> Add the key `name` by which other groups refer to this one; required unless told otherwise.
   pure subroutine add_name(schema, required)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      logical, intent(in), optional :: required
      type(key_spec_t) :: spec

      spec = new_key("name", "name by which other groups and results refer to it", type_string)
      spec%required = .true.
      if (present(required)) spec%required = required
      call add_key(schema, spec)
   end subroutine add_name

   !> Add a real key to the last group. `count` is the exact number of values; `least` and `most` bound a list of variable length.
   pure subroutine add_real(schema, name, doc, unit, rule, low, high, count, least, most, required, default)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: name, doc
      character(*), intent(in), optional :: unit, default
      integer, intent(in), optional :: rule, count, least, most
      real(wp), intent(in), optional :: low, high
      logical, intent(in), optional :: required
      type(key_spec_t) :: spec

      spec = new_key(name, doc, type_real, unit, rule, count, least, most, required, default)
      if (present(low)) spec%low = low
      if (present(high)) spec%high = high
      call add_key(schema, spec)
   end subroutine add_real

   !> Add an integer key; see `add_real`.
   pure subroutine add_integer(schema, name, doc, unit, rule, low, high, count, least, most, required, default)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: name, doc
      character(*), intent(in), optional :: unit, default
      integer, intent(in), optional :: rule, low, high, count, least, most
      logical, intent(in), optional :: required
      type(key_spec_t) :: spec

      spec = new_key(name, doc, type_integer, unit, rule, count, least, most, required, default)
      if (present(low)) spec%low = real(low, wp)
      if (present(high)) spec%high = real(high, wp)
      call add_key(schema, spec)
   end subroutine add_integer

   !> Add a logical key; see `add_real`.
   pure subroutine add_logical(schema, name, doc, most, default)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: name, doc
      character(*), intent(in), optional :: default
      integer, intent(in), optional :: most

      call add_key(schema, new_key(name, doc, type_logical, most=most, default=default))
   end subroutine add_logical

   !> Add a string key, free or one of `choices` (trailing blanks do not count); see `add_real`.
   pure subroutine add_string(schema, name, doc, choices, count, least, most, required, default)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: name, doc
      character(*), intent(in), optional :: choices(:), default
      integer, intent(in), optional :: count, least, most
      logical, intent(in), optional :: required
      type(key_spec_t) :: spec
      integer :: i

      spec = new_key(name, doc, type_string, count=count, least=least, most=most, required=required, default=default)
      if (present(choices)) then
         do i = 1, size(choices)
            call append_text(spec%choices, trim(choices(i)))
         end do
      end if
      call add_key(schema, spec)
   end subroutine add_string

   !> Add a key to the last group.
   pure subroutine add_key(schema, spec)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      type(key_spec_t), intent(in) :: spec

      schema(size(schema))%keys = [schema(size(schema))%keys, spec]
   end subroutine add_key

   !> What all kinds of key have in common.
   pure function new_key(name, doc, type, unit, rule, count, least, most, required, default) result(spec)
      character(*), intent(in) :: name, doc
      integer, intent(in) :: type
      character(*), intent(in), optional :: unit, default
      integer, intent(in), optional :: rule, count, least, most
      logical, intent(in), optional :: required
      type(key_spec_t) :: spec

      spec%name = name
      spec%code = text_code(name)
      spec%doc = doc
      spec%type = type
      spec%unit = ""
      if (present(unit)) spec%unit = unit
      if (present(rule)) then
         spec%low = 0.0_wp
         spec%open_below = rule == positive
      end if
      if (present(count)) then
         spec%least = count
         spec%most = count
      end if
      if (present(least)) spec%least = least
      if (present(most)) spec%most = most
      if (present(required)) spec%required = required
      if (present(default)) spec%default = default
      allocate (spec%choices(0))
   end function new_key

   !> Place of the group with this lower-case name; 0 when there is none.
   pure integer function group_at(schema, name)
      type(group_spec_t), intent(in) :: schema(:)
      character(*), intent(in) :: name

      integer(i8) :: code

      code = text_code(name)
      do group_at = size(schema), 1, -1
         if (schema(group_at)%code == code) return
      end do
   end function group_at

   !> Place of the key with this lower-case name; 0 when there is none.
   pure integer function key_at(spec, name)
      type(group_spec_t), intent(in) :: spec
      character(*), intent(in) :: name

      integer(i8) :: code

      code = text_code(name)
      do key_at = size(spec%keys), 1, -1
         if (spec%keys(key_at)%code == code) return
      end do
   end function key_at

end module razy_input_schema
