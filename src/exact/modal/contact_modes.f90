!! Modes with a contact closed from those with it open.
!!
!! A closed contact adds k w wᵀ to the stiffness and b w wᵀ to the damping, which changes the first-order matrix by a product of
!! two vectors: in the open modes A = X Λ Y it becomes Λ - l rᵀ with l = Y (0, w) and rᵀ = (k wᵀ, b wᵀ) X. Its eigenvalues μ are
!! the roots of 1 + Σ l_i r_i/(s - λ_i) (razy_linalg_rank_one), its right and left eigenvectors X (μ - Λ)⁻¹ l and rᵀ (μ - Λ)⁻¹ Y,
!! whose product is Σ l_i r_i/(μ - λ_i)². A mode without stiffness that the contact feels is a double pole at 0. The cost is that
!! of some products of matrices.
!!
!! Everything is checked: that the roots are roots and all of them, that left and right vectors are biorthogonal, and that the
!! condition of the eigenvalues allows terms. Where a check fails, `add_contact` says so and the caller solves the eigenproblem.
module razy_exact_modal_contact_modes
   use razy_core_kinds, only: wp
   use razy_exact_modal_basis, only: modal_basis_t, worst_of_many
   use razy_linalg_rank_one, only: rank_one_roots, root_t
   implicit none(type, external)
   private

   public :: add_contact

   !> The open modes in which an eigenvector has components: real and imaginary parts apart, rigid mode and shape (2m).
   type :: change_t
      complex(wp), allocatable :: pole(:), left(:), right(:)
      real(wp) :: feel = 0.0_wp, k = 0.0_wp, b = 0.0_wp
      integer, allocatable :: term(:)
   end type change_t

   !> Equal within this many roundings of the largest: copies of an eigenvalue.
   real(wp), parameter :: copies = 4*epsilon(1.0_wp)
   !> Felt less than this, relative, a rigid mode is not felt.
   real(wp), parameter :: unfelt = 1.0e-13_wp
   !> Largest product of a left with another's right eigenvector, relative to the products with their own.
   real(wp), parameter :: biorthogonal = 1.0e-8_wp

