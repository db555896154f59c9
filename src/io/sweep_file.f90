!! The result file of razy-sweep: axes, what became of each point, and the extrema of the observables.
!!
!! A file is begun with the numbers of points and extrema, filled with parts of consecutive points, and committed: no more than a
!! part has to be in memory.
module razy_io_sweep_file
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: check_name, extrema_t, reserve_extrema, write_extrema_part
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, reserve_dataset, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_part, only: write_part
   use razy_io_starts, only: starts_content_t, write_starts
   use razy_io_header, only: result_header_t, write_header
   implicit none(type, external)
   private

   public :: axis_t, point_value_t, sweep_content_t, sweep_writer_t, write_sweep_file

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

   !> A real number of each point, with the path of its dataset, such as `/contact/mesh/impulse`.
   type :: point_value_t
      character(:), allocatable :: path, units, long_name
      real(wp), allocatable :: values(:)
   end type point_value_t

   !> The results of all points or of some consecutive ones. Points are in grid order, the last axis runs fastest; with directions
   !> all points of the first come before those of the second. `axes`, `status` with its meanings, `events`, `steps` and
   !> `doubts` are needed.
   type :: sweep_content_t
      type(axis_t), allocatable :: axes(:)
      !> +1 for chains of points up the first axis, -1 for chains down, both in turn; not allocated if each point stands alone.
      integer(int8), allocatable :: directions(:)
      !> What became of each point (points): 0 for success, else an index into `status_meanings`.
      integer(int32), allocatable :: status(:)
      !> Meaning of each status, in words (0:).
      character(:), allocatable :: status_meanings(:)
      !> Contact events of each point (points).
      integer(int64), allocatable :: events(:)
      !> Steps of the integrator for each point (points).
      integer(int64), allocatable :: steps(:)
      !> Events in doubt at each point (points).
      integer(int64), allocatable :: doubts(:)
      !> Period of each motion in periods of the excitation, 0 or -1, and a bit for each contact touched (points); both or neither.
      integer(int32), allocatable :: period(:)
      integer(int64), allocatable :: touched(:)
      !> Names of the contacts, for the bits.
      character(:), allocatable :: contact_names(:)
      !> Statistics of contacts; may be left unallocated.
      type(point_value_t), allocatable :: contact_values(:)
      !> Extrema of each recorded observable, with `offset`; may be left unallocated.
      type(extrema_t), allocatable :: extrema(:)
      !> Of a sweep with several starts: these, of all points, and where they lead; needed by `begin`. After the directions come
      !> all points of the first start, then those of the second.
      type(starts_content_t), allocatable :: starts
   end type sweep_content_t

   !> A file that is being written: `begin`, `put` for all points, then `commit`; after an error `discard`.
   type :: sweep_writer_t
      type(hdf5_file_t), private :: file
      !> Points in all, and written; extrema of each observable in all, and written.
      integer(int64), private :: points = 0, written = 0
      integer(int64), allocatable, private :: total(:), extrema(:)
   contains
      procedure :: begin => begin_file
      procedure :: put => put_points
      procedure :: commit => commit_file
      procedure :: discard => discard_file
   end type sweep_writer_t

   character(*), parameter :: point = "/point/point"

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_sweep_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(sweep_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(sweep_writer_t) :: writer
      integer(int64), allocatable :: total(:)
      integer :: i

      call check_content(content, error)
      if (allocated(error)) return
      allocate (total(0))
      if (allocated(content%extrema)) then
         total = [(size(content%extrema(i)%value, kind=int64), i=1, size(content%extrema))]
      end if
      call writer%begin(path, header, content, total, error)
      if (allocated(error)) return
      call writer%put(content, error)
      if (allocated(error)) then
         call writer%discard()
      else
         call writer%commit(overwrite, error)
      end if
   end subroutine write_sweep_file

   !> Begin a file under a temporary name; `layout` has the axes, directions, meanings of status and, of `extrema`, names and units;
   !> `total` is the number of extrema of each observable.
   subroutine begin_file(self, path, header, layout, total, error)
      class(sweep_writer_t), intent(inout) :: self
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(sweep_content_t), intent(in) :: layout
      integer(int64), intent(in) :: total(:)
      type(error_t), allocatable, intent(out) :: error

      self%points = n_points(layout)
      self%written = 0
      self%total = total
      self%extrema = 0*total
      call self%file%create(path, error)
      if (allocated(error)) return
      call write_header(self%file, header, error)
      if (.not. allocated(error)) call write_layout(self%file, layout, self%points, total, error)
      if (allocated(error)) call self%file%discard()
   end subroutine begin_file

   !> Write the points that follow those written before.
   subroutine put_points(self, part, error)
      class(sweep_writer_t), intent(inout) :: self
      type(sweep_content_t), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call write_part(self%file, "/point/status", self%written, part%status, error)
      if (.not. allocated(error)) call write_part(self%file, "/point/events", self%written, part%events, error)
      if (.not. allocated(error)) call write_part(self%file, "/point/steps", self%written, part%steps, error)
      if (.not. allocated(error)) call write_part(self%file, "/point/doubts", self%written, part%doubts, error)
      if (allocated(part%period)) then
         if (.not. allocated(error)) call write_part(self%file, "/point/period", self%written, part%period, error)
         if (.not. allocated(error)) call write_part(self%file, "/point/touched", self%written, part%touched, error)
      end if
      if (allocated(part%contact_values)) then
         do i = 1, size(part%contact_values)
            if (allocated(error)) return
            call write_part(self%file, part%contact_values(i)%path, self%written, part%contact_values(i)%values, error)
         end do
      end if
      do i = 1, size(self%total)
         if (allocated(error)) return
         call write_extrema_part(self%file, part%extrema(i), self%written, self%extrema(i), error)
         self%extrema(i) = self%extrema(i) + size(part%extrema(i)%value, kind=int64)
      end do
      self%written = self%written + size(part%status, kind=int64)
   end subroutine put_points

   !> Give the complete file its name; a file that is not complete is discarded.
   subroutine commit_file(self, overwrite, error)
      class(sweep_writer_t), intent(inout) :: self
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      if (self%written /= self%points .or. any(self%extrema /= self%total)) then
         call raise(error, self%file%path//": has not got as many points or extrema as it was made for")
         call self%file%discard()
      else
         call self%file%commit(overwrite, error)
      end if
   end subroutine commit_file

   !> Give the file up.
   subroutine discard_file(self)
      class(sweep_writer_t), intent(inout) :: self

      call self%file%discard()
   end subroutine discard_file

   !> Number of points that axes and directions make.
   pure integer(int64) function n_points(content)
      type(sweep_content_t), intent(in) :: content
      integer :: i

      n_points = product([(size(content%axes(i)%values, kind=int64), i=1, size(content%axes))])
      if (allocated(content%directions)) n_points = n_points*size(content%directions)
      if (allocated(content%starts)) n_points = n_points*content%starts%count
   end function n_points

   !> Refuse arrays that do not belong together.
   subroutine check_content(content, error)
      type(sweep_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: points
      integer :: i

      if (.not. (allocated(content%axes) .and. allocated(content%status) .and. allocated(content%events) .and. &
                 allocated(content%steps) .and. allocated(content%doubts) .and. allocated(content%status_meanings))) then
         call raise(error, "sweep result: axes, status, events, steps, doubts or the meanings of status are missing")
         return
      end if
      points = size(content%status, kind=int64)
      if (n_points(content) /= points) then
         call raise(error, "sweep result: the axes do not make as many points as there are values of status")
      else if (any([size(content%events), size(content%steps), size(content%doubts)] /= size(content%status))) then
         call raise(error, "sweep result: status, events, steps and doubts differ in length")
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
         else if (size(content%extrema(i)%offset, kind=int64) /= points + 1) then
            call raise(error, "sweep result: the offset of the extrema of "//content%extrema(i)%name// &
                       " must have one value more than there are points")
         end if
      end do
   end subroutine check_content

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

end module razy_io_sweep_file
