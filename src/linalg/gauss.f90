!! Gauss-Legendre quadrature with eight points, and the peak of a function known at these and at both ends.
module razy_linalg_gauss
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: points, abscissa, weight, peak_of

   !> Both ends, and between them the roots of the Legendre polynomial of degree 8, on [0, 1]; an end has the weight 0.
   integer, parameter :: points = 10
   real(wp), parameter :: root(4) = [0.1834346424956498049395_wp, 0.5255324099163289858177_wp, 0.7966664774136267395916_wp, &
                                     0.9602898564975362316836_wp]
   real(wp), parameter :: share(4) = [0.3626837833783619829652_wp, 0.3137066458778872873380_wp, 0.2223810344533744705444_wp, &
                                      0.1012285362903762591525_wp]
   real(wp), parameter :: abscissa(points) = 0.5_wp + 0.5_wp*[-1.0_wp, -root(4:1:-1), root, 1.0_wp]
   real(wp), parameter :: weight(points) = 0.5_wp*[0.0_wp, share(4:1:-1), share, 0.0_wp]
   integer, parameter :: bisections = 40

contains

   !> Where on [0, 1] the polynomial through the values f (points) at the abscissas has its largest value, near the largest of f:
   !> golden section between the neighbours of that point.
   pure function peak_of(f) result(at)
      real(wp), intent(in) :: f(points)
      real(wp) :: at

      real(wp), parameter :: golden = 0.61803398874989484820_wp
      real(wp) :: barycentric(points), fl, fr, high, left, low, right
      integer :: i, k

      do i = 1, points
         barycentric(i) = 1.0_wp/(product(abscissa(i) - abscissa(:i - 1))*product(abscissa(i) - abscissa(i + 1:)))
      end do
      i = maxloc(f, dim=1)
      low = abscissa(max(1, i - 1))
      high = abscissa(min(points, i + 1))
      left = high - golden*(high - low)
      right = low + golden*(high - low)
      fl = polynomial(left)
      fr = polynomial(right)
      do k = 1, bisections
         if (fl > fr) then
            high = right
            right = left
            fr = fl
            left = high - golden*(high - low)
            fl = polynomial(left)
         else
            low = left
            left = right
            fl = fr
            right = low + golden*(high - low)
            fr = polynomial(right)
         end if
      end do
      at = 0.5_wp*(low + high)

   contains

      pure real(wp) function polynomial(x)
         real(wp), intent(in) :: x

         real(wp) :: part(points)
         integer :: at

         at = minloc(abs(x - abscissa), dim=1)
         polynomial = f(at)
         if (.not. abs(x - abscissa(at)) > 0.0_wp) return
         part = barycentric/(x - abscissa)
         polynomial = sum(part*f)/sum(part)
      end function polynomial

   end function peak_of

end module razy_linalg_gauss
