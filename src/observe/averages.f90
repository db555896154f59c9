!! Mean and root mean square of observables from a given time on.
!!
!! Both integrals are those of Gauss-Legendre with eight points on parts of each piece, which are halved until the integrals no
!! longer change: between events motions are smooth, so that a few parts give them to rounding.
module razy_observe_averages
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_linalg_gauss, only: abscissa, points, weight
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: averages_t

   type, extends(observer_t) :: averages_t
      !> Observables by number in the machine.
      integer, allocatable :: form(:)
      !> What has been recorded, s; integrals of the values and of their squares (form, 2).
      real(wp), private :: time = 0.0_wp
      real(wp), allocatable, private :: sums(:, :)
   contains
      procedure :: piece
      procedure :: forget
      procedure :: columns
   end type averages_t

   !> Natural intervals of the integrator in a part at first, how often it is halved, after how many halvings a part is shorter than
   !> one, and the difference, of all that was recorded, that is rounding.
   integer, parameter :: intervals = 8, most_halvings = 12, resolved = 4
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   subroutine forget(self)
      class(averages_t), intent(inout) :: self

      self%time = 0.0_wp
      self%sums = spread([0.0_wp, 0.0_wp], 1, size(self%form))
   end subroutine forget

   !> Add a piece, as far as it lies in the time of recording.
   subroutine piece(self, part)
      class(averages_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp), dimension(size(self%form), 2) :: before, change, last, now
      real(wp) :: length, tau
      integer :: k, n

      tau = max((self%from - part%time) - part%time_low, 0.0_wp)
      length = part%duration - tau
      if (.not. length > 0.0_wp) return
      n = ceiling(length/(intervals*part%by%interval()))
      now = integrals(self%form, part, tau, n)
      last = huge(last)
      do k = 1, most_halvings
         before = now
         n = 2*n
         now = integrals(self%form, part, tau, n)
         change = abs(now - before)
         associate (square => self%sums(:, 2) + now(:, 2))
            if (all(change(:, 2) <= rounding*square) .and. &
                all(change(:, 1) <= rounding*sqrt((self%time + length)*square))) exit
         end associate
         ! Of what rests noise is left, which does not come to an end.
         if (k > resolved .and. .not. any(change < 0.5_wp*last)) exit
         last = change
      end do
      self%time = self%time + length
      self%sums = self%sums + now
   end subroutine piece

   !> Integrals of values and squares (form, 2) over `n` parts of a piece from `tau` to its end.
   function integrals(form, part, tau, n) result(sums)
      integer, intent(in) :: form(:), n
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau
      real(wp) :: sums(size(form), 2)

      real(wp) :: length, value
      integer :: i, k, p

      length = (part%duration - tau)/n
      sums = 0.0_wp
      do k = 0, n - 1
         do p = 2, points - 1
            do i = 1, size(form)
               value = part%by%value(form(i), min(tau + (k + abscissa(p))*length, part%duration))
               sums(i, :) = sums(i, :) + length*weight(p)*[value, value**2]
            end do
         end do
      end do
   end function integrals

   !> Hand over the averages, as single values of `/average/<name>`; NaN where nothing was seen.
   subroutine columns(self, table, machine)
      class(averages_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      real(wp) :: mean(size(self%form), 2)
      integer :: i

      mean = ieee_value(mean, ieee_quiet_nan)
      if (self%time > 0.0_wp) mean = self%sums/self%time
      do i = 1, size(self%form)
         associate (seen => machine%observable(self%form(i)))
            call table%add("/average/"//seen%name//"/mean", mean(i, 1), seen%unit, "mean of "//seen%long_name)
            call table%add("/average/"//seen%name//"/rms", sqrt(mean(i, 2)), seen%unit, "root mean square of "//seen%long_name)
         end associate
      end do
   end subroutine columns

end module razy_observe_averages
