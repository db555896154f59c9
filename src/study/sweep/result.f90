!! The result file of a sweep, put together from the rows of the checkpoint in grid order; memory holds no more than some of them.
module razy_study_sweep_result
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_io_rows_file, only: rows_file_t
   use razy_study_sweep_basins, only: basin_columns
   use razy_study_sweep_task, only: sweep_task_t
   use razy_sweep_checkpoint, only: checkpoint_t
   implicit none(type, external)
   private

   public :: write_sweep

   character(*), parameter :: along = "/point/point"

contains

   !> Write the file; points that the checkpoint has not are not computed yet.
   subroutine write_sweep(task, checkpoint, path, overwrite, error)
      class(sweep_task_t), intent(inout) :: task
      type(checkpoint_t), intent(inout) :: checkpoint
      character(*), intent(in) :: path
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      type(rows_file_t) :: file
      type(table_t) :: missing, row, table
      integer(i8) :: point

      call axis_columns(task, table)
      call basin_columns(task, checkpoint, table, error)
      if (allocated(error)) return
      if (allocated(task%drawing)) call task%drawing%columns(table)
      row = checkpoint%row
      ! By this name CF readers know the coordinates of the points.
      call row%note_group("/point/", "coordinates", coordinates_of(task))
      missing = row
      call file%begin(path, task%header, table, row, task%plan%points, checkpoint%tally, error)
      do point = 1, task%plan%points
         if (allocated(error)) exit
         if (checkpoint%has(point)) then
            call checkpoint%get(point, row, error)
            if (.not. allocated(error)) call file%append(row, error)
         else
            call file%append(missing, error)
         end if
      end do
      call file%commit(overwrite, error)
   end subroutine write_sweep

   !> The axes, and the values of their parameters and the direction of the chain at each point.
   subroutine axis_columns(task, table)
      class(sweep_task_t), intent(in) :: task
      type(table_t), intent(inout) :: table

      real(wp), allocatable :: values(:)
      integer(i8) :: indices(size(task%varied)), point
      integer :: i

      do i = 1, size(task%varied)
         associate (varied => task%varied(i), axis => "/axis/"//task%varied(i)%dotted())
            call table%add(axis, task%grid%axes(i)%values(), varied%unit, varied%parameter, axis)
         end associate
      end do
      do i = 1, size(task%varied)
         if (.not. allocated(values)) allocate (values(task%plan%points))
         do point = 1, task%plan%points
            indices = task%grid%indices(task%plan%grid_point(point))
            values(point) = task%grid%axes(i)%value(indices(i))
         end do
         associate (varied => task%varied(i))
            call table%add("/point/"//varied%dotted(), values, varied%unit, varied%parameter, along)
         end associate
      end do
      if (.not. task%plan%has_chains()) return
      call table%add("/point/direction", [(int(task%plan%direction_of(point), int8), point=1, task%plan%points)], "1", &
                     "direction of the chain of points", along)
      call table%note_meanings([1, -1], ["up  ", "down"])
   end subroutine axis_columns

   !> Names of what a point is known by.
   pure function coordinates_of(task) result(names)
      class(sweep_task_t), intent(in) :: task
      character(:), allocatable :: names

      integer :: i

      names = task%varied(1)%dotted()
      do i = 2, size(task%varied)
         names = names//" "//task%varied(i)%dotted()
      end do
      if (task%plan%has_chains()) names = names//" direction"
      if (task%starts%wanted) names = names//" start"
   end function coordinates_of

end module razy_study_sweep_result
