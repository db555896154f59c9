!! Numbers of an input that a sweep or a search changes: found once by path, then set point by point.
module razy_input_slot
   use razy_input_document, only: document_t
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_input_path, only: parse_path, path_t, path_text
   use razy_input_schema, only: group_at, key_at, type_integer, type_real
   use razy_core_text, only: append_text, did_you_mean, string_t
   use razy_input_value, only: allowed_text, within
   implicit none(type, external)
   private

   public :: slot_t, locate_slot, put_slot

   !> Where one number of a document is; valid for documents of the same text and schema.
   type :: slot_t
      !> In lower case, with the indices that are needed
      character(:), allocatable :: path
      integer :: instance = 0
      integer :: key = 0
      integer :: element = 1
      !> Whether it is an integer
      logical :: whole = .false.
   end type slot_t

contains

   !> Find `group%key`, `group(i)%key` or `group%key(j)`. The message of an error has no place before it: it says what is
   !> wrong with the path, for the key of the input that holds the path.
   pure subroutine locate_slot(document, text, slot, error)
      type(document_t), intent(in) :: document
      character(*), intent(in) :: text
      type(slot_t), intent(out) :: slot
      type(error_t), allocatable, intent(out) :: error
      type(path_t) :: path
      character(:), allocatable :: problem
      integer :: spec
      logical :: ok

      slot%path = ""
      call parse_path(text, path, ok)
      spec = group_at(document%schema, path%group)
      if (spec > 0) slot%key = key_at(document%schema(spec), path%key)
      if (.not. ok .or. slot%key == 0) then
         call raise(error, "there is no such value; "//did_you_mean(text, known_paths(document), "values"))
         return
      end if
      call choose_instance(document, spec, path, slot%instance, problem)
      if (.not. allocated(problem)) call choose_element(document, spec, path, slot, problem)
      if (allocated(problem)) then
         call raise(error, problem)
         return
      end if
      slot%path = path_text(path%group, path%index, path%key, path%element)
   end subroutine locate_slot

   !> The group that a path means; its index may be left out where the group is there once.
   pure subroutine choose_instance(document, spec, path, instance, problem)
      type(document_t), intent(in) :: document
      integer, intent(in) :: spec
      type(path_t), intent(in) :: path
      integer, intent(out) :: instance
      character(:), allocatable, intent(out) :: problem
      integer :: count

      instance = 0
      count = size(document%members(spec)%instances)
      if (count == 0) then
         problem = "the input has no group &"//path%group
      else if (path%index > count) then
         problem = "the index of "//path%group//" must be 1"
         if (count > 1) problem = problem//" to "//to_text(count)
      else if (path%index == 0 .and. count > 1) then
         problem = "give an index, "//path_text(path%group, 1, path%key, 0)//" to "//path_text(path%group, count, path%key, 0)
      else
         instance = document%members(spec)%instances(max(1, path%index))
      end if
   end subroutine choose_instance

   !> The element that a path means; its subscript may be left out where there is one value.
   pure subroutine choose_element(document, spec, path, slot, problem)
      type(document_t), intent(in) :: document
      integer, intent(in) :: spec
      type(path_t), intent(in) :: path
      type(slot_t), intent(inout) :: slot
      character(:), allocatable, intent(out) :: problem
      character(*), parameter :: kinds(4) = [character(14) :: "a real number", "an integer", "a logical", "a text"]
      character(:), allocatable :: name
      integer :: count, most

      associate (key => document%schema(spec)%keys(slot%key))
         name = path_text(path%group, path%index, path%key, 0)
         count = document%instances(slot%instance)%values(slot%key)%count()
         most = count
         if (count + 1 >= key%least) most = min(count + 1, key%most)
         slot%element = max(1, path%element)
         slot%whole = key%type == type_integer
         if (key%type /= type_real .and. .not. slot%whole) then
            problem = name//" is "//trim(kinds(key%type))//", only numbers can be varied"
         else if (path%element == 0 .and. count > 1) then
            problem = name//" has "//to_text(count)//" values, give a subscript, "//name//"(1) to "//name//"("//to_text(count)//")"
         else if (most == 0) then
            problem = name//" has no value, give all "//to_text(key%least)//" values first"
         else if (slot%element > most) then
            problem = "the highest subscript of "//name//" is "//to_text(most)
         end if
      end associate
   end subroutine choose_element

   !> Paths of all numbers that the input has or may have.
   pure function known_paths(document) result(paths)
      type(document_t), intent(in) :: document
      type(string_t), allocatable :: paths(:)
      integer :: element, i, k, number

      allocate (paths(0))
      do i = 1, size(document%instances)
         associate (item => document%instances(i), spec => document%schema(document%instances(i)%spec))
            number = item%number
            if (size(document%members(item%spec)%instances) == 1) number = 0
            do k = 1, size(spec%keys)
               if (spec%keys(k)%type /= type_real .and. spec%keys(k)%type /= type_integer) cycle
               if (item%values(k)%count() <= 1 .and. spec%keys(k)%least == 1) then
                  call append_text(paths, path_text(spec%name, number, spec%keys(k)%name, 0))
                  cycle
               end if
               do element = 1, item%values(k)%count()
                  call append_text(paths, path_text(spec%name, number, spec%keys(k)%name, element))
               end do
            end do
         end associate
      end do
   end function known_paths

   !> Set the value; an error when the key does not allow it, and then nothing is changed.
   pure subroutine put_slot(document, slot, number, error)
      type(document_t), intent(inout) :: document
      type(slot_t), intent(in) :: slot
      real(wp), intent(in) :: number
      type(error_t), allocatable, intent(out) :: error

      associate (value => document%instances(slot%instance)%values(slot%key), &
                 key => document%schema(document%instances(slot%instance)%spec)%keys(slot%key))
         if (.not. within(key, number)) then
            call raise(error, slot%path//" = "//to_text(number)//": must be "//allowed_text(key))
            return
         end if
         if (slot%whole) then
            if (abs(number - anint(number)) > 0.0_wp .or. abs(number) > huge(1)) then
               call raise(error, slot%path//" = "//to_text(number)//": must be "//allowed_text(key))
               return
            end if
            if (slot%element > size(value%integers)) value%integers = [value%integers, nint(number)]
            value%integers(slot%element) = nint(number)
         else
            if (slot%element > size(value%reals)) value%reals = [value%reals, number]
            value%reals(slot%element) = number
         end if
         if (.not. value%given) value%line = document%instances(slot%instance)%line
         value%given = .true.
         if (allocated(value%text)) deallocate (value%text)
      end associate
   end subroutine put_slot

end module razy_input_slot
