!! Shapes of excitation other than a sine: periodic or once, from keys or from a file. Each is one more tone of the machine
!! (razy_core_waveform).
module razy_scenes_shapes
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_text, only: string_t
   use razy_core_text_columns, only: read_text_columns
   use razy_core_tone, only: tone_from_waveform, tone_t
   use razy_core_waveform, only: half_sine, polyline, waveform_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, add_string, group_spec_t, nonnegative, positive
   use razy_scenes_harmonics, only: add_frequency_keys, add_harmonics, add_waveform, frequency_t, harmonics_t, read_frequency
   implicit none(type, external)
   private

   public :: add_course, add_motion_keys, add_shape_keys, is_shaped

   character(*), parameter :: shapes(5) = [character(9) :: "sine", "square", "half_sine", "ramp", "pulse"]
   !> Keys that belong to some shapes, and to which.
   character(*), parameter :: keys(6) = [character(13) :: "duty", "duration", "rise", "delay", "interpolation", "beyond"]
   character(*), parameter :: formed = "half_sine, ramp, pulse", begun = "square, "//formed//", file"
   character(*), parameter :: goes_with(6) = [character(36) :: "square", formed, "pulse", begun, "file", "file"]
   !> A duration may be longer than the period by its rounding.
   real(wp), parameter :: rounding = 1.0e-12_wp

