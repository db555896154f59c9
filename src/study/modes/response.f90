!! The linear response of a machine to its harmonic loads over one of its parameters, such as the speed: amplitude and phase of what
!! &record names, peaks with their orders, and of API 617 (7th edition, 2.6.2) amplification factors and separation margins of those
!! of order 1, and the largest orbit in each ring beside its clearance.
module razy_study_modes_response
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use razy_contact_gap_law, only: branch_open
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_machine_linearised, only: linear_ok, state_asked_for
   use razy_machine_machine, only: add_observable, is_ring, machine_t, observable_t
   use razy_machine_response, only: find_response
   use razy_scenes_case, only: new_observed
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   use razy_study_sweep_axes, only: new_varied, put_value, varied_t
   implicit none(type, external)
   private

   public :: new_response, parts_of, response_t, solve_response

   !> A maximum of an amplitude; values of the parameter in its unit.
   type :: peak_t
      integer :: observable = 0, tone = 0
      !> Of the orbit in this ring, not of an observable and a tone; 0: it is none.
      integer :: ring = 0
      real(wp) :: at = 0.0_wp, amplitude = 0.0_wp
      !> N_c/(N_2 - N_1), N_1 and N_2 where the amplitude is that of the peak over sqrt(2); not a number where one is out of range,
      !> and of orders other than 1.
      real(wp) :: factor = 0.0_wp
      !> Distance from the operating range over its nearer end, and the least that is asked for; not a number without a range.
      real(wp) :: margin = 0.0_wp, required = 0.0_wp
   end type peak_t

   !> The largest orbit in a ring, m, that of all tones together, and the value of the parameter where it is; the gap that is left
   !> all round in the reference position, m, and the orbit over it, not a number where there is none.
   type :: orbit_t
      character(:), allocatable :: ring
      real(wp) :: radius = 0.0_wp, at = 0.0_wp, gap = 0.0_wp, share = 0.0_wp
   end type orbit_t

   !> What &response asks for, and the answer.
   type :: response_t
      type(input_t), private :: input
      type(varied_t), private :: varied
      class(scene_t), allocatable, private :: scene
      integer, private :: contacts = 0
      !> Ends of the operating range; not allocated if there is none.
      real(wp), allocatable, private :: operating(:)
      type(observable_t), allocatable, private :: observable(:)
      !> Values of the parameter (points), frequencies, Hz (tones, points), phasors (observables, tones, points).
      real(wp), allocatable, private :: grid(:), hertz(:, :)
      complex(wp), allocatable, private :: value(:, :, :)
      !> Orders of the tones (tones), not a number where nothing rotates.
      real(wp), allocatable, private :: order(:)
      type(peak_t), allocatable, private :: peak(:)
      type(orbit_t), allocatable, private :: orbit(:)
   contains
      procedure :: columns
      procedure :: words
   end type response_t

   !> Peaks lower than this share of the largest amplitude are rounding.
   real(wp), parameter :: least = 1.0e-9_wp
   !> Relative error of the place of a peak, to which its amplitude is flat.
   real(wp), parameter :: place_error = 1.0e-8_wp
   !> The amplitude where there is none.
   real(wp), parameter :: missing = -1.0_wp
   real(wp), parameter :: golden = 0.6180339887498949_wp
   !> More peaks than this are counted, not listed.
   integer, parameter :: most_lines = 20
   character(*), parameter :: group = "/response/"

