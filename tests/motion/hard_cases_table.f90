!! Runs every hard case by every method that its laws allow and prints the table of docs/hard_cases.md.
program hard_cases_table
   use hard_cases, only: case_names, hard_case, hard_case_t, method_of, way_names, ways
   use movers, only: follow
   use razy_core_kinds, only: wp
   use razy_motion_integrator, only: outcome_t, status_meanings, status_ok
   use razy_motion_method, only: method_t
   implicit none(type, external)

   character(:), allocatable :: line
   integer :: i, k

   line = "| case |"
   do k = 1, ways
      line = line//" "//trim(way_names(k))//" |"
   end do
   print "(a)", line
   print "(a)", repeat("|---", ways + 1)//"|"
   do i = 1, size(case_names)
      line = "| "//trim(case_names(i))//" |"
      do k = 1, ways
         line = line//" "//cell(trim(case_names(i)), k)//" |"
      end do
      print "(a)", line
   end do

contains

   !> What comes out: the error of the state in the units of the case, changes of branch if they are not those of the closed form,
   !> near misses behind a question mark, or the status and the time reached.
   function cell(name, way) result(text)
      character(*), intent(in) :: name
      integer, intent(in) :: way
      character(:), allocatable :: text

      type(hard_case_t) :: sample
      type(method_t) :: method
      type(outcome_t) :: outcome
      character(40) :: buffer
      real(wp), allocatable :: x(:), v(:)
      logical :: allowed

      text = "–"
      sample = hard_case(name)
      call method_of(way, sample, method, allowed)
      if (.not. allowed) return
      allocate (x(size(sample%x)), v(size(sample%x)))
      call follow(sample%machine, method, sample%t_end, outcome, x, v)
      if (outcome%status /= status_ok) then
         write (buffer, "(2a, f0.4, a)") trim(status_meanings(outcome%status)), ", ", outcome%time, " s"
      else
         write (buffer, "(es7.0e2)") max(maxval(abs(x - sample%x))/sample%length, maxval(abs(v - sample%v))/sample%speed)
      end if
      text = trim(adjustl(buffer))
      if (index(text, ".E") > 0) text = text(:index(text, ".E") - 1)//text(index(text, ".E") + 1:)
      if (text == "0E+00") text = "0"
      if (sample%events >= 0 .and. outcome%events /= sample%events) then
         write (buffer, "(a, i0, a, i0, a)") " (", outcome%events, " of ", sample%events, ")"
         text = text//trim(buffer)
      end if
      if (outcome%near_misses == 0) return
      write (buffer, "(a, i0)") " ?", outcome%near_misses
      text = text//trim(buffer)
   end function cell

end program hard_cases_table
