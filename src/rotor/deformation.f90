!! Deformations of shaft elements and the forces that restore them, without the cancellation of a product K q.
!!
!! Entries of K grow with the third power of the number of elements, while its lowest eigenvalues stay; K q and qᵀ K q
!! of a smooth q then lose all digits at some 10⁴ elements. Here q goes into eight deformations of each element first, whose
!! energies add up: elongation, twist, bending b in each plane, the antisymmetric a = psi_1 + psi_2 - 2 s, and the slope of the
!! chord s = (v_2 - v_1)/l, which tension N alone feels,
!!
!!     qᵀ K q = sum over elements of  E A u²/l + G Jp phi²/l + (E J/l + N l/12) b²
!!              + (3 E J/(l (1 + Phi)) + N l/(20 (1 + Phi)²)) a² + N l s².
module razy_rotor_deformation
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer, symmetric_part
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_numbering, only: add_at, values_at
   use razy_rotor_section, only: section_t, shear_cowper
   implicit none(type, external)
   private

   public :: find_deformations, projected_stiffness, restoring_force

   !> A shaft element: coordinates of its nodes (0: held), length, m, stiffness against each deformation.
   type :: segment_t
      integer :: left(6) = 0, right(6) = 0
      real(wp) :: length = 0.0_wp, stiffness(8) = 0.0_wp
   end type segment_t

