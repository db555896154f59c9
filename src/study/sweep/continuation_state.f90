!! What a chain of motions carries from one to the next: displacements, velocities, and the phase of each tone.
!!
!! Time begins at 0 in each motion, but the excitation goes on: at the start of the next motion each tone has the phase that it had
!! at the end of the last, so that with another frequency the force has a kink at most, and with the same none. Tones are matched
!! by their number; where the next machine has another number of tones, all of them begin at phase 0.
!!
!! The state is that of all coordinates: which part of them contacts feel may change with the parameter. It stands in the row of a
!! point, in columns that the result file does not have; they are empty after a motion that failed, and the next motion then
!! starts as the input says.
module razy_study_sweep_continuation_state
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_machine_excitation, only: turn_tones
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: integrator_t
   implicit none(type, external)
   private

   public :: continuation_state_t

   !> The end of a motion; empty arrays if there is none.
   type :: continuation_state_t
      !> Displacement and velocity (n each).
      real(wp), allocatable :: displacement(:), velocity(:)
      !> e^{iφ} of each tone (tones).
      complex(wp), allocatable :: phasor(:)
   contains
      procedure :: begin
      procedure :: finish
      procedure :: columns
      procedure :: take_from
   end type continuation_state_t

contains

   !> Let a machine start from here.
   pure subroutine begin(self, machine)
      class(continuation_state_t), intent(inout) :: self
      type(machine_t), intent(inout) :: machine

      if (size(self%displacement) > 0) then
         machine%displacement = self%displacement
         machine%velocity = self%velocity
         if (size(self%phasor) == size(machine%tone)) then
            call turn_tones(machine, self%phasor)
            return
         end if
      end if
      self%phasor = spread((1.0_wp, 0.0_wp), 1, size(machine%tone))
   end subroutine begin

   !> A motion of the machine has ended at `t_end`, s, by this integrator.
   subroutine finish(self, machine, t_end, integrator)
      class(continuation_state_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end
      class(integrator_t), intent(in) :: integrator

      real(wp) :: cosine, sine
      integer :: t

      do t = 1, size(machine%tone)
         call machine%tone(t)%phasor(t_end, 0.0_wp, cosine, sine)
         self%phasor(t) = self%phasor(t)*cmplx(cosine, sine, wp)
         self%phasor(t) = self%phasor(t)/abs(self%phasor(t))
      end do
      self%displacement = machine%displacement
      self%velocity = machine%velocity
      call integrator%final_state(self%displacement, self%velocity)
   end subroutine finish

   !> Hand over the state as columns of a row, empty if it is not there.
   pure subroutine columns(self, row)
      class(continuation_state_t), intent(in) :: self
      type(table_t), intent(inout) :: row

      call row%add("continuation/displacement", self%displacement, "1", "displacement", "continuation/coordinate")
      call row%add("continuation/velocity", self%velocity, "1", "velocity", "continuation/coordinate")
      call row%add("continuation/cosine", real(self%phasor, wp), "1", "real part of the phasor", "continuation/tone")
      call row%add("continuation/sine", aimag(self%phasor), "1", "imaginary part of the phasor", "continuation/tone")
   end subroutine columns

   !> The state in the row of the link before; none where there is no such row.
   pure subroutine take_from(self, row)
      class(continuation_state_t), intent(inout) :: self
      type(table_t), intent(in), optional :: row

      integer :: first

      if (.not. present(row)) then
         self%displacement = [real(wp) ::]
         self%velocity = [real(wp) ::]
         self%phasor = [complex(wp) ::]
         return
      end if
      first = row%place_of("continuation/displacement")
      self%displacement = row%column(first)%reals
      self%velocity = row%column(first + 1)%reals
      self%phasor = cmplx(row%column(first + 2)%reals, row%column(first + 3)%reals, wp)
   end subroutine take_from

end module razy_study_sweep_continuation_state
