!! What an assertion compares: scalars and arrays up to rank 3 of the four types the tests use, flattened in element order.
!!
!! With `pf_values` as the one generic name, an assertion is written once, not once for each type and rank.
module funit_values
   use, intrinsic :: iso_fortran_env, only: int64, wp => real64
   implicit none(type, external)
   private

   public :: values_t, pf_values, is_nan, is_infinite

   integer, parameter, public :: is_real = 1, is_integer = 2, is_logical = 3, is_text = 4

   !> A flattened operand; only the component named by `kind` is allocated.
   type :: values_t
      !> One of `is_real`, `is_integer`, `is_logical`, `is_text`.
      integer :: kind = 0
      !> The operand's shape; size 0 for a scalar.
      integer, allocatable :: extent(:)
      real(wp), allocatable :: real(:)
      integer, allocatable :: integer(:)
      logical, allocatable :: logical(:)
      character(:), allocatable :: text(:)
   contains
      procedure :: length
      procedure :: element
   end type values_t

   !> Flatten a scalar or an array of rank 1 to 3, texts of rank 1.
   interface pf_values
      procedure :: real_0, real_1, real_2, real_3
      procedure :: integer_0, integer_1, integer_2, integer_3
      procedure :: logical_0, logical_1, logical_2, logical_3
      procedure :: text_0, text_1
   end interface pf_values

   !> Bits of the exponent: all set in an infinity, all set and something more in a NaN.
   integer(int64), parameter :: exponent_bits = shiftl(2047_int64, 52)

contains

   !> Whether x is a NaN. Read from the bits, because any comparison of a signalling NaN traps.
   elemental logical function is_nan(x)
      real(wp), intent(in) :: x

      is_nan = iand(transfer(x, 0_int64), huge(0_int64)) > exponent_bits
   end function is_nan

   !> Whether x is an infinity of either sign.
   elemental logical function is_infinite(x)
      real(wp), intent(in) :: x

      is_infinite = iand(transfer(x, 0_int64), huge(0_int64)) == exponent_bits
   end function is_infinite

   !> Number of elements, 1 for a scalar.
   pure integer function length(self)
      class(values_t), intent(in) :: self

      length = product(self%extent)
   end function length

   !> Element k (counted in element order; a scalar is every element) as a text for the user.
   pure function element(self, k) result(text)
      class(values_t), intent(in) :: self
      integer, intent(in) :: k
      character(:), allocatable :: text
      character(32) :: buffer
      integer :: at

      at = merge(1, k, size(self%extent) == 0)
      select case (self%kind)
      case (is_real)
         if (is_nan(self%real(at))) then
            buffer = "NaN"
         else if (is_infinite(self%real(at))) then
            buffer = merge("+Infinity", "-Infinity", transfer(self%real(at), 0_int64) > 0)
         else
            write (buffer, "(es25.16e3)") self%real(at)
         end if
         text = trim(adjustl(buffer))
      case (is_integer)
         write (buffer, "(i0)") self%integer(at)
         text = trim(buffer)
      case (is_logical)
         text = merge("T", "F", self%logical(at))
      case default
         text = "'"//trim(self%text(at))//"'"
      end select
   end function element

   pure function real_0(x) result(values)
      real(wp), intent(in) :: x
      type(values_t) :: values

      values%kind = is_real
      allocate (values%extent(0))
      allocate (values%real, source=[x])
   end function real_0

   pure function real_1(x) result(values)
      real(wp), intent(in) :: x(:)
      type(values_t) :: values

      values%kind = is_real
      allocate (values%extent, source=shape(x))
      allocate (values%real, source=x)
   end function real_1

   pure function real_2(x) result(values)
      real(wp), intent(in) :: x(:, :)
      type(values_t) :: values

      values%kind = is_real
      allocate (values%extent, source=shape(x))
      allocate (values%real, source=reshape(x, [size(x)]))
   end function real_2

   pure function real_3(x) result(values)
      real(wp), intent(in) :: x(:, :, :)
      type(values_t) :: values

      values%kind = is_real
      allocate (values%extent, source=shape(x))
      allocate (values%real, source=reshape(x, [size(x)]))
   end function real_3

   pure function integer_0(x) result(values)
      integer, intent(in) :: x
      type(values_t) :: values

      values%kind = is_integer
      allocate (values%extent(0))
      allocate (values%integer, source=[x])
   end function integer_0

   pure function integer_1(x) result(values)
      integer, intent(in) :: x(:)
      type(values_t) :: values

      values%kind = is_integer
      allocate (values%extent, source=shape(x))
      allocate (values%integer, source=x)
   end function integer_1

   pure function integer_2(x) result(values)
      integer, intent(in) :: x(:, :)
      type(values_t) :: values

      values%kind = is_integer
      allocate (values%extent, source=shape(x))
      allocate (values%integer, source=reshape(x, [size(x)]))
   end function integer_2

   pure function integer_3(x) result(values)
      integer, intent(in) :: x(:, :, :)
      type(values_t) :: values

      values%kind = is_integer
      allocate (values%extent, source=shape(x))
      allocate (values%integer, source=reshape(x, [size(x)]))
   end function integer_3

   pure function logical_0(x) result(values)
      logical, intent(in) :: x
      type(values_t) :: values

      values%kind = is_logical
      allocate (values%extent(0))
      allocate (values%logical, source=[x])
   end function logical_0

   pure function logical_1(x) result(values)
      logical, intent(in) :: x(:)
      type(values_t) :: values

      values%kind = is_logical
      allocate (values%extent, source=shape(x))
      allocate (values%logical, source=x)
   end function logical_1

   pure function logical_2(x) result(values)
      logical, intent(in) :: x(:, :)
      type(values_t) :: values

      values%kind = is_logical
      allocate (values%extent, source=shape(x))
      allocate (values%logical, source=reshape(x, [size(x)]))
   end function logical_2

   pure function logical_3(x) result(values)
      logical, intent(in) :: x(:, :, :)
      type(values_t) :: values

      values%kind = is_logical
      allocate (values%extent, source=shape(x))
      allocate (values%logical, source=reshape(x, [size(x)]))
   end function logical_3

   pure function text_0(x) result(values)
      character(*), intent(in) :: x
      type(values_t) :: values

      values%kind = is_text
      allocate (values%extent(0))
      allocate (values%text, source=[x])
   end function text_0

   pure function text_1(x) result(values)
      character(*), intent(in) :: x(:)
      type(values_t) :: values

      values%kind = is_text
      allocate (values%extent, source=shape(x))
      allocate (values%text, source=x)
   end function text_1

end module funit_values
