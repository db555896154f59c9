!! The exact propagator: motion of a piecewise-linear machine from event to event in closed form.
!!
!! Between two events nothing is integrated; the next event is found with proof that none was before it (razy_exact_search_search).
!! The phases of excitation are formed anew from the time, which is kept in two doubles, so that errors do not grow with the number
!! of pieces. Where nothing is held and a contact only changes its branch, nothing jumps: its function has crossed its bound and is
!! known to start there (razy_exact_crossings), and the amplitudes go on. All else the transition settles, all events of a time
!! together, from the state, and knows which guards start on their bounds. What observers see of a piece: razy_exact_piece.
module razy_exact_exact
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_exact_closed_form_amplitudes, only: carry_disturbances, move_to, reserve, set_state
   use razy_exact_crossings, only: crossings_t
   use razy_exact_ending, only: find_ending, waits
   use razy_exact_piece, only: end_state, exact_piece_t
   use razy_exact_residual, only: worst_residual
   use razy_exact_search_search, only: exit_t, first_exit, soon
   use razy_exact_settled, only: prepare_settled, take_sizes
   use razy_hybrid_event_settle, only: start_piece
   use razy_hybrid_flow, only: ends_crossed, ends_in_event, ends_open, largest
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: outcome_t, piece_t, status_blow_up, status_costly, status_inaccurate, &
                                     status_no_contact_forces, status_no_modes, status_ok, status_step_limit
   implicit none(type, external)
   private

   public :: exact_t

   !> The propagator with what it keeps from run to run. Steps of its searches and pieces count as steps.
   type, extends(exact_piece_t) :: exact_t
      !> Whether contacts alone choose the coordinates that are followed, and all else that is observed stands beside.
      logical :: apart = .false.
      !> Whether a motion may end because closed forms do not pay.
      logical :: may_give_up = .false.
      !> What closed forms may take, 2^20 bytes; the last two are kept in any case.
      integer :: memory_mb = 256
      !> Until when the motion lasts, s.
      real(wp), private :: t_end = 0.0_wp
      !> Sum of the angles that the fastest exponents have turned by.
      real(wp), private :: turned = 0.0_wp
      !> The solution of the piece before, whose end the probe holds, 0 where z alone holds the state.
      integer, private :: ended = 0
      !> State beside at the end of a run; not allocated, and so absent, where there has been none.
      real(wp), allocatable, private :: last_beside(:)
      !> The bounds that were crossed last, and the solution before.
      type(crossings_t), private :: crossings
      integer, private :: before = 0
      !> Whether the piece begins as the transition has settled it, and not where functions have crossed their bounds.
      logical, private :: settled = .false.
      !> Whether the piece to come has begun already, as the moment that it starts with.
      logical, private :: placed = .false.
   contains
      procedure :: prepare
      procedure :: enter
      procedure :: advance
      procedure :: stand
      procedure :: finish
      procedure :: transport
      procedure :: final_state
   end type exact_t

   !> Pieces are begun anew after this angle of the fastest exponent, so that its rounding stays below 1e-13.
   real(wp), parameter :: longest_angle = 1.0e3_wp
   !> A growing term grows by less than the exponential of this in a piece.
   real(wp), parameter :: longest_growth = 50.0_wp

