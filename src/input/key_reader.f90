!! The value of one key of a group: what its entries in the file, the command line and the default make together.
module razy_input_key_reader
   use razy_core_error, only: complaint, error_t, raise
   use razy_input_namelist, only: entry_t, group_label, origin_of, raw_document_t, raw_group_t
   use razy_core_number, only: to_text
   use razy_input_schema, only: key_spec_t
   use razy_input_token, only: token_t, tokens_text
   use razy_input_value, only: allowed_text, convert, option_tokens, value_t
   implicit none(type, external)
   private

   public :: read_key, default_tokens

   !> What the entries of one key make together.
   type :: gathered_t
      type(token_t), allocatable :: tokens(:)
      logical, allocatable :: filled(:)
      !> Whether an entry without subscript was met
      logical :: whole = .false.
      !> Of the last entry; 0 for the command line
      integer :: line = 0
   end type gathered_t

contains

   !> Check and convert one key of group `g`, or take its default.
   pure subroutine read_key(raw, g, spec, value, error)
      type(raw_document_t), intent(in) :: raw
      integer, intent(in) :: g
      type(key_spec_t), intent(in) :: spec
      type(value_t), intent(out) :: value
      type(error_t), allocatable, intent(out) :: error
      type(gathered_t) :: all
      character(:), allocatable :: problem, text

      call gather(raw%groups(g), spec, all, problem)
      if (allocated(problem)) then
         text = tokens_text(given_tokens(all))
      else
         text = tokens_text(all%tokens)
         call convert(spec, all%tokens, value, problem)
      end if
      if (.not. allocated(problem) .and. size(all%tokens) == 0 .and. spec%required) then
         all%line = raw%groups(g)%line
         problem = "is required, "//allowed_text(spec)
      end if
      if (allocated(problem)) then
         call raise(error, complaint(origin_of(raw, all%line), group_label(raw, g), spec%name, text, problem))
         return
      end if
      value%given = any(all%filled)
      value%line = all%line
      if (value%given) value%text = text
   end subroutine read_key

   !> Put together what the entries of a key and its default say, element by element.
   pure subroutine gather(group, spec, all, problem)
      type(raw_group_t), intent(in) :: group
      type(key_spec_t), intent(in) :: spec
      type(gathered_t), intent(out) :: all
      character(:), allocatable, intent(out) :: problem
      type(token_t), allocatable :: defaults(:)
      integer :: i, missing

      allocate (all%tokens(0), all%filled(0))
      do i = 1, size(group%entries)
         if (group%entries(i)%key /= spec%name) cycle
         call add_entry(group%entries(i), spec, all, problem)
         if (allocated(problem)) return
      end do
      call default_tokens(spec, defaults, problem)
      if (.not. all%whole .and. size(all%tokens) < size(defaults)) then
         call lengthen(all, size(defaults))
      end if
      do missing = 1, size(all%tokens)
         if (all%filled(missing)) cycle
         if (missing > size(defaults)) then
            problem = spec%name//"("//to_text(missing)//") is missing"
            return
         end if
         all%tokens(missing) = defaults(missing)
      end do
   end subroutine gather

   !> Make room for more elements, which nothing has filled yet.
   pure subroutine lengthen(all, length)
      type(gathered_t), intent(inout) :: all
      integer, intent(in) :: length
      type(token_t), allocatable :: longer(:)

      allocate (longer(length))
      longer(:size(all%tokens)) = all%tokens
      all%filled = [all%filled, spread(.false., 1, length - size(all%tokens))]
      call move_alloc(longer, all%tokens)
   end subroutine lengthen

   !> The elements that were given.
   pure function given_tokens(all) result(tokens)
      type(gathered_t), intent(in) :: all
      type(token_t), allocatable :: tokens(:)
      integer :: i, n

      allocate (tokens(count(all%filled)))
      n = 0
      do i = 1, size(all%tokens)
         if (.not. all%filled(i)) cycle
         n = n + 1
         tokens(n) = all%tokens(i)
      end do
   end function given_tokens

   !> Add one entry; one from the command line replaces, one from the file may not be said twice.
   pure subroutine add_entry(item, spec, all, problem)
      type(entry_t), intent(in) :: item
      type(key_spec_t), intent(in) :: spec
      type(gathered_t), intent(inout) :: all
      character(:), allocatable, intent(out) :: problem
      type(token_t), allocatable :: values(:)
      integer :: first, i, last, previous

      previous = all%line
      all%line = item%line
      if (allocated(item%option)) then
         call option_tokens(spec, item%option, values, problem)
         if (item%first > 0 .and. size(values) /= 1) problem = "one element takes one value"
      else
         values = item%values
         if (all%whole .or. (item%first == 0 .and. size(all%tokens) > 0)) problem = twice(previous)
      end if
      if (item%first == 0) then
         all%whole = .true.
         all%tokens = values
         all%filled = spread(.true., 1, size(values))
         return
      end if
      first = item%first
      last = item%last
      if (last > size(all%tokens)) call lengthen(all, last)
      if (.not. allocated(item%option) .and. any(all%filled(first:last))) problem = twice(previous)
      if (allocated(problem)) return
      do i = first, last
         all%tokens(i) = values(i - first + 1)
      end do
      all%filled(first:last) = .true.
   end subroutine add_entry

   pure function twice(line) result(problem)
      integer, intent(in) :: line
      character(:), allocatable :: problem

      problem = "is given twice, first in line "//to_text(line)
   end function twice

   !> Values of a default; none when there is no default.
   pure subroutine default_tokens(spec, tokens, problem)
      type(key_spec_t), intent(in) :: spec
      type(token_t), allocatable, intent(out) :: tokens(:)
      character(:), allocatable, intent(out) :: problem

      if (allocated(spec%default)) then
         call option_tokens(spec, spec%default, tokens, problem)
      else
         allocate (tokens(0))
      end if
   end subroutine default_tokens

end module razy_input_key_reader
