!! The first time at which one of several functions leaves its bounds, with proof that none left before.
!!
!! A watched function is f = side*(d^q/dt^q form - bound), to stay >= 0. On a step of the closed form it is proved to stay,
!! or to have exactly one root, or the step is halved. Values and slopes at the ends and bounds of higher derivatives from
!! the moduli of the amplitudes suffice (razy_exact_search_sign_proof), in this order:
!! 1. f stays positive;
!! 2. f is monotone: one root if the sign changes, else none;
!! 3. f is convex or concave: one root if the sign changes; else the sign of its only extremum decides (grazing).
!! Crossings smaller than the rounding of f itself do not count as such.
module razy_exact_search_search
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, copy, move_to, reserve, step, tabulate
   use razy_exact_closed_form_response, only: coarsest_level, finest_level, many, response_t
   use razy_exact_closed_form_rows, only: rows_t, size_of, value_and_slope, value_of
   use razy_exact_search_fourth_derivative, only: fourth_derivative
   use razy_exact_search_on_bound, only: sort_on_bound
   use razy_exact_search_refine, only: refine_root, sharpen, watched_t
   use razy_exact_search_screening, only: screen, find_safe
   use razy_exact_search_sign_proof, only: proved_curvature, proved_margin, proved_monotone
   use razy_linalg_blocks, only: moduli_of, sum_of
   use razy_motion_integrator, only: budget_t, status_ok, status_step_underflow
   implicit none(type, external)
   private

   public :: exit_t, first_exit, leaves_too, rounding, search_t, soon

   !> Where the search ended: `watched` is the number of the function that left, 0 if none did before the end.
   type :: exit_t
      integer :: watched = 0
      real(wp) :: tau = 0.0_wp
   end type exit_t

   !> Workspace and counters of the search.
   type :: search_t
      !> Two ends of a step, of which `now` is the present one; a root; the root that is found. Allocatable: of components of one
      !> type below a polymorphic object gfortran 12 frees only the first.
      type(amplitudes_t), allocatable, private :: point(:), trial_root
      type(amplitudes_t), allocatable :: probe
      integer, private :: now = 1
      !> Amplitudes and dense states there is room for.
      integer, private :: room(2) = -1
      !> Moduli of the amplitudes at the last exact evaluation.
      real(wp), allocatable, private :: modulus(:)
      !> Steps are 2^-level s; so many functions left on the last one, or turned on their bounds to rounding; steps since the last
      !> exact evaluation.
      integer :: level = 10, leaving = 0, turning = 0
      integer, private :: since_resync = 0
      !> Steps tried; functions that turned on their bounds to rounding.
      integer(i8) :: steps = 0, near_misses = 0
   end type search_t

   !> What is smaller than this part of the terms it is the sum of is rounding.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
   !> Steps between exact evaluations of the amplitudes.
   integer, parameter :: resync = 32
   !> What a function does on a step: stays inside its bounds, leaves them, or cannot be told.
   integer, parameter :: stays = 0, leaves = 1, undecided = 2
   !> Times the fastest exponent, a step on which a change of third order is below rounding: its ends decide.
   real(wp), parameter :: shortest = 1.0e-6_wp
   !> Times the fastest exponent, flights within which Simpson's rule, and Gauss's of five places, are better than the difference of
   !> values.
   real(wp), parameter :: soon = 2.0e-3_wp, early = 0.5_wp
   !> A fall within one step of so many times the rounding of the value is a fall.
   real(wp), parameter :: clearly = 16.0_wp
   !> A rate so many times its rounding has a sign, whatever the state's own rounding is.
   real(wp), parameter :: firmly = 1.0e3_wp
   !> What has come to such a part of the size that its terms had does not drown in the rounding of that.
   real(wp), parameter :: good_part = 0.1_wp

