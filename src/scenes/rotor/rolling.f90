!! Rolling elements of bearings with clearance: contacts one by one, which turn with the cage.
!!
!! Element j stands at δ = δ₁ + 2π (j - 1)/Z + Ω_c t and is pressed by what the rings come nearer there,
!!
!!     Q = K pⁿ,   p = v cos δ + w sin δ - clearance,   Ω_c = κ Ω + (1 - κ) Ω_to,   κ = (1 - d/D)/2,
!!
!! with v and w of the shaft against the other end, whose speed is Ω_to, and the diameters d and D of balls and pitch circle; the
!! cage rolls between both rings without slip, at contact angle 0 (Harris and Kotzalas, Essential Concepts of Bearing Technology,
!! 2007, chapter 10). Masses of elements, their lubrication and the friction of rolling are left out.
module razy_scenes_rotor_rolling
   use razy_contact_power_law, only: new_power_law, power_side_t
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: to_text
   use razy_input_input, only: input_t
   use razy_machine_frame, only: frame_t
   use razy_machine_machine, only: machine_t
   use razy_rotor_bearing, only: radial_direction
   use razy_rotor_model, only: rotor_model_t
   use razy_scenes_harmonics, only: find_tone, frequency_t, harmonics_t
   use razy_scenes_rotor_bearings, only: exponents, read_radial
   use razy_scenes_rotor_schema, only: bearing_kinds, bearing_rolling
   implicit none(type, external)
   private

   public :: add_elements, elements_of

contains

   !> How many rolling elements have clearance.
   integer function elements_of(input)
      type(input_t), intent(in) :: input

      integer :: i

      elements_of = 0
      do i = 1, input%count("bearing")
         if (input%given("bearing", i, "clearance")) elements_of = elements_of + input%whole("bearing", i, "elements")
      end do
   end function elements_of

   !> Make them the contacts of a machine that stand before those of friction; `basis` (coordinates of the model, of the machine),
   !> `ratio` (shafts): speeds of the shafts over that of `&rotation`.
   subroutine add_elements(machine, model, basis, ratio, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: basis(:, :)
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(power_side_t) :: side
      character(:), allocatable :: name
      complex(wp) :: at
      real(wp) :: offset, rows(6, size(basis, 2)), turns
      integer :: elements, i, j, k, last, tone

      last = size(machine%contact) - input%count("friction") - elements_of(input)
      do i = 1, input%count("bearing")
         if (.not. input%given("bearing", i, "clearance")) cycle
         call input%get("bearing", i, "elements", elements)
         call read_side(side, input, i, error)
         if (.not. allocated(error)) call find_cage(tone, turns, model, ratio, input, i, harmonics, error)
         if (allocated(error)) return
         do k = 1, size(rows, 2)
            rows(:, k) = model%numbering%stretch(model%rotor%bearing(i), basis(:, k))
         end do
         if (.not. (any(abs(rows(2:3, :)) > 0.0_wp) .and. model%have_mass(model%numbering%ends(model%rotor%bearing(i))))) then
            call input%complain(error, "bearing", i, "node", "one that can move across the axis, with mass and inertia")
            return
         end if
         call input%get("bearing", i, "offset", offset)
         call input%get("bearing", i, "name", name)
         if (len(name) == 0) name = "bearing "//to_text(i)
         do j = 1, elements
            at = turn(input%number("bearing", i, "first_angle") + 360.0_wp*(j - 1)/elements)
            associate (contact => machine%contact(last + j))
               contact%name = name//"."//to_text(j)
               contact%w = matmul(radial_direction(at, offset), rows)
               if (tone > 0) contact%frame = frame_t(turns*matmul(radial_direction(at*(0.0_wp, 1.0_wp), offset), rows), &
                                                     0*contact%w, tone=tone)
               contact%law = new_power_law(power_side_t(), side, .true.)
               contact%unit = "m"
               contact%force_unit = "N"
            end associate
         end do
         last = last + elements
      end do
   end subroutine add_elements

   !> The law of each element of bearing i.
   subroutine read_side(side, input, i, error)
      type(power_side_t), intent(out) :: side
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: radial
      integer :: kind

      kind = findloc(bearing_kinds == input%choice("bearing", i, "kind"), .true., dim=1)
      if (kind == bearing_rolling .and. input%given("bearing", i, "contact_stiffness")) then
         call input%complain(error, "bearing", i, "contact_stiffness", "left out with kind = 'rolling': radial_stiffness")
         return
      end if
      side = power_side_t(.true., exponent=exponents(kind))
      call input%get("bearing", i, "clearance", side%edge)
      call input%get("bearing", i, "hysteresis", side%hysteresis)
      call read_radial(radial, input, i, kind, 1.0_wp, error)
      side%stiffness = (radial/side%exponent)**side%exponent
   end subroutine read_side

   !> The tone with which the cage of bearing i turns, 0 if it does not, and in which sense, +1 from y towards z.
   subroutine find_cage(tone, turns, model, ratio, input, i, harmonics, error)
      integer, intent(out) :: tone
      real(wp), intent(out) :: turns
      type(rotor_model_t), intent(in) :: model
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(frequency_t) :: frequency
      real(qp) :: speed(2)
      real(wp) :: cage
      integer :: end

      tone = 0
      cage = -1.0_wp
      if (input%given("bearing", i, "ball_diameter") .and. input%given("bearing", i, "pitch_diameter")) then
         cage = (1 - input%number("bearing", i, "ball_diameter")/input%number("bearing", i, "pitch_diameter"))/2
      end if
      call input%get("bearing", i, "cage_ratio", cage)
      if (cage < 0.0_wp) then
         call input%complain(error, "bearing", i, "cage_ratio", "required with a clearance, where ball_diameter and a larger "// &
                             "pitch_diameter do not give it: speed of the cage over that of the shaft, about 0.4")
         return
      end if
      speed = 0.0_qp
      associate (shaft => [model%rotor%bearing(i)%shaft, model%rotor%bearing(i)%to_shaft])
         do end = 1, 2
            if (shaft(end) == 0 .or. input%count("rotation") == 0) cycle
            speed(end) = ratio(shaft(end))
            if (model%rotor%shaft(shaft(end))%speed_known .or. .not. model%rotor%shaft(shaft(end))%turns) cycle
            call input%complain(error, "bearing", i, "clearance", "with shafts whose speeds are known, from teeth or speed_ratio")
            return
         end do
      end associate
      frequency = harmonics%of_order(cage*speed(1) + (1 - cage)*speed(2))
      turns = sign(1.0_wp, real(merge(frequency%hertz, frequency%sweep, abs(frequency%hertz) > 0.0_qp), wp))
      if (max(abs(frequency%hertz), abs(frequency%sweep)) > 0.0_qp) call find_tone(harmonics, frequency, tone)
   end subroutine find_cage

end module razy_scenes_rotor_rolling
