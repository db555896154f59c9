!! Curves of special points of periodic motions - folds, doublings, tori, grazings - over two parameters.
!!
!! One parameter is held at its next value, that of the two in which the curve goes farther; over the other, a short branch of
!! motions through the place where the curve is expected has the point, located there to rounding (razy_orbits_branch_within_step).
!! So the curve may turn in either parameter. It ends where such a branch has no point of its kind: at a cusp, or where the point
!! becomes another.
!!
!! Where on a curve another multiplier comes to 1 or -1, or the pair of a torus to a third or a fourth of a turn, two things
!! happen at once (Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, Springer (2004), chapter 9): these places are
!! located, too.
module razy_orbits_curve
   use razy_core_kinds, only: wp
   use razy_core_text, only: string_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_observe_event_log, only: event_log_t
   use razy_orbits_beyond_touch, only: slope_of_impacts
   use razy_orbits_locate, only: locate_near
   use razy_orbits_periodic_columns, only: differentiate
   use razy_orbits_periodic_problem, only: problem_t, was_stopped
   use razy_orbits_branch_point, only: complete_point_at, find_tangent, point_t
   use razy_orbits_touch, only: find_touch_again
   implicit none(type, external)
   private

   public :: curve_t, junction_t

   !> A place where two things happen at once: R1 to R4 resonances (multipliers 1 and 1, -1 and -1, a third and a fourth of a
   !> turn), CP a cusp, LPPD a fold and a doubling, GRLP and GRPD a grazing at a fold or a doubling, so also of ST and SL, RG a
   !> resonant grazing of a stop whose force jumps.
   !> `place`: the two parameters.
   type :: junction_t
      character(4) :: label = ""
      real(wp) :: place(2) = 0.0_wp
   end type junction_t

   !> `place` (2, points): the two parameters; modulus of the largest multiplier (points); scaled unknowns without the parameter
   !> (order, points) at `phase`, in periods of the excitation (points).
   type :: curve_t
      character(2) :: label = ""
      !> The contact of a grazing; periods of the excitation in one of the motion; the branch that the first point is on.
      integer :: contact = 0, periods = 1, branch = 0
      integer :: count = 0
      real(wp), allocatable :: place(:, :), largest(:), motion(:, :), phase(:)
      type(junction_t), allocatable :: junction(:)
      !> Why it ends on both sides, in words.
      type(string_t) :: ending(2)
      !> Ranges of the two parameters, which are their units below; ends of the box in these units.
      real(wp), private :: scale(2) = 1.0_wp, low(2) = 0.0_wp, high(2) = 0.0_wp
   contains
      procedure :: follow
      procedure :: passes
      procedure, private :: add
      procedure, private :: find_junctions
   end type curve_t

   !> Where a curve has come to: the point, its parameters in units of their ranges, the number of the one along which it was found,
   !> the length of the curve up to there.
   type :: station_t
      type(point_t) :: point
      !> `error`: how far it was from where it was expected.
      real(wp) :: at(2) = 0.0_wp, error = 1.0_wp, length = 0.0_wp
      integer :: active = 1
      !> Functions that change their sign where something else happens.
      real(wp) :: test(2) = 0.0_wp
   end type station_t

   !> Steps in units of the ranges.
   real(wp), parameter :: first_step = 1.0e-3_wp, largest_step = 0.02_wp, least_step = 1.0e-8_wp
   !> Half lengths of the first and the last branch in which a point is looked for, in scaled unknowns; the first is no more than a
   !> share of the step, nor than so many times the error of the point before, so that another point beside it is not on it.
   real(wp), parameter :: narrow(2) = [1.0e-6_wp, 1.0e-4_wp], narrow_share = 0.1_wp, errors = 100.0_wp, wide = 0.3_wp
   !> Shares of a step by which the place expected may err: of any step, of the first.
   real(wp), parameter :: straight = 0.2_wp, steepest = 20.0_wp
   !> So near the end of the range a curve may end.
   real(wp), parameter :: near_end = 1.0e-4_wp
   !> Part of a step to which a junction is located; one at which its test is no less than this part of those beside it is a jump.
   real(wp), parameter :: close_enough = 1.0e-10_wp, jumps = 1.0e-4_wp
   character(*), parameter :: at_border = "the end of the range"

