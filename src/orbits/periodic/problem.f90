!! The equations of a periodic motion, made of the period map.
!!
!! Unknowns u: the states x_i at the beginning of each of the m periods of the excitation in one of the motion, without excitation
!! one state and the period T, and one parameter p, each in units of its scale. Equations:
!!
!!     P(x_i, T, p) - x_(i+1) = 0, x_(m+1) = x_1,    v = c without excitation,    r·u = c:
!!
!! multiple shooting, as what grows in one period after the other would leave no more than its rounding to Newton's method
!! (H. B. Keller, Numerical Methods for Two-Point Boundary-Value Problems, Blaisdell (1968)); v is a velocity that comes to c, 0 if
!! it has both signs, as at rest; and the row r either holds the parameter or is the plane across the tangent of a branch
!! (Keller's pseudo-arclength; E. Doedel, H. B. Keller, J. P. Kernevez, Int. J. Bifurc. Chaos 1 (1991) 493-520).
!! ∂P/∂x comes with the motion; columns of T and p are secants or central differences of it, and bear on convergence alone.
!! P is what the propagator finds: a solution is a motion, with the contacts that it has, and none that another sequence
!! would need.
module razy_orbits_periodic_problem
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: is_ring
   use razy_motion_integrator, only: status_ok
   use razy_orbits_periodic_orbit, only: orbit_t, plane_t, scaled
   use razy_orbits_periodic_period_map, only: period_map_t, return_t
   implicit none(type, external)
   private

   public :: problem_t, report_work, was_stopped

   !> What is looked for: motions of `periods` periods of the excitation, with parameter number `active` of `parameter` free.
   type :: problem_t
      type(period_map_t) :: map
      integer :: periods = 1, active = 1
      real(wp), allocatable :: parameter(:)
      !> Step of the differences by period and parameter, in units of their scales: larger for a method of larger errors.
      real(wp) :: step = 1.0e-7_wp
      !> Correction with which Newton's method may end, its square less than rounding, so that no motion is found beyond a fold; and
      !> distance at which what lies beside a change of contacts is told apart from it, relative to the state.
      real(wp) :: accuracy = 1.0e-11_wp
      real(wp) :: resolution = 0.0_wp
      !> Scales of displacements, velocities and the parameter; period, s, where there is no excitation (also its scale).
      real(wp) :: displacement = 1.0_wp, velocity = 1.0_wp, range = 1.0_wp, period = 0.0_wp
      !> Where a motion without excitation begins.
      type(plane_t) :: plane
      !> Why the last evaluation failed.
      character(:), allocatable :: reason
      !> Told of what takes long, if it is associated.
      procedure(report_work), pointer, nopass :: report => null()
   contains
      procedure :: begin
      procedure :: begin_as
      procedure :: take_steps
      procedure :: is_autonomous
      procedure :: phase_after
      procedure :: multipliers
      procedure :: states
      procedure :: order
      procedure :: scales
      procedure :: value_of
      procedure :: tell
      procedure :: go_to
      procedure :: evaluate
      procedure :: has_rings
      procedure :: is_stopped
      procedure :: jacobian
   end type problem_t

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

   !> Why nothing more was computed.
   character(*), parameter :: was_stopped = "it was stopped"
   !> The parameter's unit is no smaller part of it than this: in smaller ones a fold would be sharper than steps can be.
   real(wp), parameter :: narrowest = 1.0e-2_wp

contains

   pure logical function is_autonomous(self)
      class(problem_t), intent(in) :: self

      is_autonomous = .not. self%map%period > 0.0_wp
   end function is_autonomous

   !> The phase so many periods after another; none without excitation.
   pure real(wp) function phase_after(self, phase, later)
      class(problem_t), intent(in) :: self
      real(wp), intent(in) :: phase, later

      phase_after = merge(0.0_wp, modulo(phase + later, 1.0_wp), self%is_autonomous())
   end function phase_after

   !> Number of multipliers: without excitation there is none of the direction along the motion.
   pure integer function multipliers(self)
      class(problem_t), intent(in) :: self

      multipliers = self%map%n - merge(1, 0, self%is_autonomous())
   end function multipliers

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

      real(wp) :: omega
      logical :: ok

      self%range = max(range, narrowest*abs(self%parameter(self%active)))
      self%period = period
      omega = 2*acos(-1.0_wp)/merge(self%map%period, period, self%map%period > 0.0_wp)
      associate (n => self%map%n)
         self%velocity = norm2([omega*x(:self%map%positions), x(self%map%positions + 1:)])
         ! Of a machine at rest: what the excitation would make of free masses.
         if (.not. self%velocity > 0.0_wp) self%velocity = norm2(abs(self%map%by%system%harmonic))/omega
         ! That has an amplitude of 0 where the range begins.
         if (.not. self%velocity > 0.0_wp) then
            call self%go_to([self%parameter(self%active)/self%range + 1.0_wp], ok)
            if (ok) self%velocity = norm2(abs(self%map%by%system%harmonic))/omega
            call self%go_to([self%parameter(self%active)/self%range], ok)
         end if
         self%velocity = max(self%velocity, tiny(1.0_wp)*1.0e30_wp)
         self%displacement = self%velocity/omega
      end associate
      self%plane = plane_t()
   end subroutine begin

   !> Motions begin where this one does.
   pure subroutine begin_as(self, orbit)
      class(problem_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit

      self%map%phase = orbit%phase
      self%plane = orbit%plane
   end subroutine begin_as

   !> The motions err by the relative tolerance of a method of steps.
   pure subroutine take_steps(self, tolerance)
      class(problem_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance

      self%step = min(sqrt(tolerance), 1.0e-3_wp)
      self%accuracy = max(tolerance, min(1.0e4_wp*tolerance, 1.0e-7_wp))
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
      ! What sticks has no speed: by one of rounding it would begin to slide.
      x = merge(u(:m), 0.0_wp, abs(u(:m)) > epsilon(u))*s(:m)
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
      orbit%plane = self%plane
      if (self%is_autonomous()) orbit%residual = [orbit%residual, u(self%plane%velocity) - self%plane%value]
      orbit%stuck = back%stuck
      orbit%held = back%held
   end subroutine evaluate

   !> Jacobian matrix of the equations of the motion (order, order + 1).
   function jacobian(self, orbit) result(matrix)
      class(problem_t), intent(in) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), allocatable :: matrix(:, :)

      integer :: i, m, next

      m = self%states()
      allocate (matrix(self%order(), self%order() + 1), source=0.0_wp)
      associate (n => self%map%n)
         do i = 1, m, n
            matrix(i:i + n - 1, i:i + n - 1) = scaled(orbit%derivative(:, :, 1 + i/n), self%scales())
         end do
         do i = 1, m
            next = 1 + modulo(i - 1 + n, m)
            matrix(i, next) = matrix(i, next) - 1.0_wp
         end do
      end associate
      if (self%is_autonomous()) matrix(m + 1, self%plane%velocity) = 1.0_wp
      matrix(:, m + 1:) = orbit%column
      ! What sticks is where it was, whatever else: derivatives have rounding there.
      associate (n => self%map%n, last => matrix(m - self%map%n + 1:m, :), held => orbit%held)
         last = last - matmul(held, matmul(transpose(held), last))
         last(:, :n) = last(:, :n) - matmul(held, transpose(held))
      end associate
   end function jacobian

end module razy_orbits_periodic_problem
