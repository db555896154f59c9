!! A waveform: excitation that is no harmonic for ever, in pieces that begin at known times.
!!
!! In a piece that begins at t_k its phasor E either turns, E = E_k e^{iω(t - t_k)}, as in a half sine, or is a straight line,
!! E = u + i u'/ω, so that Re(c E) of a real c is c u and its rate c u', or such an E of a cubic u. All waveforms obey
!! |u| + |u'|/ω ≤ 1 or |E| ≤ 1.
module razy_core_waveform
   use razy_core_kinds, only: i8, pi, qp, wp
   implicit none(type, external)
   private

   public :: along, half_sine, polyline, waveform_t

   !> Pieces begin at `knot`, s, the first at 0, after `delay`, s, with the phasor `start`; all of them again with the frequency
   !> `hertz`, if it is not 0. Before the first of one that is there once E = 0. `ramps`: a line, straight but where
   !> `curved`; then it bends, with the curve b + i c of a piece, by b a² + c a³ after the angle a = ω(t - t_k).
   type :: waveform_t
      logical :: ramps = .true., curved = .false.
      real(wp) :: omega = 0.0_wp
      real(qp) :: delay = 0.0_qp, hertz = 0.0_qp
      real(wp), allocatable, private :: knot(:)
      complex(wp), allocatable, private :: start(:), curve(:)
   contains
      procedure :: phasor
      procedure :: bend
      procedure :: rest
      procedure :: steps
      procedure :: jumps_until
      procedure :: renew
   end type waveform_t

   !> So near to a knot, relative to the time, it has been reached.
   real(qp), parameter :: rounding = 4*epsilon(1.0_wp)
   !> A smaller difference, of values up to 1, is rounding.
   real(wp), parameter :: smallest_jump = 1.0e-12_wp
   !> Later than any motion.
   real(qp), parameter :: long_ago = 1.0e30_qp

