!! The list of all events of a motion: the contact sequence, which contacts change to which branch, one after the other.
module razy_observe_event_log
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: table_t
   use razy_core_tone, only: jumps_until, tone_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: event_log_t

   type, extends(observer_t) :: event_log_t
      !> Number of events; time in s, never falling, contact and branch entered: the first `count` are valid.
      integer :: count = 0
      real(wp), allocatable :: time(:)
      integer, allocatable :: contact(:), branch(:)
      !> Contacts that motions without events are told apart by, and the branches they begin with; 0: not yet seen.
      integer, allocatable, private :: watched(:), first(:)
      !> The stop without whose push friction does nothing (contacts; 0: none), which of its branches are closed (branches,
      !> contacts), and whether it has just come to one.
      integer, allocatable, private :: rubs_on(:)
      logical, allocatable, private :: shut(:, :), closing(:)
      !> How long the motion takes, s, and the period of its loads.
      real(wp), private :: duration = 0.0_wp, period = 0.0_wp
      !> How many jumps of loads come before each event, `nowhere` if it does not feel them, and in a period.
      integer, allocatable, private :: jumps(:)
      integer, private :: jumps_in_period = 0
   contains
      procedure :: attach
      procedure :: attend_friction
      procedure :: forget
      procedure :: forget_between
      procedure :: place_among_jumps
      procedure :: piece
      procedure :: columns
      procedure :: is_like
      procedure :: difference
      procedure :: begins_in
      procedure :: never_change
      procedure :: changes_to
   end type event_log_t

   !> Bounces are not told apart where so little is left of the time from the first of them to when the contact stays closed.
   real(wp), parameter :: little = 1.0e-4_wp
   !> Changes of contacts no farther apart than this part of the time of a motion come in an order of rounding.
   real(wp), parameter :: at_once = 1.0e-12_wp
   integer, parameter :: nowhere = -huge(1)

