!! Loads on the coordinates of a machine, for every kind of scene: &load.
module razy_scenes_loads
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_tone, only: tone_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_real, add_string, group_spec_t
   use razy_machine_machine, only: machine_t
   use razy_scenes_harmonics, only: add_frequency_keys, add_harmonics, add_waveform, frequency_t, harmonics_t, read_frequency
   use razy_scenes_scene, only: coordinate_t, scene_t
   use razy_scenes_shapes, only: add_shape_keys, read_shape
   implicit none(type, external)
   private

   public :: add_load_group, add_loads

contains

   !> Add the group &load; `on` says what a load acts on.
   subroutine add_load_group(schema, on)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)
      character(*), intent(in) :: on
      call add_group(schema, "load", "A force or moment: value + amplitude*sin(2 pi f t + phase), or another shape", &
                     repeatable=.true.)
      call add_string(schema, "on", on, required=.true.)
      call add_real(schema, "value", "constant part", unit="N or N m", default="0.0")
      call add_real(schema, "amplitude", "amplitude of the harmonic part", unit="N or N m", default="0.0")
      call add_real(schema, "unbalance", "amplitude over the square of the angular frequency, added to amplitude", &
                    unit="kg m or kg m^2", default="0.0")
      call add_real(schema, "phase", "phase of the harmonic part", unit="deg", default="0.0")
      call add_frequency_keys(schema, "", "the harmonic part")
      call add_shape_keys(schema, "", "the harmonic part", "N or N m")
   end subroutine add_load_group

   !> Add the loads, value + (amplitude + unbalance (2πf)²) sin(2πft + phase), or value + amplitude times another shape, to those of
   !> the machine and to the harmonics.
   subroutine add_loads(machine, scene, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(coordinate_t) :: on
      real(wp) :: amplitude, factor, phase, unbalance, value
      complex(wp) :: at
      type(frequency_t) :: frequency
      type(tone_t) :: tone
      integer :: i
      logical :: shaped

      do i = 1, input%count("load")
         call scene%find_coordinate(on, input, "load", i, "on", error)
         if (allocated(error)) return
         call input%get("load", i, "value", value)
         call input%get("load", i, "amplitude", amplitude)
         call input%get("load", i, "unbalance", unbalance)
         call input%get("load", i, "phase", phase)
         shaped = input%choice("load", i, "shape") /= "sine" .or. input%given("load", i, "file")
         call read_frequency(frequency, harmonics, input, "load", i, "", &
                             .not. shaped .and. max(abs(amplitude), abs(unbalance)) > 0.0_wp, error)
         if (.not. allocated(error)) call read_shape(tone, factor, shaped, frequency, input, "load", i, "", &
                                                     "N or N m", error)
         if (allocated(error)) return
         machine%load = machine%load + value*on%row
         if (shaped) then
            if (abs(unbalance) > 0.0_wp) then
               call input%complain(error, "load", i, "unbalance", "0: it is that of a sine")
            else if (.not. input%given("load", i, "amplitude")) then
               call input%complain(error, "load", i, "amplitude", "required with a shape or file, which it multiplies")
            end if
            if (allocated(error)) return
            call add_waveform(harmonics, tone, factor*amplitude*on%row)
            cycle
         end if
         at = turn(phase)
         call add_harmonics(harmonics, frequency, amplitude*at%im*on%row, amplitude*at%re*on%row)
         call add_harmonics(harmonics, frequency, unbalance*at%im*on%row, unbalance*at%re*on%row, unbalance=.true.)
      end do
   end subroutine add_loads

end module razy_scenes_loads
