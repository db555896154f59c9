!! Serial half of the stand-in for pFUnit: the assertions that the preprocessor writes calls of, and the fixture's type.
!!
!! In every comparison a scalar on the left stands for each element of an array on the right, an integer on the left is a real
!! where the right is real, and a NaN fails. Blanks and tabs around a text do not count.
module funit
   use, intrinsic :: iso_fortran_env, only: wp => real64
   use funit_report, only: SourceLocation, anyExceptions, begin_test, end_test, has_failed, print_summary, skip_test, throw
   use funit_values, only: is_infinite, is_integer, is_nan, is_real, is_text, pf_values, values_t
   implicit none(type, external)
   private

   public :: SourceLocation, TestCase, pf_values, anyExceptions, begin_test, end_test, skip_test, print_summary, has_failed
   public :: assert_close, assert_order, assert_condition, assert_nan, assert_finite, assert_never

   !> A fixture: made anew for every test, `setUp` before it, `tearDown` after it whether the test failed or not.
   type :: TestCase
   contains
      procedure :: setUp => do_nothing
      procedure :: tearDown => do_nothing
   end type TestCase

contains

   !> A fixture that needs no preparation.
   subroutine do_nothing(this)
      class(TestCase), intent(inout) :: this
   end subroutine do_nothing

   !> Fail where |expected − actual| > tolerance or, if `relative`, > tolerance·|expected|; without tolerance, where they differ.
   subroutine assert_close(wanted, actual, relative, tolerance, message, location)
      type(values_t), intent(in) :: wanted, actual
      logical, intent(in) :: relative
      real(wp), intent(in), optional :: tolerance
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      type(values_t) :: expected
      real(wp) :: limit
      integer :: k

      expected = converted(wanted, actual%kind)
      if (.not. conform(expected, actual, location, message)) return
      limit = 0.0_wp
      if (present(tolerance)) then
         limit = tolerance
         if (expected%kind /= is_real) then
            call throw("a tolerance is for reals only", location, message)
            return
         end if
      end if
      do k = 1, actual%length()
         if (.not. element_is_close(expected, actual, k, limit, relative)) then
            call throw_element(expected, "but was", actual, k, location, message)
            return
         end if
      end do
   end subroutine assert_close

   !> Whether element k of both is the same, reals within the limit.
   pure logical function element_is_close(expected, actual, k, limit, relative) result(same)
      type(values_t), intent(in) :: expected, actual
      integer, intent(in) :: k
      real(wp), intent(in) :: limit
      logical, intent(in) :: relative
      integer :: e

      e = merge(1, k, size(expected%extent) == 0)
      select case (actual%kind)
      case (is_real)
         same = is_close(expected%real(e), actual%real(k), limit, relative)
      case (is_integer)
         same = expected%integer(e) == actual%integer(k)
      case (is_text)
         same = trimmed(expected%text(e)) == trimmed(actual%text(k))
      case default
         same = expected%logical(e) .eqv. actual%logical(k)
      end select
   end function element_is_close

   !> Integers as reals if `kind` is that of reals, anything else as it is.
   pure function converted(given, kind) result(values)
      type(values_t), intent(in) :: given
      integer, intent(in) :: kind
      type(values_t) :: values

      values = given
      if (given%kind /= is_integer .or. kind /= is_real) return
      values%kind = is_real
      values%real = real(given%integer, wp)
   end function converted

   !> Without blanks and tabs at both ends.
   pure function trimmed(text) result(inner)
      character(*), intent(in) :: text
      character(:), allocatable :: inner
      character(*), parameter :: white = " "//achar(9)

      inner = ""
      if (verify(text, white) > 0) inner = text(verify(text, white):verify(text, white, back=.true.))
   end function trimmed

   !> |expected − actual| ≤ limit (times |expected| ≠ 0), without overflow; nothing is close to a NaN.
   elemental logical function is_close(expected, actual, limit, relative)
      real(wp), intent(in) :: expected, actual, limit
      logical, intent(in) :: relative
      real(wp) :: scale

      is_close = .false.
      if (is_nan(expected) .or. is_nan(actual) .or. is_nan(limit)) return
      if (is_infinite(expected) .or. is_infinite(actual)) then
         is_close = expected == actual .and. .not. relative
      else if (abs(0.5_wp*expected - 0.5_wp*actual) < 0.25_wp*huge(expected)) then
         scale = merge(abs(expected), 1.0_wp, relative)
         is_close = scale > 0.0_wp .and. abs(expected - actual) <= limit*scale
      end if
   end function is_close

   !> Fail unless `left relation right` holds for all elements; the relation is <, <=, > or >=.
   subroutine assert_order(first, right, relation, message, location)
      type(values_t), intent(in) :: first, right
      character(*), intent(in) :: relation
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      type(values_t) :: left
      integer :: k

      left = converted(first, right%kind)
      if (.not. conform(left, right, location, message)) return
      if (left%kind /= is_real .and. left%kind /= is_integer) then
         call throw("an order is for reals and integers only", location, message)
         return
      end if
      do k = 1, right%length()
         if (.not. element_is_ordered(left, right, k, relation)) then
            call throw_element(left, relation, right, k, location, message)
            return
         end if
      end do
   end subroutine assert_order

   !> Whether `left relation right` holds for element k; a NaN is in no order.
   pure logical function element_is_ordered(left, right, k, relation) result(ordered)
      type(values_t), intent(in) :: left, right
      integer, intent(in) :: k
      character(*), intent(in) :: relation
      logical :: less, greater
      integer :: l

      l = merge(1, k, size(left%extent) == 0)
      if (left%kind == is_integer) then
         less = left%integer(l) < right%integer(k)
         greater = left%integer(l) > right%integer(k)
      else
         ordered = .not. (is_nan(left%real(l)) .or. is_nan(right%real(k)))
         if (.not. ordered) return
         less = left%real(l) < right%real(k)
         greater = left%real(l) > right%real(k)
      end if
      select case (relation)
      case ("<")
         ordered = less
      case ("<=")
         ordered = .not. greater
      case (">")
         ordered = greater
      case (">=")
         ordered = .not. less
      case default
         ordered = .false.
      end select
   end function element_is_ordered

   !> Fail unless the condition is as expected.
   subroutine assert_condition(condition, expected, message, location)
      logical, intent(in) :: condition, expected
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      if (condition .neqv. expected) call throw("the condition is "//merge("true ", "false", condition), location, message)
   end subroutine assert_condition

   !> Fail unless x is a NaN.
   subroutine assert_nan(x, message, location)
      real(wp), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      if (.not. is_nan(x)) call throw("expected a NaN", location, message)
   end subroutine assert_nan

   !> Fail if x is a NaN or infinite.
   subroutine assert_finite(x, message, location)
      real(wp), intent(in) :: x
      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location

      if (is_nan(x) .or. is_infinite(x)) call throw("expected a finite number", location, message)
   end subroutine assert_finite

   !> Fail.
   subroutine assert_never(message, location)
      character(*), intent(in) :: message
      type(SourceLocation), intent(in) :: location

      call throw(message, location)
   end subroutine assert_never

   !> Whether two operands can be compared element by element; that they cannot is a failure.
   logical function conform(left, right, location, message)
      type(values_t), intent(in) :: left, right
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message

      conform = .false.
      if (left%kind /= right%kind) then
         call throw("the operands are of different types", location, message)
      else if (size(left%extent) == 0) then
         conform = .true.
      else if (size(left%extent) /= size(right%extent)) then
         call throw("the operands are of different ranks", location, message)
      else if (any(left%extent /= right%extent)) then
         call throw("expected shape "//list(left%extent)//", actual shape "//list(right%extent), location, message)
      else
         conform = .true.
      end if
   end function conform

   !> Report that `left relation right` does not hold for element k.
   subroutine throw_element(left, relation, right, k, location, message)
      type(values_t), intent(in) :: left, right
      character(*), intent(in) :: relation
      integer, intent(in) :: k
      type(SourceLocation), intent(in) :: location
      character(*), intent(in), optional :: message
      character(:), allocatable :: place
      integer :: axis, rest
      integer :: subscript(size(right%extent))

      rest = k - 1
      do axis = 1, size(right%extent)
         subscript(axis) = mod(rest, right%extent(axis)) + 1
         rest = rest/right%extent(axis)
      end do
      place = ""
      if (size(subscript) > 0) place = " at "//list(subscript)
      call throw("expected "//left%element(k)//" "//relation//" "//right%element(k)//place, location, message)
   end subroutine throw_element

   !> Integers as `(1, 2)`.
   pure function list(items) result(text)
      integer, intent(in) :: items(:)
      character(:), allocatable :: text
      character(64) :: buffer

      write (buffer, '(*(i0, :, ", "))') items
      text = "("//trim(buffer)//")"
   end function list

end module funit
