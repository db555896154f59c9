!! A file of 64-bit words that one program at a time may hold: words are appended, read at any place, and cut off at the end.
!!
!! The lock is flock() on the file itself: the kernel drops it when the program ends in whatever way, so none is left behind by
!! a kill. All goes through POSIX: FLUSH of gfortran 12 gives no error where the words did not reach the file.
module razy_io_locked_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr, &
                                                                             c_size_t
   use, intrinsic :: iso_fortran_env, only: int64, int8
   use razy_core_error, only: error_t, raise
   use razy_io_posix, only: c_fclose, c_fileno, c_flock, c_fopen, delete_file, last_failure, lock_at_once
   implicit none(type, external)
   private

   public :: locked_file_t

   !> The file.
   type :: locked_file_t
      character(:), allocatable :: path
      !> Words in the file.
      integer(int64) :: length = 0
      type(c_ptr), private :: stream = c_null_ptr
   contains
      procedure :: open => open_locked
      procedure :: is_empty
      procedure :: append
      procedure :: fetch
      procedure :: cut
      procedure :: close => close_file
      procedure :: remove
   end type locked_file_t

   integer, parameter :: bytes_per_word = 8
   !> SEEK_END of lseek.
   integer(c_int), parameter :: from_end = 2_c_int

   interface
      function c_ftruncate(descriptor, length) result(status) bind(C, name="ftruncate")
         import :: c_int, c_int64_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor
         integer(c_int64_t), value, intent(in) :: length
         integer(c_int) :: status
      end function c_ftruncate

      function c_lseek(descriptor, offset, whence) result(place) bind(C, name="lseek")
         import :: c_int, c_int64_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor, whence
         integer(c_int64_t), value, intent(in) :: offset
         integer(c_int64_t) :: place
      end function c_lseek

      function c_write(descriptor, buffer, bytes) result(written) bind(C, name="write")
         import :: c_int, c_ptr, c_size_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor
         type(c_ptr), value, intent(in) :: buffer
         integer(c_size_t), value, intent(in) :: bytes
         integer(c_size_t) :: written
      end function c_write

      function c_pread(descriptor, buffer, bytes, offset) result(got) bind(C, name="pread")
         import :: c_int, c_int64_t, c_ptr, c_size_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: descriptor
         type(c_ptr), value, intent(in) :: buffer
         integer(c_size_t), value, intent(in) :: bytes
         integer(c_int64_t), value, intent(in) :: offset
         integer(c_size_t) :: got
      end function c_pread
   end interface

contains

   !> Open the file, which is made if it does not exist, and lock it.
   !>
   !> Errors: it cannot be opened, another program holds it, or its file system has no locks.
   subroutine open_locked(self, path, error)
      class(locked_file_t), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      type(c_ptr) :: other
      integer(c_int) :: code
      logical :: current

      self%path = path
      do
         self%stream = c_fopen(path//c_null_char, "a+"//c_null_char)
         if (.not. c_associated(self%stream)) call raise(error, path//": cannot be opened for writing")
         if (allocated(error)) return
         if (c_flock(c_fileno(self%stream), lock_at_once) /= 0_c_int) then
            code = c_fclose(self%stream)
            self%stream = c_null_ptr
            call raise(error, path//": another run is at work on this output (or the file system knows no locks)")
            return
         end if
         ! The holder before may have deleted the file that was locked: the lock counts if the path leads to it still.
         other = c_fopen(path//c_null_char, "r"//c_null_char)
         current = c_associated(other)
         if (current) then
            current = c_flock(c_fileno(other), lock_at_once) /= 0_c_int
            code = c_fclose(other)
         end if
         if (current) exit
         code = c_fclose(self%stream)
      end do
      self%length = c_lseek(c_fileno(self%stream), 0_c_int64_t, from_end)/bytes_per_word
   end subroutine open_locked

   !> There is not a single byte in the file.
   logical function is_empty(self)
      class(locked_file_t), intent(in) :: self

      is_empty = c_lseek(c_fileno(self%stream), 0_c_int64_t, from_end) == 0_c_int64_t
   end function is_empty

   !> Append words and hand them to the operating system: they survive the end of this program, whatever ends it. If there is
   !> no room for all of them, the first ones are kept.
   subroutine append(self, words, error)
      class(locked_file_t), intent(inout) :: self
      integer(int64), contiguous, target, intent(in) :: words(:)
      type(error_t), allocatable, intent(out) :: error

      integer(int8), pointer :: bytes(:)
      integer(int64) :: done, n, written

      n = bytes_per_word*size(words, kind=int64)
      if (n == 0) return
      call c_f_pointer(c_loc(words), bytes, [n])
      done = 0
      do while (done < n)
         written = c_write(c_fileno(self%stream), c_loc(bytes(done + 1)), int(n - done, c_size_t))
         if (written <= 0) then
            self%length = self%length + done/bytes_per_word
            call raise(error, self%path//": "//last_failure())
            return
         end if
         done = done + written
      end do
      self%length = self%length + size(words, kind=int64)
   end subroutine append

   !> Read words that begin behind the first `offset` ones; `got` of them are there.
   subroutine fetch(self, offset, words, got)
      class(locked_file_t), intent(in) :: self
      integer(int64), intent(in) :: offset
      integer(int64), contiguous, target, intent(out) :: words(:)
      integer(int64), intent(out) :: got

      integer(c_size_t) :: bytes

      got = 0
      if (size(words) == 0) return
      bytes = c_pread(c_fileno(self%stream), c_loc(words), bytes_per_word*size(words, kind=c_size_t), bytes_per_word*offset)
      got = max(0_int64, int(bytes, int64)/bytes_per_word)
   end subroutine fetch

   !> Keep the first `length` words only.
   subroutine cut(self, length, error)
      class(locked_file_t), intent(inout) :: self
      integer(int64), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      if (c_ftruncate(c_fileno(self%stream), bytes_per_word*length) /= 0_c_int) then
         call raise(error, self%path//": cannot be shortened")
         return
      end if
      self%length = length
   end subroutine cut

   !> Close the file and give up the lock; nothing if it is not open. What a full disk let no word become is no part of `length`.
   subroutine close_file(self)
      class(locked_file_t), intent(inout) :: self

      integer(c_int) :: code

      if (.not. c_associated(self%stream)) return
      code = c_fclose(self%stream)
      self%stream = c_null_ptr
   end subroutine close_file

   !> Delete the file and give up the lock.
   subroutine remove(self, error)
      class(locked_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      logical :: deleted

      call delete_file(self%path, deleted)
      call self%close()
      if (.not. deleted) call raise(error, self%path//": cannot be deleted")
   end subroutine remove

end module razy_io_locked_file
