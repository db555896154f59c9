!! Modes of a machine in one contact state.
!!
!! The state z = (y, y') of y'' + B y' + K y = f splits into
!! - exponential terms: one complex amplitude for a conjugate pair of eigenvalues, one real one for a real eigenvalue;
!! - rigid modes, eta'' = φᵀf, followed as polynomials;
!! - dense parts, where eigenvectors would lose accuracy (critical damping, very slow modes): followed by the matrix exponential,
!!   see razy_exact_closed_form_dense_part. If fast and slow modes of a part are only far apart, their eigenvalues are refined
!!   instead.
!! Coordinates that K and B do not couple are apart from the start, if these are not symmetric. In each set the symmetric
!! eigenproblem of K, or of its symmetric part, comes first, so that repeated frequencies have orthogonal modes; modes that
!! damping, gyroscopic or circulatory matrix couple form parts with a general eigenproblem of their own. Modes without stiffness are
!! not looked for among the eigenvalues: they are known (razy_machine_free_motions), and the eigenproblem is that of the others.
module razy_exact_modal_basis
   use razy_core_kinds, only: i8, qp, wp
   use razy_linalg_dense, only: is_symmetric, symmetric_part
   use razy_linalg_eigen, only: general_eigen, refine_eigen, symmetric_eigen
   use razy_linalg_null_space, only: complement_of
   use razy_linalg_pattern, only: connected_sets, linked
   use razy_machine_free_motions, only: part_of
   implicit none(type, external)
   private

   public :: dense_modes_t, modal_basis_t, new_modal_basis, turning, worst_of_many

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
      !> Whether fast and slow modes of a strongly damped part are exponential terms.
      logical :: stiff = .false.
      integer :: info = 0
   contains
      procedure :: numbers
   end type modal_basis_t

   !> Slower than this part of the fastest mode one of few modes is followed in a dense part.
   real(wp), parameter :: slow = 1.0e-4_wp
   !> Eigenvalues of a worse condition lose more digits than the dense part, with its square in small parts. Of many modes the
   !> dense part has a matrix of hundreds of rows, and three digits are given for not having it.
   real(wp), parameter :: worst_condition = 30.0_wp, worst_of_many = 3.0e3_wp
   integer, parameter :: many = 4
   !> Smaller than this part of the largest entry, an entry is a rounding error.
   real(wp), parameter :: rounding_of_sums = 1.0e-14_wp
   !> Eigenvalues of a part are known to such a part of its fastest.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)

