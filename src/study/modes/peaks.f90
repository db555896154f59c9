!! Peaks of the response of a machine and the largest orbits in its rings, between the points at which it is computed; amplification
!! factors and separation margins of API 617 (7th edition, 2.6.2) for peaks of order 1.
module razy_study_modes_peaks
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_study_modes_response, only: peak_t, place_error, respond, response_t
   implicit none(type, external)
   private

   public :: solve_response

   !> Peaks lower than this share of the largest amplitude are rounding.
   real(wp), parameter :: least = 1.0e-9_wp
   !> The amplitude where there is none.
   real(wp), parameter :: missing = -1.0_wp
   !> A value that is told from 1, in all units, and not from a resonance.
   real(wp), parameter :: beside = 1 + 16*epsilon(1.0_wp)
   real(wp), parameter :: golden = 0.6180339887498949_wp

contains

   !> Find response and peaks.
   subroutine solve_response(self, error)
      type(response_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      complex(wp), allocatable :: value(:, :)
      real(wp), allocatable :: hertz(:)
      real(wp) :: nan
      integer :: k, tones

      nan = ieee_value(nan, ieee_quiet_nan)
      do k = size(self%grid), 1, -1
         call respond(self, self%grid(k), value, hertz, error)
         if (allocated(error)) return
         if (.not. allocated(self%value)) then
            tones = size(hertz)
            allocate (self%hertz(tones, size(self%grid)), source=nan)
            allocate (self%value(size(value, 1), tones, size(self%grid)), source=cmplx(nan, nan, wp))
         end if
         ! At a speed of 0 there is no tone, and where frequencies meet there are fewer.
         if (size(hertz) /= tones) cycle
         self%hertz(:, k) = hertz
         self%value(:, :, k) = value
      end do
      call find_peaks(self, error)
      if (.not. allocated(error)) call find_orbits(self, error)
   end subroutine solve_response

   !> The largest orbits in rings.
   subroutine find_orbits(self, error)
      type(response_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(peak_t) :: peak
      real(wp) :: radius(size(self%grid))
      integer :: i, k

      do i = 1, size(self%orbit)
         radius = [(orbit_in(self, i, self%value(:, :, k)), k=1, size(radius))]
         where (ieee_is_nan(radius)) radius = missing
         k = maxloc(radius, dim=1)
         peak%ring = i
         call climb(self, peak, self%grid(max(1, k - 1)), self%grid(min(k + 1, size(radius))), error)
         if (allocated(error)) return
         if (.not. peak%amplitude > radius(k)) then
            peak%at = self%grid(k)
            peak%amplitude = radius(k)
         end if
         associate (orbit => self%orbit(i))
            orbit%radius = peak%amplitude
            orbit%at = peak%at
            orbit%share = ieee_value(orbit%share, ieee_quiet_nan)
            if (orbit%gap > 0.0_wp) orbit%share = orbit%radius/orbit%gap
         end associate
      end do
   end subroutine find_orbits

   !> The longer half axes of the ellipses of all tones in ring i, added, from the phasors (observables, tones).
   pure real(wp) function orbit_in(self, i, value)
      type(response_t), intent(in) :: self
      integer, intent(in) :: i
      complex(wp), intent(in) :: value(:, :)

      associate (x => value(size(self%observable) + 2*i - 1, :), y => value(size(self%observable) + 2*i, :))
         orbit_in = 0.5_wp*(sum(abs(x + (0.0_wp, 1.0_wp)*y)) + sum(abs(x - (0.0_wp, 1.0_wp)*y)))
      end associate
   end function orbit_in

   !> The maxima of all amplitudes within the range.
   subroutine find_peaks(self, error)
      type(response_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(peak_t) :: peak
      real(wp) :: amplitude(size(self%grid)), largest
      integer :: high, i, k, low, t
      logical :: singular(size(self%grid))

      allocate (self%peak(0))
      do i = 1, size(self%observable)
         largest = max(0.0_wp, maxval(abs(self%value(i, :, :)), mask=.not. ieee_is_nan(self%value(i, :, :)%re)))
         do t = 1, size(self%value, 2)
            amplitude = abs(self%value(i, t, :))
            peak%observable = i
            peak%tone = t
            singular = .false.
            do k = 1, size(amplitude)
               ! Right at a resonance that nothing damps the matrix is singular, where frequencies meet there are fewer tones: the
               ! amplitude is that next to it.
               if (.not. ieee_is_nan(amplitude(k))) cycle
               call amplitude_at(self, peak, beside*self%grid(k), amplitude(k), error)
               if (allocated(error)) return
               if (ieee_is_nan(amplitude(k)) .or. ieee_is_nan(self%hertz(t, k))) cycle
               singular(k) = self%hertz(t, k) > 0.0_wp
            end do
            where (ieee_is_nan(amplitude)) amplitude = missing
            do k = 1, size(amplitude)
               low = max(1, k - 1)
               high = min(k + 1, size(amplitude))
               if (amplitude(k) < amplitude(high) .or. (low < k .and. amplitude(k) <= amplitude(low))) cycle
               if (.not. amplitude(k) > least*largest) cycle
               call climb(self, peak, self%grid(low), self%grid(high), error)
               if (allocated(error)) return
               if (singular(k)) peak%at = self%grid(k)
               ! An amplitude that grows up to an end of the range has no maximum there, but for a resonance right at it.
               if ((low == k .or. high == k) .and. .not. (singular(k) .or. peak%amplitude > amplitude(k) + least*largest)) cycle
               call widen(self, peak, amplitude, k, error)
               if (allocated(error)) return
               peak%unbounded = peak%unbounded .or. singular(k)
               if (peak%unbounded) peak%factor = ieee_value(largest, ieee_positive_inf)
               if (is_other(self%order(t))) peak%factor = ieee_value(largest, ieee_quiet_nan)
               call set_margins(self, peak)
               self%peak = [self%peak, peak]
            end do
         end do
      end do
   end subroutine find_peaks

   !> The amplitude of a peak's observable and tone with a value of the parameter.
   subroutine amplitude_at(self, peak, at, amplitude, error)
      type(response_t), intent(inout) :: self
      type(peak_t), intent(in) :: peak
      real(wp), intent(in) :: at
      real(wp), intent(out) :: amplitude
      type(error_t), allocatable, intent(out) :: error

      complex(wp), allocatable :: value(:, :)
      real(wp), allocatable :: hertz(:)

      amplitude = 0.0_wp
      call respond(self, at, value, hertz, error)
      if (allocated(error)) return
      if (peak%ring > 0) then
         amplitude = orbit_in(self, peak%ring, value)
      else if (size(value, 2) == size(self%value, 2)) then
         amplitude = abs(value(peak%observable, peak%tone))
      end if
   end subroutine amplitude_at

   !> The maximum between two values of the parameter, by golden sections.
   subroutine climb(self, peak, low, high, error)
      type(response_t), intent(inout) :: self
      type(peak_t), intent(inout) :: peak
      real(wp), intent(in) :: low, high
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: a, b, f(2), x(2)

      a = low
      b = high
      x = [b - golden*(b - a), a + golden*(b - a)]
      call amplitude_at(self, peak, x(1), f(1), error)
      if (.not. allocated(error)) call amplitude_at(self, peak, x(2), f(2), error)
      do while (.not. allocated(error) .and. b - a > place_error*max(abs(a), abs(b)))
         if (f(1) > f(2)) then
            b = x(2)
            x = [b - golden*(b - a), x(1)]
            f(2) = f(1)
            call amplitude_at(self, peak, x(1), f(1), error)
         else
            a = x(1)
            x = [x(2), a + golden*(b - a)]
            f(1) = f(2)
            call amplitude_at(self, peak, x(2), f(2), error)
         end if
      end do
      peak%at = x(merge(1, 2, f(1) > f(2)))
      peak%amplitude = maxval(f)
   end subroutine climb

   !> The amplification factor of the peak near grid point k, from where the amplitude falls below that of the peak over sqrt(2).
   subroutine widen(self, peak, amplitude, k, error)
      type(response_t), intent(inout) :: self
      type(peak_t), intent(inout) :: peak
      real(wp), intent(in) :: amplitude(:)
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error

      type(bracketed_root_t) :: root
      real(wp) :: height, side(2), value
      integer :: i, step

      height = peak%amplitude/sqrt(2.0_wp)
      peak%unbounded = .false.
      peak%factor = ieee_value(height, ieee_quiet_nan)
      do step = -1, 1, 2
         i = k
         ! Between coarse points the nearest one may be low, and on the other side of the peak.
         do while (amplitude(i) >= height .or. step*(self%grid(i) - peak%at) <= 0.0_wp)
            i = i + step
            if (i < 1 .or. i > size(amplitude)) return
         end do
         if (amplitude(i) < 0.0_wp) return
         call root%start(self%grid(i), amplitude(i) - height, peak%at, peak%amplitude - height)
         do while (.not. root%done())
            call amplitude_at(self, peak, root%trial, value, error)
            if (allocated(error)) return
            call root%take(value - height)
         end do
         side((step + 3)/2) = root%best
      end do
      peak%factor = peak%at/(side(2) - side(1))
      peak%unbounded = peak%factor*place_error > 1.0_wp
   end subroutine widen

   !> Whether an order is there and not 1, but for rounding.
   pure logical function is_other(order)
      real(wp), intent(in) :: order

      is_other = .not. ieee_is_nan(order)
      if (is_other) is_other = abs(order - 1) > 8*epsilon(order)
   end function is_other

   !> Separation margins; below an amplification factor of 2.5 none is asked for.
   pure subroutine set_margins(self, peak)
      type(response_t), intent(in) :: self
      type(peak_t), intent(inout) :: peak

      real(wp) :: part

      peak%margin = ieee_value(part, ieee_quiet_nan)
      peak%required = peak%margin
      if (.not. allocated(self%operating) .or. is_other(self%order(peak%tone))) return
      associate (low => self%operating(1), high => self%operating(2))
         peak%margin = max((low - peak%at)/low, (peak%at - high)/high, 0.0_wp)
         if (ieee_is_nan(peak%factor)) return
         peak%required = 0.0_wp
         if (peak%factor < 2.5_wp) return
         part = 0.17_wp*(1 - 1/(peak%factor - 1.5_wp))
         peak%required = merge(0.10_wp + part, part, peak%at > high)
      end associate
   end subroutine set_margins

end module razy_study_modes_peaks
