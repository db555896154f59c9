!! Kinds of numbers and the constants that need no unit.
module razy_core_kinds
   use, intrinsic :: iso_fortran_env, only: int64, real64
   implicit none(type, external)
   private

   public :: wp, qp, i8

   !> Working precision of all computations.
   integer, parameter :: wp = real64
   !> Precision in which constants of a scene (tooth frequencies) are formed once, never used in a loop: 33 digits, or 18 where
   !> the compiler has no more.
   integer, parameter :: qp = max(selected_real_kind(33), selected_real_kind(18))
   !> Integers that count steps, events and bytes.
   integer, parameter :: i8 = int64

   real(wp), parameter, public :: pi = acos(-1.0_wp)
end module razy_core_kinds
