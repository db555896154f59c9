!! A file of 64-bit words that one program at a time may hold: words are appended, read at any place, and cut off at the end.
!!
!! The lock is flock() on the file itself: the kernel drops it when the program ends in whatever way, so none is left behind by
!! a kill. Appending goes through a Fortran unit, whose messages say why a write failed; the rest through POSIX.
module razy_io_locked_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_size_t
   use, intrinsic :: iso_fortran_env, only: int64
   use razy_core_error, only: error_t, raise
   use razy_io_posix, only: delete_file, synchronise
   implicit none(type, external)
   private

   public :: locked_file_t

   !> The file; open where `unit` is not -1.
   type :: locked_file_t
      character(:), allocatable :: path
      integer :: unit = -1
      !> Words in the file.
      integer(int64) :: length = 0
      type(c_ptr), private :: stream = c_null_ptr
      !> This program has written to it.
      logical, private :: changed = .false.
   contains
      procedure :: open => open_locked
      procedure :: is_empty
      procedure :: append
      procedure :: fetch
      procedure :: cut
      procedure :: flush_to_disk
      procedure :: close => close_file
      procedure :: remove
   end type locked_file_t

   integer, parameter :: bytes_per_word = 8
   !> LOCK_EX | LOCK_NB of flock, SEEK_END of lseek.
   integer(c_int), parameter :: lock_at_once = 6_c_int, from_end = 2_c_int

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

      character(200) :: reason
      type(c_ptr) :: other
      integer :: status
      integer(c_int) :: code
      logical :: current

      self%path = path
      self%changed = .false.
      do
         self%stream = c_fopen(path//c_null_char, "a+"//c_null_char)
         if (.not. c_associated(self%stream)) then
            call raise(error, path//": cannot be opened for writing")
            return
         end if
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
      open (newunit=self%unit, file=path, access="stream", form="unformatted", action="write", position="append", &
            iostat=status, iomsg=reason)
      if (status == 0) return
      self%unit = -1
      code = c_fclose(self%stream)
      self%stream = c_null_ptr
      call raise(error, path//": "//trim(reason))
   end subroutine open_locked

   !> There is not a single byte in the file.
   logical function is_empty(self)
      class(locked_file_t), intent(in) :: self

      is_empty = c_lseek(c_fileno(self%stream), 0_c_int64_t, from_end) == 0_c_int64_t
   end function is_empty

   !> Append words and hand them to the operating system: they survive the end of this program, whatever ends it.
   subroutine append(self, words, error)
      class(locked_file_t), intent(inout) :: self
      integer(int64), intent(in) :: words(:)
      type(error_t), allocatable, intent(out) :: error

      character(200) :: reason
      integer :: status

      self%changed = .true.
      write (self%unit, iostat=status, iomsg=reason) words
      if (status == 0) flush (self%unit, iostat=status, iomsg=reason)
      if (status == 0) then
         self%length = self%length + size(words, kind=int64)
      else
         call raise(error, self%path//": "//trim(reason))
      end if
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

      character(200) :: reason
      integer :: status

      if (c_ftruncate(c_fileno(self%stream), bytes_per_word*length) /= 0_c_int) then
         call raise(error, self%path//": cannot be shortened")
         return
      end if
      self%length = length
      ! The unit still stands at the old end.
      close (self%unit, iostat=status)
      open (newunit=self%unit, file=self%path, access="stream", form="unformatted", action="write", position="append", &
            iostat=status, iomsg=reason)
      if (status == 0) return
      self%unit = -1
      call raise(error, self%path//": "//trim(reason))
   end subroutine cut

   !> Wait until all words are on the disk itself.
   subroutine flush_to_disk(self, error)
      class(locked_file_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      call synchronise(self%path, error)
   end subroutine flush_to_disk

   !> Close the file, which keeps its first `length` words, and give up the lock; nothing if it is not open.
   subroutine close_file(self)
      class(locked_file_t), intent(inout) :: self

      integer :: status
      integer(c_int) :: code

      ! After a failed write the unit may try once more to get rid of what it has; that is cut off again.
      if (self%unit /= -1) close (self%unit, iostat=status)
      self%unit = -1
      if (.not. c_associated(self%stream)) return
      if (self%changed) then
         if (c_lseek(c_fileno(self%stream), 0_c_int64_t, from_end) > bytes_per_word*self%length) then
            code = c_ftruncate(c_fileno(self%stream), bytes_per_word*self%length)
         end if
      end if
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
