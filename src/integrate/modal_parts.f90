!! What the motion in one contact state consists of: exponential terms, rigid modes and dense parts; and what of the terms is to be
!! followed as a dense part after all.
module razy_integrate_modal_parts
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: any_near, append, dense_modes_t, modal_basis_t, near, set_aside

   !> Modes that are kept together: y = phi η, η'' + damping η' + stiffness η = phiᵀ f; or, if `core` is allocated, states x with
   !> x' = core x + into (0, f), (y, y') = out x.
   type :: dense_modes_t
      real(wp), allocatable :: phi(:, :), stiffness(:, :), damping(:, :)
      real(wp), allocatable :: core(:, :), into(:, :), out(:, :)
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
      !> Whether a part is dense only because of the frequencies of excitation.
      logical :: resonant = .false.
      !> Whether the machine has impacts or friction, which need more digits.
      logical :: impacts = .false.
      integer :: info = 0
   contains
      procedure :: is_resonant_with
   end type modal_basis_t

   !> Slower than this part of the fastest mode one of many modes is followed without its particular solution.
   real(wp), parameter :: slow_of_many = 1.0e-6_wp
   !> With impacts: flights that become ever shorter need s to the rounding of the state, and with a particular solution in
   !> which more than a digit cancels it is not known so well.
   real(wp), parameter :: slow_with_impacts = 0.3_wp
   !> Nearer than this, relative, to a frequency of excitation a mode is followed together with the excitation.
   real(wp), parameter :: near = 1.0e-3_wp, near_with_impacts = 0.3_wp

contains

   !> Take out of the exponential terms what is too slow or too near to a frequency of excitation, `omega`, and follow each pair
   !> of eigenvalues of that as a dense part of two states.
   subroutine set_aside(self, omega)
      type(modal_basis_t), intent(inout) :: self
      real(wp), intent(in) :: omega(:)

      type(dense_modes_t) :: part
      real(wp) :: slow
      logical :: aside(size(self%lambda)), near_by
      integer :: i
      integer, allocatable :: kept(:)

      slow = merge(slow_with_impacts, slow_of_many, self%impacts)*self%fastest
      do i = 1, size(self%lambda)
         near_by = any_near(self%lambda(i:i), omega, nearness(self))
         self%resonant = self%resonant .or. near_by
         aside(i) = near_by .or. abs(self%lambda(i)) <= slow
         if (.not. aside(i)) cycle
         call alone(part, self%lambda(i), self%to_term(i, :), self%from_term(:, i))
         call append(self%dense, part)
      end do
      if (.not. any(aside)) return
      kept = pack([(i, i=1, size(aside))],.not. aside)
      self%lambda = self%lambda(kept)
      self%to_term = self%to_term(kept, :)
      self%from_term = self%from_term(:, kept)
   end subroutine set_aside

   !> One eigenvalue, or a pair, as states: real and imaginary part of the amplitude.
   pure subroutine alone(part, lambda, into, out)
      type(dense_modes_t), intent(out) :: part
      complex(wp), intent(in) :: lambda, into(:), out(:)

      real(wp) :: both(size(into), 2)

      part%fastest = abs(lambda)
      if (abs(aimag(lambda)) > 0.0_wp) then
         part%core = reshape([real(lambda), aimag(lambda), -aimag(lambda), real(lambda)], [2, 2])
         both(:, 1) = real(into)
         both(:, 2) = aimag(into)
         part%into = transpose(both)
         both(:, 1) = real(out)
         both(:, 2) = -aimag(out)
         part%out = both
      else
         part%core = reshape([real(lambda)], [1, 1])
         part%into = reshape(real(into), [1, size(into)])
         part%out = reshape(real(out), [size(out), 1])
      end if
   end subroutine alone

   subroutine append(list, part)
      type(dense_modes_t), allocatable, intent(inout) :: list(:)
      type(dense_modes_t), intent(in) :: part

      type(dense_modes_t), allocatable :: longer(:)

      allocate (longer(size(list) + 1))
      longer(:size(list)) = list
      longer(size(longer)) = part
      call move_alloc(longer, list)
   end subroutine append

   !> How near counts as near.
   pure function nearness(self)
      type(modal_basis_t), intent(in) :: self
      real(wp) :: nearness

      nearness = merge(near_with_impacts, near, self%impacts)
   end function nearness

   !> Whether an eigenvalue is nearer to a frequency than the part `within` of that.
   pure function any_near(lambda, omega, within) result(found)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: omega(:), within
      logical :: found

      integer :: t

      found = .false.
      do t = 1, size(omega)
         found = found .or. any(abs(cmplx(0.0_wp, omega(t), wp) - lambda) <= within*omega(t))
      end do
   end function any_near

   !> Whether modes and frequencies of excitation are so close that a basis made for `omega` differs.
   pure function is_resonant_with(self, omega) result(resonant)
      class(modal_basis_t), intent(in) :: self
      real(wp), intent(in) :: omega(:)
      logical :: resonant

      resonant = self%resonant .or. any_near(self%lambda, omega, nearness(self))
   end function is_resonant_with

end module razy_integrate_modal_parts
