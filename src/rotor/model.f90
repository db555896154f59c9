!! The assembled rotor system,
!!
!!     M q'' + (B + Bx + Omega G) q' + (K + Kx + Omega C) q = f - sum_j w_j F_j(d_j, d_j'),   d_j = w_jᵀ q + Delta_j(t),
!!
!! with sparse matrices in the coordinates of `numbering`. Kx and Bx are the skew parts of the matrices of bearings, Kx also that
!! of torques in shafts. Meshes are not in B and K: they are directions w_j = (delta_1, -delta_2), to which a linear mesh adds
!! k w wᵀ and b w wᵀ.
module razy_rotor_model
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_linalg_sparse, only: add_matrices, csr_t, entries_t, new_csr
   use razy_rotor_bearing, only: joined
   use razy_rotor_damping, only: circulatory_matrix, internal_damping
   use razy_rotor_element, only: element_t, new_element
   use razy_rotor_numbering, only: add_at, new_numbering, numbering_t
   use razy_rotor_rotor, only: rotor_t
   implicit none(type, external)
   private

   public :: rotor_model_t, new_rotor_model

   !> A shaft element: coordinates of its nodes (0: held), length, m, stiffness against its deformations (`rotor/element`).
   type :: segment_t
      integer :: left(6), right(6)
      real(wp) :: length, stiffness(8, 8)
   end type segment_t

   !> The model with n coordinates. Matrices are (n, n), SI units.
   type :: rotor_model_t
      !> What it was made of.
      type(rotor_t) :: rotor
      type(numbering_t) :: numbering
      !> M; B of shafts and bearings; G; K of shafts, what they carry, and bearings; C. G and C contain the speed ratios of the
      !> shafts, and are multiplied by the speed of the system.
      type(csr_t) :: mass, damping, gyroscopic, stiffness, circulatory
      !> K of the shafts alone; B of the shafts' material alone.
      type(csr_t) :: shaft_stiffness, internal_damping
      !> Kx and Bx, skew; without entries where no bearing and no torque has any.
      type(csr_t) :: cross_stiffness, cross_damping
      type(segment_t), allocatable :: segment(:)
      !> w (n, meshes).
      real(wp), allocatable :: mesh_direction(:, :)
      !> Linear stiffness and damping of the meshes (meshes).
      real(wp), allocatable :: mesh_stiffness(:), mesh_damping(:)
      !> Constant load f (n), N (N m).
      real(wp), allocatable :: load(:)
      !> U (n, shafts), kg m: unbalance of shaft s at the angular speed omega is the force Re(U omega² e^(i omega t)).
      complex(wp), allocatable :: unbalance(:, :)
   contains
      procedure :: closed_stiffness
      procedure :: closed_damping
      procedure :: have_mass
   end type rotor_model_t

