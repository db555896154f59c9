!! Critical speeds: where the frequency of a branch of eigenvalues is `order` times the speed.
!!
!! Newton's method on the shape u, the growth g and the speed Omega at once, with lambda = g + i order Omega: from
!! Q(lambda, Omega) u = 0, Q = lambda² M + lambda (B + Omega G) + K + Omega C,
!!
!!     u_new = -dlambda Q⁻¹ Q_lambda u - dOmega Q⁻¹ Q_Omega u,   uᴴ u_new = 1,   dlambda = dg + i order dOmega,
!!
!! which is one complex system with two right-hand sides a step, and two real equations for dg and dOmega. If it leaves the
!! interval or ends at a shape of another branch, the crossing is found on eigenvalues that are followed by their shapes.
module razy_rotor_whirl_critical
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_branches, only: find_crossing, line_t
   use razy_eigen_spectrum, only: spectrum_t
   use razy_linalg_dense, only: rising_order
   use razy_rotor_whirl_family, only: whirl_family_t
   implicit none(type, external)
   private

   public :: critical_t, find_critical, in_order, likely

   !> Overlap above which two shapes belong together.
   real(wp), parameter :: likely = 0.6_wp
   !> Critical speeds err by less than this share; Newton's steps below the second, which no longer fall, are rounding.
   real(wp), parameter :: precise = 1.0e-12_wp, rounding = 1.0e-9_wp
   !> A crossing counts as found if frequency and excitation differ by less than this share.
   real(wp), parameter :: residual = 1.0e-9_wp
   integer, parameter :: most_newton = 12

   !> A critical speed, rad/s: there the frequency, rad/s, of `branch` is `order` times the speed. `growth` is the real part, 1/s.
   type :: critical_t
      real(wp) :: speed = 0.0_wp, order = 0.0_wp, frequency = 0.0_wp, growth = 0.0_wp, direction = 0.0_wp
      integer :: branch = 0
   end type critical_t

contains

   !> The critical speed of order `order` between mode i of one spectrum and mode j of the next, if there is one (`crossed`),
   !> and its shape (p) as in spectra; its direction is left to the caller. Not `found` if the branch was lost.
   subroutine find_critical(critical, shape, crossed, found, family, order, before, i, after, j, error)
      type(critical_t), intent(out) :: critical
      complex(wp), allocatable, intent(out) :: shape(:)
      logical, intent(out) :: crossed, found
      class(whirl_family_t), intent(inout) :: family
      real(wp), intent(in) :: order
      type(spectrum_t), intent(in) :: before, after
      integer, intent(in) :: i, j
      type(error_t), allocatable, intent(out) :: error

      type(line_t) :: line
      type(spectrum_t) :: at
      real(wp) :: f(2)
      integer :: place

      line = line_t((0.0_wp, -1.0_wp), -order, 0.0_wp)
      f = [line%height(before, i), line%height(after, j)]
      found = .false.
      crossed = (f(1) > 0.0_wp .and. f(2) <= 0.0_wp) .or. (f(1) < 0.0_wp .and. f(2) >= 0.0_wp)
      if (.not. crossed) return
      call by_newton(critical, shape, found, family, order, f(1)/(f(1) - f(2)), before, i, after, j)
      if (.not. found) then
         call find_crossing(family, before, after, before%branch(i), line, at, place, error, precise)
         if (allocated(error) .or. place == 0) return
         critical = critical_t(at%parameter, order, at%value(place)%im, at%value(place)%re)
         shape = at%shape(:, place)
         found = abs(line%height(at, place)) <= residual*critical%frequency
      end if
      critical%branch = before%branch(i)
   end subroutine find_critical

   !> Newton's method from the share `share` of the interval on, with the shape of the end at which fewer modes are
   !> degenerate, else of the nearer one.
   subroutine by_newton(critical, shape, found, family, order, share, before, i, after, j)
      type(critical_t), intent(out) :: critical
      complex(wp), allocatable, intent(out) :: shape(:)
      logical, intent(out) :: found
      class(whirl_family_t), intent(in) :: family
      real(wp), intent(in) :: order, share
      type(spectrum_t), intent(in) :: before, after
      integer, intent(in) :: i, j

      complex(wp), allocatable :: u(:)
      real(wp) :: growth, middle, old, speed, step, width
      integer :: k
      logical :: solved

      found = .false.
      width = after%parameter - before%parameter
      middle = before%parameter + 0.5_wp*width
      speed = before%parameter + share*width
      growth = (1 - share)*before%value(i)%re + share*after%value(j)%re
      associate (left => before%shape(:, before%equals_of(i)), right => after%shape(:, after%equals_of(j)))
         u = after%shape(:, j)
         if (size(left, 2) < size(right, 2) .or. (size(left, 2) == size(right, 2) .and. share < 0.5_wp)) u = before%shape(:, i)
         u = family%vector_of(u)
         step = huge(1.0_wp)
         do k = 1, most_newton
            u = u/norm2(abs(u))
            old = abs(step)
            call newton_step(family, order, speed, growth, u, step, solved)
            if (.not. solved .or. abs(speed - middle) > width) return
            found = abs(step) <= precise*speed .or. (abs(step) <= rounding*speed .and. abs(step) > 0.5_wp*old)
            if (found) exit
         end do
         if (.not. found) return
         shape = family%shape_from(u)
         shape = shape/norm2(abs(shape))
         found = max(sum(abs(matmul(conjg(shape), left))**2), sum(abs(matmul(conjg(shape), right))**2)) >= likely &
                 .and. abs(speed - middle) <= (0.5_wp + rounding)*width
      end associate
      critical = critical_t(speed, order, order*speed, growth)
   end subroutine by_newton

   !> One step; `step` is the change of the speed, rad/s.
   subroutine newton_step(family, order, speed, growth, u, step, solved)
      class(whirl_family_t), intent(in) :: family
      real(wp), intent(in) :: order
      real(wp), intent(inout) :: speed, growth
      complex(wp), intent(inout) :: u(:)
      real(wp), intent(out) :: step
      logical, intent(out) :: solved

      complex(wp) :: across, along, right(size(u), 2)
      real(wp) :: determinant
      integer :: info

      step = 0.0_wp
      call family%newton(cmplx(growth, order*speed, wp), speed, u, right, info)
      solved = info == 0
      if (.not. solved) return
      along = dot_product(u, right(:, 1))
      across = cmplx(0.0_wp, order, wp)*along + dot_product(u, right(:, 2))
      determinant = along%re*across%im - along%im*across%re
      solved = abs(determinant) > tiny(1.0_wp)*abs(along)
      if (.not. solved) return
      step = along%im/determinant
      u = (across%im/determinant - cmplx(0.0_wp, order*step, wp))*right(:, 1) - step*right(:, 2)
      growth = growth - across%im/determinant
      speed = speed + step
   end subroutine newton_step

   !> Critical speeds by rising order, then by rising speed.
   pure function in_order(list) result(sorted)
      type(critical_t), intent(in) :: list(:)
      type(critical_t), allocatable :: sorted(:)

      sorted = list(rising_order(list%speed))
      sorted = sorted(rising_order(sorted%order))
   end function in_order

end module razy_rotor_whirl_critical
