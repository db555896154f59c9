!! Deformations of shaft elements and the forces that restore them, without the cancellation of a product K q.
!!
!! Entries of K grow with the third power of the number of elements, while its lowest eigenvalues stay; K q and qᵀ K q
!! of a smooth q then lose all digits at some 10⁴ elements. Here q goes into eight deformations of each element first
!! (`rotor/element`), whose energies add up.
module razy_rotor_deformation
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer, symmetric_part
   use razy_rotor_element, only: deformation_of
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_numbering, only: add_at, values_at
   implicit none(type, external)
   private

   public :: find_deformations, projected_stiffness, restoring_force

contains

   !> Deformations of a displacement `q` (n), and the forces that they take (8, elements each).
   subroutine find_deformations(deformation, stress, model, q)
      real(wp), allocatable, intent(out) :: deformation(:, :), stress(:, :)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)

      integer :: k

      allocate (deformation(8, size(model%segment)), stress(8, size(model%segment)))
      do k = 1, size(model%segment)
         associate (segment => model%segment(k))
            deformation(:, k) = deformation_of(values_at(q, segment%left), values_at(q, segment%right), segment%length)
            stress(:, k) = matmul(segment%stiffness, deformation(:, k))
         end associate
      end do
   end subroutine find_deformations

   !> K q (n) by way of the deformations; with `meshed` all meshes are closed and linear.
   function restoring_force(model, q, meshed) result(force)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      logical, intent(in) :: meshed
      real(wp), allocatable :: force(:)

      real(wp), allocatable :: deformation(:, :), stress(:, :)
      real(wp) :: y, z
      integer :: i, j, k

      allocate (force(size(q)), source=0.0_wp)
      call find_deformations(deformation, stress, model, q)
      do k = 1, size(model%segment)
         associate (segment => model%segment(k), f => stress(:, k))
            y = 2*f(4)/segment%length
            z = 2*f(7)/segment%length
            call add_at(force, segment%left, [-f(1), y, -z, -f(2), f(7) + f(8)/2 - f(6), f(4) + f(5)/2 - f(3)])
            call add_at(force, segment%right, [f(1), -y, z, f(2), f(7) + f(8)/2 + f(6), f(4) + f(5)/2 + f(3)])
         end associate
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

      real(wp), allocatable :: deformation(:, :, :), ends(:, :), own(:, :), stress(:, :)
      integer :: i, j, k, m

      m = size(basis, 2)
      allocate (projected(m, m), ends(6, m), deformation(8, size(model%segment), m))
      do j = 1, m
         call find_deformations(own, stress, model, basis(:, j))
         deformation(:, :, j) = own
         do i = 1, j
            projected(i, j) = sum(deformation(:, :, i)*stress)
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

end module razy_rotor_deformation
