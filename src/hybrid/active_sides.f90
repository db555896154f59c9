!! Sides of rigid contacts that touch, which of them stay closed, and which friction that rests goes on sticking.
!!
!! A law with impacts has one or two edges of s, the bounds of its first switching function in the branch open; the gap of a side
!! is direction (s - edge). Nothing here knows how the motion is followed: s, s' and s'' are arguments.
!!
!! With the directions D of the candidates (M = 1) and the accelerations s'' that they would have without constraint forces, gaps
!! obey 0 <= λ ⟂ s'' >= 0, and friction |λ_k| <= μ_s N_k, with s'' = 0 inside the bounds. A friction element k that slides under
!! a candidate i adds -φ_k λ_i w_k to the forces, so column i of the matrix is Dᵀ(d_i - φ_k w_k): it is not symmetric.
!!
!! `assume` sets the branches with all candidates closed and sticking; the caller forms the accelerations for these, and
!! `choose` corrects the branches. There μ_s is the coefficient of what begins to slide too. Where the kinetic one is smaller, that
!! is not the force that it slides with, and others that `choose` lets slide may stick: the elements that `choose` calls `loose`
!! are to slide with their own force, and the rest to be decided again without them.
module razy_hybrid_active_sides
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_linalg_complementarity_friction, only: solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   use razy_machine_machine, only: contact_t
   implicit none(type, external)
   private

   public :: assume, choose, either_way, find_sides, on_limit, set_up, side_t, weakens

   !> A side that touches: contact, branch when closed, direction of its gap in s, edge, speed of the gap before the event, before
   !> its impact and after it, whether it is a candidate for a constraint: it does not open, and was not let go of as its force came
   !> to 0; whether force and acceleration are both 0; whether it was closed before.
   type :: side_t
      integer :: contact = 0, closed = 0
      real(wp) :: direction = 0.0_wp, edge = 0.0_wp, first = 0.0_wp, before = 0.0_wp, after = 0.0_wp
      logical :: candidate = .false., tied = .false., held = .false.
   end type side_t

   !> Smaller accelerations, in parts of the largest term, are rounding; so are differences of friction from its limit, in parts of
   !> that, to which forces are found at least.
   real(wp), parameter :: rounding = 1.0e4_wp*epsilon(1.0_wp), on_limit = 1.0e-9_wp
   !> Of friction that nothing presses yet: it may begin to slide forward or backward.
   integer, parameter :: either_way = 2

