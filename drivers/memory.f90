!! What happens when there is no more memory: a line and exit code 1.
!!
!! gfortran does not look at what malloc returns in most of its assignments, and an end in the nowhere follows. The linker puts
!! these procedures in the place of malloc and realloc of all that is compiled here (ld --wrap).
module memory
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_loc, c_ptr, c_size_t
   implicit none(type, external)
   private

   interface
      function real_malloc(size) result(place) bind(c, name="__real_malloc")
         import :: c_ptr, c_size_t
         implicit none(type, external)
         integer(c_size_t), value, intent(in) :: size
         type(c_ptr) :: place
      end function real_malloc

      function real_realloc(old, size) result(place) bind(c, name="__real_realloc")
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

   function malloc_or_end(size) result(place) bind(c, name="__wrap_malloc")
      integer(c_size_t), value, intent(in) :: size
      type(c_ptr) :: place

      place = real_malloc(size)
      if (.not. c_associated(place)) call give_up()
   end function malloc_or_end

   function realloc_or_end(old, size) result(place) bind(c, name="__wrap_realloc")
      type(c_ptr), value, intent(in) :: old
      integer(c_size_t), value, intent(in) :: size
      type(c_ptr) :: place

      place = real_realloc(old, size)
      if (.not. c_associated(place) .and. size > 0) call give_up()
   end function realloc_or_end

   !> Nothing that Fortran does to write or to stop goes without memory.
   subroutine give_up()
      character(kind=c_char, len=*), parameter :: words = "out of memory: fewer ranks on a machine, or shorter lists, need less"
      character(kind=c_char, len=len(words) + 1), target :: line

      line = words//new_line("a")
      if (c_write(2_c_int, c_loc(line), len(line, c_size_t)) > 0) continue
      call c_exit(1_c_int)
   end subroutine give_up

end module memory
