!! Writing parts of a dataset that `reserve_dataset` (razy_io_hdf5_dataset) has made, so that it need not be in memory as a whole.
module razy_io_hdf5_part
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use hdf5, only: h5_integer_kind, h5_real_kind, h5dclose_f, h5dget_space_f, h5dopen_f, h5dwrite_f, h5kind_to_type, &
                   h5s_select_set_f, h5sclose_f, h5screate_simple_f, h5sselect_hyperslab_f, hid_t, hsize_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_library, only: check_hdf5
   implicit none(type, external)
   private

   public :: write_part

   !> Write values behind the first `first` ones of the dataset at `path`.
   interface write_part
      module procedure write_real64
      module procedure write_int64
      module procedure write_int32
      module procedure write_int8
   end interface write_part

contains

   !> Real numbers (n).
   subroutine write_real64(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first
      real(wp), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_raw(file, path, first, size(values, kind=int64), h5kind_to_type(wp, h5_real_kind), c_loc(values), error)
   end subroutine write_real64

   !> 64-bit integers (n).
   subroutine write_int64(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first
      integer(int64), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_raw(file, path, first, size(values, kind=int64), h5kind_to_type(int64, h5_integer_kind), c_loc(values), error)
   end subroutine write_int64

   !> 32-bit integers (n).
   subroutine write_int32(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first
      integer(int32), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_raw(file, path, first, size(values, kind=int64), h5kind_to_type(int32, h5_integer_kind), c_loc(values), error)
   end subroutine write_int32

   !> 8-bit integers (n).
   subroutine write_int8(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first
      integer(int8), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_raw(file, path, first, size(values, kind=int64), h5kind_to_type(int8, h5_integer_kind), c_loc(values), error)
   end subroutine write_int8

   !> Write the `n` values that `buffer` points to.
   subroutine write_raw(file, path, first, n, memory_type, buffer, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(int64), intent(in) :: first, n
      integer(hid_t), intent(in) :: memory_type
      type(c_ptr), intent(in) :: buffer
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: dataset, memory, space
      integer :: ignored, status

      call h5dopen_f(file%id, path, dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
      if (allocated(error)) return
      call h5dget_space_f(dataset, space, status)
      if (status >= 0) call h5sselect_hyperslab_f(space, h5s_select_set_f, [int(first, hsize_t)], [int(n, hsize_t)], status)
      if (status >= 0) call h5screate_simple_f(1, [int(n, hsize_t)], memory, status)
      if (status >= 0) call h5dwrite_f(dataset, memory_type, buffer, status, memory, space)
      if (status >= 0) call h5sclose_f(memory, status)
      if (status >= 0) call h5sclose_f(space, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
      call h5dclose_f(dataset, ignored)
   end subroutine write_raw

end module razy_io_hdf5_part
