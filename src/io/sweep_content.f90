!! What a sweep found, as it goes into its result file (razy_io_sweep_file).
module razy_io_sweep_content
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: check_name, extrema_t
   use razy_io_starts, only: starts_content_t
   implicit none(type, external)
   private

   public :: axis_t, check_content, n_points, point_value_t, sweep_content_t

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

contains

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

end module razy_io_sweep_content
