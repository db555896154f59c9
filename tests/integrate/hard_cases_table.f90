!! Runs every hard case by every method that its laws allow and prints what came out, as rows of the table in docs/hard_cases.md.
program hard_cases_table
   use hard_cases, only: case_names, hard_case, hard_case_t, method_of, way_names, ways
   use movers, only: follow
   use razy_core_kinds, only: wp
   use razy_integrate_integrator, only: outcome_t, status_meanings
   use razy_machine_method, only: method_t
   implicit none(type, external)

   type(hard_case_t) :: case
   type(method_t) :: method
   type(outcome_t) :: outcome
   character(24) :: only
   real(wp), allocatable :: x(:), v(:)
   real(wp) :: error, start, finish
   integer :: i, k
   logical :: allowed

   call get_command_argument(1, only)
   print "(a)", "| case | method | status | events | steps | error | time reached, s | CPU, s |"
   print "(a)", "|---|---|---|---|---|---|---|---|"
   do i = 1, size(case_names)
      if (only /= "" .and. only /= case_names(i)) cycle
      case = hard_case(trim(case_names(i)))
      allocate (x(size(case%x)), v(size(case%x)))
      do k = 1, ways
         call method_of(k, case, method, allowed)
         if (.not. allowed) cycle
         call cpu_time(start)
         call follow(case%machine, method, case%t_end, outcome, x, v)
         call cpu_time(finish)
         error = max(maxval(abs(x - case%x))/case%length, maxval(abs(v - case%v))/case%speed)
         print "(9a,i0,a,i0,a,es8.1,a,es12.5,a,f0.3,a)", "| ", trim(case_names(i)), " | ", trim(way_names(k)), " | ", &
            trim(status_meanings(outcome%status)), " | ", "", "", outcome%events, " | ", outcome%steps, " | ", error, " | ", &
            outcome%time, " | ", finish - start, " |"
      end do
      deallocate (x, v)
   end do
end program hard_cases_table
