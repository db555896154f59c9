!! Modes of a machine in one contact state.
!!
!! The state z = (y, y') of y'' + B y' + K y = f splits into
!! - exponential terms: one complex amplitude for a conjugate pair of eigenvalues, one real one for a real eigenvalue;
!! - rigid modes, eta'' = φᵀf, followed as polynomials;
!! - dense parts, where eigenvectors would lose accuracy (critical damping, modes so slow or so near to undamped
!!   resonance that particular solutions cancel): followed by the matrix exponential, see razy_integrate_dense_part.
!! The symmetric eigenproblem of K comes first, so that repeated frequencies have orthogonal modes; modes that the damping
!! couples form parts with a general eigenproblem of their own. K that is not symmetric makes a single part.
module razy_integrate_modal_basis
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: general_eigen, symmetric_eigen
   implicit none(type, external)
   private

   public :: dense_modes_t, modal_basis_t, new_modal_basis

   !> Modes that are kept together: y = phi η, η'' + damping η' + stiffness η = phiᵀ f.
   type :: dense_modes_t
      real(wp), allocatable :: phi(:, :), stiffness(:, :), damping(:, :)
      !> Eigenvalues of the largest modulus, rad/s.
      real(wp) :: fastest = 0.0_wp
   end type dense_modes_t

   type :: modal_basis_t
      integer :: m = 0
      !> Eigenvalues of the exponential terms (terms), 1/s; of a pair the one with positive imaginary part.
      complex(wp), allocatable :: lambda(:)
      !> Amplitudes from the state (terms, 2m) and the state from amplitudes, z = Re(from_term a) (2m, terms).
      complex(wp), allocatable :: to_term(:, :), from_term(:, :)
      !> Rigid modes (m, rigid): y = rigid η, η = rigidᵀ y.
      real(wp), allocatable :: rigid(:, :)
      type(dense_modes_t), allocatable :: dense(:)
      !> Largest modulus of an eigenvalue, rad/s.
      real(wp) :: fastest = 0.0_wp
      !> Whether a part is dense only because of the frequencies of excitation.
      logical :: resonant = .false.
      integer :: info = 0
   contains
      procedure :: is_resonant_with
   end type modal_basis_t

   !> Slower than this part of the fastest mode a mode is followed without its particular solution.
   real(wp), parameter :: slow = 1.0e-4_wp
   !> Nearer than this, relative, to a frequency of excitation a mode is followed together with the excitation.
   real(wp), parameter :: near = 1.0e-3_wp
   !> Eigenvalues of a worse condition lose more digits, with its square, than the dense part.
   real(wp), parameter :: worst_condition = 30.0_wp

contains

   !> The modes of y'' + damping y' + stiffness y; `omega` are the frequencies of excitation, rad/s. `rigid` (m, r): orthonormal
   !> modes without stiffness, if they are known better than the eigenproblem gives them.
   subroutine new_modal_basis(self, stiffness, damping, omega, rigid)
      type(modal_basis_t), intent(out) :: self
      real(wp), intent(in) :: stiffness(:, :), damping(:, :), omega(:)
      real(wp), intent(in), optional :: rigid(:, :)

      real(wp) :: phi(size(damping, 1), size(damping, 1)), k(size(damping, 1), size(damping, 1))
      real(wp) :: b(size(damping, 1), size(damping, 1)), square(size(damping, 1))
      integer :: part(size(damping, 1)), i, j, m
      logical :: symmetric

      m = size(damping, 1)
      self%m = m
      allocate (self%lambda(0), self%to_term(0, 2*m), self%from_term(2*m, 0), self%rigid(m, 0), self%dense(0))
      if (m == 0) return
      symmetric = all(abs(stiffness - transpose(stiffness)) <= 1.0e-14_wp*maxval(abs(stiffness)))
      if (symmetric) then
         phi = stiffness
         call symmetric_eigen(phi, square, self%info)
         if (self%info /= 0) return
         ! Eigenvalues below the rounding of the largest are rigid-body modes.
         where (abs(square) <= 64*m*epsilon(1.0_wp)*maxval(abs(square))) square = 0.0_wp
         if (present(rigid)) call put_rigid(phi, square, rigid)
         k = 0.0_wp
         do i = 1, m
            k(i, i) = square(i)
         end do
         b = matmul(transpose(phi), matmul(damping, phi))
         where (abs(b) <= 1.0e-13_wp*maxval(abs(b))) b = 0.0_wp
         part = coupled_parts(b)
      else
         phi = 0.0_wp
         do i = 1, m
            phi(i, i) = 1.0_wp
         end do
         k = stiffness
         b = damping
         part = 1
      end if
      self%fastest = max(sqrt(maxval(sum(abs(k), dim=1))), maxval(sum(abs(b), dim=1)))
      do i = 1, maxval(part)
         call add_part(self, phi(:, pack([(j, j=1, m)], part == i)), k, b, pack([(j, j=1, m)], part == i), omega)
         if (self%info /= 0) return
      end do
   end subroutine new_modal_basis

   !> Put the rigid modes in the place of those with square 0, and make the others orthogonal to them.
   pure subroutine put_rigid(phi, square, rigid)
      real(wp), intent(inout) :: phi(:, :)
      real(wp), intent(in) :: square(:), rigid(:, :)

      integer :: i, r

      if (count(.not. abs(square) > 0.0_wp) /= size(rigid, 2)) return
      r = 0
      do i = 1, size(square)
         if (abs(square(i)) > 0.0_wp) then
            phi(:, i) = phi(:, i) - matmul(rigid, matmul(phi(:, i), rigid))
            phi(:, i) = phi(:, i)/norm2(phi(:, i))
         else
            r = r + 1
            phi(:, i) = rigid(:, r)
         end if
      end do
   end subroutine put_rigid

   !> Number the sets of modes that the damping matrix `b` couples: part(i) is the set of mode i.
   pure function coupled_parts(b) result(part)
      real(wp), intent(in) :: b(:, :)
      integer :: part(size(b, 1))

      integer :: i, j, low, high, parts
      logical :: seen(size(b, 1))

      part = [(i, i=1, size(part))]
      do i = 1, size(part)
         do j = 1, size(part)
            if (part(i) == part(j) .or. .not. abs(b(i, j)) > 0.0_wp) cycle
            low = min(part(i), part(j))
            high = max(part(i), part(j))
            where (part == high) part = low
         end do
      end do
      parts = 0
      seen = .false.
      do i = 1, size(part)
         if (seen(i)) cycle
         parts = parts + 1
         do j = size(part), i, -1
            if (part(j) == part(i) .and. .not. seen(j)) then
               seen(j) = .true.
               if (j /= i) part(j) = -parts
            end if
         end do
         part(i) = -parts
      end do
      part = -part
   end function coupled_parts

   !> Add the modes with numbers `modes`, columns `phi` (m, s).
   subroutine add_part(self, phi, k, b, modes, omega)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: phi(:, :), k(:, :), b(:, :), omega(:)
      integer, intent(in) :: modes(:)

      complex(wp) :: lambda(2*size(modes)), right(2*size(modes), 2*size(modes)), left(2*size(modes), 2*size(modes))
      real(wp) :: a(2*size(modes), 2*size(modes)), unit(size(modes)), condition
      logical :: resonant, slow_mode
      integer :: i, s

      s = size(modes)
      if (s == 1) then
         if (.not. (abs(k(modes(1), modes(1))) > 0.0_wp .or. abs(b(modes(1), modes(1))) > 0.0_wp)) then
            self%rigid = reshape([self%rigid, phi], [self%m, size(self%rigid, 2) + 1])
            return
         end if
      end if
      ! Displacements are scaled to velocities of equal energy, so that the condition says what it should.
      a = 0.0_wp
      do i = 1, s
         unit(i) = sqrt(abs(k(modes(i), modes(i))))
         if (.not. unit(i) > 0.0_wp) unit(i) = max(abs(b(modes(i), modes(i))), slow*self%fastest)
         a(i, s + i) = unit(i)
         a(s + 1:, i) = -k(modes, modes(i))/unit(i)
      end do
      a(s + 1:, s + 1:) = -b(modes, modes)
      call general_eigen(a, lambda, right, left, condition, self%info)
      slow_mode = .true.
      if (self%info == 0) slow_mode = any(abs(lambda) <= slow*self%fastest)
      resonant = .false.
      if (self%info == 0) resonant = any_near(lambda, omega)
      if (self%info /= 0 .or. slow_mode .or. resonant .or. condition > worst_condition) then
         self%info = 0
         self%resonant = self%resonant .or. resonant
         self%dense = [self%dense, dense_modes_t(phi, k(modes, modes), b(modes, modes), &
                                                 sqrt(maxval(sum(abs(k(modes, modes)), dim=1))) + maxval(abs(b(modes, modes))))]
         return
      end if
      call add_terms(self, phi, unit, lambda, right, left)
   end subroutine add_part

   !> Add exponential terms; `unit` (s) is what displacements were multiplied with in `right` and `left`.
   subroutine add_terms(self, phi, unit, lambda, right, left)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: phi(:, :), unit(:)
      complex(wp), intent(in) :: lambda(:), right(:, :), left(:, :)

      complex(wp), allocatable :: to_term(:, :), from_term(:, :)
      integer :: i, kept, old, s, m

      m = self%m
      s = size(phi, 2)
      old = size(self%lambda)
      kept = count(aimag(lambda) >= 0.0_wp)
      allocate (to_term(old + kept, 2*m), from_term(2*m, old + kept))
      to_term(:old, :) = self%to_term
      from_term(:, :old) = self%from_term
      self%lambda = [self%lambda, pack(lambda, aimag(lambda) >= 0.0_wp)]
      kept = old
      do i = 1, size(lambda)
         if (aimag(lambda(i)) < 0.0_wp) cycle
         kept = kept + 1
         to_term(kept, :m) = matmul(phi, left(i, :s)*unit)
         to_term(kept, m + 1:) = matmul(phi, left(i, s + 1:))
         from_term(:m, kept) = matmul(phi, right(:s, i)/unit)
         from_term(m + 1:, kept) = matmul(phi, right(s + 1:, i))
         if (aimag(lambda(i)) > 0.0_wp) from_term(:, kept) = 2*from_term(:, kept)
      end do
      call move_alloc(to_term, self%to_term)
      call move_alloc(from_term, self%from_term)
   end subroutine add_terms

   pure function any_near(lambda, omega) result(found)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: omega(:)
      logical :: found

      integer :: t

      found = .false.
      do t = 1, size(omega)
         found = found .or. any(abs(cmplx(0.0_wp, omega(t), wp) - lambda) <= near*omega(t))
      end do
   end function any_near

   !> Whether modes and frequencies of excitation are so close that a basis made for `omega` differs.
   pure function is_resonant_with(self, omega) result(resonant)
      class(modal_basis_t), intent(in) :: self
      real(wp), intent(in) :: omega(:)
      logical :: resonant

      resonant = self%resonant .or. any_near(self%lambda, omega)
   end function is_resonant_with

end module razy_integrate_modal_basis
