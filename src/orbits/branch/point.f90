!! Points of a branch of periodic motions, and steps from one to others near it.
module razy_orbits_branch_point
   use razy_core_kinds, only: wp
   use razy_linalg_square, only: bordered, solve_square
   use razy_orbits_periodic_columns, only: differentiate
   use razy_orbits_periodic_newton, only: complete, correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: between, complete_point, complete_point_at, direction, find_tangent, kink, length, point_t, reach, step

   !> A motion of a branch; `label` is empty where nothing happens. `tangent` of the branch, in scaled unknowns.
   type :: point_t
      type(orbit_t) :: orbit
      real(wp), allocatable :: tangent(:)
      character(2) :: label = ""
      !> The contact that a change of the sequence is one of, 0: none or several.
      integer :: contact = 0
      !> Whether the branch turns here, as motions that lost a symmetry come back to it: the other one goes across it.
      logical :: turns = .false.
      !> Whether this motion touches a stop whose force jumps: those that hit it are no neighbours.
      logical :: touches = .false.
      !> How far the parameter of a special point may be off by the errors of the method, in its unit; NaN: not known.
      real(wp) :: error = 0.0_wp
   end type point_t

   !> The largest angle between tangents of neighbours, as its cosine.
   real(wp), parameter :: least_cosine = 0.95_wp
   !> Tangents on both sides of a change of contacts that differ by no more may do so by rounding, or by a method's errors.
   real(wp), parameter :: straight_on(2) = [1.0e-5_wp, 0.001_wp]
   !> What both sides make of the other's tangent is one column if it is so parallel; as a cosine.
   real(wp), parameter :: one_column = 0.9_wp
   !> Shorter steps may turn by any angle: the branch has a kink where contacts change. Steps may err by this part of them.
   real(wp), parameter :: kink = 1.0e-6_wp, straight = 0.1_wp

