!! Tuning: the parameter with which a mode has a given natural frequency (4.91).
!!
!! The mode is the one with the greatest share of a coordinate, whatever its place in order, or the continuation of the mode with a
!! given number. Of several values the one nearest to the start is taken.
module razy_eigen_tuning
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_eigen_mode_branches, only: branches_t, follow_branches
   use razy_eigen_mode_front, only: family_at, watch_t
   use razy_eigen_modes, only: hertz
   implicit none(type, external)
   private

   public :: attainable, change_t, changes, objective, tune, tuning_t

   !> The answer. Without one, `found` is false and the rest says nothing.
   type :: tuning_t
      logical :: found = .false.
      !> The parameter, the natural frequency with it (Hz), and the share of the coordinate in the mode.
      real(wp) :: parameter = 0.0_wp, frequency = 0.0_wp, share = 0.0_wp
      !> The branch of the mode, and how many values there are besides.
      integer :: branch = 0, others = 0
   end type tuning_t

   !> What becomes of the mode between two neighbouring points `parameter`.
   type :: change_t
      real(wp) :: parameter(2) = 0.0_wp
      !> Before and after: place in ascending order, branch, strongest coordinate, frequency (Hz).
      integer :: place(2) = 0, branch(2) = 0, coordinate(2) = 0
      real(wp) :: frequency(2) = 0.0_wp
   end type change_t

contains

   !> Look for `frequency` (Hz) over the values `grid`; `coordinate` 0 means mode number `mode` with the parameter `start`.
   subroutine tune(self, branches, family, context, start, grid, coordinate, mode, frequency, error)
      type(tuning_t), intent(out) :: self
      type(branches_t), intent(out) :: branches
      procedure(family_at) :: family
      class(*), intent(inout) :: context
      real(wp), intent(in) :: start, grid(:), frequency
      integer, intent(in) :: coordinate, mode
      type(error_t), allocatable, intent(out) :: error

      logical, allocatable :: fit(:)
      integer :: i

      call follow_branches(branches, family, context, start, grid, watch_t(coordinate, mode, (2*pi*frequency)**2), error)
      if (allocated(error)) return
      fit = branches%root_watched .and. branches%root >= minval(grid) .and. branches%root <= maxval(grid)
      if (.not. any(fit)) return
      i = minloc(abs(branches%root - start), dim=1, mask=fit)
      self = tuning_t(.true., branches%root(i), hertz(branches%root_value(i)), branches%root_share(i), branches%root_branch(i), &
                      count(fit) - 1)
   end subroutine tune

   !> ψ = (1 - f/goal)² (4.91) of the mode watched at each point.
   pure function objective(branches, goal) result(psi)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: goal
      real(wp) :: psi(branches%points)

      integer :: i

      psi = [((1 - hertz(branches%value(branches%branch(i), i))/goal)**2, i=1, branches%points)]
   end function objective

   !> The frequencies (2, intervals) that the mode takes within the range, Hz, each from least to greatest.
   pure function attainable(branches, low, high) result(interval)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: low, high
      real(wp), allocatable :: interval(:, :)

      real(wp) :: f, next(2)
      integer :: i, k, last

      allocate (interval(2, 0))
      last = 0
      do i = 1, branches%points
         if (branches%parameter(i) < low .or. branches%parameter(i) > high) cycle
         f = hertz(branches%value(branches%branch(i), i))
         if (branches%branch(i) /= last) interval = reshape([interval, f, f], [2, size(interval, 2) + 1])
         last = branches%branch(i)
         k = size(interval, 2)
         interval(:, k) = [min(interval(1, k), f), max(interval(2, k), f)]
      end do
      i = 1
      do while (i < size(interval, 2))
         ! Ascending, and joined where they overlap.
         if (interval(1, i + 1) < interval(1, i)) then
            next = interval(:, i + 1)
            interval(:, i + 1) = interval(:, i)
            interval(:, i) = next
            i = max(1, i - 1)
         else if (interval(1, i + 1) <= interval(2, i)) then
            interval(2, i) = max(interval(2, i), interval(2, i + 1))
            interval = reshape([interval(:, :i), interval(:, i + 2:)], [2, size(interval, 2) - 1])
            i = max(1, i - 1)
         else
            i = i + 1
         end if
      end do
   end function attainable

   !> Where within the range the mode watched changes its place in order, its branch or its strongest coordinate.
   pure function changes(branches, low, high) result(list)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: low, high
      type(change_t), allocatable :: list(:)

      type(change_t) :: change
      integer :: b(2), i, k

      allocate (list(0))
      do i = 1, branches%points - 1
         if (branches%parameter(i) < low .or. branches%parameter(i + 1) > high) cycle
         b = branches%branch(i:i + 1)
         change%parameter = branches%parameter(i:i + 1)
         change%place = branches%place(i:i + 1)
         change%branch = b
         change%coordinate = branches%coordinate(i:i + 1)
         change%frequency = [(hertz(branches%value(b(k), i + k - 1)), k=1, 2)]
         if (change%place(1) == change%place(2) .and. b(1) == b(2) .and. change%coordinate(1) == change%coordinate(2)) cycle
         list = [list, change]
      end do
   end function changes

end module razy_eigen_tuning
