!! The contact sequence of a motion: which contacts change to which branch, one after the other.
module razy_orbits_sequence
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: sequence_t

   !> Changes 1 to `count`: contact, branch that follows, time, s.
   type, extends(observer_t) :: sequence_t
      integer :: count = 0
      integer, allocatable :: contact(:), branch(:)
      real(wp), allocatable :: time(:)
   contains
      procedure :: reset
      procedure :: piece
      procedure :: is_like
      procedure :: difference
      procedure :: changes_to
   end type sequence_t

contains

   !> Forget everything.
   subroutine reset(self)
      class(sequence_t), intent(inout) :: self

      self%count = 0
      if (.not. allocated(self%contact)) allocate (self%contact(16), self%branch(16), self%time(16))
   end subroutine reset

   !> Take up the change at the end of a piece.
   subroutine piece(self, part)
      class(sequence_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      if (part%contact == 0) return
      if (self%count == size(self%contact)) then
         call resize(self%contact, 2_i8*self%count)
         call resize(self%branch, 2_i8*self%count)
         call resize(self%time, 2_i8*self%count)
      end if
      self%count = self%count + 1
      self%contact(self%count) = part%contact
      self%branch(self%count) = part%branch
      self%time(self%count) = part%time + (part%time_low + part%duration)
   end subroutine piece

   !> Whether two sequences of a periodic motion are the same but for the change that is counted first.
   pure logical function is_like(self, other)
      class(sequence_t), intent(in) :: self, other

      integer :: shift

      is_like = self%count == other%count
      if (.not. is_like .or. self%count == 0) return
      associate (n => self%count, a => self%contact(:self%count), b => self%branch(:self%count))
         do shift = 0, n - 1
            is_like = all(a == cshift(other%contact(:n), shift)) .and. all(b == cshift(other%branch(:n), shift))
            if (is_like) return
         end do
      end associate
   end function is_like

   !> The first contact that does not change to each of its branches as often as in another sequence; 0: all do, the order differs.
   pure integer function difference(self, other) result(contact)
      class(sequence_t), intent(in) :: self, other

      integer :: branch, i

      do i = 1, self%count + other%count
         if (i <= self%count) then
            contact = self%contact(i)
            branch = self%branch(i)
         else
            contact = other%contact(i - self%count)
            branch = other%branch(i - self%count)
         end if
         if (self%changes_to(contact, branch) /= other%changes_to(contact, branch)) return
      end do
      contact = 0
   end function difference

   !> How often a contact changes to a branch.
   pure integer function changes_to(self, contact, branch)
      class(sequence_t), intent(in) :: self
      integer, intent(in) :: contact, branch

      changes_to = count(self%contact(:self%count) == contact .and. self%branch(:self%count) == branch)
   end function changes_to

end module razy_orbits_sequence
