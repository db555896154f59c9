!! Materials and sections of shafts: hollow circular cylinders.
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

   !> A cylinder cut into equal elements: length, outer and inner diameter, m. `first_node` > 0: a layer on what is there from this
   !> node on, such as a sleeve; 0: it follows the section before.
   type :: section_t
      type(material_t) :: material
      real(wp) :: length = 0.0_wp, outer = 0.0_wp, inner = 0.0_wp
      integer :: elements = 1, first_node = 0
      !> Tension that it carries, N; negative: compression.
      real(wp) :: axial_force = 0.0_wp
   contains
      procedure :: area
      procedure :: second_moment
      procedure :: shear_coefficient
   end type section_t

contains

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
