!! The map of a state to the one some periods of the excitation later, P(x, p), with its derivative by x, as the propagator
!! finds it: what the map says is a motion, through whatever contacts it leads.
!!
!! x holds the coordinates and velocities z of razy_hybrid_system without displacements that neither springs nor contacts feel and
!! without velocities that dampers do not feel either, such as the rotation of a whole gear train: z = Q x with orthonormal Q.
!! Time goes from a phase of the excitation, in parts of its period; 0 is that of the input. Without excitation the duration is the
!! caller's.
module razy_orbits_periodic_period_map
   use razy_contact_contact_law, only: contact_law_t
   use razy_contact_friction_law, only: branch_sticking
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_flow, only: flow_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_null_space, only: complement_of, kernel_of, rank_bound
   use razy_motion_integrator, only: ask_stop, observer_slot_t, outcome_t, status_no_modes, status_ok
   use razy_observe_event_log, only: event_log_t
   implicit none(type, external)
   private

   public :: family_t, period_map_t, return_t

   !> Machines with parameters, and the method that moves them.
   type, abstract :: family_t
   contains
      procedure(make_motion), deferred :: make
      procedure(find_start), deferred :: start
   end type family_t

   abstract interface
      !> Prepare `by` with the machine at these values; the period of its excitation in s, 0 if there is none.
      !> Errors: no such machine, a method without derivatives, an excitation without a period.
      subroutine make_motion(self, parameter, by, period, error)
         import :: error_t, family_t, flow_t, wp
         implicit none(type, external)
         class(family_t), intent(inout) :: self
         real(wp), intent(in) :: parameter(:)
         class(flow_t), allocatable, intent(inout), target :: by
         real(wp), intent(out) :: period
         type(error_t), allocatable, intent(out) :: error
      end subroutine make_motion

      !> The displacements and velocities (n each) that the machine made last starts with.
      subroutine find_start(self, displacement, velocity, error)
         import :: error_t, family_t, wp
         implicit none(type, external)
         class(family_t), intent(inout) :: self
         real(wp), allocatable, intent(out) :: displacement(:), velocity(:)
         type(error_t), allocatable, intent(out) :: error
      end subroutine find_start
   end interface

   !> Where a motion comes to: x (n, after one another those of its parts), the derivative by the x at the start of each part
   !> (n, n, parts), the contacts on its way, an orthonormal basis of what frictions that stick all the way hold of the
   !> displacements (n, held), and these frictions.
   type :: return_t
      real(wp), allocatable :: x(:), derivative(:, :, :), held(:, :)
      integer, allocatable :: stuck(:)
      type(event_log_t) :: sequence
      type(outcome_t) :: outcome
   end type return_t

   type :: period_map_t
      class(family_t), allocatable :: family
      !> Unknowns, of which the first `positions` are displacements; period of the excitation, s
      integer :: n = 0, positions = 0
      real(wp) :: period = 0.0_wp
      !> Phase at which motions begin, 0 to 1.
      real(wp) :: phase = 0.0_wp
      class(flow_t), allocatable :: by
      !> Asked now and then during a motion, if it is associated: whether the motion is to end at once.
      procedure(ask_stop), pointer, nopass :: stop_is_asked => null()
      real(wp), allocatable, private :: parameter(:), basis(:, :)
      integer, private :: structure = -1
      !> Contacts that are kept in one branch each, and which guards do not count: 1 upper, -1 lower, 0 both.
      integer, allocatable, private :: kept(:), branch(:), side(:)
   contains
      procedure :: go_to
      procedure :: keep
      procedure :: keep_unchanged
      procedure :: go
      procedure :: first_state
      procedure :: from_coordinates
      procedure :: to_coordinates
      procedure :: law_of
   end type period_map_t

   integer(i8), parameter :: most_events = 100000_i8
   !> What sticks has a speed of rounding where a motion begins, so that it comes to stick at once: that is no event.
   real(wp), parameter :: at_once = 1.0e-12_wp

