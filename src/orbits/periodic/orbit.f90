!! A periodic motion, as Newton's method finds it, with its derivatives and Floquet multipliers.
module razy_orbits_periodic_orbit
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_stable, is_undecided, is_unstable
   use razy_observe_event_log, only: event_log_t
   implicit none(type, external)
   private

   public :: orbit_t, plane_t, scaled

   !> Where motions without excitation begin: as an unknown, a velocity, has a value.
   type :: plane_t
      integer :: velocity = 1
      real(wp) :: value = 0.0_wp
   end type plane_t

   !> A motion: u, what comes of it, and its derivatives.
   type :: orbit_t
      real(wp), allocatable :: u(:), residual(:)
      !> ∂P/∂x of each part without scales (n, n, parts), columns of the period and the parameter (order, 1 or 2), scaled.
      real(wp), allocatable :: derivative(:, :, :), column(:, :)
      !> Whether the columns are those of this motion, not of one nearby.
      logical :: has_columns = .false.
      !> What the frictions that stick all the time hold, in scaled unknowns: an orthonormal basis of displacements (n, held). There
      !> is a motion for each of its places, so that each motion is looked for where the guess has it. These frictions' numbers.
      real(wp), allocatable :: held(:, :)
      integer, allocatable :: stuck(:)
      !> Floquet multipliers (n; without excitation n - 1), and how far off they may be (the same number).
      complex(wp), allocatable :: multiplier(:)
      real(wp), allocatable :: doubt(:)
      type(event_log_t) :: sequence
      !> Phase at which it begins, in periods of the excitation, or the plane; how long it takes, s.
      real(wp) :: phase = 0.0_wp, duration = 0.0_wp
      type(plane_t) :: plane
      !> Length of the last correction, and how much the scaled derivative changes with u, over a unit length.
      real(wp) :: correction = huge(1.0_wp), bend = 0.0_wp
      integer :: rounds = 0
   contains
      procedure :: monodromy
      procedure :: keep_held
      procedure :: stability
      procedure :: outside
   end type orbit_t

contains

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

   !> A derivative by the state, in scaled unknowns.
   pure function scaled(derivative, s) result(matrix)
      real(wp), intent(in) :: derivative(:, :), s(:)
      real(wp) :: matrix(size(derivative, 1), size(derivative, 1))

      associate (n => size(derivative, 1))
         matrix = derivative*spread(s(:n), 1, n)/spread(s(:n), 2, n)
      end associate
   end function scaled

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

end module razy_orbits_periodic_orbit
