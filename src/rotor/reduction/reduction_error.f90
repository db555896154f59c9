!! How far a reduced rotor model is from the one it was made of: static compliance of the meshes, natural frequencies with meshes
!! closed, transfer function at the meshes.
module razy_rotor_reduction_reduction_error
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_linalg_band_matrix, only: band_t, complex_band_lu_t, new_band
   use razy_linalg_banded, only: band_factor_t, bandwidth, narrow_order
   use razy_linalg_generalised, only: eigenpairs_t, modes_found
   use razy_linalg_lapack, only: zgesv
   use razy_linalg_sparse, only: add_matrices, csr_t
   use razy_rotor_free_motions, only: rigid_motions
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_whirl_modes, only: natural_modes, static_factor
   implicit none(type, external)
   private

   public :: compare_reduction, reduction_error_t

   !> What a reduced model has instead of the numbers of the unreduced one.
   type :: reduction_error_t
      !> Whether all numbers could be computed.
      logical :: complete = .false.
      !> Whether a load at the open meshes has something to stand against: not where a shaft is free to turn.
      logical, private :: is_static = .false.
      !> wᵀ K⁻¹ w of each mesh with meshes open, m/N, unreduced and reduced, NaN unless `is_static`. Where rigid motion that no mesh
      !> feels is free, K + s M stands for K with s of `reference_shift`.
      real(wp), allocatable :: compliance(:), reduced_compliance(:)
      !> Lowest natural frequencies of the unreduced model with meshes closed, rad/s.
      real(wp), allocatable :: frequency(:)
      !> Whether the unreduced modes move a mesh, |wᵀ x| > `least_d` of the largest, and the nearest frequency that the reduced
      !> model has to each, rad/s: modes that no mesh feels may be left out on purpose.
      logical, allocatable :: moves(:)
      real(wp), allocatable :: nearest(:)
      !> wᵀ (K + Kx + i omega (B + Bx) - omega² M)⁻¹ w with meshes closed, each mesh at itself (meshes, frequencies), m/N.
      complex(wp), allocatable :: response(:, :), reduced_response(:, :)
      !> s where rigid motion is free, else 0.
      real(wp), private :: shift = 0.0_wp
   contains
      procedure :: largest_compliance_error
      procedure :: largest_mesh_mode_error
      procedure :: largest_response_error
   end type reduction_error_t

   !> Modes with less of the largest deformation of a mesh are not compared.
   real(wp), parameter :: least_d = 1.0e-3_wp
   !> Frequencies below this share of the largest are those of rigid motion.
   real(wp), parameter :: rigid = 1.0e-6_wp

