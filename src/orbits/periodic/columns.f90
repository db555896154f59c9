!! How the equations of a periodic motion change with its period and with the parameter: their columns of the Jacobian matrix.
module razy_orbits_periodic_columns
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: differentiate, take_secant

   !> Steps of differences are not made smaller than by this factor: less would be rounding.
   real(wp), parameter :: least_difference = 0.02_wp
   !> Beside a grazing, where the map bends, they may be: until second differences are this part of the first.
   real(wp), parameter :: least_bent = 1.0e-3_wp, bent = 1.0e-3_wp
   !> Secants that are so short in the parameter, or whose share of it is so small, say nothing of it; beyond longer ones than this
   !> the column is that of another motion.
   real(wp), parameter :: shortest_secant = 1.0e-10_wp, steepest_secant = 0.005_wp, longest_secant = 1.0e-4_wp

contains

   !> Columns of the period, without excitation, and of the parameter, by central differences; of motions without errors with
   !> steps so small that the sequence of contacts stays: across a grazing a difference says nothing of the slope.
   subroutine differentiate(problem, orbit, ok)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      type(orbit_t) :: above, below
      real(wp) :: before, by(size(orbit%u)), least, length, most, ratio, share
      integer :: i, last, m
      logical :: like(2), made(2), straight

      m = problem%states()
      last = size(orbit%u)
      if (allocated(orbit%column)) deallocate (orbit%column)
      allocate (orbit%column(problem%order(), last - m))
      do i = m + 1, last
         by = 0.0_wp
         length = problem%step*merge(1.0_wp, max(1.0_wp, abs(orbit%u(i))), problem%resolution > 0.0_wp)
         least = least_difference*length
         before = huge(1.0_wp)
         do
            by(i) = length
            call problem%evaluate(orbit%u + by, .false., above, made(1))
            share = 0.1_wp
            like = made(1)
            if (made(1)) like = above%sequence%is_like(orbit%sequence)
            if (made(1) .and. .not. (like(1) .or. problem%resolution > 0.0_wp) .and. length > least) then
               ! Whatever is on the other side, this step is too long, where it may be shorter than the errors of a method.
               length = length*share
               cycle
            end if
            call problem%evaluate(orbit%u - by, .false., below, made(2))
            like(2) = made(2)
            if (made(2)) like(2) = below%sequence%is_like(orbit%sequence)
            straight = all(made) .and. problem%resolution > 0.0_wp .and. .not. all(like)
            if (all(made) .and. .not. straight) then
               ratio = norm2(above%residual + below%residual - 2*orbit%residual)
               associate (difference => norm2(above%residual - below%residual))
                  ! The square of the bend stays in the column, beside the 1 of the equations x = P(x).
                  most = merge(min(bent, sqrt(2*bent*length/max(difference, tiny(1.0_wp)))), bent, problem%resolution > 0.0_wp)
                  straight = ratio <= most*difference
                  if (all(like)) ratio = ratio/max(difference, sqrt(tiny(1.0_wp)))
                  if (all(like)) share = min(0.3_wp, max(1.0e-2_wp, 0.5_wp*most/max(ratio, epsilon(ratio))))
               end associate
               ! What does not fall is rounding.
               straight = straight .or. all(like) .and. ratio > before
               if (all(like)) before = ratio
            end if
            if (straight .and. (all(like) .or. length <= least)) exit
            ! A step that errors allow may lead across a change of contacts, but not to both sides.
            straight = straight .and. .not. any(like)
            if ((like(1) .neqv. like(2)) .and. problem%resolution > 0.0_wp) exit
            if (length <= merge(least_bent*least, least, all(made))) exit
            length = length*share
         end do
         ok = all(made) .or. any(like)
         if (.not. ok) return
         ! At a touch one side alone has the motion's neighbours, at an end of what is allowed there is no machine on the other.
         if (.not. straight .and. (like(1) .neqv. like(2))) then
            if (like(1)) below%residual = 2*orbit%residual - above%residual
            if (like(2)) above%residual = 2*orbit%residual - below%residual
         end if
         orbit%column(:, i - m) = (above%residual - below%residual)/(2*length)
      end do
      orbit%has_columns = .true.
   end subroutine differentiate

   !> The column of the parameter from how the equations change between two motions with the same contacts, as their derivatives by
   !> the states are known; not `taken` where Newton's method does not converge, or they hardly differ in the parameter. It has the
   !> column of this motion if the other is near.
   subroutine take_secant(problem, earlier, orbit, taken)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: earlier
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: taken

      real(wp), allocatable :: mean(:, :)
      logical :: alike, kept

      associate (m => problem%states(), step => orbit%u - earlier%u)
         alike = orbit%sequence%is_like(earlier%sequence)
         taken = alike .and. .not. (problem%is_autonomous() .or. problem%resolution > 0.0_wp)
         if (taken) taken = norm2(orbit%residual) < 0.1_wp*norm2(earlier%residual)
         if (taken) taken = abs(step(m + 1)) > max(shortest_secant, steepest_secant*norm2(step))
         if (taken) then
            mean = 0.5_wp*(problem%jacobian(orbit) + problem%jacobian(earlier))
            orbit%column(:, 1) = (orbit%residual - earlier%residual - matmul(mean(:, :m), step(:m)))/step(m + 1)
         end if
         ! Without secants the column of a motion so near is another one where the map bends, as where motions are left in a period.
         kept = earlier%has_columns .and. (orbit%bend*norm2(step) <= bent .or. .not. problem%resolution > 0.0_wp)
         orbit%has_columns = alike .and. (taken .or. kept) .and. norm2(step) < longest_secant
      end associate
   end subroutine take_secant

end module razy_orbits_periodic_columns
