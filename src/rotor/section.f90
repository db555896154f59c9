!! Materials and sections of shafts: hollow circular cylinders and cones.
module razy_rotor_section
   use razy_core_kinds, only: pi, wp
   implicit none(type, external)
   private

   public :: material_t, section_t, shear_none, shear_cowper

   !> Bending with plane sections normal to the axis (Euler, Bernoulli, Rayleigh), or with shear (Timoshenko) and the shear
   !> coefficient of Cowper, J. Appl. Mech. 33 (1966).
   integer, parameter :: shear_none = 0, shear_cowper = 1

   !> Young's modulus and shear modulus, Pa; density, kg/m³.
   type :: material_t
      real(wp) :: young = 0.0_wp, shear = 0.0_wp, density = 0.0_wp
   end type material_t

   !> A cylinder or cone cut into equal elements: length, outer and inner diameter, m. `first_node` > 0: a layer on what is there
   !> from this node on, such as a sleeve; 0: it follows the section before.
   type :: section_t
      type(material_t) :: material
      real(wp) :: length = 0.0_wp, outer = 0.0_wp, inner = 0.0_wp
      integer :: elements = 1, first_node = 0
      !> Tension that it carries, N; negative: compression.
      real(wp) :: axial_force = 0.0_wp
      !> Torque that it carries, N m: about +x on its face of largest x. `fixed`: where it begins and ceases its axis does not tilt
      !> with the shaft.
      real(wp) :: torque = 0.0_wp
      logical :: fixed = .false.
      !> Diameters at the end of largest x, m; negative: as at the other.
      real(wp) :: outer_end = -1.0_wp, inner_end = -1.0_wp
   contains
      procedure :: carries
      procedure :: slice
      procedure :: area
      procedure :: second_moment
      procedure :: shear_coefficient
   end type section_t

contains

   !> Whether tension or torque is in it.
   elemental logical function carries(self)
      class(section_t), intent(in) :: self

      carries = max(abs(self%axial_force), abs(self%torque)) > 0.0_wp
   end function carries

   !> The cylinder with the diameters that the section has at a part of its length.
   elemental function slice(self, part)
      class(section_t), intent(in) :: self
      real(wp), intent(in) :: part
      type(section_t) :: slice

      slice = section_t(self%material, outer=self%outer, inner=self%inner)
      if (self%outer_end >= 0.0_wp) slice%outer = self%outer + part*(self%outer_end - self%outer)
      if (self%inner_end >= 0.0_wp) slice%inner = self%inner + part*(self%inner_end - self%inner)
   end function slice

   !> A, m².
   elemental function area(self)
      class(section_t), intent(in) :: self
      real(wp) :: area

      area = pi*(self%outer - self%inner)*(self%outer + self%inner)/4
   end function area

   !> J about a diameter, m⁴; the polar moment is twice that.
   elemental function second_moment(self)
      class(section_t), intent(in) :: self
      real(wp) :: second_moment

      second_moment = self%area()*(self%outer**2 + self%inner**2)/16
   end function second_moment

   !> Cowper's coefficient κ of the hollow circle: shear stiffness is κ G A. Poisson's ratio follows from E and G.
   elemental function shear_coefficient(self) result(coefficient)
      class(section_t), intent(in) :: self
      real(wp) :: coefficient

      real(wp) :: poisson, ratio

      poisson = self%material%young/(2*self%material%shear) - 1
      ratio = (self%inner/self%outer)**2
      coefficient = 6*(1 + poisson)*(1 + ratio)**2/((7 + 6*poisson)*(1 + ratio)**2 + (20 + 12*poisson)*ratio)
   end function shear_coefficient

end module razy_rotor_section
