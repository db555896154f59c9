!! The motion at given or natural times: observables and, if asked for, all coordinates and their rates.
!!
!! Given times are from + i*interval, formed from the integer; of a strobe they are the multiples of the interval, from `from` on.
!! Natural times are the events and, between them, the interval that the integrator names.
module razy_observe_trajectory
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: common_unit, table_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: trajectory_t

   type, extends(observer_t) :: trajectory_t
      !> Observables by number in the machine.
      integer, allocatable :: form(:)
      !> Interval of recording, s; 0 takes natural times.
      real(wp) :: interval = 0.0_wp
      !> Multiples of the interval are taken: the excitation has the same phase in all of them.
      logical :: strobe = .false.
      !> Number of coordinates n of the machine if the state is recorded, which needs all of them followed; else 0.
      integer :: coordinates = 0
      !> Number of points; times in s (count), values (form, count), displacements and velocities (n, count): the first `count`
      !> are valid.
      integer :: count = 0
      !> Number of the next of the given times, which count from `first`, s.
      integer(i8), private :: next = 0
      real(wp), private :: first = 0.0_wp
      real(wp), allocatable :: time(:), value(:, :), displacement(:, :), velocity(:, :)
   contains
      procedure :: forget
      procedure :: piece
      procedure :: columns
   end type trajectory_t

contains

   subroutine forget(self)
      class(trajectory_t), intent(inout) :: self

      self%count = 0
      self%next = 0
      self%first = merge(0.0_wp, self%from, self%strobe)
      if (self%strobe) self%next = ceiling(self%from/self%interval*(1 - 4*epsilon(1.0_wp)), i8)
      call make_room(self, 0_i8)
   end subroutine forget

   !> Record the points of a piece; its end belongs to the next piece, but for the last.
   subroutine piece(self, part)
      class(trajectory_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau, h
      integer(i8) :: i

      if (self%interval > 0.0_wp) then
         ! Points are counted, so that none is lost between two pieces whose ends differ by rounding.
         do
            tau = ((self%first - part%time) + self%next*self%interval) - part%time_low
            if (tau >= part%duration .and. .not. (part%last .and. tau <= part%duration + 4*spacing(part%time + tau))) exit
            call record(self, part, self%first + self%next*self%interval, min(max(tau, 0.0_wp), part%duration))
            self%next = self%next + 1
         end do
      else
         h = part%by%interval()
         i = 0
         do
            tau = i*h
            if (tau >= part%duration) exit
            if (part%time + tau >= self%from) call record(self, part, part%time + (part%time_low + tau), tau)
            i = i + 1
         end do
         if (part%last) call record(self, part, part%time + (part%time_low + part%duration), part%duration)
      end if
   end subroutine piece

   subroutine record(self, part, time, tau)
      type(trajectory_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: time, tau

      integer :: i

      if (self%count == size(self%time)) call make_room(self, 2_i8*self%count + 64)
      self%count = self%count + 1
      self%time(self%count) = time
      do i = 1, size(self%form)
         self%value(i, self%count) = part%by%value(self%form(i), tau)
      end do
      if (self%coordinates == 0) return
      call part%by%state(tau, self%displacement(:, self%count), self%velocity(:, self%count))
   end subroutine record

   subroutine make_room(self, points)
      class(trajectory_t), intent(inout) :: self
      integer(i8), intent(in) :: points

      call resize(self%time, points)
      call resize(self%value, size(self%form), points)
      call resize(self%displacement, self%coordinates, points)
      call resize(self%velocity, self%coordinates, points)
   end subroutine make_room

   !> Hand over the motion of a machine: `/time`, the groups `/state` and `/observable`; of a strobe lists of `/strobe/<name>`.
   subroutine columns(self, table, machine)
      class(trajectory_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      character(*), parameter :: state(2) = [character(17) :: "/state/coordinate", "/state/time"]
      character(*), parameter :: observable = "/observable/time"
      integer :: i

      do i = 1, merge(size(self%form), 0, self%strobe)
         associate (n => self%count, seen => machine%observable(self%form(i)))
            call table%add("/strobe/"//seen%name//"/value", self%value(i, :n), seen%unit, seen%long_name, &
                           "/strobe/"//seen%name//"/row")
            call table%add("/strobe/"//seen%name//"/time", self%time(:n), "s", "time", "/strobe/"//seen%name//"/row")
         end associate
      end do
      if (self%strobe) return
      associate (n => self%count)
         ! Were /time a coordinate of the root, xarray would let it hide the times of events and extrema in the groups below.
         call table%add("/time", self%time(:n), "s", "time", "/sample")
         if (self%coordinates > 0) then
            call table%add(trim(state(1)), machine%coordinate, "1", "coordinate", trim(state(1)))
            call table%add(trim(state(2)), self%time(:n), "s", "time", trim(state(2)))
            call table%add("/state/displacement", self%displacement(:, :n), common_unit(machine%unit), "displacement", state)
            call table%note("names", machine%coordinate)
            call table%note("coordinate_units", machine%unit)
            call table%add("/state/velocity", self%velocity(:, :n), common_unit(machine%rate_unit), "velocity", state)
            call table%note("names", machine%coordinate)
            call table%note("coordinate_units", machine%rate_unit)
         end if
         if (size(self%form) > 0) call table%add(observable, self%time(:n), "s", "time", observable)
         do i = 1, size(self%form)
            associate (seen => machine%observable(self%form(i)))
               call table%add("/observable/"//seen%name, self%value(i, :n), seen%unit, seen%long_name, observable)
            end associate
         end do
      end associate
   end subroutine columns

end module razy_observe_trajectory
