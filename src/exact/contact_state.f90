!! What is kept of the contact states of a machine.
module razy_exact_contact_state
   use razy_core_kinds, only: wp
   use razy_exact_constrained_motion, only: held_t
   use razy_exact_modal_parts, only: modal_basis_t
   use razy_exact_search_refine, only: watched_t
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: rows_t
   use razy_exact_modal_state_modes, only: open_modes_t
   use razy_machine_coupled, only: coupled_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: contact_state_t, contact_states_t

   !> One contact state: the branch of every contact, and the motion in it.
   type :: contact_state_t
      integer, allocatable :: branch(:)
      type(modal_basis_t) :: basis
      type(response_t) :: response
      !> Rows of the switching functions and of the observables.
      type(rows_t) :: switching, observed
      !> Functions that end this state, the contact each belongs to, its function there, and the branch beyond.
      type(watched_t), allocatable :: watched(:)
      integer, allocatable :: contact(:), function(:), next(:)
      !> Rows of the variables s of all contacts, made when they are asked for.
      type(rows_t) :: touching
      !> Of machines with jumps: signs of the forces that press friction (contacts); coordinates while constraints are held; rows
      !> of all contact forces; which of `watched` are functions of the constraints alone.
      integer, allocatable :: press(:)
      type(held_t) :: held
      type(rows_t) :: force
      logical, allocatable :: fixed(:)
      !> Machine for which the response was made, and the rows of contacts.
      integer :: version = 0, touching_version = 0
      !> Step level that the last search ended with.
      integer :: level = 10
   end type contact_state_t

   !> All states met so far.
   type :: contact_states_t
      type(machine_t) :: machine
      type(coupled_t) :: coupled
      logical :: keep_all = .false.
      !> Whether there are impacts or friction.
      logical :: jumps = .false.
      integer :: version = 0, count = 0
      type(contact_state_t), allocatable :: state(:)
      !> Modes with all contacts open.
      type(open_modes_t) :: open
      !> Contact directions (m, contacts), constant load (m), phasors (m, tones), frequencies (tones), rad/s.
      real(wp), allocatable :: w(:, :), load(:), omega(:)
      complex(wp), allocatable :: harmonic(:, :)
   end type contact_states_t

end module razy_exact_contact_state