contains

   !> Search from `start` at `tau_from` to `tau_end` along `response`.
   !>
   !> `watched(:)`: functions on `rows`; one with `from_zero` starts on its bound and moves inwards; if it alone is watched, from a
   !> later time than 0, that is the root on this closed form which was found last, and all but its side is as that search has left
   !> it. The exit is in `found`, the amplitudes there in `self%probe`. The search ends without one when the budget is spent, or
   !> steps would be too short.
   subroutine first_exit(self, budget, response, rows, start, tau_from, tau_end, watched, found)
      type(search_t), intent(inout) :: self
      type(budget_t), intent(inout) :: budget
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: start
      real(wp), intent(in) :: tau_from, tau_end
      type(watched_t), contiguous, intent(inout) :: watched(:)
      type(exit_t), intent(out) :: found

      integer :: i, leaves
      logical :: decided, roomy, on

      on = .false.
      if (tau_from > 0.0_wp) on = watched(1)%from_zero .and. watched(1)%f1 < -good_part*watched(1)%scale
      if (on) then
         ! On the step with the last root, at whose end it is beyond, there is no other.
         watched%f1 = -watched%f1
         watched%g1 = -watched%g1
         call accept(self, response, rows, start, tau_end, watched, .false.)
      else
         call prepare(self, response, rows, start, tau_from, tau_end, watched, leaves)
         do i = 1, size(watched)
            if (watched(i)%idle) cycle
            if (watched(i)%from_zero) then
               watched(i)%f0 = 0.0_wp
               watched(i)%g0 = max(watched(i)%g0, 0.0_wp)
            end if
            if (i == leaves .or. watched(i)%f0 < -watched(i)%noise) then
               found = exit_t(i, tau_from)
               call copy(self%point(self%now), response, self%probe)
               return
            end if
            watched(i)%f0 = max(watched(i)%f0, 0.0_wp)
         end do
      end if
      do while (self%point(self%now)%tau < tau_end)
         call budget%spend()
         if (self%level > finest_level) budget%status = status_step_underflow
         if (budget%status /= status_ok) then
            found = exit_t(0, self%point(self%now)%tau)
            return
         end if
         if (self%since_resync == 0) then
            if (stay_forever(self, response, rows, watched)) exit
         end if
         call try_step(self, response, rows, watched, found, decided, roomy)
         if (.not. decided) cycle
         if (found%watched /= 0) then
            if (found%tau > tau_end) exit
            if (found%tau*response%fastest <= early) then
               call sharpen(response, rows, start, watched(found%watched), found%tau, self%probe)
            end if
            return
         end if
         call accept(self, response, rows, start, tau_end, watched, roomy)
         ! A step below the rounding of the time leads nowhere.
         if (.not. self%point(self%now)%tau > self%point(3 - self%now)%tau) budget%status = status_step_underflow
      end do
      found = exit_t(0, tau_end)
   end subroutine first_exit

   !> Judge all functions on one step; the earliest exit on it, if any, goes to `found`. Undecided: the next is half as long.
   subroutine try_step(self, response, rows, watched, found, decided, roomy)
      type(search_t), intent(inout) :: self
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), contiguous, intent(inout) :: watched(:)
      type(exit_t), intent(out) :: found
      logical, intent(out) :: decided, roomy

      real(wp) :: f, g, h, high, root
      integer :: i, verdict
      logical :: room

      call step(self%point(self%now), response, self%level, self%point(3 - self%now))
      h = response%step_length(self%level)
      self%steps = self%steps + 1
      self%leaving = 0
      self%turning = 0
      roomy = .true.
      verdict = stays
      if (response%terms >= many) call screen(response, rows, self%point(self%now), self%point(3 - self%now)%tau, watched)
      do i = 1, size(watched)
         if (.not. watched(i)%given) then
            call value_and_slope(rows, response, self%point(3 - self%now), watched(i)%form, watched(i)%order, f, g)
         end if
         if (watched(i)%idle) cycle
         call judge(self, response, rows, watched(i), f, g, h, verdict, high, room)
         roomy = roomy .and. room
         if (verdict == undecided) exit
         if (verdict == stays) cycle
         self%leaving = self%leaving + 1
         if (found%watched == 0) then
            call refine_root(response, rows, self%point(self%now), self%level, high, watched(i), self%probe, root)
            found = exit_t(i, root)
         else if (.not. leaves_later(self, response, rows, watched(i), found%tau, high)) then
            call refine_root(response, rows, self%point(self%now), self%level, high, watched(i), self%trial_root, root)
            if (root >= found%tau) cycle
            found = exit_t(i, root)
            call copy(self%trial_root, response, self%probe)
         end if
      end do
      decided = verdict /= undecided
      if (decided) self%near_misses = self%near_misses + self%turning
      if (decided) return
      found = exit_t()
      self%level = self%level + 1
   end subroutine try_step

   !> Whether a function that has one root until `high`, s after the present point, is not yet clearly beyond its bound at the exit
   !> that was found, at the time `tau` of the segment. What leaves with another, as on both sides of a symmetric machine, is not
   !> refined once more.
   pure logical function leaves_later(self, response, rows, w, tau, high)
      type(search_t), intent(in) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w
      real(wp), intent(in) :: tau, high

      leaves_later = tau - self%point(self%now)%tau <= high
      if (leaves_later) leaves_later = w%side*(value_of(rows, response, self%probe, w%form, w%order) - w%bound) &
                                       >= -noise_in(self, response, rows, w)
   end function leaves_later

   !> Whether a function that is beyond its bound after the step (f1 < 0) is on it at the exit that was found, and firmly on its way
   !> outwards: it leaves there, too, if the other changes neither its value nor its slope.
   pure logical function leaves_too(self, response, rows, w)
      type(search_t), intent(in) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w

      real(wp) :: f, g, noise

      leaves_too = w%order == 0 .and. .not. w%idle
      if (.not. leaves_too) return
      call value_and_slope(rows, response, self%probe, w%form, w%order, f, g)
      noise = noise_in(self, response, rows, w)
      leaves_too = abs(f - w%bound) <= noise .and. w%side*g < -firmly*noise*response%fastest
   end function leaves_too

   !> What is rounding in the value of a function: that of its own terms, and what the amplitudes give to the state it is formed of.
   pure real(wp) function noise_in(self, response, rows, w)
      type(search_t), intent(in) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w

      noise_in = w%noise
      if (w%order == 0) noise_in = max(noise_in, rounding*(sum_of(response%amplitudes, rows%reach(:, w%form), self%modulus) &
                                                           + rows%reach_constant(w%form) + abs(rows%constant(w%form))))
   end function noise_in

   !> What a function does on a step of h = 2^-level s from the present point, at whose end its form has the value `f` and the slope
   !> `g`; `high` (s after the point) ends the bracket of a root, `room` says that twice the step may do.
   subroutine judge(self, response, rows, w, f, g, h, verdict, high, room)
      type(search_t), intent(inout) :: self
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(inout) :: w
      real(wp), intent(in) :: f, g, h
      integer, intent(out) :: verdict
      real(wp), intent(out) :: high
      logical, intent(out) :: room

      real(wp) :: change, margin, m4, d0, d1, noise
      integer :: curvature

      high = h
      w%f1 = w%side*(f - w%bound)
      w%g1 = w%side*g
      noise = w%noise + w%slip*(self%point(self%now)%tau - w%since + h)
      ! What drives terms that are small themselves comes with its own rounding.
      if (response%driven%count > 0) noise = noise + rounding*rows%forced_reach(w%order + 1, w%form) &
                                             *((self%point(self%now)%tau - w%since) + h)
      ! Rounding below zero is no crossing, unless the function is on its way: put off to the next step, the crossings of a body
      ! that hops ever lower would be late by a part of the hop.
      if (abs(w%f1) <= noise .and. .not. -w%g1*h > clearly*noise) w%f1 = max(w%f1, 0.0_wp)
      m4 = w%m4
      if (.not. response%bounded) m4 = fourth_derivative(self%point(self%now), response, rows, w, h)
      margin = proved_margin(w%f0, w%g0, w%f1, w%g1, h, m4)
      room = .false.
      verdict = stays
      if (w%f1 >= 0.0_wp .and. margin >= 0.0_wp) then
         ! Twice the step has sixteen times the error, and a smaller margin; what rests on its bound has neither.
         room = margin >= m4*h**4*(40.0_wp/144)
         return
      end if
      if (w%f1 < 0.0_wp) verdict = leaves
      if (self%level >= finest_level) return
      ! What changes by no more than its rounding is told by its ends; a parabola on its bound would be halved without end.
      change = h*(abs(w%g0) + abs(w%g1)) + m4*h**4
      if (change <= noise) then
         room = verdict == stays .and. 16*change <= noise
         return
      end if
      if (verdict == leaves .and. w%g0 > 0.0_wp .and. .not. w%f0 > 0.0_wp) then
         ! From zero up and below zero again: half the step separates the root at its start from the one to be found.
         verdict = undecided
         return
      end if
      ! Free flight, a parabola, has no time of its own.
      if (response%fastest > 0.0_wp .and. h*response%fastest <= shortest) return
      if (proved_monotone(w%f0, w%g0, w%f1, w%g1, h, m4, noise)) return
      call proved_curvature(w%f0, w%g0, w%f1, w%g1, h, m4, noise, d0, d1, curvature)
      if (curvature == 0) then
         verdict = undecided
      else if (verdict == stays .and. curvature > 0 .and. w%g0 < 0.0_wp .and. w%g1 > 0.0_wp) then
         call judge_minimum(self, response, rows, w, d0, d1, h, verdict, high)
      end if
   end subroutine judge

   !> A convex function that is positive at both ends: the sign of its minimum decides, and ends the bracket of the first root.
   subroutine judge_minimum(self, response, rows, w, d0, d1, h, verdict, high)
      type(search_t), intent(inout) :: self
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), intent(in) :: w
      real(wp), intent(in) :: d0, d1, h
      integer, intent(out) :: verdict
      real(wp), intent(inout) :: high

      type(watched_t) :: slope
      real(wp) :: lowest, tau

      slope = watched_t(form=w%form, order=w%order + 1, side=-w%side, f0=-w%g0, g0=-d0, f1=-w%g1, g1=-d1, &
                        scale=w%scale*response%fastest)
      call refine_root(response, rows, self%point(self%now), self%level, h, slope, self%trial_root, tau)
      lowest = w%side*(value_of(rows, response, self%trial_root, w%form, w%order) - w%bound)
      if (abs(lowest) <= noise_in(self, response, rows, w)) self%turning = self%turning + 1
      verdict = stays
      if (lowest >= -w%noise) return
      verdict = leaves
      high = tau - self%point(self%now)%tau
   end subroutine judge_minimum

   !> Whether constant parts outweigh all that varies, so that no function can leave as long as this response lasts.
   pure function stay_forever(self, response, rows, watched) result(proved)
      type(search_t), intent(in) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), contiguous, intent(in) :: watched(:)
      logical :: proved

      integer :: i

      proved = response%bounded .and. response%rigid == 0
      if (.not. proved) return
      do i = 1, size(watched)
         if (watched(i)%idle .and. .not. watched(i)%stale) cycle
         associate (w => watched(i))
            proved = w%order == 0
            if (proved) proved = w%side*(rows%constant(w%form) - w%bound) &
                                 > sum_of(response%filled, rows%moduli(:, 0, w%form), self%modulus) + w%noise
         end associate
         if (.not. proved) return
      end do
   end function stay_forever

   !> Make the trial the present point; a step with room to spare is followed by a longer one, on which nothing grows by more
   !> than a factor e.
   subroutine accept(self, response, rows, start, tau_end, watched, roomy)
      type(search_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: start
      real(wp), intent(in) :: tau_end
      type(watched_t), contiguous, intent(inout) :: watched(:)
      logical, intent(in) :: roomy

      self%now = 3 - self%now
      watched%f0 = watched%f1
      watched%g0 = watched%g1
      if (roomy) self%level = max(self%level - 1, coarsest_level)
      if (response%growing) self%level = max(self%level, exponent(maxval(real(response%exponent))))
      if (self%point(self%now)%tau >= tau_end) return
      self%since_resync = modulo(self%since_resync + 1, resync)
      if (self%since_resync == 0 .or. response%growing) call resynchronise(self, response, rows, start, watched)
   end subroutine accept

   !> The first point, and what starts on its bound: `leaves`, a function that leaves at once, or 0.
   subroutine prepare(self, response, rows, start, tau_from, tau_end, watched, leaves)
      type(search_t), intent(inout) :: self
      type(response_t), intent(inout) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: start
      real(wp), intent(in) :: tau_from, tau_end
      type(watched_t), contiguous, intent(inout) :: watched(:)
      integer, intent(out) :: leaves

      if (self%room(1) < response%length .or. self%room(2) < response%nx) call make_room(self, response)
      if (.not. tau_from > 0.0_wp) then
         call copy(start, response, self%point(self%now))
      else if (watched(1)%from_zero .and. .not. abs(self%probe%tau - tau_from) > 0.0_wp) then
         ! The root that was found last.
         call copy(self%probe, response, self%point(self%now))
      else
         call move_to(start, response, tau_from, self%point(self%now))
      end if
      call renew(self, response, rows, watched)
      self%since_resync = 0
      if (.not. response%has_step(self%level)) call tabulate(response, self%level)
      call sort_on_bound(rows, response, self%point(self%now), self%modulus, response%step_length(self%level), tau_end - tau_from, &
                         watched, leaves)
      if (response%terms >= many) watched%resting = watched%idle
   end subroutine prepare

   !> Fit the workspace to a response that is larger than those before.
   subroutine make_room(self, response)
      type(search_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      if (.not. allocated(self%point)) allocate (self%point(2), self%trial_root, self%probe)
      call reserve(self%point(1), response)
      call reserve(self%point(2), response)
      call reserve(self%trial_root, response)
      call reserve(self%probe, response)
      self%modulus = self%point(1)%x
      self%room = [size(self%point(1)%x), size(self%point(1)%dense)]
   end subroutine make_room

   !> Evaluate the present point from the start of the segment.
   subroutine resynchronise(self, response, rows, start, watched)
      type(search_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(amplitudes_t), intent(in) :: start
      type(watched_t), contiguous, intent(inout) :: watched(:)

      ! A copy, as the time is written while it is read.
      call move_to(start, response, (self%point(self%now)%tau), self%point(self%now))
      call renew(self, response, rows, watched)
      watched%f0 = max(watched%f0, 0.0_wp)
      watched%slip = 0.0_wp
   end subroutine resynchronise

   !> Moduli of the amplitudes, and value, slope, bounds and rounding of the functions at the present point.
   subroutine renew(self, response, rows, watched)
      type(search_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      type(rows_t), intent(in) :: rows
      type(watched_t), contiguous, intent(inout) :: watched(:)

      real(wp) :: f, g, m4, total
      integer :: i

      call moduli_of(response%filled, self%point(self%now)%x, self%modulus)
      do i = 1, size(watched)
         associate (w => watched(i))
            if (.not. w%shares_form) then
               call value_and_slope(rows, response, self%point(self%now), w%form, w%order, f, g)
               total = size_of(rows, response, self%point(self%now), self%modulus, w%form, w%order)
               m4 = sum_of(response%filled, rows%moduli(:, 4 + w%order, w%form), self%modulus)
               if (response%driven%count > 0) m4 = m4 + rows%forced(4 + w%order, w%form)
            end if
            w%f0 = w%side*(f - w%bound)
            w%g0 = w%side*g
            w%m4 = m4
            w%since = self%point(self%now)%tau
            w%scale = total + abs(w%bound)
            w%noise = max(rounding*w%scale, w%floor)
         end associate
      end do
      if (response%terms >= many) call find_safe(response, rows, self%point(self%now)%tau, watched)
   end subroutine renew

end module razy_exact_search_search
