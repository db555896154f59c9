!! The starts of a sweep and the attractors on which its motions end: the rule of razy_study_sweep_attractors, for each grid point
!! and direction.
!!
!! Rows are read from the checkpoint, one grid point after the other, starts in their order.
module razy_study_sweep_basins
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: common_unit, table_t
   use razy_machine_drift, only: drift_basis
   use razy_study_sweep_attractors, only: attractors_t
   use razy_study_sweep_task, only: sweep_task_t
   use razy_sweep_checkpoint, only: checkpoint_t
   implicit none(type, external)
   private

   public :: basin_columns

   !> An attractor of a grid point, or its motions that are not periodic (number and period 0).
   type :: row_t
      integer :: number = 0, period = 0
      !> Starts that lead there, and the first point that does, from 0.
      integer(i8) :: starts = 0, point = 0
      real(wp) :: fraction = 0.0_wp, strobe_period = 0.0_wp
      !> State at the end of the motion of that point.
      real(wp), allocatable :: state(:)
   end type row_t

contains

   !> Find the attractors, and add the columns of starts and attractors; none without &starts.
   subroutine basin_columns(task, checkpoint, table, error)
      class(sweep_task_t), intent(inout) :: task
      type(checkpoint_t), intent(inout) :: checkpoint
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(out) :: error

      type(row_t), allocatable :: rows(:)
      type(table_t) :: row
      integer, allocatable :: attractor(:)
      integer(i8), allocatable :: offset(:)
      integer(i8) :: block, cell, cells, grid
      integer :: n

      if (.not. task%starts%wanted) return
      call start_columns(task, table)
      grid = task%plan%first_axis*task%plan%second_axis
      cells = task%plan%points/task%plan%starts
      allocate (attractor(task%plan%points), source=-1)
      allocate (offset(cells + 1), source=0_i8)
      allocate (rows(64))
      n = 0
      row = checkpoint%row
      do cell = 1, cells
         block = (cell - 1)/grid
         call one_cell(task, checkpoint, row, block*grid*task%plan%starts + 1 + modulo(cell - 1, grid), grid, rows, n, &
                       attractor, error)
         if (allocated(error)) return
         offset(cell + 1) = n
      end do
      call table%add("/point/attractor", attractor, "1", "attractor on which the motion ends", "/point/point")
      call table%note("meanings", "1, 2, ... = attractor, 0 = none found, -1 = failed")
      call attractor_columns(task, table, rows(:n), offset)
   end subroutine basin_columns

   !> The start of each point.
   subroutine start_columns(task, table)
      class(sweep_task_t), intent(in) :: task
      type(table_t), intent(inout) :: table

      integer(i8) :: p
      integer :: i

      associate (plan => task%plan, starts => task%starts)
         call table%add("/point/start", [(int(plan%start_of(p)), p=1, plan%points)], "1", "number of the start, from 1", &
                        "/point/point")
         do i = 1, size(starts%range)
            associate (range => starts%range(i))
               call table%add("/point/start."//range%name, &
                              [(starts%value(i, plan%grid_point(p), plan%start_of(p)), p=1, plan%points)], range%unit, &
                              range%name//" at the start", "/point/point")
            end associate
         end do
      end associate
   end subroutine start_columns

   subroutine attractor_columns(task, table, rows, offset)
      class(sweep_task_t), intent(in) :: task
      type(table_t), intent(inout) :: table
      type(row_t), intent(in) :: rows(:)
      integer(i8), intent(in) :: offset(:)

      character(*), parameter :: row = "/attractor/row", coordinate = "/attractor/coordinate"
      real(wp), allocatable :: displacement(:, :), velocity(:, :)
      integer :: i, n

      n = size(task%machine%mass, 1)
      allocate (displacement(n, size(rows)), velocity(n, size(rows)))
      do i = 1, size(rows)
         displacement(:, i) = rows(i)%state(:n)
         velocity(:, i) = rows(i)%state(n + 1:)
      end do
      call table%add("/attractor/offset", offset, "1", "attractors of grid point i, from 0, are offset[i]:offset[i+1]", &
                     "/attractor/boundary")
      call table%add("/attractor/number", rows%number, "1", "number at its point, 0: not periodic", row)
      call table%add("/attractor/period", rows%period, "1", "period in periods of the excitation", row)
      call table%add("/attractor/starts", rows%starts, "1", "starts that lead there", row)
      call table%add("/attractor/point", rows%point, "1", "first point that leads there, from 0", row)
      call table%add("/attractor/fraction", rows%fraction, "1", "basin fraction", row)
      call table%add("/attractor/strobe_period", rows%strobe_period, "s", "period of the excitation", row)
      associate (machine => task%machine, along => [character(len(coordinate)) :: coordinate, row])
         call table%add(coordinate, machine%coordinate, "1", "coordinate", coordinate)
         call table%add("/attractor/displacement", displacement, common_unit(machine%unit), "displacement", along)
         call table%note("coordinate_units", machine%unit)
         call table%add("/attractor/velocity", velocity, common_unit(machine%rate_unit), "velocity", along)
         call table%note("coordinate_units", machine%rate_unit)
      end associate
   end subroutine attractor_columns

   !> Append to rows(:n) the attractors of the points first, first + grid, …, one for each start.
   subroutine one_cell(task, checkpoint, row, first, grid, rows, n, attractor, error)
      class(sweep_task_t), intent(inout) :: task
      type(checkpoint_t), intent(inout) :: checkpoint
      type(table_t), intent(inout) :: row
      integer(i8), intent(in) :: first, grid
      type(row_t), allocatable, intent(inout) :: rows(:)
      integer, intent(inout) :: n, attractor(:)
      type(error_t), allocatable, intent(out) :: error

      type(attractors_t) :: attractors
      type(row_t) :: wandering
      real(wp), allocatable :: states(:, :)
      real(wp) :: scale
      integer(i8) :: point
      integer :: before, number

      call find_scale(scale)
      if (allocated(error) .or. scale < 0.0_wp) return
      call task%machine_at(first, error)
      if (allocated(error)) return
      call attractors%begin(task%machine%mass, drift_basis(task%machine), task%watch%states%interval, task%starts%tolerance, &
                            scale)
      before = n
      do point = first, first + grid*(task%plan%starts - 1), grid
         call read_states()
         if (allocated(error)) return
         if (size(states) == 0) cycle
         call attractors%number_of(states, number)
         attractor(point) = number
         if (number == 0) then
            call count_start(wandering)
         else
            if (before + number > n) call append(rows, n)
            rows(before + number)%number = number
            rows(before + number)%period = attractors%found(number)%period
            call count_start(rows(before + number))
         end if
      end do
      if (wandering%starts > 0) then
         call append(rows, n)
         rows(n) = wandering
      end if
      rows(before + 1:n)%strobe_period = task%watch%states%interval
      rows(before + 1:n)%fraction = real(rows(before + 1:n)%starts, wp)/real(sum(rows(before + 1:n)%starts), wp)

   contains

      !> The largest norm of all states of the grid point; -1 if all its motions failed.
      subroutine find_scale(scale)
         real(wp), intent(out) :: scale

         scale = -1.0_wp
         do point = first, first + grid*(task%plan%starts - 1), grid
            call checkpoint%get(point, row, error)
            if (allocated(error)) return
            if (size(row%column(row%place_of("strobe/states"))%reals) > 0) then
               scale = max(scale, row%column(row%place_of("strobe/norm"))%reals(1))
            end if
         end do
      end subroutine find_scale

      !> The states of the point, displacements above velocities (2 coordinates, times); none of a motion that failed.
      subroutine read_states()
         call checkpoint%get(point, row, error)
         if (allocated(error)) return
         associate (values => row%column(row%place_of("strobe/states"))%reals, m => 2*size(task%machine%mass, 1))
            states = reshape(values, [m, size(values)/m])
         end associate
      end subroutine read_states

      subroutine count_start(found)
         type(row_t), intent(inout) :: found

         found%starts = found%starts + 1
         if (found%starts > 1) return
         found%point = point - 1
         found%state = states(:, size(states, 2))
      end subroutine count_start

   end subroutine one_cell

   !> One row more.
   subroutine append(rows, n)
      type(row_t), allocatable, intent(inout) :: rows(:)
      integer, intent(inout) :: n

      if (n == size(rows)) rows = [rows, rows]
      n = n + 1
      rows(n) = row_t()
   end subroutine append

end module razy_study_sweep_basins
