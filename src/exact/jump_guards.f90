!! What can end a contact state of a machine with impacts or friction.
module razy_exact_jump_guards
   use razy_contact_contact_law, only: guard_t
   use razy_core_kinds, only: wp
   use razy_exact_contact_state, only: contact_state_t, contact_states_t
   use razy_hybrid_linear_form, only: add_form, contact_form, linear_form_t, normal_form
   use razy_exact_search_refine, only: watched_t
   use razy_exact_closed_form_rows, only: new_rows
   implicit none(type, external)
   private

   public :: watch_jumps

contains

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
         forms(j) = state%held%form_of(forms(j))
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

end module razy_exact_jump_guards
