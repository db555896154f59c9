!! The finite shaft element: axial motion, torsion, bending in two planes, gyroscopic effect (source thesis, (4.19)-(4.26)).
!!
!! Coordinates of a node (u, v, w, phi, theta, psi): displacements along x (the axis), y and z, rotations about them. With
!! plane normal sections psi = v', theta = -w'. Axial and torsional displacements are linear in x, bending ones cubic; with
!! shear (Phi = 12 E J/(kappa G A l²) > 0) the cubic is that of the beam loaded at its ends, so that the stiffness stays exact
!! (Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines, 2010, section 5.4). All masses are consistent.
!!
!! Tension N along the axis has the energy 1/2 N ∫ v'² dx. With the slope of the chord s = (v_2 - v_1)/l, b = psi_2 - psi_1 and
!! a = psi_1 + psi_2 - 2 s, v' of these shapes is s + b x/l + 3 a/(1 + Phi) (x²/l² - 1/12) about the middle, and the integral of
!! its square l (s² + b²/12 + a²/(20 (1 + Phi)²)).
module razy_rotor_element
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer
   use razy_rotor_section, only: section_t, shear_cowper
   implicit none(type, external)
   private

   public :: element_t, new_element

   !> Coordinates of the two nodes that move along and about the axis, in the plane xy (v, psi) and in the plane xz (w, theta).
   integer, parameter :: axial_coordinates(2) = [1, 7], twist_coordinates(2) = [4, 10]
   integer, parameter :: y_coordinates(4) = [2, 6, 8, 12], z_coordinates(4) = [3, 5, 9, 11]
   !> theta = -w': the signs that turn matrices of the plane xy into those of the plane xz.
   real(wp), parameter :: turned(4) = [1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp]

   !> Matrices (12, 12) of an element in M q'' + Omega G q' + (K + T) q; Omega is the angular speed about +x, T that of tension.
   type :: element_t
      real(wp) :: mass(12, 12) = 0.0_wp, gyroscopic(12, 12) = 0.0_wp, stiffness(12, 12) = 0.0_wp, tension(12, 12) = 0.0_wp
   end type element_t

