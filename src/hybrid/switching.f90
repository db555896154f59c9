!! Gear meshes whose stiffness switches between levels, as that of n and of n + 1 pairs of teeth, at times known beforehand.
!!
!! With the frequency f of the teeth and a phase p in turns a level ends at the part e of a period where f t + p = m + e, m whole.
!! Times are formed from m, not added up. In a run-up it is f t + r t²/2, which does not turn back.
module razy_hybrid_switching
   use razy_core_kinds, only: i8, wp
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: switching_t

   !> Whether any does; the level of the law, 0 where the stiffness does not switch, the turn m, and the time of the next switch, s
   !> (contacts).
   type :: switching_t
      logical :: acts = .false.
      integer, allocatable, private :: level(:)
      integer(i8), allocatable, private :: turn(:)
      real(wp), allocatable, private :: at(:)
   contains
      procedure :: begin
      procedure :: rest
      procedure :: pass
   end type switching_t

   real(wp), parameter :: rounding = 8*epsilon(1.0_wp)

contains

   !> A motion of the machine begins at the time `from`, s: its branches get their levels.
   pure subroutine begin(self, machine, from, branch)
      class(switching_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: from
      integer, intent(inout) :: branch(:)

      real(wp) :: phase
      integer :: j

      self%level = [(0, j=1, size(branch))]
      self%acts = any(machine%contact%mesh_tone > 0)
      self%turn = int(self%level, i8)
      self%at = spread(huge(1.0_wp), 1, size(branch))
      do j = 1, size(branch)
         associate (contact => machine%contact(j))
            if (contact%mesh_tone == 0) cycle
            associate (teeth => machine%tone(contact%mesh_tone))
               phase = contact%mesh_phase + (teeth%hertz + 0.5_wp*teeth%sweep*from)*from
            end associate
            self%turn(j) = floor(phase, i8)
            phase = phase - real(self%turn(j), wp)
            self%level(j) = 1 + modulo(count(contact%mesh_end <= phase), size(contact%mesh_end))
            branch(j) = machine%contact(j)%law%at_level(branch(j), self%level(j))
            call foresee(self, machine, j)
         end associate
      end do
   end subroutine begin

   !> When contact j switches next.
   pure subroutine foresee(self, machine, j)
      type(switching_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: j

      real(wp) :: ahead, square

      associate (contact => machine%contact(j), teeth => machine%tone(machine%contact(j)%mesh_tone))
         ahead = real(self%turn(j), wp) + (merge(1.0_wp, contact%mesh_end(self%level(j)), self%level(j) == 1) - contact%mesh_phase)
         square = teeth%hertz**2 + 2*teeth%sweep*ahead
         self%at(j) = huge(1.0_wp)
         if (square >= 0.0_wp) self%at(j) = 2*ahead/(teeth%hertz + sqrt(square))
      end associate
   end subroutine foresee

   !> Time until the next switch from `time + time_low` on, s, not 0.
   pure function rest(self, time, time_low)
      class(switching_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      real(wp) :: rest

      associate (next => minval(self%at))
         rest = max((next - time) - time_low, rounding*abs(next), tiny(1.0_wp))
      end associate
   end function rest

   !> All that switches next does so: the branches that follow, in which contacts that are `switched` have changed.
   pure subroutine pass(self, machine, branch, switched)
      class(switching_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      integer, intent(inout) :: branch(:)
      logical, intent(out) :: switched(:)

      integer :: j

      switched = self%level > 0 .and. self%at <= minval(self%at) + rounding*abs(minval(self%at))
      do j = 1, size(branch)
         if (.not. switched(j)) cycle
         self%level(j) = 1 + modulo(self%level(j), size(machine%contact(j)%mesh_end))
         if (self%level(j) == 2) self%turn(j) = self%turn(j) + 1
         branch(j) = machine%contact(j)%law%at_level(branch(j), self%level(j))
         call foresee(self, machine, j)
      end do
   end subroutine pass

end module razy_hybrid_switching
