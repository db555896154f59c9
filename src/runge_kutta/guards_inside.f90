!! The guards of a mode inside a step, on the step's dense output: their values there, and where one of them is left or turns.
!!
!! If all guards to look at are functions of s alone they are followed as scalar paths; any other, as a force, needs the state.
module razy_runge_kutta_guards_inside
   use razy_core_kinds, only: wp
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_runge_kutta_methods_dense_output, only: path_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: guards_inside_t, of_s_alone, sight_t

   !> A guard g and its rate at `theta` in [0, 1] of a step, and, at its ends and of a function of s alone, its second derivative.
   type :: sight_t
      real(wp) :: theta = 0.0_wp, g = 0.0_wp, rate = 0.0_wp, bend = 0.0_wp
   end type sight_t

   !> The step and the guards that `begin` was given, and whether the paths of s without excitation (contacts) are enough.
   type :: guards_inside_t
      type(system_t), pointer :: system => null()
      type(guards_t), pointer :: guards => null()
      type(stepper_t), pointer :: stepper => null()
      logical, allocatable, private :: wanted(:)
      logical, private :: on_paths = .false.
      type(path_t), allocatable, private :: path(:)
   contains
      procedure :: begin
      procedure :: look
      procedure :: find_root
      procedure :: find_turn
      procedure :: find_emergence
      procedure :: find_return
   end type guards_inside_t

   real(wp), parameter :: eps = epsilon(1.0_wp)
   integer, parameter :: most_iterations = 100
   !> Of a Newton step below this part the square is rounding; part to which the end of a rest is told.
   real(wp), parameter :: least_move = 1.0e-9_wp, least_part = 1.0e-3_wp