contains

   !> The first `count` of `side` (two a contact): all sides that were closed in `branch` (contacts), whose edge was `left` (lower
   !> and upper one; 2, contacts), or whose gap is not above the rounding of s; speeds below the rounding of s' are 0. Those that
   !> were closed are no candidates if their contact was `let_go` (contacts).
   subroutine find_sides(contact, s, rate, noise_s, noise_rate, branch, left, let_go, side, count)
      type(contact_t), intent(in) :: contact(:)
      real(wp), intent(in) :: s(:), rate(:), noise_s(:), noise_rate(:)
      integer, intent(in) :: branch(:)
      logical, intent(in) :: left(:, :), let_go(:)
      type(side_t), intent(inout) :: side(:)
      integer, intent(out) :: count

      integer :: j

      count = 0
      do j = 1, size(contact)
         if (.not. contact(j)%law%impacts) cycle
         associate (open => contact(j)%law%branch(branch_open)%guard(1))
            if (open%below /= 0) call look_at_side(j, open%below, 1.0_wp, open%lower, left(1, j))
            if (open%above /= 0) call look_at_side(j, open%above, -1.0_wp, open%upper, left(2, j))
         end associate
      end do

   contains

      subroutine look_at_side(j, closed, direction, edge, left)
         integer, intent(in) :: j, closed
         real(wp), intent(in) :: direction, edge
         logical, intent(in) :: left

         real(wp) :: speed

         if (.not. (left .or. branch(j) == closed .or. direction*(s(j) - edge) <= noise_s(j))) return
         ! Where a flight ends as it begins, both are rounding.
         speed = merge(direction*rate(j), 0.0_wp, abs(rate(j)) > noise_rate(j) .and. .not. (left .and. direction*rate(j) > 0.0_wp))
         count = count + 1
         side(count) = side_t(j, closed, direction, edge, speed, speed, speed, held=branch(j) == closed, &
                              candidate=.not. (speed > 0.0_wp .or. (let_go(j) .and. branch(j) == closed)))
      end subroutine look_at_side

   end subroutine find_sides

   !> Branches (contacts) with all candidates among the sides closed, other rigid contacts that the event has `stirred` open, and
   !> `resting` friction sticking.
   pure subroutine assume(contact, side, resting, stirred, branch)
      type(contact_t), intent(in) :: contact(:)
      type(side_t), intent(in) :: side(:)
      logical, intent(in) :: resting(:), stirred(:)
      integer, intent(inout) :: branch(:)

      integer :: i

      do i = 1, size(branch)
         if (contact(i)%law%impacts .and. stirred(i)) branch(i) = branch_open
         if (resting(i)) branch(i) = branch_sticking
      end do
      do i = size(side), 1, -1
         if (side(i)%candidate) branch(side(i)%contact) = side(i)%closed
      end do
   end subroutine assume

   !> Correct the branches of `assume` by the accelerations `second_rate`, s'' (contacts) with all forces but those of
   !> candidates. `normal` (contacts) is the normal force of friction without that of candidates, `per_normal` the force F of
   !> friction that slides under a unit of it, else 0; accelerations below `noise` (contacts) are rounding. `loose`
   !> (contacts): of the elements that begin to slide with less than the force of sticking those that do so fastest. Sides are
   !> `tied` whose force and acceleration are both 0, and friction whose force is on its limit while it does not slide: +1 where it
   !> would slide forward, -1 backward, `either_way` where nothing presses it yet, else 0; in `branch` they are held.
   !> Not `found`: no forces obey the laws.
   subroutine choose(contact, w, side, resting, second_rate, noise, normal, per_normal, branch, loose, tied, found)
      type(contact_t), intent(in) :: contact(:)
      real(wp), intent(in) :: w(:, :), second_rate(:), noise(:), normal(:), per_normal(:)
      type(side_t), intent(inout) :: side(:)
      logical, intent(in) :: resting(:)
      integer, intent(inout) :: branch(:)
      logical, intent(out) :: loose(:), found
      integer, intent(out) :: tied(:)

      real(wp), allocatable :: forces(:), least(:), speed(:), u(:)
      integer, allocatable :: sides(:), tangent(:)
      type(impact_problem_t) :: problem
      real(wp) :: bound
      integer :: i, k, n
      logical :: pressed

      loose = .false.
      tied = 0
      side%tied = .false.
      sides = pack([(i, i=1, size(side))], side%candidate)
      tangent = pack([(i, i=1, size(resting))], resting)
      n = size(sides)
      call set_up(w, side(sides), tangent, problem)
      problem%drift = [side(sides)%direction*second_rate(side(sides)%contact), second_rate(tangent)]
      ! Forces of what is rounding alone are not found to rounding of themselves.
      where (abs(problem%drift) <= noise([side(sides)%contact, tangent])) problem%drift = 0.0_wp
      call press_friction(contact, w, side(sides), tangent, normal, per_normal, problem)
      allocate (forces(n + size(tangent)))
      call solve_impact(problem, forces, found)
      if (.not. found) return
      u = problem%drift + matmul(problem%delassus, forces)
      least = noise([side(sides)%contact, tangent]) &
              + rounding*(maxval(abs(problem%drift)) + maxval(matmul(abs(problem%delassus), abs(forces))))
      do i = n, 1, -1
         associate (this => side(sides(i)))
            if (u(i) > least(i)) then
               if (branch(this%contact) == this%closed) branch(this%contact) = branch_open
            else
               this%tied = .not. forces(i)*problem%delassus(i, i) > least(i)
            end if
            if (forces(i) > 0.0_wp .and. .not. this%tied) branch(this%contact) = this%closed
         end associate
      end do
      allocate (speed(size(tangent)), source=0.0_wp)
      do k = 1, size(tangent)
         bound = impulse_bound(problem, k, forces)
         pressed = bound*problem%delassus(n + k, n + k) > least(n + k)
         ! What is far from its limit sticks, however well its force was found.
         if (pressed .and. abs(forces(n + k)) < (1.0_wp - on_limit)*bound) cycle
         if (abs(u(n + k)) <= least(n + k)) then
            tied(tangent(k)) = merge(merge(1, -1, forces(n + k) < 0.0_wp), either_way, pressed)
            cycle
         end if
         branch(tangent(k)) = merge(branch_forward, branch_backward, u(n + k) > 0.0_wp)
         if (weakens(contact(tangent(k)), branch(tangent(k)))) speed(k) = abs(u(n + k))/norm2(w(:, tangent(k)))
      end do
      loose(tangent) = speed > 0.0_wp .and. speed >= (1.0_wp - on_limit)*maxval(speed)
   end subroutine choose

   !> Whether friction that begins to slide into `branch` acts with less than it can stick with.
   pure function weakens(friction, branch)
      type(contact_t), intent(in) :: friction
      integer, intent(in) :: branch
      logical :: weakens

      associate (law => friction%law)
         weakens = abs(law%force(branch, 0.0_wp, 0.0_wp, 1.0_wp)) < law%branch(branch_sticking)%force_guard%upper
      end associate
   end function weakens

   !> The problem of impulses or forces in the directions of sides and of the contacts `tangent`, with these and its Delassus
   !> matrix; what else it needs is for the caller to say, and 0 in a problem that is new. Room that fits is used again.
   pure subroutine set_up(w, side, tangent, problem)
      real(wp), intent(in) :: w(:, :)
      type(side_t), intent(in) :: side(:)
      integer, intent(in) :: tangent(:)
      type(impact_problem_t), intent(inout) :: problem

      integer :: i, j

      associate (n => size(side), t => size(tangent))
         if (allocated(problem%direction)) then
            if (any([shape(problem%direction), size(problem%before)] /= [size(w, 1), n + t, n])) problem = impact_problem_t()
         end if
         if (.not. allocated(problem%direction)) then
            allocate (problem%direction(size(w, 1), n + t), problem%delassus(n + t, n + t), problem%drift(n + t), &
                      problem%before(n), problem%restitution(n), problem%coefficient(t, n), problem%limit(t), source=0.0_wp)
         end if
         do i = 1, n
            problem%direction(:, i) = side(i)%direction*w(:, side(i)%contact)
         end do
         problem%direction(:, n + 1:) = w(:, tangent)
      end associate
      do i = 1, size(problem%direction, 2)
         do j = 1, i
            problem%delassus(j, i) = dot_product(problem%direction(:, j), problem%direction(:, i))
            problem%delassus(i, j) = problem%delassus(j, i)
         end do
      end do
   end subroutine set_up

   !> Add the friction that slides or sticks under the candidate sides to the problem of their accelerations.
   pure subroutine press_friction(contact, w, side, tangent, normal, per_normal, problem)
      type(contact_t), intent(in) :: contact(:)
      real(wp), intent(in) :: w(:, :), normal(:), per_normal(:)
      type(side_t), intent(in) :: side(:)
      integer, intent(in) :: tangent(:)
      type(impact_problem_t), intent(inout) :: problem

      integer :: i, j, k

      do i = 1, size(side)
         do j = 1, size(contact)
            if (contact(j)%normal_of /= side(i)%contact .or. .not. abs(per_normal(j)) > 0.0_wp) cycle
            problem%delassus(:, i) = problem%delassus(:, i) - per_normal(j)*matmul(w(:, j), problem%direction)
         end do
      end do
      do k = 1, size(tangent)
         associate (friction => contact(tangent(k)), mu => contact(tangent(k))%law%branch(branch_sticking)%force_guard%upper)
            problem%limit(k) = mu*max(0.0_wp, normal(tangent(k)))
            problem%coefficient(k, :) = merge(mu, 0.0_wp, side%contact == friction%normal_of)
         end associate
      end do
   end subroutine press_friction

end module razy_hybrid_active_sides
