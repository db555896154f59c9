!! One thread for the libraries below LAPACK: with several, sums are taken in an order that depends on how many there are.
!!
!! A library of BLAS is asked by its own function, if the program holds one; environment variables are read before a program
!! begins.
module razy_linalg_threads
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_null_char, c_null_ptr, c_ptr
   implicit none(type, external)
   private

   public :: use_one_thread

   !> Functions that take the number of threads: OpenBLAS, MKL, FlexiBLAS.
   character(*), parameter :: setters(*) = [character(25) :: "openblas_set_num_threads", "MKL_Set_Num_Threads", &
                                                                                                      "flexiblas_set_num_threads"]

   abstract interface
      subroutine take_number(threads) bind(c)
         import :: c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: threads
      end subroutine take_number
   end interface

   ! allow(assumed-size)
   interface
      !> dlsym of POSIX; without a handle it looks in the whole program.
      function c_dlsym(handle, name) result(address) bind(c, name="dlsym")
         import :: c_char, c_funptr, c_ptr
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: handle
         character(kind=c_char), intent(in) :: name(*)
         type(c_funptr) :: address
      end function c_dlsym
   end interface

contains

   !> Have BLAS and LAPACK of this process work in one thread from now on; to be called before the first of their routines.
   subroutine use_one_thread()
      procedure(take_number), pointer :: set_threads
      type(c_funptr) :: address
      integer :: i

      do i = 1, size(setters)
         address = c_dlsym(c_null_ptr, trim(setters(i))//c_null_char)
         if (.not. c_associated(address)) cycle
         call c_f_procpointer(address, set_threads)
         call set_threads(1_c_int)
      end do
   end subroutine use_one_thread

end module razy_linalg_threads