contains

   !> The modes of y'' + damping y' + stiffness y. `free` (m, r): orthonormal motions without stiffness, all there are; the first
   !> `rigid` are without damping, too. If given, `stiffness` is that of all else, `base` (m, m), and of contacts, Σ pull wᵀ (m, n).
   subroutine new_modal_basis(self, stiffness, damping, free, rigid, base, w, pull)
      type(modal_basis_t), intent(out) :: self
      real(wp), intent(in) :: stiffness(:, :), damping(:, :), free(:, :)
      integer, intent(in) :: rigid
      real(wp), intent(in), optional :: base(:, :), w(:, :), pull(:, :)

      integer :: set(size(damping, 1)), i, j, m
      integer, allocatable :: members(:)
      real(wp), allocatable :: chosen(:, :), damped(:, :), undamped(:, :)

      m = size(damping, 1)
      self%m = m
      ! Terms are at most as many as the numbers of a state.
      allocate (self%lambda(0), self%rigid(m, 0), self%dense(0))
      allocate (self%to_term(2*m, 2*m), self%from_term(2*m, 2*m), source=(0.0_wp, 0.0_wp))
      if (m == 0) return
      set = 1
      if (turning(stiffness, damping)) then
         set = connected_sets(linked(stiffness, rounding_of_sums) .or. linked(damping, rounding_of_sums))
      end if
      if (all(set == 1)) call add_set(self, stiffness, damping, [(j, j=1, m)], free, rigid, base, w, pull)
      do i = 1, merge(maxval(set), 0, any(set > 1))
         members = pack([(j, j=1, m)], set == i)
         ! What is free is so in each of the sets.
         call part_of(free(members, :rigid), undamped, chosen)
         call part_of(free(members, rigid + 1:), damped, chosen)
         call add_set(self, stiffness, damping, members, &
                      reshape([undamped, damped], [size(members), size(undamped, 2) + size(damped, 2)]), size(undamped, 2))
         if (self%info /= 0) return
      end do
      self%to_term = self%to_term(:size(self%lambda), :)
      self%from_term = self%from_term(:, :size(self%lambda))
   end subroutine new_modal_basis

   !> Numbers that it holds, in the large arrays.
   elemental integer(i8) function numbers(self)
      class(modal_basis_t), intent(in) :: self

      numbers = 0
      if (allocated(self%lambda)) numbers = 2*(size(self%to_term, kind=i8) + size(self%from_term)) + size(self%rigid)
   end function numbers

   !> Add the modes of the coordinates `set`, which are coupled with no other; `free` (set, r) and all else as above.
   subroutine add_set(self, stiffness, damping, set, free, rigid, base, w, pull)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: stiffness(:, :), damping(:, :), free(:, :)
      integer, intent(in) :: set(:), rigid
      real(wp), intent(in), optional :: base(:, :), w(:, :), pull(:, :)

      real(wp), dimension(size(set), size(set)) :: phi, k, b
      real(wp) :: square(size(set)), shape(self%m, size(set))
      integer :: part(size(set)), held, i, j, s
      integer, allocatable :: modes(:)

      s = size(set)
      held = s - size(free, 2)
      k = stiffness(set, set)
      b = damping(set, set)
      call find_shapes(k, free, phi, square, self%info)
      if (present(base) .and. self%info == 0) call decouple(base, w, pull, phi(:, :held), square(:held), self%info)
      if (self%info /= 0) return
      k = couplings(k, phi, held)
      do i = 1, held
         k(i, i) = k(i, i) + square(i)
      end do
      b = small_removed(matmul(transpose(phi), matmul(b, phi)))
      b(:, held + 1:held + rigid) = 0.0_wp
      if (is_symmetric(damping(set, set))) b(held + 1:held + rigid, :) = 0.0_wp
      part = connected_sets(abs(k) > 0.0_wp .or. abs(b) > 0.0_wp)
      self%fastest = max(self%fastest, sqrt(maxval(sum(abs(k), dim=1))), maxval(sum(abs(b), dim=1)))
      shape = 0.0_wp
      shape(set, :) = phi
      do i = 1, maxval(part)
         modes = pack([(j, j=1, s)], part == i)
         call add_part(self, shape(:, modes), k, b, modes)
         if (self%info /= 0) return
      end do
   end subroutine add_set

   !> Orthonormal shapes `phi` (s, s): the eigenvectors of the symmetric part of `k` beside the motions `free` (s, r), with the
   !> eigenvalues `square`, and these motions.
   subroutine find_shapes(k, free, phi, square, info)
      real(wp), intent(in) :: k(:, :), free(:, :)
      real(wp), intent(out) :: phi(:, :), square(:)
      integer, intent(out) :: info

      real(wp) :: beside(size(k, 1), size(k, 1) - size(free, 2))
      real(wp), allocatable :: inner(:, :)
      integer :: held

      held = size(beside, 2)
      square = 0.0_wp
      phi(:, held + 1:) = free
      beside = complement_of(free)
      inner = symmetric_part(matmul(transpose(beside), matmul(k, beside)))
      call symmetric_eigen(inner, square(:held), info)
      phi(:, :held) = matmul(beside, inner)
   end subroutine find_shapes

   !> The eigenvectors `phi` (m, n) and eigenvalues `square` once more, of what they leave coupled in the stiffness, formed of its
   !> parts: in the sum of a stiff contact and of all else, what is rounding of the former is lost of the latter.
   subroutine decouple(base, w, pull, phi, square, info)
      real(wp), intent(in) :: base(:, :), w(:, :), pull(:, :)
      real(wp), intent(inout) :: phi(:, :), square(:)
      integer, intent(out) :: info

      real(wp) :: rest(size(square), size(square))
      integer :: i, j

      rest = symmetric_part(matmul(transpose(phi), matmul(base, phi)) &
                            + matmul(matmul(transpose(phi), pull), matmul(transpose(w), phi)))
      do i = 1, size(square)
         do j = 1, size(square)
            if (i /= j .and. abs(rest(i, j)) <= rounding_of_sums*abs(rest(i, i) - rest(j, j))) rest(i, j) = 0.0_wp
         end do
      end do
      call symmetric_eigen(rest, square, info)
      phi = matmul(phi, rest)
   end subroutine decouple

   !> Φᵀ K Φ without the diagonal of its symmetric part: of the first `held` shapes, its eigenvectors; the others are not felt by K.
   pure function couplings(k, phi, held)
      real(wp), intent(in) :: k(:, :), phi(:, :)
      integer, intent(in) :: held
      real(wp) :: couplings(size(k, 1), size(k, 1))

      couplings = 0.0_wp
      if (is_symmetric(k)) return
      associate (first => phi(:, :held), others => phi(:, held + 1:))
         couplings(:held, :held) = matmul(transpose(first), matmul(k - symmetric_part(k), first))
         couplings(held + 1:, :held) = matmul(transpose(others), matmul(k, first))
      end associate
      couplings = small_removed(couplings)
   end function couplings

   pure function small_removed(matrix) result(b)
      real(wp), intent(in) :: matrix(:, :)
      real(wp) :: b(size(matrix, 1), size(matrix, 2))

      b = matrix
      where (abs(b) <= 1.0e-13_wp*maxval(abs(b))) b = 0.0_wp
   end function small_removed

   !> Whether one of the matrices is not symmetric, as gyroscopic and circulatory matrices are not.
   pure function turning(stiffness, damping)
      real(wp), intent(in) :: stiffness(:, :), damping(:, :)
      logical :: turning

      turning = .not. (is_symmetric(stiffness) .and. is_symmetric(damping))
   end function turning

   !> Add the modes with numbers `modes`, columns `phi` (m, s).
   subroutine add_part(self, phi, k, b, modes)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: phi(:, :), k(:, :), b(:, :)
      integer, intent(in) :: modes(:)

      complex(wp) :: lambda(2*size(modes))
      real(wp) :: unit(size(modes)), condition
      type(dense_modes_t) :: dense
      ! Of hundreds of modes, too large for the stack.
      complex(wp), allocatable :: right(:, :), left(:, :)
      real(wp), allocatable :: a(:, :)
      logical :: apart, whole
      integer :: i, s

      s = size(modes)
      if (s == 1) then
         if (.not. (abs(k(modes(1), modes(1))) > 0.0_wp .or. abs(b(modes(1), modes(1))) > 0.0_wp)) then
            self%rigid = reshape([self%rigid, phi], [self%m, size(self%rigid, 2) + 1])
            return
         end if
      end if
      ! Displacements are scaled to velocities of equal energy, so that the condition says what it should.
      allocate (a(2*s, 2*s), source=0.0_wp)
      allocate (right(2*s, 2*s), left(2*s, 2*s))
      do i = 1, s
         unit(i) = sqrt(abs(k(modes(i), modes(i))))
         if (.not. unit(i) > 0.0_wp) unit(i) = max(abs(b(modes(i), modes(i))), slow*self%fastest)
         a(i, s + i) = unit(i)
         a(s + 1:, i) = -k(modes, modes(i))/unit(i)
      end do
      a(s + 1:, s + 1:) = -b(modes, modes)
      call general_eigen(a, lambda, right, left, condition, self%info)
      ! What nothing damps neither grows nor decays: whether its real part is above 0 is rounding.
      where (real(lambda) > 0.0_wp .and. real(lambda) <= rounding*maxval(abs(lambda))) lambda = cmplx(0.0_wp, aimag(lambda), wp)
      whole = condition > merge(worst_of_many, worst_condition, s > many)
      if (s <= many .and. .not. whole) then
         whole = any(abs(lambda) <= slow*self%fastest)
         ! A matrix exponential would be stepped at the speed of the fastest mode, which may be gone in no time.
         if (whole .and. minval(abs(lambda)) <= slow*maxval(abs(lambda))) then
            call refine_part(k(modes, modes), b(modes, modes), unit, lambda, right, left, apart)
            whole = .not. apart
            self%stiff = self%stiff .or. apart
         end if
      end if
      if (whole) then
         self%info = 0
         ! What the constructor of a type holds gfortran 12 does not free in one of an array.
         dense%phi = phi
         dense%stiffness = k(modes, modes)
         dense%damping = b(modes, modes)
         dense%fastest = sqrt(maxval(sum(abs(dense%stiffness), dim=1))) + maxval(abs(dense%damping))
         self%dense = [self%dense, dense]
         return
      end if
      call add_terms(self, phi, unit, lambda, right, left)
   end subroutine add_part

   !> Refine the eigenvalues and vectors of a part, with displacements in terms of `unit`; they stay as they are if not `refined`.
   pure subroutine refine_part(k, b, unit, lambda, right, left, refined)
      real(wp), intent(in) :: k(:, :), b(:, :), unit(:)
      complex(wp), intent(inout) :: lambda(:), right(:, :), left(:, :)
      logical, intent(out) :: refined

      real(qp) :: a(2*size(unit), 2*size(unit))
      integer :: i, s

      s = size(unit)
      a = 0.0_qp
      do i = 1, s
         a(i, s + i) = unit(i)
         a(s + 1:, i) = -real(k(:, i), qp)/unit(i)
      end do
      a(s + 1:, s + 1:) = -b
      call refine_eigen(a, lambda, right, left, refined)
   end subroutine refine_part

   !> Add exponential terms; `unit` (s) is what displacements were multiplied with in `right` and `left`.
   subroutine add_terms(self, phi, unit, lambda, right, left)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: phi(:, :), unit(:)
      complex(wp), intent(in) :: lambda(:), right(:, :), left(:, :)

      real(wp) :: units(size(phi, 2), size(lambda))
      real(wp), allocatable :: shape(:, :)
      integer, allocatable :: kept(:), rows(:)
      integer :: i, k, old, s

      s = size(phi, 2)
      kept = pack([(i, i=1, size(lambda))], aimag(lambda) >= 0.0_wp)
      k = size(kept)
      old = size(self%lambda)
      self%lambda = [self%lambda, lambda(kept)]
      units = spread(unit, 2, size(lambda))
      ! Coordinates of other sets have no part in them.
      rows = pack([(i, i=1, self%m)], any(abs(phi) > 0.0_wp, dim=2))
      shape = phi(rows, :)
      associate (m => self%m, to_term => self%to_term(old + 1:old + k, :), from_term => self%from_term(:, old + 1:old + k))
         to_term(:, rows) = transpose(in_coordinates(shape, units(:, :k)*transpose(left(kept, :s))))
         to_term(:, m + rows) = transpose(in_coordinates(shape, transpose(left(kept, s + 1:))))
         from_term(rows, :) = in_coordinates(shape, right(:s, kept)/units(:, :k))
         from_term(m + rows, :) = in_coordinates(shape, right(s + 1:, kept))
         from_term = from_term*spread(merge(2, 1, aimag(lambda(kept)) > 0.0_wp), 1, 2*m)
      end associate
   end subroutine add_terms

   !> Modes (s, k) of a part in coordinates, whose shapes are `phi` (coordinates, s).
   pure function in_coordinates(phi, modes) result(shapes)
      real(wp), intent(in) :: phi(:, :)
      complex(wp), intent(in) :: modes(:, :)
      complex(wp) :: shapes(size(phi, 1), size(modes, 2))

      shapes = cmplx(matmul(phi, real(modes)), matmul(phi, aimag(modes)), wp)
   end function in_coordinates

end module razy_exact_modal_basis
