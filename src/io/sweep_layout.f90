!! The groups of a sweep's result file, with room for its points.
module razy_io_sweep_layout
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: reserve_extrema
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, reserve_dataset, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_starts, only: write_starts
   use razy_io_sweep_content, only: axis_t, sweep_content_t
   implicit none(type, external)
   private

   public :: write_layout

   character(*), parameter :: point = "/point/point"

contains

   !> The groups `/axis`, `/point` and `/extrema`, with room for what `put` writes.
   subroutine write_layout(file, layout, points, total, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: layout
      integer(int64), intent(in) :: points, total(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(layout%axes)
         associate (axis => layout%axes(i))
            call write_dataset(file, "/axis/"//dotted(axis%parameter), axis%values, axis%units, axis%long_name, &
                               "/axis/"//dotted(axis%parameter), error)
         end associate
         if (allocated(error)) return
      end do
      call add_dimension(file, point, points, "points, dimension only", error)
      do i = 1, size(layout%axes)
         if (allocated(error)) return
         call write_axis_at_points(file, layout%axes, i, points, error)
      end do
      if (.not. allocated(error) .and. allocated(layout%directions)) call write_directions(file, layout%directions, points, error)
      if (.not. allocated(error) .and. allocated(layout%starts)) call write_starts(file, layout%starts, point, error)
      if (.not. allocated(error)) call reserve_status(file, layout, points, error)
      if (allocated(error)) return
      call reserve_dataset(file, "/point/events", 0_int64, points, "1", "contact events", point, error)
      if (allocated(error)) return
      call reserve_dataset(file, "/point/steps", 0_int64, points, "1", "steps of the integrator", point, error)
      if (allocated(error)) return
      call reserve_dataset(file, "/point/doubts", 0_int64, points, "1", "events in doubt", point, error)
      if (allocated(error)) return
      call write_coordinates(file, layout, error)
      if (.not. allocated(error)) call reserve_kind(file, layout, points, error)
      if (.not. allocated(error)) call reserve_values(file, layout, points, error)
      if (.not. allocated(layout%extrema)) return
      do i = 1, size(layout%extrema)
         if (allocated(error)) return
         call reserve_extrema(file, layout%extrema(i), points, total(i), error)
      end do
   end subroutine write_layout

   !> `/point/direction`.
   subroutine write_directions(file, directions, points, error)
      type(hdf5_file_t), intent(in) :: file
      integer(int8), intent(in) :: directions(:)
      integer(int64), intent(in) :: points
      type(error_t), allocatable, intent(out) :: error
      integer(int8), allocatable :: values(:)
      integer(int64) :: i

      allocate (values(points))
      do i = 1, points
         values(i) = directions(1 + (i - 1)*size(directions)/points)
      end do
      call write_dataset(file, "/point/direction", values, "1", "direction of the chain of points", point, error)
      if (allocated(error)) return
      call write_attribute(file, "/point/direction", "flag_values", [1_int8, -1_int8], error)
      if (.not. allocated(error)) call write_attribute(file, "/point/direction", "flag_meanings", "up down", error)
   end subroutine write_directions

   !> The parameter of axis `k` at each point.
   subroutine write_axis_at_points(file, axes, k, points, error)
      type(hdf5_file_t), intent(in) :: file
      type(axis_t), intent(in) :: axes(:)
      integer, intent(in) :: k
      integer(int64), intent(in) :: points
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: values(:)
      integer(int64) :: sizes(size(axes)), i, inner

      sizes = [(size(axes(i)%values, kind=int64), i=1, size(axes))]
      inner = product(sizes(k + 1:))
      allocate (values(points))
      do i = 1, size(values, kind=int64)
         values(i) = axes(k)%values(mod((i - 1)/inner, sizes(k)) + 1)
      end do
      call write_dataset(file, "/point/"//dotted(axes(k)%parameter), values, axes(k)%units, axes(k)%long_name, point, error)
   end subroutine write_axis_at_points

   !> `/point/status` with its meanings in words and as CF has them.
   subroutine reserve_status(file, content, points, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: content
      integer(int64), intent(in) :: points
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: meanings, flags
      character(12) :: number
      integer(int32) :: values(size(content%status_meanings))
      integer :: i

      meanings = ""
      flags = ""
      do i = 1, size(content%status_meanings)
         values(i) = int(i - 1, int32)
         write (number, "(i0)") values(i)
         meanings = meanings//", "//trim(number)//" = "//trim(content%status_meanings(i))
         flags = flags//" "//underscored(trim(content%status_meanings(i)))
      end do
      call reserve_dataset(file, "/point/status", 0_int32, points, "1", "what became of the point", point, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "meanings", meanings(3:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "flag_values", values, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "flag_meanings", flags(2:), error)
   end subroutine reserve_status

   !> `/point/period` and `/point/touched`, if they were asked for.
   subroutine reserve_kind(file, layout, points, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: layout
      integer(int64), intent(in) :: points
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(layout%contact_names)) return
      call reserve_dataset(file, "/point/period", 0_int32, points, "1", "period of the motion in periods of the excitation", &
                           point, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/period", "meanings", &
                                                       "0 = not periodic within 32, -1 = not determined", error)
      if (.not. allocated(error)) call reserve_dataset(file, "/point/touched", 0_int64, points, "1", &
                                                       "contacts touched, bit by bit", point, error)
      if (.not. allocated(error) .and. size(layout%contact_names) > 0) call write_attribute(file, "/point/touched", "names", &
                                                                                            layout%contact_names, error)
   end subroutine reserve_kind

   !> The datasets of the group `/contact`, if they were asked for.
   subroutine reserve_values(file, layout, points, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: layout
      integer(int64), intent(in) :: points
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      if (.not. allocated(layout%contact_values)) return
      if (size(layout%contact_values) == 0) return
      call add_dimension(file, "/contact/point", points, "points, dimension only", error)
      do i = 1, size(layout%contact_values)
         if (allocated(error)) return
         associate (stored => layout%contact_values(i))
            call reserve_dataset(file, stored%path, 0.0_wp, points, stored%units, stored%long_name, "/contact/point", error)
         end associate
      end do
   end subroutine reserve_values

   !> Tell CF readers that the parameters are the coordinates of the points.
   subroutine write_coordinates(file, layout, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: layout
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: names
      integer :: i

      names = ""
      do i = 1, size(layout%axes)
         names = names//" "//dotted(layout%axes(i)%parameter)
      end do
      if (allocated(layout%directions)) names = names//" direction"
      if (allocated(layout%starts)) names = names//" start"
      call write_attribute(file, "/point/status", "coordinates", names(2:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/events", "coordinates", names(2:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/steps", "coordinates", names(2:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/doubts", "coordinates", names(2:), error)
   end subroutine write_coordinates

   !> The parameter with `.` for `%`.
   pure function dotted(parameter) result(name)
      character(*), intent(in) :: parameter
      character(:), allocatable :: name

      name = replaced(parameter, "%", ".")
   end function dotted

   !> The words joined by `_`.
   pure function underscored(words) result(name)
      character(*), intent(in) :: words
      character(:), allocatable :: name

      name = replaced(words, " ", "_")
   end function underscored

   !> The text with every character `old` replaced.
   pure function replaced(text, old, new) result(changed)
      character(*), intent(in) :: text
      character, intent(in) :: old, new
      character(len(text)) :: changed
      integer :: i

      do i = 1, len(text)
         changed(i:i) = merge(new, text(i:i), text(i:i) == old)
      end do
   end function replaced

end module razy_io_sweep_layout
