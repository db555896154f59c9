!! The speed above which a rotor is unstable: the zero of the real part of an eigenvalue.
module razy_rotor_whirl_stability
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_eigen_branches, only: find_crossing, line_t
   use razy_eigen_spectrum, only: continue_branches, spectrum_t
   use razy_rotor_whirl_whirl, only: whirl_found, whirl_problem_t
   implicit none(type, external)
   private

   public :: known_limit, limit_t, stability_limit
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

   !> The lowest limit in [low, high] that `parts` equal parts of the range can tell, to a relative error `tolerance`.
   function stability_limit(problem, low, high, parts, circulatory, tolerance) result(limit)
      type(whirl_problem_t), intent(in) :: problem
      real(wp), intent(in) :: low, high
      integer, intent(in) :: parts
      logical, intent(in) :: circulatory
      real(wp), intent(in) :: tolerance
      type(limit_t) :: limit

      type(whirl_problem_t) :: family
      real(wp) :: growth(0:parts), speed(0:parts)
      integer :: i, status

      family = problem
      family%circulatory = circulatory
      do i = 0, parts
         speed(i) = low + (high - low)*i/parts
         call family%growth(speed(i), growth(i), status)
         if (status /= whirl_found) then
            limit%status = limit_failed
            return
         end if
         if (growth(i) > rounding*maxval(problem%scaling)) exit
      end do
      limit = known_limit(problem, speed(:min(i, parts)), growth(:min(i, parts)), circulatory, tolerance)
   end function stability_limit

   !> The same where the largest real part `growth`, 1/s, is known at rising speeds.
   function known_limit(problem, speed, growth, circulatory, tolerance) result(limit)
      type(whirl_problem_t), intent(in) :: problem
      real(wp), intent(in) :: speed(:), growth(:), tolerance
      logical, intent(in) :: circulatory
      type(limit_t) :: limit

      type(whirl_problem_t) :: family
      type(spectrum_t) :: at, high, low
      type(error_t), allocatable :: error
      type(line_t) :: stable
      real(wp), allocatable :: likeness(:)
      integer :: i, place

      stable%constant = -rounding*maxval(problem%scaling)
      i = findloc(growth + stable%constant > 0.0_wp, .true., dim=1)
      if (i == 0) return
      limit%status = limit_failed
      family = problem
      family%circulatory = circulatory
      call family%solve(speed(i), high, error)
      if (allocated(error)) return
      place = maxloc(high%value%re, dim=1)
      limit = limit_t(limit_below, speed(i), high%value(place)%im)
      if (i == 1) return
      limit%status = limit_failed
      call family%solve(speed(i - 1), low, error)
      if (allocated(error)) return
      allocate (likeness(size(high%value)))
      call continue_branches(low, high, likeness)
      associate (branch => high%branch(place))
         if (branch == 0) return
         if (stable%height(low, branch) >= 0.0_wp) return
         call find_crossing(family, low, high, branch, stable, at, place, error, tolerance)
      end associate
      if (allocated(error) .or. place == 0) return
      limit = limit_t(limit_found, at%parameter, at%value(place)%im)
   end function known_limit

end module razy_rotor_whirl_stability
