!! Forces of contacts that are closed rigidly or stick: those that keep w_cᵀ y'' + e_c'' = 0 where M = 1.
!!
!! With the directions w_c of the constraints and the coefficients φ_k of friction that slides under the force of one of them,
!! F_k = φ_k |λ_n|, they obey
!!
!!     Σ_n (w_cᵀ w_n + Σ_k w_cᵀ w_k φ_k σ_n) λ_n = w_cᵀ a + e_c'',
!!
!! where a is the acceleration without them and σ_n = ±1 the sign of λ_n. Constraints may be redundant (a body on three stops):
!! λ is then taken from the range of WᵀW, which without friction is the solution of least norm. Friction can leave them open, too:
!! where the lines of action of two feet that slide towards each other meet at the centre of mass, no moment tells the feet apart.
!! There it is the solution of least norm as well.
module razy_hybrid_constraints
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_lapack, only: dgesv
   implicit none(type, external)
   private

   public :: constraints_t, new_constraints

   !> Constraints (count) among the contacts, and friction coupled to them (couplings).
   type :: constraints_t
      integer :: count = 0, rank = 0, couplings = 0
      integer, allocatable :: contact(:)
      !> Coupled friction: its contact, the row of the constraint that presses it and the sign of that force.
      integer, allocatable :: sliding(:), row(:)
      real(wp), allocatable :: sign(:)
      !> Pseudo-inverse of WᵀW (count, count) and orthonormal basis of its range (count, rank).
      real(wp), allocatable :: inverse(:, :), range(:, :)
      !> WᵀW (count, count) and w_cᵀ w_k (count, couplings).
      real(wp), allocatable :: gram(:, :), cross(:, :)
   contains
      procedure :: solve
      procedure :: displace
      procedure :: free_part
   end type constraints_t

   !> Eigenvalues of WᵀW below this part of the largest belong to redundant constraints.
   real(wp), parameter :: negligible = 1.0e-11_wp
   !> Of a direction, what is held leaves at least this part, or it is held itself.
   real(wp), parameter :: shortest_reach = 1.0e-11_wp

contains

   !> Take the constraints `contact` of the directions `w` (m, contacts), and the friction `sliding` (contact numbers), pressed
   !> by constraint `row` with `sign`.
   subroutine new_constraints(self, w, contact, sliding, row, sign)
      type(constraints_t), intent(inout) :: self
      real(wp), intent(in) :: w(:, :), sign(:)
      integer, intent(in) :: contact(:), sliding(:), row(:)

      real(wp), allocatable :: vectors(:, :), values(:)
      integer :: i, info, n

      n = size(contact)
      self%count = n
      self%couplings = size(sliding)
      self%rank = 0
      if (n == 0) return
      self%contact = contact
      self%sliding = sliding
      self%row = row
      self%sign = sign
      self%gram = matmul(transpose(w(:, contact)), w(:, contact))
      self%cross = matmul(transpose(w(:, contact)), w(:, sliding))
      vectors = self%gram
      allocate (values(n))
      call symmetric_eigen(vectors, values, info)
      self%rank = count(values > negligible*values(n))
      self%range = vectors(:, n - self%rank + 1:)
      self%inverse = matmul(self%range, transpose(self%range))
      do i = 1, n
         self%inverse(:, i) = matmul(self%range, self%range(i, :)/values(n - self%rank + 1:))
      end do
   end subroutine new_constraints

   !> Forces (count) for the accelerations `wanted` (count) and coefficients φ (couplings); not `found`: the equations are
   !> singular.
   subroutine solve(self, wanted, phi, force, found)
      class(constraints_t), intent(in) :: self
      real(wp), intent(in) :: wanted(:), phi(:)
      real(wp), intent(out) :: force(:)
      logical, intent(out) :: found

      real(wp) :: matrix(self%count, self%count), right(self%rank), value(self%rank)
      real(wp), dimension(self%rank, self%rank) :: factor, small, square
      integer :: i, info, k, pivot(self%rank)

      found = .true.
      if (self%couplings == 0) then
         force = matmul(self%inverse, wanted)
         return
      end if
      matrix = self%gram
      do k = 1, self%couplings
         matrix(:, self%row(k)) = matrix(:, self%row(k)) + self%sign(k)*phi(k)*self%cross(:, k)
      end do
      small = matmul(transpose(self%range), matmul(matrix, self%range))
      right = matmul(wanted, self%range)
      factor = small
      call dgesv(self%rank, 1, factor, self%rank, pivot, right, self%rank, info)
      found = info == 0
      if (.not. found .or. any(abs([(factor(i, i), i=1, self%rank)]) <= negligible*maxval(self%gram))) then
         square = matmul(small, transpose(small))
         call symmetric_eigen(square, value, info)
         value = merge(value, huge(1.0_wp), value > negligible*maxval(self%gram)**2)
         right = matmul(matmul(square, matmul(matmul(wanted, self%range), square)/value), small)
         found = any(value < huge(1.0_wp))
      end if
      force = matmul(self%range, right)
   end subroutine solve

   !> Add to `x` (m) the shortest vector that changes w_cᵀ x by `change` (count).
   pure subroutine displace(self, w, change, x)
      class(constraints_t), intent(in) :: self
      real(wp), intent(in) :: w(:, :), change(:)
      real(wp), intent(inout) :: x(:)

      x = x + matmul(w(:, self%contact), matmul(self%inverse, change))
   end subroutine displace

   !> What the constraints leave of the direction of contact j in `w` (m, contacts): 0 if they hold it.
   pure function free_part(self, w, j) result(part)
      class(constraints_t), intent(in) :: self
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: j
      real(wp) :: part(size(w, 1))

      part = w(:, j)
      if (self%count == 0) return
      call self%displace(w, -matmul(w(:, j), w(:, self%contact)), part)
      if (dot_product(w(:, j), part) <= shortest_reach*dot_product(w(:, j), w(:, j))) part = 0.0_wp
   end function free_part

end module razy_hybrid_constraints
