!! What watches a motion: called with every smooth piece between events.
module razy_integrate_observer
   use razy_core_kinds, only: wp
   use razy_integrate_contact_states, only: contact_state_t
   use razy_integrate_cursor, only: cursor_t
   implicit none(type, external)
   private

   public :: observer_slot_t, observer_t, piece_t

   !> A smooth piece of the motion: `state` and `start` give the closed form of it.
   type :: piece_t
      !> Time of its start, s (sum of both), and its duration, s.
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp, duration = 0.0_wp
      type(contact_state_t), pointer :: state => null()
      !> Amplitudes at its start and at its end.
      type(cursor_t), pointer :: start => null(), finish => null()
      !> Whether the motion ends with this piece.
      logical :: last = .false.
      !> The contact whose branch changes at its end, and the branch that follows; 0 if there is no event.
      integer :: contact = 0, branch = 0
   end type piece_t

   type, abstract :: observer_t
   contains
      procedure(on_piece), deferred :: piece
   end type observer_t

   !> An observer of any type, for lists of them.
   type :: observer_slot_t
      class(observer_t), pointer :: observer => null()
   end type observer_slot_t

   abstract interface
      subroutine on_piece(self, part)
         import :: observer_t, piece_t
         implicit none(type, external)
         class(observer_t), intent(inout) :: self
         type(piece_t), intent(in) :: part
      end subroutine on_piece
   end interface

end module razy_integrate_observer
