!! Where in a step the first guard of the mode is left, on the step's dense output.
!!
!! *Screening by the ends.* A guard whose path touches 0 is at least g0 + g1 long; its speed is at most that at the ends and
!! what twice their accelerations add in half the step. A guard that rises or falls all the way is told by its ends. Functions
!! of the rate and forces are trusted only if twice the room of a cubic's control points is left. An excitation that the
!! guards feel and the motion does not (of a gap in free flight, of a force that holds what sticks) does not limit the step:
!! of a step in which it turns by more than `screened_angle` the ends say nothing.
!!
!! *Localisation.* Otherwise the step is divided by `least_probes` or more points, so that none is longer than half a radian of the
!! fastest excitation that guards feel; at each the guards and their rates are formed (razy_runge_kutta_guards_inside). A guard that
!! is negative at a point was left before it; one that falls at a point and rises at the next has a minimum in between, which is
!! found and judged.
!!
!! *Nearest miss.* A guard that turned without having been left missed its bound by so much; in units of the error that the
!! tolerance allows in it, a miss below 1 is counted: there may have been two events more.
module razy_runge_kutta_event_finder
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_guards, only: guards_t, of_force
   use razy_hybrid_system, only: system_t
   use razy_runge_kutta_guards_inside, only: guards_inside_t, of_s_alone, sight_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: event_finder_t, monotone_sign

   type :: event_finder_t
      !> Misses below the error that the tolerance allows.
      integer(i8) :: near_misses = 0
      !> Whether there is an event in the step, at which part of it, and the guard that is left first.
      logical :: found = .false.
      real(wp) :: theta = 1.0_wp
      integer :: first = 0
      !> Guards to look at inside the step, and those of them that fall all the way through it.
      logical, allocatable, private :: suspect(:), falling(:)
      !> Guards at the start and the end of a step, and at the event in it.
      type(sight_t), allocatable, private :: start(:), stop(:), event(:)
      !> Where a guard that fell has turned in the step, the least |g| there, at least half of it; huge where it has not.
      real(wp), allocatable, private :: nearest(:)
   contains
      procedure :: make_room
      procedure :: begin
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