contains

   !> Whether guard i is a function of s alone.
   pure function of_s_alone(guards, i) result(alone)
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: i
      logical :: alone

      alone = guards%entry(i)%function > 0 .and. .not. abs(guards%entry(i)%beta) > 0.0_wp
   end function of_s_alone

   !> Take a step that has its dense output, and the guards that are `wanted` in it.
   subroutine begin(self, system, guards, stepper, wanted)
      class(guards_inside_t), intent(inout) :: self
      type(system_t), intent(in), target :: system
      type(guards_t), intent(inout), target :: guards
      type(stepper_t), intent(inout), target :: stepper
      logical, intent(in) :: wanted(:)

      integer :: i

      self%system => system
      self%guards => guards
      self%stepper => stepper
      self%wanted = wanted
      allocate (self%path(size(system%gap)))
      self%on_paths = .true.
      do i = 1, guards%count
         if (.not. wanted(i)) cycle
         self%on_paths = of_s_alone(guards, i) .and. .not. system%curved
         if (.not. self%on_paths) return
         associate (j => guards%entry(i)%contact)
            call stepper%output%follow(system%w(:, j), 0, self%path(j))
         end associate
      end do
   end subroutine begin

   !> Guards at theta (count), at least those wanted; with `only` this one.
   subroutine look(self, theta, seen, only)
      class(guards_inside_t), intent(in) :: self
      real(wp), intent(in) :: theta
      type(sight_t), intent(inout) :: seen(:)
      integer, intent(in), optional :: only

      real(wp) :: s, s_rate, z(2*self%system%m)
      integer :: i

      associate (system => self%system, dynamics => self%stepper%rhs%dynamics, tau => theta*self%stepper%h)
         seen%theta = theta
         if (.not. self%on_paths) then
            call self%stepper%output%at(theta, z)
            call self%guards%look(system, dynamics, tau, z, seen%g, seen%rate)
            return
         end if
         call dynamics%excitation%look(system%machine%tone, tau)
         do i = 1, size(seen)
            if (.not. self%wanted(i)) cycle
            if (present(only)) then
               if (i /= only) cycle
            end if
            associate (guard => self%guards%entry(i), j => self%guards%entry(i)%contact)
               call self%path(j)%look(theta, s, s_rate)
               s = s + system%gap(j)%constant + sum(real(system%gap(j)%error*dynamics%excitation%phasor))
               s_rate = s_rate + system%machine%contact(j)%drive &
                        + dynamics%excitation%rate(system%machine%tone, system%gap(j)%error, 1)
               seen(i)%g = guard%side*(guard%alpha*s + guard%gamma - guard%bound)
               seen(i)%rate = guard%side*guard%alpha*s_rate
            end associate
         end do
      end associate
   end subroutine look

   !> Guard i at theta.
   function look_at(self, i, theta) result(at)
      type(guards_inside_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: theta
      type(sight_t) :: at

      type(sight_t) :: seen(self%guards%count)

      call self%look(theta, seen, i)
      at = seen(i)
   end function look_at

   !> Root of guard i between a, where it is positive, and b, where it is negative: Newton's method in the bracket, from the root of
   !> the cubic with the values and rates there.
   function find_root(self, i, a, b) result(theta)
      class(guards_inside_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: a, b
      real(wp) :: theta

      type(sight_t) :: at
      real(wp) :: high, low, move
      integer :: k

      low = a%theta
      high = b%theta
      theta = low + (high - low)*cubic_root(a, b, (high - low)*self%stepper%h)
      do k = 1, most_iterations
         at = look_at(self, i, theta)
         if (.not. abs(at%g) > 0.0_wp) return
         if (at%g > 0.0_wp) low = theta
         if (at%g < 0.0_wp) high = theta
         move = 0.0_wp
         if (at%rate < 0.0_wp) move = -at%g/(at%rate*self%stepper%h)
         if (abs(move) > 0.0_wp .and. abs(move) <= least_move*theta .and. theta + move > low .and. theta + move < high) then
            theta = theta + move
            return
         end if
         if (.not. (theta + move > low .and. theta + move < high) .or. .not. abs(move) > 0.0_wp .or. k > most_iterations/2) then
            move = 0.5_wp*(low + high) - theta
         end if
         theta = theta + move
         if (abs(move) <= eps*theta .or. high - low <= 2*eps*high) return
      end do
   end function find_root

   !> About where from a (0) to b (1), `h` s later, the cubic with the values g(a) > 0 > g(b) and the rates there vanishes.
   pure function cubic_root(a, b, h) result(x)
      type(sight_t), intent(in) :: a, b
      real(wp), intent(in) :: h
      real(wp) :: x

      real(wp) :: c2, c3, d0, d1, slope
      integer :: k

      d0 = h*a%rate
      d1 = h*b%rate
      c3 = d0 + d1 - 2*(b%g - a%g)
      c2 = 3*(b%g - a%g) - 2*d0 - d1
      x = a%g/(a%g - b%g)
      do k = 1, 2
         slope = d0 + x*(2*c2 + x*3*c3)
         if (.not. slope < 0.0_wp) return
         x = min(max(x - (a%g + x*(d0 + x*(c2 + x*c3)))/slope, 0.0_wp), 1.0_wp)
      end do
   end function cubic_root

   !> Where between a and b the rate of guard i, of other signs there, vanishes.
   function find_turn(self, i, a, b) result(turn)
      class(guards_inside_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: a, b
      type(sight_t) :: turn

      type(bracketed_root_t) :: root
      real(wp) :: noise

      call root%start(a%theta, a%rate, b%theta, b%rate, least_move)
      turn = b
      do while (.not. root%done())
         turn = look_at(self, i, root%trial)
         ! What is left of the way changes the guard by rounding.
         noise = eps*abs(turn%g)/(root%width()*self%stepper%h)
         call root%take(merge(0.0_wp, turn%rate, abs(turn%rate) <= noise))
      end do
      turn%rate = 0.0_wp
   end function find_turn

   !> Where between a, where guard i is on its bound, and b, where it is beyond, that can be told from rounding.
   function find_emergence(self, i, a, b) result(theta)
      class(guards_inside_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: a, b
      real(wp) :: theta

      type(sight_t) :: middle
      real(wp) :: low

      low = a%theta
      theta = b%theta
      do while (theta - low > least_part*theta)
         middle = look_at(self, i, 0.5_wp*(low + theta))
         if (middle%g < -self%guards%noise(i)) then
            theta = middle%theta
         else
            low = middle%theta
         end if
      end do
   end function find_emergence

   !> Where guard i, on its bound at a and beyond it at b, comes back to it if it leads away from it first, though its rate at a
   !> does not say so (friction that begins to slide with no acceleration); at a if it does not.
   function find_return(self, i, a, b) result(theta)
      class(guards_inside_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: a, b
      real(wp) :: theta

      type(sight_t) :: high, low
      integer :: k

      theta = a%theta
      high = look_at(self, i, b%theta)
      do k = 1, digits(1.0_wp)
         low = look_at(self, i, a%theta + 0.5_wp*(high%theta - a%theta))
         if (abs(low%g) <= self%guards%noise(i)) return
         if (low%g > 0.0_wp) then
            theta = self%find_root(i, low, high)
            return
         end if
         high = low
      end do
   end function find_return

end module razy_runge_kutta_guards_inside
