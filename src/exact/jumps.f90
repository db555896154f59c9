!! Events of a machine with impacts or friction that is followed in closed form.
!!
!! What follows an event is settled by the same services as for Runge-Kutta methods: impacts of all contacts that touch and the
!! branches that fit the accelerations (razy_hybrid_transition), and the ends of accumulations of impacts
!! (razy_hybrid_accumulation). Here the two meet the states of the closed form: which watched function is which guard, how
!! large its rounding is, and with what signs compliant contacts press friction.
module razy_exact_jumps
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_hybrid_mode, only: treat_by_events
   use razy_exact_search_refine, only: watched_t
   use razy_hybrid_accumulation, only: bounces_t
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_transition, only: resolution_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: jumps_t

   !> Services and their workspace. The field counts its time from the start of the piece under way, and has its branches.
   type :: jumps_t
      type(field_t) :: field
      type(guards_t) :: guards
      type(resolution_t) :: resolution
      type(bounces_t) :: bounces
      !> Signs of the forces that press friction elements (contacts).
      integer, allocatable :: press(:)
      !> Impacts and ends of accumulations in the last event.
      integer :: impacts = 0, landed = 0
      logical, allocatable, private :: hit(:)
      real(wp), allocatable, private :: g(:), rate(:)
   contains
      procedure :: attach
      procedure :: begin
      procedure :: start_piece
      procedure :: prepare_search
      procedure :: take_sizes
      procedure :: cross
   end type jumps_t

