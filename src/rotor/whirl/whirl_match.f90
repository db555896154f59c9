!! Which eigenvalues of a rotor at two speeds belong together: those whose shapes do.
!!
!! The measure is the overlap |x_iᴴ x_j|² of shapes in modes at rest, or for equal eigenvalues that of the spaces of their shapes,
!! since the shapes themselves are arbitrary there.
module razy_rotor_whirl_whirl_match
   use razy_core_kinds, only: wp
   use razy_rotor_whirl_whirl, only: whirl_t
   implicit none(type, external)
   private

   public :: equal_shapes, likely, match

   !> Overlap above which two shapes belong together.
   real(wp), parameter :: likely = 0.6_wp
   !> Eigenvalues apart by less than this share of their size are taken as equal.
   real(wp), parameter :: equal = 1.0e-7_wp

contains

   !> For each eigenvalue of `after` the one of `before` with its shape, 0 if there is none: pairs of largest overlap first.
   pure subroutine match(before, after, partner)
      type(whirl_t), intent(in) :: before, after
      integer, intent(out) :: partner(:)

      real(wp) :: overlap(size(before%value), size(after%value))
      integer :: best(2), k

      overlap = overlaps(before, after)
      partner = 0
      do k = 1, min(size(before%value), size(after%value))
         best = maxloc(overlap)
         if (overlap(best(1), best(2)) < likely) exit
         partner(best(2)) = best(1)
         overlap(best(1), :) = -1.0_wp
         overlap(:, best(2)) = -1.0_wp
      end do
   end subroutine match

   !> Overlaps (before, after), between 0 and 1; equal eigenvalues share one.
   pure function overlaps(before, after) result(overlap)
      type(whirl_t), intent(in) :: before, after
      real(wp), allocatable :: overlap(:, :)

      complex(wp), allocatable :: a(:, :), b(:, :)
      integer :: first(size(before%value) + 1), groups(2), i, j, second(size(after%value) + 1)
      real(wp) :: shared

      call group_equal(before, a, first, groups(1))
      call group_equal(after, b, second, groups(2))
      overlap = abs(matmul(conjg(transpose(a)), b))**2
      do j = 1, groups(2)
         do i = 1, groups(1)
            associate (rows => first(i + 1) - first(i), columns => second(j + 1) - second(j), &
                       block => overlap(first(i):first(i + 1) - 1, second(j):second(j + 1) - 1))
               shared = sum(block)/min(rows, columns)
               block = shared
            end associate
         end do
      end do
   end function overlaps

   !> Shapes with those of equal eigenvalues made orthonormal; group i goes from `first(i)` to `first(i + 1) - 1`.
   pure subroutine group_equal(whirl, shape, first, groups)
      type(whirl_t), intent(in) :: whirl
      complex(wp), allocatable, intent(out) :: shape(:, :)
      integer, intent(out) :: first(:), groups

      integer :: i, j, pass

      shape = whirl%modal
      groups = 0
      first = 1
      do i = 1, size(whirl%value)
         if (i == 1) then
            groups = 1
         else if (abs(whirl%value(i) - whirl%value(i - 1)) > equal*abs(whirl%value(i))) then
            groups = groups + 1
            first(groups) = i
         end if
         first(groups + 1) = i + 1
         do pass = 1, 2
            do j = first(groups), i - 1
               shape(:, i) = shape(:, i) - dot_product(shape(:, j), shape(:, i))*shape(:, j)
            end do
            shape(:, i) = shape(:, i)/max(norm2(abs(shape(:, i))), tiny(1.0_wp))
         end do
      end do
   end subroutine group_equal

   !> The shapes of all eigenvalues equal to number i, orthonormal.
   pure function equal_shapes(whirl, i) result(space)
      type(whirl_t), intent(in) :: whirl
      integer, intent(in) :: i
      complex(wp), allocatable :: space(:, :)

      complex(wp), allocatable :: shape(:, :)
      integer :: first(size(whirl%value) + 1), g, groups

      call group_equal(whirl, shape, first, groups)
      g = count(first(:groups) <= i)
      space = shape(:, first(g):first(g + 1) - 1)
   end function equal_shapes

end module razy_rotor_whirl_whirl_match