contains

   !> The element of length `length`, m, of a section; `shear` is shear_none or shear_cowper; without `rotary_inertia` bending has
   !> inertia of translation only, and gyroscopic moments all the same.
   pure function new_element(section, length, shear, rotary_inertia) result(element)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: length
      integer, intent(in) :: shear
      logical, intent(in) :: rotary_inertia
      type(element_t) :: element

      real(wp) :: bending(4, 4), inertia(4, 4), rotary(4, 4), shear_ratio, tension(4, 4)
      integer :: i, j

      associate (a => section%area(), second => section%second_moment(), density => section%material%density, &
                 young => section%material%young, modulus => section%material%shear)
         shear_ratio = 0.0_wp
         if (shear == shear_cowper) shear_ratio = 12*young*second/(section%shear_coefficient()*modulus*a*length**2)
         call add_bar(element, axial_coordinates, density*a*length, young*a/length)
         call add_bar(element, twist_coordinates, 2*density*second*length, 2*modulus*second/length)
         bending = young*second/length**3*bending_stiffness(length, shear_ratio)
         rotary = density*second/length*inertia_of_rotation(length, shear_ratio)
         inertia = density*a*length*translatory_inertia(length, shear_ratio)
         if (rotary_inertia) inertia = inertia + rotary
         tension = section%axial_force*tension_stiffness(length, shear_ratio)
      end associate
      do j = 1, 4
         do i = 1, 4
            associate (sign => turned(i)*turned(j))
               element%stiffness(y_coordinates(i), y_coordinates(j)) = bending(i, j)
               element%stiffness(z_coordinates(i), z_coordinates(j)) = sign*bending(i, j)
               element%tension(y_coordinates(i), y_coordinates(j)) = tension(i, j)
               element%tension(z_coordinates(i), z_coordinates(j)) = sign*tension(i, j)
               element%mass(y_coordinates(i), y_coordinates(j)) = inertia(i, j)
               element%mass(z_coordinates(i), z_coordinates(j)) = sign*inertia(i, j)
            end associate
            ! Angular momentum of the spinning disks: +2 rho J Omega psi' about y, -2 rho J Omega theta' about z.
            element%gyroscopic(z_coordinates(i), y_coordinates(j)) = -2*turned(i)*rotary(i, j)
            element%gyroscopic(y_coordinates(j), z_coordinates(i)) = 2*turned(i)*rotary(i, j)
         end do
      end do
   end function new_element

   !> Linear displacement between two coordinates: total `mass` and `stiffness` (axial), or inertia and torsional stiffness.
   pure subroutine add_bar(element, at, mass, stiffness)
      type(element_t), intent(inout) :: element
      integer, intent(in) :: at(2)
      real(wp), intent(in) :: mass, stiffness

      element%mass(at, at) = mass/6*reshape([2.0_wp, 1.0_wp, 1.0_wp, 2.0_wp], [2, 2])
      element%stiffness(at, at) = stiffness*reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
   end subroutine add_bar

   !> Bending stiffness over E J/l³ in (v1, psi1, v2, psi2).
   pure function bending_stiffness(l, phi) result(k)
      real(wp), intent(in) :: l, phi
      real(wp) :: k(4, 4)

      k = symmetric([12.0_wp, 6*l, -12.0_wp, 6*l, (4 + phi)*l**2, -6*l, (2 - phi)*l**2, 12.0_wp, -6*l, &
                     (4 + phi)*l**2])/(1 + phi)
   end function bending_stiffness

   !> Stiffness by tension over N.
   pure function tension_stiffness(l, phi) result(k)
      real(wp), intent(in) :: l, phi
      real(wp) :: k(4, 4)

      k = 0.0_wp
      call add_outer(k, l, [-1/l, 0.0_wp, 1/l, 0.0_wp])
      call add_outer(k, l/12, [0.0_wp, -1.0_wp, 0.0_wp, 1.0_wp])
      call add_outer(k, l/(20*(1 + phi)**2), [2/l, 1.0_wp, -2/l, 1.0_wp])
   end function tension_stiffness

   !> Inertia of translation over rho A l.
   pure function translatory_inertia(l, phi) result(m)
      real(wp), intent(in) :: l, phi
      real(wp) :: m(4, 4)

      real(wp) :: m1, m2, m3, m4, m5, m6

      m1 = 312 + 588*phi + 280*phi**2
      m2 = (44 + 77*phi + 35*phi**2)*l
      m3 = 108 + 252*phi + 140*phi**2
      m4 = -(26 + 63*phi + 35*phi**2)*l
      m5 = (8 + 14*phi + 7*phi**2)*l**2
      m6 = -(6 + 14*phi + 7*phi**2)*l**2
      m = symmetric([m1, m2, m3, m4, m5, -m4, m6, m1, -m2, m5])/(840*(1 + phi)**2)
   end function translatory_inertia

   !> Inertia of rotation over rho J/l.
   pure function inertia_of_rotation(l, phi) result(m)
      real(wp), intent(in) :: l, phi
      real(wp) :: m(4, 4)

      real(wp) :: m2, m5, m6

      m2 = (3 - 15*phi)*l
      m5 = (4 + 5*phi + 10*phi**2)*l**2
      m6 = (5*phi**2 - 5*phi - 1)*l**2
      m = symmetric([36.0_wp, m2, -36.0_wp, m2, m5, -m2, m6, 36.0_wp, -m2, m5])/(30*(1 + phi)**2)
   end function inertia_of_rotation

   !> The symmetric matrix with these rows of its upper triangle.
   pure function symmetric(upper) result(matrix)
      real(wp), intent(in) :: upper(10)
      real(wp) :: matrix(4, 4)

      integer :: i, j, k

      k = 0
      do i = 1, 4
         do j = i, 4
            k = k + 1
            matrix(i, j) = upper(k)
            matrix(j, i) = upper(k)
         end do
      end do
   end function symmetric

end module razy_rotor_element
