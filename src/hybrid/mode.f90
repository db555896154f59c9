!! What the contacts of a machine do in a mode, that is, with the branches that they are in, as right-hand sides need it.
!!
!! A contact does nothing, acts by an affine force, by its law, or as a constraint. If all forces of a mode are affine and the
!! machine is small, they are taken into its matrices once, so that a right-hand side is one product:
!!
!!     y'' = c + Σ_t (p_t cos φ_t + q_t sin φ_t) - (K + Σ_j k_j w_j w_jᵀ) y - (B + Σ_j b_j w_j w_jᵀ) y'.
module razy_hybrid_mode
   use razy_contact_contact_law, only: branch_lower_parting, branch_open, branch_upper_parting
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_kinematics, only: kinematics_t
   implicit none(type, external)
   private

   public :: mode_t
   public :: affine, constrained, idle, lawful
   public :: treat_by_events, treat_by_smoothing, treat_by_switching

   integer, parameter :: treat_by_events = 1, treat_by_switching = 2, treat_by_smoothing = 3

   !> What a contact does in a mode: nothing, an affine force, the law's force, a constraint force.
   integer, parameter :: idle = 0, affine = 1, lawful = 2, constrained = 3

   !> A folded mode: what has been formed for its branches.
   type :: fold_t
      integer, allocatable :: branch(:), does(:), acting(:)
      integer :: acts = 0
      real(wp), allocatable :: matrix(:, :), constant(:), on_cosine(:, :), on_sine(:, :)
   end type fold_t

   type, extends(kinematics_t) :: mode_t
      !> What is done about jumps.
      integer :: treatment = treat_by_events
      integer, allocatable :: branch(:)
      !> What each contact does; contacts that act, friction last.
      integer, allocatable :: does(:), acting(:)
      integer :: acts = 0
      type(constraints_t) :: constraints
      !> Workspace: force and normal force (contacts each).
      real(wp), allocatable :: force(:), normal(:)
      !> Whether the forces of the mode are in the following: K and B (m, 2m), constant (m), phasors (m, tones).
      logical :: folded = .false.
      real(wp), allocatable :: matrix(:, :), constant(:), on_cosine(:, :), on_sine(:, :)
      !> Folded modes entered before, the first `kept` in use, and the one that is replaced next.
      type(fold_t), allocatable, private :: fold(:)
      integer, private :: kept = 0, oldest = 1
      !> The branches entered last.
      integer, allocatable, private :: entered(:)
   contains
      procedure :: make_room
      procedure :: enter_mode
      procedure :: normal_of
      procedure :: forcing
   end type mode_t

   !> The most coordinates for which a full matrix is cheaper than its parts; folded modes that are kept.
   integer, parameter :: most_folded = 8, most_kept = 8

