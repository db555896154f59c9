!! Calls of the C library on streams that several modules need.
module razy_io_posix_calls
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_ptr
   implicit none(type, external)
   private

   public :: c_fclose, c_fileno, c_fopen

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
   end interface

end module razy_io_posix_calls
