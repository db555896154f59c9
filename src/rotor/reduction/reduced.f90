!! A rotor model in few coordinates, q = T y: dense matrices, projected by T.
module razy_rotor_reduction_reduced
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer, congruence_of, identity, product_of, symmetric_part
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t
   use razy_linalg_sparse, only: csr_t
   use razy_linalg_speed_table, only: table_change, tabled_t
   use razy_rotor_model, only: rotor_model_t
   implicit none(type, external)
   private

   public :: append, new_reduced, reduced_t, transformed

   !> The model with p coordinates,
   !>
   !>     M y'' + (B + Bx + Omega G) y' + (K + Kx + Omega C) y = f - sum_j w_j F_j(d_j, d_j'),   d_j = w_jᵀ y + Delta_j(t).
   type :: reduced_t
      !> T (n, p): displacements of the unreduced model are T y.
      real(wp), allocatable :: basis(:, :)
      !> Which coordinates of the model its own are (p); not there where it has others.
      integer, allocatable :: own(:)
      !> M, B, G, K, C (p, p), without meshes.
      real(wp), allocatable :: mass(:, :), damping(:, :), gyroscopic(:, :), stiffness(:, :), circulatory(:, :)
      !> Kx, Bx (p, p): skew parts of the matrices of bearings.
      real(wp), allocatable :: cross_stiffness(:, :), cross_damping(:, :)
      !> w (p, meshes) and the meshes' linear stiffness and damping (meshes).
      real(wp), allocatable :: mesh_direction(:, :), mesh_stiffness(:), mesh_damping(:)
      !> f (p); U (p, shafts), see `model`.
      real(wp), allocatable :: load(:)
      complex(wp), allocatable :: unbalance(:, :)
      !> Bearings whose matrices depend on the speed: B, Bx, K and Kx have those of their first speeds.
      type(tabled_t), allocatable :: tabled(:)
      !> What has to be known of the choice of modes.
      character(:), allocatable :: caution
   contains
      procedure :: closed_stiffness
      procedure :: closed_damping
      procedure :: modes
      procedure :: bearing_change
   end type reduced_t

