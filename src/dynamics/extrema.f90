!! Maxima and minima of an observable from a given time on, to rounding.
!!
!! Within a piece they are the roots of the observable's rate, found with the proof of razy_integrate_search that none is
!! missed. Across events the direction of the motion is carried along: where a force kink or a jump turns it, the event
!! itself is the extremum. A jump counts as a motion in no time; a plateau is an extremum at its beginning if the motion
!! goes on in the opposite direction.
module razy_dynamics_extrema
   use razy_core_kinds, only: wp
   use razy_integrate_cursor, only: copy, cursor_t, move_to, reserve
   use razy_integrate_forms, only: size_of, value_of
   use razy_integrate_observer, only: observer_t, piece_t
   use razy_integrate_refine, only: watched_t
   use razy_integrate_search, only: exit_t, first_exit, rounding, search_t
   implicit none(type, external)
   private

   public :: extrema_t

   !> Records the extrema of observable number `form`.
   type, extends(observer_t) :: extrema_t
      integer :: form = 1
      !> Start of recording, s.
      real(wp) :: from = 0.0_wp
      !> Extrema found (count): value, time in s, +1 for a maximum and -1 for a minimum.
      integer :: count = 0
      real(wp), allocatable :: value(:), time(:)
      integer, allocatable :: kind(:)
      !> Direction of the motion so far (0: none yet), and value and time where it ended.
      integer, private :: direction = 0
      real(wp), private :: end_value = 0.0_wp, end_time = 0.0_wp
      logical, private :: begun = .false., after_event = .false.
      !> Size of the terms that the observable is the sum of, at the start of the last piece.
      real(wp), private :: size = 0.0_wp
      type(search_t), private :: search
      type(cursor_t), private :: cursor
   contains
      procedure :: reset
      procedure :: piece
      procedure, private :: record
      procedure, private :: turn
   end type extrema_t

   !> A smaller difference across an event, relative likewise, is the rounding of two evaluations and no jump.
   real(wp), parameter :: smallest_jump = 1.0e-11_wp

contains

   !> Forget everything of an earlier run.
   subroutine reset(self)
      class(extrema_t), intent(inout) :: self

      self%count = 0
      self%direction = 0
      self%begun = .false.
      self%after_event = .false.
      if (.not. allocated(self%value)) allocate (self%value(64), self%time(64), self%kind(64))
   end subroutine reset

   !> Take up the extrema of a piece, as far as it lies in the time of recording.
   subroutine piece(self, part)
      class(extrema_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      type(exit_t) :: found
      type(watched_t) :: rate(1)
      real(wp) :: tau
      logical :: flat

      tau = max((self%from - part%time) - part%time_low, 0.0_wp)
      if (tau > part%duration) return
      associate (state => part%state)
         call reserve(self%cursor, state%response)
         if (tau > 0.0_wp) then
            call move_to(part%start, state%response, tau, self%cursor)
         else
            call copy(part%start, state%response, self%cursor)
         end if
         call begin_piece(self, part, flat)
         if (flat) return
         rate(1) = watched_t(form=self%form, order=1, side=real(self%direction, wp))
         self%search%level = state%level
         do while (tau < part%duration)
            call first_exit(self%search, state%response, state%observed, part%start, tau, part%duration, rate, found)
            if (found%watched == 0) exit
            tau = found%tau
            call self%record(part%time + (part%time_low + tau), &
                             value_of(state%observed, state%response, self%search%probe, self%form, 0), self%direction)
            self%direction = -self%direction
            rate(1)%side = -rate(1)%side
            rate(1)%from_zero = .true.
         end do
         self%end_value = value_of(state%observed, state%response, part%finish, self%form, 0)
         self%end_time = part%time + (part%time_low + part%duration)
      end associate
   end subroutine piece

   !> See whether the motion jumps or turns where a piece begins, and take its direction; `flat`: it does not move at all.
   subroutine begin_piece(self, part, flat)
      class(extrema_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      logical, intent(out) :: flat

      real(wp) :: before, f, jump, rate
      real(wp) :: modulus(part%state%response%amplitudes)
      integer :: order, direction

      associate (rows => part%state%observed, response => part%state%response)
         modulus = sqrt(self%cursor%re(:response%amplitudes)**2 + self%cursor%im(:response%amplitudes)**2)
         f = value_of(rows, response, self%cursor, self%form, 0)
         jump = f - self%end_value
         before = self%size
         self%size = size_of(rows, response, self%cursor, modulus, self%form, 0)
         if (self%after_event .and. abs(jump) > smallest_jump*max(before, self%size)) then
            call self%turn(nint(sign(1.0_wp, jump)))
            self%end_value = f
            self%end_time = part%time + (part%time_low + self%cursor%tau)
         end if
         direction = 0
         do order = 1, 4
            rate = value_of(rows, response, self%cursor, self%form, order)
            if (abs(rate) > rounding*size_of(rows, response, self%cursor, modulus, self%form, order)) then
               direction = nint(sign(1.0_wp, rate))
               exit
            end if
         end do
      end associate
      self%after_event = part%contact /= 0
      flat = direction == 0
      if (.not. self%begun .and. flat) then
         self%end_value = f
         self%end_time = part%time + (part%time_low + self%cursor%tau)
      end if
      self%begun = .true.
      call self%turn(direction)
   end subroutine begin_piece

   !> Go on in a direction; a reversal makes the last value an extremum.
   subroutine turn(self, direction)
      class(extrema_t), intent(inout) :: self
      integer, intent(in) :: direction

      if (direction == 0) return
      if (self%direction == -direction) call self%record(self%end_time, self%end_value, self%direction)
      self%direction = direction
   end subroutine turn

   subroutine record(self, time, value, kind)
      class(extrema_t), intent(inout) :: self
      real(wp), intent(in) :: time, value
      integer, intent(in) :: kind

      integer :: n

      n = size(self%value)
      if (self%count == n) then
         self%value = [self%value, spread(0.0_wp, 1, n)]
         self%time = [self%time, spread(0.0_wp, 1, n)]
         self%kind = [self%kind, spread(0, 1, n)]
      end if
      self%count = self%count + 1
      self%value(self%count) = value
      self%time(self%count) = time
      self%kind(self%count) = kind
   end subroutine record

end module razy_dynamics_extrema
