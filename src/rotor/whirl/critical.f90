!! Critical speeds: where the frequency of a branch of eigenvalues is `order` times the speed.
!!
!! Newton's method on the shape u, the growth g and the speed Omega at once, with lambda = g + i order Omega: from
!! Q(lambda, Omega) u = 0, Q = lambda² + lambda (B + Omega G) + K + Omega C in modes at rest,
!!
!!     u_new = -dlambda Q⁻¹ Q_lambda u - dOmega Q⁻¹ Q_Omega u,   uᴴ u_new = 1,   dlambda = dg + i order dOmega,
!!
!! which is one complex system with two right-hand sides a step, and two real equations for dg and dOmega. If it leaves the
!! interval or ends at a shape of another branch, the crossing is found by false position on eigenvalues that are followed by
!! their shapes.
module razy_rotor_whirl_critical
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: zgesv
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_whirl, only: whirl_direction, whirl_found, whirl_problem_t, whirl_t
   use razy_rotor_whirl_whirl_match, only: likely
   implicit none(type, external)
   private

   public :: critical_t, crossing_t, in_order, locate

   !> Critical speeds err by less than this share; Newton's steps below the second, which no longer fall, are rounding.
   real(wp), parameter :: precise = 1.0e-12_wp, rounding = 1.0e-9_wp
   !> A crossing counts as found if frequency and excitation differ by less than this share.
   real(wp), parameter :: residual = 1.0e-9_wp
   integer, parameter :: most_steps = 100, most_newton = 12

   !> A critical speed, rad/s: there the frequency, rad/s, of `branch` is `order` times the speed. `growth` is the real part, 1/s.
   type :: critical_t
      real(wp) :: speed = 0.0_wp, order = 0.0_wp, frequency = 0.0_wp, growth = 0.0_wp, direction = 0.0_wp
      integer :: branch = 0
   end type critical_t

   !> A branch between two speeds, rad/s: its eigenvalues there, its shapes in modes at rest (p), and the spaces of the shapes of
   !> all eigenvalues equal to them (p, equals).
   type :: crossing_t
      real(wp) :: order = 0.0_wp, speed(2) = 0.0_wp
      complex(wp) :: value(2) = (0.0_wp, 0.0_wp)
      complex(wp), allocatable :: left_shape(:), right_shape(:), left(:, :), right(:, :)
   contains
      procedure :: differences
      procedure :: there
   end type crossing_t

