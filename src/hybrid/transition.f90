!! What is known of an event while it is settled: the state of all contacts before and after, and what one phase of
!! razy_hybrid_event_settle hands to the next; between events, the mode that holds.
module razy_hybrid_transition
   use razy_core_kinds, only: wp
   use razy_hybrid_accumulation, only: accumulation_t
   use razy_hybrid_active_sides, only: side_t
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_saltation, only: saltation_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_complementarity_impact, only: impact_problem_t
   implicit none(type, external)
   private

   public :: most_passed, transition_t

   type :: transition_t
      !> The mode that follows the last event, and its guards.
      type(dynamics_t) :: dynamics
      type(guards_t) :: guards
      type(accumulation_t) :: accumulation
      !> Derivatives across events, if they are wanted.
      type(saltation_t) :: saltation
      !> Whether admissible impulses and forces were found.
      logical :: found = .true.
      !> Contacts whose branch has changed or that had an impact (the first `changes`), and the branches that follow. Branches that
      !> were passed in no time come first, then all others in the order of their contacts.
      integer :: changes = 0
      integer, allocatable :: contact(:), branch(:)
      !> Impacts, and ends of accumulations.
      integer :: impacts = 0, landed = 0
      !> Rigid sides that touch (the first `sides`).
      integer :: sides = 0
      type(side_t), allocatable :: side(:)
      !> Twice the kinetic energy that contacts gave, or took, and may not, and the most that there was before an event, in the
      !> motion so far.
      real(wp) :: energy = 0.0_wp, most = 0.0_wp
      !> The problem of the last impact, for its room.
      type(impact_problem_t) :: problem
      !> Branches that follow, and those before the event; friction elements that rest; constraints that have been let go of. Where
      !> friction that weakens as it begins to slide has come to its limit, the branch that it would slide in, else 0.
      integer, allocatable :: next(:), before(:), yielding(:)
      logical, allocatable :: resting(:), let_go(:)
      !> Contacts on what an event moves or what is joined with it; all others stay as they are, whose forces may not be unique.
      logical, allocatable :: stirred(:)
      !> Contacts that were let go of at the event before and whose guard is left again at once: what holds them is rounding.
      logical, allocatable :: again(:)
      !> y' (m) before the impacts of the event.
      real(wp), allocatable :: arriving(:)
      !> Edges that were left (lower and upper, contacts).
      logical, allocatable :: left(:, :)
   contains
      procedure :: make_room
      procedure :: note
   end type transition_t

   !> Branches that one contact may pass in no time, with the one that holds.
   integer, parameter :: most_passed = 9

contains

   !> Make room for a system; `sharpness` > 0: its laws are smoothed.
   subroutine make_room(self, system, sharpness)
      class(transition_t), intent(out) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: sharpness

      integer :: n

      n = size(system%machine%contact)
      call self%dynamics%make_room(system, sharpness)
      call self%guards%make_room(system)
      allocate (self%contact(most_passed*n), self%branch(most_passed*n), self%next(n), self%before(n), &
                self%yielding(n), source=0)
      allocate (self%resting(n), self%let_go(n), self%again(n), self%stirred(n), self%left(2, n), source=.false.)
      allocate (self%side(2*n), self%arriving(system%m))
   end subroutine make_room

   !> Add a change to the list.
   pure subroutine note(self, j, branch)
      class(transition_t), intent(inout) :: self
      integer, intent(in) :: j, branch

      self%changes = self%changes + 1
      self%contact(self%changes) = j
      self%branch(self%changes) = branch
   end subroutine note

end module razy_hybrid_transition
