!! What every integrator is to the programs and observers: it follows a motion and shows every smooth piece of it.
!!
!! An observer gets each piece as it is finished and asks the integrator, through the services below, for the motion at any
!! time of it; a closed form, a dense output or a time-stepping scheme answers. The services are about the piece being shown
!! and about nothing after `run` has ended, but for `final_state`.
module razy_motion_integrator
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: integrators
   implicit none(type, external)
   private

   public :: add_observer, ask_stop, budget_t, glimpse_t, integrator_t, observer_slot_t, observer_t, outcome_t, piece_t, &
      & show_piece, status_meanings
   public :: status_ok, status_event_limit, status_chatter, status_blow_up, status_no_modes, status_no_machine
   public :: status_step_underflow, status_step_limit, status_no_contact_forces, status_time_limit, status_interrupted
   public :: status_beyond_law, status_costly, status_inaccurate, status_not_computed

   !> How a run ended.
   integer, parameter :: status_ok = 0, status_event_limit = 1, status_chatter = 2, status_blow_up = 3, status_no_modes = 4, &
                         status_no_machine = 5, status_step_underflow = 6, status_step_limit = 7, status_no_contact_forces = 8, &
                         status_time_limit = 9, status_interrupted = 10, status_not_computed = 11, &
                         status_inaccurate = 12, status_beyond_law = 13, status_costly = 14
   character(*), parameter :: status_meanings(0:14) = [character(32) :: &
                                                       "ok", "event limit reached", "chatter limit reached", "blow-up", &
                                                       "eigenproblem failed", "no machine with this value", "step underflow", &
                                                       "step limit reached", "no admissible contact forces", &
                                                       "time limit reached", "interrupted", "not computed yet", &
                                                       "closed form inaccurate", "beyond the table of a law", &
                                                       "closed forms do not pay"]

   !> Result and counters of a run; a counter that a method does not have stays 0.
   type :: outcome_t
      integer :: status = status_ok
      !> Number of the method in `integrators` (razy_motion_method) that followed the motion; 1: none has.
      integer :: integrator = 1
      !> Time reached, s.
      real(wp) :: time = 0.0_wp
      !> Changes of branch; steps taken (accepted), rejected; smooth pieces.
      integer(i8) :: events = 0, steps = 0, rejected = 0, pieces = 0
      !> Right-hand sides, Jacobian matrices, factorisations, impacts (jumps of the velocity), accumulations of impacts.
      integer(i8) :: evaluations = 0, jacobians = 0, factorisations = 0, impacts = 0, accumulations = 0
      !> Guards that turned away from their bounds nearer than the method knows them (Runge-Kutta with events).
      integer(i8) :: near_misses = 0
      !> Modes that the motion came to (exact).
      integer :: states = 0
      !> By how much the closed forms that the motion came through (exact), and its balances where they were looked at, miss the
      !> machine's equations, over the size of the terms; 1 if that is more than the method allows.
      real(wp) :: residual = 0.0_wp
      integer :: unbalanced = 0
      !> Branches of the contacts when it ended; of methods that know events.
      integer, allocatable :: branch(:)
   contains
      procedure :: columns
   end type outcome_t

   !> A time, s, longer than any motion, whose products with numbers of steps are numbers.
   real(wp), parameter :: long = 1.0e200_wp

   !> What a motion may take, and who may end it. A method calls `spend` for each of its steps; from then on `status` says whether
   !> the motion may go on.
   type :: budget_t
      integer(i8) :: most_steps = huge(1_i8)
      !> Time on the clock, s.
      real(wp) :: most_seconds = huge(1.0_wp)
      procedure(ask_stop), pointer, nopass :: stop_is_asked => null()
      !> Run by run, a motion in parts: the clock goes on from one to the next.
      logical :: goes_on = .false.
      integer :: status = status_ok
      !> Steps so far, and those after which clock and `stop_is_asked` are looked at.
      integer(i8), private :: steps = 0, next_look = 0
      real(wp), private :: begun = 0.0_wp
      !> When the pace was looked at last: steps so far, and what was left of the motion, s; how often it was too slow.
      integer(i8), private :: steps_then = 0
      real(wp), private :: rest_then = long
      integer, private :: slow = 0
   contains
      procedure :: begin
      procedure :: spend
   end type budget_t

   !> An observable at a moment, for those who look for its extrema.
   type :: glimpse_t
      !> Value, and size of the terms that it is the sum of (its rounding is some epsilon of that).
      real(wp) :: value = 0.0_wp, size = 0.0_wp
      !> Sign of the first derivative that is not rounding; 0: the observable does not move.
      integer :: direction = 0
   end type glimpse_t

   !> A smooth piece of the motion.
   type :: piece_t
      !> Time of its start, s (sum of both), and its duration, s.
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp, duration = 0.0_wp
      !> Whether the motion ends with this piece.
      logical :: last = .false.
      !> The contact whose branch changes at its end, and the branch that follows; 0 if there is no event.
      integer :: contact = 0, branch = 0
      !> Who answers questions about it.
      class(integrator_t), pointer :: by => null()
   end type piece_t

   !> What watches a motion: `attach`, then each piece, then what was seen as columns of a result.
   type, abstract :: observer_t
      !> Start of recording, s.
      real(wp) :: from = 0.0_wp
   contains
      procedure :: attach
      procedure(on_piece), deferred :: piece
      procedure :: forget
      procedure :: columns => no_columns
   end type observer_t

   !> An observer of any type, for lists of them.
   type :: observer_slot_t
      class(observer_t), pointer :: observer => null()
   end type observer_slot_t

   !> A method of integration. Times `tau` are s after the start of the piece, in [0, duration].
   type, abstract :: integrator_t
      type(budget_t) :: budget
      !> Branches in the piece being shown (contacts).
      integer, allocatable :: branch(:)
      !> Whether the state there is that of all that is followed: no mode that nothing feels was left out.
      logical :: complete = .true.
      !> The fastest exponent of what is followed and no contact feels, 1/s.
      real(wp) :: aside = 0.0_wp
      !> Whether impacts lie within pieces, as forces of a time step, and no velocity jumps from piece to piece.
      logical :: spreads_impacts = .false.
   contains
      !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
      procedure(take_machine), deferred :: prepare
      !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
      procedure(run_motion), deferred :: run
      !> Value of observable `form`.
      procedure(value_at), deferred :: value
      !> The same with its size and direction.
      procedure(glimpse_at), deferred :: glimpse
      !> The next extremum of observable `form` after `tau`, up to `tau_end`, while it moves in `direction` (+1, -1). `turned`:
      !> the piece has an extremum at `tau` itself, which was found before.
      procedure(find_turn), deferred :: next_turn
      !> Displacements and velocities of all coordinates (n each); of what is followed without `keep_all`.
      procedure(state_at), deferred :: state
      !> Variable s, rate s' and reported force of contact j.
      procedure(contact_at), deferred :: contact
      !> A time between points that resolves the motion, s.
      procedure(natural_interval), deferred :: interval
      !> Displacements and velocities (n each) that the last run ended with; needs `keep_all`.
      procedure(end_state), deferred :: final_state
      !> Integrals over the rest of the piece of what a contact does, where the integrator has a closed form of them.
      procedure :: contact_sums
      !> The part of loads that moves what is followed.
      procedure :: followed
   end type integrator_t

   !> Steps from one look at the clock to the next.
   integer(i8), parameter :: steps_between_looks = 1024_i8
   !> The pace of steps is looked at in so many parts of those there may be; a motion is given up if so many times one after the
   !> other it was such that the steps that are left would not do.
   integer(i8), parameter :: parts = 64
   integer, parameter :: most_slow = 4

   abstract interface
      !> Whether a motion is to end at once.
      logical function ask_stop()
         implicit none(type, external)
      end function ask_stop

      subroutine on_piece(self, part)
         import :: observer_t, piece_t
         implicit none(type, external)
         class(observer_t), intent(inout) :: self
         type(piece_t), intent(in) :: part
      end subroutine on_piece

      subroutine take_machine(self, machine, keep_all, error)
         import :: error_t, integrator_t, machine_t
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         type(machine_t), intent(in) :: machine
         logical, intent(in) :: keep_all
         type(error_t), allocatable, intent(out) :: error
      end subroutine take_machine

      subroutine run_motion(self, t_end, most_events, observers, outcome)
         import :: i8, integrator_t, observer_slot_t, outcome_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout), target :: self
         real(wp), intent(in) :: t_end
         integer(i8), intent(in) :: most_events
         type(observer_slot_t), intent(in) :: observers(:)
         type(outcome_t), intent(out) :: outcome
      end subroutine run_motion

      function value_at(self, form, tau) result(value)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         integer, intent(in) :: form
         real(wp), intent(in) :: tau
         real(wp) :: value
      end function value_at

      subroutine glimpse_at(self, form, tau, seen)
         import :: glimpse_t, integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         integer, intent(in) :: form
         real(wp), intent(in) :: tau
         type(glimpse_t), intent(out) :: seen
      end subroutine glimpse_at

      subroutine find_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         integer, intent(in) :: form, direction
         real(wp), intent(in) :: tau, tau_end
         logical, intent(in) :: turned
         logical, intent(out) :: found
         real(wp), intent(out) :: tau_found, value
      end subroutine find_turn

      subroutine state_at(self, tau, displacement, velocity)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         real(wp), intent(in) :: tau
         real(wp), intent(out) :: displacement(:), velocity(:)
      end subroutine state_at

      subroutine contact_at(self, j, tau, s, rate, force)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(inout) :: self
         integer, intent(in) :: j
         real(wp), intent(in) :: tau
         real(wp), intent(out) :: s, rate, force
      end subroutine contact_at

      pure function natural_interval(self) result(interval)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(in) :: self
         real(wp) :: interval
      end function natural_interval

      subroutine end_state(self, displacement, velocity)
         import :: integrator_t, wp
         implicit none(type, external)
         class(integrator_t), intent(in) :: self
         real(wp), intent(out) :: displacement(:), velocity(:)
      end subroutine end_state
   end interface

