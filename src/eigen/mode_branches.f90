!! The modes of a machine over a parameter: each followed by its shape from value to value, through crossings and veerings.
!!
!! A step is taken if every mode keeps its shape (assurance criterion at least `least_overlap`), no two modes change
!! places, meet or part, and what is watched stays what it was; otherwise it is halved, down to `finest` of the range. So
!! modes that veer are told from modes that cross, and both are found where they are, whatever the step asked for: along a
!! branch the frequency is continuous, and at a veering its shape turns into that of the other branch. Veerings narrower
!! than `finest` pass for crossings, and modes that change places and back within one step for modes that do not meet.
!! Where a branch has the value that is looked for, its parameter is found to rounding.
module razy_eigen_mode_branches
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_bracketed_root, only: bracketed_root_t
   use razy_eigen_mode_front, only: change_places, compute_front, family_at, front_t, identify, is_watched, place_of, share_of, &
                                    watch_t
   implicit none(type, external)
   private

   public :: branches_t, follow_branches

   real(wp), parameter :: least_overlap = 0.9_wp, finest = 1.0e-9_wp
   !> Machines that may be computed for each value that is asked for, and in all where there are few.
   integer, parameter :: most_per_value = 60, most_for_few = 20000

   !> The branches, numbered by rising frequency at the start. A point is a value of the parameter with all modes there.
   type :: branches_t
      integer :: points = 0
      !> Parameter (points), ascending once all is followed, and whether it was asked for.
      real(wp), allocatable :: parameter(:)
      logical, allocatable :: asked(:)
      !> λ (branch, point).
      real(wp), allocatable :: value(:, :)
      !> Of the mode watched (points): branch, place in ascending order, strongest coordinate, share of the coordinate looked for
      !> (of the strongest, where a mode is looked for).
      integer, allocatable :: branch(:), place(:), coordinate(:)
      real(wp), allocatable :: share(:)
      !> Where branches have the value looked for (roots): parameter, λ, share as above, branch, whether it is the mode watched.
      real(wp), allocatable :: root(:), root_value(:), root_share(:)
      integer, allocatable :: root_branch(:)
      logical, allocatable :: root_watched(:)
      !> Whether every step could be made fine enough, and how many machines were computed.
      logical :: resolved = .true.
      integer :: machines = 0
      integer, private :: most = 0
      real(wp), private :: resolution = 0.0_wp
   end type branches_t

