!! The contact states of a machine: modes and closed form of each, made when the motion first comes to it.
!!
!! What depends on the machine's matrices alone (coupled coordinates, modes) outlives a change of the excitation; what depends
!! on the excitation (response, rows) is made anew for every machine that is attached, and only for states it visits.
!!
!! A machine with impacts or friction has two things more: states in which contacts hold constraints are followed in coordinates
!! of their own (razy_integrate_held), and the friction under a damped contact is another one where that contact pulls.
module razy_integrate_contact_states
   use razy_contact_contact_law, only: guard_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_integrate_constraints, only: constraints_t
   use razy_integrate_force_forms, only: add_contacts, add_form, add_loads, contact_form, force_form, normal_form, &
                                        zero_form
   use razy_integrate_held, only: held_t, new_held
   use razy_integrate_modal_basis, only: modal_basis_t, new_modal_basis
   use razy_integrate_refine, only: watched_t
   use razy_integrate_response, only: linear_form_t, new_response, new_rows, response_t, rows_t
   use razy_linalg_lapack, only: dposv
   use razy_machine_coupled, only: coupled_t, new_coupled
   use razy_machine_machine, only: contact_t, machine_t, observable_t, observe_contact_force, same_structure
   implicit none(type, external)
   private

   public :: attach, contact_state_t, contact_states_t, state_index

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
      !> Of machines with jumps: signs of the forces that press friction (contacts); coordinates while constraints are held; rows
      !> of all contact forces; which of `watched` are functions of the constraints alone.
      integer, allocatable :: press(:)
      type(held_t) :: held
      type(rows_t) :: force
      logical, allocatable :: fixed(:)
      !> Machine for which the response was made.
      integer :: version = 0
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
      !> Contact directions (m, contacts), constant load (m), phasors (m, tones), frequencies (tones), rad/s.
      real(wp), allocatable :: w(:, :), load(:), omega(:)
      complex(wp), allocatable :: harmonic(:, :)
   end type contact_states_t

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
      end if
      self%jumps = any([(any(machine%contact(j)%law%constraint), j=1, size(machine%contact))])
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
         call make_modes(self, self%state(i))
      end if
      if (self%state(i)%version /= self%version) call make_response(self, self%state(i))
      if (self%state(i)%basis%info /= 0) i = 0
   end function state_index

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

   subroutine make_modes(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      real(wp) :: k(self%coupled%m, self%coupled%m), b(self%coupled%m, self%coupled%m)
      real(wp), allocatable :: rigid(:, :)
      logical :: known
      integer :: i, j

      if (self%jumps) then
         call make_modes_with_jumps(self, state)
         return
      end if
      k = self%coupled%stiffness
      b = self%coupled%damping
      do j = 1, size(state%branch)
         associate (branch => self%machine%contact(j)%law%branch(state%branch(j)))
            do i = 1, self%coupled%m
               k(:, i) = k(:, i) + branch%stiffness*self%w(:, j)*self%w(i, j)
               b(:, i) = b(:, i) + branch%damping*self%w(:, j)*self%w(i, j)
            end do
         end associate
      end do
      call new_modal_basis(state%basis, k, b, self%omega)
      if (state%basis%info /= 0 .or. size(state%basis%rigid, 2) == 0) return
      rigid = state%basis%rigid
      call refine_rigid_modes(self, state%branch, k, rigid, known)
      if (known) call new_modal_basis(state%basis, k, b, self%omega, rigid)
   end subroutine make_modes

   subroutine make_modes_with_jumps(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      real(wp) :: k(self%coupled%m, self%coupled%m), b(self%coupled%m, self%coupled%m)

      call free_matrices(self, state, k, b)
      if (state%held%n > 0) then
         if (.not. state%held%found) then
            state%basis%info = 1
            return
         end if
         call state%held%transform_matrices(k, b)
      end if
      call new_modal_basis(state%basis, k, b, self%omega)
   end subroutine make_modes_with_jumps

   !> Rigid modes to rounding. An eigenproblem knows them to epsilon times the ratio of the largest to the smallest stiffness,
   !> and constant loads that are in balance then drive them. Here K v is formed from the machine's own matrices in extended
   !> precision, where the terms of a rigid motion cancel, and v corrected by (K + s V Vᵀ)⁻¹ K v.
   subroutine refine_rigid_modes(self, branch, k, rigid, known)
      type(contact_states_t), intent(in) :: self
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: k(:, :)
      real(wp), intent(inout) :: rigid(:, :)
      logical, intent(out) :: known

      integer, parameter :: rounds = 2
      real(wp) :: shifted(size(k, 1), size(k, 1)), rest(size(rigid, 1), size(rigid, 2))
      integer :: i, info, round

      known = .false.
      do round = 1, rounds
         do i = 1, size(rigid, 2)
            rest(:, i) = restoring_of(self, branch, rigid(:, i))
         end do
         shifted = k + maxval(abs(k))*matmul(rigid, transpose(rigid))
         call dposv("L", size(k, 1), size(rest, 2), shifted, size(k, 1), rest, size(k, 1), info)
         if (info /= 0) return
         rigid = rigid - rest
         do i = 1, size(rigid, 2)
            rigid(:, i) = rigid(:, i) - matmul(rigid(:, :i - 1), matmul(rigid(:, i), rigid(:, :i - 1)))
            rigid(:, i) = rigid(:, i)/norm2(rigid(:, i))
         end do
      end do
      known = .true.
   end subroutine refine_rigid_modes

   !> K v in coupled coordinates (m), contacts with their branches included, formed in extended precision.
   pure function restoring_of(self, branch, v) result(force)
      type(contact_states_t), intent(in) :: self
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: force(size(v))

      real(qp) :: q(size(self%machine%mass, 1)), f(size(self%machine%mass, 1))
      integer :: j

      q = matmul(real(v, qp), real(self%coupled%project, qp))
      f = matmul(real(self%machine%stiffness, qp), q)
      do j = 1, size(branch)
         associate (contact => self%machine%contact(j))
            f = f + contact%law%branch(branch(j))%stiffness*dot_product(real(contact%w, qp), q)*real(contact%w, qp)
         end associate
      end do
      force = real(matmul(real(self%coupled%project, qp), f), wp)
   end function restoring_of

   subroutine make_response(self, state)
      type(contact_states_t), intent(in) :: self
      type(contact_state_t), intent(inout) :: state

      real(wp) :: load(self%coupled%m)
      complex(wp) :: harmonic(self%coupled%m, size(self%omega))
      integer :: j, t

      if (state%version > 0) then
         if (state%basis%is_resonant_with(self%omega)) call make_modes(self, state)
      end if
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
            form%on_y = matmul(self%coupled%project, observable%on_displacement)
            form%on_v = matmul(self%coupled%project, observable%on_velocity)
            form%constant = observable%constant
            form%error = observable%error
         end if
      end associate
   end function observed_form

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
            observed(j) = observed_form(self, state, j)
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

end module razy_integrate_contact_states
