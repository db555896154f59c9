!! Natural frequencies and shapes of a rotor system at rest, undamped, and what the shapes are.
!!
!! Small systems go to LAPACK, large ones to ARPACK. Bending stiffness of n elements spans n⁴, so that the factor of a fine mesh
!! carries rounding of that size; its eigenvalues are then taken anew as Rayleigh quotients whose energy is summed up from the
!! deformations of the elements. That is exact to rounding and errors of the shapes enter squared.
module razy_rotor_modes
   use razy_core_kinds, only: pi, wp
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, lowest_modes, modes_found, modes_not_definite
   use razy_linalg_sparse, only: csr_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_section, only: section_t, shear_cowper
   implicit none(type, external)
   private

   public :: energy_shares, natural_modes, reference_shift, strain_energy

   !> Systems of at most this size, or of which more than a third of all modes is wanted, go to LAPACK.
   integer, parameter :: most_dense = 300
   !> A shift that does not make the matrix positive definite is raised by this factor, so often.
   real(wp), parameter :: raise_shift = 1.0e3_wp
   integer, parameter :: most_shifts = 4

contains

   !> The `count` lowest modes (fewer if there are not so many), eigenvalues omega², (rad/s)². With `meshed`, all meshes are
   !> closed and linear.
   function natural_modes(model, count, meshed) result(pairs)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: count
      logical, intent(in) :: meshed
      type(eigenpairs_t) :: pairs

      type(csr_t) :: stiffness
      real(wp), allocatable :: vector(:, :)
      real(wp) :: shift
      integer :: attempt, j, kept, n

      n = model%mass%rows
      kept = min(count, n)
      stiffness = model%stiffness
      if (meshed) stiffness = model%closed_stiffness()
      if (n <= most_dense .or. 3*kept > n) then
         pairs = dense_modes(stiffness%dense(), model%mass%dense())
         if (pairs%status /= modes_found .or. kept == n) return
         pairs%value = pairs%value(:kept)
         allocate (vector, source=pairs%vector(:, :kept))
         call move_alloc(vector, pairs%vector)
         return
      end if
      shift = -reference_shift(model)
      do attempt = 1, most_shifts
         pairs = lowest_modes(stiffness, model%mass, kept, shift)
         if (pairs%status /= modes_not_definite) exit
         shift = raise_shift*shift
      end do
      if (pairs%status /= modes_found) return
      do j = 1, size(pairs%value)
         pairs%value(j) = 2*strain_energy(model, pairs%vector(:, j), meshed)
      end do
   end function natural_modes

   !> A number of the size of the lowest omega² that is not zero: bending of the longest shaft, pinned at its ends.
   pure function reference_shift(model) result(shift)
      type(rotor_model_t), intent(in) :: model
      real(wp) :: shift

      integer :: i, s
      real(wp) :: length

      shift = huge(1.0_wp)
      do s = 1, size(model%rotor%shaft)
         associate (section => model%rotor%shaft(s)%section)
            length = sum(section%length)
            do i = 1, size(section)
               shift = min(shift, (pi/length)**4*section(i)%material%young*section(i)%second_moment() &
                           /(section(i)%material%density*section(i)%area()))
            end do
         end associate
      end do
   end function reference_shift

   !> qᵀ K q/2 of a displacement `q` (n), J (for a mode with xᵀ M x = 1: omega²/2), from elongation, twist and bending
   !> of each element, bearings, and with `meshed` the meshes.
   function strain_energy(model, q, meshed) result(energy)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      logical, intent(in) :: meshed
      real(wp) :: energy

      real(wp) :: left(6), right(6)
      integer :: e, i, j, node, s

      energy = 0.0_wp
      do s = 1, size(model%rotor%shaft)
         node = 1
         left = at_node(model, q, s, node)
         do i = 1, size(model%rotor%shaft(s)%section)
            do e = 1, model%rotor%shaft(s)%section(i)%elements
               node = node + 1
               right = at_node(model, q, s, node)
               energy = energy + element_energy(model%rotor%shaft(s)%section(i), model%rotor%shaft(s)%shear, left, right)
               left = right
            end do
         end do
      end do
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            left = at_node(model, q, bearing%shaft, bearing%node)
            energy = energy + 0.5_wp*dot_product(left, matmul(bearing%stiffness, left))
         end associate
      end do
      if (.not. meshed) return
      do j = 1, size(model%mesh_stiffness)
         energy = energy + 0.5_wp*model%mesh_stiffness(j)*dot_product(model%mesh_direction(:, j), q)**2
      end do
   end function strain_energy

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

   !> Energy of one element of a section. Bending by the angle b between its ends costs E J b²/(2 l); the antisymmetric
   !> deformation a = psi_1 + psi_2 - 2 (v_2 - v_1)/l costs 3 E J a²/(2 l (1 + Phi)).
   pure function element_energy(section, shear, left, right) result(energy)
      type(section_t), intent(in) :: section
      integer, intent(in) :: shear
      real(wp), intent(in) :: left(6), right(6)
      real(wp) :: energy

      real(wp) :: ratio, length, y, z

      length = section%length/section%elements
      associate (area => section%area(), second => section%second_moment(), young => section%material%young, &
                 modulus => section%material%shear)
         ratio = 0.0_wp
         if (shear == shear_cowper) ratio = 12*young*second/(section%shear_coefficient()*modulus*area*length**2)
         y = left(6) + right(6) - 2*(right(2) - left(2))/length
         z = left(5) + right(5) + 2*(right(3) - left(3))/length
         energy = 0.5_wp/length*(young*area*(right(1) - left(1))**2 + 2*modulus*second*(right(4) - left(4))**2 &
                                 + young*second*((right(6) - left(6))**2 + (right(5) - left(5))**2 + 3*(y**2 + z**2)/(1 + ratio)))
      end associate
   end function element_energy

   !> Shares of the kinetic energy of a shape `q` (n) in axial motion, torsion, bending in the plane xy and in xz; they add
   !> up to 1.
   function energy_shares(model, q) result(share)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: q(:)
      real(wp) :: share(4)

      integer, parameter :: kind_of(6) = [1, 3, 4, 2, 4, 3]
      real(wp), allocatable :: momentum(:)
      integer :: i

      momentum = model%mass%times(q)
      share = 0.0_wp
      do i = 1, size(q)
         associate (kind => kind_of(model%numbering%kind(i)))
            share(kind) = share(kind) + q(i)*momentum(i)
         end associate
      end do
      share = share/sum(share)
   end function energy_shares

end module razy_rotor_modes
