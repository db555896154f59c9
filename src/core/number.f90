!! Numbers as text: exact in both directions, and no input can raise a floating-point exception.
!!
!! Reading refuses what Fortran would round, wrap or turn into an infinity; writing gives the shortest decimal form that
!! reads back to the same bits.
module razy_core_number
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_is_negative
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: lower
   implicit none(type, external)
   private

   public :: decimal, to_text, parse_real, parse_integer, parse_logical
   public :: number_ok, number_malformed, number_not_finite

   !> Outcomes of `parse_real` and `parse_integer`; an integer is "not finite" when the default kind cannot hold it.
   integer, parameter :: number_ok = 0, number_malformed = 1, number_not_finite = 2

   !> The leading digits of the largest number of kind `wp`, 0.17976931348623157e309.
   character(*), parameter :: huge_digits = "17976931348623157"
   integer, parameter :: huge_exponent = 309
   !> Below 0.1e-330 everything is zero.
   integer, parameter :: tiny_exponent = -330

   !> Decimal text of a number: `40`, `0.08`, `1.0e-4`.
   interface to_text
      module procedure :: integer_text, long_text, real_text
   end interface to_text

contains

   !> A number with a digit before the point and so many behind it.
   pure function decimal(value, places) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: places
      character(:), allocatable :: text

      character(40) :: wide
      character(12) :: form

      write (form, "(a, i0, a)") "(f40.", places, ")"
      write (wide, form) value
      text = trim(adjustl(wide))
   end function decimal

   pure function integer_text(value) result(text)
      integer, intent(in) :: value
      character(:), allocatable :: text

      text = long_text(int(value, i8))
   end function integer_text

   pure function long_text(value) result(text)
      integer(i8), intent(in) :: value
      character(:), allocatable :: text
      character(24) :: buffer

      write (buffer, "(i0)") value
      text = trim(buffer)
   end function long_text

   !> Shortest text that reads back to the same bits; `nan`, `inf` and `-inf` for what is not finite.
   pure function real_text(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text
      character(40) :: buffer, edit
      character(:), allocatable :: digits
      real(wp) :: back
      integer :: places, exponent, mark, status

      if (ieee_is_nan(value)) then
         text = "nan"
         return
      else if (.not. ieee_is_finite(value)) then
         text = trim(merge("-inf", "inf ", value < 0.0_wp))
         return
      end if
      do places = 0, 16
         write (edit, '("(es40.", i0, "e4)")') places
         write (buffer, edit) abs(value)
         call parse_real(trim(adjustl(buffer)), back, status)
         if (status == number_ok .and. .not. abs(value) > back .and. .not. abs(value) < back) exit
      end do
      buffer = adjustl(buffer)
      mark = scan(buffer, "E")
      read (buffer(mark + 1:), *) exponent
      digits = buffer(1:1)//buffer(3:mark - 1)
      do while (len(digits) > 1 .and. digits(len(digits):) == "0")
         digits = digits(:len(digits) - 1)
      end do
      text = laid_out(digits, exponent)
      if (ieee_is_negative(value)) text = "-"//text
   end function real_text

   !> The number d.ddd times 10**exponent, with an exponent only where it is shorter to read.
   pure function laid_out(digits, exponent) result(text)
      character(*), intent(in) :: digits
      integer, intent(in) :: exponent
      character(:), allocatable :: text
      integer, parameter :: least = -3, most = 6

      if (exponent < least .or. exponent > most) then
         text = digits(1:1)//"."//digits(2:)
         if (len(digits) == 1) text = text//"0"
         text = text//"e"//integer_text(exponent)
      else if (exponent < 0) then
         text = "0."//repeat("0", -exponent - 1)//digits
      else if (len(digits) <= exponent + 1) then
         text = digits//repeat("0", exponent + 1 - len(digits))//".0"
      else
         text = digits(:exponent + 1)//"."//digits(exponent + 2:)
      end if
   end function laid_out

   !> Read a real number: sign, digits with or without a point, exponent with e, d or q.
   pure subroutine parse_real(text, value, status)
      character(*), intent(in) :: text
      !> Zero unless `status` is `number_ok`; correctly rounded
      real(wp), intent(out) :: value
      integer, intent(out) :: status
      character(:), allocatable :: digits
      integer :: at, exponent, iostat
      logical :: negative, ok

      value = 0.0_wp
      status = number_malformed
      if (is_non_finite_word(text)) status = number_not_finite
      at = 1
      call take_sign(text, at, negative)
      call take_mantissa(text, at, digits, exponent, ok)
      if (ok) call take_exponent(text, at, exponent, ok)
      if (.not. ok .or. at <= len(text)) return
      status = number_ok
      if (len(digits) > 0 .and. exponent >= tiny_exponent) then
         if (exponent > huge_exponent .or. (exponent == huge_exponent .and. leading(digits) > huge_digits)) then
            status = number_not_finite
            return
         end if
         digits = digits//"e"//integer_text(exponent - len(digits))
         read (digits, *, iostat=iostat) value
         if (iostat /= 0) status = number_malformed
      end if
      if (negative) value = -value
   end subroutine parse_real

   !> The digits that decide against the largest number.
   pure function leading(digits) result(head)
      character(*), intent(in) :: digits
      character(len(huge_digits)) :: head

      head = digits
   end function leading

   !> Whether the text is one of Fortran's words for a value that is not finite.
   pure logical function is_non_finite_word(text)
      character(*), intent(in) :: text
      character(:), allocatable :: word

      word = lower(text)
      if (scan(word, "+-") == 1) word = word(2:)
      is_non_finite_word = word == "inf" .or. word == "infinity" .or. word == "nan"
      if (len(word) > 4) is_non_finite_word = is_non_finite_word .or. word(:4) == "nan("
   end function is_non_finite_word

   pure subroutine take_sign(text, at, negative)
      character(*), intent(in) :: text
      integer, intent(inout) :: at
      logical, intent(out) :: negative

      negative = .false.
      if (at > len(text)) return
      negative = text(at:at) == "-"
      if (negative .or. text(at:at) == "+") at = at + 1
   end subroutine take_sign

   !> Significant digits and the exponent for which the number is 0.digits times 10**exponent; no digits for zero.
   pure subroutine take_mantissa(text, at, digits, exponent, ok)
      character(*), intent(in) :: text
      integer, intent(inout) :: at
      character(:), allocatable, intent(out) :: digits
      integer, intent(out) :: exponent
      logical, intent(out) :: ok
      integer :: before, zeros

      digits = digit_run(text, at)
      before = len(digits)
      at = at + before
      if (at <= len(text)) then
         if (text(at:at) == ".") then
            digits = digits//digit_run(text, at + 1)
            at = at + 1 + len(digits) - before
         end if
      end if
      ok = len(digits) > 0
      zeros = verify(digits//"1", "0") - 1
      digits = digits(zeros + 1:)
      exponent = before - zeros
   end subroutine take_mantissa

   !> Add the exponent that stands at `at`, if there is one; beyond six digits it counts as a million.
   pure subroutine take_exponent(text, at, exponent, ok)
      character(*), intent(in) :: text
      integer, intent(inout) :: at
      integer, intent(inout) :: exponent
      logical, intent(out) :: ok
      character(:), allocatable :: digits
      integer :: shift
      logical :: negative

      ok = .true.
      if (at > len(text)) return
      ok = scan(text(at:at), "eEdDqQ") == 1
      if (.not. ok) return
      at = at + 1
      call take_sign(text, at, negative)
      digits = digit_run(text, at)
      at = at + len(digits)
      ok = len(digits) > 0
      if (.not. ok) return
      digits = digits(min(verify(digits//"1", "0"), len(digits)):)
      shift = 1000000
      if (len(digits) <= 6) read (digits, *) shift
      exponent = exponent + merge(-shift, shift, negative)
   end subroutine take_exponent

   !> The digits that stand at `at`.
   pure function digit_run(text, at) result(digits)
      character(*), intent(in) :: text
      integer, intent(in) :: at
      character(:), allocatable :: digits

      digits = text(at:at + verify(text(at:)//" ", "0123456789") - 2)
   end function digit_run

   !> Read an integer of default kind; a point or an exponent makes it malformed, nothing is rounded.
   pure subroutine parse_integer(text, value, status)
      character(*), intent(in) :: text
      !> Zero unless `status` is `number_ok`
      integer, intent(out) :: value
      integer, intent(out) :: status
      character(:), allocatable :: digits
      integer(i8) :: long
      integer :: at
      logical :: negative

      value = 0
      status = number_malformed
      at = 1
      call take_sign(text, at, negative)
      digits = digit_run(text, at)
      if (len(digits) == 0 .or. at + len(digits) <= len(text)) return
      digits = digits(min(verify(digits//"1", "0"), len(digits)):)
      status = number_not_finite
      if (len(digits) > range(long)) return
      read (digits, *) long
      if (long > huge(value)) return
      value = int(merge(-long, long, negative))
      status = number_ok
   end subroutine parse_integer

   !> Read `.true.`, `.t.`, `true`, `t` or the same for false, in any case.
   pure subroutine parse_logical(text, value, ok)
      character(*), intent(in) :: text
      logical, intent(out) :: value
      logical, intent(out) :: ok

      ok = .true.
      value = .false.
      select case (lower(text))
      case (".true.", ".t.", "true", "t")
         value = .true.
      case (".false.", ".f.", "false", "f")
         value = .false.
      case default
         ok = .false.
      end select
   end subroutine parse_logical

end module razy_core_number
