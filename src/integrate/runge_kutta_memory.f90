!! Steps that served in a mode, for the next time that the motion enters it.
!!
!! A mode is told by a number formed of its branches; two that share a slot of the table forget each other, which costs a
!! step to start with and nothing else. All is forgotten at the start of a run, so that no run depends on another.
module razy_integrate_runge_kutta_memory
   use razy_contact_contact_law, only: branches
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: step_memory_t

   integer, parameter :: slots = 64
   integer(i8), parameter :: modulus = 2147483647_i8

   type :: step_memory_t
      integer(i8) :: code(slots) = -1
      real(wp) :: h(slots) = 0.0_wp
   contains
      procedure :: forget
      procedure :: keep
      procedure :: step
   end type step_memory_t

contains

   pure subroutine forget(self)
      class(step_memory_t), intent(inout) :: self

      self%code = -1
      self%h = 0.0_wp
   end subroutine forget

   pure function code_of(branch) result(code)
      integer, intent(in) :: branch(:)
      integer(i8) :: code

      integer :: j

      code = 0
      do j = 1, size(branch)
         code = modulo(code*(branches + 1) + branch(j), modulus)
      end do
   end function code_of

   !> Remember the step h for these branches.
   pure subroutine keep(self, branch, h)
      class(step_memory_t), intent(inout) :: self
      integer, intent(in) :: branch(:)
      real(wp), intent(in) :: h

      integer(i8) :: code
      integer :: slot

      code = code_of(branch)
      slot = int(modulo(code, int(slots, i8))) + 1
      self%code(slot) = code
      self%h(slot) = h
   end subroutine keep

   !> The step remembered for these branches, 0 if there is none.
   pure function step(self, branch) result(h)
      class(step_memory_t), intent(in) :: self
      integer, intent(in) :: branch(:)
      real(wp) :: h

      integer(i8) :: code
      integer :: slot

      code = code_of(branch)
      slot = int(modulo(code, int(slots, i8))) + 1
      h = 0.0_wp
      if (self%code(slot) == code) h = self%h(slot)
   end function step

end module razy_integrate_runge_kutta_memory
