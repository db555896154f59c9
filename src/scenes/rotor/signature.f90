!! What of a rotor's input its model and reduction are made of, as text: two inputs with the same one have the same model.
module razy_scenes_rotor_signature
   use razy_input_input, only: input_t
   implicit none(type, external)
   private

   public :: signature

   !> Groups that say what is done with a machine, or load it.
   character(*), parameter :: left_out(*) = [character(9) :: "motion", "record", "sweep", "initial", "load", "stop", "friction", &
                                                                                                       "starts", "duel"]
   character(*), parameter :: nl = new_line("a")

contains

   !> The effective input without the groups that do not enter the model, and without the speed.
   pure function signature(input) result(text)
      type(input_t), intent(in) :: input
      character(:), allocatable :: text

      character(:), allocatable :: all
      integer :: first, last, used
      logical :: kept

      all = input%effective()
      text = all
      used = 0
      kept = .true.
      first = 1
      do while (first <= len(all))
         last = index(all(first:), nl)
         last = merge(len(all), first + last - 1, last == 0)
         associate (line => all(first:last))
            if (line(1:1) == "&") kept = .not. any(left_out == line(2:verify(line//nl, "&"//nl, back=.true.)))
            if (kept .and. index(line, " speed_rpm = ") == 0) then
               text(used + 1:used + len(line)) = line
               used = used + len(line)
            end if
         end associate
         first = last + 1
      end do
      text = text(:used)
   end function signature

end module razy_scenes_rotor_signature
