!! The exact propagator: motion of a piecewise-linear machine from event to event in closed form.
!!
!! Between two changes of the contact state nothing is integrated; the next change is found with proof that none was before
!! it (razy_integrate_search). The state carries over an event unchanged, the phases of excitation are formed anew from the
!! time, which is kept in two doubles, so that errors do not grow with the number of pieces.
module razy_integrate_exact
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_integrate_contact_states, only: attach, contact_states_t, lay_out_contacts, state_index
   use razy_integrate_cursor, only: copy, cursor_t, move_to, reserve, set_state, state_of
   use razy_integrate_forms, only: curvature_bound, integral_of, size_of, value_and_slope, value_of
   use razy_integrate_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, &
                                        status_blow_up, status_chatter, status_event_limit, status_no_modes, status_ok
   use razy_integrate_refine, only: watched_t
   use razy_integrate_search, only: exit_t, first_exit, rounding, search_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: exact_t

   !> The bound of a switching function that was crossed, and the side on which the motion had been.
   type :: crossed_t
      integer :: function = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp
   end type crossed_t

   !> The propagator with what it keeps from run to run.
   type, extends(integrator_t) :: exact_t
      type(contact_states_t) :: states
      type(search_t) :: search
      !> Amplitudes at the start of the piece; the search's probe holds those at its end.
      type(cursor_t) :: start
      real(wp), allocatable :: z(:), cosine(:), sine(:)
      integer, allocatable :: branch(:)
      !> State under way, duration of its piece, s.
      integer :: now = 0
      real(wp) :: duration = 0.0_wp
      !> What observers are answered with.
      type(cursor_t) :: looker
      logical :: looked = .false.
      !> State (2m) and excitation (tones) there, once a contact has been asked for.
      logical :: laid_out = .false.
      real(wp), allocatable :: z_looked(:)
      complex(wp), allocatable :: turn(:)
      type(search_t) :: look
   contains
      procedure :: prepare
      procedure :: run
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: branch_now
      procedure :: interval
      procedure :: final_state
      procedure :: contact_sums
      procedure, private :: largest_distance
   end type exact_t

   !> Pieces are begun anew after this angle of the fastest exponent, so that its rounding stays below 1e-13.
   real(wp), parameter :: longest_angle = 1.0e3_wp
   !> A growing term grows by less than the exponential of this in a piece; a state beyond `largest` is a blow-up.
   real(wp), parameter :: longest_growth = 50.0_wp, largest = 1.0e100_wp

