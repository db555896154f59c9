!! The modes of a contact state: the machine's matrices with those of its closed contacts.
!!
!! Symmetric matrices go to their eigenproblem as they are. With gyroscopic or circulatory matrices the eigenproblem is solved
!! once, with all contacts open, where shafts are apart; each closed contact then changes these modes
!! (razy_exact_modal_contact_modes), and only if that fails its own eigenproblem is solved. What no contact and observable
!! feels is left out.
module razy_exact_modal_state_modes
   use razy_core_kinds, only: qp, wp
   use razy_exact_modal_contact_modes, only: add_contact
   use razy_exact_modal_basis, only: new_modal_basis, turning
   use razy_exact_modal_parts, only: modal_basis_t
   use razy_exact_modal_observable_terms, only: keep_observable
   use razy_linalg_lapack, only: dposv
   use razy_machine_coupled, only: coupled_t
   use razy_machine_machine, only: machine_t, observe_linear
   implicit none(type, external)
   private

   public :: new_open_modes, new_state_modes, open_modes_t

   !> What all contact states of a machine that turns have in common: the modes with all contacts open, made when first needed.
   type :: open_modes_t
      logical :: turns = .false., made = .false.
      type(modal_basis_t) :: basis
      !> All forms that are felt, on displacements and velocities (m, forms); none if all is to be kept.
      real(wp), allocatable :: on_y(:, :), on_v(:, :)
      !> Velocities of the energy of unit displacements (m), rad/s.
      real(wp), allocatable :: unit(:)
   end type open_modes_t

   !> Of a mode without stiffness, as a part of the fastest.
   real(wp), parameter :: slow_unit = 1.0e-4_wp

contains

   !> Begin with a machine, its coupled coordinates and the contacts' directions in them, w (m, contacts).
   subroutine new_open_modes(self, machine, coupled, w, keep_all)
      type(open_modes_t), intent(out) :: self
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      real(wp), intent(in) :: w(:, :)
      logical, intent(in) :: keep_all

      integer :: i, j, n

      self%turns = turning(coupled%stiffness, coupled%damping)
      if (.not. self%turns) return
      self%unit = [(sqrt(abs(coupled%stiffness(i, i))), i=1, coupled%m)]
      self%unit = max(self%unit, slow_unit*maxval(self%unit), tiny(1.0_wp))
      n = 0
      if (.not. keep_all) n = size(machine%contact) + size(machine%observable)
      allocate (self%on_y(coupled%m, n), self%on_v(coupled%m, n), source=0.0_wp)
      if (keep_all) return
      self%on_y(:, :size(machine%contact)) = w
      do j = 1, size(machine%observable)
         i = size(machine%contact) + j
         if (machine%observable(j)%kind /= observe_linear) cycle
         self%on_y(:, i) = matmul(coupled%project, machine%observable(j)%on_displacement)
         self%on_v(:, i) = matmul(coupled%project, machine%observable(j)%on_velocity)
      end do
   end subroutine new_open_modes

   !> The modes with each contact in its branch.
   subroutine new_state_modes(basis, open, machine, coupled, w, branch)
      type(modal_basis_t), intent(out) :: basis
      type(open_modes_t), intent(inout) :: open
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: w(:, :)

      real(wp) :: k(coupled%m, coupled%m), b(coupled%m, coupled%m)
      logical :: done, impacts
      integer :: i, j

      impacts = any([(any(machine%contact(j)%law%constraint), j=1, size(branch))])
      ! Modes made from the open ones give a state back to fewer digits than an impact needs.
      if (open%turns .and. .not. impacts) then
         call from_open(basis, open, machine, coupled, w, branch, done)
         if (done) return
      end if
      k = coupled%stiffness
      b = coupled%damping
      do j = 1, size(branch)
         associate (piece => machine%contact(j)%law%branch(branch(j)))
            do i = 1, coupled%m
               k(:, i) = k(:, i) + piece%stiffness*w(:, j)*w(i, j)
               b(:, i) = b(:, i) + piece%damping*w(:, j)*w(i, j)
            end do
         end associate
      end do
      call solve(basis, machine, coupled, branch, k, b, impacts)
      if (basis%info == 0 .and. open%turns) call leave_unfelt(basis, open)
   end subroutine new_state_modes

   !> From the open modes, contact after contact.
   subroutine from_open(basis, open, machine, coupled, w, branch, done)
      type(modal_basis_t), intent(inout) :: basis
      type(open_modes_t), intent(inout) :: open
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: w(:, :)
      logical, intent(out) :: done

      integer :: j

      if (.not. open%made) then
         open%made = .true.
         call solve(open%basis, machine, coupled, [integer ::], coupled%stiffness, coupled%damping, .false.)
         if (open%basis%info == 0) call leave_unfelt(open%basis, open)
      end if
      basis = open%basis
      done = basis%info == 0
      do j = 1, size(branch)
         if (.not. done) return
         associate (piece => machine%contact(j)%law%branch(branch(j)))
            if (.not. (abs(piece%stiffness) > 0.0_wp .or. abs(piece%damping) > 0.0_wp)) cycle
            call add_contact(basis, w(:, j), piece%stiffness, piece%damping, open%unit, done)
         end associate
      end do
   end subroutine from_open

   subroutine leave_unfelt(basis, open)
      type(modal_basis_t), intent(inout) :: basis
      type(open_modes_t), intent(in) :: open

      if (size(open%on_y, 2) > 0) call keep_observable(basis, open%on_y, open%on_v)
   end subroutine leave_unfelt

   !> The eigenproblem; rigid modes, if there are any, are refined and it is solved again with them. `branch` may be empty: all
   !> contacts open.
   subroutine solve(basis, machine, coupled, branch, k, b, impacts)
      type(modal_basis_t), intent(out) :: basis
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: k(:, :), b(:, :)
      logical, intent(in) :: impacts

      real(wp), allocatable :: rigid(:, :)
      logical :: known

      call new_modal_basis(basis, k, b, impacts=impacts)
      if (basis%info /= 0 .or. size(basis%rigid, 2) == 0) return
      rigid = basis%rigid
      call refine_rigid_modes(machine, coupled, branch, k, rigid, known)
      if (known) call new_modal_basis(basis, k, b, rigid, impacts)
   end subroutine solve

   !> Rigid modes to rounding. An eigenproblem knows them to epsilon times the ratio of the largest to the smallest stiffness,
   !> and constant loads that are in balance then drive them. Here K v is formed from the machine's own matrices in extended
   !> precision, where the terms of a rigid motion cancel, and v corrected by (K + s V Vᵀ)⁻¹ K v.
   subroutine refine_rigid_modes(machine, coupled, branch, k, rigid, known)
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
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
            rest(:, i) = restoring_of(machine, coupled, branch, rigid(:, i))
         end do
         ! Of K that is not symmetric the lower triangle stands for all: a coarser step, which two rounds make up for.
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
   pure function restoring_of(machine, coupled, branch, v) result(force)
      type(machine_t), intent(in) :: machine
      type(coupled_t), intent(in) :: coupled
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: force(size(v))

      real(qp) :: q(size(machine%mass, 1)), f(size(machine%mass, 1))
      integer :: j

      q = matmul(real(v, qp), real(coupled%project, qp))
      f = matmul(real(machine%stiffness, qp), q)
      do j = 1, size(branch)
         associate (contact => machine%contact(j))
            f = f + contact%law%branch(branch(j))%stiffness*dot_product(real(contact%w, qp), q)*real(contact%w, qp)
         end associate
      end do
      force = real(matmul(real(coupled%project, qp), f), wp)
   end function restoring_of

end module razy_exact_modal_state_modes
