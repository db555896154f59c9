!! A whole text file as one string, with clean errors for what is not a readable text file.
module razy_core_text_file
   use, intrinsic :: iso_fortran_env, only: iostat_end
   use razy_core_error, only: complaint, error_t, raise
   use razy_core_number, only: to_text
   implicit none(type, external)
   private

   public :: read_text_file, clean_text

   !> More is no input file but a mistake.
   integer, parameter :: largest_file = 16*1024*1024

contains

   !> Read `file`; lines end with a line feed, whatever they end with in the file, and a byte-order mark is left out.
   !> Errors: missing, unreadable, a directory, not text, larger than 16 MiB.
   subroutine read_text_file(file, text, error)
      character(*), intent(in) :: file
      character(:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      character(256) :: reason
      character(:), allocatable :: bytes, problem
      integer :: iostat, unit
      logical :: exists

      inquire (file=file, exist=exists)
      if (len_trim(file) == 0 .or. .not. exists) then
         call raise(error, complaint(file, "", "", "", "there is no such file"))
         return
      end if
      inquire (file=file//"/.", exist=exists)
      if (exists) then
         call raise(error, complaint(file, "", "", "", "this is a directory, not an input file"))
         return
      end if
      open (newunit=unit, file=file, access="stream", form="unformatted", status="old", action="read", iostat=iostat, iomsg=reason)
      if (iostat /= 0) then
         call raise(error, complaint(file, "", "", "", "cannot be opened: "//trim(reason)))
         return
      end if
      call read_bytes(unit, bytes, problem)
      close (unit)
      if (allocated(problem)) then
         call raise(error, complaint(file, "", "", "", "cannot be read: "//problem))
      else if (len(bytes) > largest_file) then
         call raise(error, complaint(file, "", "", "", "is larger than an input file may be (16 MiB)"))
      else
         call clean_text(bytes, file, text, error)
      end if
   end subroutine read_text_file

   !> Read to the end of a file, or somewhat more than `largest_file` bytes of it.
   subroutine read_bytes(unit, bytes, problem)
      integer, intent(in) :: unit
      character(:), allocatable, intent(out) :: bytes
      !> Allocated when reading fails
      character(:), allocatable, intent(out) :: problem
      character(:), allocatable :: longer
      character(256) :: reason
      integer :: count, iostat

      allocate (character(4096) :: bytes)
      count = 0
      do
         if (count == len(bytes)) then
            allocate (character(2*count) :: longer)
            longer(:count) = bytes
            call move_alloc(longer, bytes)
         end if
         read (unit, iostat=iostat, iomsg=reason) bytes(count + 1:count + 1)
         if (iostat /= 0 .or. count > largest_file) exit
         count = count + 1
      end do
      bytes = bytes(:count)
      if (iostat /= 0 .and. iostat /= iostat_end) problem = trim(reason)
   end subroutine read_bytes

   !> Text with uniform line ends and without byte-order mark; an error where there is nothing or a control character.
   pure subroutine clean_text(bytes, file, text, error)
      character(*), intent(in) :: bytes
      !> Name for messages
      character(*), intent(in) :: file
      character(:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
      integer, parameter :: tab = 9, line_feed = 10, carriage_return = 13, blank = 32
      integer :: code, count, i, line, previous

      text = bytes
      count = 0
      line = 1
      previous = 0
      do i = merge(4, 1, index(bytes, byte_order_mark) == 1), len(bytes)
         code = ichar(bytes(i:i))
         if (code < blank .and. code /= tab .and. code /= line_feed .and. code /= carriage_return) then
            call raise(error, complaint(file//":"//to_text(line), "", "", "", &
                                        "this is not a text file (character with code "//to_text(code)//")"))
            return
         end if
         if (code == line_feed .or. code == carriage_return) then
            if (.not. (code == line_feed .and. previous == carriage_return)) then
               count = count + 1
               text(count:count) = achar(line_feed)
               line = line + 1
            end if
         else
            count = count + 1
            text(count:count) = bytes(i:i)
         end if
         previous = code
      end do
      text = text(:count)
      if (len_trim(text) == 0) call raise(error, complaint(file, "", "", "", "the file is empty"))
   end subroutine clean_text

end module razy_core_text_file
