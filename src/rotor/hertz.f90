!! Stiffness of rolling elements from their geometry.
!!
!! Balls: Hertz's elliptic point contact Q = K delta^(3/2) on both races, in series (Harris and Kotzalas, Essential Concepts of
!! Bearing Technology, 2007, chapter 6). With curvature sum S and E' from 1/E' = sum (1 - nu²)/E,
!!
!!     delta = delta* (3 Q/(2 S E'))^(2/3) S/2,  delta* = (2 F/pi) (pi/(2 k² E))^(1/3),
!!     curvature difference = ((k² + 1) E - 2 F)/((k² - 1) E),
!!
!! with the complete elliptic integrals F, E of modulus sqrt(1 - 1/k²) and the axis ratio k >= 1 of the contact.
!! Rollers: Palmgren's line contact of steel, delta = 3.84e-5 Q^0.9/l^0.8 in mm and N (Palmgren, Ball and Roller Bearing
!! Engineering, 1959), for each of two contacts.
module razy_rotor_hertz
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: pi, wp
   use razy_linalg_bracketed_root, only: bracketed_root_t
   implicit none(type, external)
   private

   public :: ball_race_t, ball_stiffness, point_contact, roller_stiffness

   !> Radial ball bearing: diameter of the balls, diameter of the pitch circle, radii of the grooves, m; contact angle 0.
   type :: ball_race_t
      real(wp) :: ball = 0.0_wp, pitch = 0.0_wp, inner_groove = 0.0_wp, outer_groove = 0.0_wp
      !> Young's modulus, Pa, and Poisson's ratio of balls and rings.
      real(wp) :: young = 0.0_wp, poisson = 0.0_wp
   end type ball_race_t

contains

   !> Stiffness dQ/d(delta), N/m, of a ball between its races at the load `load` > 0, N.
   elemental function ball_stiffness(race, load) result(stiffness)
      type(ball_race_t), intent(in) :: race
      real(wp), intent(in) :: load
      real(wp) :: stiffness

      real(wp) :: ball, effective, inner, k_inner, k_outer, outer

      effective = race%young/(2*(1 - race%poisson**2))
      ball = 2/race%ball
      inner = 2/(race%pitch - race%ball)
      outer = -2/(race%pitch + race%ball)
      k_inner = point_contact(ball - 1/race%inner_groove, ball + inner, effective)
      k_outer = point_contact(ball - 1/race%outer_groove, ball + outer, effective)
      stiffness = 1.5_wp*(k_inner**(-2.0_wp/3) + k_outer**(-2.0_wp/3))**(-1)*load**(1.0_wp/3)
   end function ball_stiffness

   !> K of Q = K delta^(3/2), N/m^1.5, for the sums of the two bodies' curvatures in the principal planes, 1/m, both positive;
   !> `effective` is E', Pa. NaN where a sum is not positive: the bodies do not touch in a point.
   elemental function point_contact(curvature_1, curvature_2, effective) result(k)
      real(wp), intent(in) :: curvature_1, curvature_2, effective
      real(wp) :: k

      type(bracketed_root_t) :: root
      real(wp) :: a, b, deflection, ellipse, first, second

      k = ieee_value(k, ieee_quiet_nan)
      a = min(curvature_1, curvature_2)
      b = max(curvature_1, curvature_2)
      if (.not. a > 0.0_wp) return
      ! The curvature ratio b/a = (k² E - F)/(F - E) grows with the axis ratio k, from 1 and at least as fast as k.
      call elliptic_integrals(b/a + 1, first, second, ellipse)
      call root%start(1.0_wp, 1 - b/a, b/a + 1, ellipse - b/a)
      do while (.not. root%done())
         call elliptic_integrals(root%trial, first, second, ellipse)
         call root%take(ellipse - b/a)
      end do
      call elliptic_integrals(root%best, first, second, ellipse)
      deflection = 2*first/pi*(pi/(2*root%best**2*second))**(1.0_wp/3)
      k = 2*(a + b)*effective/3*(2/(deflection*(a + b)))**1.5_wp
   end function point_contact

   !> Complete elliptic integrals of modulus² 1 - 1/k² by the arithmetic-geometric mean, and the curvature ratio
   !> (k² E - F)/(F - E), which is 1 for a circle.
   elemental subroutine elliptic_integrals(axis_ratio, first, second, curvature_ratio)
      real(wp), intent(in) :: axis_ratio
      real(wp), intent(out) :: first, second, curvature_ratio

      real(wp) :: a, b, c, modulus, power, total
      integer :: i

      modulus = (1 - 1/axis_ratio)*(1 + 1/axis_ratio)
      a = 1.0_wp
      b = 1/axis_ratio
      power = 0.5_wp
      total = power*modulus
      do i = 1, 60
         c = (a - b)/2
         power = 2*power
         total = total + power*c**2
         if (c <= epsilon(1.0_wp)*a) exit
         c = sqrt(a*b)
         a = (a + b)/2
         b = c
      end do
      first = pi/(2*(a + b)/2)
      second = first*(1 - total)
      ! F - E = F total; near the circle both differences vanish.
      curvature_ratio = 1.0_wp
      if (modulus > sqrt(epsilon(1.0_wp))) curvature_ratio = (axis_ratio**2*(1 - total) - 1)/total
   end subroutine elliptic_integrals

   !> Stiffness dQ/d(delta), N/m, of a steel roller of effective length `length`, m, between two races at the load `load` > 0, N.
   elemental function roller_stiffness(length, load) result(stiffness)
      real(wp), intent(in) :: length, load
      real(wp) :: stiffness

      real(wp) :: compliance

      ! 3.84e-5 mm for N and mm is 3.84e-8 m (1e-3)^0.8 for N and m; two contacts in series.
      compliance = 2*3.84e-8_wp*(1.0e-3_wp)**0.8_wp
      stiffness = length**0.8_wp*load**0.1_wp/(0.9_wp*compliance)
   end function roller_stiffness

end module razy_rotor_hertz
