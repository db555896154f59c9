!! The few file operations of POSIX that Fortran lacks: what a path is, whether a result can be written there (asked before
!! anything is computed), and publishing a finished file atomically.
module razy_io_posix
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_int64_t, c_null_char, c_ptr, c_size_t
   use razy_core_error, only: error_t, raise
   use razy_core_text, only: excerpt, string_t
   implicit none(type, external)
   private

   public :: c_fclose, c_fileno, c_flock, c_fopen, lock_at_once, lock_shared
   public :: check_directory, check_distinct, check_path, claim, delete_file, last_failure, parent_directory, path_exists, &
             publish, synchronise

   !> LOCK_EX | LOCK_NB and LOCK_SH of flock.
   integer(c_int), parameter :: lock_at_once = 6_c_int, lock_shared = 1_c_int
   integer(c_int), parameter :: mode_exists = 0_c_int
   integer(c_int), parameter :: mode_write_and_search = 3_c_int
   !> What `c_look_up` finds, and whether links are followed.
   integer(c_int), parameter :: nothing = 0_c_int, no_file = 2_c_int, the_link_itself = 0_c_int, what_it_leads_to = 1_c_int
   !> Names may have 255 characters; those of checkpoints and unfinished files are up to 11 longer than that of the result.
   integer, parameter :: longest_name = 244
   integer, parameter :: longest_reason = 200

   ! allow(assumed-size)
   interface
      function c_fopen(path, mode) result(stream) bind(C, name="fopen")
         import :: c_char, c_ptr
         implicit none(type, external)
         character(kind=c_char), intent(in) :: path(*), mode(*)
         type(c_ptr) :: stream
      end function c_fopen

      function c_fclose(stream) result(status) bind(C, name="fclose")
         import :: c_int, c_ptr
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: stream
         integer(c_int) :: status
      end function c_fclose

      function c_fileno(stream) result(descriptor) bind(C, name="fileno")
         import :: c_int, c_ptr
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: stream
         integer(c_int) :: descriptor
      end function c_fileno

      function c_flock(descriptor, operation) result(status) bind(C, name="flock")
         import :: c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor, operation
         integer(c_int) :: status
      end function c_flock

      function c_access(path, mode) result(status) bind(C, name="access")
         import :: c_char, c_int
         implicit none(type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value, intent(in) :: mode
         integer(c_int) :: status
      end function c_access

      !> Of look_up.c.
      function c_look_up(path, followed, identity) result(kind) bind(C, name="razy_look_up")
         import :: c_char, c_int, c_int64_t
         implicit none(type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value, intent(in) :: followed
         integer(c_int64_t), intent(inout) :: identity(2)
         integer(c_int) :: kind
      end function c_look_up

      !> Of look_up.c.
      subroutine c_reason(text, length) bind(C, name="razy_reason")
         import :: c_char, c_size_t, longest_reason
         implicit none(type, external)
         character(kind=c_char), intent(inout) :: text(longest_reason)
         integer(c_size_t), value, intent(in) :: length
      end subroutine c_reason

      function c_link(from, to) result(status) bind(C, name="link")
         import :: c_char, c_int
         implicit none(type, external)
         character(kind=c_char), intent(in) :: from(*), to(*)
         integer(c_int) :: status
      end function c_link

      function c_rename(from, to) result(status) bind(C, name="rename")
         import :: c_char, c_int
         implicit none(type, external)
         character(kind=c_char), intent(in) :: from(*), to(*)
         integer(c_int) :: status
      end function c_rename

      function c_unlink(path) result(status) bind(C, name="unlink")
         import :: c_char, c_int
         implicit none(type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: status
      end function c_unlink

      function c_fsync(descriptor) result(status) bind(C, name="fsync")
         import :: c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor
         integer(c_int) :: status
      end function c_fsync
   end interface

contains

   !> Refuse a path that cannot become a result file: empty, in no writable directory, or taken by what is no file (a device, a
   !> pipe, a link).
   subroutine check_path(path, error)
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      integer(c_int64_t) :: identity(2)

      call check_directory(path, error)
      if (allocated(error)) return
      if (c_look_up(trim(path)//c_null_char, the_link_itself, identity) == no_file) then
         call raise(error, trim(path)//": is a link or a device, not a file that can be replaced")
      end if
   end subroutine check_path

   !> Refuse a command two of whose files are the same.
   subroutine check_distinct(paths, error)
      type(string_t), intent(in) :: paths(:)
      type(error_t), allocatable, intent(out) :: error

      integer :: i, k

      do i = 2, size(paths)
         do k = 1, i - 1
            if (.not. same_file(paths(k)%text, paths(i)%text)) cycle
            call raise(error, paths(i)%text//": is "//paths(k)%text//", which this command needs for something else")
            return
         end do
      end do
   end subroutine check_distinct

   !> Whether two paths lead to the same file, or would if there were one.
   function same_file(first, second) result(same)
      character(*), intent(in) :: first, second
      logical :: same

      integer(c_int64_t) :: a(2), b(2)
      logical :: found(2)

      found = [exists(first, a), exists(second, b)]
      same = found(1) .eqv. found(2)
      if (.not. any(found)) then
         same = first(index(first, "/", back=.true.) + 1:) == second(index(second, "/", back=.true.) + 1:)
         found = [exists(parent_directory(first), a), exists(parent_directory(second), b)]
      end if
      same = same .and. all(found)
      if (same) same = all(a == b)

   contains

      logical function exists(path, identity)
         character(*), intent(in) :: path
         integer(c_int64_t), intent(inout) :: identity(2)

         exists = c_look_up(path//c_null_char, what_it_leads_to, identity) /= nothing
      end function exists

   end function same_file

   !> Refuse a path that is no file name in a directory that can be written to.
   subroutine check_directory(path, error)
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: directory

      if (len_trim(path) == 0) call raise(error, "the name of the output file is empty")
      if (allocated(error)) return
      directory = parent_directory(trim(path))
      if (.not. path_exists(directory)) then
         call raise(error, excerpt(trim(path))//": the directory "//excerpt(directory)//" does not exist")
      else if (.not. is_directory(directory)) then
         call raise(error, trim(path)//": "//directory//" is not a directory")
      else if (is_directory(trim(path))) then
         call raise(error, trim(path)//": is a directory, not a file")
      else if (c_access(directory//c_null_char, mode_write_and_search) /= 0_c_int) then
         call raise(error, trim(path)//": the directory "//directory//" is not writable")
      else if (len_trim(path) - index(path, "/", back=.true.) > longest_name) then
         call raise(error, excerpt(trim(path))//": a name of more than 244 characters leaves no room for the ends of others")
      end if
   end subroutine check_directory

   !> Whether the path names anything at all: a file, a directory, a device.
   function path_exists(path) result(exists)
      character(*), intent(in) :: path
      logical :: exists

      exists = c_access(path//c_null_char, mode_exists) == 0_c_int
   end function path_exists

   !> Whether the path names a directory.
   function is_directory(path) result(directory)
      character(*), intent(in) :: path
      logical :: directory

      directory = path_exists(path//"/")
   end function is_directory

   !> The directory that holds the path; `.` where the path has none.
   pure function parent_directory(path) result(directory)
      character(*), intent(in) :: path
      character(:), allocatable :: directory
      integer :: slash

      slash = index(path, "/", back=.true.)
      directory = "."
      if (slash > 0) directory = path(:max(1, slash - 1))
   end function parent_directory

   !> Create an empty file of this name; `claimed` is false where something has the name or no file can be created.
   subroutine claim(path, claimed)
      character(*), intent(in) :: path
      logical, intent(out) :: claimed
      type(c_ptr) :: stream

      stream = c_fopen(path//c_null_char, "wx"//c_null_char)
      claimed = c_associated(stream)
      if (claimed) claimed = c_fclose(stream) == 0_c_int
   end subroutine claim

   !> Remove the file; `deleted` is false where that fails.
   subroutine delete_file(path, deleted)
      character(*), intent(in) :: path
      logical, intent(out) :: deleted

      deleted = c_unlink(path//c_null_char) == 0_c_int
   end subroutine delete_file

   !> Why the last call of the system failed, in its words.
   function last_failure() result(reason)
      character(:), allocatable :: reason

      character(longest_reason) :: text

      text = c_null_char
      call c_reason(text, int(len(text), c_size_t))
      reason = text(:index(text, c_null_char) - 1)
   end function last_failure

   !> Have what was written to the file or directory on the disk itself.
   subroutine synchronise(path, error)
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: stream
      integer(c_int) :: sync_status, close_status

      stream = c_fopen(path//c_null_char, "r"//c_null_char)
      if (.not. c_associated(stream)) call raise(error, path//": cannot be opened to flush it to the disk")
      if (allocated(error)) return
      sync_status = c_fsync(c_fileno(stream))
      close_status = c_fclose(stream)
      if (sync_status /= 0_c_int .or. close_status /= 0_c_int) call raise(error, path//": cannot be flushed to the disk")
   end subroutine synchronise

   !> Give the finished file its final name; without `overwrite` an existing file of that name is kept and is an error.
   !>
   !> link() is atomic and refuses an existing name; where the file system has no hard links, rename() follows a check.
   subroutine publish(partial, final, overwrite, error)
      character(*), intent(in) :: partial, final
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      logical :: done, deleted

      done = .false.
      if (.not. overwrite) then
         done = c_link(partial//c_null_char, final//c_null_char) == 0_c_int
         if (done) then
            call delete_file(partial, deleted)
         else if (path_exists(final)) then
            call raise(error, final//": exists already; the new result is in "//partial)
         end if
      end if
      if (.not. done .and. .not. allocated(error)) then
         done = c_rename(partial//c_null_char, final//c_null_char) == 0_c_int
         if (.not. done) call raise(error, final//": cannot be given its name; the new result is in "//partial)
      end if
   end subroutine publish

end module razy_io_posix
