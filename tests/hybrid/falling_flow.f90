!! A flow of a few lines, for tests of the loop: a ball falls to a rigid floor at 0, in closed form.
module falling_flow
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_hybrid_event_settle, only: start_piece
   use razy_hybrid_flow, only: ends_in_event, ends_open, flow_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: glimpse_t, observer_t, outcome_t, piece_t
   implicit none(type, external)
   private

   public :: falling_t, pieces_t

   type, extends(flow_t) :: falling_t
      !> Gravity, and the longest piece, s.
      real(wp) :: gravity = 10.0_wp, longest = huge(1.0_wp)
      integer :: entered = 0, stood = 0, tallied = 0
      !> Duration of the piece under way.
      real(wp), private :: duration = 0.0_wp
   contains
      procedure :: prepare
      procedure :: enter
      procedure :: advance
      procedure :: stand
      procedure :: finish
      procedure :: transport
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: interval
   end type falling_t

   !> What was shown: durations, contacts and branches of the pieces, and whether one was the last.
   type, extends(observer_t) :: pieces_t
      integer :: count = 0, contact(1000) = 0, branch(1000) = 0
      real(wp) :: time(1000) = 0.0_wp, duration(1000) = 0.0_wp
      logical :: last = .false.
   contains
      procedure :: piece => note_piece
   end type pieces_t

contains

   subroutine note_piece(self, part)
      class(pieces_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      self%count = self%count + 1
      self%contact(self%count) = part%contact
      self%branch(self%count) = part%branch
      self%time(self%count) = part%time + part%time_low
      self%duration(self%count) = part%duration
      self%last = part%last
   end subroutine note_piece

   subroutine prepare(self, machine, keep_all, error)
      class(falling_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      call self%take(machine, keep_all, .false., 0.0_wp, error)
   end subroutine prepare

   subroutine enter(self, t_end, outcome)
      class(falling_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(inout) :: outcome

      associate (unused => [real(wp) :: t_end, outcome%time])
         self%entered = self%entered + 1
         call start_piece(self%transition, self%system, self%time, self%time_low, 1.0e-6_wp, self%z)
      end associate
   end subroutine enter

   subroutine advance(self, t_end, longest, piece, ending, outcome)
      class(falling_t), intent(inout) :: self
      real(wp), intent(in) :: t_end, longest
      type(piece_t), intent(inout) :: piece
      integer, intent(out) :: ending
      type(outcome_t), intent(inout) :: outcome

      real(wp) :: rest, until_floor
      real(wp) :: x(1), v(1)

      call self%system%to_coordinates(self%z, x, v)
      associate (g => self%gravity, unused => outcome)
         rest = self%remaining(t_end)
         until_floor = (v(1) + sqrt(v(1)**2 + 2*g*x(1)))/g
         self%hit = .false.
         self%duration = min(rest, self%longest, longest)
         ending = ends_open
         if (until_floor <= self%duration) then
            ending = ends_in_event
            self%duration = until_floor
            self%hit(1) = .true.
         end if
         piece%last = ending == ends_open .and. .not. self%duration < rest
         piece%duration = self%duration
         x = x + self%duration*(v - 0.5_wp*g*self%duration)
         v = v - g*self%duration
         self%z = [matmul(self%system%coupled%to_coupled, x), matmul(self%system%coupled%to_coupled, v)]
      end associate
   end subroutine advance

   subroutine stand(self, outcome)
      class(falling_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      associate (unused => outcome)
         self%stood = self%stood + 1
      end associate
   end subroutine stand

   subroutine finish(self, outcome)
      class(falling_t), intent(inout) :: self
      type(outcome_t), intent(inout) :: outcome

      self%tallied = self%tallied + 1
      outcome%steps = self%entered
   end subroutine finish

   !> δx' = 0.
   subroutine transport(self)
      class(falling_t), intent(inout) :: self

      self%tangent(1, :) = self%tangent(1, :) + self%duration*self%tangent(2, :)
   end subroutine transport

   !> What observers ask for is not asked for here.
   function value(self, form, tau)
      class(falling_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = self%gravity + form + tau
   end function value

   subroutine glimpse(self, form, tau, seen)
      class(falling_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      seen%value = self%value(form, tau)
   end subroutine glimpse

   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(falling_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      found = turned .and. direction == 0
      tau_found = tau_end
      value = self%value(form, tau)
   end subroutine next_turn

   subroutine state(self, tau, displacement, velocity)
      class(falling_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      associate (unused => tau)
         call self%system%to_coordinates(self%z, displacement, velocity)
      end associate
   end subroutine state

   subroutine contact(self, j, tau, s, rate, force)
      class(falling_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      s = self%value(j, tau)
      rate = 0.0_wp
      force = 0.0_wp
   end subroutine contact

   pure function interval(self)
      class(falling_t), intent(in) :: self
      real(wp) :: interval

      interval = self%longest
   end function interval

end module falling_flow
