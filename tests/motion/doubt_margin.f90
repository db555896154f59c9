!! The error of a displacement at the end of the hard cases, by every method with step control and events, in units of one tolerance
!! for each step, which is what razy_hybrid_cubic_doubts takes it for. Prints the distribution for docs/hard_cases.md.
program doubt_margin
   use hard_cases, only: case_names, hard_case, hard_case_t
   use movers, only: follow, tight
   use razy_core_kinds, only: wp
   use razy_motion_integrator, only: outcome_t, status_ok
   implicit none(type, external)

   character(*), parameter :: methods(*) = [character(16) :: "bogacki_shampine", "dormand_prince", "dop853", "radau5"]
   integer, parameter :: tightest(*) = [8, 12, 12, 11]
   real(wp), parameter :: shares(*) = [0.5_wp, 0.75_wp, 0.9_wp, 0.95_wp, 1.0_wp]

   type(hard_case_t) :: sample
   type(outcome_t) :: outcome
   real(wp), allocatable :: ratio(:), sorted(:), v(:), x(:)
   real(wp) :: tolerance
   integer :: i, k, p, without, wrong

   allocate (ratio(0))
   without = 0
   wrong = 0
   do k = 1, size(methods)
      do p = 4, tightest(k), 2
         tolerance = 10.0_wp**(-p)
         do i = 1, size(case_names)
            sample = hard_case(trim(case_names(i)))
            if (allocated(x)) deallocate (x, v)
            allocate (x(size(sample%x)), v(size(sample%x)))
            call follow(sample%machine, tight(methods(k), tolerance, tolerance*sample%length), sample%t_end, outcome, x, v)
            if (outcome%status /= status_ok) cycle
            ratio = [ratio, maxval(abs(x - sample%x))/(2*tolerance*sample%length*outcome%steps)]
            if (sample%events < 0 .or. outcome%events == sample%events) cycle
            wrong = wrong + 1
            if (outcome%doubts == 0) without = without + 1
            if (outcome%doubts == 0) print "(2a, i0, a, i0, a, i0)", case_names(i), methods(k), p, ": ", outcome%events, " of ", &
               sample%events
         end do
      end do
   end do
   sorted = ratio
   do i = 1, size(sorted)
      k = i - 1 + minloc(sorted(i:), 1)
      sorted([i, k]) = sorted([k, i])
   end do
   print "(i0, a, i0, a, i0)", size(sorted), " motions; events miscounted: ", wrong, ", without a doubt: ", without
   do i = 1, size(shares)
      print "(f6.0, a, es9.1)", 100*shares(i), " % of errors are below so many tolerances for each step:", &
         sorted(ceiling(shares(i)*size(sorted)))
   end do
   print "(f6.1, a)", 100.0_wp*count(sorted <= 1)/size(sorted), " % are below one"

end program doubt_margin