contains

   !> Read and check what is asked for; `contacts` is a state of razy_machine_linearised.
   subroutine new_response(self, input, contacts, error)
      type(response_t), intent(out) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: contacts
      type(error_t), allocatable, intent(out) :: error

      type(machine_t) :: machine
      real(wp) :: first, last
      integer :: i, points

      self%input = input
      self%contacts = contacts
      call new_varied(self%varied, input, "response", 1, error)
      if (allocated(error)) return
      if (any(self%varied%slot%whole)) call input%complain(error, "response", 1, "parameter", "a real number")
      if (allocated(error)) return
      call input%get("response", 1, "first", first)
      call input%get("response", 1, "last", last)
      call input%get("response", 1, "points", points)
      if (.not. last > first) call input%complain(error, "response", 1, "last", "more than the first value")
      if (allocated(error)) return
      if (input%given("response", 1, "operating")) then
         call input%get("response", 1, "operating", self%operating)
         if (.not. (self%operating(1) > 0.0_wp .and. self%operating(2) >= self%operating(1))) then
            call input%complain(error, "response", 1, "operating", "lowest and highest value, both above 0")
            return
         end if
      end if
      self%grid = [(first + (last - first)*(real(i, wp)/(points - 1)), i=0, points - 1)]
      call machine_at(self, last, machine, error)
      if (allocated(error)) return
      call find_rings(self%orbit, machine)
      self%observable = machine%observable(:size(machine%observable) - 2*size(self%orbit))
      self%order = [(ieee_value(first, ieee_quiet_nan), i=1, size(machine%tone))]
      if (abs(machine%speed) > 0.0_wp) self%order = 2*pi*machine%tone%hertz/machine%speed
      if (size(self%observable) == 0) then
         call input%complain(error, "record", 1, "observable", "required: a quantity whose response &response finds")
      else if (abs(machine%acceleration) > 0.0_wp) then
         call input%complain(error, "rotation", 1, "acceleration_rpm_per_s", "0 for &response, which is that of constant speeds")
      else if (any([(allocated(machine%tone(i)%waveform), i=1, size(machine%tone))])) then
         call input%complain(error, "response", 1, "parameter", "harmonic excitation only, without a shape or a file, and no "// &
                             "Jenkins element, whose response while it sticks is that of law = 'linear'")
      else if (size(machine%tone) == 0) then
         call input%complain(error, "response", 1, "parameter", "harmonic loads or unbalance, to which the machine responds")
      end if
   end subroutine new_response

   !> The rings of a machine.
   subroutine find_rings(orbit, machine)
      type(orbit_t), allocatable, intent(out) :: orbit(:)
      type(machine_t), intent(in) :: machine

      integer :: i, j

      allocate (orbit(count(is_ring(machine%contact))))
      i = 0
      do j = 1, size(machine%contact)
         if (.not. is_ring(machine%contact(j))) cycle
         i = i + 1
         orbit(i)%ring = machine%contact(j)%name
         orbit(i)%gap = machine%contact(j)%law%branch(branch_open)%guard(1)%upper - norm2(machine%contact(j)%frame%centre)
      end do
   end subroutine find_rings

   !> The machine with a value of the parameter; its last observables are both displacements in each ring.
   subroutine machine_at(self, value, machine, error)
      type(response_t), intent(inout) :: self
      real(wp), intent(in) :: value
      type(machine_t), intent(out) :: machine
      type(error_t), allocatable, intent(out) :: error

      type(record_t), allocatable :: records(:)
      integer :: j

      call put_value(self%varied, self%input, value, error)
      if (.not. allocated(error)) call new_observed(machine, records, self%input, error, self%scene)
      if (allocated(error)) return
      do j = 1, size(machine%contact)
         if (.not. is_ring(machine%contact(j))) cycle
         associate (contact => machine%contact(j), still => 0*machine%load)
            call add_observable(machine, "", "m", contact%w, still)
            call add_observable(machine, "", "m", contact%frame%across, still)
         end associate
      end do
   end subroutine machine_at

   !> Phasors (observables, tones) and frequencies, Hz (tones), with a value of the parameter.
   subroutine respond(self, at, value, hertz, error)
      type(response_t), intent(inout) :: self
      real(wp), intent(in) :: at
      complex(wp), allocatable, intent(out) :: value(:, :)
      real(wp), allocatable, intent(out) :: hertz(:)
      type(error_t), allocatable, intent(out) :: error

      type(machine_t) :: machine
      integer :: culprit, status

      call machine_at(self, at, machine, error)
      if (allocated(error)) return
      call find_response(machine, self%contacts, value, status, culprit)
      if (status /= linear_ok) call self%input%complain(error, "modes", 1, "contacts", state_asked_for(machine, status, culprit))
      hertz = machine%tone%hertz
   end subroutine respond

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
      integer :: i, k, t

      allocate (self%peak(0))
      do i = 1, size(self%observable)
         largest = maxval(abs(self%value(i, :, :)), mask=.not. ieee_is_nan(self%value(i, :, :)%re))
         do t = 1, size(self%value, 2)
            amplitude = abs(self%value(i, t, :))
            where (ieee_is_nan(amplitude)) amplitude = missing
            do k = 2, size(amplitude) - 1
               if (.not. (amplitude(k) > amplitude(k - 1) .and. amplitude(k) >= amplitude(k + 1))) cycle
               if (.not. amplitude(k) > least*largest) cycle
               peak%observable = i
               peak%tone = t
               call climb(self, peak, self%grid(k - 1), self%grid(k + 1), error)
               if (.not. allocated(error)) call widen(self, peak, amplitude, k, error)
               if (allocated(error)) return
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
      else if (peak%tone <= size(value, 2)) then
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

   !> Hand over what was found.
   subroutine columns(self, table)
      class(response_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: parameter = group//"parameter", tone = group//"tone", peak = group//"peak", &
                                 ring = group//"ring"
      character(64) :: names(size(self%peak)), rings(size(self%orbit))
      integer :: i

      do i = 1, size(rings)
         rings(i) = self%orbit(i)%ring
      end do

      call table%add(parameter, self%grid, self%varied%unit, self%varied%parameter, parameter)
      call table%add(tone, [(i, i=1, size(self%hertz, 1))], "1", "number of the tone of the excitation", tone)
      call table%add(group//"frequency", self%hertz, "Hz", "frequency of the tone", [character(20) :: tone, parameter])
      do i = 1, size(self%observable)
         call table%add(group//"phasor/"//self%observable(i)%name, parts_of(self%value(i, :, :)), self%observable(i)%unit, &
                        self%observable(i)%long_name//", real and imaginary part of its phasor", &
                        [character(20) :: "/complex", tone, parameter])
      end do
      do i = 1, size(names)
         names(i) = self%observable(self%peak(i)%observable)%name
      end do
      call table%add(group//"peak_observable", names, "1", "what has a peak", peak)
      call table%add(group//"peak_tone", self%peak%tone, "1", "number of its tone", peak)
      call table%add(group//"peak_order", [(self%order(self%peak(i)%tone), i=1, size(names))], "1", &
                     "order of the tone; NaN where nothing rotates", peak)
      call table%add(group//"peak_parameter", self%peak%at, self%varied%unit, self%varied%parameter//" at the peak", peak)
      call table%add(group//"peak_amplitude", self%peak%amplitude, "1", "amplitude, in the unit of the observable", peak)
      call table%add(group//"amplification_factor", self%peak%factor, "1", "place of the peak over its width at 1/sqrt(2)", peak)
      call table%add(group//"separation_margin", self%peak%margin, "1", "distance from the operating range over its end", peak)
      call table%add(group//"required_margin", self%peak%required, "1", "separation margin that API 617 asks for", peak)
      call table%add(group//"margin_left", self%peak%margin - self%peak%required, "1", "separation margin less the required one", &
                     peak)
      if (size(self%orbit) == 0) return
      call table%add(group//"ring", rings, "1", "name of a ring", ring)
      call table%add(group//"ring_orbit", self%orbit%radius, "m", "largest distance from the middle of the orbit in it", ring)
      call table%add(group//"ring_gap", self%orbit%gap, "m", "least gap in the reference position", ring)
      call table%add(group//"ring_share", self%orbit%share, "1", "orbit over gap", ring)
      call table%add(group//"ring_parameter", self%orbit%at, self%varied%unit, self%varied%parameter//" at the largest orbit", ring)
   end subroutine columns

   !> Real and imaginary parts (2, rows, columns) of complex numbers (rows, columns).
   pure function parts_of(values) result(parts)
      complex(wp), intent(in) :: values(:, :)
      real(wp) :: parts(2, size(values, 1), size(values, 2))

      parts(1, :, :) = values%re
      parts(2, :, :) = values%im
   end function parts_of

   !> The peaks, in lines.
   function words(self) result(lines)
      class(response_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      character(:), allocatable :: line
      character(16) :: amplitude
      integer :: i

      allocate (lines(0))
      do i = 1, min(most_lines, size(self%peak))
         associate (peak => self%peak(i))
            write (amplitude, "(es10.3)") peak%amplitude
            line = "peak of "//self%observable(peak%observable)%name//" at "//decimal(peak%at, 3)//" "//self%varied%unit//": "// &
                   trim(adjustl(amplitude))//" "//self%observable(peak%observable)%unit
            if (.not. ieee_is_nan(self%order(peak%tone))) line = line//", order "//to_text(self%order(peak%tone))
            if (.not. ieee_is_nan(peak%factor)) then
               if (peak%factor*place_error > 1.0_wp) then
                  line = line//", where nothing damps it: the amplitude grows without bound there"
               else
                  line = line//", amplification factor "//decimal(peak%factor, 2)
               end if
            end if
            if (.not. ieee_is_nan(peak%required)) line = line//", separation margin "//decimal(100*peak%margin, 1)// &
                                                         " %, asked for "//decimal(100*peak%required, 1)//" %"
         end associate
         call append_text(lines, line)
      end do
      if (size(self%peak) > most_lines) call append_text(lines, "and "//to_text(size(self%peak) - most_lines)//" more peaks")
      if (size(self%peak) == 0) call append_text(lines, "no peak of the response within the range")
      do i = 1, size(self%orbit)
         associate (orbit => self%orbit(i))
            write (amplitude, "(es10.3)") orbit%radius
            line = "largest orbit in "//orbit%ring//" at "//decimal(orbit%at, 3)//" "//self%varied%unit//": "// &
                   trim(adjustl(amplitude))//" m"
            if (ieee_is_nan(orbit%share)) then
               line = line//", where the offset leaves no gap"
            else
               line = line//", "//decimal(100*orbit%share, 1)//" % of the gap"
            end if
            call append_text(lines, line)
         end associate
      end do
   end function words

end module razy_study_modes_response
