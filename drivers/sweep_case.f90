!! A sweep as the input describes it: its axes, its directions, its task.
module sweep_case
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: lower
   use razy_scenes_scene, only: scene_t
   use razy_scenes_records, only: contacts_asked, record_t
   use razy_scenes_start, only: check_start
   use razy_scenes_case, only: motion_t, new_machine
   use razy_sweep_grid, only: grid_t
   use razy_study_motion_task, only: motion_task_t
   use razy_sweep_plan, only: new_plan
   use sweep_axes, only: new_axes, put_point, put_value, varied_t
   use sweep_starts, only: new_starts, starts_t
   implicit none(type, external)
   private

   public :: check_points, new_sweep, sweep_task_t

   !> The task of a sweep over one or two values of an input.
   type, extends(motion_task_t) :: sweep_task_t
      type(input_t) :: input
      type(varied_t), allocatable :: varied(:)
      type(grid_t) :: grid
      type(starts_t) :: starts
      class(scene_t), allocatable :: scene
      character(:), allocatable :: title
   contains
      procedure :: machine_at
   end type sweep_task_t

contains

   !> Make the task of an input, on every rank; `starts` is what `read_start_file` found.
   subroutine new_sweep(self, input, starts, error)
      type(sweep_task_t), intent(out) :: self
      type(input_t), intent(in) :: input
      real(wp), intent(in) :: starts(:)
      type(error_t), allocatable, intent(out) :: error

      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)

      self%input = input
      call new_axes(self%varied, self%grid, input, error)
      if (allocated(error)) return
      call new_machine(self%machine, motion, records, self%input, error, self%scene)
      if (.not. allocated(error)) call new_starts(self%starts, self%machine, input, error, starts)
      if (allocated(error)) return
      if (self%starts%wanted) self%watch%strobe_periods = 2*self%starts%longest_period
      call plan_points(self, input)
      if (.not. allocated(error)) call check_points(self, error)
      if (allocated(error)) return
      if (.not. any(records%extrema .or. records%statistics)) then
         call input%complain(error, "record", 1, "what", "'extrema' or 'statistics' of at least one observable, for a sweep")
         return
      end if
      call input%get("sweep", 1, "kind_of_motion", self%watch%asks_kind)
      call input%get("sweep", 1, "period_tolerance", self%watch%periodicity%tolerance)
      self%title = self%machine%title
      self%method = motion%method
      allocate (self%watch%extrema(count(records%extrema)))
      call ask(self, motion, records)
   end subroutine new_sweep

   !> All points, alone or as chains.
   subroutine plan_points(self, input)
      class(sweep_task_t), intent(inout) :: self
      type(input_t), intent(in) :: input

      character(:), allocatable :: direction
      logical :: whole
      integer(i8) :: first, second

      first = self%grid%axes(1)%n_values()
      second = self%grid%n_points()/first
      call input%get("sweep", 1, "direction", direction)
      select case (lower(direction))
      case ("up")
         call new_plan(self%plan, first, second, [1], self%starts%count)
      case ("down")
         call new_plan(self%plan, first, second, [-1], self%starts%count)
      case ("both")
         call new_plan(self%plan, first, second, [1, -1], self%starts%count)
      case default
         call new_plan(self%plan, first, second, [integer ::], self%starts%count)
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
         self%watch%extrema(k)%form = records(i)%observable
         self%watch%extrema(k)%from = records(i)%from
      end do
      self%watch%contacts = contacts_asked(records, size(self%machine%contact))
      if (size(self%watch%contacts) > 0) self%watch%statistics%from = records(findloc(records%statistics, .true., dim=1))%from
      self%watch%periodicity%from = minval(records%from, mask=records%extrema .or. records%statistics)
   end subroutine ask

   !> Refuse a sweep whose ends are out of the key's range or no machine; what fails between them becomes a status.
   subroutine check_points(self, error)
      type(sweep_task_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(motion_t) :: motion
      type(record_t), allocatable :: records(:)
      integer :: i, k

      do k = 2**size(self%varied) - 1, 0, -1
         do i = 1, size(self%varied)
            associate (axis => self%grid%axes(i), at_first => btest(k, i - 1))
               call put_value(self%varied(i), self%input, axis%value(merge(1_i8, axis%n_values(), at_first)), problem)
               if (allocated(problem)) call self%input%complain(error, "sweep", i, trim(merge("first", "last ", at_first)), &
                                                                problem%message)
            end associate
            if (allocated(error)) return
         end do
         call new_machine(self%machine, motion, records, self%input, error, self%scene)
         if (self%starts%wanted .and. .not. allocated(error)) then
            call self%starts%strobe_period(self%machine, motion%t_end, self%input, self%watch%strobe_period, error)
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

      call put_point(self%varied, self%grid, self%input, self%plan%grid_point(point), error)
      if (allocated(error)) return
      call new_machine(self%machine, motion, records, self%input, error, self%scene)
      if (allocated(error)) return
      call ask(self, motion, records)
      if (.not. self%starts%wanted) return
      call self%starts%apply(self%machine, self%plan%grid_point(point), self%plan%start_of(point))
      call check_start(self%machine, self%input, error)
      if (allocated(error)) return
      call self%starts%strobe_period(self%machine, self%t_end, self%input, self%watch%strobe_period, error)
   end subroutine machine_at

end module sweep_case
