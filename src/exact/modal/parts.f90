!! What the motion in one contact state consists of: exponential terms, rigid modes and dense parts.
module razy_exact_modal_parts
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: append, dense_modes_t, modal_basis_t

   !> Modes that are kept together: y = phi η, η'' + damping η' + stiffness η = phiᵀ f.
   type :: dense_modes_t
      real(wp), allocatable :: phi(:, :), stiffness(:, :), damping(:, :)
      !> Eigenvalues of the largest modulus, rad/s.
      real(wp) :: fastest = 0.0_wp
   end type dense_modes_t

   type :: modal_basis_t
      integer :: m = 0
      !> Eigenvalues of the exponential terms (terms), 1/s; of a pair the one with positive imaginary part.
      complex(wp), allocatable :: lambda(:)
      !> Amplitudes from the state (terms, 2m) and the state from amplitudes, z = Re(from_term a) (2m, terms).
      complex(wp), allocatable :: to_term(:, :), from_term(:, :)
      !> Rigid modes (m, rigid): y = rigid η, η = rigidᵀ y.
      real(wp), allocatable :: rigid(:, :)
      type(dense_modes_t), allocatable :: dense(:)
      !> Largest modulus of an eigenvalue, rad/s.
      real(wp) :: fastest = 0.0_wp
      !> Whether the machine has impacts or friction, which need more digits.
      logical :: impacts = .false.
      !> Whether fast and slow modes of a strongly damped part are exponential terms.
      logical :: stiff = .false.
      integer :: info = 0
   end type modal_basis_t

contains

   subroutine append(list, part)
      type(dense_modes_t), allocatable, intent(inout) :: list(:)
      type(dense_modes_t), intent(in) :: part

      type(dense_modes_t), allocatable :: longer(:)

      allocate (longer(size(list) + 1))
      longer(:size(list)) = list
      longer(size(longer)) = part
      call move_alloc(longer, list)
   end subroutine append

end module razy_exact_modal_parts