contains

   !> Make room for the contacts of the machine that was taken.
   subroutine make_room(self)
      class(mode_t), intent(inout) :: self

      integer :: contacts, m, tones

      contacts = size(self%machine%contact)
      m = self%m
      tones = size(self%omega)
      if (allocated(self%branch)) deallocate (self%branch, self%force, self%normal, self%does, self%acting, self%matrix, &
                                              self%constant, self%on_cosine, self%on_sine, self%entered)
      self%kept = 0
      self%oldest = 1
      if (.not. allocated(self%fold)) allocate (self%fold(most_kept))
      allocate (self%branch(contacts), source=branch_open)
      allocate (self%entered(contacts), source=0)
      allocate (self%does(contacts), self%acting(contacts), source=idle)
      allocate (self%force(contacts), self%normal(contacts), source=0.0_wp)
      allocate (self%matrix(m, 2*m), self%constant(m), self%on_cosine(m, tones), self%on_sine(m, tones), source=0.0_wp)
   end subroutine make_room

   !> Make ready for the branches as they are.
   subroutine enter_mode(self)
      class(mode_t), intent(inout) :: self

      integer :: held(size(self%branch)), sliding(size(self%branch)), row(size(self%branch))
      real(wp) :: sign(size(self%branch))
      integer :: i, j, n, pass
      logical :: changed

      changed = .false.
      do j = 1, size(self%branch)
         changed = changed .or. self%entered(j) /= self%branch(j)
         self%entered(j) = self%branch(j)
      end do
      if (.not. changed) return
      do i = 1, self%kept
         if (any(self%fold(i)%branch /= self%branch)) cycle
         call recall(self, self%fold(i))
         return
      end do
      n = 0
      self%force = 0.0_wp
      do j = 1, size(self%branch)
         associate (law => self%machine%contact(j)%law, branch => self%branch(j))
            self%does(j) = lawful
            if (self%treatment == treat_by_smoothing) cycle
            if (law%constraint(branch)) then
               self%does(j) = constrained
               n = n + 1
               held(n) = j
            else if (law%impacts .or. (branch == branch_open .and. .not. law%branch(branch_open)%stiffness > 0.0_wp)) then
               self%does(j) = idle
            else if (law%piecewise_linear .and. .not. law%of_normal) then
               self%does(j) = affine
            end if
         end associate
      end do
      self%acts = 0
      do pass = 1, 2
         do j = 1, size(self%branch)
            if (self%does(j) /= affine .and. self%does(j) /= lawful) cycle
            if (self%machine%contact(j)%law%of_normal .neqv. pass == 2) cycle
            self%acts = self%acts + 1
            self%acting(self%acts) = j
         end do
      end do
      i = 0
      do j = 1, size(self%branch)
         if (self%does(j) /= lawful .or. .not. self%machine%contact(j)%law%of_normal) cycle
         associate (by => self%machine%contact(j)%normal_of)
            if (by == 0) cycle
            if (self%does(by) /= constrained) cycle
            i = i + 1
            sliding(i) = j
            row(i) = findloc(held(:n), by, 1)
            sign(i) = merge(1.0_wp, -1.0_wp, self%machine%contact(by)%law%force_guard(self%branch(by))%below /= 0)
         end associate
      end do
      call new_constraints(self%constraints, self%w, held(:n), sliding(:i), row(:i), sign(:i))
      self%folded = self%treatment == treat_by_events .and. self%m <= most_folded .and. n == 0 &
                    .and. all(self%does(self%acting(:self%acts)) == affine)
      if (.not. self%folded) return
      call fold(self)
      call keep(self)
   end subroutine enter_mode

   !> Keep the folded mode that was entered.
   subroutine keep(self)
      class(mode_t), intent(inout) :: self

      associate (fold => self%fold(self%oldest))
         fold%branch = self%branch
         fold%does = self%does
         fold%acting = self%acting
         fold%acts = self%acts
         fold%matrix = self%matrix
         fold%constant = self%constant
         fold%on_cosine = self%on_cosine
         fold%on_sine = self%on_sine
      end associate
      self%kept = max(self%kept, self%oldest)
      self%oldest = modulo(self%oldest, most_kept) + 1
   end subroutine keep

   !> Enter a folded mode again.
   pure subroutine recall(self, fold)
      class(mode_t), intent(inout) :: self
      type(fold_t), intent(in) :: fold

      integer :: i, j

      self%folded = .true.
      self%constraints%count = 0
      self%constraints%couplings = 0
      self%acts = fold%acts
      do j = 1, size(fold%branch)
         self%force(j) = 0.0_wp
         self%does(j) = fold%does(j)
         self%acting(j) = fold%acting(j)
      end do
      do j = 1, 2*self%m
         do i = 1, self%m
            self%matrix(i, j) = fold%matrix(i, j)
         end do
      end do
      do i = 1, self%m
         self%constant(i) = fold%constant(i)
      end do
      do j = 1, size(self%omega)
         do i = 1, self%m
            self%on_cosine(i, j) = fold%on_cosine(i, j)
            self%on_sine(i, j) = fold%on_sine(i, j)
         end do
      end do
   end subroutine recall

   !> Take the affine forces of the mode into matrix, constant and phasors.
   subroutine fold(self)
      class(mode_t), intent(inout) :: self

      integer :: i, j, k, m, t

      m = self%m
      self%matrix(:, :m) = self%coupled%stiffness
      self%matrix(:, m + 1:) = self%coupled%damping
      self%constant = self%load
      self%on_cosine = self%load_re
      self%on_sine = -self%load_im
      do k = 1, self%acts
         j = self%acting(k)
         associate (contact => self%machine%contact(j), w => self%w(:, j))
            associate (branch => contact%law%branch(self%branch(j)))
               do i = 1, m
                  self%matrix(:, i) = self%matrix(:, i) + branch%stiffness*w(i)*w
                  self%matrix(:, m + i) = self%matrix(:, m + i) + branch%damping*w(i)*w
               end do
               self%constant = self%constant - w*(branch%stiffness*contact%offset + branch%damping*contact%drive + branch%offset)
               do t = 1, size(self%omega)
                  self%on_cosine(:, t) = self%on_cosine(:, t) - w*(branch%stiffness*self%error_re(j, t) &
                                                                   - branch%damping*self%omega(t)*self%error_im(j, t))
                  self%on_sine(:, t) = self%on_sine(:, t) + w*(branch%stiffness*self%error_im(j, t) &
                                                               + branch%damping*self%omega(t)*self%error_re(j, t))
               end do
            end associate
         end associate
      end do
   end subroutine fold

   !> The part of y'' in a folded mode that does not depend on y and y', at the phases of the workspace (m).
   pure subroutine forcing(self, part)
      class(mode_t), intent(in) :: self
      real(wp), intent(out) :: part(:)

      integer :: i, t

      do i = 1, self%m
         part(i) = self%constant(i)
      end do
      do t = 1, size(self%omega)
         do i = 1, self%m
            part(i) = part(i) + (self%on_cosine(i, t)*self%c(t) + self%on_sine(i, t)*self%d(t))
         end do
      end do
   end subroutine forcing

   !> Normal force of friction element j without that of a rigid contact, N.
   pure function normal_of(self, j) result(normal)
      class(mode_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp) :: normal

      integer :: branch

      associate (contact => self%machine%contact(j))
         normal = contact%normal
         if (contact%normal_of > 0) then
            if (self%does(contact%normal_of) /= constrained .and. self%does(contact%normal_of) /= idle) then
               normal = normal + abs(self%force(contact%normal_of))
            end if
         end if
         if (contact%only_with == 0) return
         branch = self%branch(contact%only_with)
         if (self%treatment == treat_by_smoothing) then
            branch = self%machine%contact(contact%only_with)%law%initial_branch(self%s(contact%only_with), &
                                                                                self%rate(contact%only_with))
         end if
         select case (branch)
         case (branch_open, branch_upper_parting, branch_lower_parting)
            normal = 0.0_wp
         case default
         end select
      end associate
   end function normal_of

end module razy_hybrid_mode
