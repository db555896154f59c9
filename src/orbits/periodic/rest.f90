!! The rest that motions without excitation grow from or shrink to: a Hopf point, where a pair of eigenvalues crosses the imaginary
!! axis (J. E. Marsden, M. McCracken, The Hopf Bifurcation and Its Applications, Springer (1976)).
module razy_orbits_periodic_rest
   use razy_core_kinds, only: wp
   use razy_linalg_square, only: solve_square
   use razy_orbits_periodic_multipliers, only: find_multipliers
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_orbit, only: orbit_t, scaled
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_section, only: find_first_change
   implicit none(type, external)
   private

   public :: find_rate, find_rest, find_way_to_rest

   !> A motion whose size falls to less than this in a step is as good as at rest.
   real(wp), parameter :: nearly_none = 1.0e-2_wp
   integer, parameter :: most_rounds = 20, sizes = 6, doublings = 8

contains

   !> Whether between two motions of a branch without excitation there is none left, as the velocity by which they begin changes in
   !> the one as it falls, in the other as it rises; `way` from the first to where that is.
   subroutine find_way_to_rest(problem, a, b, way, shrinks)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: a, b
      real(wp), allocatable, intent(out) :: way(:)
      logical, intent(out) :: shrinks

      real(wp) :: rates(2)

      shrinks = problem%is_autonomous()
      if (.not. shrinks) return
      call find_rate(problem, a, rates(1), shrinks)
      if (shrinks) call find_rate(problem, b, rates(2), shrinks)
      if (.not. shrinks) return
      shrinks = rates(2)*sign(1.0_wp, rates(1)) < nearly_none*abs(rates(1))
      if (shrinks) way = rates(1)/(rates(1) - rates(2))*(b%u - a%u)
   end subroutine find_way_to_rest

   !> How fast the velocity by which a motion begins changes there; not `ok`: the motion does not come that far.
   subroutine find_rate(problem, orbit, rate, ok)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(out) :: rate
      logical, intent(out) :: ok

      real(wp), allocatable :: change(:)

      call find_first_change(problem, orbit%u, change, ok)
      rate = change(problem%plane%velocity)
   end subroutine find_rate

   !> The rest to which there is such a way from motion `a`: parameter and period, which do not change at first with the size of the
   !> motion, the rate, lead on from motions of `a`'s size, of smaller ones, to none at all.
   subroutine find_rest(problem, a, way, at, ok)
      type(problem_t), intent(inout) :: problem
      type(orbit_t), intent(in) :: a
      real(wp), intent(in) :: way(:)
      type(orbit_t), intent(inout) :: at
      logical, intent(out) :: ok

      type(orbit_t) :: smaller
      real(wp) :: ends(sizes, 2), less(2), size_of(sizes)
      real(wp), allocatable :: rest(:)
      integer :: i, last

      last = size(a%u)
      do i = 1, sizes
         ! The column of the period goes with the size of the motion.
         if (allocated(smaller%column)) deallocate (smaller%column)
         call correct(problem, a%u + (i - 1)*way/sizes, way/norm2(way), smaller, ok)
         if (ok) ok = smaller%sequence%count == a%sequence%count
         if (ok) call find_rate(problem, smaller, size_of(i), ok)
         if (.not. ok) return
         ends(i, :) = smaller%u(last - 1:)
      end do
      rest = [a%u(:last - 2) + way(:last - 2), at_none(size_of/size_of(1), ends)]
      less = at_none(size_of(2:)/size_of(1), ends(2:, :))
      call come_to_rest(problem, rest, ok)
      ! Where nothing moves a method takes steps in which disturbances would err: the period is made of short parts.
      if (ok) call problem%evaluate([rest(:last - 2), rest(last - 1)/2**doublings, rest(last)], .true., at, ok)
      if (.not. ok) return
      do i = 1, doublings
         at%derivative(:, :, 1) = matmul(at%derivative(:, :, 1), at%derivative(:, :, 1))
      end do
      at%u = rest
      at%duration = 2**doublings*at%duration
      at%correction = norm2(rest(last - 1:) - less)
      call find_multipliers(problem, at)
      ! What leads on from the motions is a Hopf point by the machine's own eigenvalues, too.
      ok = any(abs(at%multiplier - 1) <= sqrt(problem%accuracy))
   end subroutine find_rest

   !> Where values (n, 2) at these sizes lead to at none: polynomials without a linear term.
   function at_none(sizes, values) result(limit)
      real(wp), intent(in) :: sizes(:), values(:, :)
      real(wp) :: limit(2)

      real(wp) :: matrix(size(sizes), size(sizes)), term(size(sizes))
      integer :: i, k
      logical :: ok

      do i = 1, 2
         matrix(:, 1) = 1.0_wp
         do k = 2, size(sizes)
            matrix(:, k) = sizes**k
         end do
         term = values(:, i) - values(1, i)
         call solve_square(matrix, term, ok)
         limit(i) = values(1, i) + term(1)
      end do
   end function at_none

   !> The rest at the parameter of u, by Newton's method for a third of the period, as multipliers of the whole are 1.
   subroutine come_to_rest(problem, u, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(inout) :: u(:)
      logical, intent(out) :: ok

      type(orbit_t) :: orbit
      real(wp), allocatable :: change(:), matrix(:, :)
      integer :: i, round

      do round = 1, most_rounds
         call problem%evaluate([u(:size(u) - 2), u(size(u) - 1)/3, u(size(u))], .true., orbit, ok)
         if (.not. ok) return
         matrix = scaled(orbit%derivative(:, :, 1), problem%scales())
         do i = 1, size(matrix, 1)
            matrix(i, i) = matrix(i, i) - 1.0_wp
         end do
         change = -orbit%residual(:size(matrix, 1))
         call solve_square(matrix, change, ok)
         if (.not. ok) return
         u(:size(change)) = u(:size(change)) + change
         if (norm2(change) <= problem%accuracy*norm2(u)) return
      end do
      ok = .false.
   end subroutine come_to_rest

end module razy_orbits_periodic_rest
