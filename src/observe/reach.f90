!! How far a motion goes beyond what the geometry of its machine holds to.
!!
!! The coordinates are looked at at the ends of pieces and so many times in the motion. What contacts and observables do not feel
!! is not followed, and not seen.
module razy_observe_reach
   use razy_core_kinds, only: wp
   use razy_core_text, only: append_text, string_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: reach_t

   !> Looks at a motion.
   integer, parameter :: looks = 4000

   type, extends(observer_t) :: reach_t
      !> Names and units of the coordinates, bounds, largest displacements, now, velocities (n each).
      character(64), allocatable, private :: name(:)
      character(16), allocatable, private :: unit(:)
      real(wp), allocatable, private :: bound(:), largest(:), q(:), v(:)
      !> Time between looks, and of the next, s.
      real(wp), private :: interval = 0.0_wp, next = 0.0_wp
   contains
      procedure :: attach
      procedure :: piece
      procedure :: words
   end type reach_t

contains

   !> Begin anew with a motion of a machine until `t_end`, s.
   subroutine attach(self, machine, t_end)
      class(reach_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      self%bound = [real(wp) ::]
      if (allocated(machine%holds_to)) self%bound = machine%holds_to
      self%name = machine%coordinate
      self%unit = machine%unit
      self%largest = 0*machine%displacement
      self%q = machine%displacement
      self%v = machine%velocity
      self%interval = t_end/looks
      self%next = 0.0_wp
   end subroutine attach

   !> Look at the times within a piece, and at its end.
   subroutine piece(self, part)
      class(reach_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: end

      if (size(self%bound) == 0) return
      end = part%time + part%duration
      do while (self%next < end)
         call look(max(self%next - part%time, 0.0_wp))
         self%next = self%next + self%interval
      end do
      call look(part%duration)

   contains

      subroutine look(tau)
         real(wp), intent(in) :: tau

         call part%by%state(tau, self%q, self%v)
         self%largest = max(self%largest, abs(self%q))
      end subroutine look

   end subroutine piece

   !> A line for each coordinate that went too far.
   subroutine words(self, lines)
      class(reach_t), intent(in) :: self
      type(string_t), allocatable, intent(inout) :: lines(:)

      character(10) :: bound, reached
      integer :: i

      do i = 1, size(self%bound)
         if (self%largest(i) <= self%bound(i)) cycle
         write (bound, "(es10.2)") self%bound(i)
         write (reached, "(es10.2)") self%largest(i)
         call append_text(lines, "'"//trim(self%name(i))//"' goes to "//trim(adjustl(reached))//" "//trim(self%unit(i))// &
                          ", beyond "//trim(adjustl(bound))//" "//trim(self%unit(i))//": the geometry is that of small motion "// &
                          "(docs/namelist/body.md)")
      end do
   end subroutine words

end module razy_observe_reach
