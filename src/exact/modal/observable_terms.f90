!! The terms of a motion that contacts and observables can feel.
!!
!! In each eigenspace, of one eigenvalue or of copies of it, the forms of contacts and observables have a kernel. What is in it
!! never reaches a form, in this contact state or another, and is left out: of two equal shafts on a gear mesh half of all
!! terms. The others are turned so that they are orthogonal to it.
module razy_exact_modal_observable_terms
   use razy_core_kinds, only: wp
   use razy_exact_modal_basis, only: modal_basis_t
   implicit none(type, external)
   private

   public :: keep_observable

   !> Closer than this part of the largest modulus, eigenvalues are copies: some roundings of the eigenproblem.
   real(wp), parameter :: copies = 64*epsilon(1.0_wp)
   !> A form that is a smaller part of what it could be is rounding.
   real(wp), parameter :: unfelt = 1.0e-13_wp

contains

   !> Leave out of the exponential terms what none of the forms on_y·y + on_v·y' (m, forms) feels.
   pure subroutine keep_observable(self, on_y, on_v)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: on_y(:, :), on_v(:, :)

      complex(wp), allocatable :: turn(:, :)
      integer, allocatable :: group(:)
      logical :: kept(size(self%lambda)), seen(size(self%lambda))
      integer :: i, j, rank
      integer, allocatable :: left(:)

      kept = .true.
      seen = .false.
      do i = 1, size(self%lambda)
         if (seen(i)) cycle
         group = pack([(j, j=1, size(seen))],.not. seen .and. abs(self%lambda - self%lambda(i)) <= copies*self%fastest)
         seen(group) = .true.
         call felt_directions(self, group, on_y, on_v, turn, rank)
         if (rank == size(group)) cycle
         kept(group(rank + 1:)) = .false.
         if (rank == 0) cycle
         self%lambda(group) = sum(self%lambda(group))/size(group)
         self%from_term(:, group(:rank)) = matmul(self%from_term(:, group), turn(:, :rank))
         self%to_term(group(:rank), :) = matmul(conjg(transpose(turn(:, :rank))), self%to_term(group, :))
      end do
      if (all(kept)) return
      left = pack([(i, i=1, size(kept))], kept)
      self%lambda = self%lambda(left)
      self%from_term = self%from_term(:, left)
      self%to_term = self%to_term(left, :)
   end subroutine keep_observable

   !> Orthonormal directions (group, rank) in the space of the terms `group` that the forms feel: the space of their conjugate rows,
   !> by Gram and Schmidt with the longest rest first.
   pure subroutine felt_directions(self, group, on_y, on_v, turn, rank)
      type(modal_basis_t), intent(in) :: self
      integer, intent(in) :: group(:)
      real(wp), intent(in) :: on_y(:, :), on_v(:, :)
      complex(wp), allocatable, intent(out) :: turn(:, :)
      integer, intent(out) :: rank

      complex(wp) :: row(size(group), size(on_y, 2))
      real(wp) :: most(2)
      integer :: f, i, longest, m

      m = self%m
      most = 0.0_wp
      do i = 1, size(group)
         associate (y => self%from_term(:m, group(i)), v => self%from_term(m + 1:, group(i)))
            most = max(most, sqrt([sum(y%re**2 + y%im**2), sum(v%re**2 + v%im**2)]))
            row(i, :) = [(conjg(sum(y*on_y(:, f)) + sum(v*on_v(:, f))), f=1, size(on_y, 2))]
         end associate
      end do
      do f = 1, size(on_y, 2)
         row(:, f) = row(:, f)/max(tiny(1.0_wp), norm2(on_y(:, f))*most(1) + norm2(on_v(:, f))*most(2))
      end do
      allocate (turn(size(group), size(group)))
      rank = 0
      do while (rank < size(group))
         longest = maxloc([0.0_wp, (norm2(abs(row(:, f))), f=1, size(on_y, 2))], dim=1) - 1
         if (longest == 0) return
         if (norm2(abs(row(:, longest))) <= unfelt) return
         rank = rank + 1
         turn(:, rank) = row(:, longest)
         do i = 1, rank - 1
            turn(:, rank) = turn(:, rank) - turn(:, i)*dot_product(turn(:, i), turn(:, rank))
         end do
         turn(:, rank) = turn(:, rank)/norm2(abs(turn(:, rank)))
         do f = 1, size(on_y, 2)
            row(:, f) = row(:, f) - turn(:, rank)*dot_product(turn(:, rank), row(:, f))
         end do
      end do
   end subroutine felt_directions

end module razy_exact_modal_observable_terms
