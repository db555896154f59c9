!! The result file of razy-sweep: axes, what became of each point, and the extrema of the observables.
module razy_io_sweep_file
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: check_name, extrema_t, write_extrema
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_header, only: result_header_t, write_header
   implicit none(type, external)
   private

   public :: axis_t, sweep_content_t, write_sweep_file

   !> A parameter that is varied.
   type :: axis_t
      !> The parameter as the namelist has it, such as `rotation%speed_rpm`.
      character(:), allocatable :: parameter
      !> Units of the input.
      character(:), allocatable :: units
      !> What the parameter is.
      character(:), allocatable :: long_name
      !> Grid values in `units`.
      real(wp), allocatable :: values(:)
   end type axis_t

   !> The results; points are in grid order, the last axis runs fastest. All components but `extrema` are needed.
   type :: sweep_content_t
      type(axis_t), allocatable :: axes(:)
      !> What became of each point (points): 0 for success, else an index into `status_meanings`.
      integer(int32), allocatable :: status(:)
      !> Meaning of each status, in words (0:).
      character(:), allocatable :: status_meanings(:)
      !> Contact events of each point (points).
      integer(int64), allocatable :: events(:)
      !> Steps of the integrator for each point (points).
      integer(int64), allocatable :: steps(:)
      !> Extrema of each recorded observable, with `offset`; may be left unallocated.
      type(extrema_t), allocatable :: extrema(:)
   end type sweep_content_t

   character(*), parameter :: point = "/point/point"

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_sweep_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(sweep_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file

      call check_content(content, error)
      if (allocated(error)) return
      call file%create(path, error)
      if (allocated(error)) return
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_content(file, content, error)
      if (allocated(error)) then
         call file%discard()
      else
         call file%commit(overwrite, error)
      end if
   end subroutine write_sweep_file

   !> Refuse arrays that do not belong together.
   subroutine check_content(content, error)
      type(sweep_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: points
      integer :: i

      if (.not. (allocated(content%axes) .and. allocated(content%status) .and. allocated(content%events) .and. &
                 allocated(content%steps) .and. allocated(content%status_meanings))) then
         call raise(error, "sweep result: axes, status, events, steps or the meanings of status are missing")
         return
      end if
      points = size(content%status, kind=int64)
      if (product([(size(content%axes(i)%values, kind=int64), i=1, size(content%axes))]) /= points) then
         call raise(error, "sweep result: the axes do not make as many points as there are values of status")
      else if (size(content%events, kind=int64) /= points .or. size(content%steps, kind=int64) /= points) then
         call raise(error, "sweep result: status, events and steps differ in length")
      else if (any(content%status < 0) .or. any(content%status >= size(content%status_meanings))) then
         call raise(error, "sweep result: a status has no meaning")
      end if
      do i = 1, size(content%axes)
         if (allocated(error)) return
         call check_name(content%axes(i)%parameter, error)
      end do
      if (.not. allocated(content%extrema)) return
      do i = 1, size(content%extrema)
         if (allocated(error)) return
         if (.not. allocated(content%extrema(i)%offset)) then
            call raise(error, "sweep result: the extrema of "//content%extrema(i)%name//" have no offset")
         end if
      end do
   end subroutine check_content

   !> The groups `/axis`, `/point` and `/extrema`.
   subroutine write_content(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: points
      integer :: i

      points = size(content%status, kind=int64)
      do i = 1, size(content%axes)
         associate (axis => content%axes(i))
            call write_dataset(file, "/axis/"//dotted(axis%parameter), axis%values, axis%units, axis%long_name, &
                               "/axis/"//dotted(axis%parameter), error)
         end associate
         if (allocated(error)) return
      end do
      call add_dimension(file, point, points, "points, dimension only", error)
      do i = 1, size(content%axes)
         if (allocated(error)) return
         call write_axis_at_points(file, content%axes, i, error)
      end do
      if (.not. allocated(error)) call write_status(file, content, error)
      if (allocated(error)) return
      call write_dataset(file, "/point/events", content%events, "1", "contact events", point, error)
      if (allocated(error)) return
      call write_dataset(file, "/point/steps", content%steps, "1", "steps of the integrator", point, error)
      if (allocated(error)) return
      call write_coordinates(file, content%axes, error)
      if (.not. allocated(content%extrema)) return
      do i = 1, size(content%extrema)
         if (allocated(error)) return
         call write_extrema(file, content%extrema(i), points, error)
      end do
   end subroutine write_content

   !> The parameter of axis `k` at each point.
   subroutine write_axis_at_points(file, axes, k, error)
      type(hdf5_file_t), intent(in) :: file
      type(axis_t), intent(in) :: axes(:)
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: values(:)
      integer(int64) :: sizes(size(axes)), i, inner

      sizes = [(size(axes(i)%values, kind=int64), i=1, size(axes))]
      inner = product(sizes(k + 1:))
      allocate (values(product(sizes)))
      do i = 1, size(values, kind=int64)
         values(i) = axes(k)%values(mod((i - 1)/inner, sizes(k)) + 1)
      end do
      call write_dataset(file, "/point/"//dotted(axes(k)%parameter), values, axes(k)%units, axes(k)%long_name, point, error)
   end subroutine write_axis_at_points

   !> `/point/status` with its meanings in words and as CF has them.
   subroutine write_status(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(sweep_content_t), intent(in) :: content
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
      call write_dataset(file, "/point/status", content%status, "1", "what became of the point", point, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "meanings", meanings(3:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "flag_values", values, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/status", "flag_meanings", flags(2:), error)
   end subroutine write_status

   !> Tell CF readers that the parameters are the coordinates of the points.
   subroutine write_coordinates(file, axes, error)
      type(hdf5_file_t), intent(in) :: file
      type(axis_t), intent(in) :: axes(:)
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: names
      integer :: i

      names = ""
      do i = 1, size(axes)
         names = names//" "//dotted(axes(i)%parameter)
      end do
      call write_attribute(file, "/point/status", "coordinates", names(2:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/events", "coordinates", names(2:), error)
      if (.not. allocated(error)) call write_attribute(file, "/point/steps", "coordinates", names(2:), error)
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

end module razy_io_sweep_file
