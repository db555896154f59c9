!! The count of tests and failures of this process, and what is printed of them.
!!
!! A failure is printed at once: it is then seen even if another MPI rank goes on to wait for this one for ever.
module funit_report
   use, intrinsic :: iso_fortran_env, only: output_unit
   implicit none(type, external)
   private

   public :: SourceLocation, anyExceptions, begin_test, end_test, skip_test, has_failed, print_summary, throw

   !> Where a directive stands in its .pf file.
   type :: SourceLocation
      character(:), allocatable :: file
      integer :: line = 0
   end type SourceLocation

   !> Tests so far; the last three components belong to the test that is running.
   type :: tally_t
      integer :: run = 0, failed = 0, disabled = 0
      logical :: failing = .false.
      character(:), allocatable :: name
      !> Written after the text of a failure; the rank in an MPI test.
      character(:), allocatable :: process
   end type tally_t

   type(tally_t) :: tally

contains

   !> Whether an assertion of the running test has failed.
   logical function anyExceptions()
      anyExceptions = tally%failing
   end function anyExceptions

   !> Whether any test has failed.
   logical function has_failed()
      has_failed = tally%failed > 0
   end function has_failed

   !> Start the test of this name.
   subroutine begin_test(name, process)
      character(*), intent(in) :: name
      character(*), intent(in), optional :: process

      tally%name = name
      tally%process = ""
      if (present(process)) tally%process = process
      tally%failing = .false.
   end subroutine begin_test

   !> Count the running test; `failed` is its outcome on all ranks, which overrides that on this one.
   subroutine end_test(failed)
      logical, intent(in), optional :: failed

      if (present(failed)) tally%failing = failed
      tally%run = tally%run + 1
      if (tally%failing) tally%failed = tally%failed + 1
      tally%failing = .false.
   end subroutine end_test

   !> Count a disabled test.
   subroutine skip_test()
      tally%disabled = tally%disabled + 1
   end subroutine skip_test

   !> Report a failed assertion of the running test.
   subroutine throw(text, location, message)
      character(*), intent(in) :: text
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message

      tally%failing = .true.
      write (output_unit, "(/, a, /, a, /, a, /, a)") " Failure", "  in: ", tally%name, "  Location: "
      write (output_unit, "(3a, i0, a)") "[", location%file, ":", location%line, "]"
      if (present(message)) write (output_unit, "(a)") message
      write (output_unit, "(2a)") text, tally%process
      flush (output_unit)
   end subroutine throw

   !> Print the closing lines.
   subroutine print_summary()
      character(64) :: tests, disabled

      if (has_failed()) then
         write (output_unit, "(/, a)") " FAILURES!!!"
         write (output_unit, "(a, i0, a, i0, a)") "Tests run: ", tally%run, ", Failures: ", tally%failed, ", Errors: 0"
         write (output_unit, "(a)") "*** Encountered 1 or more failures/errors during testing ***"
      else
         write (tests, "(i0, a)") tally%run, merge(" test ", " tests", tally%run == 1)
         disabled = ""
         if (tally%disabled > 0) write (disabled, "(a, i0, a)") ", ", tally%disabled, " disabled"
         write (output_unit, "(/, a, /, 4a)") " OK", " (", trim(tests), trim(disabled), ")"
      end if
      flush (output_unit)
   end subroutine print_summary

end module funit_report