contains

   !> A step of length h along the tangent, or to where the parameter comes to `low` or `high` if there is no machine beyond.
   subroutine step(problem, here, h, low, high, next, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(in) :: h, low, high
      type(point_t), intent(out) :: next
      logical, intent(out) :: ok

      real(wp) :: away, guess(size(here%tangent)), p, row(size(here%tangent))

      call problem%begin_as(here%orbit)
      next%orbit%column = here%orbit%column
      next%orbit%bend = here%orbit%bend
      guess = here%orbit%u + h*here%tangent
      row = here%tangent
      associate (last => size(row))
         p = min(max(guess(last), low), high)
         ok = .not. abs(guess(last) - p) > 0.0_wp
         if (.not. ok) call problem%go_to(guess, ok)
         if (.not. ok) then
            guess = here%orbit%u + (p - here%orbit%u(last))/here%tangent(last)*here%tangent
            guess(last) = p
            row(:last - 1) = 0.0_wp
         end if
      end associate
      call correct(problem, guess, row, next%orbit, ok)
      if (.not. ok .and. h < kink) call turn(problem, here, h, next, ok)
      if (ok) call complete_point(problem, here, next, ok)
      if (.not. ok) return
      ok = dot_product(next%tangent, here%tangent) > least_cosine .or. h < kink
      if (.not. ok) problem%reason = "the branch turns too sharply"
      if (.not. ok .or. h < kink) return
      ! A curve, even with a kink, is no farther from its tangent than it turns; what is lies on another piece.
      away = norm2(next%orbit%u - guess)
      ok = away <= max(h*norm2(next%tangent - here%tangent), straight*h)
      if (.not. ok) problem%reason = "the motion jumps to another piece of the branch"
   end subroutine step

   !> A step around a corner where the sequence of contacts changes and that the plane across the tangent does not meet behind it.
   subroutine turn(problem, here, h, next, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(in) :: h
      type(point_t), intent(inout) :: next
      logical, intent(out) :: ok

      real(wp), allocatable :: ahead(:), matrix(:, :), way(:)
      type(point_t) :: beyond

      call problem%evaluate(here%orbit%u + h*here%tangent, .true., beyond%orbit, ok)
      if (ok) ok = .not. beyond%orbit%sequence%is_like(here%orbit%sequence)
      beyond%orbit%correction = here%orbit%correction
      if (ok) call complete_point(problem, here, beyond, ok)
      if (.not. ok) return
      ahead = direction(here, beyond)
      next%orbit%column = beyond%orbit%column
      next%orbit%bend = beyond%orbit%bend
      ! The plane may begin on this side of the corner: the first step is that of the motion beyond.
      matrix = bordered(problem%jacobian(beyond%orbit), ahead)
      way = -[beyond%orbit%residual, h*(dot_product(ahead, here%tangent) - 1.0_wp)]
      call solve_square(matrix, way, ok)
      if (ok) call correct(problem, beyond%orbit%u + way, ahead, next%orbit, ok)
      if (ok) ok = .not. next%orbit%sequence%is_like(here%orbit%sequence)
   end subroutine turn

   !> The unit tangent on the side of `guide`.
   subroutine find_tangent(problem, point, guide, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: point
      real(wp), intent(in) :: guide(:)
      logical, intent(out) :: ok

      real(wp), allocatable :: matrix(:, :)

      matrix = bordered(problem%jacobian(point%orbit), guide)
      point%tangent = [spread(0.0_wp, 1, size(guide) - 1), 1.0_wp]
      call solve_square(matrix, point%tangent, ok)
      point%tangent = point%tangent/norm2(point%tangent)
      ok = ok .and. all(abs(point%tangent) <= 1.0_wp)
      if (.not. ok) problem%reason = "the branch has no tangent"
   end subroutine find_tangent

   !> The motion at the parameter `p` between two points of a branch, in place of the second.
   subroutine reach(problem, here, next, p, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      type(point_t), intent(inout) :: next
      real(wp), intent(in) :: p
      logical, intent(out) :: ok

      real(wp) :: row(size(next%orbit%u)), share
      real(wp), allocatable :: guess(:)

      associate (a => here%orbit%u, b => next%orbit%u, last => size(next%orbit%u))
         share = (p - a(last))/(b(last) - a(last))
         guess = a + share*(b - a)
         guess(last) = p
         row = [spread(0.0_wp, 1, last - 1), 1.0_wp]
      end associate
      call correct(problem, guess, row, next%orbit, ok)
      if (ok) call complete_point_at(problem, next, here%tangent, ok)
   end subroutine reach

   !> The motion at the length s of their direction between the points `a` and `b`; not at the ends. `left` and `right`: motions
   !> found so on both sides, if there are any nearer ones.
   subroutine between(problem, a, b, s, point, ok, left, right)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      real(wp), intent(in) :: s
      type(point_t), intent(out) :: point
      logical, intent(out) :: ok
      type(point_t), intent(in), optional :: left, right

      real(wp) :: from, guess(size(a%orbit%u)), way

      point%orbit%column = a%orbit%column
      point%orbit%bend = a%orbit%bend
      if (present(left)) then
         guess = a%orbit%u + (s/length(a, b))*(b%orbit%u - a%orbit%u)
         point%orbit%column = left%orbit%column
         associate (chord => right%orbit%u - left%orbit%u, along => direction(a, b))
            from = dot_product(along, left%orbit%u - a%orbit%u)
            way = dot_product(along, chord)
            ! Nearer ones are one but for rounding.
            if (way > 8*epsilon(way)*norm2(guess)) guess = left%orbit%u + (s - from)/way*chord
         end associate
      else
         guess = on_curve(a, b, s)
      end if
      ! What one of them holds stays there.
      guess = a%orbit%keep_held(b%orbit%keep_held(guess))
      call correct(problem, guess, direction(a, b), point%orbit, ok)
      ! What is farther off than both are apart is another piece.
      if (ok) ok = norm2(point%orbit%u - guess) <= norm2(b%orbit%u - a%orbit%u)
      if (ok .and. .not. allocated(point%orbit%column)) call differentiate(problem, point%orbit, ok)
   end subroutine between

   !> Where the curve with the tangents at the points `a` and `b` is at the length s of their direction; straight across a corner.
   pure function on_curve(a, b, s) result(u)
      type(point_t), intent(in) :: a, b
      real(wp), intent(in) :: s
      real(wp) :: u(size(a%orbit%u))

      real(wp) :: part

      part = s/length(a, b)
      associate (along => direction(a, b), chord => b%orbit%u - a%orbit%u, rest => 1.0_wp - part)
         u = a%orbit%u + part*chord
         if (.not. a%orbit%sequence%is_like(b%orbit%sequence)) return
         u = u + part*rest*(rest*(length(a, b)/dot_product(a%tangent, along)*a%tangent - chord) &
                            - part*(length(a, b)/dot_product(b%tangent, along)*b%tangent - chord))
      end associate
   end function on_curve

   !> The unit vector between the tangents at a and b: the branch goes along it on both sides of a corner.
   pure function direction(a, b)
      type(point_t), intent(in) :: a, b
      real(wp), allocatable :: direction(:)

      direction = a%tangent + b%tangent
      direction = direction/norm2(direction)
   end function direction

   !> Length of the step from a to b along their direction.
   pure real(wp) function length(a, b)
      type(point_t), intent(in) :: a, b

      length = dot_product(direction(a, b), b%orbit%u - a%orbit%u)
   end function length

   !> All that is asked of a motion, unless it is there, with the tangent onwards from `a`: on the side of that at `a`, but around
   !> a corner, where contacts change, on that where they change further.
   subroutine complete_point(problem, a, point, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a
      type(point_t), intent(inout) :: point
      logical, intent(out) :: ok

      real(wp), dimension(problem%order()) :: here, there

      ok = .true.
      if (.not. allocated(point%orbit%multiplier)) call complete(problem, point%orbit, ok)
      if (ok) call find_tangent(problem, point, a%tangent, ok)
      if (.not. ok) return
      if (a%orbit%sequence%is_like(point%orbit%sequence)) return
      if (norm2(point%tangent - a%tangent) < merge(straight_on(2), straight_on(1), problem%resolution > 0.0_wp)) return
      ! What the contact adds to the derivatives is one column times its gap's gradient, which both tangents increase.
      there = matmul(problem%jacobian(point%orbit), a%tangent)
      here = matmul(problem%jacobian(a%orbit), point%tangent)
      if (dot_product(there, here) > one_column*norm2(there)*norm2(here)) point%tangent = -point%tangent
   end subroutine complete_point

   !> All that is asked of a motion, with the tangent on the side of `guide`.
   subroutine complete_point_at(problem, point, guide, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(inout) :: point
      real(wp), intent(in) :: guide(:)
      logical, intent(out) :: ok

      call complete(problem, point%orbit, ok)
      if (ok) call find_tangent(problem, point, guide, ok)
   end subroutine complete_point_at

end module razy_orbits_branch_point