contains

   !> Take a machine.
   subroutine attach(self, machine, keep_all, error)
      class(jumps_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      call self%field%attach(machine, keep_all, error)
      if (allocated(error)) return
      self%field%treatment = treat_by_events
      call self%guards%attach(self%field)
      call self%resolution%attach(self%field)
      call self%bounces%attach(self%field)
      if (allocated(self%press)) deallocate (self%press, self%hit, self%g, self%rate)
      allocate (self%press(size(machine%contact)), source=0)
      associate (n => size(self%guards%entry))
         allocate (self%hit(n), source=.false.)
         allocate (self%g(n), self%rate(n), source=0.0_wp)
      end associate
   end subroutine attach

   !> State and branches at the time 0, made consistent: out of rigid stops, impacts of what approaches, sticking or sliding. Rates
   !> of forces are differences over `delta`, s.
   subroutine begin(self, delta, z, found)
      class(jumps_t), intent(inout) :: self
      real(wp), intent(in) :: delta
      real(wp), intent(out) :: z(:)
      logical, intent(out) :: found

      logical :: moved

      call self%bounces%forget()
      call self%field%first_state(z)
      self%guards%delta = delta
      self%guards%count = 0
      call self%guards%measure(self%field, 0.0_wp, z, .true.)
      call self%resolution%push_out(self%field, self%guards, 0.0_wp, z, moved)
      found = self%resolution%found
      if (.not. found) return
      self%hit = .false.
      call self%resolution%settle(self%field, self%guards, self%hit, 0.0_wp, z)
      call after_impacts(self, 0.0_wp, z, found)
      call choose_press(self, z)
   end subroutine begin

   !> A piece starts at `time + time_low`, s, `duration` after the one before it, with the state z.
   subroutine start_piece(self, time, time_low, duration, delta, z)
      class(jumps_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_low, duration, delta
      real(wp), intent(inout) :: z(:)

      call self%bounces%count_from(duration)
      call self%field%start_piece(time, time_low)
      self%guards%delta = delta
      call self%field%keep_constraints(0.0_wp, z)
      call self%guards%watch(self%field)
      call self%guards%measure(self%field, 0.0_wp, z, .false.)
   end subroutine start_piece

   !> Tell the watched functions of a state what is rounding at z, and which of them start on their bounds: settled as the branches
   !> are, these move inwards, or rest if they are `fixed`.
   subroutine prepare_search(self, z, contact, function, next, fixed, watched)
      class(jumps_t), intent(inout) :: self
      real(wp), intent(in) :: z(:)
      integer, intent(in) :: contact(:), function(:), next(:)
      logical, intent(in) :: fixed(:)
      type(watched_t), intent(inout) :: watched(:)

      integer :: i, t

      call self%guards%look(self%field, 0.0_wp, z, self%g(:self%guards%count), self%rate(:self%guards%count))
      do t = 1, size(watched)
         watched(t)%from_zero = .false.
         watched(t)%at_rest = .false.
         watched(t)%floor = 0.0_wp
         if (function(t) < 0) cycle
         i = number_of(self, contact(t), function(t), next(t))
         watched(t)%floor = self%guards%noise(i)
         watched(t)%from_zero = abs(self%g(i)) <= self%guards%noise(i)
         watched(t)%at_rest = watched(t)%from_zero .and. fixed(t) .and. (function(t) == 0 .or. &
                                                                         abs(self%rate(i)) <= self%guards%on_rate(contact(t)))
      end do
   end subroutine prepare_search

   !> Take up the size of the terms that a state's watched functions are sums of, and with it what is rounding in s and s'. Flights
   !> are followed that are higher than 16 roundings (razy_hybrid_accumulation), so those of forms may be 16 times as
   !> large.
   subroutine take_sizes(self, contact, function, watched)
      class(jumps_t), intent(inout) :: self
      integer, intent(in) :: contact(:), function(:)
      type(watched_t), intent(in) :: watched(:)

      integer :: t

      do t = 1, size(watched)
         if (function(t) <= 0) cycle
         associate (slope => abs(self%field%machine%contact(contact(t))%law%slope(:, function(t))), j => contact(t))
            if (.not. slope(2) > 0.0_wp) then
               self%guards%size_s(j) = max(self%guards%size_s(j), watched(t)%scale/(16*slope(1)))
            else if (.not. slope(1) > 0.0_wp) then
               self%guards%size_rate(j) = max(self%guards%size_rate(j), watched(t)%scale/(16*slope(2)))
            end if
         end associate
      end do
   end subroutine take_sizes

   !> The guard of a contact's function beyond which the branch `next` lies; 0 if there is none.
   pure function number_of(self, contact, function, next) result(i)
      class(jumps_t), intent(in) :: self
      integer, intent(in) :: contact, function, next
      integer :: i

      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i))
            if (entry%contact == contact .and. entry%function == function .and. entry%next == next) return
         end associate
      end do
      i = 0
   end function number_of

   !> The event at (tau, z) where the guard of a contact's function was left (contact 0: none), or accumulations end: jumps of z,
   !> the branches of the field, and what has changed in `self%resolution`.
   subroutine cross(self, contact, function, next, tau, z, found)
      class(jumps_t), intent(inout) :: self
      integer, intent(in) :: contact, function, next
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: found

      logical :: lands

      found = .true.
      self%impacts = 0
      self%landed = 0
      self%resolution%changes = 0
      self%resolution%impacts = 0
      self%resolution%impacted = .false.
      if (contact > 0 .and. function < 0) then
         self%press(contact) = -self%press(contact)
         return
      end if
      lands = self%bounces%landing .and. .not. tau < self%bounces%tau
      if (contact > 0) then
         self%hit = .false.
         self%hit(number_of(self, contact, function, next)) = .true.
         call put_on_bound(self, number_of(self, contact, function, next), tau, z)
         call self%resolution%settle(self%field, self%guards, self%hit, tau, z)
         found = self%resolution%found
         if (.not. found) return
      end if
      if (lands) then
         call self%bounces%report(self%field, tau, self%resolution)
         self%landed = self%bounces%landed
      end if
      call after_impacts(self, tau, z, found)
      call choose_press(self, z)
   end subroutine cross

   !> Put z on the bound of guard i, where the closed form has it: the state is the sum of many terms, and errs by more than the
   !> function does.
   subroutine put_on_bound(self, i, tau, z)
      class(jumps_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: miss

      associate (entry => self%guards%entry(i), m => self%field%m)
         if (entry%function == 0) return
         call self%field%look_at_contacts(tau, z)
         associate (j => entry%contact)
            miss = entry%alpha*self%field%s(j) + entry%beta*self%field%rate(j) + entry%gamma - entry%bound
            associate (w => self%field%w(:, j))
               if (abs(entry%alpha) > 0.0_wp) then
                  z(:m) = z(:m) - w*(miss/(entry%alpha*dot_product(w, w)))
               else
                  z(m + 1:) = z(m + 1:) - w*(miss/(entry%beta*dot_product(w, w)))
               end if
            end associate
         end associate
      end associate
   end subroutine put_on_bound

   !> Count impacts, and carry those that have accumulated to the end of their sequence.
   subroutine after_impacts(self, tau, z, found)
      class(jumps_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: found

      logical :: gathered

      self%impacts = self%resolution%impacts
      call self%bounces%gather(self%field, self%guards, self%resolution, tau, z, gathered)
      found = self%resolution%found
   end subroutine after_impacts

   !> Signs of the forces of compliant contacts that press friction, at z where the field has just looked at the contacts.
   subroutine choose_press(self, z)
      class(jumps_t), intent(inout) :: self
      real(wp), intent(in) :: z(:)

      real(wp) :: force
      integer :: j

      do j = 1, size(self%press)
         associate (by => self%field%machine%contact(j)%normal_of)
            self%press(j) = 0
            if (by == 0) cycle
            associate (law => self%field%machine%contact(by)%law, branch => self%field%branch(by))
               if (law%constraint(branch)) cycle
               call self%field%look_at_contact(by, z)
               force = law%force(branch, self%field%s(by), self%field%rate(by), 0.0_wp)
               self%press(j) = merge(1, -1, force > 0.0_wp)
               ! Without damping the force has the sign of its side, also where it is on its edge.
               if (.not. law%branch(branch)%damping > 0.0_wp) self%press(j) = side_of(law%guard(1, branch)%above)
            end associate
         end associate
      end do
   end subroutine choose_press

   !> +1 on the upper side of a contact, whose branch ends below, -1 on the lower, which ends above.
   pure function side_of(above) result(side)
      integer, intent(in) :: above
      integer :: side

      side = merge(1, -1, above == 0)
   end function side_of

end module razy_exact_jumps
