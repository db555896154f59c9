!! Frequencies of excitation of a scene, and what acts with each of them.
!!
!! Frequencies are formed in extended precision from values of the input and whole numbers; equal ones become one tone.
module razy_scenes_harmonics
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: qp, wp
   use razy_core_schema, only: group_at
   use razy_core_tone, only: tone_from_hertz, tone_t
   implicit none(type, external)
   private

   public :: add_harmonic, harmonics_t, new_harmonics, read_load

   !> The tones met so far, and the phasors on rows (forces or contact errors) that belong to each.
   type :: harmonics_t
      integer :: count = 0
      real(qp), allocatable :: hertz(:)
      type(tone_t), allocatable :: tone(:)
      !> Phasors (rows, tones): Re(phasor e^{iωt}).
      complex(wp), allocatable :: phasor(:, :)
      !> What harmonics of frequency zero add (rows).
      real(wp), allocatable :: constant(:)
   end type harmonics_t

contains

   !> No tone yet, on `rows` rows.
   pure subroutine new_harmonics(self, rows)
      type(harmonics_t), intent(out) :: self
      integer, intent(in) :: rows

      allocate (self%hertz(0), self%tone(0), self%phasor(rows, 0))
      allocate (self%constant(rows), source=0.0_wp)
   end subroutine new_harmonics

   !> Add cosine*cos(2πft) + sine*sin(2πft) to a row; a negative frequency turns the other way.
   pure subroutine add_harmonic(self, row, hertz, cosine, sine)
      type(harmonics_t), intent(inout) :: self
      integer, intent(in) :: row
      real(qp), intent(in) :: hertz
      real(wp), intent(in) :: cosine, sine

      complex(wp), allocatable :: larger(:, :)
      integer :: t, rows

      rows = size(self%constant)
      if (.not. (abs(cosine) > 0.0_wp .or. abs(sine) > 0.0_wp)) return
      if (.not. abs(hertz) > 0.0_qp) then
         self%constant(row) = self%constant(row) + cosine
         return
      end if
      do t = 1, self%count
         if (.not. abs(abs(hertz) - self%hertz(t)) > 4*epsilon(1.0_qp)*abs(hertz)) exit
      end do
      if (t > self%count) then
         self%count = t
         self%hertz = [self%hertz, abs(hertz)]
         self%tone = [self%tone, tone_from_hertz(abs(hertz))]
         allocate (larger(rows, t), source=(0.0_wp, 0.0_wp))
         larger(:, :t - 1) = self%phasor
         call move_alloc(larger, self%phasor)
      end if
      self%phasor(row, t) = self%phasor(row, t) + cmplx(cosine, -sign(1.0_wp, real(hertz, wp))*sine, wp)
   end subroutine add_harmonic

   !> What `&load` number i says: value + cosine*cos(2πft) + sine*sin(2πft), N or N m, f in `hertz`.
   subroutine read_load(input, i, value, cosine, sine, hertz, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      real(wp), intent(out) :: value, cosine, sine
      real(qp), intent(out) :: hertz
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: amplitude, phase

      call input%get("load", i, "value", value)
      call input%get("load", i, "amplitude", amplitude)
      call input%get("load", i, "phase", phase)
      phase = phase*acos(-1.0_wp)/180
      cosine = amplitude*sin(phase)
      sine = amplitude*cos(phase)
      call load_frequency(input, i, abs(amplitude) > 0.0_wp, hertz, error)
   end subroutine read_load

   !> The frequency of load i, Hz, from the one of three keys that gives it.
   subroutine load_frequency(input, i, needed, hertz, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      logical, intent(in) :: needed
      real(qp), intent(out) :: hertz
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: value, speed

      hertz = 0.0_qp
      if (count([input%given("load", i, "frequency"), input%given("load", i, "angular_frequency"), &
                 input%given("load", i, "order")]) /= merge(1, 0, needed)) then
         if (needed) call input%complain(error, "load", i, "amplitude", "one of "//frequencies(input)//" goes with an amplitude")
         if (needed) return
      end if
      if (input%given("load", i, "frequency")) then
         call input%get("load", i, "frequency", value)
         hertz = value
      else if (input%given("load", i, "angular_frequency")) then
         call input%get("load", i, "angular_frequency", value)
         hertz = value/(2*acos(-1.0_qp))
      else if (input%given("load", i, "order")) then
         if (input%count("rotation") == 0) then
            call input%complain(error, "load", i, "order", "an order needs &rotation")
            return
         end if
         call input%get("load", i, "order", value)
         call input%get("rotation", 1, "speed_rpm", speed)
         hertz = real(value, qp)*speed/60
      end if
   end subroutine load_frequency

   !> The keys that may give the frequency; only a scene with a mean speed has orders.
   pure function frequencies(input) result(text)
      type(input_t), intent(in) :: input
      character(:), allocatable :: text

      text = "frequency and angular_frequency"
      if (group_at(input%schema, "rotation") > 0) text = "frequency, angular_frequency and order"
   end function frequencies

end module razy_scenes_harmonics
