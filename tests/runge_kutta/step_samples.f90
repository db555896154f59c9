!! A machine in a mode whose forces are in its matrices, and steps from the same point again and again, until there is a map.
module step_samples
   use machine_samples, only: add_contact, stop_law
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_machine_machine, only: machine_t
   use smooth_motions, only: sample
   implicit none(type, external)
   private

   public :: chain_on_stops, serve

contains

   !> A chain of three masses under two tones, its second on a stop that moves with both and is closed, its third near another.
   function chain_on_stops() result(machine)
      type(machine_t) :: machine

      machine = sample("chain")
      call add_contact(machine, [0.0_wp, 1.0_wp, 0.0_wp], stop_law("upper", 0.1_wp, 3.0e4_wp, 12.0_wp), &
                       0.5_wp, [(1.0e-3_wp, 2.0e-3_wp), (0.0_wp, -1.0e-3_wp)])
      call add_contact(machine, [0.5_wp, 0.0_wp, -1.0_wp], stop_law("both", 0.9_wp, 2.0e4_wp), &
                       -0.7_wp, [(0.0_wp, 0.0_wp), (1.0e-3_wp, 0.0_wp)])
      machine%displacement = [0.01_wp, 0.02_wp, -0.03_wp]
      machine%velocity = [1.0_wp, -0.5_wp, 0.2_wp]
   end function chain_on_stops

   !> Attempt the same step h from (tau, z), again and again.
   subroutine serve(stepper, field, tau, z, h, times)
      type(stepper_t), intent(inout) :: stepper
      type(field_t), intent(inout) :: field
      real(wp), intent(in), contiguous :: z(:)
      real(wp), intent(in) :: tau, h
      integer, intent(in) :: times

      integer :: i
      logical :: accepted, failed

      do i = 1, times
         call stepper%restart()
         call stepper%attempt(field, tau, z, h, accepted, failed)
      end do
   end subroutine serve

end module step_samples
