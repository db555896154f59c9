!! The motion at given or natural times: observables and, if asked for, all coordinates and their rates.
!!
!! Given times are from + i*interval, formed from the integer. Natural times are the events and, between them, steps as the
!! search takes them or shorter, so that the fastest term is resolved.
module razy_dynamics_trajectory
   use razy_core_kinds, only: i8, wp
   use razy_integrate_cursor, only: cursor_t, move_to, reserve, state_of
   use razy_integrate_forms, only: value_of
   use razy_integrate_observer, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: trajectory_t

   type, extends(observer_t) :: trajectory_t
      !> Observables by number in the machine.
      integer, allocatable :: form(:)
      !> Start and interval of recording, s; interval 0 takes natural times.
      real(wp) :: from = 0.0_wp, interval = 0.0_wp
      !> Coordinates from coupled coordinates (n, m); n = 0 records no state.
      real(wp), allocatable :: to_coordinates(:, :)
      !> Number of points; times in s (count), values (form, count), displacements and velocities (n, count).
      integer :: count = 0
      real(wp), allocatable :: time(:), value(:, :), displacement(:, :), velocity(:, :)
      type(cursor_t), private :: cursor
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

      call reserve(self%cursor, part%state%response)
      if (self%interval > 0.0_wp) then
         i = max(0_i8, ceiling(((part%time - self%from) + part%time_low)/self%interval, i8))
         do
            tau = ((self%from - part%time) + i*self%interval) - part%time_low
            if (tau >= part%duration .and. .not. (part%last .and. tau <= part%duration*(1 + 4*epsilon(tau)))) exit
            if (tau >= 0.0_wp) call self%record(part, self%from + i*self%interval, tau)
            i = i + 1
         end do
      else
         ! At least 25 points in a turn of the fastest term, also where no contact is near.
         h = scale(1.0_wp, -max(part%state%level, exponent(part%state%response%fastest) + 2))
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

      real(wp) :: z(2*part%state%response%m)
      integer :: i, m

      call move_to(part%start, part%state%response, tau, self%cursor)
      if (self%count == size(self%time)) call resize(self, 2*self%count)
      self%count = self%count + 1
      self%time(self%count) = time
      do i = 1, size(self%form)
         self%value(i, self%count) = value_of(part%state%observed, part%state%response, self%cursor, self%form(i), 0)
      end do
      if (size(self%to_coordinates, 1) == 0) return
      m = part%state%response%m
      call state_of(self%cursor, part%state%response, z)
      self%displacement(:, self%count) = matmul(self%to_coordinates, z(:m))
      self%velocity(:, self%count) = matmul(self%to_coordinates, z(m + 1:))
   end subroutine record

   subroutine resize(self, points)
      class(trajectory_t), intent(inout) :: self
      integer, intent(in) :: points

      real(wp), allocatable :: time(:)
      integer :: n

      n = size(self%to_coordinates, 1)
      allocate (time(points))
      if (self%count > 0) time(:self%count) = self%time(:self%count)
      call move_alloc(time, self%time)
      call widen(self%value, size(self%form))
      call widen(self%displacement, n)
      call widen(self%velocity, n)

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

end module razy_dynamics_trajectory
