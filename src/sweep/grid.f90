!! Grids of one or two parameters: what values the points of a sweep have.
!!
!! Every value is formed from its integer index (first + i step), never accumulated, so a point has the same bits whichever
!! rank computes it and wherever a sweep is taken up again. Points are numbered from 1; the last axis varies fastest.
module razy_sweep_grid
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   implicit none(type, external)
   private

   public :: axis_t, grid_t, new_axis, new_grid

   !> The most points a grid may have.
   integer(i8), parameter, public :: most_points = 1000000000_i8

   !> Values of one parameter. Made by `new_axis`.
   type :: axis_t
      private
      integer(i8), public :: n = 0
      real(wp) :: first = 0.0_wp, last = 0.0_wp, step = 0.0_wp
      logical :: by_step = .false., ends_at_last = .false.
      real(wp), allocatable :: list(:)
   contains
      procedure :: value => axis_value
      procedure :: values => axis_values
   end type axis_t

   !> One or two axes. Made by `new_grid`.
   type :: grid_t
      private
      type(axis_t), allocatable, public :: axes(:)
   contains
      procedure :: n_points
      procedure :: indices => grid_indices
      procedure :: values => grid_values
   end type grid_t

   !> Make an axis from (first, last, step), (first, last, points) or a list of values.
   interface new_axis
      module procedure :: new_axis_by_step, new_axis_by_points, new_axis_by_list
   end interface new_axis

contains

   !> first, first + step, …; the last value is `last` itself if the step divides the range to rounding, otherwise it lies short
   !> of it.
   !>
   !> Errors: a step of zero, of the wrong sign or below resolution, too many points.
   pure subroutine new_axis_by_step(self, first, last, step, error)
      type(axis_t), intent(out) :: self
      real(wp), intent(in) :: first, last, step
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: range, steps, rounding

      range = last - first
      if (step == 0.0_wp) then
         call raise(error, "must not be zero")
      else if (range /= 0.0_wp .and. (range > 0.0_wp .neqv. step > 0.0_wp)) then
         call raise(error, "must have the sign of last - first = "//to_text(range))
      else if (abs(range)/most_points >= abs(step)) then
         call raise(error, "makes more than "//to_text(most_points)//" points")
      else if (abs(step) <= 4*spacing(max(abs(first), abs(last)))) then
         call raise(error, "is lost in the rounding of first and last")
      end if
      if (allocated(error)) return

      self%by_step = .true.
      self%first = first
      self%last = last
      self%step = step
      if (abs(range) < 0.5_wp*abs(step)) then
         self%n = 1
         self%ends_at_last = range == 0.0_wp
         return
      end if
      steps = range/step
      rounding = 4*epsilon(steps)*steps + 2*spacing(max(abs(first), abs(last)))/abs(step)
      self%ends_at_last = abs(steps - anint(steps)) <= min(rounding, 0.25_wp)
      self%n = 1 + merge(nint(steps, i8), floor(steps, i8), self%ends_at_last)
   end subroutine new_axis_by_step

   !> `points` values at equal distances from `first` to `last`, both exact.
   !>
   !> Errors: points below 1 or too many, one point of a range, values that coincide.
   pure subroutine new_axis_by_points(self, first, last, points, error)
      type(axis_t), intent(out) :: self
      real(wp), intent(in) :: first, last
      integer, intent(in) :: points
      type(error_t), allocatable, intent(out) :: error

      if (points < 1 .or. points > most_points) then
         call raise(error, "must be 1 to "//to_text(most_points))
      else if (points == 1 .and. first /= last) then
         call raise(error, "must be at least 2 as first and last differ")
      else if (points > 1) then
         if (abs(last - first)/(points - 1) <= 4*spacing(max(abs(first), abs(last)))) then
            call raise(error, "the values from first to last would coincide")
         end if
      end if
      if (allocated(error)) return
      self%n = points
      self%first = first
      self%last = last
      self%ends_at_last = .true.
   end subroutine new_axis_by_points

   !> The given values, in their order.
   pure subroutine new_axis_by_list(self, values)
      type(axis_t), intent(out) :: self
      real(wp), intent(in) :: values(:)

      self%list = values
      self%n = size(values, kind=i8)
   end subroutine new_axis_by_list

   !> Value number `i` = 1 … n.
   pure real(wp) function axis_value(self, i)
      class(axis_t), intent(in) :: self
      integer(i8), intent(in) :: i

      if (allocated(self%list)) then
         axis_value = self%list(i)
      else if (self%ends_at_last .and. i == self%n) then
         axis_value = self%last
      else if (self%by_step) then
         axis_value = self%first + real(i - 1, wp)*self%step
      else
         axis_value = self%first + (self%last - self%first)*(real(i - 1, wp)/real(self%n - 1, wp))
      end if
   end function axis_value

   !> All values (n).
   pure function axis_values(self) result(values)
      class(axis_t), intent(in) :: self
      real(wp), allocatable :: values(:)
      integer(i8) :: i

      values = [(self%value(i), i=1_i8, self%n)]
   end function axis_values

   !> Make a grid of one or two axes.
   !>
   !> Errors: too many points.
   pure subroutine new_grid(self, axes, error)
      type(grid_t), intent(out) :: self
      type(axis_t), intent(in) :: axes(:)
      type(error_t), allocatable, intent(out) :: error

      if (product(axes%n) > most_points) then
         call raise(error, "the sweep has "//to_text(product(axes%n))//" points: at most "//to_text(most_points)//" are possible")
      else
         self%axes = axes
      end if
   end subroutine new_grid

   !> Number of points.
   pure integer(i8) function n_points(self)
      class(grid_t), intent(in) :: self

      n_points = product(self%axes%n)
   end function n_points

   !> Indices on the axes (axes), each from 1, of point number `point` = 1 … `n_points()`.
   pure function grid_indices(self, point) result(indices)
      class(grid_t), intent(in) :: self
      integer(i8), intent(in) :: point
      integer(i8) :: indices(size(self%axes))
      integer(i8) :: rest
      integer :: axis

      rest = point - 1
      do axis = size(self%axes), 1, -1
         indices(axis) = 1 + mod(rest, self%axes(axis)%n)
         rest = rest/self%axes(axis)%n
      end do
   end function grid_indices

   !> Values of the parameters (axes) at point number `point` = 1 … `n_points()`.
   pure function grid_values(self, point) result(values)
      class(grid_t), intent(in) :: self
      integer(i8), intent(in) :: point
      real(wp) :: values(size(self%axes))
      integer(i8) :: indices(size(self%axes))
      integer :: axis

      indices = self%indices(point)
      values = [(self%axes(axis)%value(indices(axis)), axis=1, size(values))]
   end function grid_values

end module razy_sweep_grid
