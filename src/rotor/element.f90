!! The finite shaft element: axial motion, torsion, bending in two planes, gyroscopic effect (source thesis, (4.19)-(4.26)).
!!
!! Coordinates of a node (u, v, w, phi, theta, psi): displacements along x (the axis), y and z, rotations about them. With
!! plane normal sections psi = v', theta = -w', so that the plane xz is as the plane xy with -w and theta for v and psi.
!! An element deforms by elongation, twist, and in each plane by b = psi_2 - psi_1, a = psi_1 + psi_2 - 2 (v_2 - v_1)/l and the
!! tilt p = (psi_1 + psi_2)/2. With M = M_0 + M_1 t, t = 2 x/l from the middle, loads at its ends do the work M_0 b + M_1 a, and
!!
!!     b = l/2 ∫ (M_0 + M_1 t)/(E J) dt,   a = l/2 ∫ t (M_0 + M_1 t)/(E J) dt + g M_1,   g = 2/l ∫ dt/(kappa G A)
!!
!! over -1 < t < 1, g with shear only: its inverse is the exact stiffness, of cones too. Displacements are linear in x along and
!! about the axis, with curvatures (b + 3 e t)/l in bending, e = a - g M_1, and constant shear: those of a
!! cylinder loaded at its ends (Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines, 2010, section 5.4). All masses are
!! consistent.
!!
!! Tension N along the axis has the energy 1/2 N ∫ v'² + w'² dx. A torque T turns with the sections: M_z = E J psi' - T theta and
!! M_y = E J theta' + T psi do the work T ∫ theta' dpsi - psi' dtheta dx, which is that of T/2 ∫ theta' psi - psi' theta dx and, as
!! it has no potential, of moments at the ends: T/2 (theta dpsi - psi dtheta) at the second, its negative at the first.
module razy_rotor_element
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: congruence_of, symmetric_part
   use razy_linalg_gauss, only: abscissa, points, weight
   use razy_rotor_section, only: section_t, shear_cowper
   implicit none(type, external)
   private

   public :: deformation_of, element_t, new_element

   !> Coordinates of the two nodes that move along and about the axis, in the plane xy (v, psi) and in the plane xz (w, theta).
   integer, parameter :: axial_coordinates(2) = [1, 7], twist_coordinates(2) = [4, 10]
   integer, parameter :: y_coordinates(4) = [2, 6, 8, 12], z_coordinates(4) = [3, 5, 9, 11]
   !> The signs that turn matrices of the plane xy into those of the plane xz.
   real(wp), parameter :: turned(4) = [-1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp]

   !> Matrices of an element in M q'' + Omega G q' + (K + C) q; Omega is the angular speed about +x, C that of tension and torque
   !> without the moments at the ends (12, 12 each), K + C against deformations (8, 8).
   type :: element_t
      real(wp), dimension(12, 12) :: mass = 0.0_wp, gyroscopic = 0.0_wp, stiffness = 0.0_wp, carried = 0.0_wp
      real(wp) :: against(8, 8) = 0.0_wp
   end type element_t

   !> Bending in (b, a, p, mean v of the ends): stiffness against the first three, inertia of translation and of rotation, ∫ v'² dx
   !> and twist_ij = ∫ psi_i psi_j' dx (4, 4 each).
   type :: bending_t
      real(wp), dimension(4, 4) :: stiffness = 0.0_wp, mass = 0.0_wp, rotary = 0.0_wp, tension = 0.0_wp, twist = 0.0_wp
   end type bending_t