contains

   !> Follow all modes from `start` over the values `grid` (ascending or descending), in both directions if need be.
   subroutine follow_branches(self, family, context, start, grid, watch, error)
      type(branches_t), intent(out) :: self
      procedure(family_at) :: family
      class(*), intent(inout) :: context
      real(wp), intent(in) :: start, grid(:)
      type(watch_t), intent(in) :: watch
      type(error_t), allocatable, intent(out) :: error

      type(front_t) :: first, front
      real(wp) :: target
      integer :: direction, i, n

      n = size(grid)
      self%most = max(most_for_few, most_per_value*n)
      self%resolution = finest*(max(start, maxval(grid)) - min(start, minval(grid)))
      call make_room(self)
      call compute_front(first, family, context, start, error)
      if (allocated(error)) return
      self%machines = 1
      call identify(first, watch, front)
      call record(self, first, watch, any(.not. abs(grid - start) > 0.0_wp))
      do i = 1, size(first%modes%value)
         if (is_root(first%modes%value(i)/watch%goal - 1)) call add_root(self, first, i, watch)
      end do
      do direction = 1, -1, -2
         front = first
         do i = 1, n
            target = grid(merge(i, n + 1 - i, grid(n) > grid(1) .eqv. direction > 0))
            if (direction*(target - start) > 0.0_wp) call advance(self, family, context, front, target, watch, error)
            if (allocated(error)) return
         end do
         call turn_round(self)
      end do
   end subroutine follow_branches

   !> Follow the modes from `front` to the value `target`, in as many steps as it takes.
   subroutine advance(self, family, context, front, target, watch, error)
      type(branches_t), intent(inout) :: self
      procedure(family_at) :: family
      class(*), intent(inout) :: context
      type(front_t), intent(inout) :: front
      real(wp), intent(in) :: target
      type(watch_t), intent(in) :: watch
      type(error_t), allocatable, intent(out) :: error

      type(front_t) :: next
      real(wp) :: ahead(64), overlap(size(front%modes%value))
      integer :: waiting
      logical :: fine

      ahead(1) = target
      waiting = 1
      do while (waiting > 0)
         call compute_front(next, family, context, ahead(waiting), error, front%modes, overlap)
         if (allocated(error)) return
         self%machines = self%machines + 1
         call identify(next, watch, front)
         fine = minval(overlap) >= least_overlap .and. .not. change_places(front%modes%value, next%modes%value) &
                .and. next%branch == front%branch .and. (next%coordinate == front%coordinate .or. watch%coordinate > 0)
         if (.not. fine .and. abs(next%parameter - front%parameter) > self%resolution .and. waiting < size(ahead)) then
            self%resolved = self%resolved .and. self%machines < self%most
            if (self%resolved) then
               waiting = waiting + 1
               ahead(waiting) = front%parameter + 0.5_wp*(next%parameter - front%parameter)
               cycle
            end if
         end if
         call find_roots(self, family, context, front, next, watch, error)
         if (allocated(error)) return
         call record(self, next, watch, waiting == 1)
         front = next
         waiting = waiting - 1
      end do
   end subroutine advance

   !> Where branches pass through the value looked for between two points.
   subroutine find_roots(self, family, context, front, next, watch, error)
      type(branches_t), intent(inout) :: self
      procedure(family_at) :: family
      class(*), intent(inout) :: context
      type(front_t), intent(in) :: front, next
      type(watch_t), intent(in) :: watch
      type(error_t), allocatable, intent(out) :: error

      type(bracketed_root_t) :: root
      type(front_t) :: trial, best
      real(wp) :: f(2), overlap(size(front%modes%value))
      integer :: b

      do b = 1, size(overlap)
         f = [front%modes%value(b), next%modes%value(b)]/watch%goal - 1
         if (is_root(f(2))) call add_root(self, next, b, watch)
         if (is_root(f(1)) .or. is_root(f(2)) .or. (f(1) < 0.0_wp .eqv. f(2) < 0.0_wp)) cycle
         call root%start(front%parameter, f(1), next%parameter, f(2))
         best = next
         if (abs(f(1)) <= abs(f(2))) best = front
         do while (.not. root%done())
            if (2*abs(root%trial - front%parameter) < abs(next%parameter - front%parameter)) then
               call compute_front(trial, family, context, root%trial, error, front%modes, overlap)
            else
               call compute_front(trial, family, context, root%trial, error, next%modes, overlap)
            end if
            if (allocated(error)) return
            self%machines = self%machines + 1
            call root%take(trial%modes%value(b)/watch%goal - 1)
            if (.not. abs(root%best - trial%parameter) > 0.0_wp) best = trial
         end do
         call add_root(self, best, b, watch)
      end do
   end subroutine find_roots

   !> Whether λ/goal - 1 is zero to rounding.
   pure function is_root(f)
      real(wp), intent(in) :: f
      logical :: is_root

      is_root = abs(f) <= epsilon(1.0_wp)
   end function is_root

   subroutine add_root(self, at, branch, watch)
      type(branches_t), intent(inout) :: self
      type(front_t), intent(in) :: at
      integer, intent(in) :: branch
      type(watch_t), intent(in) :: watch

      self%root = [self%root, at%parameter]
      self%root_value = [self%root_value, at%modes%value(branch)]
      self%root_branch = [self%root_branch, branch]
      self%root_share = [self%root_share, share_of(at, watch, branch)]
      self%root_watched = [self%root_watched, is_watched(at, watch, branch)]
   end subroutine add_root

   pure subroutine make_room(self)
      type(branches_t), intent(inout) :: self

      allocate (self%parameter(0), self%value(0, 0), self%share(0), self%root(0), self%root_value(0), self%root_share(0))
      allocate (self%branch(0), self%coordinate(0), self%place(0), self%root_branch(0), self%asked(0), self%root_watched(0))
   end subroutine make_room

   !> Append a point.
   subroutine record(self, front, watch, asked)
      type(branches_t), intent(inout) :: self
      type(front_t), intent(in) :: front
      type(watch_t), intent(in) :: watch
      logical, intent(in) :: asked

      real(wp), allocatable :: wider(:, :)

      if (size(self%value, 2) <= self%points) then
         allocate (wider(size(front%modes%value), 64 + 2*self%points))
         if (self%points > 0) wider(:, :self%points) = self%value(:, :self%points)
         call move_alloc(wider, self%value)
      end if
      self%points = self%points + 1
      self%value(:, self%points) = front%modes%value
      self%parameter = [self%parameter, front%parameter]
      self%asked = [self%asked, asked]
      self%branch = [self%branch, front%branch]
      self%place = [self%place, place_of(front%modes%value, front%branch)]
      self%coordinate = [self%coordinate, front%coordinate]
      self%share = [self%share, share_of(front, watch, front%branch)]
   end subroutine record

   !> Put the points into the reverse order.
   pure subroutine turn_round(self)
      type(branches_t), intent(inout) :: self

      integer :: n

      n = self%points
      self%parameter = self%parameter(n:1:-1)
      self%asked = self%asked(n:1:-1)
      self%value = self%value(:, n:1:-1)
      self%branch = self%branch(n:1:-1)
      self%place = self%place(n:1:-1)
      self%coordinate = self%coordinate(n:1:-1)
      self%share = self%share(n:1:-1)
   end subroutine turn_round

end module razy_eigen_mode_branches
