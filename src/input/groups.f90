!! The groups of a checked input, each with the values of all its keys, and what is asked of them.
!!
!! Names of groups and keys are passed in lower case. `get` leaves a scalar unchanged, and makes an array or text of length
!! zero, when a key has neither value nor default; for a group that is absent it gives the defaults. To ask for a group or
!! key that the schema does not have, for an index beyond `count`, or for another type, is a mistake in the program, not in
!! the input: a real comes back as NaN, an integer as `-huge`, a logical as false, a text or array not allocated.
module razy_input_groups
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_error, only: complaint, error_t, from_option, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower, string_t
   use razy_input_reader, only: indexed
   use razy_input_schema, only: group_at, group_spec_t, key_at, type_integer, type_logical, type_real, type_string
   use razy_input_value, only: value_t
   implicit none(type, external)
   private

   public :: groups_t

   !> One group of the input.
   type :: group_t
      !> Place of its specification in the schema
      integer :: spec = 0
      !> Line where it begins; 0 when the command line made it
      integer :: line = 0
      !> Which of the groups of this name it is
      integer :: number = 0
      !> In the order of the specification's keys
      type(value_t), allocatable :: values(:)
   end type group_t

   !> Places of the groups of one name
   type :: members_t
      integer :: count = 0
      integer, allocatable :: at(:)
   end type members_t

   !> All groups; only razy_input_input changes them.
   type :: groups_t
      !> Name for messages
      character(:), allocatable :: file
      type(group_spec_t), allocatable :: schema(:)
      !> In the order of the text; those that the command line made are last
      type(group_t), allocatable :: groups(:)
      !> Groups so far, and those of each specification
      integer :: filled = 0
      type(members_t), allocatable :: members(:)
      !> A group of each specification to which nobody gave a value
      type(group_t), allocatable :: defaults(:)
   contains
      procedure :: count => group_count
      procedure :: given
      procedure :: differs
      procedure, private :: get_real, get_reals, get_integer, get_integers, get_logical, get_text, get_texts
      !> `call input%get(group, index, key, value)`
      generic :: get => get_real, get_reals, get_integer, get_integers, get_logical, get_text, get_texts
      procedure :: number
      procedure :: list
      procedure :: whole
      procedure :: truth
      procedure :: text
      procedure :: choice
      procedure :: complain
      procedure :: find
      procedure :: label_of
      procedure :: refuse_alone
      procedure :: origin
   end type groups_t

