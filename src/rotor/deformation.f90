!! Deformations of shaft elements and the forces that restore them, without the cancellation of a product K q.
!!
!! Entries of K grow with the third power of the number of elements, while its lowest eigenvalues stay; K q and qᵀ K q
!! of a smooth q then lose all digits at some 10⁴ elements. Here q goes into six deformations of each element first, scaled so
!! that the energy is half the sum of their squares: elongation, twist, bending b in each plane, and the antisymmetric
!! a = psi_1 + psi_2 - 2 (v_2 - v_1)/l,
!!
!!     qᵀ K q = sum over elements of  E A u²/l + G Jp phi²/l + E J b²/l + 3 E J a²/(l (1 + Phi)).
module razy_rotor_deformation
   use razy_core_kinds, only: wp
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_section, only: section_t, shear_cowper
   implicit none(type, external)
   private

   public :: deformations, projected_stiffness, restoring_force

contains

   !> Scaled deformations (6, elements) of a displacement `q` (n): half the sum of their squares is the energy of the shafts, J.
   function deformations(model, q) result(deformation)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      real(wp), allocatable :: deformation(:, :)

      real(wp) :: left(6), right(6), root(6)
      integer :: e, element, i, node, s

      allocate (deformation(6, count_elements(model)))
      element = 0
      do s = 1, size(model%rotor%shaft)
         node = 1
         left = at_node(model, q, s, node)
         do i = 1, size(model%rotor%shaft(s)%section)
            associate (section => model%rotor%shaft(s)%section(i))
               root = sqrt(stiffness_of(section, model%rotor%shaft(s)%shear))
               do e = 1, section%elements
                  node = node + 1
                  element = element + 1
                  right = at_node(model, q, s, node)
                  deformation(:, element) = root*deformation_of(left, right, section%length/section%elements)
                  left = right
               end do
            end associate
         end do
      end do
   end function deformations

   !> K q (n) by way of the deformations; with `meshed` all meshes are closed and linear.
   function restoring_force(model, q, meshed) result(force)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      logical, intent(in) :: meshed
      real(wp), allocatable :: force(:)

      real(wp) :: factor(6), left(6), right(6)
      integer :: e, i, j, node, s

      allocate (force(size(q)), source=0.0_wp)
      do s = 1, size(model%rotor%shaft)
         node = 1
         left = at_node(model, q, s, node)
         do i = 1, size(model%rotor%shaft(s)%section)
            associate (section => model%rotor%shaft(s)%section(i))
               factor = stiffness_of(section, model%rotor%shaft(s)%shear)
               do e = 1, section%elements
                  node = node + 1
                  right = at_node(model, q, s, node)
                  call add_force(force, model, s, node, &
                                 factor*deformation_of(left, right, section%length/section%elements), section)
                  left = right
               end do
            end associate
         end do
      end do
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            left = matmul(bearing%stiffness, at_node(model, q, bearing%shaft, bearing%node))
            call add_at(force, model%numbering%of(bearing%shaft, bearing%node), left)
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

      real(wp), allocatable :: deformation(:, :, :), ends(:, :)
      integer :: i, j, k, m

      m = size(basis, 2)
      allocate (deformation(6, count_elements(model), m), projected(m, m), ends(6, m))
      do j = 1, m
         deformation(:, :, j) = deformations(model, basis(:, j))
      end do
      do j = 1, m
         do i = 1, j
            projected(i, j) = 0.0_wp
            do k = 1, size(deformation, 2)
               projected(i, j) = projected(i, j) + dot_product(deformation(:, k, i), deformation(:, k, j))
            end do
         end do
      end do
      do k = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(k))
            do j = 1, m
               ends(:, j) = at_node(model, basis(:, j), bearing%shaft, bearing%node)
            end do
            projected = projected + matmul(transpose(ends), matmul(bearing%stiffness, ends))
         end associate
      end do
      if (meshed) then
         do k = 1, size(model%mesh_stiffness)
            do j = 1, m
               ends(1, j) = dot_product(model%mesh_direction(:, k), basis(:, j))
            end do
            do j = 1, m
               projected(:, j) = projected(:, j) + model%mesh_stiffness(k)*ends(1, :)*ends(1, j)
            end do
         end do
      end if
      do j = 1, m
         projected(j, :j - 1) = projected(:j - 1, j)
      end do
   end function projected_stiffness

   pure integer function count_elements(model)
      type(rotor_model_t), intent(in) :: model

      integer :: s

      count_elements = 0
      do s = 1, size(model%rotor%shaft)
         count_elements = count_elements + model%rotor%shaft(s)%nodes() - 1
      end do
   end function count_elements

   !> Displacements (6) of a node; those that are held are zero.
   pure function at_node(model, q, shaft, node) result(displacement)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      integer, intent(in) :: shaft, node
      real(wp) :: displacement(6)

      integer :: at(6), k

      at = model%numbering%of(shaft, node)
      displacement = 0.0_wp
      do k = 1, 6
         if (at(k) > 0) displacement(k) = q(at(k))
      end do
   end function at_node

   !> Elongation, twist, bending in xy and xz, antisymmetric bending in xy and xz of an element of length l.
   pure function deformation_of(left, right, l) result(deformation)
      real(wp), intent(in) :: left(6), right(6), l
      real(wp) :: deformation(6)

      deformation = [right(1) - left(1), right(4) - left(4), right(6) - left(6), right(5) - left(5), &
                     right(6) + left(6) - 2*(right(2) - left(2))/l, right(5) + left(5) + 2*(right(3) - left(3))/l]
   end function deformation_of

   !> Stiffness (6) against each deformation.
   pure function stiffness_of(section, shear) result(stiffness)
      type(section_t), intent(in) :: section
      integer, intent(in) :: shear
      real(wp) :: stiffness(6)

      real(wp) :: l, ratio

      l = section%length/section%elements
      associate (area => section%area(), second => section%second_moment(), young => section%material%young, &
                 modulus => section%material%shear)
         ratio = 0.0_wp
         if (shear == shear_cowper) ratio = 12*young*second/(section%shear_coefficient()*modulus*area*l**2)
         stiffness(1) = young*area/l
         stiffness(2) = 2*modulus*second/l
         stiffness(3:4) = young*second/l
         stiffness(5:6) = 3*young*second/(l*(1 + ratio))
      end associate
   end function stiffness_of

   !> Add what the deformations' forces (6) do on both nodes of the element that ends at `node`.
   subroutine add_force(force, model, shaft, node, stress, section)
      real(wp), intent(inout) :: force(:)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: shaft, node
      real(wp), intent(in) :: stress(6)
      type(section_t), intent(in) :: section

      real(wp) :: y, z

      y = 2*stress(5)*section%elements/section%length
      z = 2*stress(6)*section%elements/section%length
      call add_at(force, model%numbering%of(shaft, node - 1), [-stress(1), y, -z, -stress(2), stress(6) - stress(4), &
                                                               stress(5) - stress(3)])
      call add_at(force, model%numbering%of(shaft, node), [stress(1), -y, z, stress(2), stress(6) + stress(4), &
                                                           stress(5) + stress(3)])
   end subroutine add_force

   pure subroutine add_at(force, at, part)
      real(wp), intent(inout) :: force(:)
      integer, intent(in) :: at(6)
      real(wp), intent(in) :: part(6)

      integer :: k

      do k = 1, 6
         if (at(k) > 0) force(at(k)) = force(at(k)) + part(k)
      end do
   end subroutine add_at

end module razy_rotor_deformation
