!! A motion through its modes: the one loop of all methods, and what a method has to offer.
!!
!! A flow moves the state within a mode, in closed form or step by step, and finds what ends it; the transition says what
!! follows (razy_hybrid_transition). A change of branch ends a piece; others at the same time are shown as pieces of no
!! duration. A flow that looks for no events notes changes of branch at the ends of its steps. Where the stiffness of gear meshes
!! switches, at times known beforehand, branches change without a guard (razy_hybrid_switching). No piece goes over a break of the
!! excitation, where forces and given speeds may jump: what is held, sticks or touches is settled anew there.
module razy_hybrid_flow
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time, time_to_break
   use razy_hybrid_event_settle, only: restart, settle, settle_start
   use razy_hybrid_pace, only: most_hurried, pace_t
   use razy_hybrid_switching, only: switching_t
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: transition_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: integrator_t, observer_slot_t, outcome_t, piece_t, show_piece, status_beyond_law, &
                                     status_blow_up, status_chatter, status_event_limit, status_no_contact_forces, status_ok, &
                                     status_step_underflow
   implicit none(type, external)
   private

   public :: flow_t
   public :: ends_crossed, ends_in_event, ends_noted, ends_open, largest

   !> How a piece ends: without an event; in one; with changes of branch that were noted afterwards; in an event at which branches
   !> change and nothing jumps, with the changes noted.
   integer, parameter :: ends_open = 0, ends_in_event = 1, ends_noted = 2, ends_crossed = 3

   type, abstract, extends(integrator_t) :: flow_t
      type(system_t) :: system
      !> What happens at events; its mode is the one that the motion is in.
      type(transition_t) :: transition
      type(switching_t), private :: switching
      !> Whether events are looked for.
      logical :: finds_events = .true.
      !> Whether the excitation has breaks.
      logical, private :: breaks = .false.
      !> Time of the motion, s (sum of both), and state z = (y, y') (2m).
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp
      real(wp), allocatable :: z(:)
      !> Whether z is that state; flows which form it only where it is needed say so.
      logical :: has_z = .true.
      !> Whether the motion has come to this mode, or has jumped, since the piece before; whether it has only just begun.
      logical :: anew = .true., starting = .true.
      !> Whether the piece, if no event ends it, lasts up to a time at which forces may jump.
      logical :: to_break = .false.
      !> Guards of the mode that are left at an event.
      logical, allocatable :: hit(:)
      !> Time at which the motion begins, s, and the state then instead of the machine's, if there is one (2m).
      real(wp) :: from = 0.0_wp
      real(wp), allocatable :: first(:)
      !> Derivatives of z (2m, columns) that are carried along, if there are any: set them before a run, for z where it begins.
      !> `differentiable`: all that the motion came through has a derivative.
      real(wp), allocatable :: tangent(:, :)
      logical :: differentiable = .true.
   contains
      procedure, non_overridable :: take
      procedure :: run
      procedure, non_overridable :: remaining
      procedure :: final_state
      procedure :: followed
      procedure(enter_mode), deferred :: enter
      procedure(go_on), deferred :: advance
      !> The piece under way is this moment, with the state and the mode as they are now.
      procedure(report), deferred :: stand
      !> The run has ended: have the state in z, and add the flow's own counters.
      procedure(report), deferred :: finish
      procedure(carry), deferred :: transport
   end type flow_t

   abstract interface
      !> Make ready for the mode of the transition, from time and state as they are; nothing is to be done if the mode goes on.
      subroutine enter_mode(self, t_end, outcome)
         import :: flow_t, outcome_t, wp
         implicit none(type, external)
         class(flow_t), intent(inout) :: self
         real(wp), intent(in) :: t_end
         type(outcome_t), intent(inout) :: outcome
      end subroutine enter_mode

      !> Move the state along the mode for at most `longest`, s, and to `t_end`: duration and end of the piece. At an event
      !> `hit` says which guards were left, and the piece what follows the first.
      subroutine go_on(self, t_end, longest, piece, ending, outcome)
         import :: flow_t, outcome_t, piece_t, wp
         implicit none(type, external)
         class(flow_t), intent(inout) :: self
         real(wp), intent(in) :: t_end, longest
         type(piece_t), intent(inout) :: piece
         integer, intent(out) :: ending
         type(outcome_t), intent(inout) :: outcome
      end subroutine go_on

      !> Carry the tangents through the piece under way.
      subroutine carry(self)
         import :: flow_t
         implicit none(type, external)
         class(flow_t), intent(inout) :: self
      end subroutine carry

      subroutine report(self, outcome)
         import :: flow_t, outcome_t
         implicit none(type, external)
         class(flow_t), intent(inout) :: self
         type(outcome_t), intent(inout) :: outcome
      end subroutine report
   end interface

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> A state beyond is a blow-up.
   real(wp), parameter :: largest = 1.0e100_wp
   !> Pieces one after the other that are shorter than the rounding of the time: the end will not be reached.
   integer, parameter :: most_creeping = 10000
   !> Events at one time, for each contact and one more: a body that two others squeeze bounces between them ever faster, and each
   !> bounce takes a part of their speeds only.
   integer, parameter :: most_standing = 64

contains

   !> Take a machine; `sharpness` > 0: its laws are smoothed; what no contact feels stands beside if it is to be `apart`.
   subroutine take(self, machine, keep_all, apart, sharpness, error)
      class(flow_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all, apart
      real(wp), intent(in) :: sharpness
      type(error_t), allocatable, intent(out) :: error

      integer :: t

      call self%system%take(machine, keep_all, apart, error)
      if (allocated(error)) return
      call self%transition%make_room(self%system, sharpness)
      self%breaks = any([(allocated(machine%tone(t)%waveform), t=1, size(machine%tone))])
      self%z = spread(0.0_wp, 1, 2*self%system%m)
      self%branch = spread(1, 1, size(machine%contact))
      self%hit = spread(.false., 1, 8*size(machine%contact))
   end subroutine take

   !> Run the prepared machine from where it begins to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(flow_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      type(piece_t) :: piece
      type(pace_t) :: pace
      integer :: creeping, ending, standing
      real(wp) :: break, longest, rest
      logical :: switches

      piece%by => self
      standing = 0
      creeping = 0
      call self%budget%begin()
      call begin(self, t_end, piece, observers, outcome)
      do while (outcome%status == status_ok .and. self%remaining(t_end) > 0.0_wp)
         call pace%look(outcome%events, most_events, self%time, t_end)
         if (outcome%events >= most_events .or. pace%hurried >= most_hurried) outcome%status = status_event_limit
         if (outcome%status /= status_ok) exit
         call self%enter(t_end, outcome)
         self%starting = .false.
         if (outcome%status == status_ok) outcome%status = self%budget%status
         if (outcome%status /= status_ok) exit
         piece%time = self%time
         piece%time_low = self%time_low
         piece%contact = 0
         piece%last = .false.
         longest = merge(max(self%transition%accumulation%rest, 0.0_wp), huge(1.0_wp), self%transition%accumulation%landing)
         rest = huge(rest)
         if (self%switching%acts) rest = self%switching%rest(self%time, self%time_low)
         ! At the end of the motion nothing switches any more.
         if (.not. rest < (1 - 8*eps)*self%remaining(t_end)) rest = huge(rest)
         break = huge(break)
         if (self%breaks) break = time_to_break(self%system%machine%tone, self%time, self%time_low)
         if (.not. break < (1 - 8*eps)*self%remaining(t_end)) break = huge(break)
         ! Where teeth come in or go, forces jump too.
         self%to_break = min(rest, break) < longest .and. (self%system%constrained .or. .not. rest < break)
         call self%advance(t_end, min(longest, rest, break), piece, ending, outcome)
         ! An event may come at the very end.
         piece%last = piece%last .or. .not. piece%duration < self%remaining(t_end)
         if (self%has_z) then
            if (.not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
         end if
         if (outcome%status == status_ok) outcome%status = self%budget%status
         if (outcome%status /= status_ok) exit
         switches = ending == ends_open .and. .not. piece%duration < rest
         call end_piece(self, t_end, ending, switches, piece, observers, outcome)
         if (self%to_break .and. ending == ends_open .and. .not. piece%duration < min(rest, break)) then
            if (switches .and. outcome%status == status_ok) call show_changes(self, 2, piece, observers, outcome)
            call pass_break(self, t_end, piece, observers, outcome)
         end if
         if (outcome%status == status_ok) outcome%status = self%budget%status
         creeping = merge(creeping + 1, 0, piece%duration <= eps*t_end)
         if (creeping > most_creeping .and. outcome%status == status_ok) outcome%status = status_step_underflow
         standing = merge(standing + 1, 0, self%anew .and. piece%duration <= 4*eps*self%time)
         if (standing > most_standing*(size(self%branch) + 1) .and. outcome%status == status_ok) outcome%status = status_chatter
         if (.not. (self%anew .or. ending == ends_noted)) cycle
         self%branch(:) = self%transition%dynamics%mode%branch
         if (outcome%status == status_ok .and. self%transition%changes > 1) call show_changes(self, 2, piece, observers, outcome)
      end do
      outcome%time = merge(t_end, self%time + self%time_low, outcome%status == status_ok)
      outcome%branch = self%transition%dynamics%mode%branch
      call self%finish(outcome)
      ! Some flows form the state now.
      if (outcome%status == status_ok .and. .not. all(abs(self%z) <= largest)) outcome%status = status_blow_up
   end subroutine run

   !> State and mode at the beginning, made consistent, and the impacts of that.
   subroutine begin(self, t_end, piece, observers, outcome)
      class(flow_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: j

      self%time = self%from
      self%time_low = 0.0_wp
      self%anew = .true.
      self%starting = .true.
      self%differentiable = .true.
      self%transition%saltation%wanted = allocated(self%tangent)
      self%transition%saltation%defined = .true.
      if (allocated(self%tangent)) call self%transition%saltation%begin(self%system%m)
      self%z = self%system%first_state()
      if (allocated(self%first)) self%z = self%first
      call settle_start(self%transition, self%system, self%finds_events, self%from, start_of_rates(self, t_end), self%z)
      if (.not. self%transition%found) outcome%status = status_no_contact_forces
      outcome%impacts = self%transition%impacts
      do j = 1, size(self%branch)
         if (is_beyond(self, j, self%transition%dynamics%mode%branch(j))) outcome%status = status_beyond_law
      end do
      call self%switching%begin(self%system%machine, self%from, self%transition%dynamics%mode%branch)
      self%branch = self%transition%dynamics%mode%branch
      if (allocated(self%tangent) .and. outcome%status == status_ok) then
         call self%transition%saltation%hold(self%system, self%transition%dynamics, self%tangent)
      end if
      if (outcome%status == status_ok .and. outcome%impacts > 0) call show_changes(self, 1, piece, observers, outcome)
   end subroutine begin

   !> Whether what is known of the law of contact j ends where this branch begins.
   pure logical function is_beyond(self, j, branch)
      class(flow_t), intent(in) :: self
      integer, intent(in) :: j, branch

      is_beyond = self%system%machine%contact(j)%law%branch(branch)%outside
   end function is_beyond

   !> The end of a piece: what follows the event there, if there is one, or the stiffness that switches, and the piece is shown.
   subroutine end_piece(self, t_end, ending, switches, piece, observers, outcome)
      class(flow_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      integer, intent(in) :: ending
      logical, intent(in) :: switches
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: i

      if (allocated(self%tangent)) call arrive(self, ending, piece%duration)
      associate (transition => self%transition)
         if (self%system%constrained) call transition%accumulation%pass(piece%duration)
         self%anew = any(ending == [ends_in_event, ends_crossed]) .or. (transition%accumulation%landing &
                                                                        .and. .not. transition%accumulation%rest > 0.0_wp)
         if (switches) then
            call switch(self, piece)
         else if (self%anew .or. ending == ends_noted) then
            if (ending == ends_crossed) then
               do i = 1, transition%changes
                  transition%dynamics%mode%branch(transition%contact(i)) = transition%branch(i)
               end do
            else if (self%anew) then
               call settle(transition, self%system, self%hit, piece%duration, self%z)
               if (.not. transition%found) outcome%status = status_no_contact_forces
               outcome%impacts = outcome%impacts + transition%impacts
               outcome%accumulations = outcome%accumulations + transition%landed
            end if
            do i = 1, transition%changes
               if (is_beyond(self, transition%contact(i), transition%branch(i))) outcome%status = status_beyond_law
            end do
            if (transition%changes > 0) then
               piece%contact = transition%contact(1)
               piece%branch = transition%branch(1)
            end if
         end if
         if (piece%contact > 0) outcome%events = outcome%events + 1
      end associate
      ! The time of a switch does not depend on the state, and the tangents go on as they are.
      if (allocated(self%tangent) .and. self%anew .and. .not. switches .and. outcome%status == status_ok) then
         call leave(self, piece%duration)
      end if
      call show_piece(observers, piece)
      call add_time(self%time, self%time_low, piece%duration)
      if (.not. piece%last) return
      self%time = t_end
      self%time_low = 0.0_wp
   end subroutine end_piece

   !> Change the branches of all contacts whose stiffness switches at the end of the piece.
   subroutine switch(self, piece)
      class(flow_t), intent(inout) :: self
      type(piece_t), intent(inout) :: piece

      logical :: switched(size(self%branch))
      integer :: j

      associate (transition => self%transition)
         call self%switching%pass(self%system%machine, transition%dynamics%mode%branch, switched)
         transition%changes = 0
         do j = 1, size(switched)
            if (switched(j)) call transition%note(j, transition%dynamics%mode%branch(j))
         end do
         call transition%dynamics%mode%enter(self%system)
         piece%contact = transition%contact(1)
         piece%branch = transition%branch(1)
      end associate
      self%anew = .true.
   end subroutine switch

   !> The excitation has come to a break, or a stiffness has switched: what follows it, of the state as it is.
   subroutine pass_break(self, t_end, piece, observers, outcome)
      class(flow_t), intent(inout) :: self
      real(wp), intent(in) :: t_end
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      self%anew = .true.
      associate (transition => self%transition)
         transition%changes = 0
         if (transition%accumulation%landing .or. .not. self%finds_events) return
         call restart(transition, self%system, self%time, self%time_low, start_of_rates(self, t_end), self%z)
         if (.not. transition%found) outcome%status = status_no_contact_forces
         outcome%impacts = outcome%impacts + transition%impacts
         self%branch(:) = transition%dynamics%mode%branch
      end associate
      if (outcome%status == status_ok) call show_changes(self, 1, piece, observers, outcome)
      self%transition%changes = 0
   end subroutine pass_break

   !> Time over which rates of forces are taken from now on, s.
   pure function start_of_rates(self, t_end) result(delta)
      class(flow_t), intent(in) :: self
      real(wp), intent(in) :: t_end
      real(wp) :: delta

      delta = 1.0e-5_wp*min(t_end - self%time, 1.0_wp/max(self%system%fastest, tiny(1.0_wp)))
   end function start_of_rates

   !> Carry the tangents through a piece to its end, and into the event there.
   subroutine arrive(self, ending, duration)
      class(flow_t), intent(inout) :: self
      integer, intent(in) :: ending
      real(wp), intent(in) :: duration

      logical :: hit(size(self%hit))

      call self%transport()
      hit = self%hit .and. any(ending == [ends_in_event, ends_crossed])
      associate (transition => self%transition)
         call transition%dynamics%mode%enter(self%system)
         if (any(hit)) call transition%guards%list(self%system, transition%dynamics%mode)
         call transition%saltation%arrive(self%system, transition%dynamics, transition%guards, hit, duration, self%z, self%tangent)
      end associate
   end subroutine arrive

   !> Carry the tangents out of the event.
   subroutine leave(self, tau)
      class(flow_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      associate (transition => self%transition)
         call transition%dynamics%mode%enter(self%system)
         call transition%saltation%leave(self%system, transition%dynamics, tau, self%z, self%tangent)
         self%differentiable = transition%saltation%defined
      end associate
   end subroutine leave

   !> Show changes of branch from number `first` on as pieces of no duration in the mode that follows them.
   subroutine show_changes(self, first, piece, observers, outcome)
      class(flow_t), intent(inout) :: self
      integer, intent(in) :: first
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome

      integer :: i

      if (self%transition%changes < first) return
      call self%stand(outcome)
      if (outcome%status /= status_ok) return
      piece%time = self%time
      piece%time_low = self%time_low
      piece%duration = 0.0_wp
      piece%last = .false.
      do i = first, self%transition%changes
         piece%contact = self%transition%contact(i)
         piece%branch = self%transition%branch(i)
         outcome%events = outcome%events + 1
         call show_piece(observers, piece)
      end do
   end subroutine show_changes

   !> Time left until `t_end`, s.
   pure function remaining(self, t_end) result(time)
      class(flow_t), intent(in) :: self
      real(wp), intent(in) :: t_end
      real(wp) :: time

      time = (t_end - self%time) - self%time_low
   end function remaining

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(flow_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call self%system%to_coordinates(self%z, displacement, velocity)
   end subroutine final_state

   !> Of loads (n, loads) what moves the coordinates that are followed.
   pure function followed(self, load)
      class(flow_t), intent(in) :: self
      real(wp), intent(in) :: load(:, :)
      real(wp), allocatable :: followed(:, :)

      associate (mass => self%system%machine%mass, project => self%system%coupled%project, beside => self%system%beside)
         followed = matmul(mass, matmul(transpose(project), matmul(project, load)))
         if (beside%m > 0) followed = followed + matmul(mass, matmul(transpose(beside%project), matmul(beside%project, load)))
      end associate
   end function followed

end module razy_hybrid_flow
