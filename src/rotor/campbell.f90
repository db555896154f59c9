!! The Campbell diagram: eigenvalues over the speed, each followed by its shape, and where lines of excitation cross them.
!!
!! Eigenvalues of neighbouring speeds belong together if their shapes do: |x_iᴴ x_j|² in modes at rest, or for equal eigenvalues the
!! overlap of the spaces of their shapes, since the shapes themselves are arbitrary there. Where nothing overlaps by more than
!! `likely`, the interval is halved.
module razy_rotor_campbell
   use razy_core_kinds, only: wp
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl, only: whirl_found, whirl_problem_t, whirl_t
   implicit none(type, external)
   private

   public :: campbell_t, critical_t, new_campbell, whirl_direction

   !> Overlap above which two shapes belong together.
   real(wp), parameter :: likely = 0.6_wp
   !> Eigenvalues apart by less than this share of their size are taken as equal.
   real(wp), parameter :: equal = 1.0e-7_wp
   !> Intervals are halved so often at most.
   integer, parameter :: most_halvings = 10
   !> Critical speeds err by less than this share.
   real(wp), parameter :: precise = 1.0e-12_wp
   !> A crossing counts as found if frequency and excitation differ by less than this share.
   real(wp), parameter :: residual = 1.0e-9_wp
   integer, parameter :: most_steps = 100
   !> Lateral motion below this share of a shape is rounding.
   real(wp), parameter :: still = 1.0e-6_wp

   !> A critical speed, rad/s: there the frequency, rad/s, of `branch` is `order` times the speed. `growth` is the real part, 1/s.
   type :: critical_t
      real(wp) :: speed = 0.0_wp, order = 0.0_wp, frequency = 0.0_wp, growth = 0.0_wp, direction = 0.0_wp
      integer :: branch = 0
   end type critical_t

   !> Eigenvalues (modes, speeds) with Im >= 0 in the order of their imaginary parts, 1/s and rad/s; the branch that each belongs
   !> to; the direction of its orbits, see `whirl_direction`. Modes that a speed does not have are 0 in `branch`.
   type :: campbell_t
      integer :: status = whirl_found
      real(wp), allocatable :: speed(:)
      complex(wp), allocatable :: value(:, :)
      integer, allocatable :: branch(:, :)
      real(wp), allocatable :: direction(:, :)
      type(critical_t), allocatable :: critical(:)
      !> Crossings that were seen but not located, because shapes changed too much.
      integer :: lost = 0
   end type campbell_t

   !> Eigenvalues at one speed with their branches.
   type :: front_t
      real(wp) :: speed = 0.0_wp
      type(whirl_t) :: whirl
      integer, allocatable :: branch(:)
   end type front_t

   !> What is the same for all speeds, and the number of branches so far.
   type :: walk_t
      logical :: circulatory = .false.
      real(wp), allocatable :: order(:)
      integer :: modes = 0, branches = 0, lost = 0
      type(critical_t), allocatable :: critical(:)
   end type walk_t

