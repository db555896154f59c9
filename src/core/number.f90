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

   public :: counted, decimal, to_text, parse_real, parse_integer, parse_logical
   public :: number_ok, number_malformed, number_not_finite

   !> Outcomes of `parse_real` and `parse_integer`; an integer is "not finite" when the default kind cannot hold it.
   integer, parameter :: number_ok = 0, number_malformed = 1, number_not_finite = 2

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
      ! What rounds to zero has no sign.
      if (verify(text, "-0.") == 0) text = text(index(text, "-") + 1:)
   end function decimal

   !> A number, as text, of what is counted: "1 point", "2 points".
   pure function counted(number, what) result(text)
      character(*), intent(in) :: number, what
      character(:), allocatable :: text

      text = number//" "//what//trim(merge(" ", "s", number == "1"))
   end function counted

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

   !> Shortest text that reads back to the same bits, with an exponent only where it is shorter to read; `nan`, `inf` and
   !> `-inf` for what is not finite.
   pure function real_text(value) result(text)
      real(wp), intent(in) :: value
      character(:), allocatable :: text
      !> Powers of ten between which a number has no exponent
      integer, parameter :: least = -3, most = 6
      character(40) :: buffer, edit
      character(:), allocatable :: digits, tail
      real(wp) :: back
      integer :: places, exponent, mark, status

      if (ieee_is_nan(value)) then
         text = "nan"
         return
      else if (.not. ieee_is_finite(value)) then
         text = trim(merge("-inf", "inf ", value < 0.0_wp))
         return
      end if
      ! Fifteen digits hold all that a normal number may have been written with; zeros behind go below.
      do places = merge(14, 0, abs(value) >= tiny(value)), 16
         write (edit, '("(es40.", i0, "e4)")') places
         write (buffer, edit) abs(value)
         buffer = adjustl(buffer)
         call parse_real(trim(buffer), back, status)
         if (status == number_ok .and. .not. abs(value) > back .and. .not. abs(value) < back) exit
      end do
      mark = scan(buffer, "E")
      read (buffer(mark + 1:), *) exponent
      digits = buffer(1:1)//buffer(3:mark - 1)
      digits = digits(:max(1, verify(digits, "0", back=.true.)))
      tail = ""
      if (exponent < least .or. exponent > most) then
         tail = "e"//integer_text(exponent)
         exponent = 0
      end if
      digits = repeat("0", max(0, -exponent))//digits
      exponent = max(0, exponent)
      digits = digits//repeat("0", max(0, exponent + 2 - len(digits)))
      text = digits(:exponent + 1)//"."//digits(exponent + 2:)//tail
      if (ieee_is_negative(value)) text = "-"//text
   end function real_text

   !> Read a real number: sign, digits with or without a point, exponent with e, d or q.
   pure subroutine parse_real(text, value, status)
      character(*), intent(in) :: text
      !> Zero unless `status` is `number_ok`; correctly rounded
      real(wp), intent(out) :: value
      integer, intent(out) :: status
      !> The largest number begins with these digits and is 0.17976931348623157e309; below 0.1e-330 everything is zero
      character(*), parameter :: huge_digits = "17976931348623157"
      integer, parameter :: huge_exponent = 309, tiny_exponent = -330
      !> Beyond it a number is zero or not finite, however many digits stand before its point
      integer, parameter :: widest_exponent = 1000000
      character(:), allocatable :: digits
      integer :: exponent, mark, point, zeros

      value = 0.0_wp
      status = number_malformed
      digits = lower(unsigned(text))
      if (digits == "inf" .or. digits == "infinity" .or. digits == "nan" .or. index(digits, "nan(") == 1) status = number_not_finite
      mark = scan(text//"e", "eEdDqQ")
      digits = unsigned(text(:mark - 1))
      point = index(digits//".", ".")
      digits = digits(:point - 1)//digits(point + 1:)
      if (len(digits) == 0 .or. verify(digits, "0123456789") > 0) return
      exponent = 0
      if (mark <= len(text)) then
         call parse_integer(text(mark + 1:), exponent, status)
         if (status == number_malformed) return
         if (status == number_not_finite) exponent = merge(-widest_exponent, widest_exponent, text(mark + 1:mark + 1) == "-")
      end if
      ! the number is 0.digits times 10**exponent, and zero has no digits
      zeros = verify(digits//"1", "0") - 1
      digits = digits(zeros + 1:)
      exponent = max(-widest_exponent, min(exponent, widest_exponent)) + point - 1 - zeros
      status = number_ok
      if (len(digits) > 0 .and. exponent >= tiny_exponent) then
         if (exponent > huge_exponent .or. (exponent == huge_exponent .and. digits(:min(len(digits), len(huge_digits))) > &
                                            huge_digits)) then
            status = number_not_finite
            return
         end if
         digits = digits//"e"//integer_text(exponent - len(digits))
         read (digits, *) value
      end if
      if (text(1:1) == "-") value = -value
   end subroutine parse_real

   !> A number without the sign before it.
   pure function unsigned(text) result(rest)
      character(*), intent(in) :: text
      character(:), allocatable :: rest

      rest = text(1 + scan(text(:min(1, len(text))), "+-"):)
   end function unsigned

   !> Read an integer of default kind; a point or an exponent makes it malformed, nothing is rounded.
   pure subroutine parse_integer(text, value, status)
      character(*), intent(in) :: text
      !> Zero unless `status` is `number_ok`
      integer, intent(out) :: value
      integer, intent(out) :: status
      character(:), allocatable :: digits
      integer(i8) :: long

      value = 0
      status = number_malformed
      digits = unsigned(text)
      if (len(digits) == 0 .or. verify(digits, "0123456789") > 0) return
      digits = digits(min(verify(digits//"1", "0"), len(digits)):)
      status = number_not_finite
      if (len(digits) > range(long)) return
      read (digits, *) long
      if (long > huge(value)) return
      value = int(long)
      if (text(1:1) == "-") value = -value
      status = number_ok
   end subroutine parse_integer

   !> Read `.true.`, `.t.`, `true`, `t` or the same for false, in any case.
   pure subroutine parse_logical(text, value, ok)
      character(*), intent(in) :: text
      logical, intent(out) :: value
      logical, intent(out) :: ok

      value = any(lower(text) == [character(6) :: ".true.", ".t.", "true", "t"])
      ok = value .or. any(lower(text) == [character(7) :: ".false.", ".f.", "false", "f"])
   end subroutine parse_logical

end module razy_core_number
