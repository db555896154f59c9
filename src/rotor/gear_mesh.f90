!! Geometry of the mesh of two external gears on parallel shafts (source thesis, (4.50)-(4.55)).
!!
!! The pitch point is at r1 (0, cos gamma, sin gamma) from the axis of gear 1, r its radius and gamma the angle of the line of
!! centres from y towards z. With r the direction of that line, t = x × r and x the axis, the force of gear 1 on gear 2 has
!! the direction
!!
!!     n = cos alpha (-h sin beta x + cos beta t) f + sin alpha r,
!!
!! with the normal pressure angle alpha, the helix angle beta, h = +1 if gear 1 is right-handed and -1 if left-handed, and
!! f = +1 if the working flank is loaded by a positive torque on gear 1 (-1: by a negative one). The mesh deformation
!!
!!     d = delta_1ᵀ q_1 - delta_2ᵀ q_2 + Delta(t),   delta_i = (n, rho_i × n),
!!
!! with rho_i from the node to the pitch point is positive in contact on the working flanks; the force on the gears is -delta_1 F
!! and +delta_2 F. The other flank has another normal; one vector for both is a limit of this model.
module razy_rotor_gear_mesh
   use razy_core_angle, only: turn
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: gear_mesh_t

   !> A mesh between the nodes of two shafts.
   type :: gear_mesh_t
      integer :: shaft(2) = 0, node(2) = 0
      !> Pitch radii, m; distance of the gears' middle planes from their nodes along +x, m.
      real(wp) :: radius(2) = 0.0_wp, offset(2) = 0.0_wp
      !> Normal pressure angle, helix angle, angle of the line of centres, deg.
      real(wp) :: pressure = 0.0_wp, helix = 0.0_wp, centre_line = 0.0_wp
      logical :: right_handed = .true.
      !> Whether a positive torque on gear 1 loads the working flanks.
      logical :: positive_drive = .true.
      !> Linear stiffness and damping of the closed mesh, N/m, N s/m.
      real(wp) :: stiffness = 0.0_wp, damping = 0.0_wp
   contains
      procedure :: direction
   end type gear_mesh_t

contains

   !> delta_i (6) of gear `gear` (1 or 2) in (u, v, w, phi, theta, psi) of its node.
   pure function direction(self, gear) result(delta)
      class(gear_mesh_t), intent(in) :: self
      integer, intent(in) :: gear
      real(wp) :: delta(6)

      complex(wp) :: line, helix, pressure
      real(wp) :: arm(3), flank, hand, normal(3), radial(3), tangent(3)

      line = turn(self%centre_line)
      helix = turn(self%helix)
      pressure = turn(self%pressure)
      radial = [0.0_wp, line%re, line%im]
      tangent = [0.0_wp, -line%im, line%re]
      hand = merge(1.0_wp, -1.0_wp, self%right_handed)
      flank = merge(1.0_wp, -1.0_wp, self%positive_drive)
      normal = flank*pressure%re*(helix%re*tangent - hand*helix%im*[1.0_wp, 0.0_wp, 0.0_wp]) + pressure%im*radial
      arm = merge(1.0_wp, -1.0_wp, gear == 1)*self%radius(gear)*radial
      arm(1) = self%offset(gear)
      delta(:3) = normal
      delta(4:) = [arm(2)*normal(3) - arm(3)*normal(2), arm(3)*normal(1) - arm(1)*normal(3), &
                   arm(1)*normal(2) - arm(2)*normal(1)]
   end function direction

end module razy_rotor_gear_mesh