contains

   !> Make room for as many guards as a system can have.
   subroutine make_room(self, most)
      class(event_finder_t), intent(out) :: self
      integer, intent(in) :: most

      allocate (self%start(most), self%event(most), self%nearest(most), self%suspect(most), self%falling(most))
      allocate (self%stop(most), source=sight_t(theta=1.0_wp))
   end subroutine make_room

   !> The mode, whose guards have been listed, begins at z with the slope dz: it is as if a step had ended there.
   subroutine begin(self, system, dynamics, guards, z, dz)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      real(wp), intent(in) :: z(:), dz(:)

      call guards%measure(system, 0.0_wp, z, .false., dynamics%excitation%now())
      call look_at_end(self, system, dynamics, guards, 0.0_wp, z, dz)
   end subroutine begin

   !> Look at the guards at the end `tau` of a step, where z has the slope dz.
   subroutine look_at_end(self, system, dynamics, guards, tau, z, dz)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      real(wp), intent(in) :: tau, z(:), dz(:)

      real(wp) :: bend(size(system%gap))
      integer :: i, j

      associate (stop => self%stop(:guards%count))
         call guards%look(system, dynamics, tau, z, stop%g, stop%rate)
      end associate
      do j = 1, size(bend)
         bend(j) = dynamics%second_rate(system, j, dz(system%m + 1:))
      end do
      do i = 1, guards%count
         associate (guard => guards%entry(i))
            self%stop(i)%bend = guard%side*guard%alpha*bend(guard%contact)
         end associate
      end do
   end subroutine look_at_end

   !> Go on to the next step of the mode, after nothing was found.
   pure subroutine advance(self, guards)
      class(event_finder_t), intent(inout) :: self
      type(guards_t), intent(in) :: guards

      associate (n => guards%count)
         self%start(:n) = self%stop(:n)
         self%start(:n)%theta = 0.0_wp
      end associate
   end subroutine advance

   !> The time, s after the start of the step, at which the parabolas of the guards of s alone that fall there reach 0 first;
   !> at most `longest`.
   pure function expected(self, guards, longest) result(h)
      class(event_finder_t), intent(in) :: self
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: longest
      real(wp) :: h

      real(wp) :: root
      integer :: i

      h = longest
      do i = 1, guards%count
         associate (start => self%start(i))
            if (.not. of_s_alone(guards, i) .or. start%g <= guards%noise(i) .or. start%rate >= 0.0_wp) cycle
            root = start%rate**2 - 2*start%g*start%bend
            if (root < 0.0_wp) cycle
            root = sqrt(root) - start%rate
            if (2*start%g < h*root) h = 2*start%g/root
         end associate
      end do
   end function expected

   !> Look for the first event in the accepted step of the stepper. If one is `found`, the step has its dense output, and `hit` are
   !> the guards that are left there together.
   subroutine find(self, system, guards, stepper, hit)
      class(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(inout) :: guards
      type(stepper_t), intent(inout) :: stepper
      logical, intent(inout) :: hit(:)

      self%found = .false.
      self%theta = 1.0_wp
      hit = .false.
      if (guards%count == 0) return
      self%nearest(:guards%count) = huge(1.0_wp)
      guards%delta = 1.0e-5_wp*stepper%h/max(1.0_wp, guards%fastest*stepper%h)
      call look_at_end(self, system, stepper%rhs%dynamics, guards, stepper%h, stepper%z_end, stepper%dz_end)
      call choose_suspects(self, guards, stepper%h)
      if (any(self%suspect(:guards%count))) call search(self, system, guards, stepper, hit)
      call count_misses(self, system, guards, stepper, hit)
   end subroutine find

   !> The guards that could be left in a step h, at whose end they have just been looked at, and those that fall all the way
   !> and have no more than one root.
   pure subroutine choose_suspects(self, guards, h)
      type(event_finder_t), intent(inout) :: self
      type(guards_t), intent(in) :: guards
      real(wp), intent(in) :: h

      type(sight_t) :: a, b
      real(wp) :: b0, b1, noise, room
      integer :: i, way
      logical :: near

      if (guards%fastest*h > screened_angle) then
         self%suspect(:guards%count) = .true.
         self%falling(:guards%count) = .false.
         return
      end if
      do i = 1, guards%count
         a = self%start(i)
         b = self%stop(i)
         if (of_s_alone(guards, i)) then
            noise = guards%noise(i)
            near = min(a%g, b%g) <= noise .or. a%g + b%g <= h*(max(abs(a%rate), abs(b%rate)) + h*max(abs(a%bend), abs(b%bend)))
            way = monotone_sign(h, a%rate, b%rate, a%bend, b%bend)
            ! Of one that goes one way only its values at the ends tell.
            if (b%g > noise .and. way < 0) near = .false.
            if (b%g > noise .and. way > 0) near = a%g < -noise
            self%suspect(i) = near
            self%falling(i) = a%g > noise .and. way < 0
         else
            b0 = a%g + h*a%rate/3
            b1 = b%g - h*b%rate/3
            room = 2*max(abs(b0 - a%g), abs(b1 - b%g), abs(b%g - a%g))
            self%suspect(i) = min(a%g, b0, b1, b%g) <= room
            self%falling(i) = .false.
         end if
      end do
   end subroutine choose_suspects

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
      way = merge(1, merge(-1, 0, highest < -room), lowest > room)
   end function monotone_sign

   !> Look for the first event among the suspects (find).
   subroutine search(self, system, guards, stepper, hit)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in), target :: system
      type(guards_t), intent(inout), target :: guards
      type(stepper_t), intent(inout), target :: stepper
      logical, intent(inout) :: hit(:)

      type(guards_inside_t) :: inside
      type(sight_t), dimension(guards%count) :: a, b
      integer :: i, k, probes

      associate (n => guards%count, suspect => self%suspect(:guards%count))
         call guards%measure(system, stepper%h, stepper%z_end, .false., stepper%rhs%dynamics%excitation%now())
         call stepper%prepare_dense(system)
         call inside%begin(system, guards, stepper, suspect)
         probes = 1
         if (any(suspect .and. .not. self%falling(:n))) probes = max(least_probes, ceiling(guards%fastest*stepper%h/probed_angle))
         a = self%start(:n)
         do k = 1, probes
            if (k < probes) then
               call inside%look(real(k, wp)/probes, b)
            else
               b = self%stop(:n)
            end if
            do i = 1, n
               if (suspect(i)) call search_between(self, inside, i, a(i), b(i))
            end do
            if (self%found) exit
            a = b
         end do
      end associate
      if (self%found) call gather(self, inside, hit)
   end subroutine search

   !> See whether guard i is left between the probes a and b, before what has been found so far.
   subroutine search_between(self, inside, i, a, b)
      type(event_finder_t), intent(inout) :: self
      type(guards_inside_t), intent(in) :: inside
      integer, intent(in) :: i
      type(sight_t), intent(in) :: a, b

      type(sight_t) :: turn
      real(wp) :: at, lowest
      logical :: left

      left = .false.
      at = a%theta
      associate (noise => inside%guards%noise(i))
         if (b%g < -noise) then
            left = .true.
            if (a%g > noise) then
               at = inside%find_root(i, a, b)
            else if (a%g < -noise .and. inside%guards%entry(i)%function == of_force) then
               ! A force that begins beyond its bound has left it.
               at = a%theta
            else if (still(inside%guards, i, a%rate) .and. abs(a%g) <= noise &
                     .and. abs(self%start(i)%bend) <= noise_of_bend(inside, i)) then
               ! It rests on its bound as far as can be told.
               at = inside%find_emergence(i, a, b)
            else if (a%rate > 0.0_wp) then
               ! It starts on the bound and leads away from it before it comes back, if by no more than rounding.
               turn = inside%find_turn(i, a, b)
               at = turn%theta
               if (turn%g > noise) at = inside%find_root(i, turn, b)
            else
               at = inside%find_return(i, a, b)
               ! It is drawn away from its bound, by less than can be told before it comes back.
               if (.not. at > a%theta .and. still(inside%guards, i, a%rate) .and. &
                   self%start(i)%bend > noise_of_bend(inside, i)) at = inside%find_emergence(i, a, b)
            end if
         else if (a%rate < 0.0_wp .and. b%rate > 0.0_wp) then
            ! A convex function is nowhere below the tangents at both ends.
            lowest = a%g + a%rate*((b%g - a%g - b%rate*(b%theta - a%theta)*inside%stepper%h)/(a%rate - b%rate))
            if (lowest > 0.5_wp*min(a%g, b%g) .and. min(a%g, b%g) > noise) then
               self%nearest(i) = min(self%nearest(i), lowest)
               return
            end if
            turn = inside%find_turn(i, a, b)
            self%nearest(i) = min(self%nearest(i), abs(turn%g))
            left = turn%g < -noise
            if (left .and. a%g > noise) at = inside%find_root(i, a, turn)
         end if
      end associate
      if (.not. left) return
      if (self%found .and. .not. at < self%theta) return
      self%found = .true.
      self%theta = at
      self%first = i
   end subroutine search_between

   !> Whether `rate` is rounding, of a guard i that is a function of s alone or of a force, whose rate is a difference over `delta`.
   pure function rests(guards, i, rate)
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: rate
      logical :: rests

      rests = still(guards, i, rate)
      if (guards%entry(i)%function == of_force) rests = abs(rate)*guards%delta <= guards%noise(i)
   end function rests

   !> Whether `rate` is rounding, of a guard i that is a function of s alone.
   pure function still(guards, i, rate)
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: rate
      logical :: still

      still = of_s_alone(guards, i) .and. abs(rate) <= abs(guards%entry(i)%alpha)*guards%on_rate(guards%entry(i)%contact)
   end function still

   !> Rounding of the second derivative of a guard i that is a function of s alone, at the start of the step.
   pure function noise_of_bend(inside, i) result(noise)
      type(guards_inside_t), intent(in) :: inside
      integer, intent(in) :: i
      real(wp) :: noise

      associate (guard => inside%guards%entry(i), a => inside%stepper%dz_start(inside%system%m + 1:))
         noise = abs(guard%alpha)*(16*eps*inside%guards%reach(guard%contact)*norm2(a))
      end associate
   end function noise_of_bend

   !> Mark the guard that is left first and all others that are left there to rounding of the time.
   subroutine gather(self, inside, hit)
      type(event_finder_t), intent(inout) :: self
      type(guards_inside_t), intent(in) :: inside
      logical, intent(inout) :: hit(:)

      real(wp) :: known
      integer :: i
      logical :: falls

      call inside%look(self%theta, self%event(:inside%guards%count))
      do i = 1, inside%guards%count
         associate (start => self%start(i), event => self%event(i), noise => inside%guards%noise(i))
            if (self%theta > 0.0_wp) then
               known = noise
               ! Impacts nearer in time than the error of the gap (as of near misses) over its speed cannot be told apart.
               if (closes(inside, self%first) .and. closes(inside, i)) known = &
                  noise + tolerated(inside%system, inside%guards, inside%stepper, i, real(inside%stepper%accepted_steps, wp))
               hit(i) = event%rate < 0.0_wp .and. event%g <= known - 8*eps*self%theta*inside%stepper%h*event%rate
               ! What rests on its bound to rounding is not left because something else is.
               if (rests(inside%guards, i, event%rate) .and. event%g >= -noise) hit(i) = .false.
            else
               ! The rate of dense output at the start is not that of the motion to the last bit.
               falls = start%rate < 0.0_wp
               if (rests(inside%guards, i, start%rate)) falls = start%bend < -noise_of_bend(inside, i)
               hit(i) = start%g <= noise .and. falls
            end if
            hit(i) = hit(i) .and. self%suspect(i)
         end associate
      end do
      hit(self%first) = .true.
   end subroutine gather

   !> Whether guard i is the gap of an open rigid side.
   pure function closes(inside, i)
      type(guards_inside_t), intent(in) :: inside
      integer, intent(in) :: i
      logical :: closes

      associate (j => inside%guards%entry(i)%contact)
         closes = inside%system%machine%contact(j)%law%impacts .and. of_s_alone(inside%guards, i) &
                  .and. inside%stepper%rhs%dynamics%mode%branch(j) == branch_open
      end associate
   end function closes

   !> The error of guard i after `steps` steps, each with the error that the tolerance allows.
   pure function tolerated(system, guards, stepper, i, steps) result(error)
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: i
      real(wp), intent(in) :: steps
      real(wp) :: error

      associate (guard => guards%entry(i), w => stepper%rhs%dynamics%w(:, guards%entry(i)%contact), z => stepper%z_start, &
                 m => system%m)
         error = steps*(abs(guard%alpha)*dot_product(abs(w), stepper%absolute + stepper%relative*abs(z(:m))) &
                        + abs(guard%beta)*dot_product(abs(w), stepper%absolute + stepper%relative*abs(z(m + 1:2*m))))
      end associate
   end function tolerated

   !> Count the guards that turned nearer to their bounds than the tolerance lets them be known, and those that are left but would
   !> have turned as near beyond. What starts on its bound, or rests there to rounding, does not count.
   pure subroutine count_misses(self, system, guards, stepper, hit)
      type(event_finder_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      type(stepper_t), intent(in) :: stepper
      logical, intent(in) :: hit(:)

      real(wp) :: bend, known, miss
      integer :: i

      ! After n steps errors are up to n times what the tolerance allows in one.
      do i = 1, guards%count
         miss = self%nearest(i)
         if (hit(i)) then
            bend = (self%stop(i)%rate - self%start(i)%rate)/stepper%h
            miss = huge(1.0_wp)
            if (bend > 0.0_wp .and. self%start(i)%g > guards%noise(i)) miss = 0.5_wp*self%event(i)%rate**2/bend
         end if
         if (.not. miss < huge(1.0_wp) .or. max(abs(self%start(i)%g), abs(self%stop(i)%g)) <= guards%noise(i)) cycle
         ! A slider comes to rest on the bound that it slid at.
         if (system%machine%contact(guards%entry(i)%contact)%law%remembers .and. abs(self%start(i)%g) <= guards%noise(i)) cycle
         known = tolerated(system, guards, stepper, i, real(stepper%accepted_steps, wp)) + guards%noise(i)
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
      integer :: i

      do i = 1, guards%count
         associate (guard => guards%entry(i), w => system%w(:, guards%entry(i)%contact), stop => self%stop(i), m => system%m)
            if (abs(stop%g) > guards%noise(i) .or. .not. still(guards, i, stop%rate)) cycle
            if (.not. guards%reach(guard%contact) > 0.0_wp .or. allocated(system%frame(guard%contact)%across)) cycle
            length = guard%side*guard%alpha*sum(w**2)
            z(:m) = z(:m) - w*(stop%g/length)
            z(m + 1:) = z(m + 1:) - w*(stop%rate/length)
            stop%g = 0.0_wp
            stop%rate = 0.0_wp
         end associate
      end do
   end subroutine keep_at_rest

end module razy_runge_kutta_event_finder
