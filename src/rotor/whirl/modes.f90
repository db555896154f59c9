!! Natural frequencies and shapes of a rotor system at rest, undamped, and what the shapes are.
!!
!! Small systems go to LAPACK, large ones to ARPACK. Bending stiffness of n elements spans n⁴, so that the factor of a fine mesh
!! carries rounding of that size. So the pairs found are improved, x + (K - shift M)⁻¹ (lambda M x - K x) with the
!! residual from the deformations of the elements, and taken anew as the eigenpairs in the space of these vectors
!! (Rayleigh and Ritz), again from deformations.
module razy_rotor_whirl_modes
   use razy_core_kinds, only: pi, wp
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_dense, only: product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, first_modes, modes_found, modes_not_definite, orient
   use razy_linalg_sparse, only: add_matrices, csr_t
   use razy_rotor_free_motions, only: rigid_motions
   use razy_rotor_deformation, only: find_deformations, projected_stiffness, restoring_force
   use razy_rotor_model, only: rotor_model_t
   implicit none(type, external)
   private

   public :: energy_shares, motion_of, natural_modes, reference_shift, shaft_shares, static_factor, &
             strain_shares

   !> A shift that does not make the matrix positive definite is raised by this factor, so often.
   real(wp), parameter :: raise_shift = 1.0e3_wp
   integer, parameter :: most_shifts = 4
   !> Corrections go on until no value changes by more than this share; errors of the values then are smaller by far.
   real(wp), parameter :: settled = 1.0e-8_wp
   integer, parameter :: most_corrections = 5

