!! Periodic motions by Newton's method on the period map.
!!
!! Unknowns u: the states x_i at the beginning of each of the m periods of the excitation in one of the motion, without excitation
!! one state and the period T, and one parameter p, each in units of its scale. Equations:
!!
!!     P(x_i, T, p) - x_(i+1) = 0, x_(m+1) = x_1,    v·(x - x0) = 0 without excitation,    r·u = c:
!!
!! multiple shooting, as what grows in one period after the other would leave no more than its rounding to Newton's method
!! (H. B. Keller, Numerical Methods for Two-Point Boundary-Value Problems, Blaisdell (1968)); the section v goes through the
!! motion at x0 (v = x' there), and the row r either holds the parameter or is the plane across the tangent of a branch
!! (Keller's pseudo-arclength; E. Doedel, H. B. Keller, J. P. Kernevez, Int. J. Bifurc. Chaos 1 (1991) 493-520).
!! ∂P/∂x comes with the motion; columns of T and p are secants or central differences of it, and bear on convergence alone.
!! P is what the propagator finds: a solution is a motion, with the contacts that it has, and none that another sequence
!! would need.
module razy_orbits_orbit
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_stable, is_undecided, is_unstable
   use razy_linalg_eigen, only: right_eigen
   use razy_linalg_lapack, only: dgetrf, dgetrs
   use razy_machine_machine, only: is_ring
   use razy_motion_integrator, only: status_ok
   use razy_observe_event_log, only: event_log_t
   use razy_orbits_period_map, only: period_map_t, return_t
   implicit none(type, external)
   private

   public :: bordered, determinant, orbit_t, problem_t, report_work, solve_square, was_stopped

   !> What is looked for: motions of `periods` periods of the excitation, with parameter number `active` of `parameter` free.
   type :: problem_t
      type(period_map_t) :: map
      integer :: periods = 1, active = 1
      real(wp), allocatable :: parameter(:)
      !> Step of the differences by period and parameter, in units of their scales: larger for a method of larger errors.
      real(wp) :: step = 1.0e-7_wp
      !> Correction with which Newton's method may end, its square less than rounding, so that no motion is found beyond a fold; and
      !> distance at which what lies beside a change of contacts is told apart from it, relative to the state.
      real(wp), private :: accuracy = 1.0e-11_wp
      real(wp) :: resolution = 0.0_wp
      !> Scales of displacements, velocities and the parameter; period, s, where there is no excitation (also its scale).
      real(wp) :: displacement = 1.0_wp, velocity = 1.0_wp, range = 1.0_wp, period = 0.0_wp
      !> The section, without excitation: x0 and v, in scaled unknowns.
      real(wp), allocatable :: origin(:), normal(:)
      !> Why the last evaluation failed.
      character(:), allocatable :: reason
      !> Told of what takes long, if it is associated.
      procedure(report_work), pointer, nopass :: report => null()
   contains
      procedure :: begin
      procedure :: take_steps
      procedure :: is_autonomous
      procedure :: states
      procedure :: order
      procedure :: scales
      procedure :: value_of
      procedure :: tell
      procedure :: go_to
      procedure :: evaluate
      procedure :: differentiate
      procedure :: complete
      procedure :: correct
      procedure, private :: take_secant
      procedure :: has_rings
      procedure :: is_stopped
      procedure :: jacobian
   end type problem_t

   !> A motion: u, what comes of it, and its derivatives.
   type :: orbit_t
      real(wp), allocatable :: u(:), residual(:)
      !> ∂P/∂x of each part without scales (n, n, parts), columns of the period and the parameter (order, 1 or 2), scaled.
      real(wp), allocatable :: derivative(:, :, :), column(:, :)
      !> Whether the columns are those of this motion, not of one nearby.
      logical, private :: has_columns = .false.
      !> What the frictions that stick all the time hold, in scaled unknowns: an orthonormal basis of displacements (n, held). There
      !> is a motion for each of its places, so that each motion is looked for where the guess has it. These frictions' numbers.
      real(wp), allocatable :: held(:, :)
      integer, allocatable :: stuck(:)
      !> Floquet multipliers (n; without excitation n - 1), and how far off they may be (the same number).
      complex(wp), allocatable :: multiplier(:)
      real(wp), allocatable :: doubt(:)
      type(event_log_t) :: sequence
      !> Phase at which it begins, in periods of the excitation, and how long it takes, s.
      real(wp) :: phase = 0.0_wp, duration = 0.0_wp
      !> Length of the last correction, and how much the scaled derivative changes with u, over a unit length.
      real(wp) :: correction = huge(1.0_wp), bend = 0.0_wp
      integer :: rounds = 0
   contains
      procedure :: monodromy
      procedure :: find_multipliers
      procedure :: keep_held
      procedure :: stability
      procedure :: outside
   end type orbit_t

   abstract interface
      !> So many periods, points or other things of this kind are done, the last at a value of the parameter in its unit.
      subroutine report_work(what, count, value)
         import :: wp
         implicit none(type, external)
         character(*), intent(in) :: what
         integer, intent(in) :: count
         real(wp), intent(in) :: value
      end subroutine report_work
   end interface

   !> Rounding that an event adds to the derivative of the map, relative to its size.
   real(wp), parameter :: rounding_of_event = 64*epsilon(1.0_wp)

   !> How much more the derivative may change in a direction that Newton's method did not go.
   real(wp), parameter :: all_ways = 4.0_wp

   integer, parameter :: most_rounds = 25
   !> Why nothing more was computed.
   character(*), parameter :: was_stopped = "it was stopped"
   !> Steps of differences are not made smaller than by this factor: less would be rounding.
   real(wp), parameter :: least_difference = 0.02_wp
   !> Beside a grazing, where the map bends, they may be: until second differences are this part of the first.
   real(wp), parameter :: least_bent = 1.0e-3_wp, bent = 1.0e-3_wp
   !> Secants that are so short in the parameter, or whose share of it is so small, say nothing of it; beyond longer ones than this
   !> the column is that of another motion.
   real(wp), parameter :: shortest_secant = 1.0e-10_wp, steepest_secant = 0.005_wp, longest_secant = 1.0e-4_wp
   !> A residual of so little, relative to the state and to how the map grows, is rounding.
   real(wp), parameter :: converged = 1.0e-14_wp, far = 1.0_wp, rounding = 16*epsilon(1.0_wp), most_rounding = 1.0e-10_wp
   !> The parameter's unit is no smaller part of it than this: in smaller ones a fold would be sharper than steps can be.
   real(wp), parameter :: narrowest = 1.0e-2_wp

contains

   pure logical function is_autonomous(self)
      class(problem_t), intent(in) :: self

      is_autonomous = .not. self%map%period > 0.0_wp
   end function is_autonomous

   !> Number of unknowns that are states.
   pure integer function states(self)
      class(problem_t), intent(in) :: self

      states = self%map%n*merge(1, self%periods, self%is_autonomous())
   end function states

   !> Number of equations of the motion, without the row.
   pure integer function order(self)
      class(problem_t), intent(in) :: self

      order = self%states() + merge(1, 0, self%is_autonomous())
   end function order

   !> Scales of u.
   pure function scales(self)
      class(problem_t), intent(in) :: self
      real(wp), allocatable :: scales(:)

      integer :: i

      associate (n => self%map%n)
         scales = [spread(self%displacement, 1, self%map%positions), spread(self%velocity, 1, n - self%map%positions)]
         scales = [[(scales, i=1, self%states()/n)], spread(self%period, 1, self%order() - self%states()), self%range]
      end associate
   end function scales

   !> The free parameter of a motion, in its unit.
   pure real(wp) function value_of(self, orbit) result(value)
      class(problem_t), intent(in) :: self
      type(orbit_t), intent(in) :: orbit

      value = orbit%u(size(orbit%u))*self%range
   end function value_of

   !> Tell of what is done, if anybody listens.
   subroutine tell(self, what, count, value)
      class(problem_t), intent(in) :: self
      character(*), intent(in) :: what
      integer, intent(in) :: count
      real(wp), intent(in) :: value

      if (associated(self%report)) call self%report(what, count, value)
   end subroutine tell

   !> Begin with a state x, whose size gives the scales; `period`, s, counts without excitation. The map is at its parameters.
   subroutine begin(self, x, period, range)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: x(:), period, range

      real(wp), allocatable :: s(:)
      real(wp) :: omega
      type(return_t) :: back

      self%range = max(range, narrowest*abs(self%parameter(self%active)))
      self%period = period
      omega = 2*acos(-1.0_wp)/merge(self%map%period, period, self%map%period > 0.0_wp)
      associate (n => self%map%n)
         self%velocity = norm2([omega*x(:self%map%positions), x(self%map%positions + 1:)])
         ! Of a machine at rest: what the excitation would make of free masses.
         if (.not. self%velocity > 0.0_wp) self%velocity = norm2(abs(self%map%by%system%harmonic))/omega
         self%velocity = max(self%velocity, tiny(1.0_wp)*1.0e30_wp)
         self%displacement = self%velocity/omega
         if (.not. self%is_autonomous()) return
         s = self%scales()
         self%origin = x/s(:n)
         call self%map%go(x, self%step*period, .false., back)
         self%normal = (back%x - x)/s(:n)
         if (norm2(self%normal) > 0.0_wp) self%normal = self%normal/norm2(self%normal)
      end associate
   end subroutine begin

   !> The motions err by the relative tolerance of a method of steps.
   pure subroutine take_steps(self, tolerance)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance

      self%step = max(3.0e-5_wp, min(100*tolerance, 1.0e-3_wp))
      self%accuracy = max(1.0e-7_wp, tolerance)
      self%resolution = max(1.0e-6_wp, 10*tolerance)
   end subroutine take_steps

   !> Make the machine of u that of the period map; `ok` is false if there is none, for the `reason`.
   subroutine go_to(self, u, ok)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: u(:)
      logical, intent(out) :: ok

      type(error_t), allocatable :: error
      real(wp) :: values(size(self%parameter))
      integer :: n

      n = self%map%n
      values = self%parameter
      values(self%active) = u(size(u))*self%range
      call self%map%go_to(values, error)
      ok = .not. allocated(error) .and. self%map%n == n
      if (ok) return
      self%reason = "the number of coordinates that are felt changes"
      if (allocated(error)) self%reason = error%message
      ! Unknowns are those of the machine that the search began with.
      if (self%map%n /= n) call self%map%go_to(self%parameter, error)
   end subroutine go_to

   !> Whether a contact of the machine is a ring.
   logical function has_rings(self)
      class(problem_t), intent(in) :: self

      has_rings = any(is_ring(self%map%by%system%machine%contact))
   end function has_rings

   !> Whether whoever asked for it wants no more.
   logical function is_stopped(self)
      class(problem_t), intent(in) :: self

      is_stopped = .false.
      if (associated(self%map%stop_is_asked)) is_stopped = self%map%stop_is_asked()
   end function is_stopped

   !> Run the motion of u; `ok` is false if there is none, for the `reason`.
   subroutine evaluate(self, u, derivative, orbit, ok)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: u(:)
      logical, intent(in) :: derivative
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      type(return_t) :: back
      real(wp), allocatable :: s(:), x(:)
      real(wp) :: duration
      integer :: m

      s = self%scales()
      m = self%states()
      call self%go_to(u, ok)
      if (.not. ok) return
      ok = .false.
      x = u(:m)*s(:m)
      duration = self%periods*self%map%period
      if (self%is_autonomous()) duration = u(m + 1)*self%period
      if (.not. duration > 0.0_wp) then
         self%reason = "the period vanishes"
         return
      end if
      call self%map%go(x, duration, derivative, back)
      ok = back%outcome%status == status_ok
      if (.not. ok) self%reason = "the motion does not come to the end of the period"
      if (self%is_stopped()) then
         self%reason = was_stopped
         ok = .false.
      end if
      if (.not. ok) return
      orbit%u = u
      orbit%has_columns = .false.
      orbit%phase = self%map%phase
      orbit%duration = duration
      orbit%sequence = back%sequence
      if (derivative) orbit%derivative = back%derivative
      orbit%residual = (back%x - cshift(x, self%map%n))/s(:m)
      if (self%is_autonomous()) orbit%residual = [orbit%residual, dot_product(self%normal, u(:m) - self%origin)]
      orbit%stuck = back%stuck
      orbit%held = back%held
   end subroutine evaluate

   !> Columns of the period, without excitation, and of the parameter, by central differences; of motions without errors with
   !> steps so small that the sequence of contacts stays: across a grazing a difference says nothing of the slope.
   subroutine differentiate(self, orbit, ok)
      class(problem_t), intent(inout) :: self
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      type(orbit_t) :: above, below
      real(wp) :: before, by(size(orbit%u)), least, length, ratio, share
      integer :: i, last, m
      logical :: like(2), straight

      m = self%states()
      last = size(orbit%u)
      if (allocated(orbit%column)) deallocate (orbit%column)
      allocate (orbit%column(self%order(), last - m))
      do i = m + 1, last
         by = 0.0_wp
         length = self%step*merge(1.0_wp, max(1.0_wp, abs(orbit%u(i))), self%resolution > 0.0_wp)
         least = least_difference*length
         before = huge(1.0_wp)
         do
            by(i) = length
            call self%evaluate(orbit%u + by, .false., above, ok)
            if (ok) call self%evaluate(orbit%u - by, .false., below, ok)
            share = 0.1_wp
            straight = ok .and. self%resolution > 0.0_wp
            like = ok
            if (ok) like = [above%sequence%is_like(orbit%sequence), below%sequence%is_like(orbit%sequence)]
            if (ok .and. .not. straight) then
               ratio = norm2(above%residual + below%residual - 2*orbit%residual)
               associate (difference => norm2(above%residual - below%residual))
                  straight = ratio <= bent*difference
                  if (all(like)) ratio = ratio/max(difference, sqrt(tiny(1.0_wp)))
                  if (all(like)) share = min(0.3_wp, max(1.0e-2_wp, 0.5_wp*bent/max(ratio, epsilon(ratio))))
               end associate
               ! What does not fall is rounding.
               straight = straight .or. all(like) .and. ratio > before
               if (all(like)) before = ratio
            end if
            if (straight .and. (all(like) .or. length <= least)) exit
            if (length <= merge(least_bent*least, least, ok)) exit
            length = length*share
         end do
         if (.not. ok) return
         ! At a touch one side alone has the motion's neighbours.
         if (.not. straight .and. (like(1) .neqv. like(2))) then
            if (like(1)) below%residual = 2*orbit%residual - above%residual
            if (like(2)) above%residual = 2*orbit%residual - below%residual
         end if
         orbit%column(:, i - m) = (above%residual - below%residual)/(2*length)
      end do
      orbit%has_columns = .true.
   end subroutine differentiate

   !> All that is asked of a motion that was found: its columns and multipliers.
   subroutine complete(self, orbit, ok)
      class(problem_t), intent(inout) :: self
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      ok = orbit%has_columns
      if (.not. ok) call self%differentiate(orbit, ok)
      if (ok) call orbit%find_multipliers(self)
   end subroutine complete

   !> Jacobian matrix of the equations of the motion (order, order + 1).
   function jacobian(self, orbit) result(matrix)
      class(problem_t), intent(in) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), allocatable :: matrix(:, :)

      real(wp), allocatable :: s(:)
      integer :: i, m, next

      s = self%scales()
      m = self%states()
      allocate (matrix(self%order(), self%order() + 1), source=0.0_wp)
      associate (n => self%map%n)
         do i = 1, m, n
            matrix(i:i + n - 1, i:i + n - 1) = scaled(orbit%derivative(:, :, 1 + i/n), s)
         end do
         matrix(m - n + 1:m, :n) = matrix(m - n + 1:m, :n) - matmul(orbit%held, transpose(orbit%held))
         do i = 1, m
            next = 1 + modulo(i - 1 + n, m)
            matrix(i, next) = matrix(i, next) - 1.0_wp
         end do
      end associate
      if (self%is_autonomous()) matrix(m + 1, :m) = self%normal
      matrix(:, m + 1:) = orbit%column
   end function jacobian

   !> Newton's method from `guess` in the plane row·(u - guess) = 0; `orbit` comes with the columns of a motion nearby, if it
   !> has any.
   subroutine correct(self, guess, row, orbit, ok)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: guess(:), row(:)
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: ok

      type(orbit_t) :: earlier
      real(wp), allocatable :: change(:), matrix(:, :)
      real(wp) :: before, growth, miss, nearly, unit
      integer :: m, round
      logical :: fresh, held, rounded, secant, slow, was_fresh

      before = far/epsilon(1.0_wp)
      secant = .false.
      slow = .false.
      was_fresh = .false.
      nearly = self%accuracy*max(1.0_wp, norm2(guess(:self%order())))
      orbit%u = guess
      orbit%rounds = 1
      m = self%states()
      ! Where the parameter is held its column bears on nothing.
      held = .not. (self%is_autonomous() .or. any(abs(row(:m)) > 0.0_wp))
      if (held) orbit%column = spread([0.0_wp], 1, m)
      do round = 1, most_rounds
         ! What goes on below the errors of a method says nothing of the step.
         if (before > nearly .or. .not. self%resolution > 0.0_wp) orbit%rounds = round
         call self%evaluate(orbit%u, .true., orbit, ok)
         if (.not. ok) return
         ! One direction may not show how the derivative changes: those before count, less and less.
         if (round > 1) then
            orbit%bend = max(0.8_wp*orbit%bend, norm2(scaled(orbit%monodromy() - earlier%monodromy(), self%scales()))/before)
            call self%take_secant(earlier, orbit, secant)
         end if
         ! Columns of another place make convergence linear.
         fresh = .not. held .and. (.not. allocated(orbit%column) .or. slow .or. &
                                   modulo(round, 4) == 2 .and. before > nearly .and. .not. secant)
         if (fresh) call self%differentiate(orbit, ok)
         if (.not. ok) return
         earlier = orbit
         fresh = fresh .or. secant .or. held
         matrix = bordered(self%jacobian(orbit), row)
         growth = norm2(matrix(:m, :m))
         change = -[orbit%residual, dot_product(row, orbit%u - guess)]
         associate (n => self%map%n, held => orbit%held)
            change(m - n + 1:m) = change(m - n + 1:m) + matmul(held, matmul(orbit%u(:n) - guess(:n), held))
         end associate
         miss = norm2(change(:self%order()))
         call solve_square(matrix, change, ok)
         ok = ok .and. all(abs(change) <= huge(1.0_wp))
         orbit%correction = norm2(change)
         ! At a branch point corrections are rounding over what is hardly more.
         unit = max(1.0_wp, norm2(orbit%u(:self%order())))
         rounded = miss <= rounding*(1.0_wp + growth)*unit
         ! So is what no change of the derivative explains after a step with columns of its place, as beside many stiff events.
         rounded = rounded .or. all([fresh, was_fresh]) .and. miss <= most_rounding*unit .and. miss > orbit%bend*before**2
         ! What columns of another place say is small may be far, too.
         if (ok) ok = orbit%correction <= merge(far, min(far, max(10*before, nearly)), rounded .or. miss <= most_rounding*unit &
                                                .or. fresh .and. .not. was_fresh)
         if (.not. ok) exit
         ! A column of another place, steep beside a grazing, makes corrections small where nothing is solved.
         if (orbit%correction <= converged*unit .and. (fresh .or. miss <= nearly)) then
            orbit%u = orbit%u + change
            exit
         end if
         ! With columns of this place, corrections that hardly shrink are rounding, or the errors of the method.
         if ((orbit%correction <= nearly .or. rounded) .and. orbit%correction > 0.25_wp*before .and. &
             (fresh .or. self%resolution > 0.0_wp)) exit
         was_fresh = fresh
         slow = orbit%correction > 0.1_wp*before .and. .not. self%resolution > 0.0_wp
         orbit%u = orbit%u + change
         before = orbit%correction
      end do
      ! Where P jumps, the column of the parameter is steep, and corrections are small also far from a motion.
      ok = ok .and. (rounded .or. orbit%correction <= nearly .and. miss <= nearly*(1.0_wp + growth))
      if (.not. ok) self%reason = "Newton's method does not converge"
   end subroutine correct

   !> The column of the parameter from how the equations change between two motions with the same contacts, as their derivatives by
   !> the states are known; not `taken` where Newton's method does not converge, or they hardly differ in the parameter. It has the
   !> column of this motion if the other is near.
   subroutine take_secant(self, earlier, orbit, taken)
      class(problem_t), intent(in) :: self
      type(orbit_t), intent(in) :: earlier
      type(orbit_t), intent(inout) :: orbit
      logical, intent(out) :: taken

      real(wp), allocatable :: mean(:, :)
      logical :: alike

      associate (m => self%states(), step => orbit%u - earlier%u)
         alike = orbit%sequence%is_like(earlier%sequence)
         taken = alike .and. .not. (self%is_autonomous() .or. self%resolution > 0.0_wp)
         if (taken) taken = norm2(orbit%residual) < 0.1_wp*norm2(earlier%residual)
         if (taken) taken = abs(step(m + 1)) > max(shortest_secant, steepest_secant*norm2(step))
         if (taken) then
            mean = 0.5_wp*(self%jacobian(orbit) + self%jacobian(earlier))
            orbit%column(:, 1) = (orbit%residual - earlier%residual - matmul(mean(:, :m), step(:m)))/step(m + 1)
         end if
         orbit%has_columns = alike .and. (taken .or. earlier%has_columns) .and. norm2(step) < longest_secant
      end associate
   end subroutine take_secant

   !> A derivative by the state, in scaled unknowns.
   pure function scaled(derivative, s) result(matrix)
      real(wp), intent(in) :: derivative(:, :), s(:)
      real(wp) :: matrix(size(derivative, 1), size(derivative, 1))

      associate (n => size(derivative, 1))
         matrix = derivative*spread(s(:n), 1, n)/spread(s(:n), 2, n)
      end associate
   end function scaled

   !> A matrix with one row more.
   pure function bordered(matrix, row) result(square)
      real(wp), intent(in) :: matrix(:, :), row(:)
      real(wp) :: square(size(row), size(row))

      square(:size(row) - 1, :) = matrix
      square(size(row), :) = row
   end function bordered

   !> Solve A x = b in place.
   subroutine solve_square(matrix, b, ok)
      real(wp), intent(inout) :: matrix(:, :), b(:)
      logical, intent(out) :: ok

      integer :: info, pivot(size(b))
      real(wp) :: right(size(b), 1)

      right(:, 1) = b
      call dgetrf(size(b), size(b), matrix, size(b), pivot, info)
      ok = info == 0
      if (ok) call dgetrs("N", size(b), 1, matrix, size(b), pivot, right, size(b), info)
      b = right(:, 1)
   end subroutine solve_square

   !> Determinant of a matrix, which is overwritten.
   real(wp) function determinant(matrix)
      real(wp), intent(inout) :: matrix(:, :)

      integer :: i, info, pivot(size(matrix, 1))

      call dgetrf(size(pivot), size(pivot), matrix, size(pivot), pivot, info)
      determinant = 1.0_wp
      do i = 1, size(pivot)
         determinant = determinant*merge(matrix(i, i), -matrix(i, i), pivot(i) == i)
      end do
   end function determinant

   !> ∂P/∂x over all parts, without scales (n, n).
   pure function monodromy(self) result(matrix)
      class(orbit_t), intent(in) :: self
      real(wp), allocatable :: matrix(:, :)

      integer :: i

      matrix = self%derivative(:, :, 1)
      do i = 2, size(self%derivative, 3)
         matrix = matmul(self%derivative(:, :, i), matrix)
      end do
   end function monodromy

   !> Floquet multipliers of a motion that was found; without excitation but for the one along the motion, the nearest to 1. The
   !> derivative errs by rounding, and by how it changes with the motion, which errs by its last correction and rounding too: much
   !> beside a grazing. An error of the derivative moves each by itself over the cosine between its left and right eigenvectors, and
   !> where these are at right angles by its square root.
   subroutine find_multipliers(self, problem)
      class(orbit_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem

      complex(wp), dimension(problem%map%n, problem%map%n) :: left, right
      complex(wp) :: values(problem%map%n)
      real(wp), allocatable :: matrix(:, :), s(:)
      real(wp) :: error, length
      integer :: i, info, k

      associate (n => problem%map%n)
         s = problem%scales()
         matrix = scaled(self%monodromy(), s)
         length = norm2(matrix)
         error = (1 + self%sequence%count)*rounding_of_event + self%correction
         error = length*max(problem%resolution, error) + all_ways*self%bend*error
         call right_eigen(matrix, values, info, right, left)
         if (info /= 0) values = cmplx(huge(1.0_wp), 0.0_wp, wp)
         self%multiplier = values
         self%doubt = [(error, k=1, n)]
         if (info == 0) self%doubt = min(error/max(abs(sum(conjg(left)*right, dim=1)), tiny(1.0_wp)), &
                                         error + sqrt(error*length))
         do i = 1, merge(size(self%held, 2), 0, info == 0)
            k = minloc(abs(self%multiplier - 1.0_wp), 1, self%doubt > 0.0_wp)
            self%multiplier(k) = 1.0_wp
            self%doubt(k) = 0.0_wp
         end do
         if (.not. problem%is_autonomous()) return
         k = minloc(abs(values - 1.0_wp), dim=1)
         self%multiplier = [values(:k - 1), values(k + 1:)]
         self%doubt = [self%doubt(:k - 1), self%doubt(k + 1:)]
      end associate
   end subroutine find_multipliers

   !> Unknowns with what is held where this motion has it.
   pure function keep_held(self, u) result(kept)
      class(orbit_t), intent(in) :: self
      real(wp), intent(in) :: u(:)
      real(wp) :: kept(size(u))

      integer :: i

      kept = u
      associate (n => size(self%held, 1))
         do i = 1, n*size(self%derivative, 3), n
            associate (there => u(i:i + n - 1) - self%u(i:i + n - 1))
               kept(i:i + n - 1) = u(i:i + n - 1) - matmul(self%held, matmul(there, self%held))
            end associate
         end do
      end associate
   end function keep_held

   !> Whether the motion is stable, as far as that can be told.
   pure integer function stability(self)
      class(orbit_t), intent(in) :: self

      stability = is_undecided
      if (self%outside(most=.true.) == 0) stability = is_stable
      if (self%outside() > 0) stability = is_unstable
   end function stability

   !> How many multipliers are outside the unit circle for certain, or at most; those of what is held are 1
   !> without a doubt.
   pure integer function outside(self, most)
      class(orbit_t), intent(in) :: self
      logical, intent(in), optional :: most

      outside = merge(count(abs(self%multiplier) + self%doubt >= 1.0_wp .and. self%doubt > 0.0_wp), &
                      count(abs(self%multiplier) - self%doubt > 1.0_wp), present(most))
   end function outside

end module razy_orbits_orbit
