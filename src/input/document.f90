!! A checked input: every group that the text has, with the converted values of all keys of its specification.
!!
!! Names of groups and keys are passed in lower case. `get` leaves a scalar unchanged, and makes an array or text of length
!! zero, when a key has neither value nor default; for a group that is absent it gives the defaults. To ask for a group or
!! key that the schema does not have, for an index beyond `count`, or for another type, is a mistake in the program, not in
!! the input: a real comes back as NaN, an integer as `-huge`, a logical as false, a text or array not allocated.
module razy_input_document
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_error, only: complaint, from_option
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_input_schema, only: group_at, group_spec_t, key_at, type_integer, type_logical, type_real, type_string
   use razy_core_text, only: string_t
   use razy_input_value, only: element_text, value_t
   implicit none(type, external)
   private

   public :: instance_t, members_t, document_t, values_text

   !> One group of the input.
   type :: instance_t
      !> Index of its specification in the schema
      integer :: spec = 0
      !> 1, 2, ... among the groups of the same name
      integer :: number = 0
      !> Line where it begins; 0 when the command line made it
      integer :: line = 0
      !> In the order of the specification's keys
      type(value_t), allocatable :: values(:)
   end type instance_t

   !> Indices of the groups of one name.
   type :: members_t
      integer, allocatable :: instances(:)
   end type members_t

   !> The schema, the groups in the order of the text, and for each specification its groups and its default values.
   type :: document_t
      character(:), allocatable :: file
      type(group_spec_t), allocatable :: schema(:)
      type(instance_t), allocatable :: instances(:)
      type(members_t), allocatable :: members(:)
      type(instance_t), allocatable :: defaults(:)
   contains
      procedure :: find
      procedure :: count => group_count
      procedure :: given
      procedure :: length
      procedure, private :: get_real, get_reals, get_integer, get_integers, get_logical, get_logicals, get_text, get_texts
      !> `call document%get(group, index, key, value)`
      generic :: get => get_real, get_reals, get_integer, get_integers, get_logical, get_logicals, get_text, get_texts
      procedure :: label
      procedure :: message
   end type document_t