contains

   !> The model in the span of `basis` (n, p), whose columns are independent; in its own coordinates without one.
   function new_reduced(model, basis) result(reduced)
      type(rotor_model_t), intent(in) :: model
      real(wp), contiguous, intent(in), optional :: basis(:, :)
      type(reduced_t) :: reduced

      integer :: i

      if (present(basis)) then
         reduced%basis = basis
      else
         reduced%own = [(i, i=1, model%numbering%n)]
         reduced%basis = identity(model%numbering%n)
      end if
      reduced%mass = projected(model%mass)
      reduced%damping = projected(model%damping)
      reduced%gyroscopic = projected(model%gyroscopic)
      reduced%stiffness = projected(model%stiffness)
      reduced%circulatory = projected(model%circulatory)
      reduced%cross_stiffness = projected(model%cross_stiffness)
      reduced%cross_damping = projected(model%cross_damping)
      call project_vectors(reduced, reduced%basis, model%mesh_direction, model%load, model%unbalance)
      reduced%mesh_stiffness = model%mesh_stiffness
      reduced%mesh_damping = model%mesh_damping
      call add_tables(reduced, model)

   contains

      function projected(matrix)
         type(csr_t), intent(in) :: matrix
         real(wp), allocatable :: projected(:, :)

         if (present(basis)) projected = matrix%congruence(basis)
         if (.not. present(basis)) projected = matrix%dense()
      end function projected

   end function new_reduced

   subroutine add_tables(reduced, model)
      type(reduced_t), intent(inout) :: reduced
      type(rotor_model_t), intent(in) :: model

      type(tabled_t) :: tabled
      integer :: i, k

      allocate (reduced%tabled(0))
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            if (.not. allocated(bearing%table)) cycle
            tabled%table = bearing%table
            tabled%ratio = model%rotor%shaft(bearing%shaft)%speed_ratio
            tabled%row = spread(spread(0.0_wp, 1, 2), 2, size(reduced%basis, 2))
            associate (at => model%numbering%of(bearing%shaft, bearing%node))
               do k = 1, 2
                  if (at(k + 1) > 0) tabled%row(k, :) = reduced%basis(at(k + 1), :)
               end do
            end associate
            reduced%tabled = [reduced%tabled, tabled]
         end associate
      end do
   end subroutine add_tables

   !> The same in further coordinates, y = `basis` z, `basis` (p, m).
   function transformed(old, basis) result(reduced)
      type(reduced_t), intent(in) :: old
      real(wp), contiguous, intent(in) :: basis(:, :)
      type(reduced_t) :: reduced

      integer :: i

      reduced%basis = product_of(old%basis, basis)
      reduced%mass = congruence_of(old%mass, basis)
      reduced%damping = congruence_of(old%damping, basis)
      reduced%gyroscopic = congruence_of(old%gyroscopic, basis)
      reduced%stiffness = congruence_of(old%stiffness, basis)
      reduced%circulatory = congruence_of(old%circulatory, basis)
      reduced%cross_stiffness = congruence_of(old%cross_stiffness, basis)
      reduced%cross_damping = congruence_of(old%cross_damping, basis)
      call project_vectors(reduced, basis, old%mesh_direction, old%load, old%unbalance)
      reduced%mesh_stiffness = old%mesh_stiffness
      reduced%mesh_damping = old%mesh_damping
      reduced%tabled = old%tabled
      do i = 1, size(old%tabled)
         reduced%tabled(i)%row = matmul(old%tabled(i)%row, basis)
      end do
   end function transformed

   subroutine project_vectors(reduced, basis, direction, load, unbalance)
      type(reduced_t), intent(inout) :: reduced
      real(wp), contiguous, intent(in) :: basis(:, :), direction(:, :), load(:)
      complex(wp), intent(in) :: unbalance(:, :)

      integer :: i, j, p

      p = size(basis, 2)
      allocate (reduced%mesh_direction(p, size(direction, 2)), reduced%unbalance(p, size(unbalance, 2)))
      reduced%load = [(dot_product(basis(:, i), load), i=1, p)]
      do j = 1, size(direction, 2)
         reduced%mesh_direction(:, j) = [(dot_product(basis(:, i), direction(:, j)), i=1, p)]
      end do
      do j = 1, size(unbalance, 2)
         reduced%unbalance(:, j) = [(sum(basis(:, i)*unbalance(:, j)), i=1, p)]
      end do
   end subroutine project_vectors

   !> K with all meshes closed and linear.
   pure function closed_stiffness(self) result(stiffness)
      class(reduced_t), intent(in) :: self
      real(wp), allocatable :: stiffness(:, :)

      integer :: j

      stiffness = self%stiffness
      do j = 1, size(self%mesh_stiffness)
         call add_outer(stiffness, self%mesh_stiffness(j), self%mesh_direction(:, j))
      end do
   end function closed_stiffness

   !> B with all meshes closed and linear.
   pure function closed_damping(self) result(damping)
      class(reduced_t), intent(in) :: self
      real(wp), allocatable :: damping(:, :)

      integer :: j

      damping = self%damping
      do j = 1, size(self%mesh_damping)
         call add_outer(damping, self%mesh_damping(j), self%mesh_direction(:, j))
      end do
   end function closed_damping

   !> What tables of bearings add to K + Kx at the speed Omega of the system, rad/s, with `damping` to B + Bx (p, p); with `rate`
   !> its derivative by Omega. The symmetric part alone where `skew` is not asked for; it is so to the last bit.
   pure function bearing_change(self, speed, damping, rate, skew) result(change)
      class(reduced_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: damping, rate, skew
      real(wp), allocatable :: change(:, :)

      real(wp), allocatable :: turn(:, :)
      real(wp) :: part(4)
      integer :: i

      allocate (change(size(self%load), size(self%load)), source=0.0_wp)
      do i = 1, size(self%tabled)
         part = table_change(self%tabled(i)%table, self%tabled(i)%ratio, speed, damping, merge(1, 0, rate))
         associate (row => self%tabled(i)%row)
            change = change + symmetric_part(matmul(transpose(row), matmul(reshape([part(1), 0.5_wp*(part(2) + part(3)), &
                                                                               0.5_wp*(part(2) + part(3)), part(4)], [2, 2]), row)))
            if (.not. skew) cycle
            turn = spread(row(1, :), 2, size(row, 2))*spread(row(2, :), 1, size(row, 2))
            change = change + 0.5_wp*(part(2) - part(3))*(turn - transpose(turn))
         end associate
      end do
   end function bearing_change

   !> All undamped modes at rest, meshes closed or open.
   function modes(self, meshed) result(pairs)
      class(reduced_t), intent(in) :: self
      logical, intent(in) :: meshed
      type(eigenpairs_t) :: pairs

      if (meshed) then
         pairs = dense_modes(self%closed_stiffness(), self%mass)
      else
         pairs = dense_modes(self%stiffness, self%mass)
      end if
   end function modes

   !> Further columns of a basis: `vectors` (rows, columns) in the rows `own`.
   pure subroutine append(basis, own, vectors)
      real(wp), allocatable, intent(inout) :: basis(:, :)
      integer, intent(in) :: own(:)
      real(wp), intent(in) :: vectors(:, :)

      real(wp), allocatable :: larger(:, :)
      integer :: p

      p = size(basis, 2)
      allocate (larger(size(basis, 1), p + size(vectors, 2)), source=0.0_wp)
      larger(:, :p) = basis
      larger(own, p + 1:) = vectors(:size(own), :)
      call move_alloc(larger, basis)
   end subroutine append

end module razy_rotor_reduction_reduced
