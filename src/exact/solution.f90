!! The closed form of a system's motion in one mode.
!!
!! What depends on the machine's matrices alone (eigenmodes) outlives a change of the excitation; what depends on the excitation
!! (response, rows) is made anew for every machine. Modes in which contacts hold constraints are followed in coordinates of their
!! own (razy_exact_constrained_motion); friction under a damped contact is another one where that contact pulls. Constraint forces
!! and the forces of friction are linear forms of the motion, watched and observed as gaps are.
module razy_exact_solution
   use razy_contact_gap_law, only: gap_law_t
   use razy_core_kinds, only: i8, wp
   use razy_exact_beside, only: beside_t, joined
   use razy_exact_closed_form_response, only: finest_level, new_response, response_t
   use razy_exact_closed_form_rows, only: new_rows, rows_t
   use razy_exact_constrained_motion, only: constrained_motion_t, new_constrained_motion
   use razy_exact_held, only: add_reactions, coefficients, drives, errors_of
   use razy_exact_modal_basis, only: modal_basis_t, new_modal_basis
   use razy_exact_modal_eigenmodes, only: new_eigenmodes, open_modes_t
   use razy_exact_search_refine, only: watched_t
   use razy_hybrid_guards, only: guard_entry_t, guard_forms, list_guards, of_press
   use razy_hybrid_linear_form, only: linear_form_t, new_form, zero_form
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   use razy_machine_machine, only: observe_contact_force
   implicit none(type, external)
   private

   public :: solution_t

   !> The motion in one mode.
   type :: solution_t
      integer, allocatable :: branch(:), press(:)
      !> Whether it is for flights after an impact.
      logical :: flies = .false.
      type(modal_basis_t) :: basis
      type(response_t) :: response
      !> Rows of the guards and of the observables.
      type(rows_t) :: switching, observed
      !> The motion with what is beside it, and the rows of observables there, where one of them feels that.
      type(response_t) :: whole
      type(rows_t) :: observed_whole
      !> The guards that can end the mode; which of them are functions of the constraints alone, and beyond which of them a contact
      !> has another branch and nothing else changes.
      type(guard_entry_t), allocatable :: entry(:)
      type(watched_t), allocatable :: watched(:)
      logical, allocatable :: fixed(:), crosses(:)
      !> Whether nothing is held, and no force that may change its sign presses friction.
      logical :: free = .true.
      !> Forms of the contact forces on the state, where one of them depends on more than its own s and s', or on s'; which of them
      !> do (contacts).
      logical :: has_forces = .false.
      logical, allocatable :: damped(:)
      type(linear_form_t), allocatable :: acting(:)
      !> Rows of the variables s of all contacts, and of those forces, made when they are asked for.
      type(rows_t) :: touching, force
      !> Coordinates while constraints are held.
      type(constrained_motion_t) :: constrained
      !> Step level that the last search ended with, and that which a motion begins with.
      integer :: level = 10, first_level = 10
      !> By how much it misses the machine's equations (razy_exact_residual).
      real(wp) :: residual = 0.0_wp
      !> Whether no mode was left out that nothing feels.
      logical :: complete = .true.
      !> Machine for which the response was made, and the rows of contacts.
      integer :: version = 0, touching_version = 0
      !> Whether the eigenmodes are those of the machine with the slopes of its contacts, and a sum of these.
      logical, private :: plain = .true.
      real(wp), private :: slopes = 0.0_wp
   contains
      procedure :: begin
      procedure :: is_of
      procedure :: shares_modes
      procedure :: find_modes
      procedure :: respond
      procedure :: lay_out_contacts
      procedure :: numbers
   end type solution_t

   !> A smaller part of a direction that is across others is rounding.
   real(wp), parameter :: least_part = 1.0e-6_wp

