!! What happens between two points of a branch: changes of the sequence of contacts, by bisection, and motions at which
!! determinants are 0 (razy_orbits_branch_within_step says which labels they have).
module razy_orbits_branch_special
   use razy_contact_contact_law, only: contact_law_t
   use razy_contact_friction_law, only: branch_sticking
   use razy_core_kinds, only: wp
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_linalg_square, only: bordered, determinant
   use razy_orbits_branch_fading, only: fading_t, new_fading, shortest
   use razy_orbits_periodic_multipliers, only: find_multipliers
   use razy_orbits_periodic_newton, only: complete
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: between, complete_point, direction, find_tangent, length, point_t
   use razy_orbits_touch, only: is_hard
   implicit none(type, external)
   private

   public :: find_change, find_root, is_crossing, name_change, value_of

   !> Contacts and flights shorter than this part of the period end in a grazing.
   real(wp), parameter :: short = 1.0e-4_wp
   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Motions so far aside of a crossing, in parts of a step, are none of the other branch's; where the branch turns they are
   !> farther off, as what the parameter tells there goes with the square.
   real(wp), parameter :: aside(2) = [0.001_wp, 0.01_wp]
   !> A function that is no smaller, of what it is at the ends of a step, than this where its sign changes jumps there.
   real(wp), parameter :: least_jump = 1.0e-3_wp

