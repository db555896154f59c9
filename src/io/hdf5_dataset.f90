!! Datasets with units, a name and a dimension scale for each dimension, as netCDF-4 and xarray expect them.
!!
!! Paths inside the file begin with `/`; their groups are made as needed. `scales` gives the path of the scale of each dimension, in
!! Fortran order; a dataset that names itself becomes the scale of its one dimension. Data go from the array to the file uncopied.
module razy_io_hdf5_dataset
   use, intrinsic :: iso_c_binding, only: c_associated, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use hdf5, only: h5_integer_kind, h5_real_kind, h5dclose_f, h5dcreate_f, h5dwrite_f, h5gclose_f, h5gcreate_f, h5kind_to_type, &
                   h5lexists_f, h5p_crt_order_indexed_f, h5p_crt_order_tracked_f, h5p_dataset_create_f, &
                   h5p_group_create_f, h5pclose_f, &
                   h5pcreate_f, h5pset_obj_track_times_f, &
                   h5pset_link_creation_order_f, h5sclose_f, h5screate_simple_f, h5t_ieee_f64le, h5t_std_i32le, &
                   h5t_std_i64le, h5t_std_i8le, h5tclose_f, hid_t, hsize_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: open_string_type, string_pointers, write_attribute
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_library, only: check_hdf5
   use razy_io_hdf5_scale, only: attach_scale, make_scale
   implicit none(type, external)
   private

   public :: write_dataset, reserve_dataset, add_dimension

   !> Create the dataset at `path` and write the values.
   interface write_dataset
      module procedure write_real64_0
      module procedure write_real64_1
      module procedure write_real64_2
      module procedure write_real64_3
      module procedure write_int64
      module procedure write_int32
      module procedure write_int8
      module procedure write_strings
   end interface write_dataset

   !> Create the dataset at `path` of `length` numbers of the type of `mold`, which razy_io_hdf5_part writes piece by piece.
   interface reserve_dataset
      module procedure reserve_real64
      module procedure reserve_int64
      module procedure reserve_int32
      module procedure reserve_int8
   end interface reserve_dataset

