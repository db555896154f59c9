!! What a rotor system consists of: shafts with what sits on them, and meshes between them.
!!
!! Nodes of a shaft are counted from 1 at its end of smallest x. Coordinates of a node are (u, v, w, phi, theta, psi), see
!! `element`. The angular speed of shaft s about +x is speed_ratio(s) Omega, Omega being the speed of the system; a wheel driven
!! by an external gear has a negative ratio.
module razy_rotor_rotor
   use razy_core_kinds, only: wp
   use razy_rotor_bearing, only: bearing_t
   use razy_rotor_disk, only: disk_t
   use razy_rotor_gear_mesh, only: gear_mesh_t
   use razy_rotor_section, only: section_t, shear_none
   implicit none(type, external)
   private

   public :: rotor_t, shaft_t, support_t, unbalance_t
   public :: check_layers, damping_none, damping_nodal, damping_modal, damping_proportional, longest_name

   !> Internal damping of the shafts: none, the thesis's on the nodes (4.32), a ratio in every mode.
   integer, parameter :: damping_none = 0, damping_nodal = 1, damping_modal = 2, damping_proportional = 3
   !> Longer names of shafts are cut.
   integer, parameter :: longest_name = 40

   !> A shaft: sections in order along +x, layers anywhere among them. One without sections is a rigid body of one node.
   type :: shaft_t
      character(longest_name) :: name = ""
      type(section_t), allocatable :: section(:)
      !> shear_none or shear_cowper.
      integer :: shear = shear_none
      !> Its angular speed over that of the system, with sign.
      real(wp) :: speed_ratio = 1.0_wp
      !> Whether anything says what that is, and be it 0.
      logical :: speed_known = .false.
      !> D of the internal damping.
      real(wp) :: damping_ratio = 0.0_wp
      !> B = mass_damping M + stiffness_damping K of its elements, which does not turn with it, 1/s and s.
      real(wp) :: mass_damping = 0.0_wp, stiffness_damping = 0.0_wp
      !> Whether it can turn, as a housing does not; whether sections have inertia of rotation in bending; whether it is a body
      !> without sections.
      logical :: turns = .true., rotary_inertia = .true., rigid = .false.
   contains
      procedure :: nodes
      procedure :: positions
      procedure :: first_nodes
   end type shaft_t

   !> Coordinates of a node that the frame holds.
   type :: support_t
      integer :: shaft = 0, node = 0
      logical :: fixed(6) = .false.
   end type support_t

   !> Mass times eccentricity, kg m, at an angle, deg, from y towards z at time 0.
   type :: unbalance_t
      integer :: shaft = 0, node = 0
      real(wp) :: moment = 0.0_wp, angle = 0.0_wp
   end type unbalance_t

   !> The system. Any list may be of size zero.
   type :: rotor_t
      type(shaft_t), allocatable :: shaft(:)
      type(disk_t), allocatable :: disk(:)
      type(bearing_t), allocatable :: bearing(:)
      type(support_t), allocatable :: support(:)
      type(gear_mesh_t), allocatable :: mesh(:)
      type(unbalance_t), allocatable :: unbalance(:)
      !> Motions that exist; of a motion left out there are no coordinates.
      logical :: axial = .true., bending = .true., torsion = .true.
      integer :: damping = damping_none
      !> Acceleration of free fall along x, y and z, m/s².
      real(wp) :: gravity(3) = 0.0_wp
   end type rotor_t

contains

   !> Number of nodes.
   pure function nodes(self)
      class(shaft_t), intent(in) :: self
      integer :: nodes

      nodes = 1 + sum(self%section%elements, mask=self%section%first_node == 0)
   end function nodes

   !> Positions (nodes) along x from the first node, m.
   pure function positions(self) result(x)
      class(shaft_t), intent(in) :: self
      real(wp), allocatable :: x(:)

      real(wp) :: start
      integer :: e, i, node

      allocate (x(self%nodes()))
      start = 0.0_wp
      node = 1
      x(1) = 0.0_wp
      do i = 1, size(self%section)
         associate (section => self%section(i))
            if (section%first_node > 0) cycle
            do e = 1, section%elements
               node = node + 1
               x(node) = start + e*section%length/section%elements
            end do
            start = start + section%length
         end associate
      end do
   end function positions

   !> The first node of each section (sections).
   pure function first_nodes(self) result(first)
      class(shaft_t), intent(in) :: self
      integer, allocatable :: first(:)

      integer :: i

      first = self%section%first_node
      do i = 1, size(first)
         if (first(i) == 0) first(i) = 1 + sum(self%section(:i - 1)%elements, mask=self%section(:i - 1)%first_node == 0)
      end do
   end function first_nodes

   !> Whether the nodes of all layers are those of the shaft; `culprit` is a section that has others.
   pure subroutine check_layers(shaft, culprit)
      type(shaft_t), intent(in) :: shaft
      integer, intent(out) :: culprit

      !> Nodes that differ by this share of the length of an element are the same.
      real(wp), parameter :: same = 1.0e-6_wp
      real(wp) :: x(shaft%nodes())
      integer :: e

      x = shaft%positions()
      do culprit = 1, size(shaft%section)
         associate (section => shaft%section(culprit))
            if (section%first_node == 0) cycle
            if (section%first_node < 1 .or. section%first_node + section%elements > size(x)) return
            do e = section%first_node, section%first_node + section%elements - 1
               associate (length => section%length/section%elements)
                  if (abs(x(e + 1) - x(e) - length) > same*length) return
               end associate
            end do
         end associate
      end do
      culprit = 0
   end subroutine check_layers

end module razy_rotor_rotor
