!! Where in a step the first guard of the mode is left, on the step's dense output.
!!
!! *Screening by the ends.* A guard whose path touches 0 is at least g0 + g1 long; its speed is at most that at the ends and
!! what twice their accelerations add in half the step. A guard that rises or falls all the way is told by its ends. Functions
!! of the rate and forces are trusted only if twice the room of a cubic's control points is left. An excitation that the
!! guards feel and the motion does not (of a gap in free flight, of a force that holds what sticks) does not limit the step:
!! of a step in which it turns by more than `screened_angle` the ends say nothing.
!!
!! *Localisation.* Otherwise the step is divided by `least_probes` or more points, so that none is longer than half a radian of the
!! fastest excitation that guards feel; at each the guards and their rates are formed. A guard that is negative at a point was left
!! before it; one that falls at a point and rises at the next has a minimum in between, which is found and judged. Guards that are
!! functions of s alone are followed as scalar paths; any other, as a force, needs the state.
!!
!! *Nearest miss.* A guard that turned without having been left missed its bound by so much; in units of the error that the
!! tolerance allows in it, a miss below 1 is counted: there may have been two events more.
module razy_runge_kutta_event_finder
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_runge_kutta_methods_dense_output, only: path_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_runge_kutta_right_hand_side, only: right_hand_side_t
   implicit none(type, external)
   private

   public :: event_finder_t, monotone_sign

   type :: event_finder_t
      !> Misses below the error that the tolerance allows.
      integer(i8) :: near_misses = 0
      !> The guard that is left first, and the guards to look at inside the step.
      integer :: first = 0
      logical, allocatable, private :: suspect(:)
      !> Guards that fall all the way through the step.
      logical, allocatable, private :: falling(:)
      !> Guards and their rates at the start and the end of a step (count each), s'' there (contacts each).
      real(wp), allocatable, private :: g0(:), rate0(:), g1(:), rate1(:), bend0(:), bend1(:)
      !> The same at two points a and b of the step, and at one in between.
      real(wp), allocatable, private :: ga(:), ra(:), gb(:), rb(:), gc(:), rc(:)
      !> Where a guard that fell has turned in the step, the least |g| there, at least half of it; huge where it has not.
      real(wp), allocatable, private :: nearest(:)
      real(wp), allocatable, private :: z(:)
      real(wp), private :: h = 0.0_wp
      !> Whether all guards to look at are functions of s alone, and then the paths of s without excitation (contacts).
      logical, private :: on_paths = .false.
      type(path_t), allocatable, private :: path(:)
   contains
      procedure :: make_room
      procedure :: start
      procedure :: advance
      procedure :: expected
      procedure :: find
      procedure :: keep_at_rest
   end type event_finder_t

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> The cubic of a sine over this angle errs by 0.04 of its amplitude, a sixth of the room that is asked for.
   real(wp), parameter :: screened_angle = 2.0_wp
   integer, parameter :: least_probes = 8
   !> Angle of the fastest excitation that guards feel between probes.
   real(wp), parameter :: probed_angle = 0.5_wp
   integer, parameter :: most_iterations = 100
   !> Of a Newton step below this part the square is rounding; part to which the end of a rest is told.
   real(wp), parameter :: least_move = 1.0e-9_wp, least_part = 1.0e-3_wp

