!! The closed forms of a system's motion, one for each mode: made when a motion comes to it, and kept as long as there is room.
!!
!! They are found by their keys. Where they would take more memory than they may, the one that was used least recently goes, with
!! the passages from it, and is made again when the motion comes back, with the same bits: a form depends on the mode alone, and
!! what a motion has learned in a mode stands apart (razy_exact_tally).
module razy_exact_solutions
   use razy_core_kinds, only: i8, wp
   use razy_exact_beside, only: beside_t
   use razy_exact_closed_form_amplitudes, only: amplitudes_t
   use razy_exact_closed_form_passage, only: passage_t, pays
   use razy_exact_modal_eigenmodes, only: new_open_modes, open_modes_t
   use razy_exact_residual, only: is_whole, new_probe, probe_t
   use razy_exact_solution, only: solution_t
   use razy_exact_tally, only: key_type, mixed, tally_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: solutions_t

   !> Chains of places with keys that are equal in their last digits.
   integer(key_type), parameter :: chains = 1024

   !> A place for a closed form.
   type :: place_t
      !> None in a place that is vacant.
      type(solution_t), allocatable :: form
      !> The next in its chain; its key; numbers that it holds, and when it was used last, 0: vacant.
      integer, private :: next = 0
      integer(key_type), private :: key = 0
      integer(i8), private :: numbers = 0, used = 0
      !> How the motion comes from others, and the places of these.
      type(passage_t), allocatable, private :: passage(:)
      integer, allocatable, private :: from(:)
   end type place_t

   type :: solutions_t
      type(place_t), allocatable :: of(:)
      !> Whether the last mode asked for has no admissible constraint forces; whether its response was made for it.
      logical :: inadmissible = .false., fresh = .false.
      !> Modes that the motion came to.
      integer :: met = 0
      integer, private :: structure = 0, first(0:chains - 1) = 0
      !> Numbers that all hold, and may hold; uses so far.
      integer(i8), private :: numbers = 0, most_numbers = 0, clock = 0
      type(open_modes_t), private :: open
      type(probe_t), private :: probe
      !> Of the motion under way: the step level of each mode, and how often it went from one to another over the state.
      type(tally_t), private :: levels, ways
      !> The place used last, and that of its level; 0: none yet.
      integer, private :: last = 0, last_level = 0
   contains
      procedure :: attach
      procedure :: begin_run
      procedure :: find
      procedure :: lay_out_contacts
      procedure :: pass
   end type solutions_t