contains

   !> Take a machine; refused with an error if one of its laws is not piecewise linear.
   subroutine prepare(self, machine, keep_all, error)
      class(exact_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: j

      do j = 1, size(machine%contact)
         if (machine%contact(j)%law%piecewise_linear .and. .not. allocated(machine%contact(j)%modulation)) cycle
         call raise(error, "the exact propagator cannot follow contact '"//machine%contact(j)%name// &
                    "', whose law is not piecewise linear, or whose stiffness varies by harmonics")
         return
      end do
      if (any(machine%tone%bends())) call raise(error, "the exact propagator follows tables that are linear or held between "// &
                                                "rows, not 'cubic'")
      if (.not. allocated(error)) call self%take(machine, keep_all, self%apart, 0.0_wp, error)
      if (allocated(error)) return
      call self%solutions%attach(self%system, self%memory_mb*(2_i8**23/storage_size(1.0_wp)))
      call self%crossings%attach(size(machine%contact))
   end subroutine prepare

   !> The solution in the mode, from time and state as they are.
   subroutine enter(self, t_end, outcome)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(inout) :: outcome

      self%t_end = t_end
      if (self%starting) then
         call self%crossings%forget()
         self%now = 0
         self%placed = .false.
         self%turned = 0.0_wp
         self%settled = self%system%constrained
         call self%solutions%begin_run()
      end if
      call self%budget%spend()
      if (self%budget%status /= status_ok) return
      if (.not. self%placed) then
         call find_solution(self, outcome)
         if (self%now == 0) return
         if (self%may_give_up .and. costs_more(self, outcome%pieces, t_end)) outcome%status = status_costly
         if (self%settled) then
            call start_piece(self%transition, self%system, self%time, self%time_low, delta_of(self, self%remaining(t_end)), self%z)
         else
            call self%transition%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
         end if
         call place(self)
      end if
      self%placed = .false.
      outcome%pieces = outcome%pieces + 1
      ! Faster than that, and the end will not be reached in the steps there are.
      associate (fastest => max(self%solutions%of(self%now)%form%response%turning, self%system%fastest))
         if (self%starting .and. t_end*fastest > longest_angle*self%budget%most_steps) outcome%status = status_step_limit
      end associate
   end subroutine enter

   !> Whether closed forms do not pay: the motion hardly ever returns to a mode, its forms cost more than its pieces would by steps
   !> of a Runge-Kutta method and a good part of what the whole motion would, and all forms there are would cost more than that.
   !> A form costs some m³, and a step m, by matrices in bands; each piece takes some steps, and the angle of the fastest exponent
   !> more. The factors are ratios of instructions, counted on chains of 20 and 100 coordinates.
   pure logical function costs_more(self, pieces, t_end)
      type(exact_t), intent(in) :: self
      integer(i8), intent(in) :: pieces
      real(wp), intent(in) :: t_end

      ! Three stops make so few modes; more pieces for each are a return.
      integer, parameter :: few = 8, often = 4
      ! Contacts have two branches or more.
      integer, parameter :: countable = 60
      real(wp), parameter :: of_piece = 128.0_wp, of_angle = 16.0_wp, good_part = 1.0_wp/16
      real(wp) :: steps

      ! In forms.
      steps = (of_piece*pieces + of_angle*self%turned)/max(self%system%m, 1)**2
      costs_more = self%solutions%met >= few .and. often*self%solutions%met > pieces &
                   .and. self%solutions%met*self%time > steps*max(self%time, good_part*t_end) &
                   .and. 2.0_wp**min(size(self%system%gap), countable)*self%time > steps*t_end
   end function costs_more

   !> The solution in the mode of the transition, which needs the state where something is held, or is about to be.
   subroutine find_solution(self, outcome)
      type(exact_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      integer :: info

      if (self%starting .and. self%system%beside%m > 0) then
         call self%beside%begin(self%system, self%time, info)
         if (info /= 0) then
            outcome%status = status_no_modes
            self%now = 0
            return
         end if
      end if
      if (self%starting) self%aside = merge(self%beside%response%fastest, 0.0_wp, self%system%beside%m > 0)
      self%before = self%now
      self%settled = self%settled .or. self%transition%accumulation%landing
      call self%solutions%find(self%system, self%transition%dynamics%mode, self%settled, self%beside, self%t_end, &
                               self%now)
      if (self%now == 0) then
         outcome%status = merge(status_no_contact_forces, status_no_modes, self%solutions%inadmissible)
      else if (self%solutions%fresh) then
         call reserve(self%start, self%solutions%of(self%now)%form%response)
         call reserve(self%looker, self%solutions%of(self%now)%form%response)
         if (any(self%system%is_beyond)) then
            call reserve(self%whole_start, self%solutions%of(self%now)%form%whole)
            call reserve(self%whole, self%solutions%of(self%now)%form%whole)
         end if
      end if
      if (self%now == 0) return
      self%complete = self%solutions%of(self%now)%form%complete
      outcome%residual = max(outcome%residual, self%solutions%of(self%now)%form%residual)
      if (.not. outcome%residual <= worst_residual) outcome%status = status_inaccurate
      self%settled = self%settled .or. .not. self%solutions%of(self%now)%form%free
      if (.not. self%settled) return
      call lay_out_state(self)
      self%ended = 0
   end subroutine find_solution

   !> Time over which rates of constraint forces are taken, s, with `rest` to go.
   pure function delta_of(self, rest) result(delta)
      type(exact_t), intent(in) :: self
      real(wp), intent(in) :: rest
      real(wp) :: delta

      delta = 1.0e-5_wp*min(rest, 1.0_wp/max(self%solutions%of(self%now)%form%basis%fastest, self%system%fastest, tiny(1.0_wp)))
   end function delta_of

   !> A piece starts now.
   subroutine place(self)
      type(exact_t), intent(inout) :: self

      logical :: passed

      self%looked = .false.
      self%whole_looked = .false.
      self%duration = 0.0_wp
      associate (solution => self%solutions%of(self%now)%form, phasor => self%transition%dynamics%excitation%start)
         if (self%ended > 0) then
            call self%solutions%pass(self%ended, self%search%probe, self%now, phasor, self%start, passed)
            if (passed) return
            call lay_out_state(self)
         end if
         if (solution%constrained%n > 0) then
            call set_state(self%start, solution%response, solution%constrained%to_coordinates(self%z), phasor)
         else
            call set_state(self%start, solution%response, self%z, phasor)
         end if
      end associate
   end subroutine place

   !> Have the state at the end of the piece before in z.
   subroutine lay_out_state(self)
      type(exact_t), intent(inout) :: self

      if (self%has_z) return
      call end_state(self%solutions%of(self%ended)%form, self%search%probe, self%z)
      self%has_z = .true.
   end subroutine lay_out_state

   !> The piece is this moment.
   subroutine stand(self, outcome)
      class(exact_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      call find_solution(self, outcome)
      if (self%now == 0) return
      call self%transition%dynamics%excitation%begin(self%system%machine%tone, self%time, self%time_low)
      call place(self)
      self%placed = .not. self%settled
   end subroutine stand

   !> Follow the solution to the next event.
   subroutine advance(self, t_end, longest, piece, ending, outcome)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: t_end, longest
      type(piece_t), intent(inout) :: piece
      integer, intent(out) :: ending
      type(outcome_t), intent(inout) :: outcome

      type(exit_t) :: found
      real(wp) :: before(size(self%z))

      if (self%settled) then
         before = self%z
         call prepare_settled(self%solutions%of(self%now)%form, self%system, self%transition, self%z)
      else
         associate (solution => self%solutions%of(self%now)%form)
            call self%crossings%prepare(solution%entry, solution%watched)
         end associate
      end if
      call follow(self, longest, t_end, piece, found)
      ! Tangents are carried through one event after the other.
      call find_ending(self%solutions%of(self%now)%form, found, self%settled, allocated(self%tangent), self%search, &
                       self%crossings, self%transition, ending)
      if (ending == ends_crossed .and. self%crossings%standing == 1 .and. self%before > 0) then
         associate (before => self%solutions%of(self%before)%form)
            call self%crossings%take_noise(before%entry, before%watched)
         end associate
      end if
      ! In a piece of no length the state has not moved.
      self%has_z = self%has_z .and. .not. (self%settled .or. found%tau > 0.0_wp)
      self%ended = self%now
      associate (solution => self%solutions%of(self%now)%form, unused => outcome)
         ! What does not grow cannot blow up.
         if (ending == ends_in_event .or. self%settled .or. allocated(self%tangent) .or. solution%response%growing &
             .or. self%to_break) then
            call lay_out_state(self)
         end if
         if (self%settled .and. found%tau*solution%response%fastest <= soon) call add_up(self, before, found%tau)
      end associate
      if (ending == ends_in_event .and. .not. self%settled) then
         call self%transition%dynamics%mode%enter(self%system)
         call self%transition%guards%list(self%system, self%transition%dynamics%mode)
      end if
      if (ending == ends_in_event .or. self%settled) then
         call take_sizes(self%solutions%of(self%now)%form, self%transition%guards)
      end if
      if (ending == ends_in_event .or. self%settled .or. allocated(self%tangent)) then
         self%hit = .false.
         if (found%watched > 0) self%hit(found%watched) = .true.
      end if
      if (ending /= ends_open) self%settled = ending == ends_in_event
      if (self%settled) self%ended = 0
      if (.not. self%to_break .or. ending /= ends_open) return
      ! The tones may jump, and with them what a function that has crossed its bound does.
      self%ended = 0
      call self%crossings%forget()
   end subroutine advance

   !> Displacements after a short piece from those `before` it, by Simpson's rule: a gap that is less than the rounding of the terms
   !> of the solution keeps its digits.
   subroutine add_up(self, before, tau)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: before(:), tau

      real(wp) :: middle(size(before))

      associate (solution => self%solutions%of(self%now)%form, m => self%system%m)
         call move_to(self%start, solution%response, 0.5_wp*tau, self%looker)
         call end_state(solution, self%looker, middle)
         self%z(:m) = before(:m) + tau/6*(before(m + 1:) + 4*middle(m + 1:) + self%z(m + 1:))
      end associate
   end subroutine add_up

   !> Follow the solution to the end of the piece, at most for `most`, s.
   subroutine follow(self, most, t_end, piece, found)
      type(exact_t), intent(inout) :: self
      real(wp), intent(in) :: most, t_end
      type(piece_t), intent(inout) :: piece
      type(exit_t), intent(out) :: found

      real(wp) :: longest, fastest

      associate (solution => self%solutions%of(self%now)%form, response => self%solutions%of(self%now)%form%response)
         fastest = max(response%turning, self%system%fastest)
         longest = self%remaining(t_end)
         piece%last = longest*fastest <= longest_angle
         if (.not. piece%last) longest = longest_angle/fastest
         if (response%growing) then
            ! Growth is looked at again before a blow-up can pass the range of the numbers.
            longest = min(longest, longest_growth/maxval(real(response%exponent)))
            piece%last = piece%last .and. .not. piece%time + longest < t_end
         end if
         piece%last = piece%last .and. longest < most
         longest = min(longest, most)
         self%search%level = solution%level
         call first_exit(self%search, self%budget, response, solution%switching, self%start, 0.0_wp, longest, solution%watched, &
                         found)
         solution%level = self%search%level
         if (self%to_break .and. found%watched > 0) then
            if (waits(solution, self%start, found, most, self%looker)) found = exit_t(tau=most)
         end if
         if (found%watched == 0) call move_to(self%start, response, found%tau, self%search%probe)
      end associate
      piece%duration = found%tau
      self%duration = found%tau
      self%turned = self%turned + found%tau*self%solutions%of(self%now)%form%response%fastest
      piece%last = piece%last .and. found%watched == 0 .and. .not. found%tau < longest
   end subroutine follow

   !> Carry the tangents through the piece.
   subroutine transport(self)
      class(exact_t), intent(inout) :: self

      associate (motion => self%solutions%of(self%now)%form%constrained, m => self%system%m, x => self%tangent)
         if (motion%n > 0) then
            x(:m, :) = matmul(motion%to_x, x(:m, :))
            x(m + 1:, :) = matmul(motion%to_x, x(m + 1:, :))
         end if
         call carry_disturbances(self%solutions%of(self%now)%form%response, self%duration, x)
         if (motion%n > 0) then
            x(:m, :) = matmul(motion%from_x, x(:m, :))
            x(m + 1:, :) = matmul(motion%from_x, x(m + 1:, :))
         end if
      end associate
   end subroutine transport

   !> State and counters of the search.
   subroutine finish(self, outcome)
      class(exact_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      call lay_out_state(self)
      self%ended = 0
      if (self%system%beside%m > 0 .and. self%now > 0) then
         self%last_beside = spread(0.0_wp, 1, 2*self%system%beside%m)
         call self%beside%find_state(self%system, self%time, self%time_low, self%last_beside)
         if (outcome%status == status_ok .and. .not. all(abs(self%last_beside) <= largest)) outcome%status = status_blow_up
      end if
      outcome%steps = self%search%steps
      outcome%near_misses = self%search%near_misses
      outcome%states = self%solutions%met
      self%search%steps = 0
      self%search%near_misses = 0
   end subroutine finish

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call self%system%to_coordinates(self%z, displacement, velocity, self%last_beside)
   end subroutine final_state

end module razy_exact_exact
