!! How long --dry-run measures: it is to answer while somebody waits.
module measuring
   use razy_core_kinds, only: wp
   use razy_sweep_clock, only: seconds
   use signals, only: time_is_up
   implicit none(type, external)
   private

   public :: begin_measuring, longest_measuring, measured_enough

   !> Time for all that is measured, s.
   integer, parameter :: longest_measuring = 10

   real(wp) :: begun = 0.0_wp

contains

   subroutine begin_measuring()
      begun = seconds()
   end subroutine begin_measuring

   !> Whether what is being measured is to be broken off, by the clock or by a signal.
   logical function measured_enough()
      measured_enough = time_is_up()
      if (.not. measured_enough) measured_enough = seconds() - begun > longest_measuring
   end function measured_enough

end module measuring
