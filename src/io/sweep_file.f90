!! The result file of razy-sweep: axes, what became of each point, and the extrema of the observables.
!!
!! A file is begun with the numbers of points and extrema, filled with parts of consecutive points, and committed: no more than a
!! part has to be in memory.
module razy_io_sweep_file
   use, intrinsic :: iso_fortran_env, only: int64
   use razy_core_error, only: error_t, raise
   use razy_io_extrema, only: write_extrema_part
   use razy_io_header, only: result_header_t, write_header
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_part, only: write_part
   use razy_io_sweep_content, only: check_content, n_points, sweep_content_t
   use razy_io_sweep_layout, only: write_layout
   implicit none(type, external)
   private

   public :: sweep_writer_t, write_sweep_file

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

end module razy_io_sweep_file
