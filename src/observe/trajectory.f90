!! The motion at given or natural times: observables and, if asked for, all coordinates and their rates.
!!
!! Given times are from + i*interval, formed from the integer. Natural times are the events and, between them, the
!! interval that the integrator names.
module razy_observe_trajectory
   use razy_core_kinds, only: i8, wp
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: trajectory_t

   type, extends(observer_t) :: trajectory_t
      !> Observables by number in the machine.
      integer, allocatable :: form(:)
      !> Start and interval of recording, s; interval 0 takes natural times.
      real(wp) :: from = 0.0_wp, interval = 0.0_wp
      !> Number of coordinates n of the machine if the state is recorded, which needs all of them followed; else 0.
      integer :: coordinates = 0
      !> Number of points; times in s (count), values (form, count), displacements and velocities (n, count).
      integer :: count = 0
      !> Number of the next of the given times.
      integer(i8), private :: next = 0
      real(wp), allocatable :: time(:), value(:, :), displacement(:, :), velocity(:, :)
   contains
      procedure :: reset
      procedure :: piece
      procedure :: finish
      procedure, private :: record
   end type trajectory_t

contains

   !> Forget everything of an earlier run.
   subroutine reset(self)
      class(trajectory_t), intent(inout) :: self

      self%count = 0
      self%next = 0
      call resize(self, 1024)
   end subroutine reset

   !> Give the arrays their final size.
   subroutine finish(self)
      class(trajectory_t), intent(inout) :: self

      call resize(self, self%count)
   end subroutine finish

   !> Record the points of a piece; its end belongs to the next piece, but for the last.
   subroutine piece(self, part)
      class(trajectory_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau, h
      integer(i8) :: i

      if (self%interval > 0.0_wp) then
         ! Points are counted, so that none is lost between two pieces whose ends differ by rounding.
         do
            tau = ((self%from - part%time) + self%next*self%interval) - part%time_low
            if (tau >= part%duration .and. .not. (part%last .and. tau <= part%duration + 4*spacing(part%time))) exit
            call self%record(part, self%from + self%next*self%interval, min(max(tau, 0.0_wp), part%duration))
            self%next = self%next + 1
         end do
      else
         h = part%by%interval()
         i = 0
         do
            tau = i*h
            if (tau >= part%duration) exit
            if (part%time + tau >= self%from) call self%record(part, part%time + (part%time_low + tau), tau)
            i = i + 1
         end do
         if (part%last) call self%record(part, part%time + (part%time_low + part%duration), part%duration)
      end if
   end subroutine piece

   subroutine record(self, part, time, tau)
      class(trajectory_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: time, tau

      integer :: i

      if (self%count == size(self%time)) call resize(self, 2*self%count)
      self%count = self%count + 1
      self%time(self%count) = time
      do i = 1, size(self%form)
         self%value(i, self%count) = part%by%value(self%form(i), tau)
      end do
      if (self%coordinates == 0) return
      call part%by%state(tau, self%displacement(:, self%count), self%velocity(:, self%count))
   end subroutine record

   subroutine resize(self, points)
      class(trajectory_t), intent(inout) :: self
      integer, intent(in) :: points

      real(wp), allocatable :: time(:)
      allocate (time(points))
      if (self%count > 0) time(:self%count) = self%time(:self%count)
      call move_alloc(time, self%time)
      call widen(self%value, size(self%form))
      call widen(self%displacement, self%coordinates)
      call widen(self%velocity, self%coordinates)

   contains

      subroutine widen(array, rows)
         real(wp), allocatable, intent(inout) :: array(:, :)
         integer, intent(in) :: rows

         real(wp), allocatable :: wider(:, :)

         allocate (wider(rows, points))
         if (self%count > 0) wider(:, :self%count) = array(:, :self%count)
         call move_alloc(wider, array)
      end subroutine widen

   end subroutine resize

end module razy_observe_trajectory
