!! The piece of a motion under way, as observers see it: observables, contacts and the state at any time of it, turns of
!! observables with the proof that none was missed, integrals of contact forces; all from the amplitudes of the closed form.
!!
!! What no contact feels is answered from the whole motion: that of the contacts and what stands beside (razy_exact_beside).
module razy_exact_piece
   use razy_core_kinds, only: wp
   use razy_exact_beside, only: beside_t
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, copy, move_to, set_state, state_of
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: curvature_bound, integral_of, rows_t, size_of, square_integral_of, &
                                          value_and_slope, value_of
   use razy_exact_search_refine, only: watched_t
   use razy_exact_search_search, only: exit_t, first_exit, rounding, search_t
   use razy_exact_solution, only: solution_t
   use razy_exact_solutions, only: solutions_t
   use razy_hybrid_flow, only: flow_t
   use razy_linalg_blocks, only: moduli_of
   use razy_motion_integrator, only: glimpse_t
   implicit none(type, external)
   private

   public :: end_state, exact_piece_t

   !> A propagator with its piece; razy_exact_exact says how it goes on.
   type, abstract, extends(flow_t) :: exact_piece_t
      type(solutions_t) :: solutions
      !> The search for events, whose probe holds the amplitudes at the end of the piece; those for turns of observables.
      type(search_t) :: search
      type(search_t), private :: turns, turns_of_whole
      !> The rate whose root is a turn.
      type(watched_t), private :: rate(1)
      !> The piece under way: its solution, duration (s), and the amplitudes at its start.
      integer :: now = 0
      real(wp) :: duration = 0.0_wp
      type(amplitudes_t) :: start
      !> What observers are answered with: amplitudes at a time, once there has been a question.
      type(amplitudes_t) :: looker
      logical :: looked = .false.
      !> What stands beside; the whole motion at the start of the piece and at `whole%tau`, once there has been a question.
      type(beside_t) :: beside
      type(amplitudes_t) :: whole_start, whole
      logical :: whole_looked = .false.
   contains
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: interval
      procedure :: contact_sums
   end type exact_piece_t