contains

   !> Where a value is. `spec` or `key` is 0 when the schema does not have it; `instance` is 0 when the input does not.
   pure subroutine find(self, group, index, name, spec, instance, key)
      class(document_t), intent(in) :: self
      !> Lower case
      character(*), intent(in) :: group, name
      !> 1, 2, ... among the groups of this name
      integer, intent(in) :: index
      integer, intent(out) :: spec, instance, key

      instance = 0
      key = 0
      spec = 0
      if (.not. allocated(self%schema)) return
      spec = group_at(self%schema, group)
      if (spec == 0) return
      key = key_at(self%schema(spec), name)
      if (index >= 1 .and. index <= size(self%members(spec)%instances)) instance = self%members(spec)%instances(index)
   end subroutine find

   !> Number of groups of a name in the input; 0 also for a name that the schema does not have.
   pure integer function group_count(self, group)
      class(document_t), intent(in) :: self
      character(*), intent(in) :: group
      integer :: instance, key, spec

      call self%find(group, 1, "", spec, instance, key)
      group_count = 0
      if (spec > 0) group_count = size(self%members(spec)%instances)
   end function group_count

   !> Whether the user gave a key. Reading the effective input back makes every default given, so this is to be asked only
   !> for keys without a default.
   pure logical function given(self, group, index, key)
      class(document_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer :: i, k, s

      call self%find(group, index, key, s, i, k)
      given = i > 0 .and. k > 0
      if (given) given = self%instances(i)%values(k)%given
   end function given

   !> Number of values of a key, given or by default.
   integer function length(self, group, index, key)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, 0)
      length = 0
      if (associated(value)) length = value%count()
   end function length

   !> The values of a key, of its defaults where the group is absent; not associated for a mistake of the program.
   function value_at(self, group, index, key, type) result(value)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      !> The type that is asked for; 0 for any
      integer, intent(in) :: type
      type(value_t), pointer :: value
      integer :: i, k, s

      value => null()
      call self%find(group, index, key, s, i, k)
      if (s == 0 .or. k == 0) return
      if (type /= 0 .and. type /= self%schema(s)%keys(k)%type) return
      if (i > 0) then
         value => self%instances(i)%values(k)
      else if (index == 1) then
         value => self%defaults(s)%values(k)
      end if
   end function value_at

   subroutine get_real(self, group, index, key, number)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), intent(inout) :: number
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_real)
      if (.not. associated(value)) then
         number = ieee_value(number, ieee_quiet_nan)
      else if (size(value%reals) > 0) then
         number = value%reals(1)
      end if
   end subroutine get_real

   subroutine get_reals(self, group, index, key, list)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_real)
      if (associated(value)) list = value%reals
   end subroutine get_reals

   subroutine get_integer(self, group, index, key, number)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer, intent(inout) :: number
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_integer)
      if (.not. associated(value)) then
         number = -huge(number)
      else if (size(value%integers) > 0) then
         number = value%integers(1)
      end if
   end subroutine get_integer

   subroutine get_integers(self, group, index, key, list)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer, allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_integer)
      if (associated(value)) list = value%integers
   end subroutine get_integers

   subroutine get_logical(self, group, index, key, number)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      logical, intent(inout) :: number
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_logical)
      if (.not. associated(value)) then
         number = .false.
      else if (size(value%logicals) > 0) then
         number = value%logicals(1)
      end if
   end subroutine get_logical

   subroutine get_logicals(self, group, index, key, list)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      logical, allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_logical)
      if (associated(value)) list = value%logicals
   end subroutine get_logicals

   subroutine get_text(self, group, index, key, text)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      character(:), allocatable, intent(out) :: text
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_string)
      if (.not. associated(value)) return
      text = ""
      if (size(value%strings) > 0) text = value%strings(1)%text
   end subroutine get_text

   subroutine get_texts(self, group, index, key, list)
      class(document_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      type(string_t), allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_string)
      if (associated(value)) list = value%strings
   end subroutine get_texts

   !> Name of a group, with its index where the name is repeated: `load(2)`.
   pure function label(self, instance) result(text)
      class(document_t), intent(in) :: self
      integer, intent(in) :: instance
      character(:), allocatable :: text

      associate (item => self%instances(instance))
         text = self%schema(item%spec)%name
         if (size(self%members(item%spec)%instances) > 1) text = text//"("//to_text(item%number)//")"
      end associate
   end function label

   !> `file:line: &group(2) key = value: allowed` for a value of the input.
   pure function message(self, instance, key, allowed) result(line)
      class(document_t), intent(in) :: self
      integer, intent(in) :: instance
      !> Index in the specification; 0 for the group as a whole
      integer, intent(in) :: key
      character(*), intent(in) :: allowed
      character(:), allocatable :: line
      character(:), allocatable :: name, origin, text
      integer :: number

      name = ""
      text = ""
      associate (item => self%instances(instance))
         number = item%line
         if (key > 0) then
            name = self%schema(item%spec)%keys(key)%name
            if (item%values(key)%given) number = item%values(key)%line
            text = values_text(item%values(key))
            if (allocated(item%values(key)%text)) text = item%values(key)%text
         end if
      end associate
      origin = from_option
      if (number > 0) origin = self%file//":"//to_text(number)
      line = complaint(origin, self%label(instance), name, text, allowed)
   end function message

   !> All values of a key in one line, in namelist syntax.
   pure function values_text(value) result(text)
      type(value_t), intent(in) :: value
      character(:), allocatable :: text
      integer :: i

      text = ""
      do i = 1, value%count()
         if (i > 1) text = text//", "
         text = text//element_text(value, i)
      end do
   end function values_text

end module razy_input_document
