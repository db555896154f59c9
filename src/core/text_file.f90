!! A whole text file as one string, with clean errors for what is not a readable text file.
module razy_core_text_file
   use, intrinsic :: iso_fortran_env, only: iostat_end
   use razy_core_error, only: error_t, refuse
   use razy_core_number, only: to_text
   use razy_core_text, only: excerpt, newline
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
      character(:), allocatable :: bytes, problem
      character(256) :: reason
      integer :: iostat, unit
      logical :: directory, exists

      inquire (file=file, exist=exists)
      inquire (file=file//"/.", exist=directory)
      if (len_trim(file) == 0 .or. .not. exists) then
         problem = "there is no such file"
         if (index(file, "/") == 0) problem = problem//" in the current folder"
      else if (directory) then
         problem = "this is a directory, not an input file"
      else
         open (newunit=unit, file=file, access="stream", form="unformatted", status="old", action="read", iostat=iostat, &
               iomsg=reason)
         if (iostat /= 0) problem = "cannot be opened: "//trim(reason)
      end if
      if (.not. allocated(problem)) then
         call read_bytes(unit, bytes, problem)
         close (unit)
      end if
      if (allocated(problem)) then
         call refuse(error, excerpt(file), problem)
      else
         call clean_text(bytes, file, text, error)
      end if
   end subroutine read_text_file

   !> Read to the end of a file, which may be a pipe; `problem` is allocated when that fails.
   subroutine read_bytes(unit, bytes, problem)
      integer, intent(in) :: unit
      character(:), allocatable, intent(out) :: bytes, problem
      character(:), allocatable :: longer
      character(256) :: reason
      integer :: count, iostat

      allocate (character(4096) :: bytes)
      do count = 0, largest_file
         if (count == len(bytes)) then
            allocate (character(2*count) :: longer)
            longer(:count) = bytes
            call move_alloc(longer, bytes)
         end if
         read (unit, iostat=iostat, iomsg=reason) bytes(count + 1:count + 1)
         if (iostat /= 0) exit
      end do
      bytes = bytes(:min(count, largest_file))
      if (iostat == 0) problem = "is larger than an input file may be (16 MiB)"
      if (iostat /= 0 .and. iostat /= iostat_end) problem = "cannot be read: "//trim(reason)
   end subroutine read_bytes

   !> Text with uniform line ends and without byte-order mark; an error where there is nothing or a control character. `file` is
   !> the name for messages.
   pure subroutine clean_text(bytes, file, text, error)
      character(*), intent(in) :: bytes, file
      character(:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191), tab = achar(9), return = achar(13)
      integer :: count, i, line

      text = bytes
      count = 0
      line = 1
      do i = merge(4, 1, index(bytes, byte_order_mark) == 1), len(bytes)
         if (bytes(i:i) < " " .and. scan(bytes(i:i), tab//newline//return) == 0) then
            call refuse(error, file//":"//to_text(line), &
                        "this is not a text file (character with code "//to_text(ichar(bytes(i:i)))//")")
            return
         end if
         ! a line that ends with a carriage return and a line feed ends once
         if (bytes(i:i) == newline .and. bytes(max(1, i - 1):max(1, i - 1)) == return) cycle
         count = count + 1
         text(count:count) = merge(newline, bytes(i:i), bytes(i:i) == return)
         if (text(count:count) == newline) line = line + 1
      end do
      text = text(:count)
      if (len_trim(text) == 0) call refuse(error, file, "the file is empty")
   end subroutine clean_text

end module razy_core_text_file
