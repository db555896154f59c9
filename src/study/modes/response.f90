!! The linear response of a machine to its harmonic loads over one of its parameters, such as the speed: amplitude and phase of what
!! &record names, peaks with their orders, and of API 617 (7th edition, 2.6.2) amplification factors and separation margins of those
!! of order 1, and the largest orbit in each ring beside its clearance.
module razy_study_modes_response
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use razy_contact_gap_law, only: branch_open
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_machine_linearised, only: linear_ok, state_asked_for
   use razy_machine_machine, only: add_observable, is_ring, machine_t, observable_t
   use razy_machine_response, only: find_response
   use razy_scenes_case, only: new_observed
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   use razy_study_sweep_axes, only: new_varied, put_value, varied_t
   implicit none(type, external)
   private

   public :: new_response, parts_of, peak_t, place_error, respond, response_t

   !> A maximum of an amplitude; values of the parameter in its unit.
   type :: peak_t
      integer :: observable = 0, tone = 0
      !> Of the orbit in this ring, not of an observable and a tone; 0: it is none.
      integer :: ring = 0
      real(wp) :: at = 0.0_wp, amplitude = 0.0_wp
      !> N_c/(N_2 - N_1), N_1 and N_2 where the amplitude is that of the peak over sqrt(2); not a number where one is out of range,
      !> and of orders other than 1; infinite where nothing damps.
      real(wp) :: factor = 0.0_wp
      !> Whether nothing damps it.
      logical :: unbounded = .false.
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
      type(input_t) :: input
      type(varied_t) :: varied
      class(scene_t), allocatable :: scene
      integer :: contacts = 0
      !> Ends of the operating range; not allocated if there is none.
      real(wp), allocatable :: operating(:)
      type(observable_t), allocatable :: observable(:)
      !> Values of the parameter (points), frequencies, Hz (tones, points), phasors (observables, tones, points).
      real(wp), allocatable :: grid(:), hertz(:, :)
      complex(wp), allocatable :: value(:, :, :)
      !> Orders of the tones (tones), not a number where nothing rotates.
      real(wp), allocatable :: order(:)
      type(peak_t), allocatable :: peak(:)
      type(orbit_t), allocatable :: orbit(:)
   contains
      procedure :: columns
      procedure :: words
   end type response_t

   !> Relative error of the place of a peak, to which its amplitude is flat.
   real(wp), parameter :: place_error = 1.0e-8_wp
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
            if (peak%unbounded) then
               line = line//", where nothing damps it: the amplitude grows without bound there"
            else if (.not. ieee_is_nan(peak%factor)) then
               line = line//", amplification factor "//decimal(peak%factor, 2)
            end if
            if (.not. ieee_is_nan(peak%required)) line = line//", separation margin "//decimal(100*peak%margin, 1)// &
                                                         " %, asked for "//decimal(100*peak%required, 1)//" %"
         end associate
         call append_text(lines, line)
      end do
      if (size(self%peak) > most_lines) call append_text(lines, "and "// &
                                                         counted(to_text(size(self%peak) - most_lines), "more peak"))
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
