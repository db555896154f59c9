!! Which mode of a changed machine continues which mode of the machine before: by shape, not by order.
!!
!! The measure is the modal assurance criterion in the mass metric, (φᵀMψ)²/((φᵀMφ)(ψᵀMψ)). Modes whose values differ by
!! no more than rounding have no shapes of their own, only a common space: as many old modes as it has dimensions are
!! assigned to it, and the orthonormal basis of it that is nearest to them (polar decomposition, Procrustes' problem) is
!! taken for their shapes.
module razy_eigen_mode_match
   use razy_core_kinds, only: wp
   use razy_eigen_modes, only: modes_t
   use razy_linalg_eigen, only: symmetric_eigen
   implicit none(type, external)
   private

   public :: align_modes, coincidence

   !> Values nearer than this part of the largest cannot be told apart.
   real(wp), parameter :: coincident = 1.0e-11_wp

contains

   !> The difference of values λ up to which they count as one.
   pure function coincidence(value) result(gap)
      real(wp), intent(in) :: value(:)
      real(wp) :: gap

      gap = coincident*maxval(abs(value))
   end function coincidence

   !> Put the columns of `modes` into the order of `reference`, with its signs. `overlap` (n): assurance criterion of each.
   subroutine align_modes(modes, reference, mass, overlap)
      type(modes_t), intent(inout) :: modes
      type(modes_t), intent(in) :: reference
      real(wp), intent(in) :: mass(:, :)
      real(wp), intent(out) :: overlap(:)

      real(wp), dimension(size(overlap), size(overlap)) :: product, rotation, weighted
      integer :: group(size(overlap)), owner(size(overlap))
      integer :: b, k

      weighted = matmul(mass, reference%shape)
      product = matmul(transpose(weighted), modes%shape)
      do b = 1, size(overlap)
         product(b, :) = product(b, :)/sqrt(dot_product(weighted(:, b), reference%shape(:, b)))
      end do
      group(1) = 1
      do k = 2, size(group)
         group(k) = group(k - 1)
         if (modes%value(k) - modes%value(k - 1) > coincidence(modes%value)) group(k) = k
      end do
      call assign_groups(product, group, owner)
      rotation = 0.0_wp
      do k = 1, size(group)
         if (group(k) == k) call align_group(product, pack([(b, b=1, size(owner))], owner == k), &
                                             [(b, b=k, k + count(group == k) - 1)], rotation)
      end do
      product = matmul(product, rotation)
      overlap = [(product(b, b)**2, b=1, size(overlap))]
      modes%value = matmul(modes%value, rotation**2)
      modes%shape = matmul(modes%shape, rotation)
   end subroutine align_modes

   !> The group of modes, named by its first, that each old mode goes to: the greatest overlap first.
   pure subroutine assign_groups(product, group, owner)
      real(wp), intent(in) :: product(:, :)
      integer, intent(in) :: group(:)
      integer, intent(out) :: owner(:)

      real(wp) :: weight(size(group), size(group))
      integer :: free(size(group)), i, k, place(2)

      weight = -1.0_wp
      free = 0
      do k = 1, size(group)
         if (group(k) == k) weight(:, k) = 0.0_wp
         weight(:, group(k)) = weight(:, group(k)) + product(:, k)**2
         free(group(k)) = free(group(k)) + 1
      end do
      do i = 1, size(group)
         place = maxloc(weight)
         owner(place(1)) = place(2)
         weight(place(1), :) = -1.0_wp
         free(place(2)) = free(place(2)) - 1
         if (free(place(2)) == 0) weight(:, place(2)) = -1.0_wp
      end do
   end subroutine assign_groups

   !> Enter into `rotation` (mode, old mode) the basis of the modes `columns` that is nearest to the old modes `rows`: with C the
   !> block of products, the orthogonal factor Cᵀ(C Cᵀ)^(-1/2).
   subroutine align_group(product, rows, columns, rotation)
      real(wp), intent(in) :: product(:, :)
      integer, intent(in) :: rows(:), columns(:)
      real(wp), intent(inout) :: rotation(:, :)

      real(wp), dimension(size(rows), size(rows)) :: block, vectors, root
      real(wp) :: values(size(rows))
      integer :: i, info

      block = product(rows, columns)
      vectors = matmul(block, transpose(block))
      call symmetric_eigen(vectors, values, info)
      if (info /= 0 .or. .not. minval(values) > 1.0e-6_wp) then
         ! The old modes do not span the space: nothing to align with, and the small overlap will say so.
         do i = 1, size(rows)
            rotation(columns(i), rows(i)) = sign(1.0_wp, block(i, i))
         end do
         return
      end if
      do i = 1, size(rows)
         root(:, i) = vectors(:, i)/sqrt(values(i))
      end do
      rotation(columns, rows) = matmul(transpose(block), matmul(root, transpose(vectors)))
   end subroutine align_group

end module razy_eigen_mode_match
