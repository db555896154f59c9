!! Maxima and minima of an observable from a given time on, to rounding.
!!
!! Within a piece they are the roots of the observable's rate, found by the integrator (`exact` proves that none is
!! missed). Across events the direction of the motion is carried along: where a force kink or a jump turns it, the event
!! itself is the extremum. A jump counts as a motion in no time; a plateau is an extremum at its beginning if the motion
!! goes on in the opposite direction.
module razy_observe_extrema
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_kinds, only: i8, wp
   use razy_core_resize, only: resize
   use razy_core_table, only: table_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: glimpse_t, observer_t, piece_t
   use razy_observe_cycle, only: cycle_time
   implicit none(type, external)
   private

   public :: extrema_t

   !> Records the extrema of observable number `form`.
   type, extends(observer_t) :: extrema_t
      integer :: form = 1
      !> How nearly maxima are to repeat themselves, if the time of that is asked for.
      real(wp), allocatable :: cycle_tolerance
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
   contains
      procedure :: forget
      procedure :: piece
      procedure :: columns
   end type extrema_t

   !> A smaller difference across an event, relative likewise, is the rounding of two evaluations and no jump.
   real(wp), parameter :: smallest_jump = 1.0e-11_wp

contains

   subroutine forget(self)
      class(extrema_t), intent(inout) :: self

      self%count = 0
      self%direction = 0
      self%begun = .false.
      self%after_event = .false.
      if (.not. allocated(self%value)) allocate (self%value(64), self%time(64), self%kind(64))
   end subroutine forget

   !> Take up the extrema of a piece, as far as it lies in the time of recording.
   subroutine piece(self, part)
      class(extrema_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau, tau_found, value
      logical :: flat, found, turned

      tau = max((self%from - part%time) - part%time_low, 0.0_wp)
      if (tau > part%duration) return
      if (.not. part%duration > 0.0_wp) then
         ! What has jumped is seen where the next piece starts.
         self%after_event = self%begun .and. (self%after_event .or. part%contact /= 0)
         return
      end if
      call begin_piece(self, part, tau, flat)
      if (flat) return
      turned = .false.
      do while (tau < part%duration)
         call part%by%next_turn(self%form, tau, part%duration, self%direction, turned, found, tau_found, value)
         if (.not. found) exit
         tau = tau_found
         call record(self, part%time + (part%time_low + tau), value, self%direction)
         self%direction = -self%direction
         turned = .true.
      end do
      self%end_value = part%by%value(self%form, part%duration)
      self%end_time = part%time + (part%time_low + part%duration)
   end subroutine piece

   !> See whether the motion jumps or turns where recording of a piece begins, at `tau`, and take its direction; `flat`: it
   !> does not move at all.
   subroutine begin_piece(self, part, tau, flat)
      class(extrema_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau
      logical, intent(out) :: flat

      type(glimpse_t) :: seen
      real(wp) :: before, jump
      logical :: jumped

      call part%by%glimpse(self%form, tau, seen)
      jump = seen%value - self%end_value
      before = self%size
      self%size = seen%size
      jumped = self%after_event .and. abs(jump) > smallest_jump*max(before, self%size)
      if (jumped) call turn(self, nint(sign(1.0_wp, jump)))
      self%after_event = part%contact /= 0
      flat = seen%direction == 0
      ! A plateau has its own value: what is left of the way to it is rounding, and no jump at its end.
      if (jumped .or. flat) self%end_value = seen%value
      if (jumped .or. (flat .and. .not. self%begun)) self%end_time = part%time + (part%time_low + tau)
      self%begun = .true.
      call turn(self, seen%direction)
   end subroutine begin_piece

   !> Go on in a direction; a reversal makes the last value an extremum.
   subroutine turn(self, direction)
      type(extrema_t), intent(inout) :: self
      integer, intent(in) :: direction

      if (direction == 0) return
      if (self%direction == -direction) call record(self, self%end_time, self%end_value, self%direction)
      self%direction = direction
   end subroutine turn

   subroutine record(self, time, value, kind)
      type(extrema_t), intent(inout) :: self
      real(wp), intent(in) :: time, value
      integer, intent(in) :: kind

      if (self%count == size(self%value)) then
         call resize(self%value, 2_i8*self%count)
         call resize(self%time, 2_i8*self%count)
         call resize(self%kind, 2_i8*self%count)
      end if
      self%count = self%count + 1
      self%value(self%count) = value
      self%time(self%count) = time
      self%kind(self%count) = kind
   end subroutine record

   !> Hand over the extrema, as lists of `/extrema/<name>`, and the time in which they repeat themselves.
   subroutine columns(self, table, machine)
      class(extrema_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      character(:), allocatable :: along, group
      integer(int8), allocatable :: kind(:)

      group = "/extrema/"//machine%observable(self%form)%name//"/"
      along = group//"extremum"
      associate (n => self%count, seen => machine%observable(self%form))
         call table%add(group//"value", self%value(:n), seen%unit, "extrema of "//seen%long_name, along)
         call table%add(group//"time", self%time(:n), "s", "time of the extremum", along)
         ! Not as an expression, whose value would stand on the stack.
         allocate (kind(n))
         kind(:) = int(self%kind(:n), int8)
         call table%add(group//"kind", kind, "1", "kind of extremum", along)
         call table%note_meanings([1, -1], ["maximum", "minimum"])
         if (.not. allocated(self%cycle_tolerance)) return
         call table%add("/point/cycle_time", cycle_time(self%value(:n), self%time(:n), self%kind(:n), self%cycle_tolerance), "s", &
                        "time in which "//seen%long_name//" repeats itself")
      end associate
   end subroutine columns

end module razy_observe_extrema