contains

   !> An error about a value, for what only the scene can check: `file:line: &group(2) key = value: allowed`.
   pure subroutine complain(self, error, group, index, key, allowed)
      class(groups_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: group
      integer, intent(in) :: index
      !> Empty for the group as a whole
      character(*), intent(in) :: key
      !> What is allowed; not a part of `error`
      character(*), intent(in) :: allowed
      character(:), allocatable :: text
      integer :: g, k, line, s

      call self%find(group, index, key, s, g, k)
      if (g == 0) call raise(error, complaint(self%file, group, key, "", allowed))
      if (allocated(error)) return
      text = ""
      line = self%groups(g)%line
      if (k > 0) then
         associate (value => self%groups(g)%values(k))
            text = value%as_written(self%schema(s)%keys(k))
            if (any(value%words%given)) line = value%line
         end associate
      end if
      call raise(error, complaint(self%origin(line), self%label_of(g), trim(key), text, allowed))
   end subroutine complain

   !> Refuse a key that says something without the one that it goes with.
   pure subroutine refuse_alone(self, error, group, index, key, with)
      class(groups_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: group, key, with
      integer, intent(in) :: index

      if (self%differs(group, index, key) .and. .not. self%given(group, index, with)) then
         call self%complain(error, group, index, key, "left out without "//with)
      end if
   end subroutine refuse_alone

   !> `file:line`, or the command line's option for what has no line.
   pure function origin(self, line) result(text)
      class(groups_t), intent(in) :: self
      integer, intent(in) :: line
      character(:), allocatable :: text

      text = from_option
      if (line > 0) text = self%file//":"//to_text(line)
   end function origin

   !> Name of group `g`, with its index where the name is repeated: `load(2)`.
   pure function label_of(self, g) result(text)
      class(groups_t), intent(in) :: self
      integer, intent(in) :: g
      character(:), allocatable :: text

      associate (s => self%groups(g)%spec)
         text = indexed(self%schema(s)%name, merge(self%groups(g)%number, 0, self%members(s)%count > 1))
      end associate
   end function label_of

   !> Where a value is. `s` (the specification) or `k` (the key) is 0 when the schema does not have it, `g` (the group) when
   !> the input does not.
   pure subroutine find(self, group, index, key, s, g, k)
      class(groups_t), intent(in) :: self
      !> Lower case
      character(*), intent(in) :: group, key
      !> 1, 2, ... among the groups of this name
      integer, intent(in) :: index
      integer, intent(out) :: s, g, k

      g = 0
      k = 0
      s = group_at(self%schema, group)
      if (s == 0) return
      k = key_at(self%schema(s), key)
      if (.not. allocated(self%members)) return
      if (index >= 1 .and. index <= self%members(s)%count) g = self%members(s)%at(index)
   end subroutine find

   !> Number of groups of a name in the input; 0 also for a name that the schema does not have.
   pure integer function group_count(self, group)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group

      integer :: s

      s = group_at(self%schema, group)
      group_count = 0
      if (s > 0) group_count = self%members(s)%count
   end function group_count

   !> Whether the user gave a key. Reading the effective input back makes every default given, so this is to be asked only
   !> for keys without a default.
   pure logical function given(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer :: g, k, s

      call self%find(group, index, key, s, g, k)
      given = g > 0 .and. k > 0
      if (given) given = any(self%groups(g)%values(k)%words%given)
   end function given

   !> Whether a key says something else than its default, whoever said so.
   pure logical function differs(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer :: g, k, s

      call self%find(group, index, key, s, g, k)
      differs = g > 0 .and. k > 0
      if (.not. differs) return
      associate (words => self%groups(g)%values(k)%words, default => self%defaults(s)%values(k)%words)
         if (size(words) == size(default)) differs = any(abs(words%number - default%number) > 0.0_wp)
      end associate
   end function differs

   !> The value of a key, of its default where the group is absent; not associated for a mistake of the program.
   function value_at(input, group, index, key, type) result(value)
      class(groups_t), intent(in), target :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      !> The type that is asked for
      integer, intent(in) :: type
      type(value_t), pointer :: value
      integer :: g, k, s

      value => null()
      call input%find(group, index, key, s, g, k)
      if (k == 0) return
      if (input%schema(s)%keys(k)%type /= type) return
      if (g > 0) then
         value => input%groups(g)%values(k)
      else if (index == 1) then
         value => input%defaults(s)%values(k)
      end if
   end function value_at

   !> The first number of a key: `otherwise` where there is neither value nor default, `none` of a key that is not of this type.
   function first_number(self, group, index, key, type, otherwise, none) result(number)
      class(groups_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index, type
      real(wp), intent(in) :: otherwise, none
      real(wp) :: number

      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type)
      number = none
      if (.not. associated(value)) return
      number = otherwise
      if (size(value%words) > 0) number = value%words(1)%number
   end function first_number

   !> The value of a real key; `otherwise` where there is neither value nor default, as of a key that not every schema has.
   function number(self, group, index, key, otherwise)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), intent(in), optional :: otherwise
      real(wp) :: number

      number = ieee_value(number, ieee_quiet_nan)
      if (present(otherwise)) number = otherwise
      number = first_number(self, group, index, key, type_real, number, number)
   end function number

   !> All values of a real key.
   function list(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), allocatable :: list(:)

      call self%get(group, index, key, list)
   end function list

   !> The value of an integer key, which has a value or default.
   function whole(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer :: whole

      whole = -huge(whole)
      call self%get(group, index, key, whole)
   end function whole

   !> Whether a logical key says so; not where there is no such key.
   function truth(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      logical :: truth

      truth = .false.
      call self%get(group, index, key, truth)
   end function truth

   !> The text of a key; empty where there is neither value nor default.
   function text(self, group, index, key)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      character(:), allocatable :: text

      call self%get(group, index, key, text)
   end function text

   !> Put the value of a key into a variable, which stays as it is where there is neither value nor default.
   subroutine get_real(self, group, index, key, number)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), intent(inout) :: number

      number = first_number(self, group, index, key, type_real, number, ieee_value(number, ieee_quiet_nan))
   end subroutine get_real

   subroutine get_reals(self, group, index, key, list)
      class(groups_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      real(wp), allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_real)
      if (associated(value)) list = value%words%number
   end subroutine get_reals

   subroutine get_integer(self, group, index, key, number)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer, intent(inout) :: number

      number = nint(first_number(self, group, index, key, type_integer, real(number, wp), -real(huge(number), wp)))
   end subroutine get_integer

   subroutine get_integers(self, group, index, key, list)
      class(groups_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      integer, allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_integer)
      if (associated(value)) list = nint(value%words%number)
   end subroutine get_integers

   subroutine get_logical(self, group, index, key, truth)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      logical, intent(inout) :: truth

      truth = first_number(self, group, index, key, type_logical, merge(1.0_wp, 0.0_wp, truth), 0.0_wp) > 0.0_wp
   end subroutine get_logical

   subroutine get_text(self, group, index, key, text)
      class(groups_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      character(:), allocatable, intent(out) :: text
      type(value_t), pointer :: value

      value => value_at(self, group, index, key, type_string)
      if (.not. associated(value)) return
      text = ""
      if (size(value%words) > 0) text = value%words(1)%text
   end subroutine get_text

   subroutine get_texts(self, group, index, key, list)
      class(groups_t), intent(in), target :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      type(string_t), allocatable, intent(out) :: list(:)
      type(value_t), pointer :: value
      integer :: i

      value => value_at(self, group, index, key, type_string)
      if (.not. associated(value)) return
      allocate (list(size(value%words)))
      do i = 1, size(list)
         list(i)%text = value%words(i)%text
      end do
   end subroutine get_texts

   !> The text of a key that has choices, in lower case.
   function choice(self, group, index, key) result(text)
      class(groups_t), intent(in) :: self
      character(*), intent(in) :: group, key
      integer, intent(in) :: index
      character(:), allocatable :: text

      text = lower(self%text(group, index, key))
   end function choice

end module razy_input_groups
