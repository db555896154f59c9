!! The contact states of a machine: modes and closed form of each, made when the motion first comes to it.
!!
!! What depends on the machine's matrices alone (coupled coordinates, modes) outlives a change of the excitation; what depends
!! on the excitation (response, rows) is made anew for every machine that is attached, and only for states it visits.
module razy_exact_contact_states
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t
   use razy_exact_contact_state, only: contact_state_t, contact_states_t
   use razy_hybrid_linear_form, only: contact_form, linear_form_t, observable_form
   use razy_exact_jump_states, only: hold, make_jump_modes, respond_with_jumps
   use razy_exact_search_refine, only: watched_t
   use razy_exact_closed_form_response, only: new_response
   use razy_exact_closed_form_rows, only: new_rows
   use razy_exact_modal_state_modes, only: new_open_modes, new_state_modes
   use razy_machine_coupled, only: new_coupled
   use razy_machine_machine, only: machine_t, observe_contact_force, same_structure
   implicit none(type, external)
   private

   public :: attach, lay_out_contacts, state_index

contains

   !> Make `self` ready for `machine`, keeping the modes if only excitation, clearances or start differ from the last.
   subroutine attach(self, machine, keep_all, error)
      type(contact_states_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: j
      logical :: known

      known = same_structure(self%machine, machine) .and. (self%keep_all .eqv. keep_all)
      self%machine = machine
      self%version = self%version + 1
      if (.not. known) then
         self%keep_all = keep_all
         self%count = 0
         if (allocated(self%state)) deallocate (self%state)
         allocate (self%state(4))
         call new_coupled(self%coupled, machine, keep_all, error)
         if (allocated(error)) then
            deallocate (self%machine%mass)
            return
         end if
         if (allocated(self%w)) deallocate (self%w)
         allocate (self%w(self%coupled%m, size(machine%contact)))
         do j = 1, size(machine%contact)
            self%w(:, j) = matmul(self%coupled%project, machine%contact(j)%w)
         end do
         self%jumps = any([(any(machine%contact(j)%law%constraint), j=1, size(machine%contact))])
         call new_open_modes(self%open, machine, self%coupled, self%w, keep_all .or. self%jumps)
      end if
      self%load = matmul(self%coupled%project, machine%load)
      self%harmonic = matmul(self%coupled%project, machine%harmonic_load)
      self%omega = machine%tone%omega
   end subroutine attach

   !> The number of the state with these branches, made ready for the attached machine. 0: its eigenproblem failed.
   !> With impacts or friction `press` tells the signs of forces that press friction, and `constraints` what is held.
   function state_index(self, branch, press, constraints) result(i)
      type(contact_states_t), intent(inout) :: self
      integer, intent(in) :: branch(:)
      integer, intent(in), optional :: press(:)
      type(constraints_t), intent(in), optional :: constraints
      integer :: i

      type(contact_state_t), allocatable :: larger(:)

      do i = 1, self%count
         if (.not. all(self%state(i)%branch == branch)) cycle
         if (.not. self%jumps) exit
         if (all(self%state(i)%press == press)) exit
      end do
      if (i > self%count) then
         if (i > size(self%state)) then
            allocate (larger(2*size(self%state)))
            larger(:self%count) = self%state
            call move_alloc(larger, self%state)
         end if
         self%count = i
         self%state(i)%branch = branch
         if (self%jumps) call hold(self, self%state(i), press, constraints)
         call make_modes(self, i)
      end if
      if (self%state(i)%version /= self%version) then
         call make_response(self, self%state(i))
      end if
      if (self%state(i)%basis%info /= 0) i = 0
   end function state_index

   !> The modes of state `i`, or those of another state in which each contact has the same slopes.
   subroutine make_modes(self, i)
      type(contact_states_t), intent(inout) :: self
      integer, intent(in) :: i

      integer :: other

      if (self%jumps) then
         call make_jump_modes(self, self%state(i))
         return
      end if
      do other = 1, self%count
         if (self%state(other)%version /= self%version .or. other == i) cycle
         if (.not. same_slopes_in(self, self%state(other)%branch, self%state(i)%branch)) cycle
         self%state(i)%basis = self%state(other)%basis
         return
      end do
      call new_state_modes(self%state(i)%basis, self%open, self%machine, self%coupled, self%w, self%state(i)%branch)
   end subroutine make_modes

   !> Whether all contacts have the same slopes in two lists of branches.
   pure function same_slopes_in(self, a, b) result(same)
      type(contact_states_t), intent(in) :: self
      integer, intent(in) :: a(:), b(:)
      logical :: same

      integer :: j

      same = .true.
      do j = 1, size(a)
         associate (first => self%machine%contact(j)%law%branch(a(j)), second => self%machine%contact(j)%law%branch(b(j)))
            same = same .and. .not. (abs(first%stiffness - second%stiffness) > 0.0_wp &
                                     .or. abs(first%damping - second%damping) > 0.0_wp)
         end associate
      end do
   end function same_slopes_in

   subroutine make_response(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      real(wp) :: load(self%coupled%m)
      complex(wp) :: harmonic(self%coupled%m, size(self%omega))
      integer :: j, t

      state%version = self%version
      if (state%basis%info /= 0) return
      ! Not taken over from the machine before: no bit of a result may depend on what was computed earlier.
      state%level = exponent(max(state%basis%fastest, 1.0_wp))
      if (self%jumps) then
         call respond_with_jumps(self, state)
         return
      end if
      load = self%load
      harmonic = self%harmonic
      do j = 1, size(state%branch)
         associate (contact => self%machine%contact(j), branch => self%machine%contact(j)%law%branch(state%branch(j)))
            load = load - self%w(:, j)*(branch%stiffness*contact%offset + branch%offset)
            do t = 1, size(self%omega)
               harmonic(:, t) = harmonic(:, t) - self%w(:, j)*contact%error(t) &
                                *cmplx(branch%stiffness, self%omega(t)*branch%damping, wp)
            end do
         end associate
      end do
      call new_response(state%response, state%basis, load, harmonic, self%omega)
      call watch_contacts(self, state)
      call new_rows(state%observed, state%response, [(observed_form(self, state, j), j=1, size(self%machine%observable))])
   end subroutine make_response

   !> Rows and bounds of all switching functions that can end the state.
   subroutine watch_contacts(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      type(linear_form_t) :: forms(3*size(state%branch))
      type(watched_t) :: watched(6*size(state%branch))
      integer :: contact(6*size(state%branch)), function(6*size(state%branch)), next(6*size(state%branch))
      integer :: f, j, used, n

      used = 0
      n = 0
      do j = 1, size(state%branch)
         associate (law => self%machine%contact(j)%law)
            do f = 1, law%functions
               associate (guard => law%guard(f, state%branch(j)))
                  if (guard%below == 0 .and. guard%above == 0) cycle
                  used = used + 1
                  forms(used) = contact_form(self%machine, self%w, j, law%slope(1, f), law%slope(2, f), law%constant(f))
                  if (guard%below /= 0) call add(guard%below, 1.0_wp, guard%lower)
                  if (guard%above /= 0) call add(guard%above, -1.0_wp, guard%upper)
                  if (guard%below /= 0 .and. guard%above /= 0) watched(n)%shares_form = .true.
                  watched(n)%given = watched(n)%shares_form
               end associate
            end do
         end associate
      end do
      state%watched = watched(:n)
      state%contact = contact(:n)
      state%function = function(:n)
      state%next = next(:n)
      call new_rows(state%switching, state%response, forms(:used))

   contains

      subroutine add(beyond, side, bound)
         integer, intent(in) :: beyond
         real(wp), intent(in) :: side, bound

         n = n + 1
         watched(n) = watched_t(form=used, side=side, bound=bound)
         contact(n) = j
         function(n) = f
         next(n) = beyond
      end subroutine add

   end subroutine watch_contacts

   !> Have the rows of the contacts' variables in state i.
   subroutine lay_out_contacts(self, i)
      type(contact_states_t), intent(inout) :: self
      integer, intent(in) :: i

      integer :: j

      associate (state => self%state(i))
         if (state%touching_version == self%version) return
         state%touching_version = self%version
         call new_rows(state%touching, state%response, &
                       [(contact_form(self%machine, self%w, j, 1.0_wp, 0.0_wp, 0.0_wp), j=1, size(self%machine%contact))])
      end associate
   end subroutine lay_out_contacts

   !> Observable i in this state.
   pure function observed_form(self, state, i) result(form)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(in) :: state
      integer, intent(in) :: i
      type(linear_form_t) :: form

      associate (observable => self%machine%observable(i))
         if (observable%kind == observe_contact_force) then
            associate (contact => self%machine%contact(observable%contact))
               associate (branch => contact%law%branch(state%branch(observable%contact)))
                  form = contact_form(self%machine, self%w, observable%contact, contact%force_sign*branch%stiffness, &
                                      contact%force_sign*branch%damping, contact%force_sign*branch%offset)
               end associate
            end associate
         else
            form = observable_form(observable, self%coupled%project)
         end if
      end associate
   end function observed_form

end module razy_exact_contact_states
