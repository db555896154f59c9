!! Whirl: eigenvalues lambda and shapes of M y'' + (B + Bx + Omega G) y' + (K + Kx + Omega C) y = 0 at a speed Omega.
!!
!! The undamped modes at rest, y = Phi z with frequencies omega_i, make the first-order matrix nearly skew-symmetric in the
!! state (S z, z'), S = diag(max(omega_i, floor)):
!!
!!     A = ( 0, S; -(omega² + Phiᵀ (Kx + Omega C) Phi) S⁻¹, -Phiᵀ (B + Bx + Omega G) Phi ).
!!
!! Errors of its eigenvalues are roundings of the largest omega, not of its square.
module razy_rotor_whirl_whirl
   use razy_core_kinds, only: wp
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, modes_found
   use razy_linalg_right_eigen, only: right_eigen, right_eigenvalues
   use razy_rotor_reduction_reduced, only: reduced_t, transformed
   use razy_rotor_model, only: rotor_model_t
   implicit none(type, external)
   private

   public :: new_whirl, orbit_direction, whirl_direction, whirl_problem_t, whirl_t
   public :: whirl_found, whirl_failed

   integer, parameter :: whirl_found = 0, whirl_failed = 1
   !> Smallest frequency of the scaling as a share of the largest, for rigid-body modes.
   real(wp), parameter :: floor_share = 1.0e-6_wp
   !> Lateral motion below this share of a shape is rounding.
   real(wp), parameter :: still = 1.0e-6_wp

   !> What does not depend on the speed.
   type :: whirl_problem_t
      integer :: status = whirl_found
      !> The model in its modes, M = 1 and K = diag(omega²), meshes in it if they are closed.
      type(reduced_t) :: modal
      !> omega², (rad/s)², and S, rad/s (p each).
      real(wp), allocatable :: squared(:), scaling(:)
      !> B + Bx with the meshes, if they are closed, and Kx (p, p).
      real(wp), allocatable :: damping(:, :), cross_stiffness(:, :)
   contains
      procedure :: solve
      procedure :: growth
      procedure :: shape_of
   end type whirl_problem_t

   !> Eigenvalues with imaginary part >= 0 at one speed, 1/s and rad/s, in the order of their imaginary parts.
   type :: whirl_t
      integer :: status = whirl_found
      complex(wp), allocatable :: value(:)
      !> Shapes (n, values) in the coordinates of the unreduced model, if asked for.
      complex(wp), allocatable :: shape(:, :)
      !> Shapes (p, values) in modes at rest times their frequencies, of unit length: for comparing shapes.
      complex(wp), allocatable :: modal(:, :)
   end type whirl_t

contains

   !> The problem of a reduced model, or of `full_basis`; with `meshed` all meshes are closed and linear.
   function new_whirl(reduced, meshed) result(problem)
      type(reduced_t), intent(in) :: reduced
      logical, intent(in) :: meshed
      type(whirl_problem_t) :: problem

      type(eigenpairs_t) :: pairs

      if (meshed) then
         pairs = dense_modes(reduced%closed_stiffness(), reduced%mass)
      else
         pairs = dense_modes(reduced%stiffness, reduced%mass)
      end if
      if (pairs%status /= modes_found) problem%status = whirl_failed
      problem%squared = pairs%value
      problem%modal = transformed(reduced, pairs%vector)
      problem%damping = problem%modal%damping
      if (meshed) problem%damping = problem%modal%closed_damping()
      problem%damping = problem%damping + problem%modal%cross_damping
      problem%cross_stiffness = problem%modal%cross_stiffness
      allocate (problem%scaling(size(pairs%value)))
      if (size(pairs%value) == 0) return
      problem%scaling = sqrt(max(pairs%value, floor_share**2*maxval(pairs%value)))
   end function new_whirl

   !> Eigenvalues and shapes at the angular speed `speed` of the system, rad/s, with or without the circulatory matrix. With
   !> `shapes` = .false. only the shapes in modes at rest.
   function solve(self, speed, circulatory, shapes) result(whirl)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: circulatory
      logical, intent(in), optional :: shapes
      type(whirl_t) :: whirl

      complex(wp), allocatable :: value(:), vector(:, :)
      real(wp), allocatable :: state(:, :)
      integer, allocatable :: order(:)
      integer :: i, info, p
      logical :: with_shapes

      with_shapes = .true.
      if (present(shapes)) with_shapes = shapes
      p = size(self%squared)
      whirl%status = self%status
      allocate (state(2*p, 2*p), value(2*p), vector(2*p, 2*p))
      if (whirl%status == whirl_found) then
         call fill(state, self, speed, circulatory)
         call right_eigen(state, value, vector, info)
         if (info /= 0) whirl%status = whirl_failed
      end if
      if (whirl%status /= whirl_found) then
         allocate (whirl%value(0), whirl%shape(size(self%modal%basis, 1), 0), whirl%modal(p, 0))
         return
      end if
      order = upper_half(value)
      allocate (whirl%value(size(order)), whirl%modal(p, size(order)))
      if (with_shapes) allocate (whirl%shape(size(self%modal%basis, 1), size(order)))
      do i = 1, size(order)
         whirl%value(i) = value(order(i))
         whirl%modal(:, i) = vector(:p, order(i))/max(norm2(abs(vector(:p, order(i)))), tiny(1.0_wp))
         if (with_shapes) whirl%shape(:, i) = self%shape_of(whirl%modal(:, i))
      end do
   end function solve

   !> A shape (n) in the coordinates of the unreduced model from one in modes at rest (p).
   pure function shape_of(self, modal) result(shape)
      class(whirl_problem_t), intent(in) :: self
      complex(wp), intent(in) :: modal(:)
      complex(wp) :: shape(size(self%modal%basis, 1))

      shape = cmplx(matmul(self%modal%basis, modal%re/self%scaling), matmul(self%modal%basis, modal%im/self%scaling), wp)
   end function shape_of

   !> The largest real part of an eigenvalue at a speed, 1/s; `status` as in `whirl_t`.
   subroutine growth(self, speed, circulatory, value, status)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: circulatory
      real(wp), intent(out) :: value
      integer, intent(out) :: status

      complex(wp), allocatable :: values(:)
      real(wp), allocatable :: state(:, :)
      integer :: info

      value = 0.0_wp
      status = self%status
      if (status /= whirl_found .or. size(self%squared) == 0) return
      allocate (state(2*size(self%squared), 2*size(self%squared)), values(2*size(self%squared)))
      call fill(state, self, speed, circulatory)
      call right_eigenvalues(state, values, info)
      if (info /= 0) status = whirl_failed
      if (info == 0) value = maxval(values%re)
   end subroutine growth

   !> The first-order matrix.
   subroutine fill(state, self, speed, circulatory)
      real(wp), intent(out) :: state(:, :)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: circulatory

      integer :: i, p

      p = size(self%squared)
      state(:, :p) = 0.0_wp
      state(:p, p + 1:) = 0.0_wp
      state(p + 1:, p + 1:) = -self%damping - speed*self%modal%gyroscopic
      do i = 1, p
         state(i, p + i) = self%scaling(i)
         state(p + i, i) = -self%squared(i)/self%scaling(i)
         state(p + 1:, i) = state(p + 1:, i) - self%cross_stiffness(:, i)/self%scaling(i)
         if (circulatory) state(p + 1:, i) = state(p + 1:, i) - speed*self%modal%circulatory(:, i)/self%scaling(i)
      end do
   end subroutine fill

   !> Places of the eigenvalues with imaginary part >= 0, ordered by it, equal ones by the real part.
   pure function upper_half(value) result(order)
      complex(wp), intent(in) :: value(:)
      integer, allocatable :: order(:)

      integer :: i, j, moved

      order = pack([(i, i=1, size(value))], value%im >= 0.0_wp)
      do i = 2, size(order)
         moved = order(i)
         j = i - 1
         do while (j >= 1)
            if (value(order(j))%im < value(moved)%im) exit
            if (.not. value(order(j))%im > value(moved)%im .and. value(order(j))%re <= value(moved)%re) exit
            order(j + 1) = order(j)
            j = j - 1
         end do
         order(j + 1) = moved
      end do
   end function upper_half

   !> How the nodes of shaft `shaft` turn on their orbits in a shape (n) with Im(lambda) > 0: +1 forward (with the shaft's
   !> rotation), -1 backward, 0 on straight lines or without lateral motion. Between, orbits are ellipses or nodes differ.
   pure function orbit_direction(model, shape, shaft) result(direction)
      type(rotor_model_t), intent(in) :: model
      complex(wp), intent(in) :: shape(:)
      integer, intent(in) :: shaft
      real(wp) :: direction

      real(wp) :: area, extent
      integer :: at(6), node

      area = 0.0_wp
      extent = 0.0_wp
      do node = 1, model%rotor%shaft(shaft)%nodes()
         at = model%numbering%of(shaft, node)
         if (at(2) == 0 .or. at(3) == 0) cycle
         ! v = cos, w = sin, that is (1, -i), turns from y to z.
         area = area - 2*aimag(conjg(shape(at(2)))*shape(at(3)))
         extent = extent + abs(shape(at(2)))**2 + abs(shape(at(3)))**2
      end do
      direction = 0.0_wp
      if (extent > still**2*sum(abs(shape)**2)) direction = area/extent*sign(1.0_wp, model%rotor%shaft(shaft)%speed_ratio)
   end function orbit_direction

   !> How nodes turn on their orbits in a shape (n) with Im(lambda) > 0, over all shafts: +1 forward (with the rotation of their
   !> shaft), -1 backward, 0 on straight lines or without lateral motion; between, orbits are ellipses or nodes differ.
   pure function whirl_direction(model, shape) result(direction)
      type(rotor_model_t), intent(in) :: model
      complex(wp), intent(in) :: shape(:)
      real(wp) :: direction

      real(wp) :: area, extent
      integer :: at(6), node, s

      area = 0.0_wp
      extent = 0.0_wp
      do s = 1, size(model%rotor%shaft)
         do node = 1, model%rotor%shaft(s)%nodes()
            at = model%numbering%of(s, node)
            if (at(2) == 0 .or. at(3) == 0) cycle
            ! v = cos, w = sin, that is (1, -i), turns from y to z.
            area = area - sign(2.0_wp, model%rotor%shaft(s)%speed_ratio)*aimag(conjg(shape(at(2)))*shape(at(3)))
            extent = extent + abs(shape(at(2)))**2 + abs(shape(at(3)))**2
         end do
      end do
      direction = 0.0_wp
      if (extent > still**2*sum(abs(shape)**2)) direction = area/extent
   end function whirl_direction

end module razy_rotor_whirl_whirl
