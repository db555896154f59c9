!! One motion at each point of a sweep: extrema of the observables, status and counters.
!!
!! A driver extends this type with what makes a machine of a point. The propagator keeps modes from point to point as long as
!! only excitation, clearances or start differ; that changes no bit of a result.
module razy_sweep_motion_task
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_dynamics_extrema, only: extrema_t
   use razy_integrate_factory, only: new_integrator
   use razy_integrate_integrator, only: integrator_t, observer_slot_t, outcome_t, status_no_machine
   use razy_machine_method, only: method_t
   use razy_machine_machine, only: machine_t
   use razy_sweep_task, only: point_result_t, point_task
   implicit none(type, external)
   private

   public :: gathered_t, motion_task_t

   !> Extrema of one observable over the whole sweep, in the order in which points were collected.
   type :: gathered_t
      !> Extrema of point i: count(i) from start(i) + 1 on; kind of the first, they alternate.
      integer(i8), allocatable :: start(:), count(:)
      integer(int8), allocatable :: first_kind(:)
      integer(i8) :: used = 0
      real(wp), allocatable :: value(:), time(:)
   contains
      procedure :: in_grid_order
   end type gathered_t

   !> The task. `prepare_ranks` is called on every rank, `prepare_root` on rank 0 besides.
   type, abstract, extends(point_task) :: motion_task_t
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      type(machine_t) :: machine
      type(method_t) :: method
      class(integrator_t), allocatable :: integrator
      type(extrema_t), allocatable :: extrema(:)
      !> Collected on rank 0 (points).
      integer, allocatable :: status(:)
      integer(i8), allocatable :: events(:), steps(:)
      type(gathered_t), allocatable :: gathered(:)
   contains
      procedure(make_machine), deferred :: machine_at
      procedure :: run => run_point
      procedure :: collect => collect_point
      procedure :: prepare_root
   end type motion_task_t

   abstract interface
      !> Set `self%machine` and `self%method` to those of point number `point`.
      subroutine make_machine(self, point, error)
         import :: error_t, i8, motion_task_t
         implicit none(type, external)
         class(motion_task_t), intent(inout) :: self
         integer(i8), intent(in) :: point
         type(error_t), allocatable, intent(out) :: error
      end subroutine make_machine
   end interface

contains

   !> Make room for the results of all points.
   subroutine prepare_root(self, points)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: points

      integer :: i

      allocate (self%status(points), source=0)
      allocate (self%events(points), self%steps(points), source=0_i8)
      allocate (self%gathered(size(self%extrema)))
      do i = 1, size(self%gathered)
         associate (gathered => self%gathered(i))
            allocate (gathered%start(points), gathered%count(points), source=0_i8)
            allocate (gathered%first_kind(points), source=0_int8)
            allocate (gathered%value(1024), gathered%time(1024))
         end associate
      end do
   end subroutine prepare_root

   !> Compute one motion: status, events, steps, then count and first kind for each observable, and values and times.
   subroutine run_point(self, point, result)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result

      type(error_t), allocatable :: error
      type(outcome_t) :: outcome
      integer :: i

      do i = 1, size(self%extrema)
         call self%extrema(i)%reset()
      end do
      call self%machine_at(point, error)
      if (.not. allocated(error)) call new_integrator(self%integrator, self%method, error)
      if (.not. allocated(error)) call self%integrator%prepare(self%machine, .false., error)
      if (allocated(error)) then
         outcome%status = status_no_machine
      else
         call follow(self%integrator, self%extrema, self%t_end, self%most_events, outcome)
      end if
      call result%append([int(outcome%status, i8), outcome%events, outcome%steps])
      do i = 1, size(self%extrema)
         associate (extrema => self%extrema(i))
            call result%append(int(extrema%count, i8))
            call result%append(int(merge(extrema%kind(1), 0, extrema%count > 0), i8))
            call result%append(extrema%value(:extrema%count))
            call result%append(extrema%time(:extrema%count))
         end associate
      end do
   end subroutine run_point

   !> Run the integrator with all extrema as observers.
   subroutine follow(integrator, extrema, t_end, most_events, outcome)
      class(integrator_t), intent(inout) :: integrator
      type(extrema_t), intent(inout), target :: extrema(:)
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(outcome_t), intent(out) :: outcome

      type(observer_slot_t) :: slots(size(extrema))
      integer :: i

      do i = 1, size(extrema)
         slots(i)%observer => extrema(i)
      end do
      call integrator%run(t_end, most_events, slots, outcome)
   end subroutine follow

   !> Take over the result of a point.
   subroutine collect_point(self, point, result, error)
      class(motion_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(in) :: result
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: n, place
      integer :: i

      if (result%n_integers /= 3 + 2*size(self%gathered)) then
         call raise(error, "a point has sent a result of another sweep")
         return
      end if
      self%status(point) = int(result%integers(1))
      self%events(point) = result%integers(2)
      self%steps(point) = result%integers(3)
      place = 0
      do i = 1, size(self%gathered)
         associate (gathered => self%gathered(i))
            n = result%integers(2 + 2*i)
            call make_room(gathered%value, gathered%used, n)
            call make_room(gathered%time, gathered%used, n)
            gathered%start(point) = gathered%used
            gathered%count(point) = n
            gathered%first_kind(point) = int(result%integers(3 + 2*i), int8)
            gathered%value(gathered%used + 1:gathered%used + n) = result%reals(place + 1:place + n)
            gathered%time(gathered%used + 1:gathered%used + n) = result%reals(place + n + 1:place + 2*n)
            gathered%used = gathered%used + n
            place = place + 2*n
         end associate
      end do
   end subroutine collect_point

   !> Let the array hold `more` numbers behind the first `used`.
   pure subroutine make_room(array, used, more)
      real(wp), allocatable, intent(inout) :: array(:)
      integer(i8), intent(in) :: used, more

      real(wp), allocatable :: longer(:)

      if (used + more <= size(array, kind=i8)) return
      allocate (longer(max(used + more, used + used/2)))
      longer(:used) = array(:used)
      call move_alloc(longer, array)
   end subroutine make_room

   !> Hand over offset (points + 1), value, time and kind in the order of the grid; the gathered arrays are gone after that.
   subroutine in_grid_order(self, offset, value, time, kind)
      class(gathered_t), intent(inout) :: self
      integer(i8), allocatable, intent(out) :: offset(:)
      real(wp), allocatable, intent(out) :: value(:), time(:)
      integer(int8), allocatable, intent(out) :: kind(:)

      integer(i8) :: i, k, points

      points = size(self%count, kind=i8)
      allocate (offset(points + 1))
      offset(1) = 0
      do i = 1, points
         offset(i + 1) = offset(i) + self%count(i)
      end do
      allocate (kind(self%used))
      do i = 1, points
         do k = 1, self%count(i)
            kind(offset(i) + k) = merge(self%first_kind(i), -self%first_kind(i), modulo(k, 2_i8) == 1)
         end do
      end do
      call sorted(self%value, value)
      call sorted(self%time, time)

   contains

      subroutine sorted(array, ordered)
         real(wp), allocatable, intent(inout) :: array(:)
         real(wp), allocatable, intent(out) :: ordered(:)

         allocate (ordered(self%used))
         do i = 1, points
            ordered(offset(i) + 1:offset(i + 1)) = array(self%start(i) + 1:self%start(i) + self%count(i))
         end do
         deallocate (array)
      end subroutine sorted

   end subroutine in_grid_order

end module razy_sweep_motion_task
