!! Extrema of an observable as a group of a result file: of one motion, or of many in one ragged array that is written in parts.
module razy_io_extrema
   use, intrinsic :: iso_fortran_env, only: int8, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, reserve_dataset, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_part, only: write_part
   implicit none(type, external)
   private

   public :: extrema_t, reserve_extrema, write_extrema, write_extrema_part, check_name

   !> The extrema of one observable, in order of points and, within a point, of time.
   type :: extrema_t
      !> Name of the observable.
      character(:), allocatable :: name
      !> Units of the values.
      character(:), allocatable :: units
      !> What the observable is.
      character(:), allocatable :: long_name
      !> For a sweep, (points + 1): the extrema of point i, from 1, are value(offset(i) + 1:offset(i + 1)); else not allocated.
      integer(int64), allocatable :: offset(:)
      !> Values (extrema) in `units`.
      real(wp), allocatable :: value(:)
      !> Times (extrema) in s.
      real(wp), allocatable :: time(:)
      !> +1 for a maximum, -1 for a minimum (extrema).
      integer(int8), allocatable :: kind(:)
   end type extrema_t

contains

   !> Write the group `/extrema/<observable>` of one motion.
   subroutine write_extrema(file, extrema, error)
      type(hdf5_file_t), intent(in) :: file
      type(extrema_t), intent(in) :: extrema
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: group, dimension

      call check_extrema(extrema, error)
      if (allocated(error)) return
      group = "/extrema/"//extrema%name
      dimension = group//"/extremum"
      call add_dimension(file, dimension, size(extrema%value, kind=int64), "extrema, dimension only", error)
      if (allocated(error)) return
      call write_dataset(file, group//"/value", extrema%value, extrema%units, "extrema of "//extrema%long_name, dimension, error)
      if (allocated(error)) return
      call write_dataset(file, group//"/time", extrema%time, "s", "time of the extremum", dimension, error)
      if (allocated(error)) return
      call write_dataset(file, group//"/kind", extrema%kind, "1", "kind of extremum", dimension, error)
      if (.not. allocated(error)) call explain_kind(file, group, error)
   end subroutine write_extrema

   !> Make the group `/extrema/<observable>` of a sweep, with room for `total` extrema at so many points.
   subroutine reserve_extrema(file, extrema, points, total, error)
      type(hdf5_file_t), intent(in) :: file
      type(extrema_t), intent(in) :: extrema
      integer(int64), intent(in) :: points, total
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: group, dimension

      call check_name(extrema%name, error)
      if (allocated(error)) return
      group = "/extrema/"//extrema%name
      call add_dimension(file, group//"/boundary", points + 1_int64, "boundaries between points, dimension only", error)
      if (allocated(error)) return
      call reserve_dataset(file, group//"/offset", 0_int64, points + 1_int64, "1", &
                           "extrema of point i (from 0) are offset[i]:offset[i+1]", group//"/boundary", error)
      if (allocated(error)) return
      call write_part(file, group//"/offset", 0_int64, [0_int64], error)
      if (allocated(error)) return
      dimension = group//"/extremum"
      call add_dimension(file, dimension, total, "extrema, dimension only", error)
      if (allocated(error)) return
      call reserve_dataset(file, group//"/value", 0.0_wp, total, extrema%units, "extrema of "//extrema%long_name, dimension, error)
      if (allocated(error)) return
      call reserve_dataset(file, group//"/time", 0.0_wp, total, "s", "time of the extremum", dimension, error)
      if (allocated(error)) return
      call reserve_dataset(file, group//"/kind", 0_int8, total, "1", "kind of extremum", dimension, error)
      if (.not. allocated(error)) call explain_kind(file, group, error)
   end subroutine reserve_extrema

   !> Write the extrema of the points behind the first `point`, which have `extremum` extrema.
   subroutine write_extrema_part(file, extrema, point, extremum, error)
      type(hdf5_file_t), intent(in) :: file
      type(extrema_t), intent(in) :: extrema
      integer(int64), intent(in) :: point, extremum
      type(error_t), allocatable, intent(out) :: error
      integer(int64), allocatable :: offset(:)
      character(:), allocatable :: group

      call check_extrema(extrema, error)
      if (allocated(error)) return
      group = "/extrema/"//extrema%name
      offset = extremum + extrema%offset(2:)
      call write_part(file, group//"/offset", point + 1_int64, offset, error)
      if (.not. allocated(error)) call write_part(file, group//"/value", extremum, extrema%value, error)
      if (.not. allocated(error)) call write_part(file, group//"/time", extremum, extrema%time, error)
      if (.not. allocated(error)) call write_part(file, group//"/kind", extremum, extrema%kind, error)
   end subroutine write_extrema_part

   !> Say what the values of `kind` mean, as CF has it.
   subroutine explain_kind(file, group, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: group
      type(error_t), allocatable, intent(out) :: error

      call write_attribute(file, group//"/kind", "flag_values", [1_int8, -1_int8], error)
      if (.not. allocated(error)) call write_attribute(file, group//"/kind", "flag_meanings", "maximum minimum", error)
   end subroutine explain_kind

   !> Refuse arrays that do not belong together.
   pure subroutine check_extrema(extrema, error)
      type(extrema_t), intent(in) :: extrema
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: n

      call check_name(extrema%name, error)
      if (allocated(error)) return
      if (.not. (allocated(extrema%value) .and. allocated(extrema%time) .and. allocated(extrema%kind))) then
         call raise(error, "extrema of "//extrema%name//": value, time or kind is missing")
         return
      end if
      n = size(extrema%value, kind=int64)
      if (size(extrema%time, kind=int64) /= n .or. size(extrema%kind, kind=int64) /= n) then
         call raise(error, "extrema of "//extrema%name//": value, time and kind differ in length")
      else if (allocated(extrema%offset)) then
         if (size(extrema%offset) == 0) then
            call raise(error, "extrema of "//extrema%name//": offset is empty")
         else if (extrema%offset(1) /= 0_int64 .or. extrema%offset(size(extrema%offset)) /= n) then
            call raise(error, "extrema of "//extrema%name//": offset must run from 0 to the number of extrema")
         end if
      end if
   end subroutine check_extrema

   !> Refuse a name that cannot be a link in an HDF5 file.
   pure subroutine check_name(name, error)
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error

      if (len_trim(name) == 0) then
         call raise(error, "a name in the result file is empty")
      else if (index(name, "/") > 0 .or. name == ".") then
         call raise(error, name//": cannot be a name in the result file, which allows neither / nor a lone point")
      end if
   end subroutine check_name

end module razy_io_extrema
