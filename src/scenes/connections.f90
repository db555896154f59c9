!! Springs, dampers and bearings by the names that `&record` gives.
module razy_scenes_connections
   use razy_core_error, only: error_t
   use razy_core_text, only: append_text, did_you_mean, position_of, string_t
   use razy_input_input, only: input_t
   use razy_scenes_tables, only: is_linear
   implicit none(type, external)
   private

   public :: find_connection

contains

   !> Which of these `groups` is called `name` in `&record` number i: its group, number `group` of these, and its number.
   subroutine find_connection(input, i, groups, name, group, number, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(*), intent(in) :: groups(:), name
      integer, intent(out) :: group, number
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      character(:), allocatable :: text

      allocate (known(0))
      do group = 1, size(groups)
         do number = 1, input%count(trim(groups(group)))
            call input%get(trim(groups(group)), number, "name", text)
            if (len(text) == 0) cycle
            call append_text(known, text)
            if (position_of(name, known(size(known):)) == 0) cycle
            if (groups(group) /= "spring") return
            if (.not. is_linear(input, number)) call input%complain(error, "record", i, "observable", &
                                                                    "'contact_force' of a spring whose law is not 'linear'")
            return
         end do
      end do
      call input%complain(error, "record", i, "of", "the name of a "//trim(groups(1))//"; "// &
                          did_you_mean(name, known, "connections"))
   end subroutine find_connection

end module razy_scenes_connections
