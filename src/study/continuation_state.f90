!! What a chain of motions carries from one to the next: displacements, velocities, and the phase of each tone.
!!
!! Time begins at 0 in each motion, but the excitation goes on: at the start of the next motion each tone has the phase that it had
!! at the end of the last, so that with another frequency the force has a kink at most, and with the same none. Tones are matched
!! by their number; where the next machine has another number of tones, all of them begin at phase 0.
module razy_study_continuation_state
   use razy_core_kinds, only: i8, wp
   use razy_machine_machine, only: machine_t
   use razy_machine_excitation, only: turn_tones
   use razy_sweep_task, only: point_result_t
   implicit none(type, external)
   private

   public :: carried_t

   !> The end of a motion. Without `valid` there is none, and the next motion starts as the input says.
   type :: carried_t
      logical :: valid = .false.
      !> Displacement and velocity (n each).
      real(wp), allocatable :: displacement(:), velocity(:)
      !> e^{iφ} of each tone (tones).
      complex(wp), allocatable :: phasor(:)
   contains
      procedure :: begin
      procedure :: forget
      procedure :: finish
      procedure :: append_to
      procedure :: take_from
   end type carried_t

contains

   !> Let a machine start from here.
   pure subroutine begin(self, machine)
      class(carried_t), intent(inout) :: self
      type(machine_t), intent(inout) :: machine

      if (self%valid) then
         machine%displacement = self%displacement
         machine%velocity = self%velocity
         if (size(self%phasor) == size(machine%tone)) then
            call turn_tones(machine, self%phasor)
            return
         end if
      end if
      self%phasor = spread((1.0_wp, 0.0_wp), 1, size(machine%tone))
   end subroutine begin

   !> Nothing is carried on.
   pure subroutine forget(self)
      class(carried_t), intent(inout) :: self

      self%valid = .false.
   end subroutine forget

   !> A motion of the machine has ended at `t_end`, s, with this state (n each).
   pure subroutine finish(self, machine, t_end, displacement, velocity)
      class(carried_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end, displacement(:), velocity(:)

      real(wp) :: cosine, sine
      integer :: t

      do t = 1, size(machine%tone)
         call machine%tone(t)%phasor(t_end, 0.0_wp, cosine, sine)
         self%phasor(t) = self%phasor(t)*cmplx(cosine, sine, wp)
         self%phasor(t) = self%phasor(t)/abs(self%phasor(t))
      end do
      self%displacement = displacement
      self%velocity = velocity
      self%valid = .true.
   end subroutine finish

   !> Append to a result: number of coordinates and of tones, and the numbers.
   pure subroutine append_to(self, result)
      class(carried_t), intent(in) :: self
      type(point_result_t), intent(inout) :: result

      if (self%valid) then
         call result%append([size(self%displacement, kind=i8), size(self%phasor, kind=i8)])
         call result%append(self%displacement)
         call result%append(self%velocity)
         call result%append(real(self%phasor, wp))
         call result%append(aimag(self%phasor))
      else
         call result%append([0_i8, 0_i8])
      end if
   end subroutine append_to

   !> Take over what was appended to the end of a result.
   pure subroutine take_from(self, result)
      class(carried_t), intent(inout) :: self
      type(point_result_t), intent(in) :: result

      integer(i8) :: n, start, tones

      n = result%integers(result%n_integers - 1)
      tones = result%integers(result%n_integers)
      self%valid = n > 0
      if (.not. self%valid) return
      start = result%n_reals - 2*n - 2*tones
      self%displacement = result%reals(start + 1:start + n)
      self%velocity = result%reals(start + n + 1:start + 2*n)
      start = start + 2*n
      self%phasor = cmplx(result%reals(start + 1:start + tones), result%reals(start + tones + 1:start + 2*tones), wp)
   end subroutine take_from

end module razy_study_continuation_state