contains

   !> Make room for a system, and for as many guards as it can have.
   subroutine make_room(self, system, most)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: most

      integer :: contacts

      contacts = size(system%gap)
      if (allocated(self%g0)) deallocate (self%g0, self%rate0, self%g1, self%rate1, self%bend0, self%bend1, self%falling, &
                                          self%nearest, self%ga, self%ra, self%gb, self%rb, self%gc, self%rc, self%z, &
                                          self%suspect, self%path)
      allocate (self%g0(most), self%rate0(most), self%g1(most), self%rate1(most), source=0.0_wp)
      allocate (self%ga(most), self%ra(most), self%gb(most), self%rb(most), self%gc(most), self%rc(most), source=0.0_wp)
      allocate (self%nearest(most), source=huge(1.0_wp))
      allocate (self%suspect(most), self%falling(most), source=.false.)
      allocate (self%bend0(contacts), self%bend1(contacts), self%z(2*system%m), source=0.0_wp)
      allocate (self%path(contacts))
   end subroutine make_room

   !> The mode, whose guards have been listed, begins at z with the slope dz: it is as if a step had ended there.
   subroutine start(self, system, rhs, guards, z, dz)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      real(wp), intent(in) :: z(:), dz(:)

      integer :: j

      call guards%measure(system, 0.0_wp, z, .false.)
      call guards%look(system, rhs%dynamics, 0.0_wp, z, self%g1, self%rate1)
      do j = 1, size(self%bend1)
         self%bend1(j) = rhs%dynamics%second_rate(system, j, dz(system%m + 1:))
      end do
   end subroutine start

   !> Go on to the next step of the mode, after nothing was found.
   pure subroutine advance(self, guards)
      class(event_finder_t), intent(inout) :: self
      type(guards_t), intent(in) :: guards

      associate (n => guards%count)
         self%g0(:n) = self%g1(:n)
         self%rate0(:n) = self%rate1(:n)
         self%bend0 = self%bend1
      end associate
   end subroutine advance

   !> The time, s after the start of the step, at which the parabolas of the guards of s alone that fall there reach 0 first;
   !> at most `longest`.
   pure function expected(self, guards, longest) result(h)
      class(event_finder_t), intent(in) :: self
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: longest
      real(wp) :: h

      real(wp) :: bend, root
      integer :: i

      h = longest
      do i = 1, guards%count
         if (.not. of_s_alone(guards, i) .or. self%g0(i) <= guards%noise(i) .or. self%rate0(i) >= 0.0_wp) cycle
         associate (guard => guards%entry(i))
            bend = guard%side*guard%alpha*self%bend0(guard%contact)
         end associate
         root = self%rate0(i)**2 - 2*self%g0(i)*bend
         if (root < 0.0_wp) cycle
         root = sqrt(root) - self%rate0(i)
         if (2*self%g0(i) < h*root) h = 2*self%g0(i)/root
      end do
   end function expected

   !> Look for the first event in the accepted step of the stepper from z. If one is `found`, it is at `theta` of the step,
   !> and `hit` are the guards that are left there together. `dense`: the dense output has been made. Errors within `relative`
   !> and `absolute` are those that the tolerance allows in the components of z.
   subroutine find(self, system, rhs, guards, stepper, z, relative, absolute, hit, found, theta, dense)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: z(:), relative, absolute
      logical, intent(inout) :: hit(:)
      logical, intent(out) :: found, dense
      real(wp), intent(out) :: theta

      real(wp) :: a, b
      integer :: i, k, n, probes

      found = .false.
      dense = .false.
      theta = 1.0_wp
      n = guards%count
      hit = .false.
      if (n == 0) return
      self%nearest(:n) = huge(1.0_wp)
      self%h = stepper%h
      guards%delta = 1.0e-5_wp*stepper%h/max(1.0_wp, guards%fastest*stepper%h)
      call guards%look(system, rhs%dynamics, stepper%h, stepper%z_end, self%g1, self%rate1)
      call choose_suspects(self, system, rhs, guards, stepper)
      if (any(self%suspect(:n))) then
         dense = .true.
         call guards%measure(system, stepper%h, stepper%z_end, .false.)
         call stepper%prepare_dense(rhs, system, z)
         call choose_paths(self, system, guards, stepper)
         probes = 1
         if (.not. all(self%falling(:n) .or. .not. self%suspect(:n))) then
            probes = max(least_probes, ceiling(guards%fastest*stepper%h/probed_angle))
         end if
         self%ga(:n) = self%g0(:n)
         self%ra(:n) = self%rate0(:n)
         a = 0.0_wp
         do k = 1, probes
            b = real(k, wp)/probes
            if (k < probes) then
               call look_inside(self, system, rhs, guards, stepper, b, self%gb, self%rb)
            else
               self%gb(:n) = self%g1(:n)
               self%rb(:n) = self%rate1(:n)
            end if
            do i = 1, n
               if (self%suspect(i)) call search_between(self, system, rhs, guards, stepper, i, a, b, theta, found)
            end do
            if (found) exit
            a = b
            self%ga(:n) = self%gb(:n)
            self%ra(:n) = self%rb(:n)
         end do
         if (found) call gather(self, system, rhs, guards, stepper, theta, hit)
      end if
      call count_misses(self, system, guards, z, relative, absolute, hit)
   end subroutine find

   !> The guards that could be left in the step, at whose end they have just been looked at, and those that fall all the way
   !> and have no more than one root.
   subroutine choose_suspects(self, system, rhs, guards, stepper)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper

      real(wp) :: b0, b1, factor, lowest, room
      integer :: i, j

      do j = 1, size(self%bend1)
         self%bend1(j) = rhs%dynamics%second_rate(system, j, stepper%dz_end(system%m + 1:))
      end do
      if (guards%fastest*stepper%h > screened_angle) then
         self%suspect(:guards%count) = .true.
         self%falling(:guards%count) = .false.
         return
      end if
      do i = 1, guards%count
         associate (guard => guards%entry(i), h => stepper%h, noise => guards%noise(i), j => guards%entry(i)%contact)
            if (of_s_alone(guards, i)) then
               factor = guard%side*guard%alpha
               self%suspect(i) = reached(self%g0(i), self%rate0(i), self%g1(i), self%rate1(i), factor*self%bend0(j), &
                                         factor*self%bend1(j), h, noise)
               self%falling(i) = self%g0(i) > noise
               if (self%falling(i)) self%falling(i) = monotone_sign(h, self%rate0(i), self%rate1(i), factor*self%bend0(j), &
                                                                    factor*self%bend1(j)) < 0
            else
               b0 = self%g0(i) + h*self%rate0(i)/3
               b1 = self%g1(i) - h*self%rate1(i)/3
               lowest = min(self%g0(i), b0, b1, self%g1(i))
               room = 2*max(abs(b0 - self%g0(i)), abs(b1 - self%g1(i)), abs(self%g1(i) - self%g0(i)))
               self%suspect(i) = lowest <= room
               self%falling(i) = .false.
            end if
         end associate
      end do
   end subroutine choose_suspects

   !> Whether guard i is a function of s alone.
   pure function of_s_alone(guards, i) result(alone)
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: i
      logical :: alone

      alone = guards%entry(i)%function > 0 .and. .not. abs(guards%entry(i)%beta) > 0.0_wp
   end function of_s_alone

   !> Whether a guard with these values, rates and second derivatives at the ends of a step h may be left in it. Of one that
   !> goes one way only its values at the ends tell.
   pure function reached(g0, rate0, g1, rate1, bend0, bend1, h, noise)
      real(wp), intent(in) :: g0, rate0, g1, rate1, bend0, bend1, h, noise
      logical :: reached

      integer :: way

      reached = min(g0, g1) <= noise .or. g0 + g1 <= h*(max(abs(rate0), abs(rate1)) + h*max(abs(bend0), abs(bend1)))
      if (.not. reached .or. .not. g1 > noise) return
      way = monotone_sign(h, rate0, rate1, bend0, bend1)
      if (way < 0) reached = .false.
      if (way > 0) reached = g0 < -noise
   end function reached

   !> +1: a function rises, -1: it falls all through a step h with the rates r0 and r1 and the accelerations a0 and a1 at its
   !> ends; 0: that cannot be told. The cubic with these has a rate between its control points; the function is trusted to go
   !> one way if zero is further from them than half of what lies between them.
   pure function monotone_sign(h, r0, r1, a0, a1) result(way)
      real(wp), intent(in) :: h, r0, r1, a0, a1
      integer :: way

      real(wp) :: b0, b1, highest, lowest, room

      b0 = r0 + h*a0/3
      b1 = r1 - h*a1/3
      lowest = min(min(r0, r1), min(b0, b1))
      highest = max(max(r0, r1), max(b0, b1))
      room = 0.5_wp*(highest - lowest)
      way = 0
      if (lowest > room) way = 1
      if (highest < -room) way = -1
   end function monotone_sign

   !> The paths of s for guards that are functions of s alone.
   subroutine choose_paths(self, system, guards, stepper)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper

      integer :: i

      self%on_paths = .true.
      do i = 1, guards%count
         if (.not. self%suspect(i)) cycle
         self%on_paths = of_s_alone(guards, i)
         if (.not. self%on_paths) return
         associate (j => guards%entry(i)%contact)
            call stepper%output%follow(system%w(:, j), 0, self%path(j))
         end associate
      end do
   end subroutine choose_paths

   !> Guards and their rates at theta of the step, at least those to look at; with `only` this one.
   subroutine look_inside(self, system, rhs, guards, stepper, theta, g, rate, only)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: theta
      real(wp), intent(inout) :: g(:), rate(:)
      integer, intent(in), optional :: only

      real(wp) :: s, s_rate
      integer :: i, j

      if (.not. self%on_paths) then
         call stepper%at(theta, self%z)
         call guards%look(system, rhs%dynamics, theta*self%h, self%z, g, rate)
         return
      end if
      associate (excitation => rhs%dynamics%excitation)
         call excitation%look(system%machine%tone, theta*self%h)
         do i = 1, guards%count
            if (.not. self%suspect(i)) cycle
            if (present(only)) then
               if (i /= only) cycle
            end if
            j = guards%entry(i)%contact
            call self%path(j)%look(theta, s, s_rate)
            s = s + system%gap(j)%constant + sum(real(system%gap(j)%error*excitation%phasor))
            s_rate = s_rate + system%machine%contact(j)%drive &
                     + sum(real(system%gap(j)%error*excitation%rates(system%machine%tone, 1)))
            associate (guard => guards%entry(i))
               g(i) = guard%side*(guard%alpha*s + guard%gamma - guard%bound)
               rate(i) = guard%side*guard%alpha*s_rate
            end associate
         end do
      end associate
   end subroutine look_inside

   !> Whether guard i is left between the probes a and b, before what has been found so far at `theta`.
   subroutine search_between(self, system, rhs, guards, stepper, i, a, b, theta, found)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(inout) :: theta
      logical, intent(inout) :: found

      real(wp) :: at, g_turn, lowest, turn
      logical :: left

      left = .false.
      at = a
      associate (ga => self%ga(i), gb => self%gb(i), ra => self%ra(i), rb => self%rb(i), noise => guards%noise(i))
         if (gb < -noise) then
            left = .true.
            if (ga > noise) then
               call find_root(self, system, rhs, guards, stepper, i, a, b, ga, gb, ra, rb, at)
            else if (at_rest(self, system, guards, stepper, i, ga, ra)) then
               call find_emergence(self, system, rhs, guards, stepper, i, a, b, at)
            else if (ra > 0.0_wp) then
               ! It starts on the bound and leads away from it before it comes back, if by no more than rounding.
               call find_turn(self, system, rhs, guards, stepper, i, a, b, turn, g_turn)
               at = turn
               if (g_turn > noise) call find_root(self, system, rhs, guards, stepper, i, turn, b, g_turn, gb, 0.0_wp, rb, at)
            else
               call find_return(self, system, rhs, guards, stepper, i, a, b, at)
            end if
         else if (ra < 0.0_wp .and. rb > 0.0_wp) then
            ! A convex function is nowhere below the tangents at both ends.
            lowest = ga + ra*((gb - ga - rb*(b - a)*self%h)/(ra - rb))
            if (lowest > 0.5_wp*min(ga, gb) .and. min(ga, gb) > noise) then
               self%nearest(i) = min(self%nearest(i), lowest)
               return
            end if
            call find_turn(self, system, rhs, guards, stepper, i, a, b, turn, g_turn)
            self%nearest(i) = min(self%nearest(i), abs(g_turn))
            left = g_turn < -noise
            if (left .and. ga > noise) call find_root(self, system, rhs, guards, stepper, i, a, turn, ga, g_turn, ra, 0.0_wp, at)
         end if
      end associate
      if (.not. left) return
      if (found .and. .not. at < theta) return
      theta = at
      self%first = i
      found = .true.
   end subroutine search_between

   !> Root of guard i between theta = a, where it is positive, and b, where it is negative, with its rates there: Newton's method in
   !> the bracket, from the root of the cubic with these values.
   subroutine find_root(self, system, rhs, guards, stepper, i, a, b, ga, gb, ra, rb, at)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b, ga, gb, ra, rb
      real(wp), intent(out) :: at

      real(wp) :: high, low, move
      integer :: k

      low = a
      high = b
      at = a + (b - a)*cubic_root(ga, gb, (b - a)*self%h*ra, (b - a)*self%h*rb)
      do k = 1, most_iterations
         call look_inside(self, system, rhs, guards, stepper, at, self%gc, self%rc, i)
         associate (g => self%gc(i), rate => self%rc(i))
            if (.not. abs(g) > 0.0_wp) return
            if (g > 0.0_wp) low = at
            if (g < 0.0_wp) high = at
            move = 0.0_wp
            if (rate < 0.0_wp) move = -g/(rate*self%h)
         end associate
         if (abs(move) > 0.0_wp .and. abs(move) <= least_move*at .and. at + move > low .and. at + move < high) then
            at = at + move
            return
         end if
         if (.not. (at + move > low .and. at + move < high) .or. .not. abs(move) > 0.0_wp .or. k > most_iterations/2) then
            move = 0.5_wp*(low + high) - at
         end if
         at = at + move
         if (abs(move) <= eps*at .or. high - low <= 2*eps*high) return
      end do
   end subroutine find_root

   !> About where in [0, 1] the cubic with the values g0 > 0 > g1 and the slopes d0 and d1 at the ends vanishes.
   pure function cubic_root(g0, g1, d0, d1) result(x)
      real(wp), intent(in) :: g0, g1, d0, d1
      real(wp) :: x

      real(wp) :: a, b, slope
      integer :: k

      a = d0 + d1 - 2*(g1 - g0)
      b = 3*(g1 - g0) - 2*d0 - d1
      x = g0/(g0 - g1)
      do k = 1, 2
         slope = d0 + x*(2*b + x*3*a)
         if (.not. slope < 0.0_wp) return
         x = min(max(x - (g0 + x*(d0 + x*(b + x*a)))/slope, 0.0_wp), 1.0_wp)
      end do
   end function cubic_root

   !> Where between theta = a and b the rate of guard i, of other signs there, vanishes, and the guard at that point.
   subroutine find_turn(self, system, rhs, guards, stepper, i, a, b, at, g)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at, g

      type(bracketed_root_t) :: root
      real(wp) :: noise

      call root%start(a, self%ra(i), b, self%rb(i), least_move)
      at = b
      g = self%gb(i)
      do while (.not. root%done())
         at = root%trial
         call look_inside(self, system, rhs, guards, stepper, at, self%gc, self%rc, i)
         g = self%gc(i)
         ! What is left of the way changes the guard by rounding.
         noise = eps*abs(g)/(root%width()*self%h)
         call root%take(merge(0.0_wp, self%rc(i), abs(self%rc(i)) <= noise))
      end do
   end subroutine find_turn

   !> Where between theta = a, where guard i is on its bound, and b, where it is beyond, that can be told from rounding.
   subroutine find_emergence(self, system, rhs, guards, stepper, i, a, b, at)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at

      real(wp) :: low, middle

      low = a
      at = b
      do while (at - low > least_part*at)
         middle = 0.5_wp*(low + at)
         call look_inside(self, system, rhs, guards, stepper, middle, self%gc, self%rc, i)
         if (self%gc(i) < -guards%noise(i)) then
            at = middle
         else
            low = middle
         end if
      end do
   end subroutine find_emergence

   !> Where guard i, on its bound at theta = a and beyond it at b, comes back to it if it leads away from it first, though its rate
   !> at a does not say so (friction that begins to slide with no acceleration); `at` = a if it does not.
   subroutine find_return(self, system, rhs, guards, stepper, i, a, b, at)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: at

      real(wp) :: g_high, g_low, high, low, rate_high, rate_low
      integer :: k

      at = a
      high = b
      call look_inside(self, system, rhs, guards, stepper, high, self%gc, self%rc, i)
      g_high = self%gc(i)
      rate_high = self%rc(i)
      do k = 1, digits(1.0_wp)
         low = a + 0.5_wp*(high - a)
         call look_inside(self, system, rhs, guards, stepper, low, self%gc, self%rc, i)
         g_low = self%gc(i)
         rate_low = self%rc(i)
         if (abs(g_low) <= guards%noise(i)) return
         if (g_low > 0.0_wp) then
            call find_root(self, system, rhs, guards, stepper, i, low, high, g_low, g_high, rate_low, rate_high, at)
            return
         end if
         high = low
         g_high = g_low
         rate_high = rate_low
      end do
   end subroutine find_return

   !> Whether guard i, with the value g and the rate at the start of the step, rests on its bound as far as can be told: g, g' and
   !> g'' are rounding there.
   pure function at_rest(self, system, guards, stepper, i, g, rate)
      type(event_finder_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: g, rate
      logical :: at_rest

      associate (guard => guards%entry(i))
         at_rest = of_s_alone(guards, i) .and. abs(g) <= guards%noise(i) &
                   .and. abs(rate) <= abs(guard%alpha)*guards%on_rate(guard%contact)
         if (at_rest) at_rest = abs(self%bend0(guard%contact)) <= noise_of_bend(system, guards, stepper, guard%contact)
      end associate
   end function at_rest

   !> Rounding of s'' of contact j at the start of the step.
   pure function noise_of_bend(system, guards, stepper, j) result(noise)
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp) :: noise

      noise = 16*eps*guards%reach(j)*norm2(stepper%dz_start(system%m + 1:))
   end function noise_of_bend

   !> Whether guard i falls at the start of the step: with its rate, or from rest with its second derivative. The rate of dense
   !> output there is not that of the motion to the last bit.
   pure function falls(self, system, guards, stepper, i)
      type(event_finder_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      logical :: falls

      associate (guard => guards%entry(i))
         falls = self%rate0(i) < 0.0_wp
         if (.not. of_s_alone(guards, i)) return
         if (abs(self%rate0(i)) > abs(guard%alpha)*guards%on_rate(guard%contact)) return
         falls = guard%side*guard%alpha*self%bend0(guard%contact) &
                 < -abs(guard%alpha)*noise_of_bend(system, guards, stepper, guard%contact)
      end associate
   end function falls

   !> Mark the guard that is left first, at `theta`, and all others that are left there to rounding of the time.
   subroutine gather(self, system, rhs, guards, stepper, theta, hit)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(right_hand_side_t), intent(inout) :: rhs
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: theta
      logical, intent(inout) :: hit(:)

      integer :: i

      call look_inside(self, system, rhs, guards, stepper, theta, self%gc, self%rc)
      do i = 1, guards%count
         if (theta > 0.0_wp) then
            hit(i) = self%suspect(i) .and. self%rc(i) < 0.0_wp .and. self%gc(i) <= guards%noise(i) - 8*eps*theta*self%h*self%rc(i)
            ! What rests on its bound to rounding is not left because something else is.
            if (of_s_alone(guards, i) .and. self%gc(i) >= -guards%noise(i)) then
               hit(i) = hit(i) .and. -self%rc(i) > abs(guards%entry(i)%alpha)*guards%on_rate(guards%entry(i)%contact)
            end if
         else
            hit(i) = self%suspect(i) .and. self%g0(i) <= guards%noise(i) .and. falls(self, system, guards, stepper, i)
         end if
      end do
      hit(self%first) = .true.
   end subroutine gather

   !> Count the guards that turned nearer to their bounds than the tolerance lets them be known, and those that are left but would
   !> have turned as near beyond. What starts on its bound, or rests there to rounding, does not count.
   pure subroutine count_misses(self, system, guards, z, relative, absolute, hit)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: z(:), relative, absolute
      logical, intent(in) :: hit(:)

      real(wp) :: bend, known, miss
      integer :: i

      do i = 1, guards%count
         miss = self%nearest(i)
         if (hit(i)) then
            bend = (self%rate1(i) - self%rate0(i))/self%h
            miss = huge(1.0_wp)
            if (bend > 0.0_wp .and. self%g0(i) > guards%noise(i)) miss = 0.5_wp*self%rc(i)**2/bend
         end if
         if (.not. miss < huge(1.0_wp) .or. max(abs(self%g0(i)), abs(self%g1(i))) <= guards%noise(i)) cycle
         associate (guard => guards%entry(i), w => system%w(:, guards%entry(i)%contact), m => system%m)
            known = abs(guard%alpha)*dot_product(abs(w), absolute + relative*abs(z(:m))) &
                    + abs(guard%beta)*dot_product(abs(w), absolute + relative*abs(z(m + 1:))) + guards%noise(i)
         end associate
         if (miss < known) self%near_misses = self%near_misses + 1
      end do
   end subroutine count_misses

   !> Take out of z, at the end of a step in which `find` has found nothing, the rounding of contacts that rest on a bound of s:
   !> where neither s nor s' can be told from rest they are set to it. Left alone, rounding would drift over the bound and back.
   subroutine keep_at_rest(self, system, guards, z)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      real(wp), intent(inout) :: z(:)

      real(wp) :: length
      integer :: i, m

      m = system%m
      do i = 1, guards%count
         if (abs(self%g1(i)) > guards%noise(i) .or. .not. of_s_alone(guards, i)) cycle
         associate (guard => guards%entry(i), w => system%w(:, guards%entry(i)%contact))
            if (.not. guards%reach(guard%contact) > 0.0_wp) cycle
            if (abs(self%rate1(i)) > abs(guard%alpha)*guards%on_rate(guard%contact)) cycle
            length = guard%side*guard%alpha*sum(w**2)
            z(:m) = z(:m) - w*(self%g1(i)/length)
            z(m + 1:) = z(m + 1:) - w*(self%rate1(i)/length)
            self%g1(i) = 0.0_wp
            self%rate1(i) = 0.0_wp
         end associate
      end do
   end subroutine keep_at_rest

end module razy_runge_kutta_event_finder