contains

   !> Begin anew with a machine: contacts with a gap tell its motions without events apart.
   subroutine attach(self, machine, t_end)
      class(event_log_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      integer :: j

      call self%forget()
      self%duration = t_end
      associate (contact => machine%contact)
         self%watched = pack([(j, j=1, size(contact))], [(.not. contact(j)%law%of_normal, j=1, size(contact))])
      end associate
      self%first = 0*self%watched
   end subroutine attach

   !> Note the branch of friction also where the stop that it acts with closes and it stays: while that is open it does nothing, and
   !> its branch is that of a slip before, or of where the motion begins.
   subroutine attend_friction(self, machine)
      class(event_log_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine

      integer :: j

      associate (contact => machine%contact)
         self%rubs_on = merge(contact%only_with, merge(0, contact%normal_of, abs(contact%normal) > 0.0_wp), contact%only_with > 0)
         self%closing = self%rubs_on < 0
         self%shut = spread(self%closing, 1, maxval([(size(contact(j)%law%branch), j=1, size(contact)), 0]))
         do j = 1, size(contact)
            self%shut(:size(contact(j)%law%branch), j) = contact(j)%law%branch%closed
         end do
      end associate
   end subroutine attend_friction

   subroutine forget(self)
      class(event_log_t), intent(inout) :: self

      self%count = 0
      self%watched = [integer ::]
      self%first = [integer ::]
      if (.not. allocated(self%time)) allocate (self%time(16), self%contact(16), self%branch(16))
   end subroutine forget

   !> Forget the events behind the first so many, up to a time, s.
   pure subroutine forget_between(self, first, time)
      class(event_log_t), intent(inout) :: self
      integer, intent(in) :: first
      real(wp), intent(in) :: time

      integer :: early

      early = count(self%time(first + 1:self%count) <= time)
      if (early == 0) return
      self%count = self%count - early
      self%time(first + 1:self%count) = self%time(first + early + 1:self%count + early)
      self%contact(first + 1:self%count) = self%contact(first + early + 1:self%count + early)
      self%branch(first + 1:self%count) = self%branch(first + early + 1:self%count + early)
   end subroutine forget_between

   !> Tell the motion from others by the jumps of periodic loads between its events, too: an impact, or friction that comes to
   !> stick, makes another derivative of what follows on each side of it. Other events do not, as their speed does not jump.
   pure subroutine place_among_jumps(self, machine, period)
      class(event_log_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: period

      integer :: i

      self%period = period
      self%jumps_in_period = jumps_until(machine%tone, period) - jumps_until(machine%tone, 0.0_wp)
      if (self%jumps_in_period == 0) return
      self%jumps = spread(nowhere, 1, self%count)
      do i = 1, self%count
         associate (law => machine%contact(self%contact(i))%law)
            if (law%impacts .or. law%of_normal) self%jumps(i) = jumps_until(machine%tone, self%time(i))
         end associate
      end do
   end subroutine place_among_jumps

   !> Note the event that ends a piece.
   subroutine piece(self, part)
      class(event_log_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      integer :: i

      if (.not. allocated(self%time)) call self%forget()
      if (any(self%first == 0)) self%first = [(part%by%branch(self%watched(i)), i=1, size(self%watched))]
      if (allocated(self%closing) .and. part%duration > 0.0_wp) then
         do i = 1, size(self%closing)
            if (.not. self%closing(i)) cycle
            associate (stop => self%rubs_on(i))
               if (self%shut(part%by%branch(stop), stop)) call note(self%time(self%count), i, part%by%branch(i))
            end associate
         end do
         self%closing = .false.
      end if
      if (part%contact == 0) return
      call note(part%time + (part%time_low + part%duration), part%contact, part%branch)
      if (allocated(self%closing)) self%closing = part%contact == self%rubs_on .or. &
                                                  self%closing .and. [(i /= part%contact, i=1, size(self%closing))]

   contains

      subroutine note(time, contact, branch)
         real(wp), intent(in) :: time
         integer, intent(in) :: contact, branch

         if (self%count == size(self%time)) then
            call resize(self%time, 2_i8*self%count)
            call resize(self%contact, 2_i8*self%count)
            call resize(self%branch, 2_i8*self%count)
         end if
         self%count = self%count + 1
         self%time(self%count) = time
         ! The end of a piece and the start of the next are one moment, but sums of other terms.
         if (self%count > 1) self%time(self%count) = max(self%time(self%count - 1), time)
         self%contact(self%count) = contact
         self%branch(self%count) = branch
      end subroutine note

   end subroutine piece

   !> Hand over the events of a machine with contacts, as lists of `/event`.
   subroutine columns(self, table, machine)
      class(event_log_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      character(*), parameter :: along = "/event/event"
      character(64) :: name(size(machine%contact))
      character(1000) :: meanings(size(name))
      integer :: j

      if (size(name) == 0) return
      do j = 1, size(name)
         name(j) = machine%contact(j)%name
         meanings(j) = machine%contact(j)%law%meanings()
      end do
      associate (n => self%count)
         call table%add("/event/time", self%time(:n), "s", "time of the event", along)
         call table%add("/event/contact", self%contact(:n), "1", "number of the contact, from 1", along)
         call table%note("names", name)
         call table%add("/event/state", self%branch(:n), "1", "branch of the contact law entered", along)
         call table%note("meanings", meanings)
      end associate
   end subroutine columns

   !> Whether two sequences of a periodic motion are the same but for the change that is counted first; of motions without events,
   !> whether the same contacts are closed all the time.
   pure logical function is_like(self, other)
      class(event_log_t), intent(in) :: self, other

      is_like = first_apart(self, other) == 0
   end function is_like

   !> 0 for sequences that are alike, the contact for such as are but for its bounces before it stays closed, or for a jump of a
   !> load between its events, else -1.
   pure integer function first_apart(self, other) result(contact)
      class(event_log_t), intent(in) :: self, other

      integer, allocatable :: mine(:), theirs(:)
      real(wp) :: away, nearest
      integer :: i, shift

      mine = counted(self)
      theirs = counted(other)
      contact = -1
      if (size(mine) /= size(theirs)) return
      if (size(mine) == 0 .and. all(self%first == other%first)) contact = 0
      nearest = huge(nearest)
      do shift = 0, size(mine) - 1
         theirs = cshift(theirs, min(shift, 1))
         if (any(self%contact(mine) /= other%contact(theirs)) .or. any(self%branch(mine) /= other%branch(theirs))) cycle
         away = distance(self, mine, other, theirs)
         if (away > nearest .or. contact == 0 .and. .not. away < nearest) cycle
         nearest = away
         do i = 1, size(mine)
            if (.not. bounce_alike(self, mine(i), other, theirs(i))) exit
            if (.not. no_jump_between(self, mine(i), other, theirs(i))) exit
         end do
         contact = 0
         if (i <= size(mine)) contact = self%contact(mine(i))
         if (contact == 0 .and. .not. nearest > 0.0_wp) exit
      end do
   end function first_apart

   !> How far events of one motion are from those of another, in periods, whole ones left out; 0 where no load jumps.
   pure real(wp) function distance(self, mine, other, theirs)
      class(event_log_t), intent(in) :: self, other
      integer, intent(in) :: mine(:), theirs(:)

      distance = 0.0_wp
      if (self%jumps_in_period == 0 .or. other%jumps_in_period == 0) return
      associate (apart => self%time(mine)/self%period - other%time(theirs)/other%period)
         distance = sum(abs(apart - anint(apart)))
      end associate
   end function distance

   !> Whether no load jumps between an event of one motion and that of another, whole periods left out.
   pure logical function no_jump_between(self, mine, other, theirs) result(none)
      class(event_log_t), intent(in) :: self, other
      integer, intent(in) :: mine, theirs

      none = self%jumps_in_period == 0 .or. self%jumps_in_period /= other%jumps_in_period
      if (.not. none) none = self%jumps(mine) == nowhere
      if (none) return
      associate (apart => nint(self%time(mine)/self%period - other%time(theirs)/other%period))
         none = self%jumps(mine) - other%jumps(theirs) == self%jumps_in_period*apart
      end associate
   end function no_jump_between

   !> Whether as many bounces come before the contact stays closed after these last ones, or before the next of them. The former are
   !> infinitely many, and rounding says how many of them are there: the times that are left, which become others along motions, say
   !> how many come before the last that both have.
   pure logical function bounce_alike(self, last, other, their_last) result(alike)
      class(event_log_t), intent(in) :: self, other
      integer, intent(in) :: last, their_last

      real(wp), allocatable :: mine(:), theirs(:)

      mine = times_left(self, last)
      theirs = times_left(other, their_last)
      alike = size(mine) == size(theirs)
      if (min(size(mine), size(theirs)) == 1 .or. goes_on(self, last) .or. goes_on(other, their_last)) return
      associate (until => max(mine(size(mine)), theirs(size(theirs)), little))
         alike = abs(number(mine, until) - number(theirs, until)) < 0.5_wp
      end associate

   contains

      !> How many times are longer than this one, interpolated.
      pure real(wp) function number(time, until)
         real(wp), intent(in) :: time(:), until

         integer :: i

         i = min(count(time > until), size(time) - 1)
         number = i + log(time(i)/until)/log(time(i)/time(i + 1))
      end function number

   end function bounce_alike

   !> Whether the contact's next change is the same again.
   pure logical function goes_on(self, this)
      type(event_log_t), intent(in) :: self
      integer, intent(in) :: this

      goes_on = self%branch(1 + modulo(this + to_next(self, this) - 1, self%count)) == self%branch(this)
   end function goes_on

   !> How many changes ahead the next one of the contact of an event is.
   pure integer function to_next(self, this)
      type(event_log_t), intent(in) :: self
      integer, intent(in) :: this

      associate (contact => self%contact(:self%count))
         to_next = findloc(contact(this + 1:), contact(this), 1)
         if (to_next == 0) to_next = size(contact) - this + findloc(contact(:this), contact(this), 1)
      end associate
   end function to_next

   !> Whether the contact of an event never comes to another branch.
   pure logical function keeps_branch(self, this) result(keeps)
      type(event_log_t), intent(in) :: self
      integer, intent(in) :: this

      associate (contact => self%contact(:self%count), branch => self%branch(:self%count))
         keeps = all(contact /= contact(this) .or. branch == branch(this))
      end associate
   end function keeps_branch

   !> From the bounces up to the last one before a contact stays closed until then, in parts of the first of these times; one, if
   !> this change is no such bounce.
   pure function times_left(self, last) result(time)
      class(event_log_t), intent(in) :: self
      integer, intent(in) :: last
      real(wp), allocatable :: time(:)

      integer :: next

      time = [1.0_wp]
      if (keeps_branch(self, last)) return
      next = 1 + modulo(last + to_next(self, last) - 1, self%count)
      associate (left => modulo(self%time(next) - self%time(bounces_until(self, last)), self%duration))
         if (left(size(left)) < left(1)) time = max(left/left(1), 0.1_wp*little)
      end associate
   end function times_left

   !> The changes of a contact to this branch one after the other, up to this last one.
   pure function bounces_until(self, last) result(place)
      class(event_log_t), intent(in) :: self
      integer, intent(in) :: last
      integer, allocatable :: place(:)

      integer :: back, i

      place = [integer ::]
      do back = 0, self%count - 1
         i = 1 + modulo(last - 1 - back, self%count)
         if (self%contact(i) /= self%contact(last)) cycle
         if (self%branch(i) /= self%branch(last)) exit
         place = [i, place]
      end do
   end function bounces_until

   !> The changes that count in the sequence of a periodic motion. Of the bounces before a contact stays closed only the last does,
   !> as they are infinitely many, and rounding says after how many the motion is past them, and such as have another change that
   !> counts before the next: of what repeats itself up to the end, as friction that turns round with each bounce, the first. What
   !> changes at once, as in symmetric machines, is in the order of the contacts.
   pure function counted(self) result(place)
      type(event_log_t), intent(in) :: self
      integer, allocatable :: place(:)

      logical, dimension(self%count) :: counts, left_out
      integer :: i, k, next(self%count)
      logical :: repeated

      do i = 1, self%count
         next(i) = 1 + modulo(i + to_next(self, i) - 1, self%count)
         counts(i) = self%branch(next(i)) /= self%branch(i) .or. keeps_branch(self, i)
      end do
      left_out = .false.
      do i = 1, self%count
         if (counts(i)) cycle
         left_out(i) = left_out(i) .or. size(between(i)) == 0
         if (.not. counts(next(i))) cycle
         associate (bounce => bounces_until(self, next(i)), left => times_left(self, next(i)))
            do k = size(left) - 1, 2, -1
               repeated = same(between(bounce(k - 1)), between(bounce(k)))
               if (left(k) > little .and. .not. repeated) exit
               left_out(bounce(k)) = .true.
               if (repeated) left_out(between(bounce(k))) = .true.
            end do
         end associate
      end do
      place = pack([(i, i=1, self%count)], mask=.not. left_out)
      do i = 2, size(place)
         do k = i, 2, -1
            if (self%contact(place(k)) >= self%contact(place(k - 1)) .or. &
                self%time(place(k)) - self%time(place(k - 1)) > at_once*self%duration) exit
            place(k - 1:k) = place(k:k - 1:-1)
         end do
      end do

   contains

      !> The changes that count between this one and the next of its contact.
      pure function between(this)
         integer, intent(in) :: this
         integer, allocatable :: between(:)

         between = [(1 + modulo(i - 1, self%count), i=this + 1, this + modulo(next(this) - this - 1, self%count))]
         between = pack(between, counts(between))
      end function between

      pure logical function same(some, others)
         integer, intent(in) :: some(:), others(:)

         same = size(some) == size(others)
         if (same) same = all(self%contact(some) == self%contact(others)) .and. all(self%branch(some) == self%branch(others))
      end function same

   end function counted

   !> The contact of the least number that does not change to each of its branches as often as in another sequence: stops come
   !> before friction, which changes with them. 0: all do, the order differs.
   pure integer function difference(self, other)
      class(event_log_t), intent(in) :: self, other

      integer, allocatable :: mine(:), theirs(:)
      integer :: i

      mine = counted(self)
      theirs = counted(other)
      difference = huge(difference)
      associate (contact => [self%contact(:self%count), other%contact(:other%count)], &
                 branch => [self%branch(:self%count), other%branch(:other%count)])
         do i = 1, size(contact)
            if (contact(i) >= difference) cycle
            if (count(self%contact(mine) == contact(i) .and. self%branch(mine) == branch(i)) /= &
                count(other%contact(theirs) == contact(i) .and. other%branch(theirs) == branch(i))) difference = contact(i)
         end do
      end associate
      if (difference < huge(difference)) return
      difference = max(0, first_apart(self, other))
      if (self%count + other%count > 0) return
      i = findloc(self%first /= other%first, .true., 1)
      if (i > 0) difference = self%watched(i)
   end function difference

   !> The branch in which a motion of the machine given to `reset` begins, of a contact that is not friction.
   pure integer function begins_in(self, contact)
      class(event_log_t), intent(in) :: self
      integer, intent(in) :: contact

      begins_in = self%first(findloc(self%watched, contact, 1))
   end function begins_in

   !> The contacts that are not friction and stay in the branch in which they begin.
   pure function never_change(self) result(contact)
      class(event_log_t), intent(in) :: self
      integer, allocatable :: contact(:)

      integer :: i

      contact = pack(self%watched, [(all(self%contact(:self%count) /= self%watched(i)), i=1, size(self%watched))])
   end function never_change

   !> How often a contact changes to a branch, bounces that do not count left out.
   pure integer function changes_to(self, contact, branch)
      class(event_log_t), intent(in) :: self
      integer, intent(in) :: contact, branch

      associate (place => counted(self))
         changes_to = count(self%contact(place) == contact .and. self%branch(place) == branch)
      end associate
   end function changes_to

end module razy_observe_event_log
