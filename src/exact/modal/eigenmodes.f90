!! The eigenmodes of a mode of the hybrid system: the machine's matrices with those of its closed contacts.
!!
!! Symmetric matrices go to their eigenproblem as they are. Where damping couples many eigenmodes, and with gyroscopic or
!! circulatory matrices, the eigenproblem is solved once, with all contacts open, where shafts are apart; each closed contact then
!! changes these eigenmodes (razy_exact_modal_contact_modes), and only if that fails its own eigenproblem is solved. What no
!! contact and observable feels of a machine that turns is left out.
module razy_exact_modal_eigenmodes
   use razy_core_kinds, only: qp, wp
   use razy_exact_modal_basis, only: modal_basis_t, new_modal_basis, turning
   use razy_exact_modal_contact_modes, only: add_contact
   use razy_exact_modal_observable_terms, only: keep_observable
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_dense, only: is_symmetric
   use razy_linalg_lapack, only: dpotrf, dpotrs
   implicit none(type, external)
   private

   public :: new_eigenmodes, new_open_modes, open_modes_t

   !> What all modes of a machine have in common: the eigenmodes with all contacts open, made when first needed.
   type :: open_modes_t
      private
      logical :: turns = .false., made = .false.
      type(modal_basis_t) :: basis
      !> All forms that are felt, on displacements and velocities (m, forms); none if all is to be kept.
      real(wp), allocatable :: on_y(:, :), on_v(:, :)
      !> Velocities of the energy of unit displacements (m), rad/s.
      real(wp), allocatable :: unit(:)
   end type open_modes_t

   !> So few coordinates cost no more on their own than from the open eigenmodes, and keep all digits.
   integer, parameter :: few = 20
   !> Of an eigenmode without stiffness, as a part of the fastest.
   real(wp), parameter :: slow_unit = 1.0e-4_wp

