!! The speed above which a rotor is unstable: the zero of the real part of an eigenvalue.
module razy_rotor_whirl_stability
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_neutral, is_undecided, is_unstable
   use razy_eigen_branches, only: find_crossing, line_t
   use razy_eigen_spectrum, only: continue_branches, spectrum_t
   use razy_rotor_whirl_family, only: whirl_family_t
   implicit none(type, external)
   private

   public :: limit_t, stability_limit, worst_of
   public :: limit_found, limit_meanings, limit_none, limit_below, limit_failed, limit_undecided

   !> Found; no instability in the range; unstable already at its lower end; an eigenproblem failed or the eigenvalue was lost;
   !> nothing is unstable for sure.
   integer, parameter :: limit_found = 0, limit_none = 1, limit_below = 2, limit_failed = 3, limit_undecided = 4
   character(*), parameter :: limit_meanings(0:4) = [character(35) :: "found", "none up to the last speed", &
                                               "unstable at the first speed already", "an eigenproblem was not solved", "undecided"]

   !> A stability limit: the speed, rad/s, and the frequency of the motion that grows above it, rad/s; the first of the speeds
   !> below it, or of all, at which an eigenvalue is undecided, `huge` if there is none. Of a rotor that is unstable at the first
   !> speed the next one at which it is not, and the limit above that, whose frequency it then is, `huge` if there is none.
   type :: limit_t
      integer :: status = limit_none
      real(wp) :: speed = 0.0_wp, frequency = 0.0_wp, undecided = huge(1.0_wp), calm = huge(1.0_wp), again = huge(1.0_wp)
   end type limit_t

   !> So often the speeds between which the limit is are halved.
   integer, parameter :: most_halvings = 50
   !> A speed above the lower one of two, in parts of their difference, at which what grows from there on does so.
   real(wp), parameter :: just_above = 1.0e-3_wp

contains

   !> The lowest limit that the rising speeds `speed`, rad/s, can tell, to a relative error `tolerance`, and what follows on
   !> instability at the first of them. `worst` is what `worst_of` says of each, if it is known.
   function stability_limit(problem, speed, tolerance, worst) result(limit)
      class(whirl_family_t), intent(in) :: problem
      real(wp), intent(in) :: speed(:), tolerance
      integer, intent(in), optional :: worst(:)
      type(limit_t) :: limit

      type(limit_t) :: beyond
      integer, allocatable :: known(:)
      integer :: i

      limit = lowest_limit(problem, speed, tolerance, worst)
      if (limit%status /= limit_below) return
      do i = 2, size(speed)
         if (present(worst)) known = worst(i:)
         beyond = lowest_limit(problem, speed(i:), tolerance, known)
         if (beyond%status == limit_below) cycle
         limit%calm = speed(i)
         limit%frequency = beyond%frequency
         if (beyond%status == limit_found) limit%again = beyond%speed
         return
      end do
   end function stability_limit

   !> As `stability_limit`, without what follows.
   function lowest_limit(problem, speed, tolerance, worst) result(limit)
      class(whirl_family_t), intent(in) :: problem
      real(wp), intent(in) :: speed(:), tolerance
      integer, intent(in), optional :: worst(:)
      type(limit_t) :: limit

      class(whirl_family_t), allocatable :: family
      type(spectrum_t) :: at, high, low
      type(error_t), allocatable :: error
      integer, allocatable :: before(:), grows(:), verdict(:)
      integer :: i, k, place, said
      logical :: found

      limit%status = limit_failed
      family = problem
      do i = 1, size(speed)
         if (present(worst)) said = worst(i)
         if (.not. present(worst)) call look(speed(i), high)
         if (allocated(error)) return
         if (said == is_unstable) exit
         if (said == is_undecided) limit%undecided = min(limit%undecided, speed(i))
      end do
      if (i > size(speed)) then
         limit%status = merge(limit_undecided, limit_none, limit%undecided < huge(1.0_wp))
         return
      end if
      limit%status = limit_below
      if (i == 1) return
      limit%status = limit_failed
      call look(speed(i), high)
      if (allocated(error)) return
      limit%frequency = high%value(maxloc(high%value%re, dim=1))%im
      limit%speed = speed(i)
      grows = pack([(k, k=1, size(verdict))], verdict == is_unstable)
      do
         i = i - 1
         call family%solve(speed(i), low, error)
         if (allocated(error)) return
         call continue_branches(low, high)
         before = [(findloc(low%branch, high%branch(grows(k)), dim=1), k=1, size(grows))]
         ! What is undecided may grow already, at speeds below too.
         if (i == 1 .or. any(before == 0)) exit
         if (.not. any(low%value(before)%re > 0.0_wp)) exit
         grows = pack(before, low%value(before)%re > 0.0_wp)
         high = low
      end do
      do i = 1, most_halvings
         limit%speed = high%parameter
         limit%frequency = high%value(maxloc(high%value%re, dim=1))%im
         found = all(before > 0)
         do k = 1, merge(size(grows), 0, found)
            place = before(k)
            at = low
            if (low%value(place)%re < 0.0_wp) call find_crossing(family, low, high, high%branch(grows(k)), line_t(), at, place, &
                                                                 error, tolerance)
            if (allocated(error)) return
            found = place > 0
            if (.not. found) exit
            if (at%parameter > limit%speed) cycle
            limit%speed = at%parameter
            limit%frequency = at%value(place)%im
         end do
         ! What neither grows nor decays at the lower speed may decay before it grows.
         if (found .and. .not. limit%speed > low%parameter) then
            call look(low%parameter + just_above*(high%parameter - low%parameter), at)
            if (allocated(error)) return
            found = said == is_unstable .or. high%parameter - low%parameter <= tolerance*high%parameter
         end if
         ! A branch that was taken for another one by its shape leaves something that grows below: between closer speeds none is.
         if (found) then
            call look(limit%speed*(1.0_wp - 10*tolerance), at)
            if (allocated(error)) return
            found = said /= is_unstable
            if (.not. found) high = at
         end if
         if (found) then
            limit%status = limit_found
            return
         end if
         call look(0.5_wp*(low%parameter + high%parameter), at)
         if (allocated(error)) return
         if (said == is_unstable) high = at
         if (said /= is_unstable) low = at
         call family%judge(high, verdict)
         grows = pack([(k, k=1, size(verdict))], verdict == is_unstable)
         call continue_branches(low, high)
         before = [(findloc(low%branch, high%branch(grows(k)), dim=1), k=1, size(grows))]
      end do

   contains

      subroutine look(speed, spectrum)
         real(wp), intent(in) :: speed
         type(spectrum_t), intent(out) :: spectrum

         said = is_neutral
         call family%solve(speed, spectrum, error)
         if (allocated(error)) return
         call family%judge(spectrum, verdict)
         said = worst_of(verdict)
      end subroutine look

   end function lowest_limit

   !> The verdict on a machine with motions of these.
   pure integer function worst_of(verdict)
      integer, intent(in) :: verdict(:)

      worst_of = is_neutral
      if (any(verdict == is_undecided)) worst_of = is_undecided
      if (any(verdict == is_unstable)) worst_of = is_unstable
   end function worst_of

end module razy_rotor_whirl_stability
