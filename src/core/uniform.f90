!! Random numbers by position: each is a function of a key and a counter, so it does not depend on what was drawn before, or where.
!!
!! Threefry-2x32 with 20 rounds: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Parallel random numbers: as easy as 1, 2, 3,
!! Proc. SC'11 (2011). Words of 32 bits are kept in integers of 64, whose sums cannot overflow.
module razy_core_uniform
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: threefry, uniform

   integer(i8), parameter :: mask = 4294967295_i8, parity = int(z'1BD11BDA', i8)
   integer, parameter :: rotation(0:7) = [13, 15, 26, 6, 17, 29, 16, 24]

contains

   !> The two words (2) of a counter (2) under a key (2), each of which counts modulo 2^32.
   pure function threefry(key, counter) result(word)
      integer(i8), intent(in) :: key(2), counter(2)
      integer(i8) :: word(2)

      integer(i8) :: schedule(0:2)
      integer :: block, round

      schedule(:1) = iand(key, mask)
      schedule(2) = ieor(parity, ieor(schedule(0), schedule(1)))
      word = iand(iand(counter, mask) + schedule(:1), mask)
      do round = 1, 20
         word(1) = iand(word(1) + word(2), mask)
         word(2) = ieor(rotated(word(2), rotation(modulo(round - 1, 8))), word(1))
         if (modulo(round, 4) /= 0) cycle
         block = round/4
         word(1) = iand(word(1) + schedule(modulo(block, 3)), mask)
         word(2) = iand(word(2) + schedule(modulo(block + 1, 3)) + block, mask)
      end do
   end function threefry

   !> A number from [0, 1), a multiple of 2^-53.
   pure real(wp) function uniform(key, counter)
      integer(i8), intent(in) :: key(2), counter(2)

      integer(i8) :: word(2)

      word = threefry(key, counter)
      uniform = scale(real(ishft(word(1), 21) + ishft(word(2), -11), wp), -53)
   end function uniform

   !> The bits of a word turned to the left.
   pure integer(i8) function rotated(word, by)
      integer(i8), intent(in) :: word
      integer, intent(in) :: by

      rotated = iand(ior(ishft(word, by), ishft(word, by - 32)), mask)
   end function rotated

end module razy_core_uniform
