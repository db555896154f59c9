!! A root of a continuous function between two points where its signs differ.
!!
!! Chandrupatla's method (Adv. Eng. Softw. 28 (1997) 145-149): inverse quadratic interpolation where it is known to converge, else
!! bisection; as fast as Brent's, and the bracket always shrinks. The caller evaluates the function, so that it may be anything:
!!
!!     call root%start(x1, f1, x2, f2)
!!     do while (.not. root%done())
!!        call root%take(f(root%trial))
!!     end do
module razy_linalg_bracketed_root
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: bracketed_root_t

   integer, parameter :: most_trials = 200

   type :: bracketed_root_t
      !> Where the function is wanted next.
      real(wp) :: trial = 0.0_wp
      !> The point with the least |f| so far, and f there.
      real(wp) :: best = 0.0_wp, value = 0.0_wp
      integer :: trials = 0
      !> The ends of the bracket, the last trial first, and the end before it; f there.
      real(wp), private :: x(3) = 0.0_wp, f(3) = 0.0_wp
      real(wp), private :: tolerance = 0.0_wp
   contains
      procedure :: start
      procedure :: take
      procedure :: done
      procedure :: width
   end type bracketed_root_t

contains

   !> Begin with f1 = f(x1) and f2 = f(x2) of opposite signs, or one of them zero. `tolerance` is the length of the bracket,
   !> relative to the root, at which the search ends; rounding if not given.
   pure subroutine start(self, x1, f1, x2, f2, tolerance)
      class(bracketed_root_t), intent(inout) :: self
      real(wp), intent(in) :: x1, f1, x2, f2
      real(wp), intent(in), optional :: tolerance

      self%trials = 0
      self%x = [x1, x2, x2]
      self%f = [f1, f2, f2]
      self%tolerance = 4*epsilon(1.0_wp)
      if (present(tolerance)) self%tolerance = max(tolerance, self%tolerance)
      call keep_best(self)
      self%trial = x1 + 0.5_wp*(x2 - x1)
   end subroutine start

   !> Whether the root is found: f is zero, or the bracket is short enough.
   pure function done(self)
      class(bracketed_root_t), intent(in) :: self
      logical :: done

      done = .not. abs(self%value) > 0.0_wp .or. self%trials >= most_trials &
             .or. self%width() <= self%tolerance*abs(self%best)
   end function done

   !> Length of the bracket.
   pure function width(self)
      class(bracketed_root_t), intent(in) :: self
      real(wp) :: width

      width = abs(self%x(2) - self%x(1))
   end function width

   !> Take f(trial), and say where it is wanted next.
   pure subroutine take(self, f)
      class(bracketed_root_t), intent(inout) :: self
      real(wp), intent(in) :: f

      real(wp) :: t, least, xi, phi

      self%trials = self%trials + 1
      if (f < 0.0_wp .eqv. self%f(1) < 0.0_wp) then
         self%x(3) = self%x(1)
         self%f(3) = self%f(1)
      else
         self%x(2:3) = self%x(:2)
         self%f(2:3) = self%f(:2)
      end if
      self%x(1) = self%trial
      self%f(1) = f
      call keep_best(self)
      if (self%done()) return
      associate (x => self%x, y => self%f)
         least = min(0.5_wp, 0.5_wp*self%tolerance*abs(self%best)/abs(x(2) - x(1)))
         t = 0.5_wp
         if (abs(y(3) - y(2)) > 0.0_wp .and. abs(y(3) - y(1)) > 0.0_wp) then
            xi = (x(1) - x(2))/(x(3) - x(2))
            phi = (y(1) - y(2))/(y(3) - y(2))
            if (phi**2 < xi .and. (1 - phi)**2 < 1 - xi) then
               t = y(1)/(y(2) - y(1))*y(3)/(y(2) - y(3)) + (x(3) - x(1))/(x(2) - x(1))*y(1)/(y(3) - y(1))*y(2)/(y(3) - y(2))
            end if
         end if
         self%trial = x(1) + min(max(t, least), 1 - least)*(x(2) - x(1))
      end associate
   end subroutine take

   pure subroutine keep_best(self)
      type(bracketed_root_t), intent(inout) :: self

      integer :: i

      i = merge(1, 2, abs(self%f(1)) <= abs(self%f(2)))
      self%best = self%x(i)
      self%value = self%f(i)
   end subroutine keep_best

end module razy_linalg_bracketed_root
