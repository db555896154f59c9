!! The list of all events of a motion: the contact sequence, which contacts change to which branch, one after the other.
module razy_observe_event_log
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: table_t
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
   contains
      procedure :: attach
      procedure :: forget
      procedure :: piece
      procedure :: columns
      procedure :: is_like
      procedure :: difference
      procedure :: begins_in
      procedure :: changes_to
   end type event_log_t

contains

   !> Begin anew with a machine: contacts with a gap tell its motions without events apart.
   subroutine attach(self, machine, t_end)
      class(event_log_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      integer :: j

      call self%forget()
      associate (contact => machine%contact, unused => t_end)
         self%watched = pack([(j, j=1, size(contact))], [(.not. contact(j)%law%of_normal, j=1, size(contact))])
      end associate
      self%first = 0*self%watched
   end subroutine attach

   subroutine forget(self)
      class(event_log_t), intent(inout) :: self

      self%count = 0
      self%watched = [integer ::]
      self%first = [integer ::]
      if (.not. allocated(self%time)) allocate (self%time(16), self%contact(16), self%branch(16))
   end subroutine forget

   !> Note the event that ends a piece.
   subroutine piece(self, part)
      class(event_log_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      integer :: i

      if (.not. allocated(self%time)) call self%forget()
      if (any(self%first == 0)) self%first = [(part%by%branch(self%watched(i)), i=1, size(self%watched))]
      if (part%contact == 0) return
      if (self%count == size(self%time)) then
         call resize(self%time, 2_i8*self%count)
         call resize(self%contact, 2_i8*self%count)
         call resize(self%branch, 2_i8*self%count)
      end if
      self%count = self%count + 1
      self%time(self%count) = part%time + (part%time_low + part%duration)
      ! The end of a piece and the start of the next are one moment, but sums of other terms.
      if (self%count > 1) self%time(self%count) = max(self%time(self%count - 1), self%time(self%count))
      self%contact(self%count) = part%contact
      self%branch(self%count) = part%branch
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

      integer, allocatable :: mine(:), theirs(:)
      integer :: shift

      mine = counted(self)
      theirs = counted(other)
      is_like = size(mine) == size(theirs)
      if (is_like .and. size(mine) == 0) is_like = all(self%first == other%first)
      if (.not. is_like .or. size(mine) == 0) return
      associate (a => self%contact(mine), b => self%branch(mine), c => other%contact(theirs), d => other%branch(theirs))
         do shift = 0, size(mine) - 1
            is_like = all(a == cshift(c, shift)) .and. all(b == cshift(d, shift))
            if (is_like) return
         end do
      end associate
   end function is_like

   !> The changes that count in the sequence of a periodic motion. Of the bounces before a contact stays closed only the last does:
   !> they are infinitely many, and rounding says after how many the motion is past them.
   pure function counted(self) result(place)
      type(event_log_t), intent(in) :: self
      integer, allocatable :: place(:)

      logical :: counts(self%count)
      integer :: i, k, next

      do i = 1, self%count
         next = 0
         do k = 1, self%count - 1
            next = 1 + modulo(i + k - 1, self%count)
            if (self%contact(next) == self%contact(i)) exit
            next = 0
         end do
         counts(i) = next == 0
         if (counts(i)) cycle
         counts(i) = self%branch(next) /= self%branch(i) .or. &
                     all(self%branch(:self%count) == self%branch(i) .or. self%contact(:self%count) /= self%contact(i))
      end do
      place = pack([(i, i=1, self%count)], counts)
   end function counted

   !> The first contact that does not change to each of its branches as often as in another sequence; 0: all do, the order differs.
   pure integer function difference(self, other)
      class(event_log_t), intent(in) :: self, other

      integer :: i

      associate (contact => [self%contact(:self%count), other%contact(:other%count)], &
                 branch => [self%branch(:self%count), other%branch(:other%count)])
         do i = 1, size(contact)
            difference = contact(i)
            if (self%changes_to(contact(i), branch(i)) /= other%changes_to(contact(i), branch(i))) return
         end do
      end associate
      difference = 0
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

   !> How often a contact changes to a branch, bounces that do not count left out.
   pure integer function changes_to(self, contact, branch)
      class(event_log_t), intent(in) :: self
      integer, intent(in) :: contact, branch

      associate (place => counted(self))
         changes_to = count(self%contact(place) == contact .and. self%branch(place) == branch)
      end associate
   end function changes_to

end module razy_observe_event_log
