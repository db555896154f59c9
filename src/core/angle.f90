!! Angles in degrees, as users give them.
module razy_core_angle
   use razy_core_kinds, only: pi, wp
   implicit none(type, external)
   private

   public :: turn

contains

   !> e^{iφ} of φ in degrees, exact at multiples of 90 degrees: rounding in a load would move what rests on a bound.
   elemental function turn(degrees) result(phasor)
      real(wp), intent(in) :: degrees
      complex(wp) :: phasor

      real(wp) :: rest
      integer :: quarters

      ! Remainders are exact.
      rest = mod(degrees, 360.0_wp)
      quarters = nint(rest/90)
      rest = (rest - 90*quarters)*(pi/180)
      phasor = cmplx(cos(rest), sin(rest), wp)
      quarters = modulo(quarters, 4)
      if (modulo(quarters, 2) == 1) phasor = cmplx(-phasor%im, phasor%re, wp)
      if (quarters > 1) phasor = -phasor
   end function turn

end module razy_core_angle
