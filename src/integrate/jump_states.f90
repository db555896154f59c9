!! The contact states of a machine with impacts or friction.
!!
!! They have two things more than others: states in which contacts hold constraints are followed in coordinates of their own
!! (razy_integrate_held), and friction under a damped contact is another one where that contact pulls. Constraint forces and the
!! forces of friction are linear forms of the motion, which are watched and observed as gaps are.
module razy_integrate_jump_states
   use razy_contact_contact_law, only: guard_t
   use razy_core_kinds, only: wp
   use razy_integrate_constraints, only: constraints_t
   use razy_integrate_contact_state, only: contact_state_t, contact_states_t
   use razy_integrate_force_forms, only: add_contacts, add_form, add_loads, contact_form, force_form, normal_form, &
                                         observable_form, zero_form
   use razy_integrate_held, only: held_t, new_held
   use razy_integrate_modal_basis, only: new_modal_basis
   use razy_integrate_refine, only: watched_t
   use razy_integrate_response, only: linear_form_t, new_response, new_rows
   use razy_integrate_state_modes, only: new_state_modes
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
         observed(j) = in_coordinates(state, observed(j))
      end do
      call new_rows(state%observed, state%response, observed)
      do j = 1, size(force)
         force(j) = in_coordinates(state, force(j))
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

   !> A form on the coupled coordinates as one on those of the state.
   pure function in_coordinates(state, form) result(in_x)
      type(contact_state_t), intent(in) :: state
      type(linear_form_t), intent(in) :: form
      type(linear_form_t) :: in_x

      if (state%held%n > 0) then
         in_x = state%held%form_of(form)
      else
         in_x = form
      end if
   end function in_coordinates

   !> Rows and bounds of what can end a state of a machine with jumps: switching functions, constraint forces (function 0), and
   !> changes of sign of the force of a compliant contact that presses friction (function -1).
   subroutine watch_jumps(self, state, force)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state
      type(linear_form_t), intent(in) :: force(:)

      type(linear_form_t) :: forms(7*size(force)), normal
      type(watched_t) :: watched(7*size(force))
      integer :: contact(7*size(force)), function(7*size(force)), next(7*size(force))
      integer :: f, j, n

      n = 0
      do j = 1, size(force)
         associate (law => self%machine%contact(j)%law)
            if (law%constraint(state%branch(j))) then
               f = 0
               if (law%of_normal) normal = total_normal(self, state, force, j)
               call add_guard(law%force_guard(state%branch(j)), force(j), law%of_normal)
               cycle
            end if
            do f = 1, law%functions
               call add_guard(law%guard(f, state%branch(j)), &
                              contact_form(self%machine, self%w, j, law%slope(1, f), law%slope(2, f), law%constant(f)), .false.)
            end do
         end associate
      end do
      do j = 1, size(force)
         if (.not. may_pull(self, state, j)) cycle
         f = -1
         call add(0, real(state%press(j), wp), 0.0_wp, force(self%machine%contact(j)%normal_of))
      end do
      state%watched = watched(:n)
      state%contact = contact(:n)
      state%function = function(:n)
      state%next = next(:n)
      do j = 1, n
         forms(j) = in_coordinates(state, forms(j))
      end do
      call new_rows(state%switching, state%response, forms(:n))
      state%fixed = [(is_fixed(state, forms(j), j), j=1, n)]

   contains

      subroutine add_guard(guard, form, of_normal)
         type(guard_t), intent(in) :: guard
         type(linear_form_t), intent(in) :: form
         logical, intent(in) :: of_normal

         type(linear_form_t) :: less

         if (guard%below /= 0) then
            less = form
            if (of_normal) call add_form(less, -guard%lower, normal)
            call add(guard%below, 1.0_wp, merge(0.0_wp, guard%lower, of_normal), less)
         end if
         if (guard%above /= 0) then
            less = form
            if (of_normal) call add_form(less, -guard%upper, normal)
            call add(guard%above, -1.0_wp, merge(0.0_wp, guard%upper, of_normal), less)
         end if
      end subroutine add_guard

      subroutine add(beyond, side, bound, form)
         integer, intent(in) :: beyond
         real(wp), intent(in) :: side, bound
         type(linear_form_t), intent(in) :: form

         n = n + 1
         forms(n) = form
         watched(n) = watched_t(form=n, side=side, bound=bound)
         contact(n) = j
         function(n) = f
         next(n) = beyond
      end subroutine add

   end subroutine watch_jumps

   !> Normal force of friction element j that sticks.
   pure function total_normal(self, state, force, j) result(form)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(in) :: state
      type(linear_form_t), intent(in) :: force(:)
      integer, intent(in) :: j
      type(linear_form_t) :: form

      form = normal_form(self%machine, self%w, state%branch, state%press, j)
      associate (by => self%machine%contact(j)%normal_of)
         if (by == 0) return
         associate (law => self%machine%contact(by)%law)
            if (.not. law%constraint(state%branch(by))) return
            call add_form(form, merge(1.0_wp, -1.0_wp, law%force_guard(state%branch(by))%below /= 0), force(by))
         end associate
      end associate
   end function total_normal

   !> Whether the force that presses friction element j may change its sign: that of a damped contact which does not part there.
   pure function may_pull(self, state, j)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(in) :: state
      integer, intent(in) :: j
      logical :: may_pull

      integer :: f

      may_pull = .false.
      associate (by => self%machine%contact(j)%normal_of)
         if (by == 0) return
         associate (law => self%machine%contact(by)%law, branch => state%branch(by))
            may_pull = law%branch(branch)%damping > 0.0_wp .and. .not. law%constraint(branch)
            do f = 2, law%functions
               may_pull = may_pull .and. law%guard(f, branch)%below == 0 .and. law%guard(f, branch)%above == 0
            end do
         end associate
      end associate
   end function may_pull

   !> Whether a watched function depends on what is held alone, and so does not move but with the excitation and the drives.
   pure function is_fixed(state, form, j)
      type(contact_state_t), intent(in) :: state
      type(linear_form_t), intent(in) :: form
      integer, intent(in) :: j
      logical :: is_fixed

      real(wp), parameter :: negligible = 1.0e-11_wp

      is_fixed = state%held%n > 0
      if (.not. is_fixed) return
      associate (free => state%held%m - state%held%rank)
         is_fixed = norm2(form%on_y(:free)) <= negligible*norm2(form%on_y) &
                    .and. norm2(form%on_v(:free)) <= negligible*norm2(form%on_v) &
                    .and. all(state%switching%size0(:, j) <= negligible*state%switching%longest_reach(j))
      end associate
   end function is_fixed

end module razy_integrate_jump_states
