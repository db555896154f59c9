!! Initial states of a sweep and the attractors they lead to, as parts of a result file.
module razy_io_starts
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: check_name
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   implicit none(type, external)
   private

   public :: starts_content_t, write_starts

   !> A quantity of the state that differs from start to start.
   type :: start_quantity_t
      !> Name and unit, and the value at each point (points).
      character(:), allocatable :: name, units
      real(wp), allocatable :: value(:)
   end type start_quantity_t

   !> Starts and attractors. A row is an attractor of a grid point, or its motions that are not periodic.
   type :: starts_content_t
      !> Number of the start of each point, from 1 (points); starts of each grid point.
      integer(int64) :: count = 0
      integer(int32), allocatable :: start(:)
      type(start_quantity_t), allocatable :: quantities(:)
      !> Where the motion of each point ended (points): number of an attractor, 0 not periodic, -1 the motion failed.
      integer(int32), allocatable :: attractor(:)
      !> Rows of grid point g, from 1, one set for each direction: offset(g) + 1:offset(g + 1).
      integer(int64), allocatable :: offset(:)
      !> Number of the attractor, its period in periods of the excitation; 0, 0 for motions that are not periodic. (rows)
      integer(int32), allocatable :: number(:), period(:)
      !> Starts that lead there, the first point that does, from 0. (rows)
      integer(int64), allocatable :: starts(:), point(:)
      !> Share of the starts whose motions did not fail; period of the excitation, s. (rows)
      real(wp), allocatable :: fraction(:), strobe_period(:)
      !> State at the end of the motion of `point` (n, rows), names and units of the coordinates (n).
      real(wp), allocatable :: displacement(:, :), velocity(:, :)
      character(64), allocatable :: coordinate(:)
      character(16), allocatable :: unit(:), rate_unit(:)
   end type starts_content_t

contains

   !> Write what belongs to points, whose dimension is `scale`, and the group `/attractor`.
   subroutine write_starts(file, content, scale, error)
      type(hdf5_file_t), intent(in) :: file
      type(starts_content_t), intent(in) :: content
      character(*), intent(in) :: scale
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      call write_dataset(file, "/point/start", content%start, "1", "number of the start, from 1", scale, error)
      do i = 1, size(content%quantities)
         associate (quantity => content%quantities(i))
            if (.not. allocated(error)) call check_name(quantity%name, error)
            if (.not. allocated(error)) call write_dataset(file, "/point/start."//quantity%name, quantity%value, quantity%units, &
                                                           quantity%name//" at the start", scale, error)
         end associate
      end do
      if (.not. allocated(error)) call write_dataset(file, "/point/attractor", content%attractor, "1", &
                                                     "attractor on which the motion ends", scale, error)
      if (.not. allocated(error)) call write_attribute(file, "/point/attractor", "meanings", &
                                                       "1, 2, ... = attractor, 0 = none found, -1 = failed", &
                                                       error)
      if (.not. allocated(error)) call write_attractors(file, content, error)
   end subroutine write_starts

   subroutine write_attractors(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(starts_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: row = "/attractor/row", boundary = "/attractor/boundary"

      call add_dimension(file, boundary, size(content%offset, kind=int64), "boundaries of grid points, dimension only", error)
      if (allocated(error)) return
      call add_dimension(file, row, size(content%number, kind=int64), "attractors, dimension only", error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/offset", content%offset, "1", "first attractor of each grid point", boundary, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/number", content%number, "1", "number at its point, 0: not periodic", row, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/period", content%period, "1", "period in periods of the excitation", row, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/starts", content%starts, "1", "starts that lead there", row, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/point", content%point, "1", "first point that leads there, from 0", row, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/fraction", content%fraction, "1", "basin fraction", row, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/strobe_period", content%strobe_period, "s", "period of the excitation", row, error)
      if (.not. allocated(error)) call write_states(file, content, row, error)
   end subroutine write_attractors

   subroutine write_states(file, content, row, error)
      type(hdf5_file_t), intent(in) :: file
      type(starts_content_t), intent(in) :: content
      character(*), intent(in) :: row
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: coordinate = "/attractor/coordinate"
      character(len(coordinate)) :: scales(2)

      scales = [character(len(coordinate)) :: coordinate, row]
      call write_dataset(file, coordinate, content%coordinate, "1", "coordinate", coordinate, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/displacement", content%displacement, shared(content%unit), "displacement", scales, error)
      if (allocated(error)) return
      call write_attribute(file, "/attractor/displacement", "coordinate_units", content%unit, error)
      if (allocated(error)) return
      call write_dataset(file, "/attractor/velocity", content%velocity, shared(content%rate_unit), "velocity", scales, error)
      if (.not. allocated(error)) call write_attribute(file, "/attractor/velocity", "coordinate_units", content%rate_unit, error)
   end subroutine write_states

   !> The unit that all have, or `mixed`.
   pure function shared(units) result(unit)
      character(*), intent(in) :: units(:)
      character(:), allocatable :: unit

      unit = "mixed"
      if (all(units == units(1))) unit = trim(units(1))
   end function shared

end module razy_io_starts