contains

   !> Make ready for a system, keeping the eigenmodes if only excitation, clearances or start differ from the last; all forms may
   !> hold so many numbers, but the last two used are kept in any case.
   subroutine attach(self, system, most_numbers)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer(i8), intent(in) :: most_numbers

      self%most_numbers = most_numbers
      if (self%structure == system%structure) return
      self%structure = system%structure
      if (allocated(self%of)) deallocate (self%of)
      allocate (self%of(4))
      self%first = 0
      self%numbers = 0
      self%last = 0
      call new_open_modes(self%open, system)
      call new_probe(self%probe, system)
   end subroutine attach

   !> A motion begins: its bits do not depend on the one before.
   pure subroutine begin_run(self)
      class(solutions_t), intent(inout) :: self

      self%last = 0
      self%met = 0
      call self%levels%forget()
      call self%ways%forget()
   end subroutine begin_run

   !> The place of the solution in `mode`, made ready for the system, and tested for a motion to `t_end`, s; 0: there is none. It
   !> `flies` after an impact, where the next may be near; `beside` it is what no contact feels.
   subroutine find(self, system, mode, flies, beside, t_end, i)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      logical, intent(in) :: flies
      type(beside_t), intent(in) :: beside
      real(wp), intent(in) :: t_end
      integer, intent(out) :: i

      integer(key_type) :: key
      integer :: j
      logical :: new

      key = merge(1, 2, flies)
      do j = 1, size(mode%branch)
         key = mixed(key, 4*mode%branch(j) + mode%press(j))
      end do
      i = self%first(modulo(key, chains))
      do while (i > 0)
         if (self%of(i)%key == key) then
            if (self%of(i)%form%is_of(mode, flies)) exit
         end if
         i = self%of(i)%next
      end do
      if (i == 0) call add(self, system, mode, flies, key, i)
      if (self%last > 0) self%levels%value(self%last_level) = self%of(self%last)%form%level
      self%clock = self%clock + 1
      self%of(i)%used = self%clock
      associate (form => self%of(i)%form)
         self%fresh = form%version /= system%version
         if (self%fresh) call form%respond(system, mode, beside)
         self%inadmissible = .not. form%constrained%found
         self%last = merge(i, 0, form%basis%info == 0)
         i = self%last
         if (i == 0) return
         call self%levels%find(key, form%first_level, self%last_level, new)
         if (new) self%met = self%met + 1
         form%level = self%levels%value(self%last_level)
         if (.not. self%fresh) return
         form%complete = is_whole(form%response)
         form%residual = self%probe%residual(system, mode, form%response, form%constrained, form%acting, t_end)
      end associate
      call self%of(i)%passage%renew()
      call weigh(self, i)
   end subroutine find

   !> A place `i` with the eigenmodes in a mode.
   subroutine add(self, system, mode, flies, key, i)
      type(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      logical, intent(in) :: flies
      integer(key_type), intent(in) :: key
      integer, intent(out) :: i

      type(place_t), allocatable :: more(:)
      integer :: chain, other

      i = findloc(self%of%used, 0_i8, dim=1)
      if (i == 0) then
         i = size(self%of) + 1
         allocate (more(2*size(self%of)))
         do other = 1, size(self%of)
            call move(self%of(other), more(other))
         end do
         call move_alloc(more, self%of)
      end if
      chain = int(modulo(key, chains))
      self%of(i)%key = key
      self%of(i)%next = self%first(chain)
      self%first(chain) = i
      allocate (self%of(i)%form, self%of(i)%passage(0), self%of(i)%from(0))
      associate (form => self%of(i)%form)
         call form%begin(system, mode, flies)
         do other = 1, size(self%of)
            if (self%of(other)%used == 0) cycle
            if (.not. form%shares_modes(system, self%of(other)%form)) cycle
            form%basis = self%of(other)%form%basis
            return
         end do
         call form%find_modes(system, mode, self%open)
      end associate
   end subroutine add

   !> Move what is in a place to another.
   pure subroutine move(from, to)
      type(place_t), intent(inout) :: from, to

      call move_alloc(from%form, to%form)
      call move_alloc(from%passage, to%passage)
      call move_alloc(from%from, to%from)
      to%next = from%next
      to%key = from%key
      to%numbers = from%numbers
      to%used = from%used
   end subroutine move

   !> Take up what place i holds now, and let go of others until there is room.
   subroutine weigh(self, i)
      type(solutions_t), intent(inout) :: self
      integer, intent(in) :: i

      integer :: oldest

      self%numbers = self%numbers - self%of(i)%numbers
      self%of(i)%numbers = self%of(i)%form%numbers() + sum(self%of(i)%passage%numbers())
      self%numbers = self%numbers + self%of(i)%numbers
      do while (self%numbers > self%most_numbers)
         oldest = minloc(self%of%used, mask=self%of%used > 0 .and. self%of%used < self%clock - 1, dim=1)
         if (oldest == 0) return
         call let_go(self, oldest)
      end do
   end subroutine weigh

   !> Make place i vacant.
   subroutine let_go(self, i)
      type(solutions_t), intent(inout) :: self
      integer, intent(in) :: i

      integer :: at, chain, k

      chain = int(modulo(self%of(i)%key, chains))
      at = self%first(chain)
      if (at == i) then
         self%first(chain) = self%of(i)%next
      else
         do while (self%of(at)%next /= i)
            at = self%of(at)%next
         end do
         self%of(at)%next = self%of(i)%next
      end if
      deallocate (self%of(i)%form, self%of(i)%passage, self%of(i)%from)
      self%numbers = self%numbers - self%of(i)%numbers
      self%of(i)%numbers = 0
      self%of(i)%used = 0
      do at = 1, size(self%of)
         if (.not. allocated(self%of(at)%from)) cycle
         k = place_of(self%of(at)%from, i)
         if (k == 0) cycle
         self%of(at)%numbers = self%of(at)%numbers - self%of(at)%passage(k)%numbers()
         self%numbers = self%numbers - self%of(at)%passage(k)%numbers()
         self%of(at)%from(k) = 0
         self%of(at)%passage(k) = passage_t()
      end do
   end subroutine let_go

   !> Have the rows of the contacts' variables in solution i.
   subroutine lay_out_contacts(self, system, i)
      class(solutions_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: i

      if (self%of(i)%form%touching_version == system%version) return
      call self%of(i)%form%lay_out_contacts(system)
      call weigh(self, i)
   end subroutine lay_out_contacts

   !> Put `start` at the start of a piece in solution i, from `last`, the end of the piece before it in solution `before`
   !> (razy_exact_closed_form_passage); not `passed`: from the state it takes no longer.
   subroutine pass(self, before, last, i, phasor, start, passed)
      class(solutions_t), intent(inout) :: self
      integer, intent(in) :: before, i
      type(amplitudes_t), intent(in) :: last
      complex(wp), contiguous, intent(in) :: phasor(:)
      type(amplitudes_t), intent(inout) :: start
      logical, intent(out) :: passed

      integer :: at, k
      logical :: new

      associate (from => self%of(before)%form%response, to => self%of(i)%form%response)
         k = place_of(self%of(i)%from, before)
         passed = .false.
         if (k > 0) passed = self%of(i)%passage(k)%pays_in == self%ways%forgotten
         if (.not. passed) then
            call self%ways%find(mixed(self%of(before)%key, int(self%of(i)%key)), 0, at, new)
            passed = pays(self%ways%value(at), from, to)
            if (.not. passed) then
               self%ways%value(at) = self%ways%value(at) + 1
               return
            end if
            if (k == 0) call add_passage(self%of(i), before, k)
            self%of(i)%passage(k)%pays_in = self%ways%forgotten
         end if
         new = .not. self%of(i)%passage(k)%ready
         call self%of(i)%passage(k)%pass(from, last, to, phasor, start)
      end associate
      if (new) call weigh(self, i)
   end subroutine pass

   !> The first place of a number in a list; 0: none.
   pure integer function place_of(list, number)
      integer, intent(in) :: list(:), number

      do place_of = 1, size(list)
         if (list(place_of) == number) return
      end do
      place_of = 0
   end function place_of

   !> Room for the passage number k, which comes from the place `from`.
   pure subroutine add_passage(self, from, k)
      type(place_t), intent(inout) :: self
      integer, intent(in) :: from
      integer, intent(out) :: k

      type(passage_t), allocatable :: more(:)

      k = place_of(self%from, 0)
      if (k == 0) then
         k = size(self%from) + 1
         allocate (more(k))
         more(:k - 1) = self%passage
         call move_alloc(more, self%passage)
         self%from = [self%from, from]
      end if
      self%from(k) = from
   end subroutine add_passage

end module razy_exact_solutions