contains

   !> Take a machine; refused with an error if one of its laws is not piecewise linear.
   subroutine prepare(self, machine, keep_all, error)
      class(exact_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: j, m

      do j = 1, size(machine%contact)
         if (machine%contact(j)%law%piecewise_linear) cycle
         call raise(error, "the exact propagator cannot follow contact '"//machine%contact(j)%name// &
                    "', whose law is not piecewise linear")
         return
      end do
      call attach(self%states, machine, keep_all, error)
      if (allocated(error)) return
      m = self%states%coupled%m
      if (allocated(self%z)) deallocate (self%z, self%cosine, self%sine, self%branch, self%z_looked, self%turn)
      allocate (self%z_looked(2*m), self%turn(size(machine%tone)))
      allocate (self%z(2*m), self%cosine(size(machine%tone)), self%sine(size(machine%tone)), self%branch(size(machine%contact)))
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      type(piece_t) :: piece
      type(exit_t) :: found
      type(crossed_t) :: crossed
      integer :: i, standing, switched
      integer(i8) :: steps, halvings

      steps = self%search%steps
      halvings = self%search%halvings
      call begin(self)
      piece%by => self
      standing = 0
      switched = 0
      do while (piece%time < t_end)
         i = state_index(self%states, self%branch)
         if (i == 0) outcome%status = status_no_modes
         if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         if (outcome%status /= status_ok) exit
         call next_piece(self, i, switched, crossed, t_end, piece, found)
         outcome%pieces = outcome%pieces + 1
         call show_piece(observers, piece)
         call state_of(self%search%probe, self%states%state(i)%response, self%z)
         standing = merge(standing + 1, 0, found%watched > 0 .and. .not. piece%duration > 0.0_wp)
         call add_time(piece%time, piece%time_low, piece%duration)
         if (piece%last) piece%time = t_end
         switched = 0
         if (found%watched == 0) cycle
         switched = piece%contact
         crossed = crossed_t(self%states%state(i)%function(found%watched), self%states%state(i)%watched(found%watched)%side, &
                             self%states%state(i)%watched(found%watched)%bound)
         self%branch(switched) = piece%branch
         outcome%events = outcome%events + 1
         if (standing > 8*size(self%branch) + 8) outcome%status = status_chatter
         if (outcome%events >= most_events .and. piece%time < t_end) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
      end do
      outcome%time = piece%time
      outcome%steps = self%search%steps - steps
      outcome%halvings = self%search%halvings - halvings
      outcome%states = self%states%count
   end subroutine run

   !> State and branches at the time 0.
   subroutine begin(self)
      class(exact_t), intent(inout) :: self

      real(wp) :: s, rate
      integer :: j, m

      m = self%states%coupled%m
      associate (machine => self%states%machine)
         self%z(:m) = matmul(self%states%coupled%to_coupled, machine%displacement)
         self%z(m + 1:) = matmul(self%states%coupled%to_coupled, machine%velocity)
         do j = 1, size(machine%contact)
            associate (contact => machine%contact(j))
               s = dot_product(contact%w, machine%displacement) + contact%offset + sum(real(contact%error))
               rate = dot_product(contact%w, machine%velocity) - sum(self%states%omega*aimag(contact%error))
               self%branch(j) = contact%law%initial_branch(s, rate)
            end associate
         end do
      end associate
   end subroutine begin

   !> Follow state i from the time of `piece` to its end; `switched` is the contact that has just crossed the bound `crossed`,
   !> and so starts on it.
   subroutine next_piece(self, i, switched, crossed, t_end, piece, found)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: i, switched
      type(crossed_t), intent(in) :: crossed
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(exit_t), intent(out) :: found

      real(wp) :: longest, fastest
      integer :: t

      self%now = i
      self%looked = .false.
      associate (state => self%states%state(i))
         do t = 1, size(self%cosine)
            call self%states%machine%tone(t)%phasor(piece%time, piece%time_low, self%cosine(t), self%sine(t))
         end do
         call reserve(self%start, state%response)
         call set_state(self%start, state%response, self%z, self%cosine, self%sine)
         fastest = state%basis%fastest
         if (size(self%states%omega) > 0) fastest = max(fastest, maxval(self%states%omega))
         longest = (t_end - piece%time) - piece%time_low
         piece%last = longest*fastest <= longest_angle
         if (.not. piece%last) longest = longest_angle/fastest
         if (state%response%growing) then
            ! Growth is looked at again before a blow-up can pass the range of the numbers.
            longest = min(longest, longest_growth/maxval(real(state%response%exponent)))
            piece%last = piece%last .and. .not. piece%time + longest < t_end
         end if
         state%watched%from_zero = .false.
         if (switched > 0) then
            do t = 1, size(state%watched)
               state%watched(t)%from_zero = state%contact(t) == switched .and. state%function(t) == crossed%function &
                                            .and. state%watched(t)%side*crossed%side < 0.0_wp &
                                            .and. .not. abs(state%watched(t)%bound - crossed%bound) > 0.0_wp
            end do
         end if
         self%search%level = state%level
         self%search%resolution = spacing(piece%time)
         call first_exit(self%search, state%response, state%switching, self%start, 0.0_wp, longest, state%watched, found)
         state%level = self%search%level
         if (found%watched == 0) call move_to(self%start, state%response, found%tau, self%search%probe)
         piece%duration = found%tau
         self%duration = found%tau
         piece%last = piece%last .and. found%watched == 0
         piece%contact = 0
         if (found%watched == 0) return
         piece%contact = state%contact(found%watched)
         piece%branch = state%next(found%watched)
      end associate
   end subroutine next_piece

   !> Amplitudes at `tau` into `self%looker`.
   subroutine look_at(self, tau)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      if (self%looked .and. .not. abs(tau - self%looker%tau) > 0.0_wp) return
      self%looked = .true.
      self%laid_out = .false.
      associate (response => self%states%state(self%now)%response)
         call reserve(self%looker, response)
         if (.not. abs(tau) > 0.0_wp) then
            call copy(self%start, response, self%looker)
         else if (.not. abs(tau - self%duration) > 0.0_wp) then
            call copy(self%search%probe, response, self%looker)
         else
            call move_to(self%start, response, tau, self%looker)
         end if
      end associate
   end subroutine look_at

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      call look_at(self, tau)
      associate (state => self%states%state(self%now))
         value = value_of(state%observed, state%response, self%looker, form, 0)
      end associate
   end function value

   !> Value, size and direction of observable `form` at `tau`, from up to four derivatives.
   subroutine glimpse(self, form, tau, seen)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp) :: rate
      real(wp) :: modulus(self%states%state(self%now)%response%amplitudes)
      integer :: order

      call look_at(self, tau)
      associate (rows => self%states%state(self%now)%observed, response => self%states%state(self%now)%response)
         modulus = sqrt(self%looker%re(:response%amplitudes)**2 + self%looker%im(:response%amplitudes)**2)
         seen%value = value_of(rows, response, self%looker, form, 0)
         seen%size = size_of(rows, response, self%looker, modulus, form, 0)
         do order = 1, 4
            rate = value_of(rows, response, self%looker, form, order)
            if (abs(rate) > rounding*size_of(rows, response, self%looker, modulus, form, order)) then
               seen%direction = nint(sign(1.0_wp, rate))
               return
            end if
         end do
      end associate
   end subroutine glimpse

   !> The next root of the observable's rate, found with the proof that none was before it.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      type(exit_t) :: turn
      type(watched_t) :: rate(1)

      rate(1) = watched_t(form=form, order=1, side=real(direction, wp), from_zero=turned)
      associate (state => self%states%state(self%now))
         self%look%level = state%level
         call first_exit(self%look, state%response, state%observed, self%start, tau, tau_end, rate, turn)
         found = turn%watched /= 0
         tau_found = turn%tau
         value = 0.0_wp
         if (found) value = value_of(state%observed, state%response, self%look%probe, form, 0)
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: z(size(self%z))

      call look_at(self, tau)
      call state_of(self%looker, self%states%state(self%now)%response, z)
      call to_coordinates(self, z, displacement, velocity)
   end subroutine state

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call to_coordinates(self, self%z, displacement, velocity)
   end subroutine final_state

   pure subroutine to_coordinates(self, z, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)

      associate (coupled => self%states%coupled)
         displacement = matmul(z(:coupled%m), coupled%project)
         velocity = matmul(z(coupled%m + 1:), coupled%project)
      end associate
   end subroutine to_coordinates

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      integer :: t

      call look_at(self, tau)
      if (.not. self%laid_out) then
         call state_of(self%looker, self%states%state(self%now)%response, self%z_looked)
         do t = 1, size(self%turn)
            self%turn(t) = cmplx(self%cosine(t), self%sine(t), wp)*cmplx(cos(self%states%omega(t)*tau), &
                                                                         sin(self%states%omega(t)*tau), wp)
         end do
         self%laid_out = .true.
      end if
      associate (touching => self%states%machine%contact(j), m => self%states%coupled%m, z => self%z_looked)
         s = dot_product(self%states%w(:, j), z(:m)) + touching%offset
         rate = dot_product(self%states%w(:, j), z(m + 1:)) + touching%drive
         do t = 1, size(self%cosine)
            s = s + real(self%turn(t)*touching%error(t))
            rate = rate - self%states%omega(t)*aimag(self%turn(t)*touching%error(t))
         end do
         force = touching%force_sign*touching%law%force(self%branch(j), s, rate, touching%normal)
      end associate
   end subroutine contact

   !> Integrals of what contact j does from `tau` to the end of the piece, where its force is k s + offset and no part is dense:
   !> the work is a difference of potentials then.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      real(wp) :: distance, s(2), rate(2)

      associate (state => self%states%state(self%now), contact => self%states%machine%contact(j), last => self%search%probe)
         associate (law => contact%law%branch(self%branch(j)), response => state%response)
            known = response%nx == 0 .and. .not. abs(law%damping) > 0.0_wp
            if (.not. known .or. .not. max(abs(law%stiffness), abs(law%offset)) > 0.0_wp) return
            call lay_out_contacts(self%states, self%now)
            call look_at(self, tau)
            call value_and_slope(state%touching, response, self%looker, j, 0, s(1), rate(1))
            call value_and_slope(state%touching, response, last, j, 0, s(2), rate(2))
            impulse = impulse + contact%force_sign*(law%stiffness*integral_of(state%touching, response, self%looker, last, j) &
                                                    + law%offset*(last%tau - self%looker%tau))
            work = work + (s(2) - s(1))*(law%stiffness*0.5_wp*(s(1) + s(2)) + law%offset)
            largest = max(largest, maxval(abs(law%stiffness*s + law%offset)))
            if (.not. abs(law%stiffness) > 0.0_wp) return
            distance = largest/abs(law%stiffness)
            call self%largest_distance(j, -law%offset/law%stiffness, tau, s, rate, distance)
            largest = max(largest, abs(law%stiffness)*distance)
         end associate
      end associate
   end subroutine contact_sums

   !> Raise `distance` to the largest |s - edge| of contact j at the turns of s between `tau` and the end of the piece; s and s'
   !> at both are known. The search is spared where the curvature does not suffice for a larger one.
   subroutine largest_distance(self, j, edge, tau, s, rate, distance)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: edge, tau, s(2), rate(2)
      real(wp), intent(inout) :: distance

      type(exit_t) :: turn
      type(watched_t) :: watched(1)
      real(wp) :: direction, from

      associate (state => self%states%state(self%now))
         if (.not. state%response%growing) then
            if (maxval(abs(s - edge)) + (self%duration - tau)**2/8*curvature_bound(state%touching, state%response, self%looker, j) &
                <= distance) return
         end if
         direction = sign(1.0_wp, rate(1))
         from = tau
         watched(1) = watched_t(form=j, order=1)
         do while (from < self%duration)
            watched(1)%side = direction
            watched(1)%from_zero = from > tau
            self%look%level = state%level
            call first_exit(self%look, state%response, state%touching, self%start, from, self%duration, watched, turn)
            if (turn%watched == 0) return
            distance = max(distance, abs(value_of(state%touching, state%response, self%look%probe, j, 0) - edge))
            from = turn%tau
            direction = -direction
         end do
      end associate
   end subroutine largest_distance

   !> Branch of contact j.
   pure function branch_now(self, j) result(branch)
      class(exact_t), intent(in) :: self
      integer, intent(in) :: j
      integer :: branch

      branch = self%branch(j)
   end function branch_now

   !> The step of the search, or less, so that a turn of the fastest term has at least 25 points.
   pure function interval(self)
      class(exact_t), intent(in) :: self
      real(wp) :: interval

      associate (state => self%states%state(self%now))
         interval = scale(1.0_wp, -max(state%level, exponent(state%response%fastest) + 2))
      end associate
   end function interval

end module razy_integrate_exact
