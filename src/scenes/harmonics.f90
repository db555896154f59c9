!! Frequencies of excitation of a scene, and what acts with each of them.
!!
!! Frequencies are formed in extended precision from values of the input and whole numbers; equal ones become one tone.
module razy_scenes_harmonics
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_tone, only: tone_from_hertz, tone_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, group_at, group_spec_t, positive
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: add_frequency_keys, add_harmonic, add_harmonics, find_tone, harmonics_t, new_harmonics, read_frequency, take_harmonics

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

      integer :: t

      if (.not. (abs(cosine) > 0.0_wp .or. abs(sine) > 0.0_wp)) return
      if (.not. abs(hertz) > 0.0_qp) then
         self%constant(row) = self%constant(row) + cosine
         return
      end if
      call find_tone(self, hertz, t)
      self%phasor(row, t) = self%phasor(row, t) + cmplx(cosine, -sign(1.0_wp, real(hertz, wp))*sine, wp)
   end subroutine add_harmonic

   !> The number of the tone of a frequency that is not 0, which is added if there is none.
   pure subroutine find_tone(self, hertz, t)
      type(harmonics_t), intent(inout) :: self
      real(qp), intent(in) :: hertz
      integer, intent(out) :: t

      complex(wp), allocatable :: larger(:, :)

      do t = 1, self%count
         if (.not. abs(abs(hertz) - self%hertz(t)) > 4*epsilon(1.0_qp)*abs(hertz)) exit
      end do
      if (t > self%count) then
         self%count = t
         self%hertz = [self%hertz, abs(hertz)]
         self%tone = [self%tone, tone_from_hertz(abs(hertz))]
         allocate (larger(size(self%constant), t), source=(0.0_wp, 0.0_wp))
         larger(:, :t - 1) = self%phasor
         call move_alloc(larger, self%phasor)
      end if
   end subroutine find_tone

   !> The same on the first rows, one for each of the numbers in `cosine` and `sine`.
   pure subroutine add_harmonics(self, hertz, cosine, sine)
      type(harmonics_t), intent(inout) :: self
      real(qp), intent(in) :: hertz
      real(wp), intent(in) :: cosine(:), sine(:)

      integer :: row

      do row = 1, size(cosine)
         call add_harmonic(self, row, hertz, cosine(row), sine(row))
      end do
   end subroutine add_harmonics

   !> Give a machine its tones, and what they do: the rows are those of the coordinates, of the contacts, and of their modulation.
   pure subroutine take_harmonics(machine, self)
      type(machine_t), intent(inout) :: machine
      type(harmonics_t), intent(in) :: self

      integer :: i, n

      n = size(machine%load)
      machine%tone = self%tone
      machine%harmonic_load = self%phasor(:n, :)
      machine%load = machine%load + self%constant(:n)
      do i = 1, size(machine%contact)
         machine%contact(i)%error = self%phasor(n + i, :)
         machine%contact(i)%offset = self%constant(n + i)
         associate (modulation => self%phasor(n + size(machine%contact) + i, :))
            if (any(abs(modulation) > 0.0_wp)) machine%contact(i)%modulation = modulation
         end associate
      end do
   end subroutine take_harmonics

   !> Add the keys that give a frequency, of `what`; `orders`: the scene has a mean speed.
   subroutine add_frequency_keys(schema, prefix, what, orders)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: prefix, what
      logical, intent(in) :: orders
      call add_real(schema, prefix//"frequency", "frequency of "//what, unit="Hz", rule=positive)
      call add_real(schema, prefix//"angular_frequency", "frequency of "//what//", instead of "//prefix//"frequency", &
                    unit="rad/s", rule=positive)
      if (.not. orders) return
      call add_real(schema, prefix//"order", "frequency in multiples of the speed of &rotation, instead of "//prefix//"frequency", &
                    rule=positive)
   end subroutine add_frequency_keys

   !> The frequency of `group` number i, Hz, from the one of three keys (after `prefix`) that gives it.
   subroutine read_frequency(hertz, input, group, i, prefix, needed, error)
      real(qp), intent(out) :: hertz
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix
      integer, intent(in) :: i
      logical, intent(in) :: needed
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: keys(3) = [character(17) :: "frequency", "angular_frequency", "order"]
      real(wp) :: value, speed
      logical :: given(3)
      integer :: k

      hertz = 0.0_qp
      do k = 1, 3
         given(k) = input%given(group, i, prefix//trim(keys(k)))
      end do
      if (needed .and. count(given) /= 1) then
         call input%complain(error, group, i, prefix//"amplitude", "one of "//frequencies(input, prefix)//" goes with an amplitude")
         return
      end if
      k = findloc(given, .true., dim=1)
      if (k == 0) return
      call input%get(group, i, prefix//trim(keys(k)), value)
      select case (k)
      case (1)
         hertz = value
      case (2)
         hertz = value/(2*acos(-1.0_qp))
      case default
         if (input%count("rotation") == 0) then
            call input%complain(error, group, i, prefix//"order", "an order needs &rotation")
            return
         end if
         call input%get("rotation", 1, "speed_rpm", speed)
         hertz = real(value, qp)*speed/60
      end select
   end subroutine read_frequency

   !> The keys that may give the frequency; only a scene with a mean speed has orders.
   pure function frequencies(input, prefix) result(text)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: prefix
      character(:), allocatable :: text

      text = prefix//"frequency and "//prefix//"angular_frequency"
      if (input%knows("rotation")) text = prefix//"frequency, "//prefix//"angular_frequency and "//prefix//"order"
   end function frequencies

end module razy_scenes_harmonics