contains

   !> Whether it is the motion in `mode`.
   pure logical function is_of(self, mode, flies)
      class(solution_t), intent(in) :: self
      type(mode_t), intent(in) :: mode
      logical, intent(in) :: flies

      is_of = self%flies .eqv. flies
      if (is_of) is_of = all(self%branch == mode%branch)
      if (is_of) is_of = all(self%press == mode%press)
   end function is_of

   !> Become the motion in `mode`, without eigenmodes.
   subroutine begin(self, system, mode, flies)
      class(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      logical, intent(in) :: flies

      integer :: j

      self%branch = mode%branch
      self%press = mode%press
      self%flies = flies
      self%plain = mode%constraints%count == 0 .and. .not. any([(slides_under_spring(system, mode, j), j=1, size(mode%branch))])
      do j = 1, size(mode%branch)
         associate (piece => system%machine%contact(j)%law%branch(mode%branch(j)))
            self%slopes = self%slopes + j*piece%stiffness + (j + 0.5_wp)*piece%damping
         end associate
      end do
   end subroutine begin

   !> Whether the eigenmodes are those of another: where nothing is held, no friction depends on the motion and all contacts have
   !> the same slopes.
   pure function shares_modes(self, system, other) result(same)
      class(solution_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(solution_t), intent(in) :: other
      logical :: same

      integer :: j

      same = self%plain .and. other%plain .and. .not. abs(self%slopes - other%slopes) > 0.0_wp
      if (.not. same) return
      do j = 1, size(self%branch)
         associate (law => system%machine%contact(j)%law)
            associate (a => law%branch(self%branch(j)), b => law%branch(other%branch(j)))
               same = same .and. .not. (abs(a%stiffness - b%stiffness) > 0.0_wp .or. abs(a%damping - b%damping) > 0.0_wp)
            end associate
         end associate
      end do
   end function shares_modes

   !> The eigenmodes: of the coordinates in which it is free; where nothing is held and no friction depends on the motion, those of
   !> the machine with each closed contact.
   subroutine find_modes(self, system, mode, open)
      class(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(open_modes_t), intent(inout) :: open

      real(wp) :: k(system%m, system%m), b(system%m, system%m)
      real(wp), allocatable :: free(:, :)
      integer :: rigid

      if (self%plain) then
         call new_eigenmodes(self%basis, open, system, mode)
         return
      end if
      associate (constrained => self%constrained)
         call mode%matrices(system, k, b)
         call mode%free_motions(system, free, rigid)
         if (mode%constraints%count > 0) then
            call new_constrained_motion(constrained, mode%constraints, system%w, coefficients(system, mode), k, b, &
                                        drives(system, mode), free, rigid)
            if (.not. constrained%found) then
               self%basis%info = 1
               return
            end if
            call constrained%unsprung_in_x(free, rigid)
         end if
         call new_modal_basis(self%basis, k, b, free, rigid)
      end associate
   end subroutine find_modes

   !> Whether element j is friction that slides under a compliant contact.
   pure function slides_under_spring(system, mode, j) result(slides)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      integer, intent(in) :: j
      logical :: slides

      associate (law => system%machine%contact(j)%law, by => system%machine%contact(j)%normal_of)
         slides = law%of_normal .and. by > 0 .and. .not. law%branch(mode%branch(j))%constraint
         if (slides) slides = .not. system%machine%contact(by)%law%impacts
      end associate
   end function slides_under_spring

   !> Response and rows of a solution under the system's excitation.
   subroutine respond(self, system, mode, beside)
      class(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(beside_t), intent(in) :: beside

      type(linear_form_t) :: force(size(mode%branch)), observed(size(system%observed))
      real(wp) :: load(system%m), origin(system%m)
      complex(wp) :: harmonic(system%m, size(system%omega))
      integer :: j

      self%version = system%version
      if (self%basis%info /= 0) return
      ! Not taken over from the machine before: no bit of a result may depend on what was computed earlier.
      self%first_level = min(exponent(max(self%basis%fastest, 1.0_wp)), finest_level)
      call mode%loads(system, load, harmonic)
      do j = 1, size(force)
         force(j) = mode%force_form(system, j)
      end do
      if (self%constrained%n > 0) then
         call add_reactions(self%constrained, system, mode, load, harmonic, force)
         harmonic = self%constrained%harmonic_of(harmonic, errors_of(system, self%constrained), system%turning)
         load = self%constrained%load_of(load)
      end if
      origin = edges_of(system, mode)
      if (any(abs(origin) > 0.0_wp)) then
         load = system%load - matmul(system%coupled%stiffness, origin) &
                - matmul(system%w, [(force(j)%at_rest(origin), j=1, size(force))])
      end if
      call new_response(self%response, self%basis, self%flies, load, harmonic, system%turning, system%slope, &
                        origin(:self%basis%m))
      call watch_guards(self, system, mode, force)
      do j = 1, size(observed)
         associate (observable => system%machine%observable(j))
            if (observable%kind == observe_contact_force) then
               observed(j) = zero_form(system%m, size(system%omega))
               call observed(j)%add(system%machine%contact(observable%contact)%force_sign, force(observable%contact))
            else
               observed(j) = system%observed(j)
            end if
         end associate
         observed(j) = self%constrained%form_of(observed(j))
      end do
      call new_rows(self%observed, self%response, observed)
      if (any(system%is_beyond)) call respond_whole(self, system, beside, load, harmonic, observed)
      self%has_forces = .not. self%free .or. any([(system%machine%contact(j)%law%of_normal, j=1, size(force))])
      self%damped = [(abs(system%machine%contact(j)%law%branch(mode%branch(j))%damping) > 0.0_wp, j=1, size(force))]
      self%acting = force(:merge(size(force), 0, self%has_forces .or. any(self%damped)))
   end subroutine respond

   !> Where closed compliant contacts touch, the shortest way there (m), 0 where contacts are held: a closed form that counts from
   !> there has depths of contacts to rounding of themselves, not of clearances.
   pure function edges_of(system, mode) result(y)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp) :: y(system%m)

      real(wp) :: across(system%m), taken(system%m, size(mode%branch))
      integer :: j, n

      y = 0.0_wp
      n = 0
      if (mode%constraints%count > 0) return
      do j = 1, size(mode%branch)
         select type (law => system%machine%contact(j)%law)
         class is (gap_law_t)
            if (law%impacts .or. .not. law%branch(mode%branch(j))%closed) cycle
            across = system%w(:, j) - matmul(taken(:, :n), matmul(system%w(:, j), taken(:, :n)))
            if (norm2(across) <= least_part*norm2(system%w(:, j))) cycle
            n = n + 1
            taken(:, n) = across/norm2(across)
            y = y + taken(:, n)*((law%edge(mode%branch(j)) - system%gap(j)%at_rest(y))/dot_product(taken(:, n), system%w(:, j)))
         end select
      end do
   end function edges_of

   !> Response and rows of observables of the motion with what is beside it, under the load (m) and the phasors (m, tones) of the
   !> motion; `observed` are the observables as forms of that.
   subroutine respond_whole(self, system, beside, load, harmonic, observed)
      type(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(beside_t), intent(in) :: beside
      real(wp), intent(in) :: load(:)
      complex(wp), intent(in) :: harmonic(:, :)
      type(linear_form_t), intent(in) :: observed(:)

      type(linear_form_t) :: whole(size(observed))
      integer :: j, t

      call new_response(self%whole, joined(self%basis, beside%basis), self%flies, [load, system%load_beside], &
                        reshape([([harmonic(:, t), system%harmonic_beside(:, t)], t=1, size(system%omega))], &
                                [size(load) + size(system%load_beside), size(system%omega)]), system%turning, system%slope, &
                        [self%response%origin(:system%m), 0*system%load_beside])
      do j = 1, size(observed)
         associate (own => observed(j), beyond => system%beyond(j))
            whole(j) = new_form([own%on_y, beyond%on_y], [own%on_v, beyond%on_v], own%constant, own%error)
         end associate
      end do
      call new_rows(self%observed_whole, self%whole, whole)
   end subroutine respond_whole

   !> Rows and bounds of all guards of the mode; two bounds of one function share its row.
   subroutine watch_guards(self, system, mode, force)
      type(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(linear_form_t), intent(in) :: force(:)

      type(guard_entry_t) :: entry(8*size(force))
      type(linear_form_t) :: form(8*size(force))
      real(wp) :: bound
      integer :: i, n, rows

      call list_guards(system, mode, entry, n)
      call guard_forms(system, mode, force, entry(:n), form(:n))
      self%entry = entry(:n)
      if (allocated(self%watched)) deallocate (self%watched)
      allocate (self%watched(n))
      rows = 0
      do i = 1, n
         if (.not. entry(i)%shares) then
            rows = rows + 1
            form(rows) = self%constrained%form_of(form(i))
            ! What is watched is how far it is from its bound.
            bound = entry(i)%bound
            form(rows)%constant = form(rows)%constant - bound
         end if
         self%watched(i) = watched_t(form=rows, side=entry(i)%side, bound=entry(i)%bound - bound, shares_form=entry(i)%shares, &
                                     given=entry(i)%shares)
      end do
      call new_rows(self%switching, self%response, form(:rows))
      self%fixed = [(is_fixed(self, form(self%watched(i)%form), self%watched(i)%form), i=1, n)]
      self%free = self%constrained%n == 0 .and. .not. any(entry(:n)%function == of_press)
      self%crosses = [(self%free .and. is_lone_spring(system, entry(i)%contact), i=1, n)]
   end subroutine watch_guards

   !> Whether contact j neither impacts nor holds nor remembers, and no friction goes with it or is pressed by it.
   pure function is_lone_spring(system, j) result(is)
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      logical :: is

      associate (contact => system%machine%contact)
         is = .not. (contact(j)%law%impacts .or. contact(j)%law%remembers .or. any(contact(j)%law%branch%constraint)) &
              .and. .not. any(contact%normal_of == j .or. contact%only_with == j)
      end associate
   end function is_lone_spring

   !> Whether a guard depends on what is held alone, and so does not move but with the excitation and the drives.
   pure function is_fixed(self, form, row) result(fixed)
      type(solution_t), intent(in) :: self
      type(linear_form_t), intent(in) :: form
      integer, intent(in) :: row
      logical :: fixed

      real(wp), parameter :: negligible = 1.0e-11_wp

      fixed = self%constrained%n > 0
      if (.not. fixed) return
      associate (free => self%constrained%m - self%constrained%rank)
         fixed = norm2(form%on_y(:free)) <= negligible*norm2(form%on_y) &
                 .and. norm2(form%on_v(:free)) <= negligible*norm2(form%on_v) &
                 .and. all(self%switching%moduli(:, 0, row) <= negligible*self%switching%longest_reach(row))
      end associate
   end function is_fixed

   !> Have the rows of the contacts' variables, and those of their forces.
   subroutine lay_out_contacts(self, system)
      class(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      type(linear_form_t) :: form(size(system%gap))
      integer :: j

      self%touching_version = system%version
      do j = 1, size(form)
         form(j) = self%constrained%form_of(system%gap(j))
      end do
      call new_rows(self%touching, self%response, form)
      if (size(self%acting) == 0) return
      do j = 1, size(form)
         form(j) = self%constrained%form_of(self%acting(j))
      end do
      call new_rows(self%force, self%response, form)
   end subroutine lay_out_contacts

   !> Numbers that it holds.
   pure integer(i8) function numbers(self)
      class(solution_t), intent(in) :: self

      numbers = self%basis%numbers() + self%constrained%numbers() + self%response%numbers() + self%whole%numbers() &
                + self%switching%numbers() + self%observed%numbers() + self%observed_whole%numbers() + self%touching%numbers() &
                + self%force%numbers()
      if (.not. allocated(self%watched)) return
      numbers = numbers + 2*self%response%m*size(self%acting) &
                + (storage_size(self) + size(self%watched)*(storage_size(self%watched) + storage_size(self%entry)) &
                   + size(self%acting)*storage_size(self%acting))/storage_size(1.0_wp)
   end function numbers

end module razy_exact_solution
