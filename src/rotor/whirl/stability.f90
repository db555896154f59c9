!! The speed above which a rotor is unstable: the zero of the real part of an eigenvalue.
module razy_rotor_whirl_stability
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_branches, only: find_crossing, line_t
   use razy_eigen_spectrum, only: continue_branches, spectrum_t
   use razy_rotor_whirl_family, only: whirl_family_t
   implicit none(type, external)
   private

   public :: limit_t, stability_limit
   public :: limit_found, limit_meanings, limit_none, limit_below, limit_failed

   !> Found; no instability in the range; unstable already at its lower end; an eigenproblem failed or the eigenvalue was lost.
   integer, parameter :: limit_found = 0, limit_none = 1, limit_below = 2, limit_failed = 3
   character(*), parameter :: limit_meanings(0:3) = [character(35) :: "found", "none up to the last speed", &
                                                            "unstable at the first speed already", "an eigenproblem was not solved"]
   !> Real parts below this share of the largest frequency are rounding: undamped modes have such.
   real(wp), parameter :: rounding = 1.0e-12_wp

   !> A stability limit: the speed, rad/s, and the frequency of the motion that grows above it, rad/s.
   type :: limit_t
      integer :: status = limit_none
      real(wp) :: speed = 0.0_wp, frequency = 0.0_wp
   end type limit_t

contains

   !> The lowest limit that the rising speeds `speed`, rad/s, can tell, to a relative error `tolerance`. `growth` is the largest
   !> real part at each, 1/s, if it is known.
   function stability_limit(problem, speed, tolerance, growth) result(limit)
      class(whirl_family_t), intent(in) :: problem
      real(wp), intent(in) :: speed(:), tolerance
      real(wp), intent(in), optional :: growth(:)
      type(limit_t) :: limit

      class(whirl_family_t), allocatable :: family
      type(spectrum_t) :: at, high, low
      type(error_t), allocatable :: error
      type(line_t) :: stable
      real(wp) :: largest
      integer :: i, place

      stable%constant = -rounding*problem%largest
      limit%status = limit_failed
      family = problem
      do i = 1, size(speed)
         if (present(growth)) then
            largest = growth(i)
         else
            call family%solve(speed(i), high, error)
            if (allocated(error)) return
            largest = maxval([-huge(1.0_wp), high%value%re])
         end if
         if (largest + stable%constant > 0.0_wp) exit
      end do
      if (i > size(speed)) then
         limit%status = limit_none
         return
      end if
      call family%solve(speed(i), high, error)
      if (allocated(error)) return
      place = maxloc(high%value%re, dim=1)
      limit = limit_t(limit_below, speed(i), high%value(place)%im)
      if (i == 1) return
      limit%status = limit_failed
      call family%solve(speed(i - 1), low, error)
      if (allocated(error)) return
      call continue_branches(low, high)
      associate (branch => high%branch(place))
         if (branch == 0) return
         if (stable%height(low, branch) >= 0.0_wp) return
         call find_crossing(family, low, high, branch, stable, at, place, error, tolerance)
      end associate
      if (allocated(error) .or. place == 0) return
      limit = limit_t(limit_found, at%parameter, at%value(place)%im)
   end function stability_limit

end module razy_rotor_whirl_stability
