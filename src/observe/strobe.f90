!! The state of a motion at given times: what a stroboscope shows.
module razy_observe_strobe
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: strobe_t

   !> Needs an integrator that follows every coordinate.
   type, extends(observer_t) :: strobe_t
      !> Times, s, ascending, none after the end of the motion (times).
      real(wp), allocatable :: time(:)
      !> States recorded: displacement above velocity (2 n, times); the first `count` are valid.
      integer :: count = 0
      real(wp), allocatable :: state(:, :)
   contains
      procedure :: begin
      procedure :: piece
      procedure :: columns
   end type strobe_t

contains

   !> Look at times t_end - k period, k = `periods` … 0, at a machine of n coordinates.
   pure subroutine begin(self, n, t_end, period, periods)
      class(strobe_t), intent(inout) :: self
      integer, intent(in) :: n, periods
      real(wp), intent(in) :: t_end, period

      integer :: k

      self%count = 0
      self%time = [(t_end - k*period, k=periods, 0, -1)]
      if (allocated(self%state)) deallocate (self%state)
      allocate (self%state(2*n, periods + 1))
   end subroutine begin

   !> Take the states at times within a piece; its end belongs to the next piece, but for the last.
   subroutine piece(self, part)
      class(strobe_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau
      integer :: n

      n = size(self%state, 1)/2
      do while (self%count < size(self%time))
         tau = (self%time(self%count + 1) - part%time) - part%time_low
         if (tau >= part%duration .and. .not. part%last) exit
         if (tau > part%duration*(1 + 4*epsilon(tau)) + 2*spacing(self%time(self%count + 1))) exit
         self%count = self%count + 1
         tau = max(0.0_wp, min(tau, part%duration))
         call part%by%state(tau, self%state(:n, self%count), self%state(n + 1:, self%count))
      end do
   end subroutine piece

   !> Hand over the states, one after the other, for the checkpoint of a sweep.
   subroutine columns(self, table)
      class(strobe_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      if (self%count > 0) then
         call table%add("strobe/states", reshape(self%state(:, :self%count), [size(self%state, 1)*self%count]), "1", "states", &
                        "strobe/value")
      else
         call table%add("strobe/states", [real(wp) ::], "1", "states", "strobe/value")
      end if
   end subroutine columns

end module razy_observe_strobe
