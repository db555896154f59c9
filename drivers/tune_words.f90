!! The answer of a tuning in words for the user.
module tune_words
   use command_line, only: decimal
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, string_t
   use razy_eigen_tuning, only: change_t, changes
   use tune_case, only: tune_t
   implicit none(type, external)
   private

   public :: words_of

   !> More changes of a mode than this are counted, not listed.
   integer, parameter :: most_lines = 8

contains

   !> The answer, and what becomes of the mode over the range, in lines for the user.
   function words_of(self) result(lines)
      type(tune_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      type(change_t), allocatable :: list(:)
      integer :: i, k

      allocate (lines(0))
      associate (answer => self%answer)
         call append_text(lines, self%name//" = "//to_text(answer%parameter)//" "//self%unit//": "//self%mode_words// &
                          " has "//decimal(answer%frequency, 6)//" Hz, share "//decimal(answer%share, 3))
         if (answer%others > 0) call append_text(lines, "the value nearest to that of the input; others in the range: " &
                                                 //to_text(answer%others))
         if (abs(answer%frequency/self%frequency - 1) > 1.0e-12_wp) then
            call append_text(lines, "rounding keeps the frequency from its goal by more than 1e-12 of it")
         end if
      end associate
      list = changes(self%branches, self%grid(1), self%grid(size(self%grid)))
      k = 0
      do i = 1, size(list)
         if (list(i)%branch(1) == list(i)%branch(2) .and. list(i)%place(1) == list(i)%place(2) .and. self%coordinate > 0) cycle
         k = k + 1
         if (k <= most_lines) call append_text(lines, change_words(self, list(i)))
      end do
      if (k > most_lines) call append_text(lines, "and "//to_text(k - most_lines)//" more changes of place or shape")
      if (.not. self%branches%resolved) call append_text(lines, "some modes change too often to be followed with certainty")
   end function words_of

   !> One change of the mode in words.
   function change_words(self, change) result(line)
      type(tune_t), intent(in) :: self
      type(change_t), intent(in) :: change
      character(:), allocatable :: line

      line = "at "//self%name//" = "//to_text(real(change%parameter(1), wp))//" "//self%unit//", "
      if (change%branch(1) /= change%branch(2)) then
         line = line//"veering: "//self%mode_words//" is number "//to_text(change%place(1))//" below and " &
                //to_text(change%place(2))//" above, with a gap from "//decimal(minval(change%frequency), 4)//" to " &
                //decimal(maxval(change%frequency), 4)//" Hz"
      else if (change%place(1) /= change%place(2)) then
         line = line//"crossing: "//self%mode_words//" goes from place "//to_text(change%place(1))//" to " &
                //to_text(change%place(2))//" at "//decimal(change%frequency(1), 4)//" Hz"
      else
         line = line//self%mode_words//" turns from mostly "//trim(self%machine%coordinate(change%coordinate(1)))//" to mostly " &
                //trim(self%machine%coordinate(change%coordinate(2)))//" at "//decimal(change%frequency(1), 4)//" Hz"
      end if
   end function change_words

end module tune_words
