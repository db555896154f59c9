!! Initial states that &starts takes from a file.
module sweep_start_file
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower, newline, string_t
   use razy_io_columns, only: read_columns
   use razy_io_journal, only: checksum
   implicit none(type, external)
   private

   public :: identity_of, read_start_file

contains

   !> Read the file of starts, if there is one: all first numbers of &start_range, then all second ones. (ranges*starts)
   subroutine read_start_file(numbers, input, error)
      real(wp), allocatable, intent(out) :: numbers(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: columns(:)
      character(:), allocatable :: file, method, quantity
      real(wp), allocatable :: values(:, :)
      integer :: i

      allocate (numbers(0))
      if (input%count("starts") == 0) return
      call input%get("starts", 1, "method", method)
      if (lower(method) /= "file") return
      if (.not. input%given("starts", 1, "file")) then
         call input%complain(error, "starts", 1, "file", "required for method = 'file'")
         return
      end if
      call input%get("starts", 1, "file", file)
      allocate (columns(input%count("start_range")))
      do i = 1, size(columns)
         if (input%given("start_range", i, "column")) then
            call input%get("start_range", i, "column", columns(i)%text)
         else
            call input%get("start_range", i, "coordinate", columns(i)%text)
            call input%get("start_range", i, "quantity", quantity)
            columns(i)%text = columns(i)%text//"."//lower(quantity)
         end if
      end do
      if (size(columns) == 0) return
      call read_columns(file, columns, values, error)
      if (.not. allocated(error)) numbers = reshape(values, [size(values)])
   end subroutine read_start_file

   !> A group that tells starts from a file from others, to be added to an effective input; empty if there are none.
   pure function identity_of(numbers) result(text)
      real(wp), intent(in) :: numbers(:)
      character(:), allocatable :: text

      character(16) :: sum

      text = ""
      if (size(numbers) == 0) return
      write (sum, "(z16.16)") checksum(transfer(numbers, [0_i8]))
      text = "&starts"//newline//"   contents_of_file = "//to_text(size(numbers))//" numbers with checksum "//sum//newline// &
             "/"//newline
   end function identity_of

end module sweep_start_file
