!! The closed forms of a system's motion, one for each mode met: made when the motion first comes to the mode, and kept.
!!
!! What depends on the machine's matrices alone (eigenmodes) outlives a change of the excitation; what depends on the excitation
!! (response, rows) is made anew for every machine, and only for modes it visits. Modes in which contacts hold constraints are
!! followed in coordinates of their own (razy_exact_constrained_motion); friction under a damped contact is another one where that
!! contact pulls. Constraint forces and the forces of friction are linear forms of the motion, watched and observed as gaps are.
module razy_exact_solutions
   use razy_core_kinds, only: wp
   use razy_exact_beside, only: beside_t, joined
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_passage, only: passage_t
   use razy_exact_closed_form_response, only: finest_level, new_response, response_t
   use razy_exact_closed_form_rows, only: new_rows, rows_t
   use razy_exact_constrained_motion, only: constrained_motion_t, new_constrained_motion
   use razy_exact_modal_basis, only: modal_basis_t, new_modal_basis
   use razy_exact_modal_eigenmodes, only: new_eigenmodes, new_open_modes, open_modes_t
   use razy_exact_residual, only: new_probe, probe_t
   use razy_exact_search_refine, only: watched_t
   use razy_hybrid_guards, only: guard_entry_t, guard_forms, list_guards, of_press
   use razy_hybrid_linear_form, only: linear_form_t, new_form, zero_form
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   use razy_machine_machine, only: observe_contact_force
   implicit none(type, external)
   private

   public :: solution_t, solutions_t

   !> The motion in one mode.
   type :: solution_t
      integer, allocatable :: branch(:), press(:)
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
      !> Whether nothing is held, and no force that may change its sign presses friction; whether it is for flights after an impact.
      logical :: free = .true.
      logical, private :: flies = .false.
      !> Rows of the variables s of all contacts, made when they are asked for; of all contact forces, where one of them depends on
      !> more than its own s and s'.
      type(rows_t) :: touching, force
      logical :: has_forces = .false.
      !> Coordinates while constraints are held.
      type(constrained_motion_t) :: constrained
      !> How the motion comes from the others.
      type(passage_t), allocatable, private :: passage(:)
      !> Step level that the last search ended with, and that which a motion begins with.
      integer :: level = 10
      integer, private :: first_level = 10
      !> By how much it misses the machine's equations (razy_exact_residual).
      real(wp) :: residual = 0.0_wp
      !> Machine for which the response was made, and the rows of contacts.
      integer, private :: version = 0, touching_version = 0
      !> Whether the eigenmodes are those of the machine with the slopes of its contacts.
      logical, private :: plain = .true.
   end type solution_t

   !> All of them so far.
   type :: solutions_t
      integer :: count = 0
      type(solution_t), allocatable :: of(:)
      !> Whether the last mode asked for has no admissible constraint forces; whether its response was made for it.
      logical :: inadmissible = .false., fresh = .false.
      integer, private :: structure = 0
      type(open_modes_t), private :: open
      type(probe_t), private :: probe
   contains
      procedure :: attach
      procedure :: begin_run
      procedure :: find
      procedure :: lay_out_contacts
      procedure :: pass
   end type solutions_t

