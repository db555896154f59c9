!! What served in a mode, for the next time that the motion enters it: the first step, and how many steps it took.
!!
!! A mode is told by a number formed of its branches; two that share a slot of the table forget each other, which costs a
!! step to start with and nothing else. All is forgotten at the start of a run, so that no run depends on another.
module razy_runge_kutta_memory
   use razy_contact_contact_law, only: branches
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: step_memory_t

   integer, parameter :: slots = 64
   integer(i8), parameter :: modulus = 2147483647_i8

   type :: step_memory_t
      private
      integer(i8) :: code(slots) = -1
      real(wp) :: h(slots) = 0.0_wp
      integer :: steps(slots) = 0
      !> The slot of the present mode.
      integer :: now = 1
   contains
      procedure :: forget
      procedure :: enter
      procedure :: keep_step
      procedure :: keep_count
   end type step_memory_t

contains

   pure subroutine forget(self)
      class(step_memory_t), intent(inout) :: self

      self%code = -1
   end subroutine forget

   !> Enter the mode of these branches: the step and the number of steps remembered for it, 0 if there are none.
   pure subroutine enter(self, branch, h, steps)
      class(step_memory_t), intent(inout) :: self
      integer, intent(in) :: branch(:)
      real(wp), intent(out) :: h
      integer, intent(out) :: steps

      integer(i8) :: code
      integer :: j

      code = 0
      do j = 1, size(branch)
         code = modulo(code*(branches + 1) + branch(j), modulus)
      end do
      self%now = int(modulo(code, int(slots, i8))) + 1
      if (self%code(self%now) /= code) then
         self%code(self%now) = code
         self%h(self%now) = 0.0_wp
         self%steps(self%now) = 0
      end if
      h = self%h(self%now)
      steps = self%steps(self%now)
   end subroutine enter

   !> Remember the step h for the mode entered last.
   pure subroutine keep_step(self, h)
      class(step_memory_t), intent(inout) :: self
      real(wp), intent(in) :: h

      self%h(self%now) = h
   end subroutine keep_step

   !> Remember the number of steps in it.
   pure subroutine keep_count(self, steps)
      class(step_memory_t), intent(inout) :: self
      integer, intent(in) :: steps

      self%steps(self%now) = steps
   end subroutine keep_count

end module razy_runge_kutta_memory
