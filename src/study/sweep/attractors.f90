!! Which motions end on the same attractor: stroboscopic states compared with each other.
!!
!! A motion is known by its states x_0 … x_m, one period T of the excitation apart, the last at its end. Distances are those of
!! the norm |x|² = v'Mv + (2π/T)² q'Mq, twice a kinetic energy; two states are equal if they differ by no more than `tolerance`
!! times `scale`, a norm that the caller takes from all motions that are compared. Of q the part along the drifts of the machine
!! (razy_machine_drift) is left out: a motion that goes on elsewhere is the same.
!!
!! The motion has the period p T, the smallest p ≤ m/2 for which each of the last p states equals the one p before; it has settled
!! if they do so within `tolerance` times `settled`. The two bounds differ because a transient that shrinks by a factor ρ in p T,
!! and moves the state by d in that time, has d/(1 - ρ) still to go; and because a transient that turns may come back by chance to
!! where it was some periods ago. Two settled motions are on the same attractor if their p agree and the last p states of the one
!! equal those of the other but for a shift by some number of periods T. Motions without a period, and those that have not
!! settled, are not told apart: they have the number 0.
module razy_study_sweep_attractors
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: attractor_t, attractors_t, state_norm

   !> Part of the tolerance within which a settled motion repeats itself.
   real(wp), parameter :: settled = 1.0e-2_wp

   !> A periodic attractor.
   type :: attractor_t
      !> Period in periods of the excitation.
      integer :: period = 0
      !> States over one period, displacement above velocity (2 n, period).
      real(wp), allocatable :: states(:, :)
   end type attractor_t

   !> The attractors of one machine, found one by one.
   type :: attractors_t
      !> M (n, n), basis of the drifts D (n, r), 2π/T, rad/s.
      real(wp), allocatable :: mass(:, :), drifts(:, :)
      real(wp) :: omega = 0.0_wp
      real(wp) :: tolerance = 0.0_wp, scale = 0.0_wp
      type(attractor_t), allocatable :: found(:)
   contains
      procedure :: begin
      procedure :: number_of
      procedure, private :: equal
      procedure, private :: period_of
      procedure, private :: matches
   end type attractors_t

contains

   !> Nothing is found yet.
   subroutine begin(self, mass, drifts, period, tolerance, scale)
      class(attractors_t), intent(out) :: self
      !> M (n, n); D (n, r), DᵀM D = I; T, s.
      real(wp), intent(in) :: mass(:, :), drifts(:, :), period, tolerance, scale

      self%mass = mass
      self%drifts = drifts
      self%omega = 2*acos(-1.0_wp)/period
      self%tolerance = tolerance
      self%scale = scale
      allocate (self%found(0))
   end subroutine begin

   !> Number of the attractor on which states (2 n, m + 1) end, from 1 in the order in which they were met; 0: not periodic.
   subroutine number_of(self, states, number)
      class(attractors_t), intent(inout) :: self
      real(wp), intent(in) :: states(:, :)
      integer, intent(out) :: number

      integer :: m, p

      number = 0
      p = self%period_of(states)
      if (p == 0) return
      m = size(states, 2)
      do number = 1, size(self%found)
         if (self%matches(self%found(number), states(:, m - p + 1:))) return
      end do
      self%found = [self%found, attractor_t(p, states(:, m - p + 1:))]
   end subroutine number_of

   !> Period of a motion in periods of the excitation; 0: none, or not settled.
   pure integer function period_of(self, states) result(period)
      class(attractors_t), intent(in) :: self
      real(wp), intent(in) :: states(:, :)

      integer :: k, m

      m = size(states, 2)
      periods: do period = 1, (m - 1)/2
         do k = m - period + 1, m
            if (.not. self%equal(states(:, k), states(:, k - period), 1.0_wp)) cycle periods
         end do
         do k = m - period + 1, m
            if (.not. self%equal(states(:, k), states(:, k - period), settled)) exit periods
         end do
         return
      end do periods
      period = 0
   end function period_of

   !> Whether states (2 n, p) are those of an attractor but for a shift.
   pure logical function matches(self, attractor, states)
      class(attractors_t), intent(in) :: self
      type(attractor_t), intent(in) :: attractor
      real(wp), intent(in) :: states(:, :)

      integer :: k, p, shift

      p = size(states, 2)
      matches = .false.
      if (p /= attractor%period) return
      shifts: do shift = 0, p - 1
         do k = 1, p
            if (.not. self%equal(states(:, k), attractor%states(:, 1 + modulo(k - 1 + shift, p)), 1.0_wp)) cycle shifts
         end do
         matches = .true.
         return
      end do shifts
   end function matches

   pure logical function equal(self, a, b, part)
      class(attractors_t), intent(in) :: self
      real(wp), intent(in) :: a(:), b(:), part

      equal = state_norm(self%mass, self%omega, self%drifts, a - b) <= part*self%tolerance*self%scale
   end function equal

   !> Norm of a state (2 n), displacement above velocity, without the part of the displacement along `drifts` D, DᵀM D = I.
   pure real(wp) function state_norm(mass, omega, drifts, state) result(norm)
      real(wp), intent(in) :: mass(:, :), omega, drifts(:, :), state(:)

      real(wp) :: q(size(mass, 1))
      integer :: n

      n = size(mass, 1)
      q = state(:n) - matmul(drifts, matmul(matmul(mass, state(:n)), drifts))
      norm = dot_product(state(n + 1:), matmul(mass, state(n + 1:))) + omega**2*dot_product(q, matmul(mass, q))
      norm = sqrt(max(norm, 0.0_wp))
   end function state_norm

end module razy_study_sweep_attractors
