!! Raw document and schema to a checked document: unknown, missing, doubled and wrong things are refused.
module razy_input_validation
   use razy_input_document, only: document_t, instance_t
   use razy_core_error, only: complaint, error_t, raise
   use razy_input_key_reader, only: default_tokens, read_key
   use razy_input_namelist, only: group_label, origin_of, raw_document_t
   use razy_core_number, only: to_text
   use razy_input_schema, only: group_at, group_names, group_spec_t, key_at, key_names
   use razy_core_text, only: did_you_mean, is_name, lower, string_t
   use razy_input_token, only: token_t, tokens_text
   use razy_input_value, only: convert
   implicit none(type, external)
   private

   public :: validate

contains

   !> Check `raw` against `schema`. The first thing that is wrong comes back as `file:line: &group key = value: allowed`.
   pure subroutine validate(raw, schema, document, error)
      type(raw_document_t), intent(in) :: raw
      type(group_spec_t), intent(in) :: schema(:)
      type(document_t), intent(out) :: document
      type(error_t), allocatable, intent(out) :: error
      integer :: g, s

      document%file = raw%file
      document%schema = schema
      call set_defaults(schema, document%defaults, error)
      if (allocated(error)) return
      allocate (document%instances(size(raw%groups)), document%members(size(schema)))
      do s = 1, size(schema)
         allocate (document%members(s)%instances(0))
      end do
      do g = 1, size(raw%groups)
         call admit_group(raw, g, document, error)
         if (allocated(error)) return
      end do
      do g = 1, size(raw%groups)
         call read_group(raw, g, schema(document%instances(g)%spec), document%instances(g), error)
         if (allocated(error)) return
      end do
      do s = 1, size(schema)
         if (.not. schema(s)%required .or. size(document%members(s)%instances) > 0) cycle
         call raise(error, complaint(raw%file, schema(s)%name, "", "", "this group is required"))
         return
      end do
      call check_names(document, error)
   end subroutine validate

   !> Default values of all groups; an error is a mistake in the schema.
   pure subroutine set_defaults(schema, defaults, error)
      type(group_spec_t), intent(in) :: schema(:)
      type(instance_t), allocatable, intent(out) :: defaults(:)
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: problem
      type(token_t), allocatable :: tokens(:)
      integer :: k, s

      allocate (defaults(size(schema)))
      do s = 1, size(schema)
         defaults(s)%spec = s
         allocate (defaults(s)%values(size(schema(s)%keys)))
         if (.not. is_name(schema(s)%name) .or. lower(schema(s)%name) /= schema(s)%name &
             .or. group_at(schema, schema(s)%name) /= s) then
            call raise(error, complaint("schema", schema(s)%name, "", "", "the name must be in lower case and unique"))
            return
         end if
         do k = 1, size(schema(s)%keys)
            associate (spec => schema(s)%keys(k))
               call default_tokens(spec, tokens, problem)
               if (.not. allocated(problem)) call convert(spec, tokens, defaults(s)%values(k), problem)
               if (.not. is_name(spec%name) .or. lower(spec%name) /= spec%name .or. key_at(schema(s), spec%name) /= k) then
                  problem = "the name must be in lower case and unique"
               end if
               if (spec%least < 1 .or. spec%most < spec%least) problem = "the numbers of values are contradictory"
               if (allocated(problem)) then
                  call raise(error, complaint("schema", schema(s)%name, spec%name, tokens_text(tokens), problem))
                  return
               end if
            end associate
         end do
      end do
   end subroutine set_defaults

   !> Find the specification of a group and count the group.
   pure subroutine admit_group(raw, g, document, error)
      type(raw_document_t), intent(in) :: raw
      integer, intent(in) :: g
      type(document_t), intent(inout) :: document
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: origin
      integer :: s

      origin = origin_of(raw, raw%groups(g)%line)
      s = group_at(document%schema, raw%groups(g)%name)
      if (s == 0) then
         call raise(error, complaint(origin, raw%groups(g)%name, "", "", "there is no such group; "// &
                                     did_you_mean(raw%groups(g)%name, group_names(document%schema), "groups")))
         return
      end if
      associate (members => document%members(s), instance => document%instances(g))
         if (size(members%instances) > 0 .and. .not. document%schema(s)%repeatable) then
            call raise(error, complaint(origin, raw%groups(g)%name, "", "", "this group is allowed once, the first is in line "// &
                                        to_text(raw%groups(members%instances(1))%line)))
            return
         end if
         members%instances = [members%instances, g]
         instance%spec = s
         instance%number = size(members%instances)
         instance%line = raw%groups(g)%line
      end associate
   end subroutine admit_group

   !> Check and convert all keys of a group.
   pure subroutine read_group(raw, g, spec, instance, error)
      type(raw_document_t), intent(in) :: raw
      integer, intent(in) :: g
      type(group_spec_t), intent(in) :: spec
      type(instance_t), intent(inout) :: instance
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k

      do i = 1, size(raw%groups(g)%entries)
         associate (item => raw%groups(g)%entries(i))
            if (key_at(spec, item%key) > 0) cycle
            call raise(error, complaint(origin_of(raw, item%line), group_label(raw, g), item%key, tokens_text(item%values), &
                                        "there is no such key; "//did_you_mean(item%key, key_names(spec), "keys")))
            return
         end associate
      end do
      allocate (instance%values(size(spec%keys)))
      do k = 1, size(spec%keys)
         call read_key(raw, g, spec%keys(k), instance%values(k), error)
         if (allocated(error)) return
      end do
   end subroutine read_group

   !> Refuse a name that two groups of the same name space have, in any case.
   pure subroutine check_names(document, error)
      type(document_t), intent(in) :: document
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: names(:)
      integer, allocatable :: keys(:)
      integer :: i, j, k

      allocate (names(size(document%instances)), keys(size(document%instances)))
      do i = 1, size(names)
         associate (item => document%instances(i), spec => document%schema(document%instances(i)%spec))
            keys(i) = 0
            names(i)%text = ""
            do k = 1, size(spec%keys)
               if (spec%keys(k)%is_name .and. item%values(k)%count() == 1) keys(i) = k
            end do
            if (keys(i) == 0) cycle
            names(i)%text = lower(item%values(keys(i))%strings(1)%text)
            do j = 1, i - 1
               if (keys(j) == 0 .or. names(j)%text /= names(i)%text) cycle
               if (document%schema(document%instances(j)%spec)%name_space /= spec%name_space) cycle
               call raise(error, document%message(i, keys(i), "the name must be unique, &"//document%label(j)//" has it"))
               return
            end do
         end associate
      end do
   end subroutine check_names

end module razy_input_validation