contains

   !> Frequency less excitation at both speeds, rad/s.
   pure function differences(self) result(difference)
      class(crossing_t), intent(in) :: self
      real(wp) :: difference(2)

      difference = self%value%im - self%order*self%speed
   end function differences

   !> Whether the line of excitation crosses the branch.
   pure function there(self)
      class(crossing_t), intent(in) :: self
      logical :: there

      real(wp) :: f(2)

      f = self%differences()
      there = (f(1) > 0.0_wp .and. f(2) <= 0.0_wp) .or. (f(1) < 0.0_wp .and. f(2) >= 0.0_wp)
   end function there

   !> The critical speed of a crossing; its branch is left to the caller.
   subroutine locate(critical, found, problem, model, circulatory, crossing)
      type(critical_t), intent(out) :: critical
      logical, intent(out) :: found
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: circulatory
      type(crossing_t), intent(in) :: crossing

      complex(wp), allocatable :: shape(:)

      call by_newton(critical, shape, found, problem, circulatory, crossing)
      if (.not. found) call by_following(critical, shape, found, problem, circulatory, crossing)
      critical%order = crossing%order
      if (found) critical%direction = whirl_direction(model, problem%shape_of(shape))
   end subroutine locate

   subroutine by_newton(critical, shape, found, problem, circulatory, crossing)
      type(critical_t), intent(out) :: critical
      complex(wp), allocatable, intent(out) :: shape(:)
      logical, intent(out) :: found
      type(whirl_problem_t), intent(in) :: problem
      logical, intent(in) :: circulatory
      type(crossing_t), intent(in) :: crossing

      complex(wp), allocatable :: u(:)
      complex(wp) :: lambda
      real(wp) :: f(2), growth, old, share, speed, step, width
      integer :: i
      logical :: solved

      f = crossing%differences()
      share = f(1)/(f(1) - f(2))
      width = crossing%speed(2) - crossing%speed(1)
      speed = crossing%speed(1) + share*width
      growth = (1 - share)*crossing%value(1)%re + share*crossing%value(2)%re
      if (share < 0.5_wp) u = crossing%left_shape/problem%scaling
      if (.not. share < 0.5_wp) u = crossing%right_shape/problem%scaling
      step = huge(1.0_wp)
      found = .false.
      do i = 1, most_newton
         u = u/norm2(abs(u))
         old = abs(step)
         call newton_step(problem, circulatory, crossing%order, speed, growth, u, step, solved)
         if (.not. solved) return
         if (abs(speed - 0.5_wp*sum(crossing%speed)) > width) return
         found = abs(step) <= precise*speed .or. (abs(step) <= rounding*speed .and. abs(step) > 0.5_wp*old)
         if (found) exit
      end do
      if (.not. found) return
      shape = problem%scaling*u
      shape = shape/norm2(abs(shape))
      found = max(sum(abs(matmul(conjg(shape), crossing%left))**2), sum(abs(matmul(conjg(shape), crossing%right))**2)) >= likely &
              .and. abs(speed - 0.5_wp*sum(crossing%speed)) <= (0.5_wp + rounding)*width
      lambda = cmplx(growth, crossing%order*speed, wp)
      critical%speed = speed
      critical%frequency = lambda%im
      critical%growth = growth
   end subroutine by_newton

   !> One step; `step` is the change of the speed, rad/s.
   subroutine newton_step(problem, circulatory, order, speed, growth, u, step, solved)
      type(whirl_problem_t), intent(in) :: problem
      logical, intent(in) :: circulatory
      real(wp), intent(in) :: order
      real(wp), intent(inout) :: speed, growth
      complex(wp), intent(inout) :: u(:)
      real(wp), intent(out) :: step
      logical, intent(out) :: solved

      complex(wp) :: across, along, lambda, matrix(size(u), size(u)), right(size(u), 2)
      real(wp) :: determinant
      integer :: i, info, p, pivot(size(u))

      p = size(u)
      lambda = cmplx(growth, order*speed, wp)
      matrix = problem%damping + speed*problem%modal%gyroscopic
      right(:, 1) = matmul(matrix, u) + 2*lambda*u
      right(:, 2) = lambda*matmul(problem%modal%gyroscopic, u)
      matrix = lambda*matrix + problem%cross_stiffness
      if (circulatory) then
         right(:, 2) = right(:, 2) + matmul(problem%modal%circulatory, u)
         matrix = matrix + speed*problem%modal%circulatory
      end if
      do i = 1, p
         matrix(i, i) = matrix(i, i) + problem%squared(i) + lambda**2
      end do
      step = 0.0_wp
      call zgesv(p, 2, matrix, p, pivot, right, p, info)
      solved = info == 0
      if (.not. solved) return
      along = dot_product(u, right(:, 1))
      across = cmplx(0.0_wp, order, wp)*along + dot_product(u, right(:, 2))
      determinant = along%re*across%im - along%im*across%re
      solved = abs(determinant) > tiny(1.0_wp)*abs(along)
      if (.not. solved) return
      step = along%im/determinant
      u = (across%im/determinant - cmplx(0.0_wp, order*step, wp))*right(:, 1) - step*right(:, 2)
      growth = growth - across%im/determinant
      speed = speed + step
   end subroutine newton_step

   !> By the Illinois variant of false position. The eigenvalue is known by the space of shapes of an end: that of fewer equal
   !> eigenvalues, else the nearer one.
   subroutine by_following(critical, shape, found, problem, circulatory, crossing)
      type(critical_t), intent(out) :: critical
      complex(wp), allocatable, intent(out) :: shape(:)
      logical, intent(out) :: found
      type(whirl_problem_t), intent(in) :: problem
      logical, intent(in) :: circulatory
      type(crossing_t), intent(in) :: crossing

      type(whirl_t) :: whirl
      real(wp) :: at, f, fx(2), old, x(2)
      integer :: last, place, replaced, step
      logical :: use_left

      found = .false.
      x = crossing%speed
      fx = crossing%differences()
      at = x(2)
      last = 0
      associate (left => crossing%left, right => crossing%right)
         do step = 1, most_steps
            old = at
            at = x(2) - fx(2)*(x(2) - x(1))/(fx(2) - fx(1))
            whirl = problem%solve(at, circulatory, shapes=.false.)
            if (whirl%status /= whirl_found) return
            use_left = size(left, 2) < size(right, 2)
            if (size(left, 2) == size(right, 2)) use_left = at - crossing%speed(1) < crossing%speed(2) - at
            if (use_left) then
               place = maxloc(sum(abs(matmul(conjg(transpose(left)), whirl%modal))**2, dim=1), dim=1)
            else
               place = maxloc(sum(abs(matmul(conjg(transpose(right)), whirl%modal))**2, dim=1), dim=1)
            end if
            shape = whirl%modal(:, place)
            critical%speed = at
            critical%frequency = whirl%value(place)%im
            critical%growth = whirl%value(place)%re
            f = critical%frequency - crossing%order*at
            found = abs(f) <= residual*critical%frequency
            if (abs(at - old) <= precise*at .or. .not. abs(f) > 0.0_wp) return
            replaced = merge(1, 2, (f > 0.0_wp) .eqv. (fx(1) > 0.0_wp))
            if (replaced == last) fx(3 - replaced) = 0.5_wp*fx(3 - replaced)
            x(replaced) = at
            fx(replaced) = f
            last = replaced
         end do
      end associate
   end subroutine by_following

   !> Critical speeds by rising order, then by rising speed.
   pure function in_order(list) result(sorted)
      type(critical_t), intent(in) :: list(:)
      type(critical_t), allocatable :: sorted(:)

      type(critical_t) :: moved
      integer :: i, j

      sorted = list
      do i = 2, size(sorted)
         moved = sorted(i)
         j = i - 1
         do while (j >= 1)
            if (sorted(j)%order < moved%order) exit
            if (.not. sorted(j)%order > moved%order .and. sorted(j)%speed <= moved%speed) exit
            sorted(j + 1) = sorted(j)
            j = j - 1
         end do
         sorted(j + 1) = moved
      end do
   end function in_order

end module razy_rotor_whirl_critical