contains

   !> Close a contact of direction `w` (m), stiffness `k` and damping `b`; `unit` (m) makes displacements velocities, for the
   !> conditions. Without success `done` is false and the basis undefined.
   subroutine add_contact(self, w, k, b, unit, done)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: w(:), k, b, unit(:)
      logical, intent(out) :: done

      type(change_t) :: change
      type(root_t), allocatable :: root(:)
      complex(wp), allocatable :: right(:, :), left(:, :), product(:)
      integer :: i

      done = .false.
      if (size(self%dense) > 0 .or. any(.not. aimag(self%lambda) > 0.0_wp)) return
      call isolate_rigid(self, w, change%feel)
      call take_coupling(self, w, k, b, change)
      call part_copies(self, change)
      change%term = pack([(i, i=1, size(self%lambda))], abs(change%right) > 0.0_wp .or. abs(change%left) > 0.0_wp)
      if (size(change%term) == 0 .and. .not. change%feel > 0.0_wp) then
         done = .true.
         return
      end if
      ! A mode that is moved but not felt, or felt but not moved, is left to the eigenproblem.
      if (any(.not. abs(change%right(change%term)*change%left(change%term)) > 0.0_wp)) return
      allocate (root(size(change%term) + merge(1, 0, change%feel > 0.0_wp)))
      change%pole = self%lambda(change%term)
      change%left = change%left(change%term)
      change%right = change%right(change%term)
      call rank_one_roots(change%pole, change%left*change%right, [b, k]*change%feel**2, root, done)
      if (.not. done) return
      call vectors(self, change, root, right, left, product, done)
      if (.not. done) return
      call replace_terms(self, change, root, right, left, product, unit, done)
   end subroutine add_contact

   !> Turn the rigid modes so that the contact feels the last one alone, by `feel`; 0: it feels none.
   pure subroutine isolate_rigid(self, w, feel)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: w(:)
      real(wp), intent(out) :: feel

      real(wp) :: share(size(self%rigid, 2)), mirror(size(self%rigid, 2))
      integer :: n

      feel = 0.0_wp
      n = size(self%rigid, 2)
      if (n == 0) return
      share = matmul(w, self%rigid)
      if (norm2(share) <= unfelt*norm2(w)) return
      feel = norm2(share)
      ! Householder's reflection that takes the shares to the last mode.
      mirror = share
      mirror(n) = mirror(n) + sign(feel, share(n))
      mirror = mirror/norm2(mirror)
      self%rigid = self%rigid - 2*spread(matmul(self%rigid, mirror), 2, n)*spread(mirror, 1, self%m)
      self%rigid(:, n) = -sign(1.0_wp, share(n))*self%rigid(:, n)
   end subroutine isolate_rigid

   pure subroutine take_coupling(self, w, k, b, change)
      type(modal_basis_t), intent(in) :: self
      real(wp), intent(in) :: w(:), k, b
      type(change_t), intent(inout) :: change

      integer :: i, m

      m = self%m
      change%k = k
      change%b = b
      allocate (change%left(size(self%lambda)), change%right(size(self%lambda)))
      do i = 1, size(self%lambda)
         change%left(i) = sum(self%to_term(i, m + 1:)*w)
         change%right(i) = 0.5_wp*(k*sum(self%from_term(:m, i)*w) + b*sum(self%from_term(m + 1:, i)*w))
      end do
   end subroutine take_coupling

   !> Of copies of an eigenvalue one combination is felt, the others stay what they are: turn the right vectors of each two by a
   !> unitary matrix so that the second is not felt, and add to its left vector what makes it blind to the contact.
   pure subroutine part_copies(self, change)
      type(modal_basis_t), intent(inout) :: self
      type(change_t), intent(inout) :: change

      complex(wp) :: c, s, first(2*self%m), row(2*self%m), both
      real(wp) :: length
      integer :: i, j

      do i = 1, size(self%lambda)
         do j = i + 1, size(self%lambda)
            if (abs(self%lambda(i) - self%lambda(j)) > copies*abs(self%lambda(i))) cycle
            length = sqrt(abs(change%right(i))**2 + abs(change%right(j))**2)
            if (.not. abs(change%right(j)) > 0.0_wp) cycle
            c = conjg(change%right(i))/length
            s = conjg(change%right(j))/length
            first = self%from_term(:, i)
            self%from_term(:, i) = c*first + s*self%from_term(:, j)
            self%from_term(:, j) = -conjg(s)*first + conjg(c)*self%from_term(:, j)
            row = self%to_term(i, :)
            self%to_term(i, :) = conjg(c)*row + conjg(s)*self%to_term(j, :)
            self%to_term(j, :) = -s*row + c*self%to_term(j, :)
            both = change%left(i)
            change%left(i) = conjg(c)*both + conjg(s)*change%left(j)
            change%left(j) = -s*both + c*change%left(j)
            change%right(i) = length
            change%right(j) = (0.0_wp, 0.0_wp)
            self%lambda(j) = self%lambda(i)
            if (.not. abs(change%left(i)) > 0.0_wp) cycle
            self%to_term(j, :) = self%to_term(j, :) - change%left(j)/change%left(i)*self%to_term(i, :)
            self%from_term(:, i) = self%from_term(:, i) + change%left(j)/change%left(i)*self%from_term(:, j)
            change%left(j) = (0.0_wp, 0.0_wp)
         end do
      end do
   end subroutine part_copies

   !> Right and left eigenvectors (2m, roots) and (roots, 2m), the product of each two, and whether those of different roots vanish.
   pure subroutine vectors(self, change, root, right, left, product, done)
      type(modal_basis_t), intent(in) :: self
      type(change_t), intent(in) :: change
      type(root_t), intent(in) :: root(:)
      complex(wp), allocatable, intent(out) :: right(:, :), left(:, :), product(:)
      logical, intent(out) :: done

      complex(wp) :: near(size(change%pole), size(root)), far(size(change%pole), size(root)), mu(size(root)), sums, both
      complex(wp) :: felt(size(change%pole), 2)
      real(wp) :: rate(2*self%m), size_of(size(root))
      integer :: i, j, n

      n = size(root)
      do j = 1, n
         mu(j) = root(j)%minus((0.0_wp, 0.0_wp), change%pole)
         do i = 1, size(change%pole)
            near(i, j) = 1.0_wp/root(j)%minus(change%pole(i), change%pole)
            far(i, j) = 1.0_wp/root(j)%minus(conjg(change%pole(i)), change%pole)
         end do
      end do
      allocate (product(n))
      do j = 1, n
         product(j) = sum(change%left*change%right*near(:, j)**2 + conjg(change%left*change%right)*far(:, j)**2)
         product(j) = product(j) + change%feel**2*(2*change%k/mu(j) + change%b)/mu(j)**2
      end do
      done = all(abs(product) > 0.0_wp)
      if (.not. done) return
      size_of = abs(product)
      do j = 1, n
         felt(:, 1) = change%left*change%right*near(:, j)
         felt(:, 2) = conjg(change%left*change%right)*far(:, j)
         do i = 1, j - 1
            sums = sum(felt(:, 1)*near(:, i) + felt(:, 2)*far(:, i))
            both = sums + change%feel**2*(change%k*(1.0_wp/mu(i) + 1.0_wp/mu(j)) + change%b)/(mu(i)*mu(j))
            done = done .and. both%re**2 + both%im**2 <= biorthogonal**2*size_of(i)*size_of(j)
         end do
      end do
      if (.not. done) return
      call combine(transpose(self%to_term(change%term, :)), change%right, near, far, left)
      left = transpose(left)
      call combine(0.5_wp*self%from_term(:, change%term), change%left, near, far, right)
      if (.not. change%feel > 0.0_wp) return
      rate = 0.0_wp
      rate(self%m + 1:) = self%rigid(:, size(self%rigid, 2))*change%feel
      do j = 1, n
         right(:, j) = right(:, j) + rate/mu(j) + cshift(rate, self%m)/mu(j)**2
         left(j, :) = left(j, :) + change%k/mu(j)*cshift(rate, self%m) + (change%k/mu(j) + change%b)/mu(j)*rate
      end do
   end subroutine vectors

   !> Σ_i x_i share_i/(μ - λ_i) and the same of their conjugates, for all μ: (2m, roots). Products of real matrices serve.
   pure subroutine combine(x, share, near, far, sums)
      complex(wp), intent(in) :: x(:, :), share(:), near(:, :), far(:, :)
      complex(wp), allocatable, intent(out) :: sums(:, :)

      complex(wp) :: even(size(near, 1), size(near, 2)), odd(size(near, 1), size(near, 2))
      real(wp) :: re(size(x, 1), size(x, 2)), im(size(x, 1), size(x, 2))
      integer :: j

      do j = 1, size(near, 2)
         even(:, j) = share*near(:, j) + conjg(share)*far(:, j)
         odd(:, j) = share*near(:, j) - conjg(share)*far(:, j)
      end do
      re = real(x)
      im = aimag(x)
      sums = cmplx(matmul(re, real(even)) - matmul(im, aimag(odd)), matmul(re, aimag(even)) + matmul(im, real(odd)), wp)
   end subroutine combine

   !> Put the new terms in the place of those they are made of, if the condition of their eigenvalues allows.
   pure subroutine replace_terms(self, change, root, right, left, product, unit, done)
      type(modal_basis_t), intent(inout) :: self
      type(change_t), intent(in) :: change
      type(root_t), intent(in) :: root(:)
      complex(wp), intent(in) :: right(:, :), left(:, :), product(:)
      real(wp), intent(in) :: unit(:)
      logical, intent(out) :: done

      complex(wp), allocatable :: to_term(:, :), from_term(:, :), lambda(:)
      real(wp) :: length
      integer, allocatable :: kept(:)
      integer :: i, j, m

      m = self%m
      done = .false.
      kept = pack([(i, i=1, size(self%lambda))], [(all(change%term /= i), i=1, size(self%lambda))])
      allocate (lambda(size(kept) + size(root)), to_term(size(kept) + size(root), 2*m), from_term(2*m, size(kept) + size(root)))
      lambda(:size(kept)) = self%lambda(kept)
      to_term(:size(kept), :) = self%to_term(kept, :)
      from_term(:, :size(kept)) = self%from_term(:, kept)
      do j = 1, size(root)
         i = size(kept) + j
         lambda(i) = root(j)%minus((0.0_wp, 0.0_wp), change%pole)
         length = hypot(norm2(abs(right(:m, j))*unit), norm2(abs(right(m + 1:, j))))
         if (length*hypot(norm2(abs(left(j, :m))/unit), norm2(abs(left(j, m + 1:)))) > worst_of_many*abs(product(j))) return
         from_term(:, i) = 2*right(:, j)/length
         to_term(i, :) = left(j, :)*(length/product(j))
      end do
      call move_alloc(lambda, self%lambda)
      call move_alloc(to_term, self%to_term)
      call move_alloc(from_term, self%from_term)
      if (change%feel > 0.0_wp) self%rigid = self%rigid(:, :size(self%rigid, 2) - 1)
      self%fastest = maxval(abs(self%lambda))
      done = .true.
   end subroutine replace_terms

end module razy_exact_modal_contact_modes