contains

   !> Amplitudes at `tau` into `piece%looker`.
   subroutine look_at(piece, tau)
      class(exact_piece_t), intent(inout) :: piece
      real(wp), intent(in) :: tau

      if (piece%looked .and. .not. abs(tau - piece%looker%tau) > 0.0_wp) return
      piece%looked = .true.
      associate (response => piece%solutions%of(piece%now)%form%response)
         if (.not. abs(tau) > 0.0_wp) then
            call copy(piece%start, response, piece%looker)
         else if (.not. abs(tau - piece%duration) > 0.0_wp) then
            call copy(piece%search%probe, response, piece%looker)
         else
            call move_to(piece%start, response, tau, piece%looker)
         end if
      end associate
   end subroutine look_at

   !> Amplitudes of the whole motion at `tau` into `piece%whole`.
   subroutine look_at_whole(piece, tau)
      class(exact_piece_t), intent(inout) :: piece
      real(wp), intent(in) :: tau

      real(wp), dimension(2*piece%system%m) :: z
      real(wp), dimension(2*piece%system%beside%m) :: more

      associate (solution => piece%solutions%of(piece%now)%form, m => piece%system%m, n => piece%system%beside%m)
         if (.not. piece%whole_looked) then
            call state_of(piece%start, solution%response, z)
            call piece%beside%find_state(piece%system, piece%time, piece%time_low, more)
            call set_state(piece%whole_start, solution%whole, [z(:m), more(:n), z(m + 1:), more(n + 1:)], &
                           piece%transition%dynamics%excitation%start)
         else if (.not. abs(tau - piece%whole%tau) > 0.0_wp) then
            return
         end if
         piece%whole_looked = .true.
         call move_to(piece%whole_start, solution%whole, tau, piece%whole)
      end associate
   end subroutine look_at_whole

   !> z (2m) at amplitudes of a solution.
   subroutine end_state(solution, at, z)
      type(solution_t), intent(in) :: solution
      type(amplitudes_t), intent(in) :: at
      real(wp), intent(out) :: z(:)

      call state_of(at, solution%response, z)
      if (solution%constrained%n > 0) z = solution%constrained%to_state(z)
   end subroutine end_state

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(exact_piece_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      associate (solution => self%solutions%of(self%now)%form)
         if (self%system%is_beyond(form)) then
            call look_at_whole(self, tau)
            value = value_of(solution%observed_whole, solution%whole, self%whole, form, 0)
         else
            call look_at(self, tau)
            value = value_of(solution%observed, solution%response, self%looker, form, 0)
         end if
      end associate
   end function value

   !> Value, size and direction of observable `form` at `tau`, from up to four derivatives.
   subroutine glimpse(self, form, tau, seen)
      class(exact_piece_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      associate (solution => self%solutions%of(self%now)%form)
         if (self%system%is_beyond(form)) then
            call look_at_whole(self, tau)
            call glimpse_at(solution%observed_whole, solution%whole, self%whole, form, seen)
         else
            call look_at(self, tau)
            call glimpse_at(solution%observed, solution%response, self%looker, form, seen)
         end if
      end associate
   end subroutine glimpse

   pure subroutine glimpse_at(rows, response, at, form, seen)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: at
      integer, intent(in) :: form
      type(glimpse_t), intent(out) :: seen

      real(wp) :: modulus(response%filled), rate
      integer :: order

      call moduli_of(response%filled, at%x, modulus)
      seen%value = value_of(rows, response, at, form, 0)
      seen%size = size_of(rows, response, at, modulus, form, 0)
      do order = 1, 4
         rate = value_of(rows, response, at, form, order)
         if (abs(rate) > rounding*size_of(rows, response, at, modulus, form, order)) then
            seen%direction = nint(sign(1.0_wp, rate))
            return
         end if
      end do
   end subroutine glimpse_at

   !> The next root of the observable's rate, found with the proof that none was before it.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(exact_piece_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      type(exit_t) :: turn

      associate (solution => self%solutions%of(self%now)%form, rate => self%rate)
         if (.not. turned) rate(1) = watched_t(form=form, order=1)
         rate(1)%side = direction
         rate(1)%from_zero = turned
         self%turns%level = solution%level
         value = 0.0_wp
         if (self%system%is_beyond(form)) then
            call look_at_whole(self, tau)
            self%turns_of_whole%level = solution%level
            call first_exit(self%turns_of_whole, self%budget, solution%whole, solution%observed_whole, self%whole_start, tau, &
                            tau_end, rate, turn)
            if (turn%watched /= 0) value = value_of(solution%observed_whole, solution%whole, self%turns_of_whole%probe, form, 0)
         else
            call first_exit(self%turns, self%budget, solution%response, solution%observed, self%start, tau, tau_end, rate, turn)
            if (turn%watched /= 0) value = value_of(solution%observed, solution%response, self%turns%probe, form, 0)
         end if
         found = turn%watched /= 0
         tau_found = turn%tau
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(exact_piece_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: more(2*self%system%beside%m), z(2*self%system%m)

      call look_at(self, tau)
      call end_state(self%solutions%of(self%now)%form, self%looker, z)
      if (self%system%beside%m > 0) call self%beside%find_state(self%system, self%time, self%time_low + tau, more)
      call self%system%to_coordinates(z, displacement, velocity, more)
   end subroutine state

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(exact_piece_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      call look_at(self, tau)
      call self%solutions%lay_out_contacts(self%system, self%now)
      associate (touching => self%system%machine%contact(j), solution => self%solutions%of(self%now)%form)
         call value_and_slope(solution%touching, solution%response, self%looker, j, 0, s, rate)
         rate = rate + touching%drive
         if (solution%has_forces) then
            force = value_of(solution%force, solution%response, self%looker, j, 0)
         else
            force = touching%law%force(solution%branch(j), s, rate, touching%normal)
         end if
         force = touching%force_sign*force
      end associate
   end subroutine contact

   !> The step of the search, or less, so that a turn of the fastest term has at least 25 points.
   pure function interval(self)
      class(exact_piece_t), intent(in) :: self
      real(wp) :: interval

      associate (solution => self%solutions%of(self%now)%form)
         interval = scale(1.0_wp, -max(solution%level, exponent(solution%response%fastest) + 2))
      end associate
   end function interval

   !> Integrals of what contact j does from `tau` to the end of the piece, where its force is k s + b s' + offset and no part is
   !> dense: the work is a difference of potentials and b ∫ s'² dt then.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(exact_piece_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      real(wp) :: distance, f(2), g(2), s(2), rate(2)

      associate (solution => self%solutions%of(self%now)%form, contact => self%system%machine%contact(j), last => self%search%probe)
         associate (law => contact%law%branch(solution%branch(j)), response => solution%response, touching => solution%touching)
            ! Motions that are not exponential have products of another kind.
            known = response%plain .and. .not. (solution%has_forces .or. (solution%damped(j) .and. &
                                                         (response%rigid > 0 .or. response%ramps .or. abs(contact%drive) > 0.0_wp)))
            if (.not. known .or. .not. max(abs(law%stiffness), abs(law%damping), abs(law%offset)) > 0.0_wp) return
            call self%solutions%lay_out_contacts(self%system, self%now)
            call look_at(self, tau)
            call value_and_slope(touching, response, self%looker, j, 0, s(1), rate(1))
            call value_and_slope(touching, response, last, j, 0, s(2), rate(2))
            impulse = impulse + contact%force_sign*(law%stiffness*integral_of(touching, response, self%looker, last, j) &
                                                    + law%damping*(s(2) - s(1)) + law%offset*(last%tau - self%looker%tau))
            work = work + (s(2) - s(1))*(law%stiffness*0.5_wp*(s(1) + s(2)) + law%offset)
            if (solution%damped(j)) then
               work = work + law%damping*square_integral_of(touching, response, self%looker, last, j)
               call value_and_slope(solution%force, response, self%looker, j, 0, f(1), g(1))
               call value_and_slope(solution%force, response, last, j, 0, f(2), g(2))
               largest = max(largest, maxval(abs(f)))
               call raise_distance(self, solution%force, j, 0.0_wp, tau, f, g, largest)
               return
            end if
            largest = max(largest, maxval(abs(law%stiffness*s + law%offset)))
            if (.not. abs(law%stiffness) > 0.0_wp) return
            distance = largest/abs(law%stiffness)
            call raise_distance(self, touching, j, -law%offset/law%stiffness, tau, s, rate, distance)
            largest = max(largest, abs(law%stiffness)*distance)
         end associate
      end associate
   end subroutine contact_sums

   !> Raise `distance` to the largest |f - edge| of form j of `rows` at the turns of f between `tau` and the end of the piece; f and
   !> its slope at both are known. The search is spared where the curvature does not suffice for a larger one.
   subroutine raise_distance(piece, rows, j, edge, tau, f, slope, distance)
      class(exact_piece_t), intent(inout) :: piece
      type(rows_t), intent(in) :: rows
      integer, intent(in) :: j
      real(wp), intent(in) :: edge, tau, f(2), slope(2)
      real(wp), intent(inout) :: distance

      type(exit_t) :: turn
      type(watched_t) :: watched(1)
      real(wp) :: direction, from

      associate (solution => piece%solutions%of(piece%now)%form, response => piece%solutions%of(piece%now)%form%response)
         if (.not. response%growing) then
            if (maxval(abs(f - edge)) + (piece%duration - tau)**2/8*curvature_bound(rows, response, piece%looker, j) &
                <= distance) return
         end if
         direction = sign(1.0_wp, slope(1))
         from = tau
         watched(1) = watched_t(form=j, order=1)
         do while (from < piece%duration)
            watched(1)%side = direction
            watched(1)%from_zero = from > tau
            piece%turns%level = solution%level
            call first_exit(piece%turns, piece%budget, response, rows, piece%start, from, piece%duration, watched, turn)
            if (turn%watched == 0) return
            distance = max(distance, abs(value_of(rows, response, piece%turns%probe, j, 0) - edge))
            from = turn%tau
            direction = -direction
         end do
      end associate
   end subroutine raise_distance

end module razy_exact_piece
