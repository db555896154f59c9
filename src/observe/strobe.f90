!! The state of a motion at given times: what a stroboscope shows.
module razy_observe_strobe
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: strobe_t

   !> Needs an integrator that follows every coordinate.
   type, extends(observer_t) :: strobe_t
      !> Periods before the end of the motion that are looked at, 0: it is not looked at; the period, s.
      integer :: periods = 0
      real(wp) :: period = 0.0_wp
      !> Times, s, ascending, none after the end of the motion (times).
      real(wp), allocatable :: time(:)
      !> States recorded: displacement above velocity (2 n, times); the first `count` are valid.
      integer :: count = 0
      real(wp), allocatable :: state(:, :)
   contains
      procedure :: attach
      procedure :: piece
      procedure :: forget
      procedure :: columns
   end type strobe_t

contains

   !> Look at times t_end - k period, k = `periods` … 0.
   subroutine attach(self, machine, t_end)
      class(strobe_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      integer :: k

      self%count = 0
      self%time = [(t_end - k*self%period, k=self%periods, 0, -1)]
      if (allocated(self%state)) deallocate (self%state)
      allocate (self%state(2*size(machine%mass, 1), self%periods + 1))
   end subroutine attach

   subroutine forget(self)
      class(strobe_t), intent(inout) :: self

      self%count = 0
   end subroutine forget

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
   subroutine columns(self, table, machine)
      class(strobe_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: states(:)

      associate (unused => machine)
         states = [real(wp) ::]
      end associate
      if (self%count > 0) states = reshape(self%state(:, :self%count), [size(self%state, 1)*self%count])
      call table%add("strobe/states", states, "1", "states", "strobe/value")
   end subroutine columns

end module razy_observe_strobe
