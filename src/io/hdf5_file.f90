!! An HDF5 file under construction: it has a temporary name until it is complete.
!!
!! `create`, then what razy_io_hdf5_column offers, then `commit`; after any error
!! `discard`. A file object that is neither committed nor discarded leaves its partial file behind.
module razy_io_hdf5_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_null_char, c_null_ptr, c_ptr
   use hdf5, only: h5f_acc_trunc_f, h5f_close_strong_f, h5f_libver_latest_f, h5f_libver_v18_f, h5f_scope_global_f, h5fclose_f, &
                   h5fcreate_f, h5fflush_f, h5p_crt_order_indexed_f, h5p_crt_order_tracked_f, h5p_file_access_f, &
                   h5p_file_create_f, h5pclose_f, h5pcreate_f, h5pset_fclose_degree_f, h5pset_libver_bounds_f, &
                   h5pset_obj_track_times_f, &
                   h5pset_link_creation_order_f, hid_t
   use razy_core_error, only: error_t, raise
   use razy_core_number, only: to_text
   use razy_io_hdf5_library, only: check_hdf5, start_hdf5
   use razy_io_posix, only: c_fclose, c_fileno, c_flock, c_fopen, check_directory, claim, delete_file, lock_at_once, lock_shared, &
                            parent_directory, path_exists, publish, synchronise
   implicit none(type, external)
   private

   public :: delete_partial_files, hdf5_file_t

   !> The file; open where `id` is not negative.
   type :: hdf5_file_t
      !> Identifier for the calls of the HDF5 library.
      integer(hid_t) :: id = -1_hid_t
      !> Final name.
      character(:), allocatable :: path
      !> Name until `commit`.
      character(:), allocatable :: partial
      !> The folder, which all hold by a shared lock who write a file in it.
      type(c_ptr), private :: folder = c_null_ptr
   contains
      procedure :: create
      procedure :: commit
      procedure :: discard
   end type hdf5_file_t

   integer, parameter :: most_partial_files = 99

contains

   !> Create the file under a temporary name beside the final one that no other run uses.
   subroutine create(self, path, error)
      class(hdf5_file_t), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      integer :: attempt
      logical :: claimed

      if (self%id >= 0_hid_t) call raise(error, trim(path)//": the file object still holds "//self%partial)
      if (.not. allocated(error)) call check_directory(path, error)
      if (.not. allocated(error)) call start_hdf5(error)
      if (allocated(error)) return
      self%path = trim(path)
      call hold_folder(self)
      do attempt = 1, most_partial_files
         self%partial = partial_name(self%path, attempt)
         call claim(self%partial, claimed)
         if (claimed) exit
         if (path_exists(self%partial)) cycle
         call raise(error, self%partial//" cannot be created")
         return
      end do
      if (claimed) then
         call create_file(self%partial, self%id, error)
         if (allocated(error)) call self%discard()
      else
         call raise(error, self%path//": "//self%partial//" and those before it exist; delete what killed runs left behind")
      end if
   end subroutine create

   !> Take part in the lock of the folder, which the kernel drops when the program ends in whatever way. Who is alone with it for a
   !> moment deletes what killed runs left of this file; where folders know no locks it stays.
   subroutine hold_folder(self)
      class(hdf5_file_t), intent(inout) :: self
      integer(c_int) :: status

      self%folder = c_fopen(parent_directory(self%path)//c_null_char, "r"//c_null_char)
      if (.not. c_associated(self%folder)) return
      if (c_flock(c_fileno(self%folder), lock_at_once) == 0_c_int) call delete_partial_files(self%path)
      status = c_flock(c_fileno(self%folder), lock_shared)
   end subroutine hold_folder

   subroutine release_folder(self)
      class(hdf5_file_t), intent(inout) :: self
      integer(c_int) :: status

      if (c_associated(self%folder)) status = c_fclose(self%folder)
      self%folder = c_null_ptr
   end subroutine release_folder

   pure function partial_name(path, attempt) result(name)
      character(*), intent(in) :: path
      integer, intent(in) :: attempt
      character(:), allocatable :: name

      name = path//".partial"
      if (attempt > 1) name = path//"."//to_text(attempt)//".partial"
   end function partial_name

   !> Delete what killed runs left of this file; nobody else may be at work on it.
   subroutine delete_partial_files(path)
      character(*), intent(in) :: path

      integer :: attempt
      logical :: deleted

      do attempt = 1, most_partial_files
         call delete_file(partial_name(path, attempt), deleted)
      end do
   end subroutine delete_partial_files

   !> Make the claimed file an HDF5 file; groups remember the order in which their members were made.
   subroutine create_file(path, id, error)
      character(*), intent(in) :: path
      integer(hid_t), intent(out) :: id
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: access, creation
      integer :: status

      id = -1_hid_t
      call h5pcreate_f(h5p_file_access_f, access, status)
      if (status >= 0) call h5pset_libver_bounds_f(access, h5f_libver_v18_f, h5f_libver_latest_f, status)
      if (status >= 0) call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)
      if (status >= 0) call h5pcreate_f(h5p_file_create_f, creation, status)
      if (status >= 0) call h5pset_obj_track_times_f(creation, .false., status)
      if (status >= 0) call h5pset_link_creation_order_f(creation, ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f), status)
      if (status >= 0) call h5fcreate_f(path, h5f_acc_trunc_f, id, status, creation, access)
      call check_hdf5(status, path//" cannot be written", error)
      if (allocated(error)) return
      call h5pclose_f(access, status)
      if (status >= 0) call h5pclose_f(creation, status)
      call check_hdf5(status, path//" cannot be written", error)
   end subroutine create_file

   !> Close the file and give it its final name; on failure it is discarded, unless only the naming failed.
   subroutine commit(self, overwrite, error)
      class(hdf5_file_t), intent(inout) :: self
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: unsupported
      integer :: status

      call h5fflush_f(self%id, h5f_scope_global_f, status)
      call check_hdf5(status, self%path//" cannot be written", error)
      if (.not. allocated(error)) then
         call h5fclose_f(self%id, status)
         call check_hdf5(status, self%path//" cannot be closed", error)
         ! A second attempt at closing crashes the library.
         self%id = -1_hid_t
      end if
      if (.not. allocated(error)) call synchronise(self%partial, error)
      if (allocated(error)) then
         call self%discard()
         return
      end if
      call publish(self%partial, self%path, overwrite, error)
      call release_folder(self)
      ! Some file systems cannot flush a directory; the file itself is on the disk.
      if (.not. allocated(error)) call synchronise(parent_directory(self%path), unsupported)
   end subroutine commit

   !> Close the file, if it is open, and delete what was written.
   subroutine discard(self)
      class(hdf5_file_t), intent(inout) :: self
      integer :: status
      logical :: deleted

      if (self%id >= 0_hid_t) call h5fclose_f(self%id, status)
      self%id = -1_hid_t
      if (allocated(self%partial)) call delete_file(self%partial, deleted)
      call release_folder(self)
   end subroutine discard

end module razy_io_hdf5_file
