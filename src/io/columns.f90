!! Named columns of numbers from a file: comma-separated text, or HDF5.
!!
!! Text is that of razy_core_text_columns. A column of an HDF5 file is a dataset with one dimension, named by its path from the
!! root.
module razy_io_columns
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
   use hdf5, only: h5dclose_f, h5dget_space_f, h5dopen_f, h5dread_f, h5f_acc_rdonly_f, h5fclose_f, h5fopen_f, h5lexists_f, &
                   h5sclose_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5t_native_double, hid_t, hsize_t
   use razy_core_error, only: complaint, error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: excerpt, lower, string_t
   use razy_core_text_columns, only: read_text_columns
   use razy_io_hdf5_library, only: check_hdf5, start_hdf5
   implicit none(type, external)
   private

   public :: read_columns

   !> Values that a column may have.
   integer(i8), parameter :: most_values = 100000000_i8

contains

   !> Read the columns `names` of a file into `values` (rows, columns); a file whose name ends with `.csv` or `.txt` is text, any
   !> other HDF5.
   !>
   !> Errors, with the line where there are lines: no such file or column, no rows, columns of unequal lengths, what is no finite
   !> number.
   subroutine read_columns(file, names, values, error)
      character(*), intent(in) :: file
      type(string_t), intent(in) :: names(:)
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: ending
      integer :: dot

      dot = index(file, ".", back=.true.)
      ending = lower(file(max(dot, 1):))
      if (ending == ".csv" .or. ending == ".txt") then
         call read_text_columns(file, names, values, error)
      else
         call read_hdf5(file, names, values, error)
      end if
      if (allocated(error)) return
      if (size(values, 1) == 0) call refuse(error, file, "has no rows of numbers")
   end subroutine read_columns

   !> The columns of an HDF5 file.
   subroutine read_hdf5(file, names, values, error)
      character(*), intent(in) :: file
      type(string_t), intent(in) :: names(:)
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: column(:)
      integer(hid_t) :: id
      integer :: k, status
      logical :: exists

      inquire (file=file, exist=exists)
      if (.not. exists) then
         call refuse(error, excerpt(file), "there is no such file")
         return
      end if
      call start_hdf5(error)
      if (allocated(error)) return
      call h5fopen_f(file, h5f_acc_rdonly_f, id, status)
      call check_hdf5(status, excerpt(file)//": is neither text (.csv, .txt) nor an HDF5 file that can be read", error)
      if (allocated(error)) return
      do k = 1, size(names)
         call read_dataset(file, id, names(k)%text, column, error)
         if (allocated(error)) exit
         if (k == 1) allocate (values(size(column), size(names)))
         if (size(column) /= size(values, 1)) then
            call refuse(error, file, "'"//excerpt(names(k)%text)//"' and '"//excerpt(names(1)%text)//"' have unequal lengths")
            exit
         end if
         values(:, k) = column
      end do
      call h5fclose_f(id, status)
   end subroutine read_hdf5

   !> One dataset with one dimension, all of whose values are finite.
   subroutine read_dataset(file, id, name, column, error)
      character(*), intent(in) :: file, name
      integer(hid_t), intent(in) :: id
      real(wp), allocatable, target, intent(out) :: column(:)
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: set, space
      integer(hsize_t) :: length(1), most(1)
      type(c_ptr) :: buffer
      integer :: dimensions, status
      integer(i8) :: i
      logical :: there

      call h5lexists_f(id, name, there, status)
      if (status < 0 .or. .not. there) then
         call refuse(error, file, "has no dataset '"//excerpt(name)//"'")
         return
      end if
      call h5dopen_f(id, name, set, status)
      call check_hdf5(status, file//": '"//excerpt(name)//"' is no dataset", error)
      if (allocated(error)) return
      call h5dget_space_f(set, space, status)
      call h5sget_simple_extent_ndims_f(space, dimensions, status)
      if (dimensions == 1) then
         call h5sget_simple_extent_dims_f(space, length, most, status)
         if (length(1) > most_values) then
            call refuse(error, file, "'"//excerpt(name)//"' has more than 1e8 values")
         else
            allocate (column(length(1)))
            buffer = c_loc(column)
            call h5dread_f(set, h5t_native_double, buffer, status)
            call check_hdf5(status, file//": '"//excerpt(name)//"' cannot be read as real numbers", error)
         end if
      else
         call refuse(error, file, "'"//excerpt(name)//"' has not one dimension")
      end if
      call h5sclose_f(space, status)
      call h5dclose_f(set, status)
      if (allocated(error)) return
      do i = 1, size(column, kind=i8)
         if (ieee_is_finite(column(i))) cycle
         call refuse(error, file, "'"//excerpt(name)//"' has a value that is not finite at place "//to_text(i - 1)// &
                     ", from 0")
         return
      end do
   end subroutine read_dataset

   !> Refuse a file with one line.
   pure subroutine refuse(error, file, what)
      type(error_t), allocatable, intent(out) :: error
      character(*), intent(in) :: file, what

      call raise(error, complaint(file, "", "", "", what))
   end subroutine refuse

end module razy_io_columns
