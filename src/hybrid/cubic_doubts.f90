!! Events that cannot be told: what a method may have passed over, or found where there is none, without knowing it.
!!
!! A switching function f that turns within a step stays on its side of a bound or goes beyond it and comes back; that is two events
!! more or less. If it turns nearer to the bound than the method knows f, the events there are **in doubt**, whatever was found.
!! How well f = alpha s + beta s' is known is a matter of the method (razy_runge_kutta_known):
!!
!! - with a tolerance, |error of z_i| <= absolute + relative |z_i| in a step, and after n steps n times that, as contacts that are
!!   elastic or take energy do not enlarge errors: n Σ |w_i| (absolute + relative |z_i|);
!! - without one, by c = h/64 (2 (s'_0 - s'_1) + h (s''_0 + s''_1)) = h⁴ s⁽⁴⁾/384, the difference of the cubic and the quintic
!!   through values and slopes at both ends in the middle of the step. The classical method of order 4 errs by h⁵ s⁽⁵⁾/120 in a step
!!   of linear motion, which is 384/120 of what c changes from step to step. So f is known to 2 |c| + 2 · 3.2 Σ |Δc|.
!!
!! Between looks at the ends of steps only, as with `switching`, `smoothing` and time stepping, f is taken as that cubic, known to
!! 2 |c|. The factors of 2 are for what the next order adds.
!! A doubt is no proof of an error, and where errors have grown beyond their sum, as in chaotic motion, there is none.
module razy_hybrid_cubic_doubts
   use razy_contact_contact_law, only: branch_lower, branch_lower_parting, branch_upper, branch_upper_parting, contact_law_t
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: across, barely_passed, cubic_defect, cubic_turn, doubts_t, samples_t, turned_near, within_tolerance

   !> Doubts so far, and the time of the first, s.
   type :: doubts_t
      integer(i8) :: count = 0
      real(wp) :: first = 0.0_wp
   contains
      procedure :: add
   end type doubts_t

   !> The last two values of functions of which only those at the ends of steps are known (2, functions), and how many there are.
   type :: samples_t
      real(wp), allocatable, private :: time(:, :), value(:, :)
      integer, allocatable, private :: count(:)
   contains
      procedure :: begin => begin_samples
      procedure :: next => next_sample
      procedure :: forget
   end type samples_t

