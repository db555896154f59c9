!! Serial half of the stand-in for pFUnit: exceptions, the count of tests, and the assertions the preprocessor writes calls of.
!!
!! A failed assertion is reported at once, so that it is seen even if another MPI rank then waits for ever.
module funit
   use, intrinsic :: iso_fortran_env, only: output_unit, wp => real64
   use funit_values, only: is_infinite, is_integer, is_nan, is_real, is_text, pf_values, values_t
   implicit none(type, external)
   private

   public :: SourceLocation, TestCase, pf_values, anyExceptions, begin_test, end_test, skip_test, print_summary, has_failed
   public :: assertEqual, assertRelativelyEqual, assertLessThan, assertLessThanOrEqual, assertGreaterThan
   public :: assertGreaterThanOrEqual, assertTrue, assertFalse, assertIsNaN, assertIsFinite, assertFail

   !> Where a directive stands in its .pf file.
   type :: SourceLocation
      character(:), allocatable :: file
      integer :: line = 0
   end type SourceLocation

   !> A fixture: made anew for every test, `setUp` before it, `tearDown` after it whether the test failed or not.
   type :: TestCase
   contains
      procedure :: setUp => do_nothing
      procedure :: tearDown => do_nothing
   end type TestCase

   !> Outcome of the tests so far; `failing` belongs to the test that is running.
   type :: tally_t
      integer :: run = 0, failed = 0, disabled = 0
      logical :: failing = .false.
      character(:), allocatable :: name
   end type tally_t

   type(tally_t) :: tally

