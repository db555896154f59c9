!! Starting the HDF5 library and turning its failures into errors.
!!
!! The library is started when it is first needed and ends with the program: closing it would close the files of others.
module razy_io_hdf5_library
   use, intrinsic :: ieee_arithmetic, only: ieee_all, ieee_get_status, ieee_set_halting_mode, ieee_set_status, ieee_status_type
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funloc, c_funptr, c_int, c_int64_t, &
                                                                             c_loc, c_null_char, c_ptr
   use hdf5, only: h5dont_atexit_f, h5eset_auto_f, h5iis_valid_f, h5open_f, h5t_ieee_f64le
   use razy_core_error, only: error_t, raise
   implicit none(type, external)
   private

   public :: start_hdf5, check_hdf5

   integer, parameter :: detail_length = 1024

   !> The innermost description on the library's error stack.
   type :: detail_t
      character(detail_length) :: text
   end type detail_t

   !> H5E_error2_t of the C interface; hid_t has 64 bits since HDF5 1.10.
   type, bind(C) :: stack_entry_t
      integer(c_int64_t) :: class_id
      integer(c_int64_t) :: major
      integer(c_int64_t) :: minor
      integer(c_int) :: line
      type(c_ptr) :: procedure_name
      type(c_ptr) :: file_name
      type(c_ptr) :: description
   end type stack_entry_t

   integer(c_int64_t), parameter :: default_stack = 0_c_int64_t
   integer(c_int), parameter :: innermost_first = 0_c_int

   interface
      function c_walk(stack, direction, visit, client) result(status) bind(C, name="H5Ewalk2")
         import :: c_funptr, c_int, c_int64_t, c_ptr
         implicit none(type, external)
         integer(c_int64_t), value, intent(in) :: stack
         integer(c_int), value, intent(in) :: direction
         type(c_funptr), value, intent(in) :: visit
         type(c_ptr), value, intent(in) :: client
         integer(c_int) :: status
      end function c_walk
   end interface

contains

   !> Start the library unless it runs, with its own printing of errors switched off.
   !>
   !> It probes floating-point arithmetic: that must neither trap nor leave exception flags behind.
   subroutine start_hdf5(error)
      type(error_t), allocatable, intent(out) :: error
      type(ieee_status_type) :: arithmetic
      integer :: status, already_called
      logical :: running

      call ieee_get_status(arithmetic)
      call ieee_set_halting_mode(ieee_all, .false.)
      ! A file that could not be closed, on a full disk, would crash the library's own clean-up at the end of the program.
      call h5dont_atexit_f(already_called)
      running = .false.
      call h5iis_valid_f(h5t_ieee_f64le, running, status)
      if (status /= 0 .or. .not. running) call h5open_f(status)
      if (status == 0) call h5eset_auto_f(0, status)
      call ieee_set_status(arithmetic)
      if (status < 0) call raise(error, "the HDF5 library cannot be started")
   end subroutine start_hdf5

   !> Turn a negative status of HDF5 into an error `what: reason`; to be called before the next call of the library.
   subroutine check_hdf5(status, what, error)
      integer, intent(in) :: status
      character(*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error

      if (status < 0) call raise(error, what//": "//reason())
   end subroutine check_hdf5

   !> Why the last call of the library failed: the system's message where there is one, else the library's.
   function reason() result(text)
      character(:), allocatable :: text
      character(*), parameter :: system_message = "error message = '"
      type(detail_t), target :: detail
      integer(c_int) :: status
      integer :: first, length

      detail%text = ""
      status = c_walk(default_stack, innermost_first, c_funloc(keep_first), c_loc(detail))
      text = trim(detail%text)
      if (status < 0_c_int .or. len(text) == 0) text = "HDF5 gives no reason"
      first = index(text, system_message)
      if (first > 0) then
         text = text(first + len(system_message):)
         length = index(text, "'") - 1
         if (length > 0) text = text(:length)
      end if
   end function reason

   !> Visitor of the error stack: copies the description of entry 0.
   function keep_first(position, entry, client) result(status) bind(C)
      integer(c_int), value, intent(in) :: position
      type(stack_entry_t), intent(in) :: entry
      type(c_ptr), value, intent(in) :: client
      integer(c_int) :: status
      type(detail_t), pointer :: detail
      character(kind=c_char), pointer :: description(:)
      integer :: i

      status = 0_c_int
      if (position /= 0_c_int .or. .not. c_associated(entry%description)) return
      call c_f_pointer(client, detail)
      call c_f_pointer(entry%description, description, [detail_length])
      do i = 1, detail_length
         if (description(i) == c_null_char) exit
         detail%text(i:i) = description(i)
      end do
   end function keep_first

end module razy_io_hdf5_library
