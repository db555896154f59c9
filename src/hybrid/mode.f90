!! A mode of the hybrid system: the branch of every contact, what each contact does there, and the dynamics that follow.
!!
!! In its branch a contact does nothing, acts by an affine force F = k s + b s' + offset, by a force that its law gives, or holds a
!! constraint. Friction that slides acts with F = μ N, where the normal force N is constant, or that of a compliant contact, with
!! the sign that this has (`press`), or that of a rigid one, a constraint force, which comes in later (razy_hybrid_constraints).
!! Forces of piecewise-linear laws are linear forms of the motion, and the mode has the matrices
!!
!!     K + Σ_j w_j a_jᵀ,  B + Σ_j w_j b_jᵀ   with   F_j = a_j·y + b_j·y' + c_j + Re(Σ e_jt E_t).
module razy_hybrid_mode
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_linear_form, only: linear_form_t, zero_form
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: affine, constrained, idle, lawful, mode_t, press_of

   !> What a contact does in a mode: nothing, an affine force, the law's force, a constraint force.
   integer, parameter :: idle = 0, affine = 1, lawful = 2, constrained = 3

   type :: mode_t
      integer, allocatable :: branch(:)
      !> Signs of the forces of compliant contacts that press friction elements while the mode lasts; 0: none does, or of no
      !> sign that is known (contacts).
      integer, allocatable :: press(:)
      !> What each contact does; contacts that act, friction last (the first `acts`).
      integer, allocatable :: does(:), acting(:)
      integer :: acts = 0
      type(constraints_t) :: constraints
      !> Contacts that hold nothing and cannot move, as what is held leaves them no motion (contacts).
      logical, allocatable :: still(:)
      !> Whether laws have their smoothed forms, which know no branches.
      logical :: smoothed = .false.
      !> The branches entered last (contacts).
      integer, allocatable, private :: entered(:)
   contains
      procedure :: make_room
      procedure :: enter
      procedure :: in_play
      procedure :: force_form
      procedure :: normal_form
      procedure :: matrices
      procedure :: free_motions
      procedure :: damping_trace
      procedure :: loads
   end type mode_t

