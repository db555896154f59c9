!! Frequencies of excitation of a scene, and what acts with each of them.
!!
!! Frequencies are formed in extended precision from values of the input and whole numbers; equal ones become one tone. Those
!! that are tied to the speed of &rotation change with it (razy_core_tone).
module razy_scenes_harmonics
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_tone, only: swept_tones, tone_from_hertz, tone_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_logical, add_real, add_string, group_spec_t, positive
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: add_frequency_keys, add_harmonic, add_harmonics, add_rotation_group, add_waveform, find_tone, frequency_t
   public :: harmonics_t, new_harmonics, read_frequency, read_rotation, take_harmonics

   !> A frequency at time 0, Hz, its rate, Hz/s, and its multiple of the speed of &rotation, 0 if it is not tied to that.
   type :: frequency_t
      real(qp) :: hertz = 0.0_qp, sweep = 0.0_qp, order = 0.0_qp
   end type frequency_t

   !> The tones met so far, and the phasors on rows (forces or contact errors) that belong to each.
   type :: harmonics_t
      integer :: count = 0
      type(frequency_t), allocatable :: frequency(:)
      type(tone_t), allocatable :: tone(:)
      !> Phasors (rows, tones): Re(phasor e^{iωt}).
      complex(wp), allocatable :: phasor(:, :)
      !> What harmonics of frequency zero add (rows).
      real(wp), allocatable :: constant(:)
      !> The speed of &rotation, 0 without it, and the end of the motion, s.
      type(frequency_t) :: rotation
      real(wp) :: t_end = 0.0_wp
      !> The longest period that is given to what has an amplitude of 0, s; 0 if there is none.
      real(wp) :: given_period = 0.0_wp
      !> Whether more than frequencies of tones follows from that speed.
      logical :: bound = .false.
   contains
      procedure :: of_order
      procedure :: set_speed
   end type harmonics_t

