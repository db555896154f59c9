!! The parameter with which a mode has a given natural frequency (tuning, 4.91).
!!
!! The mode is the one with the greatest share of a coordinate, whatever its place in order, or the continuation of the mode with a
!! given number. Of several values the one nearest to the start is taken.
module razy_eigen_tuning
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_eigen_mode_branches, only: branches_t, follow_branches, hertz, machines_t, watch_t
   use razy_linalg_dense, only: rising_order
   implicit none(type, external)
   private

   public :: attainable, change_t, changes, frequencies, objective, tune, tuning_t

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
   subroutine tune(self, branches, family, start, grid, coordinate, mode, frequency, error)
      type(tuning_t), intent(out) :: self
      type(branches_t), intent(out) :: branches
      class(machines_t), intent(inout) :: family
      real(wp), intent(in) :: start, grid(:), frequency
      integer, intent(in) :: coordinate, mode
      type(error_t), allocatable, intent(out) :: error

      logical, allocatable :: fit(:)
      integer :: i

      call follow_branches(branches, family, start, grid, watch_t(coordinate, mode, (2*pi*frequency)**2), error)
      if (allocated(error)) return
      associate (root => branches%root)
         fit = root%watched .and. root%parameter >= minval(grid) .and. root%parameter <= maxval(grid)
         if (.not. any(fit)) return
         i = minloc(abs(root%parameter - start), dim=1, mask=fit)
         self = tuning_t(.true., root(i)%parameter, hertz(root(i)%value), root(i)%share, root(i)%branch, count(fit) - 1)
      end associate
   end subroutine tune

   !> Frequency of the mode watched at each point, Hz.
   pure function frequencies(branches) result(frequency)
      type(branches_t), intent(in) :: branches
      real(wp) :: frequency(size(branches%point))

      integer :: i

      frequency = [(hertz(branches%value(branches%point(i)%branch, i)), i=1, size(frequency))]
   end function frequencies

   !> ψ = (1 - f/goal)² (4.91) of the mode watched at each point.
   pure function objective(branches, goal) result(psi)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: goal
      real(wp) :: psi(size(branches%point))

      psi = (1 - frequencies(branches)/goal)**2
   end function objective

   !> The frequencies (2, intervals) that the mode takes within the range, Hz, each from least to greatest, ascending and apart.
   pure function attainable(branches, low, high) result(interval)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: low, high
      real(wp), allocatable :: interval(:, :)

      real(wp) :: frequency(size(branches%point))
      real(wp), allocatable :: piece(:, :)
      integer :: i, last

      frequency = frequencies(branches)
      allocate (piece(2, 0), interval(2, 0))
      last = 0
      do i = 1, size(frequency)
         associate (point => branches%point(i), k => size(piece, 2))
            if (point%parameter < low .or. point%parameter > high) cycle
            if (point%branch /= last) then
               piece = reshape([piece, frequency(i), frequency(i)], [2, k + 1])
            else
               piece(:, k) = [min(piece(1, k), frequency(i)), max(piece(2, k), frequency(i))]
            end if
            last = point%branch
         end associate
      end do
      piece = piece(:, rising_order(piece(1, :)))
      do i = 1, size(piece, 2)
         associate (k => size(interval, 2))
            if (k > 0) then
               if (piece(1, i) <= interval(2, k)) then
                  interval(2, k) = max(interval(2, k), piece(2, i))
                  cycle
               end if
            end if
            interval = reshape([interval, piece(:, i)], [2, k + 1])
         end associate
      end do
   end function attainable

   !> Where within the range the mode watched changes its place in order, its branch or its strongest coordinate.
   pure function changes(branches, low, high) result(list)
      type(branches_t), intent(in) :: branches
      real(wp), intent(in) :: low, high
      type(change_t), allocatable :: list(:)

      real(wp) :: frequency(size(branches%point))
      integer :: i

      frequency = frequencies(branches)
      allocate (list(0))
      do i = 1, size(frequency) - 1
         associate (pair => branches%point(i:i + 1))
            if (pair(1)%parameter < low .or. pair(2)%parameter > high) cycle
            if (pair(1)%place == pair(2)%place .and. pair(1)%branch == pair(2)%branch &
                .and. pair(1)%coordinate == pair(2)%coordinate) cycle
            list = [list, change_t(pair%parameter, pair%place, pair%branch, pair%coordinate, frequency(i:i + 1))]
         end associate
      end do
   end function changes

end module razy_eigen_tuning
