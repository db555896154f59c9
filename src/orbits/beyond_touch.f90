!! The other branch at the first touch of a stop: motions that hit it softly where a branch without the impact ends, or these.
!!
!! An impact with the speed v that the gap h has lost by the time at which it turns adds v m to what the map P without it gives, to
!! first order, where m is its impulse carried to the end of the period. Motions that hit the stop leave the touch so that
!!
!!     (∂P/∂x - 1) dx + ∂P/∂p dp + m dv = 0,    ∂h/∂x dx + ∂h/∂p dp = 0,    dv > 0:
!!
!! along v they are smooth, though over p they have a square root (A. B. Nordmark, J. Sound Vib. 145 (1991) 279-297).
module razy_orbits_beyond_touch
   use razy_core_kinds, only: wp
   use razy_orbits_identity, only: least_part, part_way, parts
   use razy_orbits_orbit, only: bordered, orbit_t, problem_t, solve_square
   use razy_orbits_point, only: complete_point_at, point_t
   use razy_orbits_touch, only: gap_at, near_touch
   implicit none(type, external)
   private

   public :: switch_at_touch

   !> Distances from the touch, in scaled unknowns, at which a motion of the other branch is looked for, one after the other; it is
   !> no farther off than this times the distance.
   real(wp), parameter :: distances(*) = [1.0e-3_wp, 3.0e-4_wp, 3.0e-3_wp, 1.0e-4_wp, 1.0e-2_wp], nearest = 2.0_wp
   !> How far from the touch, in scaled unknowns, the gap and the impulse are looked at, and how far apart.
   real(wp), parameter :: aside = 1.0e-4_wp, apart = 1.0e-6_wp

contains

   !> A motion of the other branch at a touch, GR, that ends a branch, with its derivatives; `guide`: where that branch goes;
   !> `away`: how far off it is.
   subroutine switch_at_touch(problem, point, orbit, guide, away, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: guide(:)
      real(wp), intent(out) :: away
      logical, intent(out) :: ok

      type(point_t) :: without
      real(wp), allocatable :: guess(:), way(:)
      real(wp) :: deep, impulse, slope
      integer :: i
      logical :: hits

      problem%map%phase = point%orbit%phase
      call near_touch(problem, point%orbit%u, point%orbit, without%orbit, hits, ok)
      away = 0.0_wp
      if (ok) away = norm2(point%orbit%u - without%orbit%u)
      ok = ok .and. away > 0.0_wp
      if (ok) call complete_point_at(problem, without, without%orbit%u - point%orbit%u, ok)
      if (.not. ok) return
      if (hits) then
         ! Motions of a part of the period are those of a branch of their own.
         do i = 1, size(parts)
            call part_way(problem, without%orbit, parts(i), way)
            if (size(way) > 0) ok = ok .and. norm2(way) > least_part*away
         end do
         orbit = without%orbit
         guide = without%tangent
         return
      end if
      call find_direction(problem, point, without, guide, impulse, slope, ok)
      if (.not. ok) return
      do i = 1, size(distances)
         away = distances(i)
         if (allocated(orbit%column)) deallocate (orbit%column)
         ! From where the gap just closes, as deep as an impact of this impulse is.
         guess = point%orbit%u + away*(guide + without%tangent)
         deep = gap_at(problem, guess, point%contact)/slope + aside*(away*impulse)**2
         if (deep > 2*away) cycle
         call problem%correct(guess - deep*without%tangent, guide, orbit, ok)
         if (ok) ok = norm2(orbit%u - point%orbit%u) < nearest*away &
                      .and. .not. orbit%sequence%is_like(without%orbit%sequence)
         if (ok) call problem%complete(orbit, ok)
         if (.not. ok) cycle
         guide = (orbit%u - point%orbit%u)/norm2(orbit%u - point%orbit%u)
         return
      end do
   end subroutine switch_at_touch

   !> The unit vector along motions that hit the stop, and the impulse on the way, in that of an impact as deep as the tangent of
   !> motions `without` the impact, which points away from the touch, comes in `aside`; `slope` of the gap along that tangent.
   subroutine find_direction(problem, point, without, direction, impulse, slope, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point, without
      real(wp), allocatable, intent(out) :: direction(:)
      real(wp), intent(out) :: impulse, slope
      logical, intent(out) :: ok

      type(orbit_t) :: beyond
      real(wp), allocatable :: matrix(:, :)
      real(wp) :: gap, row(size(point%orbit%u))
      integer :: side

      associate (u => point%orbit%u, t => without%tangent)
         call problem%evaluate(u - aside*t, .false., beyond, ok)
         if (ok) ok = .not. beyond%sequence%is_like(without%orbit%sequence)
         impulse = 0.0_wp
         slope = 0.0_wp
         if (.not. ok) return
         row = 0.0_wp
         row(size(row)) = 1.0_wp
         direction = -[beyond%residual, 0.0_wp]
         matrix = bordered(problem%jacobian(without%orbit), row)
         call solve_square(matrix, direction, ok)
         if (.not. ok) return
         impulse = 1.0_wp/norm2(direction)
         direction = direction*impulse
         gap = gap_at(problem, u + aside*t, point%contact)
         slope = gap/aside
         do side = -1, 1, 2
            associate (change => side*(gap_at(problem, u + aside*t + side*apart*direction, point%contact) - gap))
               ok = abs(change) < abs(gap) .and. slope > 0.0_wp
               if (ok) direction = direction - change/(apart*slope)*t
            end associate
            if (ok) exit
         end do
         impulse = impulse/norm2(direction)
         direction = direction/norm2(direction)
      end associate
   end subroutine find_direction

end module razy_orbits_beyond_touch
