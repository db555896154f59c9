!! The time in which a motion without excitation repeats itself, from the maxima of an observable.
module razy_observe_cycle
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: cycle_time

   !> The most maxima of a cycle that are looked for, and how many are compared at least.
   integer, parameter :: longest = 32, fewest = 4

contains

   !> T, s, such that the last maxima are those m before, T later, for the smallest such m: the last m of them, at least four, to
   !> `tolerance` times the largest value, and times T. NaN where there is none. `value`, `time` (s) and `kind` (+1 maximum) of
   !> all extrema (extrema each).
   pure function cycle_time(value, time, kind, tolerance) result(duration)
      real(wp), intent(in) :: value(:), time(:), tolerance
      integer, intent(in) :: kind(:)
      real(wp) :: duration

      real(wp), allocatable :: at(:), peak(:)
      real(wp) :: scale
      integer :: compared, i, m, n

      at = pack(time, kind == 1)
      peak = pack(value, kind == 1)
      n = size(at)
      scale = maxval([0.0_wp, abs(value)])
      do m = 1, min(longest, n/2)
         compared = max(m, fewest)
         if (n < compared + m) exit
         duration = at(n) - at(n - m)
         if (all([(abs(peak(i) - peak(i - m)) <= tolerance*scale .and. &
                   abs(at(i) - at(i - m) - duration) <= tolerance*duration, i=n - compared + 1, n)])) return
      end do
      duration = ieee_value(duration, ieee_quiet_nan)
   end function cycle_time

end module razy_observe_cycle
