!! Newton's method for a periodic motion: its equations (razy_orbits_periodic_problem) with the row that makes them a square.
module razy_orbits_periodic_newton
   use razy_core_kinds, only: wp
   use razy_linalg_square, only: bordered, solve_square
   use razy_orbits_periodic_columns, only: differentiate, take_secant
   use razy_orbits_periodic_multipliers, only: find_multipliers
   use razy_orbits_periodic_orbit, only: orbit_t, scaled
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: complete, correct

   !> Corrections that do not fall to half of the least within so many rounds do not converge.
   integer, parameter :: most_rounds = 25, most_vain = 4
   !> A residual of so little, relative to the state and to how the map grows, is rounding.
   real(wp), parameter :: converged = 1.0e-14_wp, far = 1.0_wp, rounding = 16*epsilon(1.0_wp), most_rounding = 1.0e-10_wp

contains

   !> Newton's method from `guess` in the plane row·(u - guess) = 0; `orbit` comes with the columns of a motion nearby, if it
   !> has any.
   subroutine correct(problem, guess, row, orbit, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: guess(:), row(:)
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      type(orbit_t) :: earlier
      real(wp), allocatable :: change(:), matrix(:, :)
      real(wp) :: before, growth, least, miss, nearly, unit
      integer :: better, m, round
      logical :: fresh, held, rounded, secant, slow, was_fresh

      before = far/epsilon(1.0_wp)
      least = 2*before
      secant = .false.
      slow = .false.
      was_fresh = .false.
      nearly = problem%accuracy*max(1.0_wp, norm2(guess(:problem%order())))
      orbit%u = guess
      orbit%rounds = 1
      m = problem%states()
      ! Where the parameter is held its column bears on nothing.
      held = .not. (problem%is_autonomous() .or. any(abs(row(:m)) > 0.0_wp))
      if (held) orbit%column = spread([0.0_wp], 1, m)
      do round = 1, most_rounds
         ! What goes on below the errors of a method says nothing of the step.
         if (before > nearly .or. .not. problem%resolution > 0.0_wp) orbit%rounds = round
         call problem%evaluate(orbit%u, .true., orbit, ok)
         if (.not. ok) return
         ! One direction may not show how the derivative changes: those before count, less and less.
         if (round > 1) then
            orbit%bend = max(0.8_wp*orbit%bend, norm2(scaled(orbit%monodromy() - earlier%monodromy(), problem%scales()))/before)
            call take_secant(problem, earlier, orbit, secant)
         end if
         ! Columns of another place make convergence linear.
         fresh = .not. held .and. (.not. allocated(orbit%column) .or. slow .or. &
                                   modulo(round, 4) == 2 .and. before > nearly .and. .not. secant)
         if (fresh) call differentiate(problem, orbit, ok)
         if (.not. ok) return
         earlier = orbit
         fresh = fresh .or. secant .or. held
         matrix = bordered(problem%jacobian(orbit), row)
         growth = norm2(matrix(:m, :m))
         change = -[orbit%residual, dot_product(row, orbit%u - guess)]
         associate (n => problem%map%n, held => orbit%held)
            ! What sticks stays where the guess has it: what the map misses there is rounding.
            change(m - n + 1:m) = change(m - n + 1:m) + matmul(held, matmul(orbit%u(:n) - guess(:n) - change(m - n + 1:m), held))
         end associate
         miss = norm2(change(:problem%order()))
         call solve_square(matrix, change, ok)
         ok = ok .and. all(abs(change) <= huge(1.0_wp))
         orbit%correction = norm2(change)
         ! At a branch point corrections are rounding over what is hardly more.
         unit = max(1.0_wp, norm2(orbit%u(:problem%order())))
         rounded = miss <= rounding*(1.0_wp + growth)*unit
         ! So is what no change of the derivative explains after a step with columns of its place, as beside many stiff events.
         rounded = rounded .or. all([fresh, was_fresh]) .and. miss <= most_rounding*unit .and. miss > orbit%bend*before**2
         ! What columns of another place say is small may be far, too.
         if (ok) ok = orbit%correction <= merge(far, min(far, max(10*before, nearly)), rounded .or. miss <= most_rounding*unit &
                                                .or. fresh .and. .not. was_fresh)
         if (orbit%correction <= 0.5_wp*least) then
            least = orbit%correction
            better = round
         end if
         if (ok .and. round - better >= most_vain) ok = orbit%correction <= nearly
         if (.not. ok) exit
         ! A column of another place, steep beside a grazing, makes corrections small where nothing is solved.
         if (orbit%correction <= converged*unit .and. (fresh .or. miss <= nearly)) then
            orbit%u = orbit%u + change
            exit
         end if
         ! With columns of this place, corrections that hardly shrink are rounding, or the errors of the method.
         if ((orbit%correction <= nearly .or. rounded) .and. orbit%correction > 0.25_wp*before .and. &
             (held .or. orbit%has_columns .or. problem%resolution > 0.0_wp)) exit
         was_fresh = fresh
         slow = orbit%correction > 0.1_wp*before .and. .not. problem%resolution > 0.0_wp
         orbit%u = orbit%u + change
         before = orbit%correction
      end do
      ! Where P jumps, the column of the parameter is steep, and corrections are small also far from a motion.
      ok = ok .and. (rounded .or. orbit%correction <= nearly .and. miss <= nearly*(1.0_wp + growth))
      if (.not. ok) problem%reason = "Newton's method does not converge"
   end subroutine correct

   !> All that is asked of a motion that was found: its columns and multipliers.
   subroutine complete(problem, orbit, ok)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      ok = orbit%has_columns
      if (.not. ok) call differentiate(problem, orbit, ok)
      if (ok) call find_multipliers(problem, orbit)
   end subroutine complete

end module razy_orbits_periodic_newton
