!! The period of a machine's excitation.
module razy_machine_excitation
   use razy_core_kinds, only: wp
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: excitation_period

   !> Frequencies this close to a multiple of the lowest, relative to it, are one.
   real(wp), parameter :: closeness = 1.0e-9_wp

contains

   !> Period of the lowest tone that acts on the machine, s; 0 if there is none, or if another one is no multiple of it.
   pure function excitation_period(machine) result(period)
      type(machine_t), intent(in) :: machine
      real(wp) :: period

      real(wp), allocatable :: hertz(:)
      logical :: acts(size(machine%tone))
      integer :: j, t

      period = 0.0_wp
      do t = 1, size(acts)
         acts(t) = any(abs(machine%harmonic_load(:, t)) > 0.0_wp)
         do j = 1, size(machine%contact)
            acts(t) = acts(t) .or. abs(machine%contact(j)%error(t)) > 0.0_wp
         end do
         acts(t) = acts(t) .and. machine%tone(t)%hertz > 0.0_wp
      end do
      hertz = pack(machine%tone%hertz, acts)
      if (size(hertz) == 0) return
      if (any(abs(hertz/minval(hertz) - anint(hertz/minval(hertz))) > closeness*hertz/minval(hertz))) return
      period = 1.0_wp/minval(hertz)
   end function excitation_period

end module razy_machine_excitation
