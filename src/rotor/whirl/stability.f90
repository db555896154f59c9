!! The speed above which a rotor is unstable: the zero of the real part of an eigenvalue.
module razy_rotor_whirl_stability
   use razy_core_kinds, only: wp
   use razy_rotor_whirl_whirl, only: whirl_found, whirl_problem_t, whirl_t
   implicit none(type, external)
   private

   public :: known_limit, largest_growth, limit_t, stability_limit
   public :: limit_found, limit_none, limit_below, limit_failed

   !> Found; no instability in the range; unstable already at its lower end; an eigenproblem failed or the eigenvalue was lost.
   integer, parameter :: limit_found = 0, limit_none = 1, limit_below = 2, limit_failed = 3
   !> Real parts below this share of the largest frequency are rounding: undamped modes have such.
   real(wp), parameter :: noise = 1.0e-12_wp
   integer, parameter :: most_steps = 100

   !> A stability limit: the speed, rad/s, and the frequency of the motion that grows above it, rad/s.
   type :: limit_t
      integer :: status = limit_none
      real(wp) :: speed = 0.0_wp, frequency = 0.0_wp
   end type limit_t

contains

   !> The largest real part at a speed, 1/s, and where it is in the list.
   pure subroutine largest_growth(whirl, growth, place)
      type(whirl_t), intent(in) :: whirl
      real(wp), intent(out) :: growth
      integer, intent(out) :: place

      place = maxloc(whirl%value%re, dim=1)
      growth = whirl%value(place)%re
   end subroutine largest_growth

   !> The lowest limit in [low, high] that `parts` equal parts of the range can tell, to a relative error `tolerance`.
   function stability_limit(problem, low, high, parts, circulatory, tolerance) result(limit)
      type(whirl_problem_t), intent(in) :: problem
      real(wp), intent(in) :: low, high
      integer, intent(in) :: parts
      logical, intent(in) :: circulatory
      real(wp), intent(in) :: tolerance
      type(limit_t) :: limit

      real(wp) :: growth(0:parts), speed(0:parts)
      integer :: i, status

      do i = 0, parts
         speed(i) = low + (high - low)*i/parts
         call problem%growth(speed(i), circulatory, growth(i), status)
         if (status /= whirl_found) then
            limit%status = limit_failed
            return
         end if
         if (growth(i) > noise*maxval(problem%scaling)) exit
      end do
      limit = known_limit(problem, speed(:min(i, parts)), growth(:min(i, parts)), circulatory, tolerance)
   end function stability_limit

   !> The same where the largest real part `growth`, 1/s, is known at rising speeds.
   function known_limit(problem, speed, growth, circulatory, tolerance) result(limit)
      type(whirl_problem_t), intent(in) :: problem
      real(wp), intent(in) :: speed(:), growth(:), tolerance
      logical, intent(in) :: circulatory
      type(limit_t) :: limit

      type(whirl_t) :: whirl
      real(wp) :: largest
      integer :: i, place

      i = findloc(growth > noise*maxval(problem%scaling), .true., dim=1)
      if (i == 0) return
      limit%status = limit_failed
      whirl = problem%solve(speed(i), circulatory, shapes=.false.)
      if (whirl%status /= whirl_found) return
      call largest_growth(whirl, largest, place)
      limit%speed = speed(i)
      limit%frequency = whirl%value(place)%im
      limit%status = limit_below
      if (i > 1) call refine(limit, problem, speed(i - 1), speed(i), whirl, circulatory, tolerance)
   end function known_limit

   !> The zero of the real part in [low, high] by the Illinois variant of false position; the eigenvalue is known by its shape,
   !> which is taken anew at the unstable end.
   subroutine refine(limit, problem, low, high, whirl_high, circulatory, tolerance)
      type(limit_t), intent(inout) :: limit
      type(whirl_problem_t), intent(in) :: problem
      real(wp), intent(in) :: low, high
      type(whirl_t), intent(in) :: whirl_high
      logical, intent(in) :: circulatory
      real(wp), intent(in) :: tolerance

      type(whirl_t) :: whirl
      complex(wp), allocatable :: followed(:)
      real(wp) :: a, b, fa, fb, least, old, speed, value
      integer :: place, side, step

      least = noise*maxval(problem%scaling)
      a = low
      b = high
      call largest_growth(whirl_high, fb, place)
      fb = fb - least
      followed = whirl_high%modal(:, place)
      fa = -fb
      speed = b
      side = 0
      limit%status = limit_failed
      do step = 0, most_steps
         old = speed
         speed = a
         if (step > 0) speed = b - fb*(b - a)/(fb - fa)
         whirl = problem%solve(speed, circulatory, shapes=.false.)
         if (whirl%status /= whirl_found) return
         place = likeliest(whirl, followed)
         value = whirl%value(place)%re - least
         if (step == 0 .and. value >= 0.0_wp) return
         limit%frequency = whirl%value(place)%im
         if (step > 1 .and. abs(speed - old) <= 0.1_wp*tolerance*speed) then
            limit%status = limit_found
            limit%speed = speed
            return
         end if
         if (value > 0.0_wp) then
            b = speed
            fb = value
            followed = whirl%modal(:, place)
            if (side == 1) fa = 0.5_wp*fa
            side = 1
         else
            a = speed
            fa = value
            if (side == -1) fb = 0.5_wp*fb
            side = -1
         end if
      end do
   end subroutine refine

   !> The eigenvalue whose shape is most like this one.
   pure function likeliest(whirl, shape) result(place)
      type(whirl_t), intent(in) :: whirl
      complex(wp), intent(in) :: shape(:)
      integer :: place

      real(wp) :: best, likeness
      integer :: i

      place = 1
      best = -1.0_wp
      do i = 1, size(whirl%value)
         likeness = abs(dot_product(shape, whirl%modal(:, i)))
         if (likeness > best) then
            best = likeness
            place = i
         end if
      end do
   end function likeliest

end module razy_rotor_whirl_stability
