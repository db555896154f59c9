!! The linear machine M q'' + B q' + K q = 0 that a machine is when its contacts keep a chosen state.
!!
!! A closed contact with the slopes k = dF/ds, b = dF/ds' of its law is a two-way spring and damper: it adds k w wᵀ to K and
!! b w wᵀ to B. A friction element has no gap to close and adds nothing where all contacts are open or all closed.
module razy_machine_linearised
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer
   use razy_machine_equilibrium, only: find_equilibrium
   use razy_machine_machine, only: contact_t, is_ring, machine_t, stretch_of
   implicit none(type, external)
   private

   public :: contact_choices, contacts_closed, contacts_equilibrium, contacts_open, linearise, state_asked_for
   public :: linear_ok, linear_no_equilibrium, linear_rigid, linear_curved

   !> States of the contacts: none acts; all but rings act, on their upper side if they have two; those act that do in static
   !> equilibrium.
   integer, parameter :: contacts_open = 1, contacts_closed = 2, contacts_equilibrium = 3
   !> Their names in an input, in this order.
   character(*), parameter :: contact_choices(3) = [character(11) :: "open", "closed", "equilibrium"]

   !> Outcomes are done; there is no equilibrium; a contact that acts is rigid; one has no stiffness that the state would say.
   integer, parameter :: linear_ok = 0, linear_no_equilibrium = 1, linear_rigid = 2, linear_curved = 3

contains

   !> What state of the contacts a status other than `linear_ok` asks for, in words.
   pure function state_asked_for(machine, status, culprit) result(words)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: status, culprit
      character(:), allocatable :: words

      words = "'closed' or 'open', as the constant loads are in no equilibrium"
      if (status == linear_no_equilibrium) return
      words = "'open': the contact "//machine%contact(culprit)%name//" has a curved law, or is a ring"
      if (status == linear_rigid) words = "'open': the contact "//machine%contact(culprit)%name//" is rigid"
   end function state_asked_for

   !> K and B (n, n) with the contacts in a state; `culprit` is the contact that a status belongs to. `slope` (2, contacts): k, b.
   subroutine linearise(machine, contacts, stiffness, damping, status, culprit, slope)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: contacts
      real(wp), allocatable, intent(out) :: stiffness(:, :), damping(:, :)
      integer, intent(out) :: status, culprit
      real(wp), allocatable, intent(out), optional :: slope(:, :)

      real(wp) :: q(size(machine%mass, 1)), k, b
      logical :: found

      stiffness = machine%stiffness
      damping = machine%damping
      status = linear_ok
      q = 0.0_wp
      if (present(slope)) allocate (slope(2, size(machine%contact)), source=0.0_wp)
      if (contacts == contacts_equilibrium) then
         ! Equilibrium is known for these laws only.
         do culprit = 1, size(machine%contact)
            if (any(machine%contact(culprit)%law%branch%constraint)) status = linear_curved
            if (status /= linear_ok) return
         end do
         culprit = 0
         call find_equilibrium(machine, q, found)
         if (.not. found) status = linear_no_equilibrium
         if (.not. found) return
      end if
      do culprit = 1, size(machine%contact)
         associate (w => machine%contact(culprit)%w)
            call contact_slopes(machine%contact(culprit), contacts, q, k, b, status)
            if (status /= linear_ok) return
            call add_outer(stiffness, k, w)
            call add_outer(damping, b, w)
            if (present(slope)) slope(:, culprit) = [k, b]
         end associate
      end do
   end subroutine linearise

   !> Stiffness and damping of one contact at rest in the displacement `q`. All that is known here of a law is asked here.
   pure subroutine contact_slopes(contact, contacts, q, stiffness, damping, status)
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: contacts
      real(wp), intent(in) :: q(:)
      real(wp), intent(out) :: stiffness, damping
      integer, intent(out) :: status

      real(wp) :: s
      integer :: branch

      call stretch_of(contact, q, s)
      stiffness = 0.0_wp
      damping = 0.0_wp
      status = linear_ok
      associate (law => contact%law)
         if (law%of_normal) return
         branch = law%home
         ! A ring has no side to be closed on: at rest it is open.
         if (contacts == contacts_closed .and. .not. is_ring(contact)) then
            branch = law%shut
         else if (contacts == contacts_equilibrium) then
            branch = law%initial_branch(s, 0.0_wp)
         end if
         if (law%branch(branch)%constraint) then
            status = linear_rigid
         else if (branch /= law%home .and. (allocated(contact%frame) .or. (contacts == contacts_closed &
                                                                           .and. .not. law%piecewise_linear))) then
            status = linear_curved
         else
            call law%slopes(branch, s, 0.0_wp, 0.0_wp, stiffness, damping)
         end if
      end associate
   end subroutine contact_slopes

end module razy_machine_linearised