contains

   !> One more at `time`, s.
   pure subroutine add(self, time)
      class(doubts_t), intent(inout) :: self
      real(wp), intent(in) :: time

      if (self%count == 0) self%first = time
      self%count = self%count + 1
   end subroutine add

   !> No values yet, of so many functions.
   pure subroutine begin_samples(self, functions)
      class(samples_t), intent(inout) :: self
      integer, intent(in) :: functions

      if (allocated(self%count)) deallocate (self%time, self%value, self%count)
      allocate (self%time(2, functions), self%value(2, functions), source=0.0_wp)
      allocate (self%count(functions), source=0)
   end subroutine begin_samples

   !> Function i is not known any more.
   pure subroutine forget(self, i)
      class(samples_t), intent(inout) :: self
      integer, intent(in) :: i

      self%count(i) = 0
   end subroutine forget

   !> The next value of function i. If the one before is lower than both beside it (`turned`) it is `lowest`, and the parabola
   !> through the three is nowhere lower by more than `room` = h² f''/6: h² f''/8 between values, and h² f''/24 where they are means
   !> over steps.
   pure subroutine next_sample(self, i, time, value, turned, lowest, room)
      class(samples_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: time, value
      logical, intent(out) :: turned
      real(wp), intent(out) :: lowest, room

      real(wp) :: h(2), second

      turned = .false.
      lowest = self%value(2, i)
      room = 0.0_wp
      if (self%count(i) >= 2) turned = lowest < min(self%value(1, i), value)
      if (turned) then
         h = [self%time(2, i) - self%time(1, i), time - self%time(2, i)]
         second = 2*((value - lowest)/h(2) + (self%value(1, i) - lowest)/h(1))/sum(h)
         room = maxval(h)**2*second/6
      end if
      self%time(:, i) = [self%time(2, i), time]
      self%value(:, i) = [self%value(2, i), value]
      self%count(i) = self%count(i) + 1
   end subroutine next_sample

   !> How well Σ w_i z_i is known after a step under tolerances of z.
   pure function within_tolerance(w, z, relative, absolute) result(known)
      real(wp), intent(in) :: w(:), z(:), relative, absolute
      real(wp) :: known

      integer :: i

      known = 0.0_wp
      do i = 1, size(w)
         known = known + abs(w(i))*(absolute + relative*abs(z(i)))
      end do
   end function within_tolerance

   !> The difference c of the quintic and the cubic in the middle of a step h, from rates and second rates at its ends.
   pure function cubic_defect(h, rate, second) result(defect)
      real(wp), intent(in) :: h, rate(2), second(2)
      real(wp) :: defect

      defect = h*(2*(rate(1) - rate(2)) + h*(second(1) + second(2)))/64
   end function cubic_defect

   !> The value at which the cubic with values f and slopes `rate` at the ends of a step h turns between them; `turns`: its slopes
   !> have different signs, so that it does so once, at `place` of the step.
   pure subroutine cubic_turn(h, f, rate, turns, at_turn, place)
      real(wp), intent(in) :: h, f(2), rate(2)
      logical, intent(out) :: turns
      real(wp), intent(out) :: at_turn
      real(wp), intent(out), optional :: place

      real(wp) :: a, b, c, q, theta, unit

      turns = min(rate(1), rate(2)) < 0.0_wp .and. max(rate(1), rate(2)) > 0.0_wp
      at_turn = f(1)
      if (present(place)) place = 0.0_wp
      if (.not. turns) return
      ! f(1) + a θ + b θ² + c θ³
      a = h*rate(1)
      b = 3*(f(2) - f(1)) - h*(2*rate(1) + rate(2))
      c = h*(rate(1) + rate(2)) - 2*(f(2) - f(1))
      ! Squares in units of the coefficients: those of a motion that has died out are none.
      unit = max(abs(a), abs(b), abs(c), tiny(1.0_wp))
      q = b + sign(unit*sqrt(max((b/unit)**2 - 3*(a/unit)*(c/unit), 0.0_wp)), b)
      ! Of the roots -a/q and -q/(3c) of the slope one is in the step.
      theta = 0.5_wp
      if (abs(q) > 0.0_wp) theta = -a/q
      if (.not. (theta >= 0.0_wp .and. theta <= 1.0_wp) .and. abs(c) > epsilon(c)*abs(q)) theta = -q/(3*c)
      theta = min(max(theta, 0.0_wp), 1.0_wp)
      at_turn = f(1) + theta*(a + theta*(b + theta*c))
      if (present(place)) place = theta
   end subroutine cubic_turn

   !> Whether s, with values and rates at the ends of a step h, goes towards a bound of `branch` and turns nearer to it than
   !> `known`, or beyond it. Away from a bound and back is no touch: a stiff contact is never deep.
   pure function turned_near(law, branch, h, s, rate, known) result(near)
      class(contact_law_t), intent(in) :: law
      integer, intent(in) :: branch
      real(wp), intent(in) :: h, s(2), rate(2), known
      logical :: near

      real(wp) :: at_turn
      logical :: turns

      near = .false.
      call cubic_turn(h, s, rate, turns, at_turn)
      if (.not. turns) return
      associate (guard => law%guard(1, branch))
         if (guard%below /= 0) near = rate(1) < 0.0_wp .and. at_turn - guard%lower <= known
         if (guard%above /= 0) near = near .or. (rate(1) > 0.0_wp .and. guard%upper - at_turn <= known)
      end associate
   end function turned_near

   !> Whether s, which passes a bound in `direction` (+1, -1) at `speed` and is turned back by s'' = `second`, comes no farther
   !> beyond it than `known`. A speed that is not positive does not even reach it.
   pure function barely_passed(direction, speed, second, known) result(barely)
      real(wp), intent(in) :: direction, speed, second, known
      logical :: barely

      barely = direction*second < 0.0_wp .and. max(speed, 0.0_wp)**2 <= 2*abs(second)*known
   end function barely_passed

   !> Whether one of two branches is on the lower side and the other on the upper one.
   pure function across(before, after)
      integer, intent(in) :: before, after
      logical :: across

      across = (lower(before) .and. upper(after)) .or. (upper(before) .and. lower(after))

   contains

      pure function lower(branch)
         integer, intent(in) :: branch
         logical :: lower

         lower = branch == branch_lower .or. branch == branch_lower_parting
      end function lower

      pure function upper(branch)
         integer, intent(in) :: branch
         logical :: upper

         upper = branch == branch_upper .or. branch == branch_upper_parting
      end function upper

   end function across

end module razy_hybrid_cubic_doubts