contains

   !> sin(πt/duration) from 0 to `duration`, s.
   pure function half_sine(duration) result(self)
      real(wp), intent(in) :: duration
      type(waveform_t) :: self

      self%ramps = .false.
      self%omega = pi/duration
      self%knot = [0.0_wp, duration]
      self%start = [(0.0_wp, -1.0_wp), (0.0_wp, 0.0_wp)]
   end function half_sine

   !> The lines from the values `from` at the times `knot`, s, to `to` just before the next (pieces); those of no length are left
   !> out. The last ends with the period, s, or is held if that is 0. What the waveform has to be multiplied by is `factor`. With
   !> the rates `rates` at both ends (pieces, 2) the lines are cubics.
   pure subroutine polyline(self, factor, knot, from, to, period, rates)
      type(waveform_t), intent(out) :: self
      real(wp), intent(out) :: factor
      real(wp), intent(in) :: knot(:), from(:), to(:), period
      real(wp), intent(in), optional :: rates(:, :)

      real(wp) :: ends(size(knot), 2), length(size(knot)), slope(size(knot))
      integer :: n

      n = size(knot)
      length = [knot(2:) - knot(:n - 1), merge(period - knot(n), 1.0_wp, period > 0.0_wp)]
      slope = 0.0_wp
      where (length > 0.0_wp) slope = (to - from)/length
      ends = spread(slope, 2, 2)
      if (present(rates)) ends = rates
      ! A cubic and its rate lie between their control points.
      factor = 2*maxval(abs([from, to, from + length*ends(:, 1)/3, to - length*ends(:, 2)/3]))
      if (.not. factor > 0.0_wp) factor = 1.0_wp
      self%omega = 2*maxval(abs([ends(:, 1), ends(:, 2), 3*slope - ends(:, 1) - ends(:, 2)]))/factor
      ! Steps have no rate, and the frequency of a tone is positive.
      if (.not. self%omega > 0.0_wp) self%omega = 1.0_wp/maxval(length)
      self%knot = pack(knot, length > 0.0_wp)
      self%start = pack(cmplx(from/factor, ends(:, 1)/factor/self%omega, wp), length > 0.0_wp)
      allocate (self%curve(size(self%knot)), source=(0.0_wp, 0.0_wp))
      self%curved = present(rates)
      if (self%curved) self%curve = cmplx((3*slope - 2*ends(:, 1) - ends(:, 2))/length/self%omega**2, &
                                          (ends(:, 1) + ends(:, 2) - 2*slope)/length**2/self%omega**3, wp)/factor
   end subroutine polyline

   !> E after an angle from `from` on, with the curve `bend`.
   elemental function along(from, bend, angle) result(e)
      complex(wp), intent(in) :: from, bend
      real(wp), intent(in) :: angle
      complex(wp) :: e

      e = cmplx(from%re + angle*(from%im + angle*(bend%re + angle*bend%im)), &
                from%im + angle*(2*bend%re + angle*3*bend%im), wp)
   end function along

   !> How the line of a waveform that ramps bends from the time `time + time_low` on, s.
   pure function bend(self, time, time_low)
      class(waveform_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      complex(wp) :: bend

      real(qp) :: since
      integer :: k

      bend = (0.0_wp, 0.0_wp)
      call find_piece(self, time, time_low, k, since)
      if (k > 0) bend = self%curve(k) + 3*self%omega*real(since - self%knot(k), wp)*self%curve(k)%im
   end function bend

   !> E at the time `time + time_low`, s, at a knot after it.
   pure function phasor(self, time, time_low)
      class(waveform_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      complex(wp) :: phasor

      real(qp) :: since
      integer :: k

      phasor = (0.0_wp, 0.0_wp)
      call find_piece(self, time, time_low, k, since)
      if (k == 0) return
      associate (angle => self%omega*real(since - self%knot(k), wp))
         if (self%ramps) phasor = along(self%start(k), self%curve(k), angle)
         if (.not. self%ramps) phasor = self%start(k)*cmplx(cos(angle), sin(angle), wp)
      end associate
   end function phasor

   !> The time from then to the next knot, s.
   pure function rest(self, time, time_low)
      class(waveform_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      real(wp) :: rest

      real(qp) :: since
      integer :: k

      call find_piece(self, time, time_low, k, since)
      rest = huge(rest)
      if (k < size(self%knot)) then
         rest = real(self%knot(k + 1) - since, wp)
      else if (self%hertz > 0.0_qp) then
         rest = real(1.0_qp/self%hertz - since, wp)
      end if
   end function rest

   !> At which knots E of straight lines jumps; before the first of one that is there once it is 0, but for time 0.
   pure function steps(self)
      class(waveform_t), intent(in) :: self
      logical :: steps(size(self%knot))

      real(wp) :: before(size(self%knot)), length(size(self%knot))
      integer :: n

      steps = .false.
      if (.not. self%ramps) return
      n = size(self%knot)
      length = 0.0_wp
      length(2:) = self%knot(2:) - self%knot(:n - 1)
      if (self%hertz > 0.0_qp) length(1) = real(1.0_qp/self%hertz, wp) - self%knot(n)
      before = cshift(real(along(self%start, self%curve, self%omega*cshift(length, 1))), -1)
      if (.not. self%hertz > 0.0_qp) before(1) = merge(0.0_wp, self%start(1)%re, self%delay > 0.0_qp)
      steps = abs(before - self%start%re) > smallest_jump
   end function steps

   !> How many jumps of one that comes again there are up to a time, s, from one before it on that hangs on no time.
   pure integer function jumps_until(self, time) result(jumps)
      class(waveform_t), intent(in) :: self
      real(wp), intent(in) :: time

      real(qp) :: since
      integer :: k

      call find_piece(self, time, 0.0_wp, k, since)
      associate (steps => self%steps())
         jumps = count(steps(:k)) + count(steps)*nint((time - self%delay - since)*self%hertz)
      end associate
   end function jumps_until

   !> The piece at a time, 0 before the first, and the time since the first began, s.
   pure subroutine find_piece(self, time, time_low, k, since)
      class(waveform_t), intent(in) :: self
      real(wp), intent(in) :: time, time_low
      integer, intent(out) :: k
      real(qp), intent(out) :: since

      real(qp) :: near
      integer :: above, middle

      since = (real(time, qp) + time_low) - self%delay
      near = rounding*abs(time)
      if (self%hertz > 0.0_qp) since = since - floor((since + near)*self%hertz, i8)/self%hertz
      k = 0
      above = size(self%knot) + 1
      do while (above - k > 1)
         middle = (k + above)/2
         if (self%knot(middle) <= since + near) then
            k = middle
         else
            above = middle
         end if
      end do
   end subroutine find_piece

   !> Begin `turns` of the period later; what is there once is over.
   pure subroutine renew(self, turns)
      class(waveform_t), intent(inout) :: self
      real(wp), intent(in) :: turns

      if (self%hertz > 0.0_qp) then
         self%delay = self%delay - turns/self%hertz
      else
         self%delay = -long_ago
      end if
   end subroutine renew

end module razy_core_waveform