contains

   !> Compare at the `count` lowest frequencies (at most those of the reduced model) and at the angular frequencies `omega` > 0,
   !> rad/s. What is `known` of the unreduced model from a comparison with as many frequencies and the same `omega` is not computed
   !> again.
   function compare_reduction(model, reduced, count, omega, known) result(difference)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      integer, intent(in) :: count
      real(wp), intent(in) :: omega(:)
      type(reduction_error_t), intent(in), optional :: known
      type(reduction_error_t) :: difference

      integer :: kept

      kept = min(count, size(reduced%load))
      if (present(known)) then
         difference = known
         difference%frequency = known%frequency(:min(kept, size(known%frequency)))
         difference%moves = known%moves(:size(difference%frequency))
      else
         call find_unreduced(difference, model, kept, omega)
      end if
      call find_reduced(difference, reduced, omega)
   end function compare_reduction

   subroutine find_unreduced(difference, model, count, omega)
      type(reduction_error_t), intent(inout) :: difference
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count
      real(wp), intent(in) :: omega(:)

      type(band_factor_t) :: factor
      type(csr_t) :: damping, pattern, stiffness
      type(band_t), allocatable :: band(:)
      type(complex_band_lu_t) :: response
      type(eigenpairs_t) :: pairs
      complex(wp), allocatable :: ordered(:, :), solution(:, :)
      real(wp), allocatable :: free(:, :), meshed(:, :), untouched(:, :)
      integer, allocatable :: order(:)
      integer :: f, info, j, width

      associate (w => model%mesh_direction, meshes => size(model%mesh_stiffness))
         allocate (difference%compliance(meshes), difference%response(meshes, size(omega)))
         call rigid_motions(model, .false., .false., .false., .false., free, untouched)
         call rigid_motions(model, .false., .false., .false., .true., meshed, untouched)
         difference%is_static = size(free, 2) == size(meshed, 2)
         difference%complete = .true.
         difference%compliance = ieee_value(difference%compliance, ieee_quiet_nan)
         if (difference%is_static) then
            call static_factor(model, factor, difference%shift, info)
            difference%complete = info == 0
            difference%compliance = [(dot_product(w(:, j), factor%solve(w(:, j))), j=1, meshes)]
         end if
         pairs = natural_modes(model, count, meshed=.true.)
         difference%complete = difference%complete .and. pairs%status == modes_found
         difference%frequency = sqrt(max(pairs%value, 0.0_wp))
         difference%moves = moving(model, pairs%vector)
         stiffness = add_matrices(1.0_wp, model%closed_stiffness(), 1.0_wp, model%cross_stiffness)
         damping = add_matrices(1.0_wp, model%closed_damping(), 1.0_wp, model%cross_damping)
         pattern = add_matrices(1.0_wp, add_matrices(1.0_wp, stiffness, 1.0_wp, model%mass), 1.0_wp, damping)
         order = narrow_order(pattern)
         width = max(bandwidth(stiffness%extract(order)), bandwidth(damping%extract(order)), bandwidth(pattern%extract(order)))
         band = [new_band(stiffness, order, width), new_band(damping, order, width), new_band(model%mass, order, width)]
         allocate (solution(size(w, 1), meshes))
         do f = 1, size(omega)
            ordered = cmplx(w(order, :), kind=wp)
            call response%factor(band(1), band(2), band(3), cmplx(0.0_wp, omega(f), wp), info)
            difference%complete = difference%complete .and. info == 0
            if (info == 0) call response%solve(ordered)
            solution(order, :) = ordered
            difference%response(:, f) = sum(w*solution, dim=1)
         end do
      end associate
   end subroutine find_unreduced

   !> Which shapes (n, modes) move a mesh.
   pure function moving(model, shapes) result(moves)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: shapes(:, :)
      logical, allocatable :: moves(:)

      real(wp) :: d(size(shapes, 2), size(model%mesh_stiffness))
      integer :: i

      d = abs(matmul(transpose(shapes), model%mesh_direction))
      moves = [(any(d(i, :) > least_d*maxval(d)), i=1, size(d, 1))]
   end function moving

   subroutine find_reduced(difference, reduced, omega)
      type(reduction_error_t), intent(inout) :: difference
      type(reduced_t), intent(in) :: reduced
      real(wp), intent(in) :: omega(:)

      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: values(:)
      integer :: f, i

      difference%reduced_compliance = difference%compliance
      if (difference%is_static) then
         difference%reduced_compliance = real(at_meshes(cmplx(reduced%stiffness + difference%shift*reduced%mass, kind=wp)), wp)
      end if
      pairs = reduced%modes(meshed=.true.)
      difference%complete = difference%complete .and. pairs%status == modes_found
      values = sqrt(max(pairs%value, 0.0_wp))
      associate (frequency => difference%frequency)
         difference%nearest = [(values(minloc(abs(values - frequency(i)), dim=1)), i=1, size(frequency))]
      end associate
      difference%reduced_response = difference%response
      do f = 1, size(omega)
         difference%reduced_response(:, f) = at_meshes(cmplx(reduced%closed_stiffness() + reduced%cross_stiffness &
                                                             - omega(f)**2*reduced%mass, &
                                                             omega(f)*(reduced%closed_damping() + reduced%cross_damping), wp))
      end do

   contains

      !> w_jᵀ A⁻¹ w_j of each mesh; A (p, p) is lost.
      function at_meshes(matrix) result(response)
         complex(wp), intent(in) :: matrix(:, :)
         complex(wp) :: response(size(reduced%mesh_direction, 2))

         complex(wp), allocatable :: factor(:, :), solution(:, :)
         integer :: info, p, pivot(size(matrix, 1))

         p = size(matrix, 1)
         factor = matrix
         solution = cmplx(reduced%mesh_direction, kind=wp)
         call zgesv(p, size(solution, 2), factor, p, pivot, solution, p, info)
         difference%complete = difference%complete .and. info == 0
         response = sum(reduced%mesh_direction*solution, dim=1)
      end function at_meshes

   end subroutine find_reduced

   !> The largest relative error of the static compliance; NaN if there is none.
   pure function largest_compliance_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      error = ieee_value(error, ieee_quiet_nan)
      if (self%is_static) error = maxval([0.0_wp, abs(self%reduced_compliance/self%compliance - 1)])
   end function largest_compliance_error

   !> The largest relative distance from the frequency of a mode that moves a mesh to the next one of the reduced model.
   pure function largest_mesh_mode_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      logical :: compared(size(self%frequency))

      compared = self%moves .and. self%frequency > rigid*maxval(self%frequency)
      error = maxval([0.0_wp, abs(pack(self%nearest, compared)/pack(self%frequency, compared) - 1)])
   end function largest_mesh_mode_error

   !> The largest error of the transfer function over its largest magnitude, of any mesh.
   pure function largest_response_error(self) result(error)
      class(reduction_error_t), intent(in) :: self
      real(wp) :: error

      integer :: j

      error = maxval([0.0_wp, (maxval(abs(self%reduced_response(j, :) - self%response(j, :)))/maxval(abs(self%response(j, :))), &
                               j=1, size(self%response, 1))])
   end function largest_response_error

end module razy_rotor_reduction_reduction_error
