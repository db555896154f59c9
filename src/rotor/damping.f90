!! Internal damping of shafts and the circulatory matrix that comes with it.
!!
!! `nodal` (source thesis, (4.32)-(4.34)): on v and w of every node b_i = 2 D sqrt(k_vi m_vi), with the diagonal entries of the
!! shaft's stiffness and of the mass with its disks. There is none in torsion and axial motion, and the damping ratios of
!! modes are many times D.
!! `proportional`: B = beta K of each shaft's elements, beta = 2 D/omega with the lowest frequency omega of the shaft's bending on
!! its bearings at rest: the ratio is D there if the bearings are stiff, and grows with the frequency, on however many elements.
!! `modal`: the ratio D in every mode of each shaft on its bearings, meshes open, B = M V diag(2 D omega) Vᵀ M. It fills the
!! shaft's block of B.
!!
!! Damping that turns with the shaft acts on velocities relative to it, q' - Omega J q with J q = x × q at each node:
!! C = -(B J + J B)/2, which is -B J for a B without preferred direction, and the mean over a turn for any other.
module razy_rotor_damping
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_linalg_dense, only: product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, modes_found
   use razy_linalg_null_space, only: null_space
   use razy_linalg_sparse, only: csr_t, entries_t, new_csr
   use razy_rotor_numbering, only: numbering_t
   use razy_rotor_rotor, only: damping_modal, damping_nodal, damping_proportional, rotor_t
   use razy_rotor_shaft_motions, only: list_bearings, list_held, list_motions
   implicit none(type, external)
   private

   public :: circulatory_matrix, internal_damping

   !> The block of a shaft is full with modal damping: no more coordinates than this.
   integer, parameter :: most_modal = 3000
   !> The coordinate that J exchanges each of the six with (0: none), and the sign of J(exchanged, coordinate).
   integer, parameter :: partner(6) = [0, 3, 2, 0, 6, 5]
   real(wp), parameter :: turn(6) = [0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, -1.0_wp]

