!! Critical speeds: where the frequency of a branch of eigenvalues is `order` times the speed.
!!
!! The crossing is found on eigenvalues that are followed by their shapes (razy_eigen_branches).
module razy_rotor_whirl_critical
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_branches, only: find_crossing, line_t
   use razy_eigen_spectrum, only: spectrum_t
   use razy_linalg_dense, only: rising_order
   use razy_rotor_whirl_whirl, only: whirl_problem_t
   implicit none(type, external)
   private

   public :: critical_t, find_critical, in_order, likely

   !> Overlap above which two shapes belong together.
   real(wp), parameter :: likely = 0.6_wp
   !> Critical speeds err by less than this share.
   real(wp), parameter :: precise = 1.0e-12_wp
   !> A crossing counts as found if frequency and excitation differ by less than this share.
   real(wp), parameter :: residual = 1.0e-9_wp

   !> A critical speed, rad/s: there the frequency, rad/s, of `branch` is `order` times the speed. `growth` is the real part, 1/s.
   type :: critical_t
      real(wp) :: speed = 0.0_wp, order = 0.0_wp, frequency = 0.0_wp, growth = 0.0_wp, direction = 0.0_wp
      integer :: branch = 0
   end type critical_t

contains

   !> The critical speed of order `order` between mode i of one spectrum and mode j of the next, if there is one (`crossed`),
   !> and its shape (p) in modes at rest; its direction is left to the caller. Not `found` if the branch was lost.
   subroutine find_critical(critical, shape, crossed, found, family, order, before, i, after, j, error)
      type(critical_t), intent(out) :: critical
      complex(wp), allocatable, intent(out) :: shape(:)
      logical, intent(out) :: crossed, found
      type(whirl_problem_t), intent(inout) :: family
      real(wp), intent(in) :: order
      type(spectrum_t), intent(in) :: before, after
      integer, intent(in) :: i, j
      type(error_t), allocatable, intent(out) :: error

      type(line_t) :: line
      type(spectrum_t) :: at
      real(wp) :: f(2)
      integer :: place

      line = line_t((0.0_wp, -1.0_wp), -order, 0.0_wp)
      f = [line%height(before, i), line%height(after, j)]
      found = .false.
      crossed = (f(1) > 0.0_wp .and. f(2) <= 0.0_wp) .or. (f(1) < 0.0_wp .and. f(2) >= 0.0_wp)
      if (.not. crossed) return
      call find_crossing(family, before, after, before%branch(i), line, at, place, error, precise)
      if (allocated(error) .or. place == 0) return
      critical = critical_t(at%parameter, order, at%value(place)%im, at%value(place)%re)
      shape = at%shape(:, place)
      found = abs(line%height(at, place)) <= residual*critical%frequency
      critical%branch = before%branch(i)
   end subroutine find_critical

   !> Critical speeds by rising order, then by rising speed.
   pure function in_order(list) result(sorted)
      type(critical_t), intent(in) :: list(:)
      type(critical_t), allocatable :: sorted(:)

      sorted = list(rising_order(list%speed))
      sorted = sorted(rising_order(sorted%order))
   end function in_order

end module razy_rotor_whirl_critical
