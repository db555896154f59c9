!! Steps of a ladder, `rungs` of them to a factor of two, so that a step is used again and again
!! (razy_runge_kutta_methods_step_maps).
!!
!! They are told by the bits of the number: the functions are called for every step.
module razy_runge_kutta_methods_step_ladder
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: below_on_ladder, half_rung, log_half_rung, near_on_ladder, slot_of

   !> Steps in a factor of two.
   integer, parameter :: rungs = 8
   !> Bits of the fraction of a number, and of 2**(i/rungs), i = 0 … rungs - 1: those of numbers on the ladder.
   integer, parameter :: fraction_bits = 52
   integer(i8), parameter :: on_ladder(0:rungs - 1) = ibits(transfer([1.0_wp, 1.0905077326652576592_wp, &
                                                                      1.1892071150027210667_wp, 1.2968395546510096659_wp, &
                                                                      1.4142135623730950488_wp, 1.5422108254079408236_wp, &
                                                                      1.6817928305074290861_wp, 1.8340080864093424635_wp], &
                                                                     0_i8, rungs), 0, fraction_bits)
   !> 2**(1/(2 rungs)), and its logarithm.
   real(wp), parameter :: half_rung = 1.0442737824274138403_wp, log_half_rung = 0.043321698784996581_wp

contains

   !> The step of the ladder nearest to h > 0.
   pure function near_on_ladder(h) result(near)
      real(wp), intent(in) :: h
      real(wp) :: near

      near = below_on_ladder(h*half_rung)
   end function near_on_ladder

   !> The largest step of the ladder that is not longer than h > 0.
   pure function below_on_ladder(h) result(lower)
      real(wp), intent(in) :: h
      real(wp) :: lower

      integer(i8) :: bits, part
      integer :: i

      bits = transfer(h, bits)
      part = ibits(bits, 0, fraction_bits)
      do i = rungs - 1, 1, -1
         if (on_ladder(i) <= part) exit
      end do
      lower = transfer(bits - part + on_ladder(i), lower)
   end function below_on_ladder

   !> Where a step of the ladder is kept, one of `slots` places from 0 on; -1 if it is none.
   pure function slot_of(h, slots) result(slot)
      real(wp), intent(in) :: h
      integer, intent(in) :: slots
      integer :: slot

      integer(i8) :: bits, part
      integer :: i

      bits = transfer(h, bits)
      part = ibits(bits, 0, fraction_bits)
      slot = -1
      do i = 0, rungs - 1
         if (part /= on_ladder(i)) cycle
         slot = int(modulo(shiftr(bits, fraction_bits)*rungs + i, int(slots, i8)))
         return
      end do
   end function slot_of

end module razy_runge_kutta_methods_step_ladder
