!! A root in a bracket by false position after Illinois, with bisection where that is slow (M. Dowell and P. Jarratt, BIT 11 (1971)
!! 168-174). The caller evaluates the function:
!!
!!     call bracket%begin(a, b, f_a, f_b)
!!     do while (bracket%goes_on())
!!        call bracket%take(f(bracket%x))
!!     end do
module razy_core_illinois
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: bracket_t

   !> The bracket [low, high], in which f changes its sign, and the point x to look at next.
   type :: bracket_t
      real(wp) :: low = 0.0_wp, high = 0.0_wp, x = 0.0_wp
      real(wp), private :: f_low = 0.0_wp, f_high = 0.0_wp, sign_low = 1.0_wp, width = 0.0_wp
      integer, private :: side = 0, rounds = 0
      logical, private :: hit = .false.
   contains
      procedure :: begin
      procedure :: goes_on
      procedure :: take
   end type bracket_t

   !> Rounds of false position, and of bisection after that.
   integer, parameter :: of_position = 50, of_bisection = 50

contains

   !> Begin with a bracket, and f at its ends; it is narrowed to `width`, or to two roundings of its upper end.
   subroutine begin(self, low, high, f_low, f_high, width)
      class(bracket_t), intent(out) :: self
      real(wp), intent(in) :: low, high, f_low, f_high
      real(wp), intent(in), optional :: width

      self%low = low
      self%high = high
      self%f_low = f_low
      self%f_high = f_high
      self%sign_low = sign(1.0_wp, f_low)
      self%x = high
      if (present(width)) self%width = width
   end subroutine begin

   !> Whether there is a point x to look at; if not, x is the last one.
   function goes_on(self)
      class(bracket_t), intent(inout) :: self
      logical :: goes_on

      goes_on = .not. self%hit .and. self%rounds < of_position + of_bisection &
                .and. self%high - self%low > max(self%width, 2*epsilon(1.0_wp)*abs(self%high))
      if (.not. goes_on) return
      self%rounds = self%rounds + 1
      self%x = 0.5_wp*(self%low + self%high)
      if (self%rounds <= of_position .and. self%f_low*self%f_high < 0.0_wp) then
         self%x = self%low + (self%high - self%low)*(self%f_low/(self%f_low - self%f_high))
         self%x = min(max(self%x, self%low), self%high)
      end if
   end function goes_on

   !> f at x; what is within `noise` is 0, and ends the search.
   pure subroutine take(self, f, noise)
      class(bracket_t), intent(inout) :: self
      real(wp), intent(in) :: f
      real(wp), intent(in), optional :: noise

      self%hit = .not. abs(f) > 0.0_wp
      if (present(noise)) self%hit = abs(f) <= noise
      if (self%hit) return
      if (self%sign_low*f > 0.0_wp) then
         self%low = self%x
         self%f_low = f
         if (self%side == 1) self%f_high = 0.5_wp*self%f_high
         self%side = 1
      else
         self%high = self%x
         self%f_high = f
         if (self%side == -1) self%f_low = 0.5_wp*self%f_low
         self%side = -1
      end if
   end subroutine take

end module razy_core_illinois
