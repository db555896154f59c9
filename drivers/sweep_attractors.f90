!! On which attractors the motions of a sweep end: the rule of razy_study_attractors, for each grid point and direction.
!!
!! Results are read from the checkpoint, one grid point after the other, starts in their order.
module sweep_attractors
   use, intrinsic :: iso_fortran_env, only: int32
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_study_attractors, only: attractors_t
   use razy_io_starts, only: starts_content_t
   use razy_study_motion_watch, only: motion_result_t
   use razy_sweep_task, only: point_result_t
   use sweep_case, only: sweep_task_t
   implicit none(type, external)
   private

   public :: find_attractors

   !> A row that is being counted.
   type :: row_t
      integer(i8) :: starts = 0, point = 0
      real(wp), allocatable :: state(:)
   end type row_t

contains

   !> Fill `content`; not allocated without &starts.
   subroutine find_attractors(task, content, error)
      class(sweep_task_t), intent(inout) :: task
      type(starts_content_t), allocatable, intent(out) :: content
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: block, cell, cells, grid

      if (.not. task%starts%wanted) return
      allocate (content)
      call describe(task, content)
      grid = task%plan%first_axis*task%plan%second_axis
      cells = task%plan%points/task%plan%starts
      content%offset = [0_i8]
      do cell = 1, cells
         block = (cell - 1)/grid
         call one_cell(task, content, block*grid*task%plan%starts + 1 + modulo(cell - 1, grid), grid, error)
         if (allocated(error)) return
         content%offset = [content%offset, size(content%number, kind=i8)]
      end do
   end subroutine find_attractors

   !> The starts of each point, and no attractors yet.
   subroutine describe(task, content)
      class(sweep_task_t), intent(in) :: task
      type(starts_content_t), intent(inout) :: content

      integer(i8) :: point
      integer :: i, n

      n = size(task%machine%mass, 1)
      content%count = task%plan%starts
      allocate (content%start(task%plan%points), content%attractor(task%plan%points))
      allocate (content%quantities(size(task%starts%range)))
      do i = 1, size(content%quantities)
         content%quantities(i)%name = task%starts%range(i)%name
         content%quantities(i)%units = task%starts%range(i)%unit
         allocate (content%quantities(i)%value(task%plan%points))
      end do
      do point = 1, task%plan%points
         content%start(point) = int(task%plan%start_of(point), int32)
         do i = 1, size(content%quantities)
            content%quantities(i)%value(point) = task%starts%value(i, task%plan%grid_point(point), task%plan%start_of(point))
         end do
      end do
      allocate (content%number(0), content%period(0), content%starts(0), content%point(0), content%fraction(0), &
                content%strobe_period(0), content%displacement(n, 0), content%velocity(n, 0))
      content%coordinate = task%machine%coordinate
      content%unit = task%machine%unit
      content%rate_unit = task%machine%rate_unit
   end subroutine describe

   !> The attractors of the points first, first + grid, …, one for each start.
   subroutine one_cell(task, content, first, grid, error)
      class(sweep_task_t), intent(inout) :: task
      type(starts_content_t), intent(inout) :: content
      integer(i8), intent(in) :: first, grid
      type(error_t), allocatable, intent(out) :: error

      type(attractors_t) :: attractors
      type(row_t), allocatable :: rows(:)
      type(point_result_t) :: result
      type(motion_result_t) :: motion
      real(wp), allocatable :: states(:, :)
      integer(i8) :: point, start
      integer :: n, number

      call scale_of_cell(task, first, grid, attractors%scale, error)
      if (allocated(error)) return
      content%attractor(first:first + grid*(task%plan%starts - 1):grid) = -1
      if (attractors%scale < 0.0_wp) return
      call task%machine_at(first, error)
      if (allocated(error)) return
      n = size(task%machine%mass, 1)
      call attractors%begin(task%machine%mass, task%watch%strobe_period, task%starts%tolerance, attractors%scale)
      allocate (rows(0:16))
      do start = 1, task%plan%starts
         point = first + grid*(start - 1)
         call task%result_at(point, result, motion, error)
         if (allocated(error)) return
         if (motion%strobe_count == 0) cycle
         states = reshape(result%reals(motion%strobe_place + 1:motion%strobe_place + motion%strobe_count - 1), &
                          [2*n, task%watch%strobe_periods + 1])
         call attractors%number_of(states, number)
         content%attractor(point) = number
         call make_room(rows, number)
         rows(number)%starts = rows(number)%starts + 1
         if (rows(number)%starts > 1) cycle
         rows(number)%point = point - 1
         rows(number)%state = states(:, size(states, 2))
      end do
      do number = 1, attractors%count
         call append_row(content, rows(number), number, attractors%found(number)%period, task%watch%strobe_period)
      end do
      if (rows(0)%starts > 0) call append_row(content, rows(0), 0, 0, task%watch%strobe_period)
      associate (begun => content%offset(size(content%offset)))
         content%fraction(begun + 1:) = real(content%starts(begun + 1:), wp)/real(sum(content%starts(begun + 1:)), wp)
      end associate
   end subroutine one_cell

   !> The largest norm of all states of a grid point; -1 if all its motions failed.
   subroutine scale_of_cell(task, first, grid, scale, error)
      class(sweep_task_t), intent(inout) :: task
      integer(i8), intent(in) :: first, grid
      real(wp), intent(out) :: scale
      type(error_t), allocatable, intent(out) :: error

      type(point_result_t) :: result
      type(motion_result_t) :: motion
      integer(i8) :: start

      scale = -1.0_wp
      do start = 1, task%plan%starts
         call task%result_at(first + grid*(start - 1), result, motion, error)
         if (allocated(error)) return
         if (motion%strobe_count > 0) scale = max(scale, result%reals(motion%strobe_place))
      end do
   end subroutine scale_of_cell

   !> Let the rows (0:) have a number.
   subroutine make_room(rows, number)
      type(row_t), allocatable, intent(inout) :: rows(:)
      integer, intent(in) :: number

      type(row_t), allocatable :: more(:)

      if (number <= ubound(rows, 1)) return
      allocate (more(0:2*number))
      more(:ubound(rows, 1)) = rows
      call move_alloc(more, rows)
   end subroutine make_room

   subroutine append_row(content, row, number, period, strobe_period)
      type(starts_content_t), intent(inout) :: content
      type(row_t), intent(in) :: row
      integer, intent(in) :: number, period
      real(wp), intent(in) :: strobe_period

      integer :: n, rows

      n = size(row%state)/2
      rows = size(content%number)
      content%number = [content%number, int(number, int32)]
      content%period = [content%period, int(period, int32)]
      content%starts = [content%starts, row%starts]
      content%point = [content%point, row%point]
      content%fraction = [content%fraction, 0.0_wp]
      content%strobe_period = [content%strobe_period, strobe_period]
      content%displacement = reshape([content%displacement, row%state(:n)], [n, rows + 1])
      content%velocity = reshape([content%velocity, row%state(n + 1:)], [n, rows + 1])
   end subroutine append_row

end module sweep_attractors