contains

   !> Make room for so many contacts.
   subroutine make_room(self, contacts, smoothed)
      class(mode_t), intent(out) :: self
      integer, intent(in) :: contacts
      logical, intent(in) :: smoothed

      allocate (self%branch(contacts), source=1)
      allocate (self%press(contacts), self%entered(contacts), source=0)
      allocate (self%does(contacts), self%acting(contacts), source=idle)
      allocate (self%still(contacts), source=.false.)
      self%smoothed = smoothed
   end subroutine make_room

   !> Make ready for the branches as they are.
   subroutine enter(self, system)
      class(mode_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      if (any(self%entered /= self%branch)) call change(self, system)
   end subroutine enter

   !> The branches have changed.
   subroutine change(self, system)
      type(mode_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer, dimension(size(self%branch)) :: closed, row, sliding
      real(wp) :: sign(size(self%branch))
      type(constraints_t) :: held
      integer :: by, couplings, j, n, pass

      self%entered = self%branch
      n = 0
      do j = 1, size(self%branch)
         self%does(j) = task_of(self, system, j)
         if (self%does(j) /= constrained) cycle
         n = n + 1
         closed(n) = j
      end do
      self%acts = 0
      do pass = 1, 2
         do j = 1, size(self%branch)
            if (self%does(j) /= affine .and. self%does(j) /= lawful) cycle
            if (system%machine%contact(j)%law%of_normal .neqv. pass == 2) cycle
            self%acts = self%acts + 1
            self%acting(self%acts) = j
         end do
      end do
      couplings = 0
      do j = 1, size(self%branch)
         by = system%machine%contact(j)%normal_of
         if (self%does(j) /= lawful .or. .not. system%machine%contact(j)%law%of_normal .or. by == 0) cycle
         if (self%does(by) /= constrained) cycle
         couplings = couplings + 1
         sliding(couplings) = j
         row(couplings) = findloc(closed(:n), by, 1)
         sign(couplings) = merge(1.0_wp, -1.0_wp, system%machine%contact(by)%law%branch(self%branch(by))%force_guard%below /= 0)
      end do
      call new_constraints(self%constraints, system%w, closed(:n), sliding(:couplings), row(:couplings), sign(:couplings))
      self%still = .false.
      if (n == 0 .or. system%curved) return
      if (any(system%given(closed(:n)))) then
         call new_constraints(held, system%w, pack(closed(:n),.not. system%given(closed(:n))), [integer ::], [integer ::], &
                              [real(wp) ::])
         call find_still(held)
      else
         call find_still(self%constraints)
      end if

   contains

      !> What these constraints, none of which is given, hold.
      subroutine find_still(by)
         type(constraints_t), intent(in) :: by

         integer :: i

         do i = 1, size(self%branch)
            if (self%does(i) == constrained .or. system%given(i)) cycle
            self%still(i) = .not. norm2(by%free_part(system%w, i)) > 0.0_wp
         end do
      end subroutine find_still

   end subroutine change

   !> What contact j does in its branch.
   pure function task_of(self, system, j) result(does)
      type(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      integer :: does

      does = lawful
      if (self%smoothed) return
      associate (law => system%machine%contact(j)%law, branch => self%branch(j))
         if (law%branch(branch)%constraint) then
            does = constrained
         else if (law%impacts .or. .not. (law%branch(branch)%closed .or. abs(law%branch(branch)%stiffness) > 0.0_wp &
                                          .or. law%branch(branch)%damping > 0.0_wp)) then
            does = idle
         else if (law%piecewise_linear .and. .not. (law%of_normal .or. allocated(system%machine%contact(j)%modulation) &
                                                    .or. allocated(system%machine%contact(j)%frame))) then
            does = affine
         end if
      end associate
   end function task_of

   !> Whether friction element j can have a normal force: the contact that it goes with is closed, and so is the one that gives it,
   !> if there is no constant one.
   pure function in_play(self, system, j) result(is)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      logical :: is

      is = .true.
      associate (friction => system%machine%contact(j))
         if (friction%only_with > 0) is = closed(friction%only_with)
         if (is .and. friction%normal_of > 0 .and. .not. friction%normal > 0.0_wp) is = closed(friction%normal_of)
      end associate

   contains

      pure logical function closed(by)
         integer, intent(in) :: by

         closed = system%machine%contact(by)%law%branch(self%branch(by))%closed
      end function closed

   end function in_play

   !> Sign by which a contact's force presses: that which it has in the mode, beyond its zero too, so that the field of the mode
   !> is smooth up to the event and behind it; where none is known, its own.
   elemental function press_of(press, force) result(factor)
      integer, intent(in) :: press
      real(wp), intent(in) :: force
      real(wp) :: factor

      factor = sign(1.0_wp, force)
      if (press /= 0) factor = real(press, wp)
   end function press_of

   !> F of contact j, without constraint forces and those that vary by harmonics. All laws here are piecewise linear.
   pure function force_form(self, system, j) result(form)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      type(linear_form_t) :: form

      associate (law => system%machine%contact(j)%law)
         associate (piece => law%branch(self%branch(j)))
            if (law%branch(self%branch(j))%constraint .or. allocated(system%machine%contact(j)%modulation)) then
               form = zero_form(system%m, size(system%omega))
            else if (law%of_normal) then
               form = zero_form(system%m, size(system%omega))
               call form%add(piece%offset, self%normal_form(system, j))
            else
               form = system%contact_form(j, piece%stiffness, piece%damping, piece%offset)
            end if
         end associate
      end associate
   end function force_form

   !> Normal force of friction element j, without that of a rigid contact.
   pure function normal_form(self, system, j) result(form)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      type(linear_form_t) :: form

      form = zero_form(system%m, size(system%omega))
      if (.not. self%in_play(system, j)) return
      form%constant = system%machine%contact(j)%normal
      associate (by => system%machine%contact(j)%normal_of)
         if (by == 0) return
         associate (law => system%machine%contact(by)%law)
            if (law%branch(self%branch(by))%constraint) return
            associate (piece => law%branch(self%branch(by)))
               call form%add(real(self%press(j), wp), system%contact_form(by, piece%stiffness, piece%damping, piece%offset))
            end associate
         end associate
      end associate
   end function normal_form

   !> K and B (m, m) with what the contacts do, without constraint forces.
   pure subroutine matrices(self, system, k, b)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(out) :: k(:, :), b(:, :)

      type(linear_form_t) :: force
      integer :: i, j

      k = system%coupled%stiffness
      b = system%coupled%damping
      do j = 1, size(self%branch)
         force = self%force_form(system, j)
         if (.not. any(abs(force%on_y) > 0.0_wp .or. abs(force%on_v) > 0.0_wp)) cycle
         do i = 1, system%m
            k(:, i) = k(:, i) + system%w(:, j)*force%on_y(i)
            b(:, i) = b(:, i) + system%w(:, j)*force%on_v(i)
         end do
      end do
   end subroutine matrices

   !> The motions (m, r) that have no stiffness, orthonormal; the first `rigid` have no damping either.
   subroutine free_motions(self, system, shape, rigid)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp), allocatable, intent(out) :: shape(:, :)
      integer, intent(out) :: rigid

      logical :: held(size(self%branch)), felt(size(self%branch))
      integer :: j

      do j = 1, size(self%branch)
         associate (law => system%machine%contact(j)%law)
            held(j) = law%branch(self%branch(j))%constraint
            felt(j) = held(j)
            ! Friction under a contact is felt where that contact is.
            if (law%of_normal .or. held(j)) cycle
            held(j) = abs(law%branch(self%branch(j))%stiffness) > 0.0_wp
            felt(j) = held(j) .or. abs(law%branch(self%branch(j))%damping) > 0.0_wp
         end associate
      end do
      call system%free%in_state(held, felt, shape, rigid)
   end subroutine free_motions

   !> Trace of B, 1/s; volumes of states shrink with it.
   pure function damping_trace(self, system) result(trace)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp) :: trace

      type(linear_form_t) :: force
      integer :: i, j

      trace = sum([(system%coupled%damping(i, i), i=1, system%m)])
      do j = 1, size(self%branch)
         force = self%force_form(system, j)
         trace = trace + dot_product(system%w(:, j), force%on_v)
      end do
   end function damping_trace

   !> Load (m) and its phasors (m, tones) with what of the contacts' forces does not depend on the motion.
   pure subroutine loads(self, system, load, harmonic)
      class(mode_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(out) :: load(:)
      complex(wp), intent(out) :: harmonic(:, :)

      type(linear_form_t) :: force
      integer :: j, t

      load = system%load
      harmonic = system%harmonic
      do j = 1, size(self%branch)
         force = self%force_form(system, j)
         load = load - system%w(:, j)*force%constant
         do t = 1, size(harmonic, 2)
            harmonic(:, t) = harmonic(:, t) - system%w(:, j)*force%error(t)
         end do
      end do
   end subroutine loads

end module razy_hybrid_mode
