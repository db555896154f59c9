!! A checked input: the groups that a schema allows, each with the values of all its keys.
!!
!! `read_entries` (razy_input_reader) takes a text apart, `check_input` puts what it says in the place of a schema's defaults
!! and checks all that a schema can say.
!!
!! What is asked of it is razy_input_groups; here it is made, a sweep changes its numbers, and it becomes text again.
module razy_input_input
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_error, only: complaint, error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_resize, only: resize
   use razy_core_text, only: append_text, did_you_mean, lower, newline, string_t, text_code
   use razy_input_groups, only: groups_t
   use razy_input_reader, only: entries_t, entry_t, indexed, path_t, read_path
   use razy_input_scanner, only: words_text
   use razy_input_schema, only: group_at, group_spec_t, key_at, type_integer, type_logical, type_string
   use razy_input_value, only: allowed_text, allows
   implicit none(type, external)
   private

   public :: input_t, slot_t, check_input, peek

   !> Where one number of an input is, for `put`; valid for inputs of the same text and schema.
   type :: slot_t
      !> In lower case, with the indices that are needed
      character(:), allocatable :: path
      !> Of the key; empty for a pure number
      character(:), allocatable :: unit
      !> Which of all groups, which of its keys, which of the key's elements
      integer :: instance = 0, key = 0, element = 1
      !> Whether it is an integer
      logical :: whole = .false.
      !> What was there when it was located; not a number where there was nothing
      real(wp) :: number = 0.0_wp
   end type slot_t

   !> The input; made by `check_input`, changed only by `put`.
   type, extends(groups_t) :: input_t
   contains
      procedure :: locate
      procedure :: put
      procedure :: effective
      procedure :: numbers
   end type input_t

