!! Lanes at the width of the processor's vectors, which is asked for at run time.
!!
!! The modules of the levels 3 and 4 are made from razy_exact_lanes_kernel by CMake and differ in the instructions that the compiler
!! may use, and so in speed. Their bits are the same: each lane is computed by itself, in one order, and no product is contracted
!! with a sum.
module razy_exact_lanes_width
   use, intrinsic :: iso_c_binding, only: c_int
   use razy_exact_lanes_block, only: block_t
   use razy_exact_lanes_gates, only: gate_t, lane_mode_t
   use razy_exact_lanes_kernel, only: follow_by_two => follow_pieces
   use razy_exact_lanes_kernel_v3, only: follow_by_four => follow_pieces
   use razy_exact_lanes_kernel_v4, only: follow_by_eight => follow_pieces
   implicit none(type, external)
   private

   public :: follow_at_width, widest

   interface
      integer(c_int) function vector_level() bind(c, name="razy_vector_level")
         import :: c_int
         implicit none(type, external)
      end function vector_level
   end interface

contains

   !> The level of x86-64 whose instructions this processor has: 2, 3 or 4.
   integer function widest()
      widest = int(vector_level())
   end function widest

   !> Follow a piece in each lane (razy_exact_lanes_kernel) by the instructions of `level`, or those below it.
   subroutine follow_at_width(level, mode, gate, b)
      integer, intent(in) :: level
      type(lane_mode_t), intent(in) :: mode
      type(gate_t), intent(in) :: gate
      type(block_t), intent(inout) :: b

      if (level >= 4) then
         call follow_by_eight(mode, gate, b)
      else if (level == 3) then
         call follow_by_four(mode, gate, b)
      else
         call follow_by_two(mode, gate, b)
      end if
   end subroutine follow_at_width

end module razy_exact_lanes_width
