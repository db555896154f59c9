!! How far a reduced rotor model is from the one it was made of: static compliance of the meshes, natural frequencies with meshes
!! closed, transfer function at the meshes.
module razy_rotor_reduction_reduction_error
   use razy_core_kinds, only: wp
   use razy_linalg_band_lapack, only: zgbsv
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, modes_found
   use razy_linalg_lapack, only: zgesv
   use razy_linalg_ordering, only: bandwidth, narrow_order
   use razy_linalg_sparse, only: add_matrices, csr_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_modes, only: natural_modes, reference_shift
   use razy_rotor_reduction_reduced, only: reduced_t
   implicit none(type, external)
   private

   public :: compare_reduction, reduction_error_t

   !> Relative errors of a reduced model.
   type :: reduction_error_t
      !> Whether all numbers could be computed.
      logical :: complete = .false.
      !> s of K + s M where rigid motion is free, else 0.
      real(wp) :: shift = 0.0_wp
      !> wᵀ K⁻¹ w of each mesh with meshes open, m/N, unreduced and reduced. Where rigid motion is free, K + s M stands for K
      !> with s of `reference_shift`.
      real(wp), allocatable :: compliance(:), reduced_compliance(:)
      !> Lowest natural frequencies with meshes closed, rad/s.
      real(wp), allocatable :: frequency(:), reduced_frequency(:)
      !> Whether the unreduced modes move a mesh, |wᵀ x| > `least_d` of the largest, and the nearest frequency that the reduced
      !> model has to each, rad/s: modes that no mesh feels may be left out on purpose.
      logical, allocatable :: moves(:)
      real(wp), allocatable :: nearest(:)
      !> Angular frequencies of the comparison, rad/s; wᵀ (K + Kx + i omega (B + Bx) - omega² M)⁻¹ w with meshes closed,
      !> each mesh at itself (meshes, frequencies), m/N.
      real(wp), allocatable :: omega(:)
      complex(wp), allocatable :: response(:, :), reduced_response(:, :)
   contains
      procedure :: largest_compliance_error
      procedure :: largest_frequency_error
      procedure :: largest_mesh_mode_error
      procedure :: largest_response_error
   end type reduction_error_t

   !> Modes with less of the largest deformation of a mesh are not compared.
   real(wp), parameter :: least_d = 1.0e-3_wp