contains

   !> Take the machine at these values of the parameters. Where there is none, the period stays that of the one before: whether
   !> there is excitation hangs on no value.
   subroutine go_to(self, parameter, error)
      class(period_map_t), intent(inout), target :: self
      real(wp), intent(in) :: parameter(:)
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: period
      integer :: i

      if (allocated(self%parameter)) then
         if (.not. any(abs(self%parameter - parameter) > 0.0_wp)) return
         deallocate (self%parameter)
      end if
      call self%family%make(parameter, self%by, period, error)
      if (allocated(error)) return
      self%period = period
      associate (system => self%by%system)
         if (system%structure /= self%structure .or. .not. allocated(self%basis)) then
            call find_basis(self%basis, self%positions, system)
            self%structure = system%structure
         end if
         self%n = size(self%basis, 2)
         if (allocated(self%kept)) then
            do i = 1, size(self%kept)
               associate (law => system%machine%contact(self%kept(i))%law, branch => self%branch(i))
                  law%home = branch
                  if (self%side(i) >= 0) law%branch(branch)%guard%above = 0
                  if (self%side(i) <= 0) law%branch(branch)%guard%below = 0
               end associate
            end do
         end if
      end associate
      self%parameter = parameter
   end subroutine go_to

   !> Keep contacts of the machines to come in one branch each, whatever its guards on this side say, and no others any more.
   pure subroutine keep(self, contact, branch, side)
      class(period_map_t), intent(inout) :: self
      integer, intent(in) :: contact(:), branch(:), side(:)

      self%kept = contact
      self%side = side
      self%branch = branch
      if (allocated(self%parameter)) deallocate (self%parameter)
   end subroutine keep

   !> Keep the contacts that never change in a motion with these events, so that its neighbours have no others.
   pure subroutine keep_unchanged(self, sequence)
      class(period_map_t), intent(inout) :: self
      type(event_log_t), intent(in) :: sequence

      integer :: i

      associate (same => sequence%never_change())
         call self%keep(same, [(sequence%begins_in(same(i)), i=1, size(same))], 0*same)
      end associate
   end subroutine keep_unchanged

   !> Orthonormal Q without displacements that neither springs nor contacts feel and without velocities that dampers do not feel
   !> either; `positions` of its columns are displacements.
   subroutine find_basis(basis, positions, system)
      real(wp), allocatable, intent(out) :: basis(:, :)
      integer, intent(out) :: positions
      type(system_t), intent(in) :: system

      real(wp), allocatable :: free(:, :), moves(:, :), speeds(:, :)
      logical :: acts(size(system%machine%contact))
      integer :: j, rigid

      ! Friction feels velocities alone.
      acts = [(.not. system%machine%contact(j)%law%of_normal, j=1, size(acts))]
      call system%free%in_state(acts, spread(.true., 1, size(acts)), free, rigid)
      moves = complement_of(free)
      speeds = complement_of(free(:, :rigid))
      positions = size(moves, 2)
      associate (m => system%m)
         allocate (basis(2*m, positions + size(speeds, 2)), source=0.0_wp)
         basis(:m, :positions) = moves
         basis(m + 1:, positions + 1:) = speeds
      end associate
   end subroutine find_basis

   !> The motion from x for `duration`, s; observers see it. With `derivative` it carries its derivative along. x of more than n
   !> elements are the states at the beginning of as many parts of the same length, each of which is followed from its own.
   subroutine go(self, x, duration, derivative, back, observers)
      class(period_map_t), intent(inout), target :: self
      real(wp), intent(in) :: x(:), duration
      logical, intent(in) :: derivative
      type(return_t), intent(inout), target :: back
      type(observer_slot_t), intent(in), optional :: observers(:)

      type(observer_slot_t), allocatable :: slots(:)
      logical, allocatable :: stuck(:)
      logical :: goes_on
      real(wp) :: length
      integer :: before, i, j

      allocate (slots(1))
      slots(1)%observer => back%sequence
      if (present(observers)) slots = [slots, observers]
      back%x = x
      associate (by => self%by, n => self%n, parts => size(x)/self%n)
         length = duration/parts
         call back%sequence%attach(by%system%machine, duration)
         call back%sequence%attend_friction(by%system%machine)
         by%budget%stop_is_asked => self%stop_is_asked
         goes_on = by%budget%goes_on
         if (derivative) back%derivative = reshape([real(wp) ::], [n, n, parts], [0.0_wp])
         associate (contact => by%system%machine%contact, seen => back%sequence)
            stuck = [(contact(j)%law%of_normal, j=1, size(contact))]
            do i = 1, parts
               ! A product as it stands is written beyond a shorter vector by gfortran 12.
               by%first = [matmul(self%basis, x(n*(i - 1) + 1:n*i))]
               by%from = self%phase*self%period + (i - 1)*length
               by%budget%goes_on = goes_on .or. i > 1
               if (allocated(by%tangent)) deallocate (by%tangent)
               if (derivative) by%tangent = self%basis
               before = seen%count
               call by%run(by%from + length, most_events, slots, back%outcome)
               back%x(n*(i - 1) + 1:n*i) = matmul(by%z, self%basis)
               if (back%outcome%status /= status_ok) exit
               ! Of what sticks at the end no rounding is left.
               if (derivative) call by%transition%saltation%hold(by%system, by%transition%dynamics, by%tangent)
               if (derivative) back%derivative(:, :, i) = matmul(transpose(self%basis), by%tangent)
               call seen%forget_between(before, by%from + at_once*length)
               stuck = stuck .and. by%branch == branch_sticking
            end do
            by%budget%goes_on = goes_on
            if (self%period > 0.0_wp) call seen%place_among_jumps(by%system%machine, self%period)
            back%stuck = pack([(j, j=1, size(contact))], [(stuck(j) .and. all(seen%contact(:seen%count) /= j), &
                                                           j=1, size(contact))])
         end associate
         call find_held(self%basis(:by%system%m, :), by%system%w, back)
      end associate
   end subroutine go

   !> What the frictions that stick hold of the displacements that count (orthonormal columns of `moves`, or 0) against each other
   !> and the frame, and which of them do so: others hold what may be anywhere, as a body that drifts along with another.
   subroutine find_held(moves, directions, back)
      real(wp), intent(in) :: moves(:, :), directions(:, :)
      type(return_t), intent(inout) :: back

      real(wp), allocatable :: free(:, :), share(:, :), w(:, :)
      integer :: info

      w = directions(:, back%stuck)/spread(max(norm2(directions(:, back%stuck), 1), tiny(1.0_wp)), 1, size(moves, 1))
      call kernel_of(transpose(w - matmul(moves, matmul(transpose(moves), w))), share, info)
      if (info == 0) call kernel_of(matmul(w, share), free, info)
      if (info /= 0) back%outcome%status = status_no_modes
      if (info /= 0) return
      back%held = matmul(transpose(moves), complement_of(free))
      back%stuck = pack(back%stuck, norm2(share, 2) > rank_bound .and. size(back%held, 2) > 0)
   end subroutine find_held

   !> x of the machine's own start.
   subroutine first_state(self, x, error)
      class(period_map_t), intent(inout) :: self
      real(wp), allocatable, intent(out) :: x(:)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: displacement(:), velocity(:)

      call self%family%start(displacement, velocity, error)
      if (.not. allocated(error)) x = self%from_coordinates([displacement, velocity])
   end subroutine first_state

   !> x of the machine's displacements, then its velocities.
   function from_coordinates(self, state) result(x)
      class(period_map_t), intent(in) :: self
      real(wp), intent(in) :: state(:)
      real(wp), allocatable :: x(:)

      associate (n => size(self%by%system%machine%displacement))
         x = matmul(self%by%system%from_coordinates(state(:n), state(n + 1:)), self%basis)
      end associate
   end function from_coordinates

   !> Displacements and velocities of the machine (2, coordinates) with this x; where contacts and observables do not feel the
   !> whole machine, the part that they feel.
   function to_coordinates(self, x) result(state)
      class(period_map_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), allocatable :: state(:)

      integer :: n

      n = size(self%by%system%machine%displacement)
      state = spread(0.0_wp, 1, 2*n)
      call self%by%system%to_coordinates(matmul(self%basis, x), state(:n), state(n + 1:))
   end function to_coordinates

   !> The law of a contact of the machine.
   function law_of(self, contact) result(law)
      class(period_map_t), intent(in) :: self
      integer, intent(in) :: contact
      class(contact_law_t), allocatable :: law

      allocate (law, source=self%by%system%machine%contact(contact)%law)
   end function law_of

end module razy_orbits_periodic_period_map