contains

   !> B of the shafts' material (n, n); `shafts` is the stiffness of the shafts alone, `stiffness` that with bearings.
   subroutine internal_damping(damping, rotor, numbering, mass, shafts, stiffness, error)
      type(csr_t), intent(out) :: damping
      type(rotor_t), intent(in) :: rotor
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(in) :: mass, shafts, stiffness
      type(error_t), allocatable, intent(out) :: error

      type(entries_t) :: entries
      real(wp), allocatable :: k(:), m(:)
      integer :: i, s

      if (rotor%damping == damping_nodal) then
         k = shafts%diagonal()
         m = mass%diagonal()
         do i = 1, numbering%n
            if (numbering%kind(i) /= 2 .and. numbering%kind(i) /= 3) cycle
            call entries%add(i, i, 2*rotor%shaft(numbering%shaft(i))%damping_ratio*sqrt(k(i)*m(i)))
         end do
      else
         do s = 1, size(rotor%shaft)
            if (rotor%damping == damping_modal) call add_modal(entries, rotor, numbering, s, mass, stiffness, error)
            if (rotor%damping == damping_proportional) then
               call add_proportional(entries, rotor, numbering, s, mass, shafts, stiffness, error)
            end if
            if (allocated(error)) return
         end do
      end if
      damping = new_csr(entries, numbering%n, numbering%n)
   end subroutine internal_damping

   subroutine add_proportional(entries, rotor, numbering, s, mass, shafts, stiffness, error)
      type(entries_t), intent(inout) :: entries
      type(rotor_t), intent(in) :: rotor
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: s
      type(csr_t), intent(in) :: mass, shafts, stiffness
      type(error_t), allocatable, intent(out) :: error

      type(csr_t) :: m, k
      type(eigenpairs_t) :: pairs
      integer, allocatable :: bending(:)
      real(wp) :: beta
      integer :: free, i, j

      bending = [(i, i=numbering%first(s), numbering%first(s + 1) - 1)]
      bending = pack(bending, numbering%kind(bending) /= 1 .and. numbering%kind(bending) /= 4)
      if (size(bending) == 0 .or. .not. rotor%shaft(s)%damping_ratio > 0.0_wp) return
      m = mass%extract(bending)
      k = stiffness%extract(bending)
      pairs = dense_modes(k%dense(), m%dense())
      free = free_in_bending(rotor, numbering, s)
      beta = 0.0_wp
      if (pairs%status == modes_found .and. free < size(pairs%value)) beta = pairs%value(free + 1)
      if (.not. beta > 0.0_wp) then
         call raise(error, "proportional damping of shaft "//to_text(s)//": it has no lowest frequency of bending")
         return
      end if
      beta = 2*rotor%shaft(s)%damping_ratio/sqrt(beta)
      do i = numbering%first(s), numbering%first(s + 1) - 1
         do j = shafts%start(i), shafts%start(i + 1) - 1
            call entries%add(i, shafts%column(j), beta*shafts%value(j))
         end do
      end do
   end subroutine add_proportional

   !> How many rigid motions of shaft s across its axis no support and no bearing holds.
   integer function free_in_bending(rotor, numbering, s) result(free)
      type(rotor_t), intent(in) :: rotor
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: s

      integer, parameter :: across(4) = [2, 3, 5, 6]
      real(wp) :: moved(6*size(rotor%shaft), size(numbering%at))
      real(wp), allocatable :: basis(:, :), held(:, :)
      integer :: info

      call list_motions(rotor, moved)
      call list_held(numbering, moved, held)
      call list_bearings(rotor, moved, .true., held)
      call null_space(held(6*(s - 1) + across, :), basis, info)
      free = merge(size(basis, 2), 0, info == 0)
   end function free_in_bending

   subroutine add_modal(entries, rotor, numbering, s, mass, stiffness, error)
      type(entries_t), intent(inout) :: entries
      type(rotor_t), intent(in) :: rotor
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: s
      type(csr_t), intent(in) :: mass, stiffness
      type(error_t), allocatable, intent(out) :: error

      type(csr_t) :: m, k
      type(eigenpairs_t) :: pairs
      real(wp), allocatable :: image(:, :), block(:, :)
      integer, allocatable :: own(:)
      integer :: i, n

      own = [(i, i=numbering%first(s), numbering%first(s + 1) - 1)]
      n = size(own)
      if (n == 0 .or. .not. rotor%shaft(s)%damping_ratio > 0.0_wp) return
      if (n > most_modal) then
         call raise(error, "modal damping of shaft "//to_text(s)//" with "//to_text(n)//" coordinates: at most "// &
                    to_text(most_modal)//" (reduce the model, or use nodal damping)")
         return
      end if
      m = mass%extract(own)
      k = stiffness%extract(own)
      pairs = dense_modes(k%dense(), m%dense())
      if (pairs%status /= modes_found) call raise(error, "modal damping of shaft "//to_text(s)//": the eigenproblem was not solved")
      if (allocated(error)) return
      allocate (image(n, n))
      do i = 1, n
         image(:, i) = sqrt(2*rotor%shaft(s)%damping_ratio*sqrt(max(pairs%value(i), 0.0_wp)))*m%times(pairs%vector(:, i))
      end do
      block = product_of(image, transpose(image))
      ! Symmetric to the last bit, so that C is skew-symmetric.
      do i = 1, n
         block(i, :i - 1) = block(:i - 1, i)
      end do
      call entries%add_block(own, block)
   end subroutine add_modal

   !> C (n, n) of the internal damping B, with the speed ratio of each shaft in it.
   pure function circulatory_matrix(rotor, numbering, damping) result(circulatory)
      type(rotor_t), intent(in) :: rotor
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(in) :: damping
      type(csr_t) :: circulatory

      type(entries_t) :: entries
      real(wp) :: half
      integer :: i, j, k

      do i = 1, damping%rows
         do k = damping%start(i), damping%start(i + 1) - 1
            j = damping%column(k)
            half = 0.5_wp*rotor%shaft(numbering%shaft(i))%speed_ratio*damping%value(k)
            call entries%add(i, partner_of(numbering, j), half*turn(numbering%kind(j)))
            call entries%add(partner_of(numbering, i), j, -half*turn(numbering%kind(i)))
         end do
      end do
      circulatory = new_csr(entries, damping%rows, damping%rows)
   end function circulatory_matrix

   !> Number of the coordinate that J exchanges coordinate i with, or 0.
   pure function partner_of(numbering, i) result(other)
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: i
      integer :: other

      integer :: index(6)

      other = 0
      if (partner(numbering%kind(i)) == 0) return
      index = numbering%of(numbering%shaft(i), numbering%node(i))
      other = index(partner(numbering%kind(i)))
   end function partner_of

end module razy_rotor_damping