contains

   !> Compare at the `count` lowest frequencies (at most those of the reduced model) and at the frequencies `omega` > 0. What is
   !> `known` of the unreduced model from a comparison with as many frequencies and the same `omega` is not computed again.
   function compare_reduction(model, reduced, count, omega, known) result(difference)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      integer, intent(in) :: count
      real(wp), intent(in) :: omega(:)
      type(reduction_error_t), intent(in), optional :: known
      type(reduction_error_t) :: difference

      type(eigenpairs_t) :: pairs
      integer :: i, kept

      kept = min(count, size(reduced%load))
      if (present(known)) then
         difference = known
         difference%frequency = known%frequency(:min(kept, size(known%frequency)))
         difference%moves = known%moves(:size(difference%frequency))
      else
         difference%omega = omega
         call unreduced_compliance(difference, model)
         pairs = natural_modes(model, kept, meshed=.true.)
         difference%complete = difference%complete .and. pairs%status == modes_found
         difference%frequency = sqrt(max(pairs%value, 0.0_wp))
         difference%moves = moving(model, pairs%vector)
         call unreduced_response(difference, model)
      end if
      call compliance_of(difference, reduced)
      kept = size(difference%frequency)
      pairs = dense_modes(reduced%closed_stiffness(), reduced%mass)
      difference%complete = difference%complete .and. pairs%status == modes_found
      difference%reduced_frequency = sqrt(max(pairs%value(:min(kept, size(pairs%value))), 0.0_wp))
      difference%nearest = difference%frequency
      do i = 1, kept
         associate (values => sqrt(max(pairs%value, 0.0_wp)))
            difference%nearest(i) = values(minloc(abs(values - difference%frequency(i)), dim=1))
         end associate
      end do
      call response_of(difference, reduced)
   end function compare_reduction

   !> Which shapes (n, modes) move a mesh.
   pure function moving(model, shapes) result(moves)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: shapes(:, :)
      logical, allocatable :: moves(:)

      real(wp) :: d(size(shapes, 2), size(model%mesh_stiffness))
      integer :: i, j

      do j = 1, size(d, 2)
         d(:, j) = [(abs(dot_product(model%mesh_direction(:, j), shapes(:, i))), i=1, size(d, 1))]
      end do
      moves = [(any(d(i, :) > least_d*maxval(d)), i=1, size(d, 1))]
   end function moving

   subroutine unreduced_compliance(difference, model)
      type(reduction_error_t), intent(inout) :: difference
      type(rotor_model_t), intent(in) :: model

      type(band_factor_t) :: factor
      integer :: info, j

      allocate (difference%compliance(size(model%mesh_stiffness)))
      call factor%factor(model%stiffness, info)
      if (info /= 0) then
         difference%shift = reference_shift(model)
         call factor%factor(add_matrices(1.0_wp, model%stiffness, difference%shift, model%mass), info)
      end if
      difference%complete = info == 0
      do j = 1, size(model%mesh_stiffness)
         associate (w => model%mesh_direction(:, j))
            difference%compliance(j) = dot_product(w, factor%solve(w))
         end associate
      end do
   end subroutine unreduced_compliance

   subroutine compliance_of(difference, reduced)
      type(reduction_error_t), intent(inout) :: difference
      type(reduced_t), intent(in) :: reduced

      complex(wp), allocatable :: matrix(:, :), column(:, :)
      integer, allocatable :: pivot(:)
      integer :: info, j, p

      p = size(reduced%load)
      allocate (pivot(p), column(p, 1))
      difference%reduced_compliance = difference%compliance
      do j = 1, size(difference%compliance)
         matrix = cmplx(reduced%stiffness + difference%shift*reduced%mass, kind=wp)
         column(:, 1) = cmplx(reduced%mesh_direction(:, j), kind=wp)
         call zgesv(p, 1, matrix, p, pivot, column, p, info)
         difference%complete = difference%complete .and. info == 0
         difference%reduced_compliance(j) = dot_product(reduced%mesh_direction(:, j), column(:, 1)%re)
      end do
   end subroutine compliance_of

   subroutine unreduced_response(difference, model)
      type(reduction_error_t), intent(inout) :: difference
      type(rotor_model_t), intent(in) :: model

      type(csr_t) :: stiffness
      complex(wp), allocatable :: column(:)
      integer :: f, info, j

      allocate (difference%response(size(model%mesh_stiffness), size(difference%omega)))
      stiffness = model%closed_stiffness()
      do f = 1, size(difference%omega)
         do j = 1, size(model%mesh_stiffness)
            call harmonic_response(column, model, stiffness, difference%omega(f), j, info)
            difference%complete = difference%complete .and. info == 0
            difference%response(j, f) = sum(model%mesh_direction(:, j)*column)
         end do
      end do
   end subroutine unreduced_response

   subroutine response_of(difference, reduced)
      type(reduction_error_t), intent(inout) :: difference
      type(reduced_t), intent(in) :: reduced

      complex(wp), allocatable :: matrix(:, :), solution(:, :)
      integer, allocatable :: pivot(:)
      integer :: f, info, j, meshes, p

      meshes = size(difference%compliance)
      p = size(reduced%load)
      difference%reduced_response = difference%response
      allocate (pivot(p), solution(p, meshes))
      do f = 1, size(difference%omega)
         associate (omega => difference%omega(f))
            matrix = cmplx(reduced%closed_stiffness() + reduced%cross_stiffness - omega**2*reduced%mass, &
                           omega*(reduced%closed_damping() + reduced%cross_damping), wp)
            solution = cmplx(reduced%mesh_direction, kind=wp)
            call zgesv(p, meshes, matrix, p, pivot, solution, p, info)
            difference%complete = difference%complete .and. info == 0
            do j = 1, meshes
               difference%reduced_response(j, f) = sum(reduced%mesh_direction(:, j)*solution(:, j))
            end do
         end associate
      end do
   end subroutine response_of

   !> (K + Kx + i omega (B + Bx) - omega² M)⁻¹ w_j with meshes closed, by a banded factor in a narrow order.
   subroutine harmonic_response(column, model, stiffness, omega, j, info)
      complex(wp), allocatable, intent(out) :: column(:)
      type(rotor_model_t), intent(in) :: model
      type(csr_t), intent(in) :: stiffness
      real(wp), intent(in) :: omega
      integer, intent(in) :: j
      integer, intent(out) :: info

      type(csr_t) :: damping, dynamic, pattern
      complex(wp), allocatable :: band(:, :), right(:, :)
      integer, allocatable :: order(:), pivot(:), place(:)
      integer :: i, n, width

      n = model%mass%rows
      dynamic = add_matrices(1.0_wp, add_matrices(1.0_wp, stiffness, 1.0_wp, model%cross_stiffness), -omega**2, model%mass)
      damping = add_matrices(1.0_wp, model%closed_damping(), 1.0_wp, model%cross_damping)
      pattern = add_matrices(1.0_wp, dynamic, 1.0_wp, damping)
      allocate (order(n), place(n), pivot(n), right(n, 1), column(n))
      order = narrow_order(pattern)
      do i = 1, n
         place(order(i)) = i
         right(i, 1) = cmplx(model%mesh_direction(order(i), j), kind=wp)
      end do
      width = bandwidth(pattern, order)
      allocate (band(3*width + 1, n), source=(0.0_wp, 0.0_wp))
      call add_to_band(band, width, place, dynamic, (1.0_wp, 0.0_wp))
      call add_to_band(band, width, place, damping, cmplx(0.0_wp, omega, wp))
      call zgbsv(n, width, width, 1, band, 3*width + 1, pivot, right, n, info)
      do i = 1, n
         column(order(i)) = right(i, 1)
      end do
   end subroutine harmonic_response

   pure subroutine add_to_band(band, width, place, matrix, factor)
      complex(wp), intent(inout) :: band(:, :)
      integer, intent(in) :: width, place(:)
      type(csr_t), intent(in) :: matrix
      complex(wp), intent(in) :: factor

      integer :: i, j, k, row

      do row = 1, matrix%rows
         i = place(row)
         do k = matrix%start(row), matrix%start(row + 1) - 1
            j = place(matrix%column(k))
            associate (entry => band(2*width + 1 + i - j, j))
               entry = entry + factor*matrix%value(k)
            end associate
         end do
      end do
   end subroutine add_to_band

   !> The largest relative error of the static compliance.
   pure function largest_compliance_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      error = maxval([0.0_wp, abs(self%reduced_compliance/self%compliance - 1)])
   end function largest_compliance_error

   !> The largest relative error of a frequency; rigid-body motion, which has none, is left out.
   pure function largest_frequency_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      integer :: i

      error = 0.0_wp
      do i = 1, size(self%frequency)
         if (self%frequency(i) <= 1.0e-6_wp*maxval(self%frequency)) cycle
         error = max(error, abs(self%reduced_frequency(i)/self%frequency(i) - 1))
      end do
   end function largest_frequency_error

   !> The largest relative distance from the frequency of a mode that moves a mesh to the next one of the reduced model.
   pure function largest_mesh_mode_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      integer :: i

      error = 0.0_wp
      do i = 1, size(self%frequency)
         if (.not. self%moves(i) .or. self%frequency(i) <= 1.0e-6_wp*maxval(self%frequency)) cycle
         error = max(error, abs(self%nearest(i)/self%frequency(i) - 1))
      end do
   end function largest_mesh_mode_error

   !> The largest error of the transfer function over its largest magnitude, of any mesh.
   pure function largest_response_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      integer :: j

      error = 0.0_wp
      do j = 1, size(self%response, 1)
         error = max(error, maxval(abs(self%reduced_response(j, :) - self%response(j, :)))/maxval(abs(self%response(j, :))))
      end do
   end function largest_response_error

end module razy_rotor_reduction_reduction_error