contains

   !> The `count` lowest modes (fewer if there are not so many), eigenvalues omega², (rad/s)². With `meshed`, all meshes are
   !> closed and linear.
   function natural_modes(model, count, meshed) result(pairs)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count
      logical, intent(in) :: meshed
      type(eigenpairs_t) :: pairs

      type(csr_t) :: stiffness
      real(wp) :: shift
      integer :: attempt

      stiffness = model%stiffness
      if (meshed) stiffness = model%closed_stiffness()
      shift = -reference_shift(model)
      do attempt = 1, most_shifts
         pairs = first_modes(stiffness, model%mass, count, shift)
         if (pairs%status /= modes_not_definite) exit
         shift = raise_shift*shift
      end do
      ! Beside the highest modes the projected stiffness of low ones is rounding.
      if (pairs%status == modes_found .and. count <= model%mass%rows/3) call improve(pairs, model, stiffness, shift, meshed)
   end function natural_modes

   !> Inverse iteration in the form of corrections, and the Ritz pairs of the vectors, until the values stay.
   subroutine improve(pairs, model, stiffness, shift, meshed)
      type(eigenpairs_t), intent(inout) :: pairs
      type(rotor_model_t), intent(in) :: model
      type(csr_t), intent(in) :: stiffness
      real(wp), intent(in) :: shift
      logical, intent(in) :: meshed

      type(band_factor_t) :: factor
      type(eigenpairs_t) :: ritz
      real(wp), allocatable :: force(:), old(:), residual(:), vector(:, :)
      integer :: info, j, step

      call factor%factor(add_matrices(1.0_wp, stiffness, -shift, model%mass), info)
      if (info /= 0) pairs%status = modes_not_definite
      do step = 1, most_corrections
         if (pairs%status /= modes_found) return
         old = pairs%value
         do j = 1, size(pairs%value)
            residual = model%mass%times(pairs%vector(:, j))
            force = restoring_force(model, pairs%vector(:, j), meshed)
            residual = pairs%value(j)*residual - force
            force = factor%solve(residual)
            pairs%vector(:, j) = pairs%vector(:, j) + force
         end do
         ritz = dense_modes(projected_stiffness(model, pairs%vector, meshed), model%mass%congruence(pairs%vector))
         pairs%status = ritz%status
         pairs%value = ritz%value
         ! A separate array: the compiler would take the stack for the product otherwise.
         vector = product_of(pairs%vector, ritz%vector)
         call move_alloc(vector, pairs%vector)
         call orient(pairs%vector)
         if (maxval(abs(pairs%value - old)/(abs(pairs%value) - shift)) <= settled) exit
      end do
   end subroutine improve

   !> The factor of K with open meshes, `shift` = 0, or where rigid motion is free that of K + s M with s = `shift` of
   !> `reference_shift`. `info` is 0 if the matrix is positive definite.
   subroutine static_factor(model, factor, shift, info)
      type(rotor_model_t), intent(in) :: model
      type(band_factor_t), intent(out) :: factor
      real(wp), intent(out) :: shift
      integer, intent(out) :: info

      real(wp), allocatable :: motion(:, :), untouched(:, :)

      shift = 0.0_wp
      call rigid_motions(model, .false., .false., .false., .false., motion, untouched)
      if (size(motion, 2) == 0) then
         call factor%factor(model%stiffness, info)
         return
      end if
      shift = reference_shift(model)
      call factor%factor(add_matrices(1.0_wp, model%stiffness, shift, model%mass), info)
   end subroutine static_factor

   !> A number of the size of the lowest omega² that is not zero: bending of the longest shaft, pinned at its ends, which carries
   !> all disks; without them a shaft of hardly any mass, as textbooks have it, would be thousands of times too fast.
   pure function reference_shift(model) result(shift)
      type(rotor_model_t), intent(in) :: model
      real(wp) :: shift

      integer :: i, s
      real(wp) :: length, line_mass

      shift = huge(1.0_wp)
      do s = 1, size(model%rotor%shaft)
         associate (section => model%rotor%shaft(s)%section)
            length = sum(section%length, mask=section%first_node == 0)
            do i = 1, size(section)
               if (section(i)%first_node > 0) cycle
               line_mass = section(i)%material%density*section(i)%area() + sum(model%rotor%disk%mass)/length
               if (.not. line_mass > 0.0_wp) cycle
               shift = min(shift, (pi/length)**4*section(i)%material%young*section(i)%second_moment()/line_mass)
            end do
         end associate
      end do
      if (.not. shift < huge(1.0_wp)) shift = 1.0_wp
   end function reference_shift

   !> Which motion a coordinate of a node (1 to 6) belongs to: 1 axial, 2 torsion, 3 bending in the plane xy, 4 in xz.
   elemental integer function motion_of(kind)
      integer, intent(in) :: kind

      integer, parameter :: motion(6) = [1, 3, 4, 2, 4, 3]

      motion_of = motion(kind)
   end function motion_of

   !> Shares of the kinetic energy of a shape `q` (n) in axial motion, torsion, bending in the plane xy and in xz; they add
   !> up to 1.
   function energy_shares(model, q) result(share)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      real(wp) :: share(4)

      share = kinetic_shares(model, q, motion_of(model%numbering%kind), 4)
   end function energy_shares

   !> The same in the shafts (shafts).
   function shaft_shares(model, q) result(share)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      real(wp), allocatable :: share(:)

      share = kinetic_shares(model, q, model%numbering%shaft, size(model%rotor%shaft))
   end function shaft_shares

   !> The same in `parts` parts; `part` (n) is that of each coordinate.
   function kinetic_shares(model, q, part, parts) result(share)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      integer, intent(in) :: part(:), parts
      real(wp) :: share(parts)

      real(wp), allocatable :: energy(:)
      integer :: i

      energy = q*model%mass%times(q)
      share = [(sum(energy, mask=part == i), i=1, parts)]
      share = share/sum(share)
   end function kinetic_shares

   !> Shares of the strain energy of a shape `q` (n) in the shafts, the bearings and the meshes, which are closed if `meshed`; they
   !> add up to 1. Zero for rigid-body motion, which has no strain energy.
   function strain_shares(model, q, meshed) result(share)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      logical, intent(in) :: meshed
      real(wp) :: share(3)

      real(wp), allocatable :: deformation(:, :), stress(:, :)
      real(wp) :: moved(6)
      integer :: j

      call find_deformations(deformation, stress, model, q)
      share(1) = sum(stress*deformation)
      share(2:) = 0.0_wp
      do j = 1, size(model%rotor%bearing)
         moved = model%numbering%stretch(model%rotor%bearing(j), q)
         share(2) = share(2) + dot_product(moved, matmul(model%rotor%bearing(j)%stiffness, moved))
      end do
      if (meshed) share(3) = sum(model%mesh_stiffness*matmul(q, model%mesh_direction)**2)
      if (sum(share) > tiny(1.0_wp)) share = share/sum(share)
   end function strain_shares

end module razy_rotor_whirl_modes
