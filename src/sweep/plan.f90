!! Which points of a sweep are still to be computed, and how they are handed out: one by one, or as chains.
!!
!! Points are numbered in the order of the grid (razy_sweep_grid), the last axis fastest; with several starts all points of the
!! first start come before those of the second, and with two directions all points of the first direction before those of the
!! second. A chain runs along the first axis, up or down: there is one for each value of the second axis, each start and each
!! direction. What is handed out is a unit: a point that is missing, or the rest of a chain.
module razy_sweep_plan
   use razy_core_kinds, only: i8
   implicit none(type, external)
   private

   public :: plan_t, new_plan

   !> Made by `new_plan`; all points are missing until `mark_done`. `units` and what follows are valid after `close`.
   type :: plan_t
      !> Values on the first axis and on the second (1 if there is none).
      integer(i8) :: first_axis = 0, second_axis = 1
      !> +1 (up) or -1 (down) for each direction; empty if each point stands alone.
      integer, allocatable :: directions(:)
      !> Initial states of each grid point.
      integer(i8) :: starts = 1
      !> Points in all, and those that are done.
      integer(i8) :: points = 0, n_done = 0
      logical, allocatable :: done(:)
      !> Missing points as runs: first of each, and missing points before it. (runs)
      integer(i8), allocatable :: run_first(:), run_before(:)
      !> Chains that are not complete, and the links of each that are done. (units)
      integer(i8), allocatable :: chain(:), reached(:)
   contains
      procedure :: has_chains
      procedure :: mark_done
      procedure :: close => close_plan
      procedure :: units
      procedure :: point_of_unit
      procedure :: point_of_link
      procedure :: direction_of
      procedure :: grid_point
      procedure :: start_of
      procedure, private :: close_chains
      procedure, private :: close_runs
   end type plan_t

contains

   !> The plan of a sweep of which nothing is done.
   subroutine new_plan(self, first_axis, second_axis, directions, starts)
      type(plan_t), intent(out) :: self
      integer(i8), intent(in) :: first_axis, second_axis
      integer, intent(in) :: directions(:)
      integer(i8), intent(in), optional :: starts

      self%first_axis = first_axis
      self%second_axis = second_axis
      self%directions = directions
      if (present(starts)) self%starts = starts
      self%points = first_axis*second_axis*self%starts*max(1, size(directions))
      allocate (self%done(self%points), source=.false.)
   end subroutine new_plan

   !> Whether the end of a point is the start of another.
   pure logical function has_chains(self)
      class(plan_t), intent(in) :: self

      has_chains = size(self%directions) > 0
   end function has_chains

   !> A point is done; `fresh` is false if it was already, or if there is no such point.
   pure subroutine mark_done(self, point, fresh)
      class(plan_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      logical, intent(out) :: fresh

      fresh = point >= 1 .and. point <= self%points
      if (fresh) fresh = .not. self%done(point)
      if (.not. fresh) return
      self%done(point) = .true.
      self%n_done = self%n_done + 1
   end subroutine mark_done

   !> No more points will be marked before the units are handed out. `whole` is false if a chain has a gap.
   pure subroutine close_plan(self, whole)
      class(plan_t), intent(inout) :: self
      logical, intent(out) :: whole

      whole = .true.
      if (self%has_chains()) then
         call self%close_chains(whole)
      else
         call self%close_runs()
      end if
   end subroutine close_plan

   !> Find the chains that are not complete.
   pure subroutine close_chains(self, whole)
      class(plan_t), intent(inout) :: self
      logical, intent(out) :: whole

      integer(i8), allocatable :: reached(:)
      integer(i8) :: chain, link, n
      logical :: done

      n = self%second_axis*self%starts*size(self%directions)
      allocate (reached(n), source=0_i8)
      whole = .true.
      do chain = 1, n
         do link = 1, self%first_axis
            done = self%done(self%point_of_link(chain, link))
            if (done .and. reached(chain) < link - 1) whole = .false.
            if (done) reached(chain) = link
         end do
      end do
      self%chain = pack([(chain, chain=1, n)], reached < self%first_axis)
      self%reached = pack(reached, reached < self%first_axis)
   end subroutine close_chains

   !> Find the runs of missing points.
   pure subroutine close_runs(self)
      class(plan_t), intent(inout) :: self

      integer(i8), allocatable :: last(:)
      integer(i8) :: point, run

      self%run_first = pack([(point, point=1, self%points)],.not. self%done .and. eoshift(self%done, -1, .true.))
      last = pack([(point, point=1, self%points)],.not. self%done .and. eoshift(self%done, 1, .true.))
      self%run_before = 0*last
      do run = 2, size(last, kind=i8)
         self%run_before(run) = self%run_before(run - 1) + last(run - 1) - self%run_first(run - 1) + 1
      end do
   end subroutine close_runs

   !> Number of units to hand out.
   pure integer(i8) function units(self)
      class(plan_t), intent(in) :: self

      if (self%has_chains()) then
         units = size(self%chain, kind=i8)
      else
         units = self%points - self%n_done
      end if
   end function units

   !> The missing point number `unit`, where each point stands alone.
   pure integer(i8) function point_of_unit(self, unit) result(point)
      class(plan_t), intent(in) :: self
      integer(i8), intent(in) :: unit

      integer(i8) :: run

      run = count(self%run_before < unit, kind=i8)
      point = self%run_first(run) + (unit - self%run_before(run) - 1)
   end function point_of_unit

   !> The point that is link number `link` of a chain.
   pure integer(i8) function point_of_link(self, chain, link) result(point)
      class(plan_t), intent(in) :: self
      integer(i8), intent(in) :: chain, link

      integer(i8) :: along, block, direction

      block = (chain - 1)/self%second_axis
      direction = 1 + block/self%starts
      along = merge(self%first_axis + 1 - link, link, self%directions(direction) < 0)
      point = block*self%first_axis*self%second_axis + (along - 1)*self%second_axis &
              + 1 + modulo(chain - 1, self%second_axis)
   end function point_of_link

   !> Direction of a point: +1, -1, or 0 if each point stands alone.
   pure integer function direction_of(self, point)
      class(plan_t), intent(in) :: self
      integer(i8), intent(in) :: point

      direction_of = 0
      if (self%has_chains()) direction_of = self%directions(1 + (point - 1)/(self%first_axis*self%second_axis*self%starts))
   end function direction_of

   !> Number of a point in the grid, from 1, whatever its direction and start.
   pure integer(i8) function grid_point(self, point)
      class(plan_t), intent(in) :: self
      integer(i8), intent(in) :: point

      grid_point = 1 + modulo(point - 1, self%first_axis*self%second_axis)
   end function grid_point

   !> Number of the start of a point, from 1.
   pure integer(i8) function start_of(self, point)
      class(plan_t), intent(in) :: self
      integer(i8), intent(in) :: point

      start_of = 1 + modulo((point - 1)/(self%first_axis*self%second_axis), self%starts)
   end function start_of

end module razy_sweep_plan
