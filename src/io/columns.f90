!! Named columns of numbers from a file: comma-separated text, or HDF5.
!!
!! Text is that of razy_core_text_columns. A column of an HDF5 file is a dataset with one dimension, named by its path from the
!! root.
module razy_io_columns
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_error, only: error_t, refuse
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: excerpt, lower, string_t
   use razy_core_text_columns, only: read_text_columns
   use razy_io_stored_file, only: stored_file_t
   implicit none(type, external)
   private

   public :: read_columns

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

      type(stored_file_t) :: stored
      real(wp), allocatable :: column(:)
      integer :: k

      call stored%begin_reading(file, "is neither text (.csv, .txt) nor an HDF5 file that can be read", error)
      if (allocated(error)) return
      do k = 1, size(names)
         call read_column(file, stored, names(k)%text, column, error)
         if (allocated(error)) exit
         if (k == 1) allocate (values(size(column), size(names)))
         if (size(column) /= size(values, 1)) then
            call refuse(error, file, "'"//excerpt(names(k)%text)//"' and '"//excerpt(names(1)%text)//"' have unequal lengths")
            exit
         end if
         values(:, k) = column
      end do
      call stored%end_reading()
   end subroutine read_hdf5

   !> One dataset with one dimension, all of whose values are finite.
   subroutine read_column(file, stored, name, column, error)
      character(*), intent(in) :: file, name
      type(stored_file_t), intent(in) :: stored
      real(wp), allocatable, intent(out) :: column(:)
      type(error_t), allocatable, intent(out) :: error

      integer(i8), allocatable :: shape(:)
      integer(i8) :: i

      call stored%read_numbers(name, column, shape, error)
      if (allocated(error)) return
      if (size(shape) /= 1) call refuse(error, file, "'"//excerpt(name)//"' has not one dimension")
      if (allocated(error)) return
      do i = 1, size(column, kind=i8)
         if (ieee_is_finite(column(i))) cycle
         call refuse(error, file, "'"//excerpt(name)//"' has a value that is not finite at place "//to_text(i - 1)// &
                     ", from 0")
         return
      end do
   end subroutine read_column

end module razy_io_columns
