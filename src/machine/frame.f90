!! The frame of a contact in a plane: a round hole around a place, such as a ring around a shaft, and what rubs on it.
!!
!! With the displacements d = (wᵀq - c₁, acrossᵀq - c₂) of the place from the centre of the hole, r = |d| and n = d/r, the
!! variable of the contact is s = r, in the direction n of the frame; friction on it slides along t = (n₂, -n₁) with
!! s' = t·d' + spinᵀq' + drive. Both directions turn with the place, by (t·d')/r:
!!
!!     n' = t (t·d')/r,   t' = -n (t·d')/r.
!!
!! A frame that turns with a tone e^{iφ} instead, as the cage of a bearing does, has s = nᵀq in the direction
!! n = cos(φ + α) w + sin(φ + α) across at any time, wherever the place is.
module razy_machine_frame
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: frame_t, outward

   !> Second direction of the frame, the first is that of the contact; what the turning of rubbing surfaces adds to s' (n or m
   !> each); centre of the hole, m. The tone that turns it, 0 if the place does, and e^{iα}.
   type :: frame_t
      real(wp), allocatable :: across(:), spin(:)
      real(wp) :: centre(2) = 0.0_wp
      integer :: tone = 0
      complex(wp) :: phase = (1.0_wp, 0.0_wp)
   end type frame_t

contains

   !> The unit vector n at d; at the centre that of the velocity, by which the place leaves it.
   pure function outward(d, velocity) result(n)
      real(wp), intent(in) :: d(2), velocity(2)
      real(wp) :: n(2)

      n = [1.0_wp, 0.0_wp]
      if (norm2(d) > 0.0_wp) then
         n = d/norm2(d)
      else if (norm2(velocity) > 0.0_wp) then
         n = velocity/norm2(velocity)
      end if
   end function outward

end module razy_machine_frame