contains

   !> Add the keys of a shape, each after `prefix`, of `what` with values in `unit`.
   subroutine add_shape_keys(schema, prefix, what, unit)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: prefix, what, unit

      call add_string(schema, prefix//"shape", "of "//what//", with "//prefix//"amplitude a: a sine; a for the share duty of "// &
                      "each period, else -a; half a sine; from 0 to a, which stays; from 0 to a and back. The last three come "// &
                      "once, or, with a frequency, in each period", choices=shapes, default="sine")
      call add_real(schema, prefix//"duty", "of a square: share of the period; 0.5 if not given", high=1.0_wp, rule=positive)
      call add_real(schema, prefix//"duration", "of a half sine, of the rise of a ramp, of a whole pulse", unit="s", rule=positive)
      call add_real(schema, prefix//"rise", "of a pulse: time in which it rises, and falls; 0 if not given", unit="s", &
                    rule=nonnegative)
      call add_real(schema, prefix//"delay", "when the shape, or the file, begins; 0 if not given", unit="s", rule=nonnegative)
      call add_string(schema, prefix//"file", what//" from a table, instead of a shape: comma-separated text with the columns "// &
                      "time [s], from 0 on, and value ["//unit//"]; "//prefix//"amplitude multiplies it")
      call add_string(schema, prefix//"interpolation", "between rows of the file, 'cubic' not by 'exact'; 'linear' if "// &
                      "not given", choices=["linear", "held  ", "cubic "])
      call add_string(schema, prefix//"beyond", "after the last row of the file, which without this is not before the end of "// &
                      "the motion: hold, zero, or periodic with that row as the end of the period", &
                      choices=["hold    ", "zero    ", "periodic"])
   end subroutine add_shape_keys

   !> Add the keys of a motion over time, of `what`, after motion_.
   subroutine add_motion_keys(schema, what)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: what

      call add_real(schema, "motion_amplitude", "amplitude of "//what, unit="m or rad", default="0.0")
      call add_real(schema, "motion_phase", "phase of that motion", unit="deg", default="0.0")
      call add_frequency_keys(schema, "motion_", "that motion")
      call add_shape_keys(schema, "motion_", "that motion", "m or rad")
   end subroutine add_motion_keys

   !> Whether the course of `group` number i, which the keys after `prefix` give, is none of sines.
   logical function is_shaped(input, group, i, prefix)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix
      integer, intent(in) :: i

      is_shaped = input%choice(group, i, prefix//"shape") /= "sine" .or. input%given(group, i, prefix//"file")
   end function is_shaped

   !> Add `row` times (amplitude + unbalance (2πf)²) sin(2πft + phase), or amplitude times another shape, one that does not jump if
   !> it has to be `continuous`, to the first rows of the harmonics. Values of a file are in a `unit`, such as `N or N m`.
   subroutine add_course(harmonics, row, continuous, input, group, i, prefix, unit, error)
      type(harmonics_t), intent(inout) :: harmonics
      real(wp), intent(in) :: row(:)
      logical, intent(in) :: continuous
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix, unit
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: amplitude, factor, unbalance
      complex(wp) :: at
      type(frequency_t) :: frequency
      type(tone_t) :: tone
      logical :: shaped

      call input%get(group, i, prefix//"amplitude", amplitude)
      ! A key that only loads have.
      unbalance = input%number(group, i, "unbalance", otherwise=0.0_wp)
      shaped = is_shaped(input, group, i, prefix)
      call read_frequency(frequency, harmonics, input, group, i, prefix, &
                          .not. shaped .and. max(abs(amplitude), abs(unbalance)) > 0.0_wp, error)
      if (.not. allocated(error)) call read_shape(tone, factor, frequency, input, group, i, prefix, unit, error)
      if (allocated(error)) return
      if (frequency%hertz > 0.0_qp .and. .not. max(abs(amplitude), abs(unbalance)) > 0.0_wp) then
         harmonics%given_period = max(harmonics%given_period, real(1.0_qp/frequency%hertz, wp))
         harmonics%bound = harmonics%bound .or. abs(frequency%order) > 0.0_qp
      end if
      if (.not. shaped) then
         at = turn(input%number(group, i, prefix//"phase"))
         call add_harmonics(harmonics, frequency, amplitude*at%im*row, amplitude*at%re*row)
         call add_harmonics(harmonics, frequency, unbalance*at%im*row, unbalance*at%re*row, unbalance=.true.)
      else if (abs(unbalance) > 0.0_wp) then
         call input%complain(error, group, i, "unbalance", "0: it is that of a sine")
      else if (.not. input%given(group, i, prefix//"amplitude")) then
         call input%complain(error, group, i, prefix//"amplitude", "required with a shape or file, which it multiplies")
      else if (continuous .and. any(tone%waveform%steps())) then
         call input%complain(error, group, i, prefix//trim(merge("file ", "shape", input%given(group, i, prefix//"file"))), &
                             "one without jumps, such as a ramp")
      else
         call add_waveform(harmonics, tone, factor*amplitude*row)
         harmonics%bound = harmonics%bound .or. abs(frequency%order) > 0.0_qp
      end if
   end subroutine add_course

   !> The tone of `group` number i, by whose E the amplitude times `factor` is multiplied, if it is none of sines. The
   !> frequency is that of its other keys.
   subroutine read_shape(tone, factor, frequency, input, group, i, prefix, unit, error)
      type(tone_t), intent(out) :: tone
      real(wp), intent(out) :: factor
      type(frequency_t), intent(in) :: frequency
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix, unit
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: shape
      real(wp) :: delay
      type(waveform_t) :: wave

      factor = 1.0_wp
      shape = input%choice(group, i, prefix//"shape")
      if (input%given(group, i, prefix//"file")) then
         if (shape /= "sine") call input%complain(error, group, i, prefix//"shape", "not given with "//prefix//"file")
         shape = "file"
      end if
      if (.not. allocated(error)) call check_keys(shape, frequency, input, group, i, prefix, error)
      if (allocated(error) .or. shape == "sine") return
      delay = input%number(group, i, prefix//"delay", otherwise=0.0_wp)
      if (shape == "file") then
         call read_file(wave, factor, delay, input, group, i, prefix, unit, error)
      else
         call form(wave, factor, shape, frequency%hertz, input, group, i, prefix, error)
      end if
      if (allocated(error)) return
      wave%delay = delay
      tone = tone_from_waveform(wave)
   end subroutine read_shape

   !> Whether what is given goes with the shape.
   subroutine check_keys(shape, frequency, input, group, i, prefix, error)
      character(*), intent(in) :: shape, group, prefix
      type(frequency_t), intent(in) :: frequency
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      do k = 1, size(keys)
         if (.not. input%given(group, i, prefix//trim(keys(k)))) cycle
         if (index(", "//goes_with(k), ", "//shape) > 0) cycle
         call input%complain(error, group, i, prefix//trim(keys(k)), "not given: it goes with "//trim(goes_with(k)))
         return
      end do
      if (shape == "sine") return
      if (abs(frequency%sweep) > 0.0_qp) then
         call input%complain(error, group, i, prefix//"order", "a sine where &rotation has an acceleration_rpm_per_s")
      else if (abs(input%number(group, i, prefix//"phase")) > 0.0_wp) then
         call input%complain(error, group, i, prefix//"phase", "0: a shape has a delay")
      else if (shape == "file" .and. frequency%hertz > 0.0_qp) then
         call input%complain(error, group, i, prefix//"file", "without a frequency: its period is the time of its last row")
      else if (shape == "square" .and. .not. frequency%hertz > 0.0_qp) then
         call input%complain(error, group, i, prefix//"shape", "'square' with a frequency")
      else if (index(goes_with(2), shape) > 0 .and. .not. input%given(group, i, prefix//"duration")) then
         call input%complain(error, group, i, prefix//"duration", "required for shape = '"//shape//"'")
      end if
   end subroutine check_keys

   !> A shape, periodic if `hertz` is not 0.
   subroutine form(wave, factor, shape, hertz, input, group, i, prefix, error)
      type(waveform_t), intent(out) :: wave
      real(wp), intent(out) :: factor
      character(*), intent(in) :: shape, group, prefix
      real(qp), intent(in) :: hertz
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: duration, period, rise

      factor = 1.0_wp
      period = 0.0_wp
      if (hertz > 0.0_qp) period = real(1.0_qp/hertz, wp)
      if (shape == "square") then
         call polyline(wave, factor, [0.0_wp, period*input%number(group, i, prefix//"duty", otherwise=0.5_wp)], &
                       [1.0_wp, -1.0_wp], [1.0_wp, -1.0_wp], period)
      else
         call input%get(group, i, prefix//"duration", duration)
         if (period > 0.0_wp .and. duration > (1 + rounding)*period) then
            call input%complain(error, group, i, prefix//"duration", "no more than a period, "//to_text(period)//" s")
            return
         end if
         select case (shape)
         case ("half_sine")
            wave = half_sine(duration)
         case ("ramp")
            call polyline(wave, factor, [0.0_wp, duration], [0.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], period)
         case default
            rise = input%number(group, i, prefix//"rise", otherwise=0.0_wp)
            if (rise > 0.5_wp*duration) then
               call input%complain(error, group, i, prefix//"rise", "no more than half of duration, in which the pulse falls again")
               return
            end if
            call polyline(wave, factor, [0.0_wp, rise, duration - rise, duration], [0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp], &
                          [1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp], period)
         end select
      end if
      wave%hertz = hertz
   end subroutine form

   !> A table, from its file.
   subroutine read_file(wave, factor, delay, input, group, i, prefix, unit, error)
      type(waveform_t), intent(out) :: wave
      real(wp), intent(out) :: factor
      real(wp), intent(in) :: delay
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, prefix, unit
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: beyond, file
      real(wp), allocatable :: rates(:, :), rows(:, :), to(:)
      real(wp) :: period, t_end
      integer :: j, last, n

      factor = 1.0_wp
      call input%get(group, i, prefix//"file", file)
      call read_text_columns(file, [string_t("time [s]"), string_t("value ["//unit//"]")], rows, error)
      if (allocated(error)) return
      n = size(rows, 1)
      if (n < 2) then
         call input%complain(error, group, i, prefix//"file", "a file with two rows or more")
      else if (abs(rows(1, 1)) > 0.0_wp) then
         call input%complain(error, group, i, prefix//"file", "a file whose first time is 0; that of '"//file//"' is "// &
                             to_text(rows(1, 1)))
      end if
      if (allocated(error)) return
      j = 1 + findloc(rows(2:, 1) > rows(:n - 1, 1), .false., dim=1)
      if (j > 1) call input%complain(error, group, i, prefix//"file", "a file whose time rises from row to row; row "// &
                                     to_text(j)//" of '"//file//"' has "//to_text(rows(j, 1)))
      if (allocated(error)) return
      beyond = input%choice(group, i, prefix//"beyond")
      t_end = input%number("motion", 1, "t_end", otherwise=0.0_wp)
      if (beyond == "" .and. delay + rows(n, 1) < t_end) then
         call input%complain(error, group, i, prefix//"beyond", "required: '"//file//"' ends at "// &
                             decimal(delay + rows(n, 1), 6)//" s, before the motion")
         return
      end if
      ! As a period a table ends with its last row.
      last = merge(n - 1, n, beyond == "periodic")
      period = merge(rows(n, 1), 0.0_wp, beyond == "periodic")
      to = [rows(2:, 2), rows(n, 2)]
      if (input%choice(group, i, prefix//"interpolation") == "held") to = rows(:, 2)
      if (input%choice(group, i, prefix//"interpolation") == "cubic") then
         if (last < n .and. abs(rows(n, 2) - rows(1, 2)) > 0.0_wp) then
            call input%complain(error, group, i, prefix//"file", "a file whose last value is the first, as a period ends")
            return
         end if
         rates = spline_rates(rows(:, 1), rows(:, 2), last)
      end if
      if (beyond == "zero") rows(n, 2) = 0.0_wp
      if (beyond == "zero") to(n) = 0.0_wp
      call polyline(wave, factor, rows(:last, 1), rows(:last, 2), to(:last), period, rates)
      if (period > 0.0_wp) wave%hertz = 1/real(period, qp)
   end subroutine read_file

   !> The rates at both ends of the `last` lines of the cubic spline through u(t): natural and then held, or periodic if there is no
   !> line after its last point.
   pure function spline_rates(t, u, last) result(rates)
      real(wp), intent(in) :: t(:), u(:)
      integer, intent(in) :: last
      real(wp) :: rates(last, 2)

      real(wp) :: rate(size(t))
      real(wp), dimension(0:size(t)) :: slope, weight
      integer :: k, n, sweep

      n = size(t)
      weight = 0.0_wp
      weight(1:n - 1) = 1/(t(2:) - t(:n - 1))
      slope(1:n - 1) = (u(2:) - u(:n - 1))*weight(1:n - 1)
      slope([0, n]) = slope([n - 1, 1])
      if (last < n) weight([0, n]) = weight([n - 1, 1])
      rate = slope(1:)
      ! Gauss and Seidel: twice as much weight is on each rate as on those beside it, so that a sweep halves the error.
      do sweep = 1, digits(rate)
         do k = 1, n
            associate (before => rate(merge(n - 1, k - 1, k == 1)), after => rate(merge(2, k + 1, k == n)))
               rate(k) = (weight(k - 1)*(3*slope(k - 1) - before) + weight(k)*(3*slope(k) - after))/(2*(weight(k - 1) + weight(k)))
            end associate
         end do
      end do
      rates = 0.0_wp
      rates(:n - 1, :) = reshape([rate(:n - 1), rate(2:)], [n - 1, 2])
   end function spline_rates

end module razy_scenes_shapes