contains

   !> No tone yet, on `rows` rows.
   subroutine new_harmonics(self, rows, input)
      type(harmonics_t), intent(out) :: self
      integer, intent(in) :: rows
      type(input_t), intent(in) :: input

      real(wp) :: acceleration, speed

      allocate (self%frequency(0), self%tone(0), self%phasor(rows, 0))
      allocate (self%constant(rows), source=0.0_wp)
      call read_rotation(speed, acceleration, input)
      self%rotation = frequency_t(speed/60.0_qp, acceleration/60.0_qp)
      self%bound = abs(acceleration) > 0.0_wp
      call input%get("motion", 1, "t_end", self%t_end)
   end subroutine new_harmonics

   !> What &rotation says: the speed at time 0, rpm, and its rate, rpm/s; 0 without it.
   subroutine read_rotation(speed, acceleration, input)
      real(wp), intent(out) :: speed, acceleration
      type(input_t), intent(in) :: input

      speed = input%number("rotation", 1, "speed_rpm", otherwise=0.0_wp)
      acceleration = input%number("rotation", 1, "acceleration_rpm_per_s", otherwise=0.0_wp)
   end subroutine read_rotation

   !> The frequency of an order of the rotation.
   elemental function of_order(self, order) result(frequency)
      class(harmonics_t), intent(in) :: self
      real(qp), intent(in) :: order
      type(frequency_t) :: frequency

      frequency = frequency_t(order*self%rotation%hertz, order*self%rotation%sweep, order)
   end function of_order

   !> Take another speed of &rotation, rpm, as if all had been read with that; not `done` where more would change than the
   !> frequencies of the tones.
   pure subroutine set_speed(self, rpm, done)
      class(harmonics_t), intent(inout) :: self
      real(wp), intent(in) :: rpm
      logical, intent(out) :: done

      real(qp) :: hertz(self%count), speed
      integer :: t

      speed = rpm/60.0_qp
      done = .not. abs(speed - self%rotation%hertz) > 0.0_qp
      if (done .or. self%bound .or. .not. speed*self%rotation%hertz > 0.0_qp) return
      hertz = merge(self%frequency%order*speed, self%frequency%hertz, abs(self%frequency%order) > 0.0_qp)
      do t = 2, self%count
         ! Tones that meet become one; waveforms are none of these.
         if (hertz(t) > 0.0_qp .and. any(equal(hertz(t), hertz(:t - 1)))) return
      end do
      done = .true.
      self%rotation%hertz = speed
      do t = 1, self%count
         if (.not. abs(self%frequency(t)%order) > 0.0_qp) cycle
         self%frequency(t)%hertz = hertz(t)
         self%tone(t) = tone_from_hertz(hertz(t))
      end do
   end subroutine set_speed

   !> Whether two frequencies are equal to rounding.
   elemental logical function equal(a, b)
      real(qp), intent(in) :: a, b

      equal = .not. abs(a - b) > 4*epsilon(1.0_qp)*abs(a)
   end function equal

   !> Add cosine*cos(φ) + sine*sin(φ) to a row, φ = 2πft; a negative frequency turns the other way. `unbalance`: the negative second
   !> derivative of that, as the force of a mass that turns with φ; of a constant frequency it is (2πf)² times as much.
   pure subroutine add_harmonic(self, row, frequency, cosine, sine, unbalance)
      type(harmonics_t), intent(inout) :: self
      integer, intent(in) :: row
      type(frequency_t), intent(in) :: frequency
      real(wp), intent(in) :: cosine, sine
      logical, intent(in), optional :: unbalance

      real(wp) :: factor, turns
      integer :: t
      logical :: inertial

      inertial = .false.
      if (present(unbalance)) inertial = unbalance
      if (.not. (abs(cosine) > 0.0_wp .or. abs(sine) > 0.0_wp)) return
      if (.not. max(abs(frequency%hertz), abs(frequency%sweep)) > 0.0_qp) then
         if (.not. inertial) self%constant(row) = self%constant(row) + cosine
         return
      end if
      turns = sign(1.0_wp, real(merge(frequency%hertz, frequency%sweep, abs(frequency%hertz) > 0.0_qp), wp))
      call find_tone(self, frequency, t)
      factor = 1.0_wp
      if (inertial) factor = self%tone(t)%omega**2
      self%bound = self%bound .or. (inertial .and. abs(frequency%order) > 0.0_qp)
      if (inertial .and. self%tone(t)%is_swept()) then
         t = t + 2
         factor = -factor
      end if
      self%phasor(row, t) = self%phasor(row, t) + factor*cmplx(cosine, -turns*sine, wp)
   end subroutine add_harmonic

   !> The number of the tone of a frequency that is not 0 for ever, which is added if there is none, with its derivatives if it
   !> is swept.
   pure subroutine find_tone(self, frequency, t)
      type(harmonics_t), intent(inout) :: self
      type(frequency_t), intent(in) :: frequency
      integer, intent(out) :: t

      type(tone_t), allocatable :: fresh(:)
      type(frequency_t) :: wanted

      wanted = frequency
      if (frequency%hertz < 0.0_qp .or. (.not. frequency%hertz > 0.0_qp .and. frequency%sweep < 0.0_qp)) then
         wanted = frequency_t(-frequency%hertz, -frequency%sweep, -frequency%order)
      end if
      do t = 1, self%count
         if (.not. (equal(wanted%hertz, self%frequency(t)%hertz) .and. equal(wanted%sweep, self%frequency(t)%sweep))) cycle
         self%bound = self%bound .or. .not. equal(wanted%order, self%frequency(t)%order)
         return
      end do
      fresh = [tone_from_hertz(wanted%hertz)]
      if (abs(wanted%sweep) > 0.0_qp) fresh = swept_tones(wanted%hertz, wanted%sweep, self%t_end)
      call append(self, wanted, fresh)
   end subroutine find_tone

   !> Tones of one frequency, with which nothing acts yet.
   pure subroutine append(self, frequency, fresh)
      type(harmonics_t), intent(inout) :: self
      type(frequency_t), intent(in) :: frequency
      type(tone_t), intent(in) :: fresh(:)

      self%count = self%count + size(fresh)
      self%phasor = reshape(self%phasor, [size(self%constant), self%count], pad=[(0.0_wp, 0.0_wp)])
      self%frequency = [self%frequency, spread(frequency, 1, size(fresh))]
      self%tone = [self%tone, fresh]
   end subroutine append

   !> Add a tone that is a waveform u, with value*u on the first rows.
   pure subroutine add_waveform(self, tone, value)
      type(harmonics_t), intent(inout) :: self
      type(tone_t), intent(in) :: tone
      real(wp), intent(in) :: value(:)

      ! No sine has this frequency.
      call append(self, frequency_t(hertz=-1.0_qp), [tone])
      self%phasor(:size(value), self%count) = cmplx(value, 0.0_wp, wp)
   end subroutine add_waveform

   !> The same on the first rows, one for each of the numbers in `cosine` and `sine`.
   pure subroutine add_harmonics(self, frequency, cosine, sine, unbalance)
      type(harmonics_t), intent(inout) :: self
      type(frequency_t), intent(in) :: frequency
      real(wp), intent(in) :: cosine(:), sine(:)
      logical, intent(in), optional :: unbalance

      integer :: row

      do row = 1, size(cosine)
         call add_harmonic(self, row, frequency, cosine(row), sine(row), unbalance)
      end do
   end subroutine add_harmonics

   !> Give a machine its tones, and what they do: the rows are those of the coordinates, of the contacts, and of their modulation.
   pure subroutine take_harmonics(machine, self)
      type(machine_t), intent(inout) :: machine
      type(harmonics_t), intent(in) :: self

      integer :: i, n

      n = size(machine%load)
      machine%speed = 2*pi*real(self%rotation%hertz, wp)
      machine%acceleration = 2*pi*real(self%rotation%sweep, wp)
      machine%tone = self%tone
      machine%given_period = self%given_period
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

   !> Add the keys that give a frequency, of `what`.
   subroutine add_frequency_keys(schema, prefix, what)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: prefix, what

      call add_real(schema, prefix//"frequency", "frequency of "//what, unit="Hz", rule=positive)
      call add_real(schema, prefix//"angular_frequency", "frequency of "//what//", instead of "//prefix//"frequency", &
                    unit="rad/s", rule=positive)
      call add_real(schema, prefix//"order", "frequency in multiples of the speed of &rotation, instead of "//prefix//"frequency", &
                    rule=positive)
   end subroutine add_frequency_keys

   !> Add the group &rotation.
   subroutine add_rotation_group(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "rotation", "The mean speed of the machine, of wheels in the plane against the line of their "// &
                     "centres, and what it brings")
      call add_real(schema, "speed_rpm", "mean speed, of shafts about +x; of wheels whose centres a carrier moves, against the "// &
                    "carrier", unit="rpm", required=.true.)
      call add_real(schema, "acceleration_rpm_per_s", "rate of the speed, which is speed_rpm at time 0: a run-up, or a "// &
                    "run-down; not with integrator = 'exact'", unit="rpm/s", default="0.0")
      call add_string(schema, "of", "name of the inertia, body or shaft that has this speed; if left out, the first shaft")
      call add_logical(schema, "gyroscopic", "whether gyroscopic moments of shafts act", default=".true.")
      call add_logical(schema, "circulatory", "whether internal damping turns with the shaft, which adds the circulatory matrix", &
                       default=".false.")
   end subroutine add_rotation_group

   !> The frequency of `group` number i from the one of three keys (after `prefix`) that gives it.
   subroutine read_frequency(frequency, harmonics, input, group, i, prefix, needed, error)
      type(frequency_t), intent(out) :: frequency
      type(harmonics_t), intent(in) :: harmonics
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix
      integer, intent(in) :: i
      logical, intent(in) :: needed
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: keys(3) = [character(17) :: "frequency", "angular_frequency", "order"]
      real(wp) :: value
      logical :: given(3)
      integer :: k

      given = [(input%given(group, i, prefix//trim(keys(k))), k=1, 3)]
      if (needed .and. count(given) /= 1) then
         call input%complain(error, group, i, prefix//"amplitude", "one of "//prefix//"frequency, "//prefix// &
                             "angular_frequency and "//prefix//"order goes with an amplitude")
         return
      end if
      k = findloc(given, .true., dim=1)
      if (k == 0) return
      call input%get(group, i, prefix//trim(keys(k)), value)
      select case (k)
      case (1)
         frequency%hertz = value
      case (2)
         frequency%hertz = value/(2*acos(-1.0_qp))
      case default
         if (input%count("rotation") == 0) call input%complain(error, group, i, prefix//"order", "an order needs &rotation")
         if (allocated(error)) return
         frequency = harmonics%of_order(real(value, qp))
      end select
   end subroutine read_frequency

end module razy_scenes_harmonics
