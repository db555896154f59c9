!! What happens when there is no more memory: a line and exit code 1.
!!
!! Hardly anything looks at what malloc returns: not gfortran in most of its assignments, nor the threads of MPI. An end in the
!! nowhere follows. These procedures stand in the place of malloc, calloc and realloc of the C library for all that runs in a
!! program, the libraries that it loads too: the dynamic linker looks for a name in the program first. Threads are in them at once:
!! all is recursive.
module memory
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_loc, c_ptr, c_size_t
   implicit none(type, external)
   private

   ! What the library of GNU calls these itself.
   interface
      function real_malloc(size) result(place) bind(c, name="__libc_malloc")
         import :: c_ptr, c_size_t
         implicit none(type, external)
         integer(c_size_t), value, intent(in) :: size
         type(c_ptr) :: place
      end function real_malloc

      function real_calloc(count, size) result(place) bind(c, name="__libc_calloc")
         import :: c_ptr, c_size_t
         implicit none(type, external)
         integer(c_size_t), value, intent(in) :: count, size
         type(c_ptr) :: place
      end function real_calloc

      function real_realloc(old, size) result(place) bind(c, name="__libc_realloc")
         import :: c_ptr, c_size_t
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: old
         integer(c_size_t), value, intent(in) :: size
         type(c_ptr) :: place
      end function real_realloc

      function c_write(file, text, length) result(written) bind(c, name="write")
         import :: c_int, c_ptr, c_size_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: file
         type(c_ptr), value, intent(in) :: text
         integer(c_size_t), value, intent(in) :: length
         integer(c_size_t) :: written
      end function c_write

      subroutine c_exit(code) bind(c, name="_exit")
         import :: c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: code
      end subroutine c_exit
   end interface

contains

   recursive function malloc_or_end(size) result(place) bind(c, name="malloc")
      integer(c_size_t), value, intent(in) :: size
      type(c_ptr) :: place

      place = real_malloc(size)
      if (.not. c_associated(place)) call give_up()
   end function malloc_or_end

   recursive function calloc_or_end(count, size) result(place) bind(c, name="calloc")
      integer(c_size_t), value, intent(in) :: count, size
      type(c_ptr) :: place

      place = real_calloc(count, size)
      if (.not. c_associated(place)) call give_up()
   end function calloc_or_end

   recursive function realloc_or_end(old, size) result(place) bind(c, name="realloc")
      type(c_ptr), value, intent(in) :: old
      integer(c_size_t), value, intent(in) :: size
      type(c_ptr) :: place

      place = real_realloc(old, size)
      if (.not. c_associated(place) .and. size > 0) call give_up()
   end function realloc_or_end

   !> Nothing that Fortran does to write or to stop goes without memory.
   recursive subroutine give_up()
      character(kind=c_char, len=*), parameter :: words = "out of memory: fewer ranks on a machine, points or starts need less"
      character(kind=c_char, len=len(words) + 1), target :: line

      line = words//new_line("a")
      if (c_write(2_c_int, c_loc(line), len(line, c_size_t)) > 0) continue
      call c_exit(1_c_int)
   end subroutine give_up

end module memory
