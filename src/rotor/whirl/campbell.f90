!! The Campbell diagram: eigenvalues over the speed, each followed by its shape, and where lines of excitation cross them.
!!
!! Eigenvalues of neighbouring speeds belong together if their shapes do (`whirl_match`). Where shapes change too much for that,
!! the interval is halved. Critical speeds are looked for on all branches, also on those beyond the modes asked for.
module razy_rotor_whirl_campbell
   use razy_core_kinds, only: wp
   use razy_rotor_whirl_critical, only: critical_t, crossing_t, in_order, locate
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_whirl, only: whirl_direction, whirl_found, whirl_problem_t, whirl_t
   use razy_rotor_whirl_whirl_match, only: equal_shapes, match
   implicit none(type, external)
   private

   public :: campbell_t, new_campbell

   !> Intervals are halved so often at most, for modes beyond those asked for less often.
   integer, parameter :: most_halvings = 10, halvings_beyond = 2

   !> Eigenvalues (modes, speeds) with Im >= 0 in the order of their imaginary parts, 1/s and rad/s; the branch that each belongs
   !> to; the direction of its orbits, see `whirl_direction`. Modes that a speed does not have are 0 in `branch`.
   type :: campbell_t
      integer :: status = whirl_found
      real(wp), allocatable :: speed(:)
      complex(wp), allocatable :: value(:, :)
      integer, allocatable :: branch(:, :)
      real(wp), allocatable :: direction(:, :)
      !> The largest real part of all eigenvalues, 1/s (speeds).
      real(wp), allocatable :: growth(:)
      type(critical_t), allocatable :: critical(:)
      !> Crossings that were seen but not located, because shapes changed too much.
      integer :: lost = 0
      !> Speeds at which an eigenproblem was solved.
      integer :: solved = 0
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
      integer :: modes = 0, branches = 0, lost = 0, solved = 0
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
      allocate (diagram%direction(modes, size(speed)), diagram%growth(size(speed)), source=0.0_wp)
      do k = 1, size(speed)
         if (allocated(front%branch)) deallocate (front%branch)
         front%speed = speed(k)
         front%whirl = problem%solve(speed(k), circulatory, shapes=.false.)
         walk%solved = walk%solved + 1
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
            diagram%direction(i, k) = whirl_direction(model, problem%shape_of(front%whirl%modal(:, i)))
         end do
         diagram%growth(k) = maxval(front%whirl%value%re)
         before = front
      end do
      diagram%critical = in_order(walk%critical)
      diagram%lost = walk%lost
      diagram%solved = walk%solved
   end function new_campbell

   !> The branches of `front`, from those of `before`, over speeds between as far as shapes change too much.
   recursive subroutine advance(walk, problem, model, before, front, halvings)
      type(walk_t), intent(inout) :: walk
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      type(front_t), intent(in) :: before
      type(front_t), intent(inout) :: front
      integer, intent(in) :: halvings

      type(front_t) :: middle
      integer :: i, known, partner(size(front%whirl%value))

      call match(before%whirl, front%whirl, partner)
      if (any(partner == 0 .and. halvings > spared(walk, before%speed, front))) then
         middle%speed = before%speed + (front%speed - before%speed)/2
         middle%whirl = problem%solve(middle%speed, walk%circulatory, shapes=.false.)
         walk%solved = walk%solved + 1
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
      known = size(walk%critical) + walk%lost
      do i = 1, size(partner)
         if (partner(i) > 0) then
            front%branch(i) = before%branch(partner(i))
            call cross(walk, problem, model, before, partner(i), front, i)
         else
            walk%branches = walk%branches + 1
            front%branch(i) = walk%branches
         end if
      end do
      walk%lost = walk%lost + unseen(walk, before, front, size(walk%critical) + walk%lost - known)
   end subroutine advance

   !> Halvings that are left undone where an eigenvalue has no partner: none for the modes asked for, most for those beyond that a
   !> line of excitation can cross on the way, all for others.
   pure function spared(walk, start, front)
      type(walk_t), intent(in) :: walk
      real(wp), intent(in) :: start
      type(front_t), intent(in) :: front
      integer :: spared(size(front%whirl%value))

      integer :: i

      spared = most_halvings
      if (size(walk%order) > 0) then
         where (front%whirl%value%im >= minval(walk%order)*start .and. front%whirl%value%im <= maxval(walk%order)*front%speed)
            spared = most_halvings - halvings_beyond
         end where
      end if
      do i = 1, min(walk%modes, size(spared))
         spared(i) = 0
      end do
   end function spared

   !> Crossings that no branch shows: what the numbers of eigenvalues above the lines of excitation have changed by more than by the
   !> `seen` crossings.
   pure integer function unseen(walk, before, front, seen)
      type(walk_t), intent(in) :: walk
      type(front_t), intent(in) :: before, front
      integer, intent(in) :: seen

      integer :: k

      unseen = -seen
      do k = 1, size(walk%order)
         unseen = unseen + abs(count(before%whirl%value%im > walk%order(k)*before%speed) &
                               - count(front%whirl%value%im > walk%order(k)*front%speed))
      end do
      unseen = max(unseen, 0)
   end function unseen

   !> Add the critical speeds between eigenvalue `i` of `before` and `j` of `front`.
   subroutine cross(walk, problem, model, before, i, front, j)
      type(walk_t), intent(inout) :: walk
      type(whirl_problem_t), intent(in) :: problem
      type(rotor_model_t), intent(in) :: model
      type(front_t), intent(in) :: before, front
      integer, intent(in) :: i, j

      type(crossing_t) :: crossing
      type(critical_t) :: critical
      logical :: found
      integer :: k

      do k = 1, size(walk%order)
         crossing%order = walk%order(k)
         crossing%speed = [before%speed, front%speed]
         crossing%value = [before%whirl%value(i), front%whirl%value(j)]
         if (.not. crossing%there()) cycle
         crossing%left_shape = before%whirl%modal(:, i)
         crossing%right_shape = front%whirl%modal(:, j)
         crossing%left = equal_shapes(before%whirl, i)
         crossing%right = equal_shapes(front%whirl, j)
         call locate(critical, found, problem, model, walk%circulatory, crossing)
         critical%branch = before%branch(i)
         if (found) then
            walk%critical = [walk%critical, critical]
         else
            walk%lost = walk%lost + 1
         end if
      end do
   end subroutine cross

end module razy_rotor_whirl_campbell