contains

   !> The diagram at the rising speeds `speed`, rad/s, of `modes` modes, with critical speeds for the excitation orders `order`.
   function new_campbell(problem, model, speed, modes, order, circulatory) result(diagram)
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: speed(:), order(:)
      integer, intent(in) :: modes
      logical, intent(in) :: circulatory
      type(campbell_t) :: diagram

      type(front_t) :: before, front
      type(walk_t) :: walk
      integer :: i, k

      walk%circulatory = circulatory
      walk%order = order
      walk%modes = modes
      allocate (walk%critical(0))
      diagram%speed = speed
      allocate (diagram%value(modes, size(speed)), source=(0.0_wp, 0.0_wp))
      allocate (diagram%branch(modes, size(speed)), source=0)
      allocate (diagram%direction(modes, size(speed)), source=0.0_wp)
      do k = 1, size(speed)
         if (allocated(front%branch)) deallocate (front%branch)
         front%speed = speed(k)
         front%whirl = problem%solve(speed(k), circulatory)
         if (k == 1) then
            front%branch = [(i, i=1, size(front%whirl%value))]
            walk%branches = size(front%branch)
         else if (front%whirl%status == whirl_found) then
            call advance(walk, problem, model, before, front, most_halvings)
         end if
         diagram%status = front%whirl%status
         if (diagram%status /= whirl_found) exit
         do i = 1, min(modes, size(front%whirl%value))
            diagram%value(i, k) = front%whirl%value(i)
            diagram%branch(i, k) = front%branch(i)
            diagram%direction(i, k) = whirl_direction(model, front%whirl%shape(:, i))
         end do
         before = front
      end do
      diagram%critical = in_order(walk%critical)
      diagram%lost = walk%lost
   end function new_campbell

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

   !> The branches of `front`, from those of `before`, over speeds between as far as shapes change too much.
   recursive subroutine advance(walk, problem, model, before, front, halvings)
      type(walk_t), intent(inout) :: walk
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      type(front_t), intent(in) :: before
      type(front_t), intent(inout) :: front
      integer, intent(in) :: halvings

      type(front_t) :: middle
      integer :: i, partner(size(front%whirl%value))

      call match(before%whirl, front%whirl, partner)
      if (halvings > 0 .and. any(partner(:min(walk%modes, size(partner))) == 0)) then
         middle%speed = before%speed + (front%speed - before%speed)/2
         middle%whirl = problem%solve(middle%speed, walk%circulatory)
         if (middle%whirl%status /= whirl_found) then
            front%whirl%status = middle%whirl%status
            return
         end if
         call advance(walk, problem, model, before, middle, halvings - 1)
         if (middle%whirl%status == whirl_found) call advance(walk, problem, model, middle, front, halvings - 1)
         if (middle%whirl%status /= whirl_found) front%whirl%status = middle%whirl%status
         return
      end if
      allocate (front%branch(size(partner)), source=0)
      do i = 1, size(partner)
         if (partner(i) > 0) then
            front%branch(i) = before%branch(partner(i))
            if (min(i, partner(i)) <= walk%modes) call cross(walk, problem, model, before, partner(i), front, i)
         else
            walk%branches = walk%branches + 1
            front%branch(i) = walk%branches
         end if
      end do
   end subroutine advance

   !> For each eigenvalue of `after` the one of `before` with its shape, 0 if there is none: pairs of largest overlap first.
   pure subroutine match(before, after, partner)
      type(whirl_t), intent(in) :: before, after
      integer, intent(out) :: partner(:)

      real(wp) :: overlap(size(before%value), size(after%value))
      integer :: best(2), k

      overlap = overlaps(before, after)
      partner = 0
      do k = 1, min(size(before%value), size(after%value))
         best = maxloc(overlap)
         if (overlap(best(1), best(2)) < likely) exit
         partner(best(2)) = best(1)
         overlap(best(1), :) = -1.0_wp
         overlap(:, best(2)) = -1.0_wp
      end do
   end subroutine match

   !> Overlaps (before, after), between 0 and 1; equal eigenvalues share one.
   pure function overlaps(before, after) result(overlap)
      type(whirl_t), intent(in) :: before, after
      real(wp), allocatable :: overlap(:, :)

      complex(wp), allocatable :: a(:, :), b(:, :)
      integer :: first(size(before%value) + 1), groups(2), i, j, second(size(after%value) + 1)
      real(wp) :: shared

      call group_equal(before, a, first, groups(1))
      call group_equal(after, b, second, groups(2))
      overlap = abs(matmul(conjg(transpose(a)), b))**2
      do j = 1, groups(2)
         do i = 1, groups(1)
            associate (rows => first(i + 1) - first(i), columns => second(j + 1) - second(j), &
                       block => overlap(first(i):first(i + 1) - 1, second(j):second(j + 1) - 1))
               shared = sum(block)/min(rows, columns)
               block = shared
            end associate
         end do
      end do
   end function overlaps

   !> Shapes with those of equal eigenvalues made orthonormal; group i goes from `first(i)` to `first(i + 1) - 1`.
   pure subroutine group_equal(whirl, shape, first, groups)
      type(whirl_t), intent(in) :: whirl
      complex(wp), allocatable, intent(out) :: shape(:, :)
      integer, intent(out) :: first(:), groups

      integer :: i, j, pass

      shape = whirl%modal
      groups = 0
      first = 1
      do i = 1, size(whirl%value)
         if (i == 1) then
            groups = 1
         else if (abs(whirl%value(i) - whirl%value(i - 1)) > equal*abs(whirl%value(i))) then
            groups = groups + 1
            first(groups) = i
         end if
         first(groups + 1) = i + 1
         do pass = 1, 2
            do j = first(groups), i - 1
               shape(:, i) = shape(:, i) - dot_product(shape(:, j), shape(:, i))*shape(:, j)
            end do
            shape(:, i) = shape(:, i)/max(norm2(abs(shape(:, i))), tiny(1.0_wp))
         end do
      end do
   end subroutine group_equal

   !> Add the critical speeds between eigenvalue `i` of `before` and `j` of `front`.
   subroutine cross(walk, problem, model, before, i, front, j)
      type(walk_t), intent(inout) :: walk
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      type(front_t), intent(in) :: before, front
      integer, intent(in) :: i, j

      type(critical_t) :: critical
      real(wp) :: high, low
      logical :: found
      integer :: k

      do k = 1, size(walk%order)
         low = before%whirl%value(i)%im - walk%order(k)*before%speed
         high = front%whirl%value(j)%im - walk%order(k)*front%speed
         if (.not. (low > 0.0_wp .and. high <= 0.0_wp) .and. .not. (low < 0.0_wp .and. high >= 0.0_wp)) cycle
         critical%order = walk%order(k)
         critical%branch = before%branch(i)
         call locate(critical, found, problem, model, walk%circulatory, [before%speed, front%speed], [low, high], &
                     equal_shapes(before%whirl, i), equal_shapes(front%whirl, j))
         if (found) then
            walk%critical = [walk%critical, critical]
         else
            walk%lost = walk%lost + 1
         end if
      end do
   end subroutine cross

   !> The shapes of all eigenvalues equal to number i, orthonormal.
   pure function equal_shapes(whirl, i) result(space)
      type(whirl_t), intent(in) :: whirl
      integer, intent(in) :: i
      complex(wp), allocatable :: space(:, :)

      complex(wp), allocatable :: shape(:, :)
      integer :: first(size(whirl%value) + 1), g, groups

      call group_equal(whirl, shape, first, groups)
      g = count(first(:groups) <= i)
      space = shape(:, first(g):first(g + 1) - 1)
   end function equal_shapes

   !> The crossing between two speeds by the Illinois variant of false position. The eigenvalue is known by the space of shapes of
   !> an end: that of fewer equal eigenvalues, else the nearer one.
   subroutine locate(critical, found, problem, model, circulatory, speed, difference, left, right)
      type(critical_t), intent(inout) :: critical
      logical, intent(out) :: found
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: circulatory
      real(wp), intent(in) :: speed(2), difference(2)
      complex(wp), intent(in) :: left(:, :), right(:, :)

      type(whirl_t) :: whirl
      real(wp) :: at, f, fx(2), old, x(2)
      integer :: last, place, replaced, step
      logical :: use_left

      found = .false.
      x = speed
      fx = difference
      at = x(2)
      last = 0
      do step = 1, most_steps
         old = at
         at = x(2) - fx(2)*(x(2) - x(1))/(fx(2) - fx(1))
         whirl = problem%solve(at, circulatory)
         if (whirl%status /= whirl_found) return
         use_left = size(left, 2) < size(right, 2)
         if (size(left, 2) == size(right, 2)) use_left = at - speed(1) < speed(2) - at
         if (use_left) then
            place = maxloc(sum(abs(matmul(conjg(transpose(left)), whirl%modal))**2, dim=1), dim=1)
         else
            place = maxloc(sum(abs(matmul(conjg(transpose(right)), whirl%modal))**2, dim=1), dim=1)
         end if
         critical%speed = at
         critical%frequency = whirl%value(place)%im
         critical%growth = whirl%value(place)%re
         critical%direction = whirl_direction(model, whirl%shape(:, place))
         f = critical%frequency - critical%order*at
         found = abs(f) <= residual*critical%frequency
         if (abs(at - old) <= precise*at .or. .not. abs(f) > 0.0_wp) return
         replaced = merge(1, 2, (f > 0.0_wp) .eqv. (fx(1) > 0.0_wp))
         if (replaced == last) fx(3 - replaced) = 0.5_wp*fx(3 - replaced)
         x(replaced) = at
         fx(replaced) = f
         last = replaced
      end do
   end subroutine locate

   !> How nodes turn on their orbits in a shape (n) with Im(lambda) > 0, over all shafts: +1 forward (with the rotation of their
   !> shaft), -1 backward, 0 on straight lines or without lateral motion; between, orbits are ellipses or nodes differ.
   pure function whirl_direction(model, shape) result(direction)
      type(rotor_model_t), intent(in) :: model
      complex(wp), intent(in) :: shape(:)
      real(wp) :: direction

      real(wp) :: area, extent
      integer :: at(6), node, s

      area = 0.0_wp
      extent = 0.0_wp
      do s = 1, size(model%rotor%shaft)
         do node = 1, model%rotor%shaft(s)%nodes()
            at = model%numbering%of(s, node)
            if (at(2) == 0 .or. at(3) == 0) cycle
            ! v = cos, w = sin, that is (1, -i), turns from y to z.
            area = area - sign(2.0_wp, model%rotor%shaft(s)%speed_ratio)*aimag(conjg(shape(at(2)))*shape(at(3)))
            extent = extent + abs(shape(at(2)))**2 + abs(shape(at(3)))**2
         end do
      end do
      direction = 0.0_wp
      if (extent > still**2*sum(abs(shape)**2)) direction = area/extent
   end function whirl_direction

end module razy_rotor_campbell
