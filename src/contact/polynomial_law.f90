!! Springs whose force is a polynomial of their stretch, such as Duffing's: F = Σ c_i sⁱ + b s', i = 1, 2, ...
module razy_contact_polynomial_law
   use razy_contact_contact_law, only: contact_law_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: new_polynomial_law, polynomial_law_t

   !> m (rad), further than anything moves: a trial step that is much too long may ask with any number.
   real(wp), parameter :: farthest = 1.0e20_wp

   !> One branch, which nothing ends.
   type, extends(contact_law_t) :: polynomial_law_t
      !> c_i, N/mⁱ (N m/radⁱ), and b, N s/m (N m s/rad).
      real(wp), allocatable, private :: coefficient(:)
      real(wp), private :: viscosity = 0.0_wp
   contains
      procedure :: energy
      procedure :: force
      procedure :: slopes
      procedure :: smoothed
   end type polynomial_law_t

contains

   !> A law from its coefficients, at most 9, and its damping.
   pure function new_polynomial_law(coefficient, damping) result(law)
      real(wp), intent(in) :: coefficient(:), damping
      type(polynomial_law_t) :: law

      law%coefficient = coefficient
      law%viscosity = damping
      law%functions = 0
      law%plain = 1
      allocate (law%branch(1))
      law%branch(1)%name = "acting"
      law%branch(1)%closed = .true.
   end function new_polynomial_law

   pure function force(self, branch, s, rate, normal)
      class(polynomial_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp) :: force

      real(wp) :: x
      integer :: i

      associate (u1 => branch, u2 => normal)
         x = max(-farthest, min(farthest, s))
      end associate
      force = 0.0_wp
      do i = size(self%coefficient), 1, -1
         force = (force + self%coefficient(i))*x
      end do
      force = force + self%viscosity*rate
   end function force

   pure subroutine slopes(self, branch, s, rate, normal, stiffness, damping)
      class(polynomial_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, normal
      real(wp), intent(out) :: stiffness, damping

      real(wp) :: force

      associate (unused => branch)
         call self%smoothed(s, rate, normal, 0.0_wp, force, stiffness, damping)
      end associate
   end subroutine slopes

   !> Stored since s = 0, Σ c_i sⁱ⁺¹/(i + 1), J.
   pure function energy(self, branch, s)
      class(polynomial_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      integer :: i

      associate (unused => branch)
         energy = sum([(self%coefficient(i)*s**(i + 1)/(i + 1), i=1, size(self%coefficient))])
      end associate
   end function energy

   !> Nothing is to be smoothed: F and its slopes.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(polynomial_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      real(wp) :: x
      integer :: i

      associate (unused => sharpness)
         force = self%force(1, s, rate, normal)
      end associate
      x = max(-farthest, min(farthest, s))
      stiffness = 0.0_wp
      do i = size(self%coefficient), 1, -1
         stiffness = stiffness*x + i*self%coefficient(i)
      end do
      damping = self%viscosity
   end subroutine smoothed

end module razy_contact_polynomial_law
