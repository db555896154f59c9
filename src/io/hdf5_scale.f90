!! Dimension scales (the H5DS convention): which dataset holds the coordinates of which dimension.
module razy_io_hdf5_scale
   use h5ds, only: h5dsattach_scale_f, h5dsset_scale_f
   use hdf5, only: h5dclose_f, h5dopen_f, hid_t
   use razy_core_error, only: error_t
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_library, only: check_hdf5
   implicit none(type, external)
   private

   public :: make_scale, attach_scale

contains

   !> Make the dataset at `path` a dimension scale called `name`.
   subroutine make_scale(file, path, name, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, name
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: dataset
      integer :: status

      call h5dopen_f(file%id, path, dataset, status)
      if (status >= 0) call h5dsset_scale_f(dataset, status, name)
      if (status >= 0) call h5dclose_f(dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be made a dimension scale", error)
   end subroutine make_scale

   !> Attach the scale at the path `scale` to a dimension of the dataset at `path`, counted in the order of the file: slowest first.
   subroutine attach_scale(file, path, dimension, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, scale
      integer, intent(in) :: dimension
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, scale_dataset
      integer :: status

      call h5dopen_f(file%id, path, dataset, status)
      if (status >= 0) call h5dopen_f(file%id, scale, scale_dataset, status)
      if (status >= 0) call h5dsattach_scale_f(dataset, scale_dataset, dimension, status)
      if (status >= 0) call h5dclose_f(scale_dataset, status)
      if (status >= 0) call h5dclose_f(dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be given the dimension scale "//scale, error)
   end subroutine attach_scale

end module razy_io_hdf5_scale
