!! The contact states of a machine with impacts or friction.
!!
!! They have two things more than others: states in which contacts hold constraints are followed in coordinates of their own
!! (razy_exact_constrained_motion), and friction under a damped contact is another one where that contact pulls. Constraint
!! forces and the forces of friction are linear forms of the motion, which are watched and observed as gaps are.
module razy_exact_jump_states
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t
   use razy_exact_contact_state, only: contact_state_t, contact_states_t
   use razy_hybrid_linear_form, only: add_contacts, add_form, add_loads, force_form, linear_form_t, observable_form, zero_form
   use razy_exact_constrained_motion, only: held_t
   use razy_exact_constrained_coordinates, only: new_held
   use razy_exact_jump_guards, only: watch_jumps
   use razy_exact_modal_basis, only: new_modal_basis
   use razy_exact_closed_form_response, only: new_response
   use razy_exact_closed_form_rows, only: new_rows
   use razy_exact_modal_state_modes, only: new_state_modes
   use razy_machine_machine, only: observe_contact_force
   implicit none(type, external)
   private

   public :: hold, make_jump_modes, respond_with_jumps

contains

   !> The coordinates of a state of a machine with jumps.
   subroutine hold(self, state, press, constraints)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state
      integer, intent(in) :: press(:)
      type(constraints_t), intent(in) :: constraints

      real(wp) :: k(self%coupled%m, self%coupled%m), b(self%coupled%m, self%coupled%m)
      integer :: i

      state%press = press
      if (constraints%count == 0) return
      call free_matrices(self, state, k, b)
      call new_held(state%held, constraints, self%w, &
                    [(self%machine%contact(constraints%sliding(i))%law%branch(state%branch(constraints%sliding(i)))%offset, &
                      i=1, constraints%couplings)], k, b, &
                    [(self%machine%contact(constraints%contact(i))%drive, i=1, constraints%count)])
   end subroutine hold

   !> K and B of a state of a machine with jumps, without constraints.
   subroutine free_matrices(self, state, k, b)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(in) :: state
      real(wp), intent(out) :: k(:, :), b(:, :)

      k = self%coupled%stiffness
      b = self%coupled%damping
      call add_contacts(self%machine, self%w, state%branch, state%press, k, b)
   end subroutine free_matrices

   !> The modes of a state: of the coordinates in which it is free, or those of any state where nothing is held and no friction
   !> depends on the motion.
   subroutine make_jump_modes(self, state)
      type(contact_states_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state

      real(wp) :: k(self%coupled%m, self%coupled%m), b(self%coupled%m, self%coupled%m)
      integer :: j

      if (state%held%n == 0 .and. .not. any([(may_press(self, state, j), j=1, size(state%branch))])) then
         call new_state_modes(state%basis, self%open, self%machine, self%coupled, self%w, state%branch)
         return
      end if
      call free_matrices(self, state, k, b)
      if (state%held%n > 0) then
         if (.not. state%held%found) then
            state%basis%info = 1
            return
         end if
         call state%held%transform_matrices(k, b)
      end if
      call new_modal_basis(state%basis, k, b, impacts=.true.)
   end subroutine make_jump_modes

   !> Whether element j is friction that slides under a compliant contact.
   pure function may_press(self, state, j)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(in) :: state
      integer, intent(in) :: j
      logical :: may_press

      associate (law => self%machine%contact(j)%law, by => self%machine%contact(j)%normal_of)
         may_press = law%of_normal .and. by > 0 .and. .not. law%constraint(state%branch(j))
         if (may_press) may_press = .not. self%machine%contact(by)%law%impacts
      end associate
   end function may_press

   !> Response and rows of a state of a machine with jumps.
   subroutine respond_with_jumps(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      type(linear_form_t) :: force(size(state%branch)), observed(size(self%machine%observable))
      real(wp) :: k(self%coupled%m, self%coupled%m), b(self%coupled%m, self%coupled%m), load(self%coupled%m)
      complex(wp) :: harmonic(self%coupled%m, size(self%omega))
      integer :: j

      load = self%load
      harmonic = self%harmonic
      call add_loads(self%machine, self%w, state%branch, state%press, load, harmonic)
      call free_matrices(self, state, k, b)
      do j = 1, size(state%branch)
         force(j) = force_form(self%machine, self%w, state%branch, state%press, j)
      end do
      if (state%held%n > 0) then
         call add_reactions(self, state%held, k, b, load, harmonic, force)
         load = state%held%load_of(load)
         harmonic = state%held%harmonic_of(harmonic, errors_of(self, state%held), self%omega)
      end if
      call new_response(state%response, state%basis, load, harmonic, self%omega)
      call watch_jumps(self, state, force)
      do j = 1, size(observed)
         if (self%machine%observable(j)%kind == observe_contact_force) then
            observed(j) = zero_form(self%coupled%m, size(self%omega))
            call add_form(observed(j), self%machine%contact(self%machine%observable(j)%contact)%force_sign, &
                          force(self%machine%observable(j)%contact))
         else
            observed(j) = observable_form(self%machine%observable(j), self%coupled%project)
         end if
         observed(j) = state%held%form_of(observed(j))
      end do
      call new_rows(state%observed, state%response, observed)
      do j = 1, size(force)
         force(j) = state%held%form_of(force(j))
      end do
      call new_rows(state%force, state%response, force)
   end subroutine respond_with_jumps

   !> Phasors of the errors of what is held (n, tones).
   pure function errors_of(self, held) result(error)
      type(contact_states_t), intent(in) :: self
      type(held_t), intent(in) :: held
      complex(wp) :: error(held%n, size(self%omega))

      integer :: i

      do i = 1, held%n
         error(i, :) = self%machine%contact(held%contact(i))%error
      end do
   end function errors_of

   !> Add constraint forces, and the friction under them, to the forces of all contacts; arguments as for `reaction`.
   subroutine add_reactions(self, held, k, b, load, harmonic, force)
      type(contact_states_t), intent(in) :: self
      type(held_t), intent(in) :: held
      real(wp), intent(in) :: k(:, :), b(:, :), load(:)
      complex(wp), intent(in) :: harmonic(:, :)
      type(linear_form_t), intent(inout) :: force(:)

      integer :: i

      do i = 1, held%n
         force(held%contact(i)) = held%reaction(i, k, b, load, harmonic, errors_of(self, held), self%omega)
      end do
      do i = 1, size(held%sliding)
         call add_form(force(held%sliding(i)), held%share(i), force(held%contact(held%row(i))))
      end do
   end subroutine add_reactions

end module razy_exact_jump_states
