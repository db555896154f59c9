!! Matrices of machines that turn, without pattern.
module turning_shafts
   use machine_samples, only: random_numbers
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: two_shafts

contains

   !> A random turning machine of two shafts of s coordinates each, not coupled. `twin`: the second is the first, relative
   !> difference `split`. `free`: each has a mode without stiffness.
   subroutine two_shafts(seed, s, twin, split, free, k, b)
      integer, intent(inout) :: seed
      integer, intent(in) :: s
      logical, intent(in) :: twin, free
      real(wp), intent(in) :: split
      real(wp), intent(out) :: k(2*s, 2*s), b(2*s, 2*s)

      real(wp) :: x(4*s*s)
      integer :: i

      k = 0.0_wp
      b = 0.0_wp
      do i = 0, 1
         if (i == 0 .or. .not. twin) call random_numbers(seed, x)
         associate (one => k(i*s + 1:(i + 1)*s, i*s + 1:(i + 1)*s), other => b(i*s + 1:(i + 1)*s, i*s + 1:(i + 1)*s))
            call fill(one, other, reshape(x(:s*s), [s, s]), reshape(x(s*s + 1:2*s*s), [s, s]), &
                      reshape(x(2*s*s + 1:3*s*s), [s, s]), x(3*s*s + 1:3*s*s + s))
            one = one*(1.0_wp + i*split)
         end associate
      end do

   contains

      subroutine fill(one, other, p, q, r, spread_of)
         real(wp), intent(inout) :: one(:, :), other(:, :)
         real(wp), intent(in) :: p(:, :), q(:, :), r(:, :), spread_of(:)

         integer :: j, first

         first = merge(2, 1, free)
         one(first:, first:) = 20*(q(first:, first:) - transpose(q(first:, first:))) &
                               + 5*matmul(p(first:, first:), transpose(p(first:, first:)))
         do j = first, size(one, 1)
            one(j, j) = one(j, j) + 100*10.0_wp**(3*spread_of(j))
         end do
         other(first:, first:) = 0.3_wp*matmul(r(first:, first:), transpose(r(first:, first:))) &
                                 + 8*(p(first:, first:) - transpose(p(first:, first:)))
      end subroutine fill

   end subroutine two_shafts

end module turning_shafts
