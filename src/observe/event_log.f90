!! The list of all events of a motion.
module razy_observe_event_log
   use razy_contact_contact_law, only: branch_meanings
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: table_t
   use razy_machine_machine, only: contact_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: event_log_t

   type, extends(observer_t) :: event_log_t
      !> Number of events; time in s, never falling, contact and branch entered: the first `count` are valid.
      integer :: count = 0
      real(wp), allocatable :: time(:)
      integer, allocatable :: contact(:), branch(:)
   contains
      procedure :: reset
      procedure :: piece
      procedure :: columns
   end type event_log_t

contains

   !> Forget everything of an earlier run.
   subroutine reset(self)
      class(event_log_t), intent(inout) :: self

      self%count = 0
      if (.not. allocated(self%time)) allocate (self%time(1024), self%contact(1024), self%branch(1024))
   end subroutine reset

   !> Note the event that ends a piece.
   subroutine piece(self, part)
      class(event_log_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      if (part%contact == 0) return
      if (.not. allocated(self%time)) call self%reset()
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

   !> Hand over the events of a motion with these contacts, as lists of `/event`.
   subroutine columns(self, table, contact)
      class(event_log_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(contact_t), intent(in) :: contact(:)

      character(*), parameter :: along = "/event/event"
      character(64) :: name(size(contact))
      integer :: j

      do j = 1, size(contact)
         name(j) = contact(j)%name
      end do
      associate (n => self%count)
         call table%add("/event/time", self%time(:n), "s", "time of the event", along)
         call table%add("/event/contact", self%contact(:n), "1", "number of the contact, from 1", along)
         call table%note("names", name)
         call table%add("/event/state", self%branch(:n), "1", "branch of the contact law entered", along)
         call table%note("meanings", branch_meanings)
      end associate
   end subroutine columns

end module razy_observe_event_log
