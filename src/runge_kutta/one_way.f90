!! Whether a function goes one way all through a step, by its rates and accelerations at the ends.
!!
!! The cubic with these has a rate between its control points r0, r0 + h a0/3, r1 - h a1/3, r1. The function is trusted to go one
!! way if zero is further from them than half of what lies between them.
module razy_runge_kutta_one_way
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: one_way

contains

   !> +1: it rises, -1: it falls all through a step h with the rates r0 and r1 and the accelerations a0 and a1 at its ends; 0: that
   !> cannot be told.
   pure function one_way(h, r0, r1, a0, a1) result(way)
      real(wp), intent(in) :: h, r0, r1, a0, a1
      integer :: way

      real(wp) :: b0, b1, highest, lowest, room

      b0 = r0 + h*a0/3
      b1 = r1 - h*a1/3
      lowest = min(min(r0, r1), min(b0, b1))
      highest = max(max(r0, r1), max(b0, b1))
      room = 0.5_wp*(highest - lowest)
      way = 0
      if (lowest > room) way = 1
      if (highest < -room) way = -1
   end function one_way

end module razy_runge_kutta_one_way