contains

   !> Begin with a system. Modes made from the open ones give a state back to fewer digits than an impact needs.
   subroutine new_open_modes(self, system)
      type(open_modes_t), intent(out) :: self
      type(system_t), intent(in) :: system

      integer :: i, j, n

      associate (m => system%m, contacts => size(system%gap))
         self%turns = turning(system%coupled%stiffness, system%coupled%damping)
         self%unit = [(sqrt(abs(system%coupled%stiffness(i, i))), i=1, m)]
         self%unit = max(self%unit, slow_unit*maxval(self%unit), tiny(1.0_wp))
         n = 0
         if (self%turns .and. .not. (system%keep_all .or. system%constrained)) n = contacts + size(system%observed)
         allocate (self%on_y(m, n), self%on_v(m, n), source=0.0_wp)
         if (n == 0) return
         self%on_y(:, :contacts) = system%w
         do j = 1, size(system%observed)
            self%on_y(:, contacts + j) = system%observed(j)%on_y
            self%on_v(:, contacts + j) = system%observed(j)%on_v
         end do
      end associate
   end subroutine new_open_modes

   !> The eigenmodes of a mode without constraints and without friction that depends on the motion.
   subroutine new_eigenmodes(basis, open, system, mode)
      type(modal_basis_t), intent(out) :: basis
      type(open_modes_t), intent(inout) :: open
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode

      real(wp) :: k(system%m, system%m), b(system%m, system%m), pull(system%m, size(mode%branch))
      real(wp), allocatable :: free(:, :)
      type(linear_form_t) :: force
      integer :: j, rigid
      logical :: done

      call mode%matrices(system, k, b)
      ! Matrices that commute have their eigenvectors in common, which damping does not couple then.
      done = .not. system%constrained .and. (open%turns .or. system%m > few)
      if (done .and. .not. open%turns) done = .not. is_symmetric(matmul(k, b))
      if (done) call from_open(basis, open, system, mode%branch, done)
      if (done) return
      call mode%free_motions(system, free, rigid)
      call refine(system, mode%branch, k, free)
      do j = 1, size(mode%branch)
         force = mode%force_form(system, j)
         pull(:, j) = force%on_y
      end do
      call new_modal_basis(basis, k, b, free, rigid, system%coupled%stiffness, system%w, pull)
      if (basis%info == 0) call leave_unfelt(basis, open)
   end subroutine new_eigenmodes

   !> From the open modes, contact after contact.
   subroutine from_open(basis, open, system, branch, done)
      type(modal_basis_t), intent(inout) :: basis
      type(open_modes_t), intent(inout) :: open
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)
      logical, intent(out) :: done

      real(wp), allocatable :: free(:, :)
      integer :: j, rigid

      if (.not. open%made) then
         open%made = .true.
         call system%free%in_state([(.false., j=1, size(branch))], [(.false., j=1, size(branch))], free, rigid)
         call refine(system, [integer ::], system%coupled%stiffness, free)
         call new_modal_basis(open%basis, system%coupled%stiffness, system%coupled%damping, free, rigid)
         if (open%basis%info == 0) call leave_unfelt(open%basis, open)
      end if
      basis = open%basis
      done = basis%info == 0
      do j = 1, size(branch)
         if (.not. done) return
         associate (piece => system%machine%contact(j)%law%branch(branch(j)))
            if (.not. (abs(piece%stiffness) > 0.0_wp .or. abs(piece%damping) > 0.0_wp)) cycle
            call add_contact(basis, system%w(:, j), piece%stiffness, piece%damping, open%unit, done)
         end associate
      end do
   end subroutine from_open

   subroutine leave_unfelt(basis, open)
      type(modal_basis_t), intent(inout) :: basis
      type(open_modes_t), intent(in) :: open

      if (size(open%on_y, 2) > 0) call keep_observable(basis, open%on_y, open%on_v)
   end subroutine leave_unfelt

   !> Motions without stiffness to the last bit: what their directions and the coupled coordinates round would be driven by constant
   !> loads that are in balance. K v is formed from the machine's own matrices in extended precision, where its terms cancel, and v
   !> corrected by (K + s V Vᵀ)⁻¹ K v.
   subroutine refine(system, branch, k, free)
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: k(:, :)
      real(wp), intent(inout) :: free(:, :)

      integer, parameter :: rounds = 2
      real(wp) :: shifted(size(k, 1), size(k, 1)), rest(size(free, 1), size(free, 2))
      integer :: i, info, round

      if (size(free, 2) == 0) return
      do round = 1, rounds
         do i = 1, size(free, 2)
            rest(:, i) = restoring_of(system, branch, free(:, i))
         end do
         ! Of K that is not symmetric the lower triangle stands for all: a coarser step, which two rounds make up for.
         shifted = k + maxval(abs(k))*matmul(free, transpose(free))
         call dpotrf("L", size(k, 1), shifted, size(k, 1), info)
         if (info /= 0) return
         call dpotrs("L", size(k, 1), size(rest, 2), shifted, size(k, 1), rest, size(k, 1), info)
         free = free - rest
         do i = 1, size(free, 2)
            free(:, i) = free(:, i) - matmul(free(:, :i - 1), matmul(free(:, i), free(:, :i - 1)))
            free(:, i) = free(:, i)/norm2(free(:, i))
         end do
      end do
   end subroutine refine

   !> K v in coupled coordinates (m), contacts with their branches included, formed in extended precision.
   pure function restoring_of(system, branch, v) result(force)
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: v(:)
      real(wp) :: force(size(v))

      real(qp) :: q(size(system%machine%mass, 1)), f(size(system%machine%mass, 1))
      integer :: j

      associate (machine => system%machine, project => system%coupled%project)
         q = matmul(real(v, qp), real(project, qp))
         f = matmul(real(machine%stiffness, qp), q)
         do j = 1, size(branch)
            associate (contact => machine%contact(j))
               f = f + contact%law%branch(branch(j))%stiffness*dot_product(real(contact%w, qp), q)*real(contact%w, qp)
            end associate
         end do
         force = real(matmul(real(project, qp), f), wp)
      end associate
   end function restoring_of

end module razy_exact_modal_eigenmodes