contains

   !> Element number `part` of a section; `shear` is shear_none or shear_cowper; without `rotary_inertia` bending has inertia of
   !> translation only, and gyroscopic moments all the same.
   function new_element(section, part, shear, rotary_inertia) result(element)
      type(section_t), intent(in) :: section
      integer, intent(in) :: part, shear
      logical, intent(in) :: rotary_inertia
      type(element_t) :: element

      type(section_t) :: slice(points)
      type(bending_t) :: bending
      real(wp), dimension(4, 4) :: inertia, plane, rotary, stiffness, tension, twist
      real(wp) :: l

      l = section%length/section%elements
      slice = section%slice((part - 1 + abscissa)/section%elements)
      associate (material => section%material, area => slice%area(), polar => 2*slice%second_moment())
         element%against(1, 1) = material%young/(l*sum(weight/area))
         element%against(2, 2) = material%shear/(l*sum(weight/polar))
         call add_bar(element, axial_coordinates, element%against(1, 1), material%density*l*area)
         call add_bar(element, twist_coordinates, element%against(2, 2), material%density*l*polar)
      end associate
      bending = bending_of(slice, l, shear)
      tension = section%axial_force*bending%tension
      twist = 0.5_wp*section%torque*(bending%twist - transpose(bending%twist))
      element%against(3:5, 3:5) = bending%stiffness(:3, :3) + tension(:3, :3)
      element%against(6:, 6:) = element%against(3:5, 3:5)
      element%against(3:5, 6:) = twist(:3, :3)
      element%against(6:, 3:5) = transpose(twist(:3, :3))
      plane = reshape([0.0_wp, 2/l, 0.0_wp, 0.5_wp, -1.0_wp, 1.0_wp, 0.5_wp, 0.0_wp, &
                       0.0_wp, -2/l, 0.0_wp, 0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.0_wp], [4, 4])
      stiffness = symmetric_part(congruence_of(bending%stiffness, plane))
      rotary = symmetric_part(congruence_of(bending%rotary, plane))
      inertia = symmetric_part(congruence_of(bending%mass, plane))
      if (rotary_inertia) inertia = inertia + rotary
      tension = symmetric_part(congruence_of(tension, plane))
      twist = congruence_of(twist, plane)
      associate (y => y_coordinates, z => z_coordinates, rows => spread(turned, 2, 4))
         element%stiffness(y, y) = stiffness
         element%stiffness(z, z) = rows*transpose(rows)*stiffness
         element%mass(y, y) = inertia
         element%mass(z, z) = rows*transpose(rows)*inertia
         element%carried(y, y) = tension
         element%carried(z, z) = rows*transpose(rows)*tension
         element%carried(z, y) = rows*transpose(twist)
         element%carried(y, z) = transpose(element%carried(z, y))
         ! Angular momentum of the spinning disks: +2 rho J Omega psi' about y, -2 rho J Omega theta' about z.
         element%gyroscopic(z, y) = 2*rows*rotary
         element%gyroscopic(y, z) = -transpose(element%gyroscopic(z, y))
      end associate
   end function new_element

   !> Bending of an element of length `l` that is `slice` at the abscissas.
   pure function bending_of(slice, l, shear) result(bending)
      type(section_t), intent(in) :: slice(points)
      real(wp), intent(in) :: l
      integer, intent(in) :: shear
      type(bending_t) :: bending

      real(wp), parameter :: t(points) = 2*abscissa - 1
      real(wp), dimension(4) :: bent, curvature, psi, slope, v
      real(wp) :: flexibility(points), g
      integer :: i

      associate (material => slice(1)%material, area => slice%area(), second => slice%second_moment())
         flexibility = weight*l/(material%young*second)
         g = 0.0_wp
         if (shear == shear_cowper) g = 4/l*sum(weight/(slice%shear_coefficient()*material%shear*area))
         associate (bb => sum(flexibility), ba => sum(t*flexibility), aa => sum(t**2*flexibility) + g)
            bending%stiffness(:2, :2) = reshape([aa, -ba, -ba, bb], [2, 2])/(bb*aa - ba**2)
         end associate
         bent = [-g*bending%stiffness(1, 2), 1 - g*bending%stiffness(2, 2), 0.0_wp, 0.0_wp]
         do i = 1, points
            psi = [t(i)/2, 0.0_wp, 1.0_wp, 0.0_wp] - 0.75_wp*(1 - t(i)**2)*bent
            slope = psi - 0.5_wp*([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp] - bent)
            v = [l/8*(t(i)**2 - 1), -l/4*t(i), l/2*t(i), 1.0_wp] + l/8*(t(i)**3 - t(i))*bent
            curvature = ([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp] + 3*t(i)*bent)/l
            call add_product(bending%mass, l*weight(i)*material%density*area(i), v, v)
            call add_product(bending%rotary, l*weight(i)*material%density*second(i), psi, psi)
            call add_product(bending%tension, l*weight(i), slope, slope)
            call add_product(bending%twist, l*weight(i), psi, curvature)
         end do
      end associate
   end function bending_of

   !> Add `factor` x yᵀ.
   pure subroutine add_product(matrix, factor, x, y)
      real(wp), intent(inout) :: matrix(4, 4)
      real(wp), intent(in) :: factor, x(4), y(4)

      matrix = matrix + factor*spread(x, 2, 4)*spread(y, 1, 4)
   end subroutine add_product

   !> Linear displacement between two coordinates: `stiffness` and the `mass` (points) of cylinders as at the abscissas, or inertia
   !> about the axis.
   pure subroutine add_bar(element, at, stiffness, mass)
      type(element_t), intent(inout) :: element
      integer, intent(in) :: at(2)
      real(wp), intent(in) :: stiffness, mass(points)

      associate (left => 1 - abscissa, right => abscissa, part => weight*mass)
         element%mass(at, at) = reshape([sum(part*left**2), sum(part*left*right), sum(part*left*right), sum(part*right**2)], [2, 2])
      end associate
      element%stiffness(at, at) = stiffness*reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
   end subroutine add_bar

   !> Deformations of an element of length `l` by displacements of its nodes: elongation, twist, then b, a and p in xy and in xz.
   pure function deformation_of(left, right, l) result(deformation)
      real(wp), intent(in) :: left(6), right(6), l
      real(wp) :: deformation(8)

      associate (y => (right(2) - left(2))/l, z => (left(3) - right(3))/l)
         deformation = [right(1) - left(1), right(4) - left(4), right(6) - left(6), right(6) + left(6) - 2*y, &
                        0.5_wp*(right(6) + left(6)), right(5) - left(5), right(5) + left(5) - 2*z, 0.5_wp*(right(5) + left(5))]
      end associate
   end function deformation_of

end module razy_rotor_element
