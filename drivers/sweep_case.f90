!! A sweep as the input describes it: its axis, its directions, its task.
module sweep_case
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: i8, wp
   use razy_core_slot, only: slot_t
   use razy_core_text, only: lower
   use razy_scenes_study, only: contacts_asked, motion_t, new_machine, record_t
   use razy_sweep_grid, only: axis_t, new_axis
   use razy_sweep_motion_task, only: motion_task_t
   use razy_sweep_plan, only: new_plan
   implicit none(type, external)
   private

   public :: check_points, new_sweep, sweep_task_t

   !> The task of a sweep over one value of an input.
   type, extends(motion_task_t) :: sweep_task_t
      type(input_t) :: input
      type(slot_t) :: slot
      type(axis_t) :: axis
      character(:), allocatable :: title, unit
   contains
      procedure :: machine_at
   end type sweep_task_t

contains

   !> Make the task of an input, on every rank.
   subroutine new_sweep(self, input, error)
      type(sweep_task_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)

      self%input = input
      if (input%count("sweep") == 0) then
         call input%complain(error, "sweep", 1, "parameter", "required: the group%key that razy-sweep varies")
         return
      end if
      call self%input%locate_value("sweep", 1, "parameter", self%slot, error)
      if (allocated(error)) return
      if (index(self%slot%path, "sweep%") == 1) then
         call input%complain(error, "sweep", 1, "parameter", "a value of another group than &sweep")
         return
      end if
      self%unit = self%input%unit_of(self%slot)
      call read_axis(self%axis, input, error)
      if (allocated(error)) return
      call plan_points(self, input)
      call new_machine(self%machine, motion, records, self%input, error)
      if (.not. allocated(error)) call check_points(self, error)
      if (allocated(error)) return
      if (.not. any(records%extrema .or. records%statistics)) then
         call input%complain(error, "record", 1, "what", "'extrema' or 'statistics' of at least one observable, for a sweep")
         return
      end if
      call input%get("sweep", 1, "kind_of_motion", self%asks_kind)
      call input%get("sweep", 1, "period_tolerance", self%periodicity%tolerance)
      self%title = self%machine%title
      self%method = motion%method
      allocate (self%extrema(count(records%extrema)))
      call ask(self, motion, records)
   end subroutine new_sweep

   !> All points, alone or as chains.
   subroutine plan_points(self, input)
      class(sweep_task_t), intent(inout) :: self
      type(input_t), intent(in) :: input

      character(:), allocatable :: direction
      logical :: whole

      call input%get("sweep", 1, "direction", direction)
      select case (lower(direction))
      case ("up")
         call new_plan(self%plan, self%axis%n_values(), 1_i8, [1])
      case ("down")
         call new_plan(self%plan, self%axis%n_values(), 1_i8, [-1])
      case ("both")
         call new_plan(self%plan, self%axis%n_values(), 1_i8, [1, -1])
      case default
         call new_plan(self%plan, self%axis%n_values(), 1_i8, [integer ::])
      end select
      call self%plan%close(whole)
   end subroutine plan_points

   !> Take over what is asked of a motion.
   subroutine ask(self, motion, records)
      class(sweep_task_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      type(record_t), intent(in) :: records(:)

      integer :: i, k

      self%t_end = motion%t_end
      self%method = motion%method
      self%most_events = motion%most_events
      k = 0
      do i = 1, size(records)
         if (.not. records(i)%extrema) cycle
         k = k + 1
         self%extrema(k)%form = records(i)%observable
         self%extrema(k)%from = records(i)%from
      end do
      self%contacts = contacts_asked(records, size(self%machine%contact))
      if (size(self%contacts) > 0) self%statistics%from = records(findloc(records%statistics, .true., dim=1))%from
      self%periodicity%from = minval(records%from, mask=records%extrema .or. records%statistics)
   end subroutine ask

   !> The values of the axis, from first, last, and step or points.
   subroutine read_axis(axis, input, error)
      type(axis_t), intent(out) :: axis
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      real(wp) :: first, last, step
      integer :: points

      call input%get("sweep", 1, "first", first)
      call input%get("sweep", 1, "last", last)
      step = 0.0_wp
      if (input%given("sweep", 1, "step")) call input%get("sweep", 1, "step", step)
      if (abs(step) > 0.0_wp .eqv. input%given("sweep", 1, "points")) then
         call input%complain(error, "sweep", 1, "step", "one of step and points has to be given")
         return
      end if
      if (abs(step) > 0.0_wp) then
         call new_axis(axis, first, last, step, problem)
         if (allocated(problem)) call input%complain(error, "sweep", 1, "step", after_colon(problem%message))
      else
         call input%get("sweep", 1, "points", points)
         call new_axis(axis, first, last, points, problem)
         if (allocated(problem)) call input%complain(error, "sweep", 1, "points", after_colon(problem%message))
      end if
   end subroutine read_axis

   !> A message without the key and value that it begins with, which `complain` says already.
   pure function after_colon(message) result(rest)
      character(*), intent(in) :: message
      character(:), allocatable :: rest

      rest = message(index(message, ": ") + merge(2, 1, index(message, ": ") > 0):)
   end function after_colon

   !> Refuse a sweep whose ends are out of the key's range or no machine; what fails between them becomes a status.
   subroutine check_points(self, error)
      type(sweep_task_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)
      integer :: k

      do k = 1, 2
         call self%input%put(self%slot, self%axis%value(merge(1_i8, self%axis%n_values(), k == 1)), problem)
         if (allocated(problem)) then
            call self%input%complain(error, "sweep", 1, trim(merge("first", "last ", k == 1)), problem%message)
         else
            call new_machine(self%machine, motion, records, self%input, error)
         end if
         if (allocated(error)) return
      end do
   end subroutine check_points

   subroutine machine_at(self, point, error)
      class(sweep_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(error_t), allocatable, intent(out) :: error

      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)

      call self%input%put(self%slot, self%axis%value(self%plan%grid_point(point)), error)
      if (allocated(error)) return
      call new_machine(self%machine, motion, records, self%input, error)
      if (.not. allocated(error)) call ask(self, motion, records)
   end subroutine machine_at

end module sweep_case
