!! Whether events come so fast, and no slower, that a motion would not come to its end.
module razy_hybrid_pace
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: most_hurried, pace_t

   !> The pace of events is looked at after so many. A motion is given up if so many times one after the other they come no slower
   !> than the time before but for this factor, in less than this part of what the first took, and so fast that there would be
   !> more than there may before its end. Accumulations are over by then, unless their ratio is above 0.9998; what goes on at
   !> one pace from its first event is not meant.
   integer(i8), parameter :: stretch = 32768
   integer, parameter :: most_hurried = 8
   real(wp), parameter :: no_slower = 1.01_wp, much_faster = 0.5_wp

   !> The pace of events: when, s, and after how many it was looked at last; how long those took, and the first; how often it was
   !> too fast.
   type :: pace_t
      real(wp), private :: time = 0.0_wp, took = 1.0e300_wp, first = 0.0_wp
      integer(i8), private :: events = 0
      integer :: hurried = 0
   contains
      procedure :: look
   end type pace_t

contains

   !> Look at the pace at `time`, s, after so many events, if it is time to.
   pure subroutine look(self, events, most_events, time, t_end)
      class(pace_t), intent(inout) :: self
      integer(i8), intent(in) :: events, most_events
      real(wp), intent(in) :: time, t_end

      real(wp) :: takes, to_come
      logical :: too_fast

      if (events - self%events < stretch) return
      takes = time - self%time
      if (self%events == 0) self%first = takes
      to_come = real(events - self%events, wp)*(t_end - time)
      too_fast = takes < no_slower*self%took .and. takes < much_faster*self%first .and. &
                 to_come > real(most_events - events, wp)*takes
      self%hurried = merge(self%hurried + 1, 0, too_fast)
      self%events = events
      self%took = takes
      self%time = time
   end subroutine look

end module razy_hybrid_pace