contains

   !> Assemble a rotor system. An error names the part that cannot be.
   subroutine new_rotor_model(model, rotor, error)
      type(rotor_model_t), intent(out) :: model
      type(rotor_t), intent(in) :: rotor
      type(error_t), allocatable, intent(out) :: error

      type(entries_t) :: damping, outer_stiffness, cross_damping, cross_stiffness
      integer :: i, n

      model%rotor = rotor
      model%numbering = new_numbering(rotor)
      n = model%numbering%n
      call assemble_shafts(model, damping, outer_stiffness, cross_stiffness)
      do i = 1, size(rotor%bearing)
         associate (at => model%numbering%ends(rotor%bearing(i)))
            call outer_stiffness%add_block(at, joined(rotor%bearing(i)%stiffness))
            call damping%add_block(at, joined(rotor%bearing(i)%damping))
            call cross_stiffness%add_block(at, joined(rotor%bearing(i)%cross_stiffness))
            call cross_damping%add_block(at, joined(rotor%bearing(i)%cross_damping))
         end associate
      end do
      model%cross_stiffness = new_csr(cross_stiffness, n, n)
      model%cross_damping = new_csr(cross_damping, n, n)
      model%stiffness = add_matrices(1.0_wp, model%shaft_stiffness, 1.0_wp, new_csr(outer_stiffness, n, n))
      call internal_damping(model%internal_damping, rotor, model%numbering, model%mass, model%shaft_stiffness, model%stiffness, &
                            error)
      if (allocated(error)) return
      model%damping = add_matrices(1.0_wp, model%internal_damping, 1.0_wp, new_csr(damping, n, n))
      model%circulatory = circulatory_matrix(rotor, model%numbering, model%internal_damping)
      call assemble_meshes(model)
      call assemble_unbalance(model)
   end subroutine new_rotor_model

   !> M, G and K of elements and disks, their weight, what damping they have that does not turn, and stiffness by tension and
   !> torque.
   subroutine assemble_shafts(model, damping, outer_stiffness, cross_stiffness)
      type(rotor_model_t), intent(inout) :: model
      type(entries_t), intent(inout) :: damping, outer_stiffness, cross_stiffness

      type(entries_t) :: gyroscopic, mass, stiffness
      type(element_t) :: element
      integer, allocatable :: first(:)
      real(wp) :: weight(12)
      !> Moments about y and z at both ends by their tilts, over a torque that turns with them; of a fixed axis the negative.
      real(wp), parameter :: turning(4, 4) = 0.5_wp*reshape([real(wp) :: 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0], [4, 4])
      integer :: at(12), e, i, k, n, node, s

      allocate (model%load(model%numbering%n), source=0.0_wp)
      allocate (model%segment(sum([(sum(model%rotor%shaft(s)%section%elements), s=1, size(model%rotor%shaft))])))
      k = 0
      associate (rotor => model%rotor, numbering => model%numbering)
         do s = 1, size(rotor%shaft)
            first = rotor%shaft(s)%first_nodes()
            do i = 1, size(first)
               associate (section => rotor%shaft(s)%section(i))
                  do e = 1, section%elements
                     element = new_element(section, e, rotor%shaft(s)%shear, rotor%shaft(s)%rotary_inertia)
                     weight = matmul(element%mass(:, [1, 2, 3, 7, 8, 9]), [rotor%gravity, rotor%gravity])
                     node = first(i) + e - 1
                     at(:6) = numbering%of(s, node)
                     at(7:) = numbering%of(s, node + 1)
                     k = k + 1
                     model%segment(k) = segment_t(at(:6), at(7:), section%length/section%elements, element%against)
                     call mass%add_block(at, element%mass)
                     call gyroscopic%add_block(at, rotor%shaft(s)%speed_ratio*element%gyroscopic)
                     call stiffness%add_block(at, element%stiffness)
                     if (section%carries()) call outer_stiffness%add_block(at, element%carried)
                     if (abs(section%torque) > 0.0_wp) then
                        call cross_stiffness%add_block(at([5, 6, 11, 12]), merge(-1, 1, section%fixed)*section%torque*turning)
                     end if
                     call damping%add_block(at, rotor%shaft(s)%mass_damping*element%mass &
                                            + rotor%shaft(s)%stiffness_damping*element%stiffness)
                     call add_at(model%load, at(:6), weight(:6))
                     call add_at(model%load, at(7:), weight(7:))
                  end do
               end associate
            end do
         end do
         do i = 1, size(rotor%disk)
            associate (disk => rotor%disk(i))
               at(:6) = numbering%of(disk%shaft, disk%node)
               call mass%add_block(at(:6), disk%mass_matrix())
               associate (own => disk%mass_matrix())
                  call add_at(model%load, at(:6), matmul(own(:, :3), rotor%gravity))
               end associate
               call gyroscopic%add_block(at(:6), rotor%shaft(disk%shaft)%speed_ratio*disk%gyroscopic_matrix())
            end associate
         end do
         n = numbering%n
      end associate
      model%mass = new_csr(mass, n, n)
      model%gyroscopic = new_csr(gyroscopic, n, n)
      model%shaft_stiffness = new_csr(stiffness, n, n)
   end subroutine assemble_shafts

   subroutine assemble_meshes(model)
      type(rotor_model_t), intent(inout) :: model

      integer :: gear, j

      allocate (model%mesh_direction(model%numbering%n, size(model%rotor%mesh)), source=0.0_wp)
      do j = 1, size(model%rotor%mesh)
         associate (mesh => model%rotor%mesh(j))
            do gear = 1, 2
               call add_at(model%mesh_direction(:, j), model%numbering%of(mesh%shaft(gear), mesh%node(gear)), &
                           merge(1.0_wp, -1.0_wp, gear == 1)*mesh%direction(gear))
            end do
         end associate
      end do
      model%mesh_stiffness = model%rotor%mesh%stiffness
      model%mesh_damping = model%rotor%mesh%damping
   end subroutine assemble_meshes

   subroutine assemble_unbalance(model)
      type(rotor_model_t), intent(inout) :: model

      complex(wp) :: phase
      integer :: at(6), i

      allocate (model%unbalance(model%numbering%n, size(model%rotor%shaft)), source=(0.0_wp, 0.0_wp))
      do i = 1, size(model%rotor%unbalance)
         associate (unbalance => model%rotor%unbalance(i))
            at = model%numbering%of(unbalance%shaft, unbalance%node)
            phase = unbalance%moment*turn(unbalance%angle)
            associate (u => model%unbalance(:, unbalance%shaft))
               if (at(2) > 0) u(at(2)) = u(at(2)) + phase
               ! sin(omega t) along z, turning from y to z for omega > 0
               if (at(3) > 0) u(at(3)) = u(at(3)) - (0.0_wp, 1.0_wp)*phase
            end associate
         end associate
      end do
   end subroutine assemble_unbalance

   !> K with all meshes closed and linear, K + sum k w wᵀ.
   function closed_stiffness(self) result(stiffness)
      class(rotor_model_t), intent(in) :: self
      type(csr_t) :: stiffness

      stiffness = plus_meshes(self%stiffness, self%mesh_direction, self%mesh_stiffness)
   end function closed_stiffness

   !> B with all meshes closed and linear, B + sum b w wᵀ.
   function closed_damping(self) result(damping)
      class(rotor_model_t), intent(in) :: self
      type(csr_t) :: damping

      damping = plus_meshes(self%damping, self%mesh_direction, self%mesh_damping)
   end function closed_damping

   !> Whether all coordinates with these numbers have mass or inertia; 0 is one that is held.
   pure logical function have_mass(self, at)
      class(rotor_model_t), intent(in) :: self
      integer, intent(in) :: at(:)

      real(wp) :: mass(self%numbering%n)

      mass = self%mass%diagonal()
      have_mass = all(mass(pack(at, at > 0)) > 0.0_wp)
   end function have_mass

   function plus_meshes(matrix, direction, factor) result(total)
      type(csr_t), intent(in) :: matrix
      real(wp), intent(in) :: direction(:, :), factor(:)
      type(csr_t) :: total

      type(entries_t) :: entries
      integer, allocatable :: at(:)
      integer :: i, j

      do j = 1, size(factor)
         at = pack([(i, i=1, size(direction, 1))], abs(direction(:, j)) > 0.0_wp)
         associate (w => direction(at, j))
            call entries%add_block(at, factor(j)*spread(w, 2, size(w))*spread(w, 1, size(w)))
         end associate
      end do
      total = add_matrices(1.0_wp, matrix, 1.0_wp, new_csr(entries, matrix%rows, matrix%columns))
   end function plus_meshes

end module razy_rotor_model
