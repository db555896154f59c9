!! Whether a result can be written where the user wants it: asked before anything is computed.
module razy_io_output
   use razy_core_error, only: error_t, raise
   use razy_io_posix, only: is_directory, is_writable, parent_directory, path_exists
   implicit none(type, external)
   private

   public :: output_is_free, check_directory

contains

   !> Refuse a path that cannot become a result file: empty, in no writable directory, or taken and not to be overwritten.
   subroutine output_is_free(path, overwrite, error)
      character(*), intent(in) :: path
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      call check_directory(path, error)
      if (allocated(error)) return
      if (path_exists(trim(path)) .and. .not. overwrite) call raise(error, trim(path)//": exists already; --force overwrites it")
   end subroutine output_is_free

   !> Refuse a path that is no file name in a directory that can be written to.
   subroutine check_directory(path, error)
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: directory

      if (len_trim(path) == 0) then
         call raise(error, "the name of the output file is empty")
         return
      end if
      directory = parent_directory(trim(path))
      if (.not. path_exists(directory)) then
         call raise(error, trim(path)//": the directory "//directory//" does not exist")
      else if (.not. is_directory(directory)) then
         call raise(error, trim(path)//": "//directory//" is not a directory")
      else if (is_directory(trim(path))) then
         call raise(error, trim(path)//": is a directory, not a file")
      else if (.not. is_writable(directory)) then
         call raise(error, trim(path)//": the directory "//directory//" is not writable")
      end if
   end subroutine check_directory

end module razy_io_output