contains

   !> Make ready for a system, keeping the eigenmodes if only excitation, clearances or start differ from the last.
   subroutine attach(self, system)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      if (self%structure == system%structure) return
      self%structure = system%structure
      self%count = 0
      if (allocated(self%of)) deallocate (self%of)
      allocate (self%of(4))
      call new_open_modes(self%open, system)
      call new_probe(self%probe, system)
   end subroutine attach

   !> A motion begins: its bits do not depend on the one before.
   pure subroutine begin_run(self)
      class(solutions_t), intent(inout) :: self

      integer :: i

      do i = 1, self%count
         self%of(i)%level = self%of(i)%first_level
         if (allocated(self%of(i)%passage)) self%of(i)%passage%uses = 0
      end do
   end subroutine begin_run

   !> Put `start` at the start of a piece in solution i, from `last`, the end of the piece before it in solution `before`
   !> (razy_exact_closed_form_passage).
   subroutine pass(self, before, last, i, phasor, start, passed)
      class(solutions_t), intent(inout) :: self
      integer, intent(in) :: before, i
      type(amplitudes_t), intent(in) :: last
      complex(wp), intent(in) :: phasor(:)
      type(amplitudes_t), intent(inout) :: start
      logical, intent(out) :: passed

      type(passage_t), allocatable :: more(:)

      associate (from => self%of(before)%response, to => self%of(i))
         if (.not. allocated(to%passage)) allocate (to%passage(size(self%of)))
         if (size(to%passage) < before) then
            allocate (more(size(self%of)))
            more(:size(to%passage)) = to%passage
            call move_alloc(more, to%passage)
         end if
         call to%passage(before)%pass(from, last, to%response, phasor, start, passed)
      end associate
   end subroutine pass

   !> The number of the solution in `mode`, made ready for the system, and tested for a motion to `t_end`, s; 0: there is none. It
   !> `flies` after an impact, where the next may be near; `beside` it is what no contact feels.
   subroutine find(self, system, mode, flies, beside, t_end, i)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      logical, intent(in) :: flies
      type(beside_t), intent(in) :: beside
      real(wp), intent(in) :: t_end
      integer, intent(out) :: i

      type(solution_t), allocatable :: larger(:)

      do i = 1, self%count
         if (.not. all(self%of(i)%branch == mode%branch)) cycle
         if (all(self%of(i)%press == mode%press) .and. (self%of(i)%flies .eqv. flies)) exit
      end do
      if (i > self%count) then
         if (i > size(self%of)) then
            allocate (larger(2*size(self%of)))
            larger(:self%count) = self%of
            call move_alloc(larger, self%of)
         end if
         self%count = i
         self%of(i)%branch = mode%branch
         self%of(i)%press = mode%press
         self%of(i)%flies = flies
         call find_eigenmodes(self, system, mode, i)
      end if
      self%fresh = self%of(i)%version /= system%version
      if (self%fresh) call respond(self%of(i), system, mode, beside)
      self%inadmissible = .not. self%of(i)%constrained%found
      if (self%of(i)%basis%info /= 0) then
         i = 0
      else if (self%fresh) then
         associate (new => self%of(i))
            new%residual = self%probe%residual(system, mode, new%response, new%constrained, new%force, t_end)
         end associate
      end if
   end subroutine find

   !> The eigenmodes of mode i: of the coordinates in which it is free; where nothing is held and no friction depends on the motion,
   !> those of another such mode with the same slopes, or of the machine with each closed contact.
   subroutine find_eigenmodes(self, system, mode, i)
      type(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      integer, intent(in) :: i

      real(wp) :: k(system%m, system%m), b(system%m, system%m)
      real(wp), allocatable :: free(:, :)
      integer :: j, other, rigid

      associate (basis => self%of(i)%basis, constrained => self%of(i)%constrained, plain => self%of(i)%plain)
         plain = mode%constraints%count == 0 .and. .not. any([(slides_under_spring(system, mode, j), j=1, size(mode%branch))])
         if (plain) then
            do other = 1, self%count - 1
               if (.not. self%of(other)%plain) cycle
               if (.not. same_slopes_in(system, self%of(other)%branch, mode%branch)) cycle
               basis = self%of(other)%basis
               return
            end do
            call new_eigenmodes(basis, self%open, system, mode)
            return
         end if
         call mode%matrices(system, k, b)
         call mode%free_motions(system, free, rigid)
         if (mode%constraints%count > 0) then
            call new_constrained_motion(constrained, mode%constraints, system%w, coefficients(system, mode), k, b, &
                                        drives(system, mode), free, rigid)
            if (.not. constrained%found) then
               basis%info = 1
               return
            end if
            call constrained%transform_matrices(k, b)
            call constrained%unsprung_in_x(free, rigid)
         end if
         call new_modal_basis(basis, k, b, free, rigid)
      end associate
   end subroutine find_eigenmodes

   !> Whether all contacts have the same slopes in two lists of branches.
   pure function same_slopes_in(system, a, b) result(same)
      type(system_t), intent(in) :: system
      integer, intent(in) :: a(:), b(:)
      logical :: same

      integer :: j

      same = .true.
      do j = 1, size(a)
         associate (first => system%machine%contact(j)%law%branch(a(j)), second => system%machine%contact(j)%law%branch(b(j)))
            same = same .and. .not. (abs(first%stiffness - second%stiffness) > 0.0_wp &
                                     .or. abs(first%damping - second%damping) > 0.0_wp)
         end associate
      end do
   end function same_slopes_in

   !> Whether element j is friction that slides under a compliant contact.
   pure function slides_under_spring(system, mode, j) result(slides)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      integer, intent(in) :: j
      logical :: slides

      associate (law => system%machine%contact(j)%law, by => system%machine%contact(j)%normal_of)
         slides = law%of_normal .and. by > 0 .and. .not. law%constraint(mode%branch(j))
         if (slides) slides = .not. system%machine%contact(by)%law%impacts
      end associate
   end function slides_under_spring

   !> Speeds with which what is held is driven (constraints).
   pure function drives(system, mode) result(drive)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp) :: drive(mode%constraints%count)

      integer :: i

      do i = 1, size(drive)
         drive(i) = system%machine%contact(mode%constraints%contact(i))%drive
      end do
   end function drives

   !> Coefficients of the friction that constraints press (couplings).
   pure function coefficients(system, mode) result(phi)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp) :: phi(mode%constraints%couplings)

      integer :: i

      do i = 1, size(phi)
         associate (j => mode%constraints%sliding(i))
            phi(i) = system%machine%contact(j)%law%branch(mode%branch(j))%offset
         end associate
      end do
   end function coefficients

   !> Response and rows of a solution under the system's excitation.
   subroutine respond(self, system, mode, beside)
      type(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(beside_t), intent(in) :: beside

      type(linear_form_t) :: force(size(mode%branch)), observed(size(system%observed))
      real(wp) :: load(system%m)
      complex(wp) :: harmonic(system%m, size(system%omega))
      integer :: j

      self%version = system%version
      if (allocated(self%passage)) call self%passage%renew()
      if (self%basis%info /= 0) return
      ! Not taken over from the machine before: no bit of a result may depend on what was computed earlier.
      self%first_level = min(exponent(max(self%basis%fastest, 1.0_wp)), finest_level)
      self%level = self%first_level
      call mode%loads(system, load, harmonic)
      do j = 1, size(force)
         force(j) = mode%force_form(system, j)
      end do
      if (self%constrained%n > 0) then
         call add_reactions(self%constrained, system, mode, load, harmonic, force)
         harmonic = self%constrained%harmonic_of(harmonic, errors_of(system, self%constrained), system%turning)
         load = self%constrained%load_of(load)
      end if
      call new_response(self%response, self%basis, self%flies, load, harmonic, system%turning, system%slope)
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
      if (.not. self%has_forces) return
      do j = 1, size(force)
         force(j) = self%constrained%form_of(force(j))
      end do
      call new_rows(self%force, self%response, force)
   end subroutine respond

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
                                [size(load) + size(system%load_beside), size(system%omega)]), system%turning, system%slope)
      do j = 1, size(observed)
         associate (own => observed(j), beyond => system%beyond(j))
            whole(j) = new_form([own%on_y, beyond%on_y], [own%on_v, beyond%on_v], own%constant, own%error)
         end associate
      end do
      call new_rows(self%observed_whole, self%whole, whole)
   end subroutine respond_whole

   !> Phasors of the errors of what is held (n, tones).
   pure function errors_of(system, constrained) result(error)
      type(system_t), intent(in) :: system
      type(constrained_motion_t), intent(in) :: constrained
      complex(wp) :: error(constrained%n, size(system%omega))

      integer :: i

      do i = 1, constrained%n
         error(i, :) = system%machine%contact(constrained%contact(i))%error
      end do
   end function errors_of

   !> Add constraint forces, and the friction under them, to the forces of all contacts; load (m) and phasors (m, tones) are
   !> those of the mode without constraints.
   subroutine add_reactions(constrained, system, mode, load, harmonic, force)
      type(constrained_motion_t), intent(in) :: constrained
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      real(wp), intent(in) :: load(:)
      complex(wp), intent(in) :: harmonic(:, :)
      type(linear_form_t), intent(inout) :: force(:)

      real(wp) :: k(system%m, system%m), b(system%m, system%m)
      integer :: i

      call mode%matrices(system, k, b)
      do i = 1, constrained%n
         force(constrained%contact(i)) = constrained%reaction(i, k, b, load, harmonic, errors_of(system, constrained), &
                                                              system%turning)
      end do
      do i = 1, size(constrained%sliding)
         call force(constrained%sliding(i))%add(constrained%share(i), force(constrained%contact(constrained%row(i))))
      end do
   end subroutine add_reactions

   !> Rows and bounds of all guards of the mode; two bounds of one function share its row.
   subroutine watch_guards(self, system, mode, force)
      type(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(linear_form_t), intent(in) :: force(:)

      type(guard_entry_t) :: entry(8*size(force))
      type(linear_form_t) :: form(8*size(force))
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
         end if
         self%watched(i) = watched_t(form=rows, side=entry(i)%side, bound=entry(i)%bound, shares_form=entry(i)%shares, &
                                     given=entry(i)%shares)
      end do
      call new_rows(self%switching, self%response, form(:rows))
      self%fixed = [(is_fixed(self, form(self%watched(i)%form), self%watched(i)%form), i=1, n)]
      self%free = self%constrained%n == 0 .and. .not. any(entry(:n)%function == of_press)
      self%crosses = [(self%free .and. is_lone_spring(system, entry(i)%contact), i=1, n)]
   end subroutine watch_guards

   !> Whether contact j neither impacts nor holds, and no friction goes with it or is pressed by it.
   pure function is_lone_spring(system, j) result(is)
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      logical :: is

      associate (contact => system%machine%contact)
         is = .not. (contact(j)%law%impacts .or. any(contact(j)%law%constraint)) &
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

   !> Have the rows of the contacts' variables in solution i.
   subroutine lay_out_contacts(self, system, i)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: i

      if (self%of(i)%touching_version /= system%version) call row_contacts(self%of(i), system)
   end subroutine lay_out_contacts

   subroutine row_contacts(self, system)
      type(solution_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      type(linear_form_t) :: gap(size(system%gap))
      integer :: j

      do j = 1, size(gap)
         gap(j) = self%constrained%form_of(system%gap(j))
      end do
      call new_rows(self%touching, self%response, gap)
      self%touching_version = system%version
   end subroutine row_contacts

end module razy_exact_solutions
