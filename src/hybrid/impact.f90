!! The impact of all rigid sides that touch, with the friction that they press, where M = 1.
!!
!! Impulses of gaps act in their directions d_i = ±w_i, those of friction in w_k; with u⁻ the speeds before, y'⁺ = y'⁻ + D λ and
!! the impulses λ obey the laws of Newton, Moreau and Coulomb (razy_linalg_complementarity_impact). A finite friction force gives
!! no impulse: only friction pressed by a side that touches takes part.
module razy_hybrid_impact
   use razy_contact_friction_law, only: branch_forward, branch_sticking
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: set_up, side_t
   use razy_linalg_complementarity_friction, only: solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t, impulse_bound
   use razy_linalg_dense, only: identity
   use razy_linalg_lapack, only: dgesv
   use razy_machine_machine, only: contact_t
   implicit none(type, external)
   private

   public :: are_jammed, coefficient, impact_derivative_t, push_apart, strike

   !> How the change of y' depends on the speeds u before the impact of gaps and of the friction that takes part.
   type :: impact_derivative_t
      !> Contacts, signs of their s in u, and directions D (m, directions).
      integer, allocatable :: contact(:)
      real(wp), allocatable :: sign(:), direction(:, :)
      !> D dλ/du (m, directions), and whether it exists.
      real(wp), allocatable :: effect(:, :)
      logical :: defined = .true.
   end type impact_derivative_t

   !> Friction whose impulse is closer to its bound slides.
   real(wp), parameter :: sticking = 1.0e-9_wp
   !> What is rounding of a part of a direction, in parts of its square.
   real(wp), parameter :: none_left = 1.0e-12_wp