contains

   !> One observer more, which has to be a target.
   subroutine add_observer(slots, observer)
      type(observer_slot_t), allocatable, intent(inout) :: slots(:)
      class(observer_t), intent(in), target :: observer

      type(observer_slot_t) :: slot

      slot%observer => observer
      slots = [slots, slot]
   end subroutine add_observer

   !> Begin anew with a motion of a machine until `t_end`, s.
   subroutine attach(self, machine, t_end)
      class(observer_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      associate (unused_machine => machine, unused_end => t_end)
         call self%forget()
      end associate
   end subroutine attach

   !> Nothing was seen.
   subroutine forget(self)
      class(observer_t), intent(inout) :: self

      associate (unused => self)
      end associate
   end subroutine forget

   !> Hand over what was seen of a motion of a machine; here nothing.
   subroutine no_columns(self, table, machine)
      class(observer_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      associate (unused => self, unused_table => table, unused_machine => machine)
      end associate
   end subroutine no_columns

   !> A motion begins, or its next part.
   subroutine begin(self)
      class(budget_t), intent(inout) :: self

      self%status = status_ok
      self%steps = 0
      self%next_look = 0
      self%steps_then = 0
      self%rest_then = long
      self%slow = 0
      if (.not. self%goes_on) self%begun = seconds()
   end subroutine begin

   !> One step more. `rest`: what is left of the motion, s, by methods whose steps may become so short that it is never over.
   subroutine spend(self, rest)
      class(budget_t), intent(inout) :: self
      real(wp), intent(in), optional :: rest

      self%steps = self%steps + 1
      if (self%steps > self%next_look) call look(self, rest)
   end subroutine spend

   !> See what is left.
   subroutine look(self, rest)
      type(budget_t), intent(inout) :: self
      real(wp), intent(in), optional :: rest

      logical :: stop

      stop = .false.
      if (associated(self%stop_is_asked)) stop = self%stop_is_asked()
      if (stop) then
         self%status = status_interrupted
      else if (self%steps > self%most_steps) then
         self%status = status_step_limit
      else if (seconds() - self%begun > self%most_seconds) then
         self%status = status_time_limit
      else
         self%next_look = min(self%steps + steps_between_looks, self%most_steps)
         if (present(rest)) call look_at_pace(self, rest)
      end if
   end subroutine look

   !> Whether the motion comes to its end at the pace of the last steps, s of it each.
   subroutine look_at_pace(self, rest)
      type(budget_t), intent(inout) :: self
      real(wp), intent(in) :: rest

      integer(i8) :: taken
      real(wp) :: passed

      taken = self%steps - self%steps_then
      if (taken < self%most_steps/parts) return
      passed = self%rest_then - rest
      self%slow = merge(self%slow + 1, 0, rest*real(taken, wp) > passed*real(self%most_steps - self%steps, wp))
      if (self%slow >= most_slow) self%status = status_step_limit
      self%steps_then = self%steps
      self%rest_then = rest
   end subroutine look_at_pace

   real(wp) function seconds()
      integer(i8) :: ticks, rate

      call system_clock(ticks, rate)
      seconds = real(ticks, wp)/real(rate, wp)
   end function seconds

   !> Of contact j from `tau` to the end of the piece: integral of its reported force, work done on its law, and `largest` raised
   !> to the largest magnitude of the force. `known` is false where the integrator has no closed form, as here; then the others
   !> are left as they are.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(integrator_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      associate (unused_1 => self, unused_2 => j, unused_3 => tau, unused_4 => [largest, impulse, work])
         known = .false.
      end associate
   end subroutine contact_sums

   !> Of loads (n, loads) what moves the coordinates that are followed: all of it here.
   pure function followed(self, load)
      class(integrator_t), intent(in) :: self
      real(wp), intent(in) :: load(:, :)
      real(wp), allocatable :: followed(:, :)

      associate (unused => self)
         followed = load
      end associate
   end function followed

   !> Hand over status and counters as single values of `group`, such as `/outcome/`; `brief`: only those that a sweep stores of
   !> each point.
   subroutine columns(self, table, group, brief)
      class(outcome_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: group
      logical, intent(in) :: brief

      integer :: i

      call table%add(group//"status", self%status, "1", "how the motion ended")
      if (brief) call table%note_meanings([(i, i=0, ubound(status_meanings, 1))], status_meanings)
      if (.not. brief) call table%note("meanings", status_meanings)
      call table%add(group//"events", self%events, "1", "changes of branch of contacts")
      call table%add(group//"steps", self%steps, "1", "steps of the integrator")
      call table%add(group//"near_misses", self%near_misses, "1", &
                     "switching functions that turned nearer to a bound than resolved")
      call table%add(group//"residual", self%residual, "1", &
                     "what the motion misses in the machine's equations and balances, over the size of their terms")
      call table%add(group//"unbalanced", self%unbalanced, "1", "1 = that is more than the method allows")
      call table%add(group//"integrator", self%integrator, "1", "method that followed the motion")
      call table%note_meanings([(i, i=1, size(integrators))], integrators)
      if (brief) return
      call table%add(group//"time", self%time, "s", "time reached")
      call table%add(group//"rejected", self%rejected, "1", "steps rejected")
      call table%add(group//"rhs_evaluations", self%evaluations, "1", "right-hand sides")
      call table%add(group//"jacobians", self%jacobians, "1", "Jacobian matrices")
      call table%add(group//"factorisations", self%factorisations, "1", "factorisations of matrices")
      call table%add(group//"impacts", self%impacts, "1", "jumps of the velocity")
      call table%add(group//"accumulations", self%accumulations, "1", "accumulations of impacts carried to their end")
   end subroutine columns

   !> Show a piece to all observers.
   subroutine show_piece(observers, piece)
      type(observer_slot_t), intent(in) :: observers(:)
      type(piece_t), intent(in) :: piece

      integer :: i

      do i = 1, size(observers)
         call observers(i)%observer%piece(piece)
      end do
   end subroutine show_piece

end module razy_motion_integrator
