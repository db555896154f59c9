!! The other branch at the first touch of a stop: motions that hit it softly where a branch without the impact ends, or these.
!!
!! An impact with the speed v that the gap h has lost by the time at which it turns adds v m to what the map P without it gives, to
!! first order, where m is its impulse carried to the end of the period. Motions that hit the stop leave the touch so that
!!
!!     (∂P/∂x - 1) dx + ∂P/∂p dp + m dv = 0,    ∂h/∂x dx + ∂h/∂p dp = 0,    dv > 0:
!!
!! along v they are smooth, though over p they have a square root (A. B. Nordmark, J. Sound Vib. 145 (1991) 279-297). Of several
!! stops that are touched at once, as by a symmetric motion between walls, each has its v, m and h: motions may hit them all, or
!! one of them if the others' gaps open on the way.
module razy_orbits_beyond_touch
   use razy_core_kinds, only: wp
   use razy_linalg_square, only: bordered, solve_square
   use razy_orbits_periodic_identity, only: least_part, part_way, parts
   use razy_orbits_periodic_newton, only: complete, correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_section, only: carry, find_quiet
   use razy_orbits_branch_point, only: complete_point_at, point_t
   use razy_orbits_touch, only: gaps_at, near_touch
   implicit none(type, external)
   private

   public :: slope_of_impacts, switch_at_touch

   !> Distances from the touch, relative to the state, at which a motion of the other branch is looked for, one after the other, and
   !> for two stops at once four times as far: the map of several impacts is steeper. It is no farther off than this times the
   !> distance.
   real(wp), parameter :: distances(*) = [5.0e-4_wp, 1.0e-4_wp, 2.5e-3_wp, 2.5e-5_wp], nearest = 2.0_wp
   !> How far from the touch, in scaled unknowns, the gaps are looked at, and the impulse, so near that it is small.
   real(wp), parameter :: apart = 1.0e-5_wp, aside = 1.0e-9_wp
   !> Edges whose gap at the touch is this part of that `apart` are touched at once.
   real(wp), parameter :: at_once = 1.0e-3_wp
   !> So much less than `apart` the unknowns move along what an impact does.
   real(wp), parameter :: beside_by = 1.0e-2_wp

   !> A way from the touch: the unit vector along motions that hit the edges `hit` (hits; numbers as in `gaps_at`), and on it the
   !> impulse of each, in that of an impact as deep as the tangent of motions without the impact comes in `aside`, and how far each
   !> (second index) opens the gap of those later in the period at once; `slope` of the gaps along the tangent.
   !> `vector` (unknowns, hits + 1): what an impact on each moves, and the tangent; `rate` at which these open gaps, and a row of
   !> ones but for the tangent (hits + 1, hits + 1).
   type :: way_t
      integer, allocatable :: hit(:)
      real(wp), allocatable :: along(:), impulse(:), jump(:, :), slope(:), vector(:, :), rate(:, :)
   end type way_t

   !> So often a guess is corrected.
   integer, parameter :: most_passes = 12