contains

   !> The last motion with the sequence of `a`, and the next one, `at`, by bisection, led by how long what only one side has lasts.
   !> Of motions that err `left` and `right` are farther off, as derivatives next to a grazing mean nothing. If no motion is found
   !> between them the change is only known to be there (not `located`).
   subroutine find_change(problem, a, b, left, at, right, located)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      type(point_t), intent(out) :: left, at, right
      logical, intent(out) :: located

      type(point_t) :: middle
      logical :: found
      real(wp) :: high, low, s, width
      type(fading_t) :: fading

      left = a
      right = b
      low = 0.0_wp
      high = length(a, b)
      width = least_width(a)
      fading = new_fading(a%orbit, b%orbit, high, width)
      located = .true.
      do
         s = 0.5_wp*(low + high)
         if (high - low <= width .or. s <= low .or. s >= high) exit
         s = fading%trial(low, high)
         call between(problem, a, b, s, middle, located, left, right)
         if (.not. located) exit
         call fading%see(middle%orbit, s)
         if (middle%orbit%sequence%is_like(a%orbit%sequence)) then
            left = middle
            low = s
         else
            right = middle
            high = s
         end if
      end do
      call complete_point(problem, a, right, found)
      at = right
      call name_change(problem, left%orbit, at%orbit, at%label, at%contact)
      s = problem%resolution*norm2(a%orbit%u)
      if (s > 0.0_wp) then
         if (found .and. low > s) call between(problem, a, b, low - s, left, found)
         if (found .and. high + s < length(a, b)) call between(problem, a, b, high + s, right, found)
      end if
      if (found) call complete_point(problem, a, left, found)
      if (found) call complete_point(problem, a, right, found)
      if (.not. found) then
         left = a
         right = b
         at = b
         call name_change(problem, left%orbit, at%orbit, at%label, at%contact)
         located = .false.
      end if
      ! Across a corner the planes in which it is looked for with other machines meet both sides.
      at%tangent = direction(left, right)
      at%orbit%multiplier = right%orbit%multiplier
      at%orbit%doubt = right%orbit%doubt
      if (.not. located) at%error = abs(problem%value_of(right%orbit) - problem%value_of(left%orbit))
      ! Where it jumps a little, motions of one side go on beside those of the other for as long.
      s = norm2(right%orbit%u - left%orbit%u)
      if (located .and. s > max(problem%accuracy, 10*problem%resolution)) at%error = s*problem%range
      if (at%label == "GR" .and. at%error > 0.0_wp) at%touches = is_hard(problem%map%by%system%machine, at%contact, 0.0_wp)
   end subroutine find_change

   !> Of a step from a point what is shorter is rounding.
   pure real(wp) function least_width(from) result(width)
      type(point_t), intent(in) :: from

      width = 4*eps*max(1.0_wp, abs(from%orbit%u(size(from%orbit%u))))
   end function least_width

   !> The label of a change of the sequence, from motions on both sides, and the contact.
   subroutine name_change(problem, before, after, label, contact)
      class(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: before, after
      character(2), intent(out) :: label
      integer, intent(out) :: contact

      class(contact_law_t), allocatable :: law
      integer :: i, j
      logical, allocatable :: more(:)

      j = before%sequence%difference(after%sequence)
      contact = j
      label = "CH"
      if (j == 0) return
      law = problem%map%law_of(j)
      associate (old => before%sequence, new => after%sequence)
         more = [(old%changes_to(j, i) /= new%changes_to(j, i), i=1, size(law%branch))]
         if (law%of_normal) then
            label = merge("ST", "SL", more(branch_sticking))
         else if (min(shortest(before, j), shortest(after, j)) < short .or. old%count + new%count == 0 .or. &
                  law%impacts .and. more(law%home) .and. count(more) == 1) then
            ! An impact alone has no length, and goes with its speed.
            label = "GR"
         end if
      end associate

   end subroutine name_change

   !> The function whose root is a special point of this kind; of the first kind a crossing if `along`, about the tangent, is given.
   real(wp) function value_of(problem, orbit, kind, along) result(value)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(in) :: orbit
      integer, intent(in) :: kind
      real(wp), intent(in), optional :: along(:)

      real(wp), allocatable :: alone(:), gap(:), matrix(:, :)
      integer :: i, j

      select case (kind)
      case (1)
         matrix = problem%jacobian(orbit)
         if (present(along)) then
            matrix = bordered(matrix, along)
         else
            matrix = matrix(:, :problem%order())
         end if
         value = determinant(matrix)
      case (2)
         value = real(product(1.0_wp + orbit%multiplier), wp)
      case default
         ! Of a pair at the circle the product is 1; of such as have become real it goes on.
         associate (mu => orbit%multiplier)
            alone = pack(mu%re, abs(mu%im) <= 0.0_wp)
            gap = [1.0_wp - abs(pack(mu, mu%im > 0.0_wp))**2, &
                   ((1.0_wp - alone(i)*alone(j), j=i + 1, size(alone)), i=1, size(alone))]
            value = minval([1.0_wp, abs(gap)])*(-1)**count(gap < 0.0_wp)
         end associate
      end select
   end function value_of

   !> The motion between a and b on a branch at which what vanishes at special points of this kind does (value_of); found where it
   !> has another sign at the one than at the other.
   subroutine find_root(problem, a, b, kind, point, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      integer, intent(in) :: kind
      type(point_t), intent(out) :: point
      logical, intent(out) :: found

      type(bracketed_root_t) :: root
      type(point_t) :: left, right, trial
      real(wp) :: ends(2), value
      real(wp), allocatable :: along(:)
      logical :: crosses

      crosses = .false.
      if (kind == 1) crosses = is_crossing(problem, a, b)
      ends = [value_of(problem, a%orbit, kind), value_of(problem, b%orbit, kind)]
      if (crosses .and. ends(1)*ends(2) > 0.0_wp) then
         along = direction(a, b)
         ends = [value_of(problem, a%orbit, kind, along), value_of(problem, b%orbit, kind, along)]
      end if
      found = ends(1)*ends(2) < 0.0_wp
      if (.not. found) return
      left = a
      right = b
      call root%start(0.0_wp, ends(1), length(a, b), ends(2), 1.0e-15_wp)
      do while (.not. root%done() .and. root%width() > least_width(a))
         call between(problem, a, b, root%trial, trial, found, left, right)
         if (.not. found) return
         if (kind /= 1) call find_multipliers(problem, trial%orbit)
         value = value_of(problem, trial%orbit, kind, along)
         point = trial
         if (value*ends(1) > 0.0_wp) left = trial
         if (value*ends(1) <= 0.0_wp) right = trial
         call root%take(value)
      end do
      ! Where it jumps it has no root.
      found = abs(root%value) <= least_jump*maxval(abs(ends))
      ! The product of two real ones may be 1, too.
      associate (mu => point%orbit%multiplier)
         if (kind == 3) found = found .and. abs(mu(minloc(abs(abs(mu) - 1.0_wp), 1))%im) > 0.0_wp
      end associate
      if (.not. found) return
      if (crosses) call move_to_crossing(problem, a, b, root%best, allocated(along), point, found)
      if (.not. found) return
      call complete(problem, point%orbit, found)
      if (found) call find_tangent(problem, point, a%tangent, found)
      found = found .or. allocated(point%tangent)
   end subroutine find_root

   !> Whether another branch crosses between two points, rather than that the branch turns: with the tangent as a row the
   !> determinant changes its sign, which it does not at a fold, even if the branch begins there.
   logical function is_crossing(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(point_t), intent(in) :: a, b

      real(wp), allocatable :: before(:, :), after(:, :)

      before = bordered(problem%jacobian(a%orbit), a%tangent)
      after = bordered(problem%jacobian(b%orbit), b%tangent)
      is_crossing = (determinant(before) > 0.0_wp) .neqv. (determinant(after) > 0.0_wp)
   end function is_crossing

   !> Where branches cross, at about the length s between two points, from motions on both sides, unless these are rounding: at the
   !> crossing itself the equations are singular, and Newton's method comes to any of them. Where the branch `turns` the parameter
   !> says where: of the determinant its derivative errs.
   subroutine move_to_crossing(problem, a, b, s, turns, point, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      real(wp), intent(in) :: s
      logical, intent(in) :: turns
      type(point_t), intent(inout) :: point
      logical, intent(out) :: found

      type(point_t) :: there(4)
      real(wp) :: h, value(4)
      integer :: i
      integer, parameter :: steps(4) = [-2, -1, 1, 2]

      h = min(merge(aside(2), aside(1), turns)*length(a, b), s/3, (length(a, b) - s)/3)
      do i = 1, 4
         call between(problem, a, b, s + steps(i)*h, there(i), found)
         if (.not. found) return
         value(i) = value_of(problem, there(i)%orbit, 1)
         if (turns) value(i) = there(i)%orbit%u(size(there(i)%orbit%u))
      end do
      ! Steps from where the parabola through all of them turns.
      if (turns) value = steps + 0.3_wp*dot_product(steps, value)/(value(1) - value(2) - value(3) + value(4))
      found = .not. turns
      if (.not. value(2)*value(3) < 0.0_wp .or. .not. all((value(2:) - value(:3))*(value(3) - value(2)) > 0.0_wp)) return
      point%orbit%u = 0.0_wp
      do i = 1, 4
         associate (others => pack(value, [1, 2, 3, 4] /= i))
            point%orbit%u = point%orbit%u + product(others/(others - value(i)))*there(i)%orbit%u
         end associate
      end do
      call problem%evaluate(point%orbit%u, .true., point%orbit, found)
      point%orbit%correction = maxval([(there(i)%orbit%correction, i=1, 4)])
   end subroutine move_to_crossing

end module razy_orbits_branch_special
