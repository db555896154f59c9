!! The rigid disk (source thesis, (4.28)-(4.29)).
module razy_rotor_disk
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: disk_t

   !> A disk on a node: mass, kg; moments of inertia about the axis and about a diameter through the centre of mass, kg m²;
   !> distance of the centre of mass from the node along +x, m.
   type :: disk_t
      integer :: shaft = 0, node = 0
      real(wp) :: mass = 0.0_wp, polar = 0.0_wp, diametral = 0.0_wp, offset = 0.0_wp
   contains
      procedure :: mass_matrix
      procedure :: gyroscopic_matrix
   end type disk_t

contains

   !> Mass matrix (6, 6) in (u, v, w, phi, theta, psi) of the node.
   pure function mass_matrix(self) result(m)
      class(disk_t), intent(in) :: self
      real(wp) :: m(6, 6)

      integer :: i

      m = 0.0_wp
      do i = 1, 3
         m(i, i) = self%mass
      end do
      m(4, 4) = self%polar
      m(5, 5) = self%diametral + self%mass*self%offset**2
      m(6, 6) = m(5, 5)
      m(2, 6) = self%mass*self%offset
      m(6, 2) = m(2, 6)
      m(3, 5) = -m(2, 6)
      m(5, 3) = -m(2, 6)
   end function mass_matrix

   !> Gyroscopic matrix (6, 6), to be multiplied by the angular speed about +x.
   pure function gyroscopic_matrix(self) result(g)
      class(disk_t), intent(in) :: self
      real(wp) :: g(6, 6)

      g = 0.0_wp
      g(5, 6) = self%polar
      g(6, 5) = -self%polar
   end function gyroscopic_matrix

end module razy_rotor_disk
