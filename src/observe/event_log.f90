!! The list of all events of a motion.
module razy_observe_event_log
   use razy_core_kinds, only: wp
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: event_log_t

   type, extends(observer_t) :: event_log_t
      !> Number of events; time in s, never falling, contact and branch entered (count).
      integer :: count = 0
      real(wp), allocatable :: time(:)
      integer, allocatable :: contact(:), branch(:)
   contains
      procedure :: piece
      procedure :: finish
   end type event_log_t

contains

   !> Note the event that ends a piece.
   subroutine piece(self, part)
      class(event_log_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      if (part%contact == 0) return
      if (.not. allocated(self%time)) call resize(self, 1024)
      if (self%count == size(self%time)) call resize(self, 2*self%count)
      self%count = self%count + 1
      self%time(self%count) = part%time + (part%time_low + part%duration)
      ! The end of a piece and the start of the next are one moment, but sums of other terms.
      if (self%count > 1) self%time(self%count) = max(self%time(self%count - 1), self%time(self%count))
      self%contact(self%count) = part%contact
      self%branch(self%count) = part%branch
   end subroutine piece

   !> Give the arrays their final size.
   subroutine finish(self)
      class(event_log_t), intent(inout) :: self

      call resize(self, self%count)
   end subroutine finish

   subroutine resize(self, events)
      class(event_log_t), intent(inout) :: self
      integer, intent(in) :: events

      real(wp), allocatable :: time(:)
      integer, allocatable :: contact(:), branch(:)

      allocate (time(events), contact(events), branch(events))
      if (self%count > 0) then
         time(:self%count) = self%time(:self%count)
         contact(:self%count) = self%contact(:self%count)
         branch(:self%count) = self%branch(:self%count)
      end if
      call move_alloc(time, self%time)
      call move_alloc(contact, self%contact)
      call move_alloc(branch, self%branch)
   end subroutine resize

end module razy_observe_event_log