contains

   !> Speeds `after` of the sides that touch, of which those numbered `who` take part and some are `jammed` (sides), and the change
   !> of y' (m), for the directions `w` (m, contacts) and s' before, `rate` (contacts), with its rounding. Not `found`: no impulses
   !> obey the laws. The room of `problem` is used again. With `derivative`, that of the change; the actual argument may be
   !> unallocated.
   subroutine strike(contact, w, rate, noise_rate, side, who, jammed, problem, change, found, derivative)
      type(contact_t), intent(in) :: contact(:)
      real(wp), intent(in) :: w(:, :), rate(:), noise_rate(:)
      type(side_t), intent(inout) :: side(:)
      integer, intent(in) :: who(:)
      logical, intent(in) :: jammed(:)
      type(impact_problem_t), intent(inout) :: problem
      real(wp), intent(out) :: change(:)
      logical, intent(out) :: found
      type(impact_derivative_t), intent(inout), optional :: derivative

      real(wp) :: impulses(size(who) + size(contact))
      integer :: sliding(size(contact)), i, k, n

      n = size(who)
      k = 0
      do i = 1, size(contact)
         if (.not. contact(i)%law%of_normal .or. all(side(who)%contact /= contact(i)%normal_of)) cycle
         k = k + 1
         sliding(k) = i
      end do
      associate (friction => sliding(:k), impulse => impulses(:n + k))
         call set_up(w, side(who), friction, problem)
         problem%before = side(who)%before
         problem%drift(:n) = side(who)%before
         problem%drift(n + 1:) = rate(friction)
         do i = 1, n
            ! Between what is jammed impacts follow each other in no time.
            problem%restitution(i) = merge(0.0_wp, contact(side(who(i))%contact)%law%restitution, jammed(who(i)))
            do k = 1, size(friction)
               problem%coefficient(k, i) = merge(coefficient(contact(friction(k)), rate(friction(k)), noise_rate(friction(k))), &
                                                 0.0_wp, contact(friction(k))%normal_of == side(who(i))%contact)
            end do
         end do
         call solve_impact(problem, impulse, found)
         change = 0.0_wp
         if (.not. found) return
         change = matmul(problem%direction, impulse)
         do i = 1, size(side)
            side(i)%after = side(i)%before + side(i)%direction*dot_product(w(:, side(i)%contact), change)
            if (abs(side(i)%after) <= noise_rate(side(i)%contact)) side(i)%after = 0.0_wp
            side(i)%candidate = .not. side(i)%after > 0.0_wp
         end do
         ! Newton's law, of the speeds as they are now.
         found = all(side(who)%after + problem%restitution*problem%before >= -noise_rate(side(who)%contact) - &
                     sqrt(epsilon(1.0_wp))*maxval(abs(problem%drift)))
         if (.not. (found .and. present(derivative))) return
         derivative%contact = [side(who)%contact, friction]
         derivative%sign = [side(who)%direction, (1.0_wp, k=1, size(friction))]
         derivative%direction = problem%direction
         call differentiate(problem, impulse, derivative)
      end associate
   end subroutine strike

   !> Sides that cannot open without closing another: the direction of each is a sum of the others' with weights below 0, so that of
   !> the motions that close none the one next to it is 0. Facing sides are, and those of a row of bodies between two walls.
   function are_jammed(w, side) result(jammed)
      real(wp), intent(in) :: w(:, :)
      type(side_t), intent(in) :: side(:)
      logical :: jammed(size(side))

      type(impact_problem_t) :: problem
      real(wp) :: impulse(size(side))
      integer :: i
      logical :: found

      jammed = .false.
      if (size(side) == 1) return
      call set_up(w, side, [integer ::], problem)
      do i = 1, size(side)
         problem%drift = problem%delassus(:, i)
         call solve_impact(problem, impulse, found)
         jammed(i) = problem%drift(i) + dot_product(problem%drift, impulse) <= none_left*problem%drift(i)
      end do
   end function are_jammed

   !> D dλ/du with the sides that have an impulse, and the friction that sticks, as they are; the coefficients of friction do not
   !> change. Not `defined`: impulses that are not unique.
   subroutine differentiate(problem, impulse, derivative)
      type(impact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: impulse(:)
      type(impact_derivative_t), intent(inout) :: derivative

      real(wp), dimension(size(impulse), size(impulse)) :: left, right
      integer :: i, info, n, pivot(size(impulse))

      n = size(problem%before)
      left = identity(size(impulse))
      right = 0.0_wp
      do i = 1, size(impulse)
         if (i <= n) then
            if (.not. impulse(i) > 0.0_wp) cycle
            ! u⁺ + ε u⁻ = 0
            left(i, :) = problem%delassus(i, :)
            right(i, i) = -(1.0_wp + problem%restitution(i))
         else if (abs(impulse(i)) < (1.0_wp - sticking)*impulse_bound(problem, i - n, impulse)) then
            left(i, :) = problem%delassus(i, :)
            right(i, i) = -1.0_wp
         else
            left(i, :n) = -sign(1.0_wp, impulse(i))*problem%coefficient(i - n, :)
         end if
      end do
      call dgesv(size(impulse), size(impulse), left, size(impulse), pivot, right, size(impulse), info)
      derivative%defined = info == 0
      if (info /= 0) right = 0.0_wp
      derivative%effect = matmul(derivative%direction, right)
   end subroutine differentiate

   !> Coefficient of friction at the sliding speed it has: the static one if that is rounding.
   pure function coefficient(friction, rate, noise_rate) result(mu)
      type(contact_t), intent(in) :: friction
      real(wp), intent(in) :: rate, noise_rate
      real(wp) :: mu

      mu = friction%law%branch(branch_sticking)%force_guard%upper
      if (abs(rate) > noise_rate) mu = friction%law%force(branch_forward, 0.0_wp, abs(rate), 1.0_wp)
   end function coefficient

   !> The shortest change of y (m) that leaves none of the sides closed by more than rounding, for s (contacts) as it is; `moved`
   !> tells whether one is needed. Not `found`: there is none.
   subroutine push_apart(w, s, noise_s, side, change, moved, found)
      real(wp), intent(in) :: w(:, :), s(:), noise_s(:)
      type(side_t), intent(in) :: side(:)
      real(wp), intent(out) :: change(:)
      logical, intent(out) :: moved, found

      type(impact_problem_t) :: problem
      real(wp) :: shift(size(side))

      change = 0.0_wp
      found = .true.
      call set_up(w, side, [integer ::], problem)
      problem%drift = side%direction*(s(side%contact) - side%edge)
      moved = any(problem%drift < -noise_s(side%contact))
      if (.not. moved) return
      call solve_impact(problem, shift, found)
      if (found) change = matmul(problem%direction, shift)
   end subroutine push_apart

end module razy_hybrid_impact