contains

   !> Follow the curve of a special point of a branch over parameter 1, where the problem is, both ways, in the box from `low` to
   !> `high`, for at most `most` points on each side; the parameter that was followed has its range as scale, the other `range`.
   subroutine follow(self, problem, point, low, high, range, most)
      class(curve_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: low(2), high(2), range
      integer, intent(in) :: most

      type(station_t) :: first
      real(wp), allocatable :: parameter(:)
      integer :: half, side

      call problem%begin_as(point%orbit)
      self%label = point%label
      self%contact = point%contact
      self%periods = problem%periods
      self%scale = [problem%range, range]
      self%low = low/self%scale
      self%high = high/self%scale
      parameter = problem%parameter
      first%point = point
      first%at = [point%orbit%u(size(point%orbit%u)), parameter(2)/range]
      if (.not. point%touches) first%test = test_for_others(self%label, point%orbit%multiplier)
      allocate (self%place(2, 2*most + 1), self%largest(2*most + 1), self%phase(2*most + 1), self%junction(0))
      allocate (self%motion(problem%order(), 2*most + 1))
      do side = 1, 2
         call one_side(self, problem, first, side, most)
         if (side == 2) exit
         half = self%count
         self%place(:, :half) = self%place(:, half:1:-1)
         self%largest(:half) = self%largest(half:1:-1)
         self%motion(:, :half) = self%motion(:, half:1:-1)
         self%phase(:half) = self%phase(half:1:-1)
         call self%add(first)
      end do
      problem%active = 1
      problem%range = self%scale(1)
      problem%parameter = parameter
      self%place = self%place(:, :self%count)
      self%largest = self%largest(:self%count)
      self%motion = self%motion(:, :self%count)
      self%phase = self%phase(:self%count)
   end subroutine follow

   pure subroutine add(self, station)
      class(curve_t), intent(inout) :: self
      type(station_t), intent(in) :: station

      self%count = self%count + 1
      self%place(:, self%count) = station%at*self%scale
      self%largest(self%count) = maxval([0.0_wp, abs(station%point%orbit%multiplier)])
      self%motion(:, self%count) = station%point%orbit%u(:size(self%motion, 1))
      self%phase(self%count) = station%point%orbit%phase
   end subroutine add

   !> Whether the curve, of these ranges, goes through a point at a place with its motion, or, if the point is of another kind, so
   !> near by that no picture tells them apart (a fold beside a grazing).
   pure logical function passes(self, point, at, range)
      class(curve_t), intent(in) :: self
      type(point_t), intent(in) :: point
      real(wp), intent(in) :: at(2), range(2)

      !> Motions that differ by more than this part of them are two, as those of two folds near a cusp.
      real(wp), parameter :: same_motion = 0.02_wp
      real(wp) :: same, share
      integer :: i

      passes = .false.
      same = merge(1.0e-3_wp, 1.0e-5_wp, point%label == self%label)
      do i = 2, self%count
         associate (a => self%place(:, i - 1), b => self%place(:, i))
            if ((a(2) - at(2))*(b(2) - at(2)) > 0.0_wp .or. .not. abs(b(2) - a(2)) > 0.0_wp) cycle
            share = (at(2) - a(2))/(b(2) - a(2))
            if (abs(a(1) + share*(b(1) - a(1)) - at(1)) >= same*range(1)) cycle
            associate (u => self%motion(:, i - 1) + share*(self%motion(:, i) - self%motion(:, i - 1)))
               passes = point%label /= self%label .or. abs(self%phase(i) - point%orbit%phase) > 0.0_wp .or. &
                        norm2(point%orbit%u(:size(u)) - u) < same_motion*norm2(u)
            end associate
            if (passes) return
         end associate
      end do
   end function passes

   !> From a point on, at first towards lower (side 1) or higher (2) values of parameter 2.
   subroutine one_side(self, problem, first, side, most)
      class(curve_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(station_t), intent(in) :: first
      integer, intent(in) :: side, most

      type(station_t) :: last(3), next
      real(wp), allocatable :: expected(:)
      real(wp) :: error, h
      integer :: count, held, known, n
      logical :: at_end, found, outside

      last(1) = first
      known = 1
      n = size(first%point%orbit%u) - 1
      h = first_step
      self%ending(side)%text = "the most points"
      do count = 1, most
         do
            expected = ahead(last(:known), last(1)%length + h)
            if (known == 1) expected(n + 2) = expected(n + 2) + merge(-h, h, side == 1)
            associate (at => expected(n + 1:))
               held = merge(2, 1, abs(at(2) - last(1)%at(2)) >= abs(at(1) - last(1)%at(1)))
               if (at(3 - held) < self%low(3 - held) .or. at(3 - held) > self%high(3 - held)) held = 3 - held
               at_end = at(held) <= self%low(held) .or. at(held) >= self%high(held)
               at(held) = max(self%low(held), min(self%high(held), at(held)))
            end associate
            call look(self, problem, last(1), expected, held, h, next, error, found)
            ! Nothing is known of the slope at first.
            if (found) found = error <= merge(steepest, straight, known == 1)*h
            outside = found .and. any(next%at < self%low .or. next%at > self%high)
            if (found .and. .not. outside) exit
            h = h/4
            if (h > merge(near_end, least_step, outside)) cycle
            self%ending(side)%text = "no such point further on"
            if (.not. outside .and. self%label == "LP" .and. self%count > 0) call find_cusp(self, side)
            if (outside) self%ending(side)%text = at_border
            ! Such as loads without a common period.
            call problem%go_to([expected(:n), expected(n + 3 - held)], found)
            if (.not. found) self%ending(side)%text = problem%reason
            if (problem%is_stopped()) self%ending(side)%text = was_stopped
            return
         end do
         call self%add(next)
         call problem%tell("curve", self%count, next%at(1)*self%scale(1))
         next%length = last(1)%length + norm2(next%at - last(1)%at)
         call self%find_junctions(problem, [next, last(:min(known, 2))], held)
         if (at_end) self%ending(side)%text = at_border
         if (at_end) return
         if (error < 0.25_wp*straight*h) h = min(2*h, largest_step)
         last(2:) = last(:2)
         last(1) = next
         known = min(known + 1, 3)
      end do
   end subroutine one_side

   !> Where a curve of folds ends because it turns back in a cusp, a junction: there both parameters are stationary along the
   !> motions, by the parabola through three points of the curve.
   subroutine find_cusp(self, side)
      class(curve_t), intent(inout) :: self
      integer, intent(in) :: side

      !> Distance of the three points, relative to the motion; share of the slope that may be left at the vertex.
      real(wp), parameter :: apart = 1.0e-3_wp, flat = 0.1_wp
      real(wp) :: bend(2), first(2), second(2), vertex, x(3)
      real(wp), allocatable :: away(:)
      integer :: i, k(3)

      away = [(norm2(self%motion(:, i) - self%motion(:, self%count)), i=1, self%count)]
      k(1) = self%count
      do i = 2, 3
         k(i) = findloc(away(:k(i - 1) - 1) > (i - 1)*apart*norm2(self%motion(:, k(1))), .true., dim=1, back=.true.)
         if (k(i) == 0) return
      end do
      x = -away(k)
      associate (at => self%place(:, k)/spread(self%scale, 2, 3))
         first = (at(:, 1) - at(:, 2))/(x(1) - x(2))
         second = (at(:, 2) - at(:, 3))/(x(2) - x(3))
         bend = (first - second)/(x(1) - x(3))
         vertex = 0.5_wp*(x(1) + x(2) - dot_product(first, bend)/max(dot_product(bend, bend), tiny(vertex)))
         if (vertex < x(2) .or. vertex > -x(3)) return
         if (norm2(first + bend*(2*vertex - x(1) - x(2))) > flat*norm2(second)) return
         self%ending(side)%text = "a cusp: two folds meet"
         first = self%scale*(at(:, 1) + first*vertex + bend*vertex*(vertex - x(2)))
      end associate
      self%junction = [self%junction, junction_t("CP", first)]
   end subroutine find_cusp

   !> What else happens between the last two of some stations, the newest first, along parameter 3 - `held`.
   subroutine find_junctions(self, problem, station, held)
      class(curve_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(station_t), intent(in) :: station(:)
      integer, intent(in) :: held

      type(bracketed_root_t) :: root
      type(station_t) :: there
      character(4) :: name(2)
      real(wp) :: error
      integer :: k
      logical :: found

      name = [character(4) :: self%label//"LP", self%label//"PD"]
      if (self%label == "LP") name = [character(4) :: "R1", "LPPD"]
      if (self%label == "PD") name = [character(4) :: "LPPD", "R2"]
      if (self%label == "TR") name = [character(4) :: "R3", "R4"]
      if (station(1)%point%touches) name = "RG"
      do k = 1, 2
         if (station(2)%test(k)*station(1)%test(k) >= 0.0_wp) cycle
         call root%start(station(2)%length, station(2)%test(k), station(1)%length, station(1)%test(k))
         found = .true.
         do while (root%width() > close_enough*abs(station(1)%length - station(2)%length) .and. .not. root%done())
            call look(self, problem, station(2), ahead(station, root%trial), held, abs(root%trial - station(2)%length), there, &
                      error, found)
            if (.not. found) exit
            call root%take(there%test(k))
         end do
         if (.not. found .or. abs(root%value) >= jumps*max(abs(station(2)%test(k)), abs(station(1)%test(k)))) cycle
         self%junction = [self%junction, junction_t(name(k), there%at*self%scale)]
      end do
   end subroutine find_junctions

   !> Functions of the multipliers of a point of this kind that change their sign where something else happens.
   pure function test_for_others(label, multiplier) result(value)
      character(*), intent(in) :: label
      complex(wp), intent(in) :: multiplier(:)
      real(wp) :: value(2)

      integer :: pair
      logical :: others(size(multiplier))

      if (label == "TR") then
         value = 0.0_wp
         pair = minloc(abs(abs(multiplier) - 1), dim=1, mask=multiplier%im > 0.0_wp)
         if (pair > 0) value = real(multiplier(pair), wp) + [0.5_wp, 0.0_wp]
         return
      end if
      others = .true.
      if (label == "LP") others(minloc(abs(multiplier - 1), dim=1)) = .false.
      if (label == "PD") others(minloc(abs(multiplier + 1), dim=1)) = .false.
      value = [real(product(multiplier - 1, mask=others), wp), real(product(multiplier + 1, mask=others), wp)]
   end function test_for_others

   !> Unknowns without the parameter, and both parameters, where the curve is expected at this length, by the polynomial
   !> through where it was last.
   pure function ahead(last, length) result(expected)
      type(station_t), intent(in) :: last(:)
      real(wp), intent(in) :: length
      real(wp), allocatable :: expected(:)

      real(wp) :: weight
      integer :: i, j, n

      n = size(last(1)%point%orbit%u) - 1
      expected = spread(0.0_wp, 1, n + 2)
      do i = 1, size(last)
         weight = 1.0_wp
         do j = 1, size(last)
            if (j /= i) weight = weight*(length - last(j)%length)/(last(i)%length - last(j)%length)
         end do
         expected = expected + weight*[last(i)%point%orbit%u(:n), last(i)%at]
      end do
   end function ahead

   !> The special point near where the curve is expected, a step h from `here`, with parameter `held` as it is there. `error`:
   !> how far it is from where it was expected.
   subroutine look(self, problem, here, there, held, h, next, error, found)
      type(curve_t), intent(in) :: self
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: held
      type(station_t), intent(in) :: here
      real(wp), intent(in) :: there(:), h
      type(station_t), intent(out) :: next
      real(wp), intent(out) :: error
      logical, intent(out) :: found

      real(wp), allocatable :: expected(:), row(:)
      real(wp) :: half
      integer :: last

      last = size(there) - 1
      next%active = 3 - held
      next%at = there(last:)
      problem%active = next%active
      problem%range = self%scale(next%active)
      problem%parameter(held) = next%at(held)*self%scale(held)
      expected = [there(:last - 1), next%at(next%active)]
      error = huge(error)
      call along(self, problem, here, next%active, row, found)
      if (.not. found) return
      if (here%point%touches) then
         call problem%begin_as(here%point%orbit)
         call touch_near(problem, here%point%orbit%sequence, self%contact, expected, row, next, found)
      else
         half = min(narrow(2), narrow_share*h, max(narrow(1), errors*here%error))
         next%point = here%point
         call locate_near(problem, self%label, self%contact, expected, row, half, wide, next%point, found)
         if (found) next%test = test_for_others(self%label, next%point%orbit%multiplier)
      end if
      if (.not. found) return
      next%at(next%active) = next%point%orbit%u(last)
      error = abs(next%at(next%active) - expected(last))
      next%error = error
   end subroutine look

   !> The first touch of a stop whose force jumps near the unknowns `expected`: beyond it motions are no neighbours. Where along
   !> those that hit the stop the parameter does not change to first order, folds and doublings meet the touch.
   subroutine touch_near(problem, sequence, contact, expected, row, next, found)
      type(problem_t), intent(inout) :: problem
      type(event_log_t), intent(in) :: sequence
      integer, intent(in) :: contact
      real(wp), intent(in) :: expected(:), row(:)
      type(station_t), intent(inout) :: next
      logical, intent(out) :: found

      real(wp), allocatable :: u(:)

      next%point%touches = .true.
      call find_touch_again(problem, expected, row, sequence, contact, u, next%point%orbit, found)
      if (found) call complete_point_at(problem, next%point, next%point%orbit%u - u, found)
      if (.not. found) return
      ! Whether they are on the side of those without the impact, whichever parameter is varied.
      next%test = [slope_of_impacts(problem, u, next%point)*sign(1.0_wp, next%point%tangent(size(u))), 0.0_wp]
      call problem%begin_as(next%point%orbit)
      next%point%orbit%u = u
   end subroutine touch_near

   !> The direction at a point of the branch over parameter `active`: its tangent, or that by the derivatives with respect to this
   !> parameter if the point was found along the other. It exists at a fold too.
   subroutine along(self, problem, here, active, row, ok)
      type(curve_t), intent(in) :: self
      type(problem_t), intent(inout) :: problem
      type(station_t), intent(in) :: here
      integer, intent(in) :: active
      real(wp), allocatable, intent(out) :: row(:)
      logical, intent(out) :: ok

      type(point_t) :: there
      real(wp) :: held_value

      ok = .true.
      row = here%point%tangent
      if (active == here%active) return
      there%orbit = here%point%orbit
      there%orbit%u(size(row)) = here%at(active)
      associate (held => problem%parameter(3 - active))
         held_value = held
         held = here%at(3 - active)*self%scale(3 - active)
         call differentiate(problem, there%orbit, ok)
         if (ok) call find_tangent(problem, there, row, ok)
         held = held_value
      end associate
      if (ok) row = there%tangent
   end subroutine along

end module razy_orbits_curve
