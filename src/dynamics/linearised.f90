!! The linear machine M q'' + B q' + K q = 0 that a machine is when its contacts keep a chosen state.
!!
!! A closed contact with the slopes k, b of its law is a two-way spring and damper: it adds k w wᵀ to K and b w wᵀ to B.
module razy_dynamics_linearised
   use razy_contact_contact_law, only: branch_lower, branch_open, branch_upper
   use razy_core_kinds, only: wp
   use razy_machine_equilibrium, only: find_equilibrium
   use razy_machine_machine, only: contact_t, machine_t
   implicit none(type, external)
   private

   public :: contact_choices, contacts_closed, contacts_equilibrium, contacts_open, linearise

   !> States of the contacts: none acts; all act, on their upper side if they have two; those act that do in static equilibrium.
   integer, parameter :: contacts_open = 1, contacts_closed = 2, contacts_equilibrium = 3
   !> Their names in an input, in this order.
   character(*), parameter :: contact_choices(3) = [character(11) :: "open", "closed", "equilibrium"]

contains

   !> K and B (n, n) with the contacts in a state. `found` is false if equilibrium is asked for and there is none.
   subroutine linearise(machine, contacts, stiffness, damping, found)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: contacts
      real(wp), allocatable, intent(out) :: stiffness(:, :), damping(:, :)
      logical, intent(out) :: found

      real(wp) :: q(size(machine%mass, 1)), k, b
      integer :: i, j

      stiffness = machine%stiffness
      damping = machine%damping
      found = .true.
      q = 0.0_wp
      if (contacts == contacts_equilibrium) call find_equilibrium(machine, q, found)
      if (.not. found) return
      do j = 1, size(machine%contact)
         associate (w => machine%contact(j)%w)
            call contact_slopes(machine%contact(j), contacts, q, k, b)
            do i = 1, size(q)
               stiffness(:, i) = stiffness(:, i) + k*w*w(i)
               damping(:, i) = damping(:, i) + b*w*w(i)
            end do
         end associate
      end do
   end subroutine linearise

   !> Stiffness and damping of one contact at rest in the displacement `q`. All that is known here of a law is asked here.
   pure subroutine contact_slopes(contact, contacts, q, stiffness, damping)
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: contacts
      real(wp), intent(in) :: q(:)
      real(wp), intent(out) :: stiffness, damping

      integer :: branch

      associate (law => contact%law)
         select case (contacts)
         case (contacts_closed)
            branch = merge(branch_upper, branch_lower, law%guard(1, branch_open)%above /= 0)
         case (contacts_equilibrium)
            branch = law%initial_branch(dot_product(contact%w, q) + contact%offset, 0.0_wp)
         case default
            branch = branch_open
         end select
         stiffness = law%branch(branch)%stiffness
         damping = law%branch(branch)%damping
      end associate
   end subroutine contact_slopes

end module razy_dynamics_linearised