contains

   !> One real number, of no dimension.
   subroutine write_real64_0(file, path, value, units, long_name, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name
      real(wp), intent(in), target :: value
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, path, h5t_ieee_f64le, h5kind_to_type(wp, h5_real_kind), [integer(hsize_t) ::], c_loc(value), units, &
                     long_name, [character(1) ::], error)
   end subroutine write_real64_0

   !> Room for real numbers.
   subroutine reserve_real64(file, path, mold, length, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      real(wp), intent(in) :: mold
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, path, h5t_ieee_f64le, h5kind_to_type(kind(mold), h5_real_kind), [int(length, hsize_t)], c_null_ptr, &
                     units, long_name, [scale], error)
   end subroutine reserve_real64

   !> Room for 64-bit integers.
   subroutine reserve_int64(file, path, mold, length, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int64), intent(in) :: mold
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, path, h5t_std_i64le, h5kind_to_type(kind(mold), h5_integer_kind), [int(length, hsize_t)], c_null_ptr, &
                     units, long_name, [scale], error)
   end subroutine reserve_int64

   !> Room for 32-bit integers.
   subroutine reserve_int32(file, path, mold, length, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int32), intent(in) :: mold
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, path, h5t_std_i32le, h5kind_to_type(kind(mold), h5_integer_kind), [int(length, hsize_t)], c_null_ptr, &
                     units, long_name, [scale], error)
   end subroutine reserve_int32

   !> Room for 8-bit integers.
   subroutine reserve_int8(file, path, mold, length, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int8), intent(in) :: mold
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, path, h5t_std_i8le, h5kind_to_type(kind(mold), h5_integer_kind), [int(length, hsize_t)], c_null_ptr, &
                     units, long_name, [scale], error)
   end subroutine reserve_int8

   !> Real numbers (n).
   subroutine write_real64_1(file, path, values, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      real(wp), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_ieee_f64le, h5kind_to_type(wp, h5_real_kind), shape(values, hsize_t), buffer, units, &
                     long_name, [scale], error)
   end subroutine write_real64_1

   !> Real numbers (m, n), which other languages see as (n, m).
   subroutine write_real64_2(file, path, values, units, long_name, scales, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scales(2)
      real(wp), intent(in), target, contiguous :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_ieee_f64le, h5kind_to_type(wp, h5_real_kind), shape(values, hsize_t), buffer, units, &
                     long_name, scales, error)
   end subroutine write_real64_2

   !> Real numbers (l, m, n), which other languages see as (n, m, l).
   subroutine write_real64_3(file, path, values, units, long_name, scales, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scales(3)
      real(wp), intent(in), target, contiguous :: values(:, :, :)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_ieee_f64le, h5kind_to_type(wp, h5_real_kind), shape(values, hsize_t), buffer, units, &
                     long_name, scales, error)
   end subroutine write_real64_3

   !> 64-bit integers (n).
   subroutine write_int64(file, path, values, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int64), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_std_i64le, h5kind_to_type(int64, h5_integer_kind), shape(values, hsize_t), buffer, units, &
                     long_name, [scale], error)
   end subroutine write_int64

   !> 32-bit integers (n).
   subroutine write_int32(file, path, values, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int32), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_std_i32le, h5kind_to_type(int32, h5_integer_kind), shape(values, hsize_t), buffer, units, &
                     long_name, [scale], error)
   end subroutine write_int32

   !> 8-bit integers (n).
   subroutine write_int8(file, path, values, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scale
      integer(int8), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer

      buffer = c_null_ptr
      if (size(values) > 0) buffer = c_loc(values)
      call write_raw(file, path, h5t_std_i8le, h5kind_to_type(int8, h5_integer_kind), shape(values, hsize_t), buffer, units, &
                     long_name, [scale], error)
   end subroutine write_int8

   !> Strings (n), without their trailing blanks.
   subroutine write_strings(file, path, values, units, long_name, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, values(:), units, long_name, scale
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable, target :: text
      type(c_ptr), allocatable, target :: pointers(:)
      type(c_ptr) :: buffer
      integer(hid_t) :: type_id
      integer :: status

      buffer = c_null_ptr
      call string_pointers(values, text, pointers)
      if (size(values) > 0) buffer = c_loc(pointers)
      call open_string_type(type_id, error)
      if (allocated(error)) return
      call write_raw(file, path, type_id, type_id, shape(values, hsize_t), buffer, units, long_name, [scale], error)
      call h5tclose_f(type_id, status)
      if (.not. allocated(error)) call check_hdf5(status, path, error)
   end subroutine write_strings

   !> A dimension without coordinates: a scale that has a length and a name, but no values and takes no room in the file.
   subroutine add_dimension(file, path, length, long_name, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, long_name
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error
      character(80) :: name

      ! By this name netCDF-4 knows a dimension that is no variable.
      write (name, "(a, i10)") "This is a netCDF dimension but not a netCDF variable.", length
      call write_raw(file, path, h5t_std_i8le, h5t_std_i8le, [int(length, hsize_t)], c_null_ptr, "1", long_name, &
                     [character(1) ::], error)
      if (.not. allocated(error)) call make_scale(file, path, trim(name), error)
   end subroutine add_dimension

   !> Create the dataset, write what `buffer` points to (nothing if null), then units, name and scales.
   subroutine write_raw(file, path, file_type, memory_type, extent, buffer, units, long_name, scales, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, units, long_name, scales(:)
      integer(hid_t), intent(in) :: file_type, memory_type
      integer(hsize_t), intent(in) :: extent(:)
      type(c_ptr), intent(in) :: buffer
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: creation, space, dataset
      integer :: status, i

      call make_groups(file, path, error)
      if (allocated(error)) return
      call h5screate_simple_f(size(extent), extent, space, status)
      ! Without the time of its making, the same results make the same file, byte for byte.
      if (status >= 0) call h5pcreate_f(h5p_dataset_create_f, creation, status)
      if (status >= 0) call h5pset_obj_track_times_f(creation, .false., status)
      if (status >= 0) call h5dcreate_f(file%id, path, file_type, space, dataset, status, creation)
      if (status >= 0) call h5pclose_f(creation, status)
      if (status >= 0 .and. c_associated(buffer)) call h5dwrite_f(dataset, memory_type, buffer, status)
      if (status >= 0) call h5dclose_f(dataset, status)
      if (status >= 0) call h5sclose_f(space, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
      if (.not. allocated(error)) call write_attribute(file, path, "units", units, error)
      if (.not. allocated(error)) call write_attribute(file, path, "long_name", long_name, error)
      do i = 1, size(scales)
         if (allocated(error)) return
         if (scales(i) == path) then
            call make_scale(file, path, path(index(path, "/", back=.true.) + 1:), error)
         else
            call attach_scale(file, path, size(scales) + 1 - i, trim(scales(i)), error)
         end if
      end do
   end subroutine write_raw

   !> Make the groups on the way to `path` that do not exist yet; they remember the order in which their members were made.
   subroutine make_groups(file, path, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: creation, group
      integer :: status, last
      logical :: exists
      integer :: creation_order

      creation_order = ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f)
      do last = 2, len(path) - 1
         if (path(last + 1:last + 1) /= "/") cycle
         call h5lexists_f(file%id, path(:last), exists, status)
         if (status >= 0 .and. .not. exists) then
            call h5pcreate_f(h5p_group_create_f, creation, status)
            if (status >= 0) call h5pset_link_creation_order_f(creation, creation_order, status)
            if (status >= 0) call h5pset_obj_track_times_f(creation, .false., status)
            if (status >= 0) call h5gcreate_f(file%id, path(:last), group, status, gcpl_id=creation)
            if (status >= 0) call h5gclose_f(group, status)
            if (status >= 0) call h5pclose_f(creation, status)
         end if
         call check_hdf5(status, file%path//": group "//path(:last)//" cannot be made", error)
         if (allocated(error)) return
      end do
   end subroutine make_groups

end module razy_io_hdf5_dataset