contains

   !> Check what an input says against a schema. The first thing that is wrong comes back as one line,
   !> `file:line: &group(2) key = value: what is allowed`.
   pure subroutine check_input(self, said, schema, error, lenient)
      type(input_t), intent(out) :: self
      type(entries_t), intent(in) :: said
      type(group_spec_t), intent(in) :: schema(:)
      type(error_t), allocatable, intent(out) :: error
      !> Present: what the schema does not have is passed over
      logical, intent(in), optional :: lenient
      character(:), allocatable :: problem
      integer :: g, i, k, pass

      self%file = said%file
      self%schema = schema
      ! The command line can make one of each name.
      allocate (self%groups(count([(len(said%list(i)%path%key) == 0, i=1, size(said%list))]) + size(schema)))
      allocate (self%members(size(schema)))
      call set_defaults(self, error)
      ! heads of groups first, because messages about keys tell how often a group is there
      do pass = 1, 2
         do i = 1, size(said%list)
            if (allocated(error)) return
            if ((pass == 1) .neqv. len(said%list(i)%path%key) == 0) cycle
            call admit(self, said%list(i), present(lenient), error)
         end do
      end do
      ! What is said before what is missing: the latter may be what the former was meant for.
      do pass = 1, 2
         do g = 1, self%filled
            associate (spec => self%schema(self%groups(g)%spec), number => self%groups(g)%number)
               do k = 1, size(spec%keys)
                  if (allocated(error)) return
                  associate (value => self%groups(g)%values(k))
                     if ((pass == 1) .neqv. size(value%words) > 0) cycle
                     call value%check(spec%keys(k), problem)
                  end associate
                  if (allocated(problem)) call self%complain(error, spec%name, number, spec%keys(k)%name, problem)
               end do
            end associate
         end do
      end do
      if (.not. allocated(error)) call check_names(self, error)
   end subroutine check_input

   !> Only one text, before the schema is known: the value of the only key of `schema`, checked against that alone. It is empty
   !> when the key is not there.
   subroutine peek(said, schema, value, error)
      type(entries_t), intent(in) :: said
      !> One group that stands once, with one string key
      type(group_spec_t), intent(in) :: schema(:)
      character(:), allocatable, intent(out) :: value
      type(error_t), allocatable, intent(out) :: error
      type(input_t) :: part

      call check_input(part, said, schema, error, lenient=.true.)
      if (allocated(error)) return
      call part%get(schema(1)%name, 1, schema(1)%keys(1)%name, value)
   end subroutine peek

   !> A group of each specification with its default values; an error is a mistake in the schema.
   pure subroutine set_defaults(self, error)
      type(input_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: problem
      integer :: k, s

      allocate (self%defaults(size(self%schema)))
      do s = 1, size(self%schema)
         associate (default => self%defaults(s), spec => self%schema(s))
            default%spec = s
            allocate (default%values(size(spec%keys)))
            do k = 1, size(spec%keys)
               call default%values(k)%set_default(spec%keys(k), problem)
               if (.not. allocated(problem)) cycle
               call raise(error, complaint("schema", spec%name, spec%keys(k)%name, &
                                           default%values(k)%as_written(spec%keys(k)), problem))
               return
            end do
         end associate
      end do
   end subroutine set_defaults

   !> Add a group, or put what is said about a key in its place. An option makes a group that is absent and can stand only once.
   pure subroutine admit(self, item, lenient, error)
      type(input_t), intent(inout) :: self
      type(entry_t), intent(in) :: item
      logical, intent(in) :: lenient
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: names(:)
      character(:), allocatable :: name, problem, text
      integer :: g, k, s

      allocate (names(0))
      associate (path => item%path)
         call self%find(path%group, path%index, path%key, s, g, k)
         if (lenient .and. (s == 0 .or. (k == 0 .and. len(path%key) > 0))) return
         if (s == 0) then
            do s = 1, size(self%schema)
               call append_text(names, self%schema(s)%name)
            end do
            problem = "there is no such group; "//did_you_mean(path%group, names, "groups")
         else if (len(path%key) == 0) then
            if (self%members(s)%count == 0 .or. self%schema(s)%repeatable) then
               call add_group(self, s, item%line)
               return
            end if
            g = self%members(s)%at(1)
            problem = "this group is allowed once, the first is in line "//to_text(self%groups(g)%line)
         else if (k == 0) then
            do k = 1, size(self%schema(s)%keys)
               call append_text(names, self%schema(s)%keys(k)%name)
            end do
            problem = "there is no such key; "//did_you_mean(path%key, names, "keys")
         else if (allocated(item%option) .and. path%element > self%schema(s)%keys(k)%most) then
            problem = "the highest subscript of '"//path%key//"' is "//to_text(self%schema(s)%keys(k)%most)
         else
            if (self%count(path%group) == 0 .and. path%index <= 1 .and. .not. self%schema(s)%repeatable) call add_group(self, s, 0)
            call choose_group(self, path, g, problem)
            if (.not. allocated(problem)) then
               call self%groups(g)%values(k)%enter(self%schema(s)%keys(k), item, problem)
               if (allocated(problem)) call self%complain(error, path%group, max(1, path%index), path%key, problem)
               return
            end if
         end if
         name = path%group
         if (allocated(item%option) .or. self%count(path%group) > 1) name = indexed(path%group, path%index)
         text = ""
         if (allocated(item%option)) text = item%option
         if (allocated(item%words)) text = words_text(item%words)
         call raise(error, complaint(self%origin(item%line), name, path%key, text, problem))
      end associate
   end subroutine admit

   !> Add a group with the default values of specification `s`.
   pure subroutine add_group(self, s, line)
      type(input_t), intent(inout) :: self
      integer, intent(in) :: s, line

      self%filled = self%filled + 1
      associate (group => self%groups(self%filled), members => self%members(s))
         group = self%defaults(s)
         group%line = line
         if (.not. allocated(members%at)) allocate (members%at(1))
         if (members%count == size(members%at)) call resize(members%at, 2_i8*members%count)
         members%count = members%count + 1
         members%at(members%count) = self%filled
         group%number = members%count
      end associate
   end subroutine add_group

   !> The group that a path means; its index may be left out where the group is there once.
   pure subroutine choose_group(self, path, g, problem)
      class(input_t), intent(in) :: self
      type(path_t), intent(in) :: path
      integer, intent(out) :: g
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: has
      integer :: count, k, s

      call self%find(path%group, max(1, path%index), path%key, s, g, k)
      count = self%count(path%group)
      has = "the input has &"//path%group//" "//to_text(count)//" times, "
      if (count == 1) has = "the input has &"//path%group//" once, "
      if (count == 0) then
         problem = "the input has no group &"//path%group
         if (path%group == "planetary") problem = problem//" any more: name a key of the groups it became, which --check prints"
      else if (g == 0) then
         problem = has//"the index must be 1"
         if (count > 1) problem = problem//" to "//to_text(count)
      else if (path%index == 0 .and. count > 1) then
         problem = has//"give an index: "//indexed(path%group, 1)//"%"//path%key//" to "//indexed(path%group, count)//"%"//path%key
      end if
   end subroutine choose_group

   !> Refuse a name that two groups have, in any case.
   pure subroutine check_names(self, error)
      type(input_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: code(self%filled)
      integer :: g, k, other

      code = 0
      do g = 1, self%filled
         associate (spec => self%schema(self%groups(g)%spec), group => self%groups(g))
            k = key_at(spec, "name")
            if (k == 0) cycle
            if (size(group%values(k)%words) == 0) cycle
            code(g) = text_code(lower(group%values(k)%words(1)%text))
            other = findloc(code(:g - 1), code(g), dim=1)
            if (code(g) == 0 .or. other == 0) cycle
            call self%complain(error, spec%name, group%number, "name", "the name must be unique, &"//self%label_of(other)// &
                               " has it")
            return
         end associate
      end do
   end subroutine check_names

   !> Find a number by its path, for `put`: `rotation%speed_rpm`, `load(2)%value`, `gear_mesh%radius(2)`; its subscript may be
   !> left out where there is one value. The message of an error has no place before it: it says what is wrong with the path,
   !> for the key of the input that holds the path.
   pure subroutine locate(self, text, slot, error)
      class(input_t), intent(in) :: self
      character(*), intent(in) :: text
      type(slot_t), intent(out) :: slot
      type(error_t), allocatable, intent(out) :: error
      type(path_t) :: path
      character(:), allocatable :: name, problem
      integer :: count, g, most, s
      logical :: ok

      call read_path(text, path, ok)
      if (ok) call self%find(path%group, path%index, path%key, s, g, slot%key)
      if (slot%key == 0) then
         problem = "there is no such value; "//did_you_mean(text, known_paths(self), "values")
      else
         call choose_group(self, path, slot%instance, problem)
      end if
      if (allocated(problem)) call raise(error, problem)
      if (allocated(error)) return
      associate (key => self%schema(s)%keys(slot%key), words => self%groups(slot%instance)%values(slot%key)%words)
         count = size(words)
         name = indexed(path%group, path%index)//"%"//path%key
         slot%path = indexed(name, path%element)
         slot%unit = key%unit
         slot%element = max(1, path%element)
         slot%whole = key%type == type_integer
         slot%number = ieee_value(slot%number, ieee_quiet_nan)
         if (slot%element <= count) slot%number = words(slot%element)%number
         ! one element more can be added, unless others before it are missing
         most = count
         if (count + 1 >= key%least) most = min(count + 1, key%most)
         if (key%type == type_logical) then
            call raise(error, name//" is a logical, only numbers can be varied")
         else if (key%type == type_string) then
            call raise(error, name//" is a text, only numbers can be varied")
         else if (path%element == 0 .and. count > 1) then
            call raise(error, name//" has "//to_text(count)//" values, give a subscript, "//name//"(1) to "//indexed(name, count))
         else if (most == 0) then
            call raise(error, name//" has no value, give all "//to_text(key%least)//" values first")
         else if (slot%element > most) then
            call raise(error, "the highest subscript of "//name//" is "//to_text(most))
         end if
      end associate
   end subroutine locate

   !> Paths of all numbers that the input has or may have.
   pure function known_paths(self) result(paths)
      class(input_t), intent(in) :: self
      type(string_t), allocatable :: paths(:)
      integer :: count, element, g, k
      logical :: single

      allocate (paths(0))
      do g = 1, self%filled
         associate (group => self%groups(g), spec => self%schema(self%groups(g)%spec))
            do k = 1, size(spec%keys)
               if (spec%keys(k)%type == type_logical .or. spec%keys(k)%type == type_string) cycle
               count = size(group%values(k)%words)
               ! of a single number the path has no subscript
               single = count <= 1 .and. spec%keys(k)%least == 1
               do element = merge(0, 1, single), merge(0, count, single)
                  call append_text(paths, self%label_of(g)//"%"//indexed(spec%keys(k)%name, element))
               end do
            end do
         end associate
      end do
   end function known_paths

   !> Change a number, in the unit of its key; refused, and left as it was, when the key's limits do not allow it.
   pure subroutine put(self, slot, number, error)
      class(input_t), intent(inout) :: self
      type(slot_t), intent(in) :: slot
      real(wp), intent(in) :: number
      type(error_t), allocatable, intent(out) :: error

      associate (group => self%groups(slot%instance), key => self%schema(self%groups(slot%instance)%spec)%keys(slot%key))
         if (.not. any(group%values(slot%key)%words%given)) group%values(slot%key)%line = group%line
         if (allows(key, number)) then
            call group%values(slot%key)%put(slot%element, number)
         else
            call raise(error, slot%path//" = "//to_text(number)//": must be "//allowed_text(key))
         end if
      end associate
   end subroutine put

   !> The effective input as text: every group in the order of the input with every value, defaults included. It is valid for
   !> Fortran's own namelist reading, and reading it back gives the same bits and the same text.
   pure function effective(self) result(text)
      class(input_t), intent(in) :: self
      character(:), allocatable :: text
      integer :: g, k

      text = ""
      do g = 1, self%filled
         associate (values => self%groups(g)%values, spec => self%schema(self%groups(g)%spec))
            text = text//"&"//spec%name//newline
            do k = 1, size(spec%keys)
               if (size(values(k)%words) > 0) text = text//values(k)%as_namelist(spec%keys(k))//newline
            end do
            text = text//"/"//newline
         end associate
      end do
   end function effective

   !> What the input says, as numbers, `within` the `groups` or else in all others, but for the number at `key` of `group`: of each
   !> key how many words it has, and these. Inputs of one schema with the same numbers say the same.
   pure function numbers(self, groups, within, group, key) result(list)
      class(input_t), intent(in) :: self
      character(*), intent(in) :: groups(:), group, key
      logical, intent(in) :: within
      real(wp), allocatable :: list(:)
      logical :: left_out(0:size(self%schema))
      integer :: at, g, i, k, key_left_out, n, s

      left_out = within
      do i = 1, size(groups)
         left_out(group_at(self%schema, groups(i))) = .not. within
      end do
      call self%find(group, 1, key, s, at, key_left_out)
      allocate (list(256))
      n = 0
      do g = 1, self%filled
         if (left_out(self%groups(g)%spec)) cycle
         associate (values => self%groups(g)%values)
            do k = 1, size(values)
               if (g == at .and. k == key_left_out) cycle
               associate (words => values(k)%words)
                  if (n + 1 + size(words) > size(list)) call resize(list, 2_i8*(n + 1 + size(words)))
                  list(n + 1) = size(words)
                  list(n + 2:n + 1 + size(words)) = words%number
                  n = n + 1 + size(words)
               end associate
            end do
         end associate
      end do
      list = list(:n)
   end function numbers

end module razy_input_input
