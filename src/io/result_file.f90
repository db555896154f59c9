!! Result files: which program of which version made them from which input, and tables of named columns (razy_core_table).
module razy_io_result_file
   use razy_core_error, only: error_t, raise
   use razy_core_table, only: table_t
   use razy_core_version, only: razy_git_commit, razy_version
   use razy_io_hdf5_column, only: write_attribute, write_table
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_posix, only: check_path, path_exists
   use razy_io_stored_file, only: text_of_root
   implicit none(type, external)
   private

   public :: begin_result, check_name, check_output, has_header, new_header, result_header_t, write_result

   !> What the root group says; made by `new_header`.
   type :: result_header_t
      !> Name of the program, such as `razy-sweep`; title of the scene; the effective input, of any length.
      character(:), allocatable :: program, title, input
      !> Method of integration, and what it does about jumps and kinks of contact laws.
      character(:), allocatable :: integrator, treatment
   end type result_header_t

contains

   !> What every result file says of the program and the input that made it.
   pure function new_header(program, title, integrator, treatment, input) result(header)
      character(*), intent(in) :: program, title, integrator, treatment, input
      type(result_header_t) :: header

      header%program = program
      header%title = title
      header%integrator = trim(integrator)
      header%treatment = trim(treatment)
      header%input = input
   end function new_header

   !> Refuse a path that cannot become a result of `program`, asked before anything is computed. Only a result of the same program
   !> is overwritten: by default all programs name their files after the input.
   subroutine check_output(path, program, overwrite, error)
      character(*), intent(in) :: path, program
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: other

      call check_path(path, error)
      if (allocated(error)) return
      if (.not. path_exists(path)) return
      other = text_of_root(path, "program")
      if (other == program) then
         if (.not. overwrite) call raise(error, path//": exists already; --force overwrites it")
      else if (len(other) == 0) then
         call raise(error, path//": is no result of razy, and is not overwritten; name another --output, or delete it")
      else
         call raise(error, path//": is a result of "//other//", which "//program//" does not overwrite; name another --output, "// &
                    "or delete it")
      end if
   end subroutine check_output

   !> Whether there is a result file which this build of the same program made of the same input.
   logical function has_header(path, header)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header

      has_header = text_of_root(path, "program") == header%program
      if (has_header) has_header = text_of_root(path, "razy_version") == razy_version
      if (has_header) has_header = text_of_root(path, "git_commit") == razy_git_commit
      if (has_header) has_header = text_of_root(path, "input") == header%input
   end function has_header

   !> Write a whole file under a temporary name, then give it its own.
   subroutine write_result(path, header, table, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(table_t), intent(in) :: table
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      type(hdf5_file_t) :: file

      call begin_result(file, path, header, table, error)
      if (.not. allocated(error)) call file%commit(overwrite, error)
   end subroutine write_result

   !> Begin a file with its header and a table.
   subroutine begin_result(file, path, header, table, error)
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(table_t), intent(in) :: table
      type(error_t), allocatable, intent(out) :: error

      call file%create(path, error)
      if (allocated(error)) return
      call write_attribute(file, "/", "razy_version", razy_version, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "git_commit", razy_git_commit, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "program", header%program, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "title", header%title, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "integrator", header%integrator, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "treatment", header%treatment, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "input", header%input, error)
      if (.not. allocated(error)) call write_table(file, table, error)
      if (allocated(error)) call file%discard()
   end subroutine begin_result

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

end module razy_io_result_file