contains

   !> All elements of all shafts.
   function segments_of(model) result(list)
      type(rotor_model_t), intent(in) :: model
      type(segment_t), allocatable :: list(:)

      integer, allocatable :: first(:)
      integer :: e, i, k, node, s

      allocate (list(sum([(sum(model%rotor%shaft(s)%section%elements), s=1, size(model%rotor%shaft))])))
      k = 0
      do s = 1, size(model%rotor%shaft)
         first = model%rotor%shaft(s)%first_nodes()
         do i = 1, size(first)
            associate (section => model%rotor%shaft(s)%section(i))
               do e = 1, section%elements
                  node = first(i) + e - 1
                  k = k + 1
                  list(k)%left = model%numbering%of(s, node)
                  list(k)%right = model%numbering%of(s, node + 1)
                  list(k)%length = section%length/section%elements
                  list(k)%stiffness = stiffness_of(section, model%rotor%shaft(s)%shear)
               end do
            end associate
         end do
      end do
   end function segments_of

   !> Deformations of a displacement `q` (n), and their stiffness (8, elements each).
   subroutine find_deformations(deformation, stiffness, model, q)
      real(wp), allocatable, intent(out) :: deformation(:, :), stiffness(:, :)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)

      type(segment_t), allocatable :: segment(:)
      integer :: k

      segment = segments_of(model)
      allocate (deformation(8, size(segment)), stiffness(8, size(segment)))
      do k = 1, size(segment)
         deformation(:, k) = deformation_of(segment(k), q)
         stiffness(:, k) = segment(k)%stiffness
      end do
   end subroutine find_deformations

   !> K q (n) by way of the deformations; with `meshed` all meshes are closed and linear.
   function restoring_force(model, q, meshed) result(force)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      logical, intent(in) :: meshed
      real(wp), allocatable :: force(:)

      type(segment_t), allocatable :: segment(:)
      real(wp) :: stress(8), y, z
      integer :: i, j, k

      allocate (force(size(q)), source=0.0_wp)
      segment = segments_of(model)
      do k = 1, size(segment)
         stress = segment(k)%stiffness*deformation_of(segment(k), q)
         y = (2*stress(5) - stress(7))/segment(k)%length
         z = (2*stress(6) + stress(8))/segment(k)%length
         call add_at(force, segment(k)%left, [-stress(1), y, -z, -stress(2), stress(6) - stress(4), stress(5) - stress(3)])
         call add_at(force, segment(k)%right, [stress(1), -y, z, stress(2), stress(6) + stress(4), stress(5) + stress(3)])
      end do
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            associate (at => model%numbering%ends(bearing), push => matmul(bearing%stiffness, model%numbering%stretch(bearing, q)))
               call add_at(force, at(:6), push)
               call add_at(force, at(7:), -push)
            end associate
         end associate
      end do
      if (.not. meshed) return
      do j = 1, size(model%mesh_stiffness)
         associate (w => model%mesh_direction(:, j))
            force = force + model%mesh_stiffness(j)*dot_product(w, q)*w
         end associate
      end do
   end function restoring_force

   !> Xᵀ K X (m, m) of displacements `basis` X (n, m), which need not be exact where it is small.
   function projected_stiffness(model, basis, meshed) result(projected)
      type(rotor_model_t), intent(in) :: model
      real(wp), contiguous, intent(in) :: basis(:, :)
      logical, intent(in) :: meshed
      real(wp), allocatable :: projected(:, :)

      real(wp), allocatable :: deformation(:, :, :), ends(:, :), own(:, :), stiffness(:, :)
      integer :: i, j, k, m

      m = size(basis, 2)
      allocate (projected(m, m), ends(6, m))
      do j = 1, m
         call find_deformations(own, stiffness, model, basis(:, j))
         if (j == 1) allocate (deformation(8, size(own, 2), m))
         deformation(:, :, j) = own
      end do
      do j = 1, m
         do i = 1, j
            projected(i, j) = 0.0_wp
            do k = 1, size(deformation, 2)
               projected(i, j) = projected(i, j) + dot_product(deformation(:, k, i), stiffness(:, k)*deformation(:, k, j))
            end do
            projected(j, i) = projected(i, j)
         end do
      end do
      do k = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(k))
            do j = 1, m
               ends(:, j) = model%numbering%stretch(bearing, basis(:, j))
            end do
            projected = projected + symmetric_part(matmul(transpose(ends), matmul(bearing%stiffness, ends)))
         end associate
      end do
      if (.not. meshed) return
      do k = 1, size(model%mesh_stiffness)
         call add_outer(projected, model%mesh_stiffness(k), matmul(model%mesh_direction(:, k), basis))
      end do
   end function projected_stiffness

   !> Elongation, twist, then in xy and xz each bending, antisymmetric bending and slope of the chord of an element.
   pure function deformation_of(segment, q) result(deformation)
      type(segment_t), intent(in) :: segment
      real(wp), intent(in) :: q(:)
      real(wp) :: deformation(8)

      real(wp) :: left(6), right(6)

      left = values_at(q, segment%left)
      right = values_at(q, segment%right)
      associate (l => segment%length)
         deformation = [right(1) - left(1), right(4) - left(4), right(6) - left(6), right(5) - left(5), &
                        right(6) + left(6) - 2*(right(2) - left(2))/l, right(5) + left(5) + 2*(right(3) - left(3))/l, &
                        (right(2) - left(2))/l, (right(3) - left(3))/l]
      end associate
   end function deformation_of

   !> Stiffness (8) against each deformation.
   pure function stiffness_of(section, shear) result(stiffness)
      type(section_t), intent(in) :: section
      integer, intent(in) :: shear
      real(wp) :: stiffness(8)

      real(wp) :: l, ratio

      l = section%length/section%elements
      associate (area => section%area(), second => section%second_moment(), young => section%material%young, &
                 tension => section%axial_force, modulus => section%material%shear)
         ratio = 0.0_wp
         if (shear == shear_cowper) ratio = 12*young*second/(section%shear_coefficient()*modulus*area*l**2)
         stiffness(1) = young*area/l
         stiffness(2) = 2*modulus*second/l
         stiffness(3:4) = young*second/l + tension*l/12
         stiffness(5:6) = 3*young*second/(l*(1 + ratio)) + tension*l/(20*(1 + ratio)**2)
         stiffness(7:8) = tension*l
      end associate
   end function stiffness_of

end module razy_rotor_deformation