contains

   !> A fixture that needs no preparation.
   subroutine do_nothing(this)
      class(TestCase), intent(inout) :: this
   end subroutine do_nothing

   !> Whether an assertion of the running test has failed.
   logical function anyExceptions()
      anyExceptions = tally%failing
   end function anyExceptions

   !> Whether any test has failed.
   logical function has_failed()
      has_failed = tally%failed > 0
   end function has_failed

   !> Start the test of this name.
   subroutine begin_test(name)
      character(*), intent(in) :: name

      tally%name = name
      tally%failing = .false.
   end subroutine begin_test

   !> Count the running test; `failed` overrides what this process saw of it.
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

   !> The closing lines.
   subroutine print_summary()
      character(:), allocatable :: tests
      character(64) :: buffer

      if (has_failed()) then
         write (output_unit, '(/, a)') ' FAILURES!!!'
         write (output_unit, '(a, i0, a, i0, a)') 'Tests run: ', tally%run, ', Failures: ', tally%failed, ', Errors: 0'
         write (output_unit, '(a)') '*** Encountered 1 or more failures/errors during testing ***'
      else
         write (buffer, '(i0, a)') tally%run, merge(' test ', ' tests', tally%run == 1)
         tests = trim(buffer)
         if (tally%disabled > 0) then
            write (buffer, '(a, i0, a)') ', ', tally%disabled, ' disabled'
            tests = tests//trim(buffer)
         end if
         write (output_unit, '(/, a, /, a)') ' OK', ' ('//tests//')'
      end if
      flush (output_unit)
   end subroutine print_summary

   !> Report a failed assertion of the running test.
   subroutine throw(text, location, message)
      character(*), intent(in) :: text
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message

      tally%failing = .true.
      write (output_unit, '(/, a)') ' Failure in: '//tally%name
      write (output_unit, '(3a, i0, a)') '   Location: [', location%file, ':', location%line, ']'
      if (present(message)) write (output_unit, '(2a)') '   ', message
      write (output_unit, '(2a)') '   ', text
      flush (output_unit)
   end subroutine throw

   !> Report the first element k of a comparison that does not hold; k = 0 means that all of them do.
   subroutine throw_item(relation, left, right, k, location, message)
      character(*), intent(in) :: relation
      type(values_t), intent(in) :: left, right
      integer, intent(in) :: k
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message
      character(:), allocatable :: text
      character(16) :: buffer
      integer :: axis, rest

      if (k == 0) return
      text = 'expected '//left%item(k)//' '//relation//' '//right%item(k)
      if (size(right%extent) > 0) then
         text = text//' at element ('
         rest = k - 1
         do axis = 1, size(right%extent)
            write (buffer, '(i0)') mod(rest, right%extent(axis)) + 1
            rest = rest/right%extent(axis)
            text = text//trim(buffer)//merge(', ', ') ', axis < size(right%extent))
         end do
      end if
      call throw(trim(text), location, message)
   end subroutine throw_item

   !> Whether two operands can be compared element by element; if not, that is the failure.
   logical function conform(left, right, location, message)
      type(values_t), intent(in) :: left, right
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message
      character(64) :: shapes(2)

      conform = .false.
      if (left%kind /= right%kind) then
         call throw('the operands are of different types', location, message)
      else if (size(left%extent) == 0) then
         conform = .true.
      else if (size(left%extent) /= size(right%extent)) then
         call throw('the operands are of different rank', location, message)
      else if (any(left%extent /= right%extent)) then
         write (shapes(1), '(*(i0, :, ", "))') left%extent
         write (shapes(2), '(*(i0, :, ", "))') right%extent
         call throw('expected shape ('//trim(shapes(1))//'), actual shape ('//trim(shapes(2))//')', location, message)
      else
         conform = .true.
      end if
   end function conform

   !> |expected − actual| ≤ tolerance without overflow; a NaN is close to nothing.
   elemental logical function is_close(expected, actual, tolerance)
      real(wp), intent(in) :: expected, actual, tolerance

      is_close = .false.
      if (is_nan(expected) .or. is_nan(actual) .or. is_nan(tolerance)) return
      if (is_infinite(expected) .or. is_infinite(actual)) then
         is_close = expected == actual
      else if (abs(0.5_wp*expected - 0.5_wp*actual) < 0.25_wp*huge(expected)) then
         is_close = abs(expected - actual) <= tolerance
      end if
   end function is_close

   !> Fail where |expected − actual| > tolerance; without tolerance, where they differ at all.
   subroutine assertEqual(expected, actual, tolerance, message, location)
      type(values_t), intent(in) :: expected, actual
      real(wp), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      real(wp) :: limit
      integer :: a, e, k
      logical :: same

      if (.not. conform(expected, actual, location, message)) return
      limit = 0.0_wp
      if (present(tolerance)) then
         limit = tolerance
         if (expected%kind /= is_real) then
            call throw('a tolerance is for reals', location, message)
            return
         end if
      end if
      do k = 1, actual%length()
         a = k
         e = merge(1, k, size(expected%extent) == 0)
         select case (actual%kind)
         case (is_real)
            same = is_close(expected%real(e), actual%real(a), limit)
         case (is_integer)
            same = expected%integer(e) == actual%integer(a)
         case (is_text)
            same = expected%text(e) == actual%text(a)
         case default
            same = expected%logical(e) .eqv. actual%logical(a)
         end select
         if (.not. same) then
            call throw_item('but was', expected, actual, k, location, message)
            return
         end if
      end do
   end subroutine assertEqual

   !> Fail where |expected − actual| > tolerance·|expected|; an expected zero has no relative error and fails.
   subroutine assertRelativelyEqual(expected, actual, tolerance, message, location)
      type(values_t), intent(in) :: expected, actual
      real(wp), intent(in) :: tolerance
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      real(wp) :: reference
      integer :: k

      if (.not. conform(expected, actual, location, message)) return
      if (actual%kind /= is_real) then
         call throw('a relative comparison is for reals', location, message)
         return
      end if
      do k = 1, actual%length()
         reference = expected%real(merge(1, k, size(expected%extent) == 0))
         if (is_nan(reference) .or. is_infinite(reference)) then
            call throw_item('(not a number to be relative to) but was', expected, actual, k, location, message)
            return
         else if (abs(reference) <= 0.0_wp) then
            call throw_item('(no relative error of zero) but was', expected, actual, k, location, message)
            return
         else if (.not. is_close(reference, actual%real(k), tolerance*abs(reference))) then
            call throw_item('within the relative tolerance but was', expected, actual, k, location, message)
            return
         end if
      end do
   end subroutine assertRelativelyEqual

   !> First element at which `left relation right` does not hold, 0 if there is none; a NaN is in no order.
   pure integer function first_disorder(left, relation, right) result(k)
      type(values_t), intent(in) :: left, right
      character(*), intent(in) :: relation
      integer :: l, order
      logical :: holds

      do k = 1, right%length()
         l = merge(1, k, size(left%extent) == 0)
         if (left%kind == is_real) then
            if (is_nan(left%real(l)) .or. is_nan(right%real(k))) return
            order = merge(1, 0, left%real(l) > right%real(k)) - merge(1, 0, left%real(l) < right%real(k))
         else
            order = merge(1, 0, left%integer(l) > right%integer(k)) - merge(1, 0, left%integer(l) < right%integer(k))
         end if
         select case (relation)
         case ('<')
            holds = order < 0
         case ('<=')
            holds = order <= 0
         case ('>')
            holds = order > 0
         case default
            holds = order >= 0
         end select
         if (.not. holds) return
      end do
      k = 0
   end function first_disorder

   !> Fail unless `left relation right` holds for all elements.
   subroutine assert_order(left, relation, right, location, message)
      type(values_t), intent(in) :: left, right
      character(*), intent(in) :: relation
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message

      if (.not. conform(left, right, location, message)) return
      if (left%kind == is_real .or. left%kind == is_integer) then
         call throw_item(relation, left, right, first_disorder(left, relation, right), location, message)
      else
         call throw('an order is for reals and integers', location, message)
      end if
   end subroutine assert_order

   !> Fail unless left < right.
   subroutine assertLessThan(left, right, message, location)
      type(values_t), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      call assert_order(left, '<', right, location, message)
   end subroutine assertLessThan

   !> Fail unless left ≤ right.
   subroutine assertLessThanOrEqual(left, right, message, location)
      type(values_t), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      call assert_order(left, '<=', right, location, message)
   end subroutine assertLessThanOrEqual

   !> Fail unless left > right.
   subroutine assertGreaterThan(left, right, message, location)
      type(values_t), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      call assert_order(left, '>', right, location, message)
   end subroutine assertGreaterThan

   !> Fail unless left ≥ right.
   subroutine assertGreaterThanOrEqual(left, right, message, location)
      type(values_t), intent(in) :: left, right
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      call assert_order(left, '>=', right, location, message)
   end subroutine assertGreaterThanOrEqual

   !> Fail unless the condition holds.
   subroutine assertTrue(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      if (.not. condition) call throw('expected true but was false', location, message)
   end subroutine assertTrue

   !> Fail if the condition holds.
   subroutine assertFalse(condition, message, location)
      logical, intent(in) :: condition
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      if (condition) call throw('expected false but was true', location, message)
   end subroutine assertFalse

   !> Fail unless x is a NaN.
   subroutine assertIsNaN(x, message, location)
      real(wp), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      type(values_t) :: values

      if (is_nan(x)) return
      values = pf_values(x)
      call throw('expected NaN but was '//values%item(1), location, message)
   end subroutine assertIsNaN

   !> Fail if x is a NaN or infinite.
   subroutine assertIsFinite(x, message, location)
      real(wp), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      type(values_t) :: values

      if (.not. (is_nan(x) .or. is_infinite(x))) return
      values = pf_values(x)
      call throw('expected a finite number but was '//values%item(1), location, message)
   end subroutine assertIsFinite

   !> Fail.
   subroutine assertFail(message, location)
      character(*), intent(in) :: message
      type(SourceLocation), intent(in) :: location

      call throw(message, location)
   end subroutine assertFail

end module funit