contains

   !> A motion of the other branch at a touch, GR, that ends a branch, with its derivatives; `last`: the one before the touch;
   !> `guide`: where that branch goes; `away`: how far off it is. It hits all stops that are touched, where `which` is 0, or that of
   !> this number alone; `more`: whether there may be one of the next number.
   subroutine switch_at_touch(problem, last, point, which, orbit, guide, away, more, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: last, point
      integer, intent(in) :: which
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: guide(:)
      real(wp), intent(out) :: away
      logical, intent(out) :: more, ok

      type(point_t) :: without
      type(way_t) :: way
      real(wp), allocatable :: before(:), touch(:)
      integer :: i

      ! Motions that hit stops on both sides at once have neighbours that hit one beside those that hit none.
      more = which == 0
      touch = point%orbit%u
      call problem%begin_as(point%orbit)
      call near_touch(problem, touch, point%orbit, merge(1, -1, which == 0), without%orbit, ok)
      if (ok) then
         away = norm2(touch - without%orbit%u)
         call complete_point_at(problem, without, without%orbit%u - touch, ok)
         ! Motions of a part of the period are those of a branch of their own.
         do i = 1, size(parts)
            before = part_way(problem, without%orbit, parts(i))
            if (size(before) > 0) ok = ok .and. norm2(before) > least_part*away
         end do
         ! Where the branch comes to the touch without an impact, what lies back along it is the branch.
         ok = ok .and. norm2((without%orbit%u - touch)/away + point%tangent) > least_part
         orbit = without%orbit
         guide = without%tangent
         return
      end if
      without = last
      without%tangent = -last%tangent
      call leave_touch(problem, touch, without, ok)
      if (ok) call find_way(problem, touch, without, which, way, more, ok)
      if (.not. ok) return
      do i = 1, size(distances)
         away = distances(i)*size(way%hit)**2*norm2(touch(:size(touch) - 1))
         if (allocated(orbit%column)) deallocate (orbit%column)
         guide = touch + away*way%along
         call deepen(problem, way, away, guide, ok)
         if (ok) call correct(problem, guide, way%along, orbit, ok)
         if (ok) ok = norm2(orbit%u - touch) < nearest*away &
                      .and. .not. orbit%sequence%is_like(without%orbit%sequence)
         if (ok) call complete(problem, orbit, ok)
         if (.not. ok) cycle
         guide = (orbit%u - touch)/norm2(orbit%u - touch)
         return
      end do
   end subroutine switch_at_touch

   !> How the parameter changes along motions that hit the stop, on their way from the touch, in scaled unknowns: not to first order
   !> at a resonant grazing (0, too, where there is no such way). `beside`: a motion without the impact, with its tangent away from
   !> the touch.
   real(wp) function slope_of_impacts(problem, touch, beside) result(slope)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: touch(:)
      type(point_t), intent(in) :: beside

      real(wp), allocatable :: u(:)
      type(point_t) :: without
      type(way_t) :: way
      logical :: more, ok

      slope = 0.0_wp
      u = touch
      without = beside
      call leave_touch(problem, u, without, ok)
      if (ok) call find_way(problem, u, without, 0, way, more, ok)
      if (ok) slope = way%along(size(u))
   end function slope_of_impacts

   !> Move a guess so far off that each impact is as deep as one of its impulse is; `ok` is false where no gap is near.
   subroutine deepen(problem, way, away, guess, ok)
      type(problem_t), intent(inout) :: problem
      type(way_t), intent(in) :: way
      real(wp), intent(in) :: away
      real(wp), intent(inout) :: guess(:)
      logical, intent(out) :: ok

      real(wp), dimension(size(way%hit)) :: depth, gap, strength
      real(wp), allocatable :: gaps(:)
      real(wp) :: matrix(size(way%hit) + 1, size(way%hit) + 1), share(size(way%hit) + 1)
      integer :: i, k, pass

      depth = aside*way%slope*(away*way%impulse)**2
      strength = 0.0_wp
      do pass = 1, most_passes
         do i = 1, size(depth)
            if (size(depth) == 1) then
               ! The stop may be hit elsewhere, so that it is looked at before it is touched.
               gaps = gaps_at(problem, guess + away*way%vector(:, 2))
            else
               ! First without any impact, then with those on the others.
               call keep_open(problem, pack(way%hit, [(pass == 1 .or. k == i, k=1, size(depth))]))
               gaps = gaps_at(problem, guess, way%hit)
               call keep_open(problem, [integer ::])
            end if
            gap(i) = gaps(way%hit(i))
         end do
         ok = maxval(gap) < huge(1.0_wp)
         if (.not. ok) return
         if (size(depth) == 1) gap = gap - away*way%slope
         ! The speed of an impact goes with the root of its depth; one alone does nothing to others.
         if (pass > 1) strength = sqrt(max(-gap, 0.0_wp)/depth)
         share(:size(depth)) = -gap - depth + away*matmul(way%jump, strength - 1.0_wp)
         share(size(share)) = 0.0_wp
         matrix = way%rate
         call solve_square(matrix, share, ok)
         if (.not. ok) return
         guess = guess + matmul(way%vector, share)
      end do
   end subroutine deepen

   !> Begin the motion that touches, and that `without` impacts beside it, in the middle of the longest time between touches.
   subroutine leave_touch(problem, touch, without, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable, intent(inout) :: touch(:)
      type(point_t), intent(inout) :: without
      logical, intent(out) :: ok

      type(orbit_t) :: beyond
      real(wp), allocatable :: later(:)
      real(wp) :: quiet, way

      call problem%evaluate(touch - apart*without%tangent, .false., beyond, ok)
      if (.not. ok) return
      quiet = find_quiet(problem, beyond)
      call carry(problem, without%orbit%u, beyond%phase, quiet, later, ok)
      if (.not. ok) return
      problem%map%phase = problem%phase_after(beyond%phase, quiet)
      way = touch(size(touch)) - later(size(later))
      call problem%evaluate(later, .true., without%orbit, ok)
      if (ok) call complete_point_at(problem, without, [0.0_wp*later(2:), -way], ok)
      ! Carried on itself it might hit by rounding, and the next stop by the root of that.
      if (ok) touch = later + without%tangent*way/without%tangent(size(later))
   end subroutine leave_touch

   !> The way from the touch, at the unknowns u. `which` and `more` as in `switch_at_touch`.
   subroutine find_way(problem, u, without, which, way, more, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:)
      type(point_t), intent(in) :: without
      integer, intent(in) :: which
      type(way_t), intent(out) :: way
      logical, intent(out) :: more, ok

      real(wp), allocatable :: gaps(:, :), later(:, :), matrix(:, :), rate(:, :), share(:)
      integer, allocatable :: hit(:), touched(:)
      integer :: i

      gaps = spread(gaps_at(problem, u + apart*without%tangent), 2, 2)
      gaps(:, 2) = gaps_at(problem, u + 2*apart*without%tangent)
      touched = pack([(i, i=1, size(gaps, 1))], maxval(gaps, 2) < huge(1.0_wp))
      touched = pack(touched, abs(gaps(touched, 2) - 2*gaps(touched, 1)) <= at_once*gaps(touched, 1))
      way%slope = (gaps(touched, 2) - gaps(touched, 1))/apart
      more = size(touched) > max(1, which)
      ok = which <= size(touched) .and. size(touched) > 0
      if (.not. ok) return
      hit = [(i, i=1, size(touched))]
      if (which > 0) hit = [which]
      associate (n => size(hit))
         allocate (way%vector(size(u), n + 1), way%rate(n + 1, n + 1), way%impulse(n))
         allocate (later(size(touched), n), rate(size(touched), n + 1))
         do i = 1, n
            call find_impact(problem, u, without, touched, way%slope, gaps, hit(i), way%vector(:, i), later(:, i), rate(:, i), &
                             way%impulse(i), ok)
            if (.not. ok) return
         end do
         way%vector(:, n + 1) = without%tangent
         rate(:, n + 1) = way%slope
         ! Shares of the impacts that add up to 1, and of the tangent, with which the gaps stay closed.
         way%rate(:n, :) = rate(hit, :)
         way%rate(n + 1, :) = [spread(1.0_wp, 1, n), 0.0_wp]
         matrix = way%rate
         matrix(:n, :n) = matrix(:n, :n) + later(hit, :)
         share = [spread(0.0_wp, 1, n), 1.0_wp]
         call solve_square(matrix, share, ok)
         rate(:, :n) = rate(:, :n) + later
         ok = ok .and. all(share(:n) > 0.0_wp) .and. all(way%slope > 0.0_wp)
         do i = 1, size(touched)
            if (.not. any(hit == i)) ok = ok .and. dot_product(rate(i, :), share) > 0.0_wp
         end do
         way%along = matmul(way%vector, share)
         way%impulse = way%impulse*share(:n)/norm2(way%along)
         way%jump = later(hit, :)*spread(share(:n), 1, n)/norm2(way%along)
      end associate
      way%along = way%along/norm2(way%along)
      way%slope = way%slope(hit)
      way%hit = touched(hit)
   end subroutine find_way

   !> The unit vector by which an impact on the edge touched(hit) alone moves the motion at the same parameter, where the others are
   !> kept open, its impulse, and the rate at which that opens the gaps of all edges `touched`, whose `slope` is that along the
   !> tangent, `apart` and twice as far along which they are `gaps`; `later`: what comes after the impact within the period feels it
   !> at once.
   subroutine find_impact(problem, u, without, touched, slope, gaps, hit, direction, later, rate, impulse, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: u(:)
      type(point_t), intent(in) :: without
      integer, intent(in) :: touched(:), hit
      real(wp), intent(in) :: slope(:), gaps(:, :)
      real(wp), intent(out) :: direction(:), later(:), rate(:), impulse
      logical, intent(out) :: ok

      type(orbit_t) :: beyond, softer
      real(wp), allocatable :: matrix(:, :), flight(:), there(:)
      integer :: i

      later = 0.0_wp
      rate = 0.0_wp
      associate (beside => u - aside*without%tangent, others => pack(touched, [(i /= hit, i=1, size(touched))]))
         call keep_open(problem, touched)
         flight = gaps_at(problem, beside, touched)
         ! A stop that is touched alone may be hit elsewhere.
         if (size(touched) == 1) flight(touched) = -aside*slope
         call keep_open(problem, others)
         call problem%evaluate(beside, .false., beyond, ok)
         if (ok) call problem%evaluate(u - 0.25_wp*aside*without%tangent, .false., softer, ok)
         there = gaps_at(problem, beside, others)
         call keep_open(problem, [integer ::])
      end associate
      impulse = 0.0_wp
      direction = 0.0_wp
      if (ok) ok = without%orbit%sequence%difference(beyond%sequence) == (touched(hit) + 1)/2 &
                   .and. softer%sequence%is_like(beyond%sequence)
      if (ok) then
         ! Without what goes with the square of the speed, which is half of that of the first, but for its size.
         direction = -[4*softer%residual - beyond%residual, 0.0_wp]
         direction = direction*norm2(beyond%residual)/norm2(direction)
         matrix = bordered(problem%jacobian(without%orbit), [spread(0.0_wp, 1, size(direction) - 1), 1.0_wp])
         call solve_square(matrix, direction, ok)
         there(touched(hit)) = flight(touched(hit))
         ok = ok .and. norm2(direction) > 0.0_wp .and. flight(touched(hit)) < 0.0_wp &
              .and. max(maxval(there(touched)), maxval(flight(touched))) < huge(1.0_wp)
      end if
      if (ok) then
         ! By its errors the touch is not there for all stops at once, and the speed goes with the root of the depth.
         impulse = sqrt(-flight(touched(hit))/(aside*slope(hit)))/norm2(direction)
         later = (there(touched) - flight(touched))/norm2(direction)
         direction = direction/norm2(direction)
         ! At the touch itself, by the rates at once and twice as far from it; an edge that is not come near to any more has none.
         do i = 1, 2
            there = gaps_at(problem, u + apart*(i*without%tangent + beside_by*direction))
            ok = ok .and. maxval(there(touched)) < huge(1.0_wp)
            if (.not. ok) return
            there(touched) = (there(touched) - gaps(touched, i))/(beside_by*apart)
            rate = merge(there(touched), 2*rate - there(touched), i == 1)
         end do
      end if
   end subroutine find_impact

   !> Keep the open contacts with these edges open.
   subroutine keep_open(problem, edges)
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: edges(:)

      integer :: i

      associate (contact => problem%map%by%system%machine%contact)
         call problem%map%keep((edges + 1)/2, [(contact((edges(i) + 1)/2)%law%home, i=1, size(edges))], &
                               merge(1, -1, modulo(edges, 2) == 0))
      end associate
   end subroutine keep_open

end module razy_orbits_beyond_touch
