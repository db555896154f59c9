!! Loads on the coordinates of a machine, for every kind of scene: &load.
module razy_scenes_loads
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_real, add_string, group_spec_t
   use razy_scenes_harmonics, only: add_frequency_keys, harmonics_t
   use razy_scenes_scene, only: coordinate_t, scene_t
   use razy_scenes_shapes, only: add_course, add_shape_keys
   implicit none(type, external)
   private

   public :: add_load_group, add_loads

contains

   !> Add the group &load.
   subroutine add_load_group(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "load", "A force or moment: value + amplitude*sin(2 pi f t + phase), or another shape", &
                     repeatable=.true.)
      call add_string(schema, "on", "name of a mass or inertia, of a coordinate such as 'table.y', of a point with .x or .y, "// &
                      "of a place of a shaft with u, v, w, phi, theta or psi, such as 'input.8.phi'", required=.true.)
      call add_real(schema, "value", "constant part", unit="N or N m", default="0.0")
      call add_real(schema, "amplitude", "amplitude of the harmonic part", unit="N or N m", default="0.0")
      call add_real(schema, "unbalance", "amplitude over the square of the angular frequency, added to amplitude", &
                    unit="kg m or kg m^2", default="0.0")
      call add_real(schema, "phase", "phase of the harmonic part", unit="deg", default="0.0")
      call add_frequency_keys(schema, "", "the harmonic part")
      call add_shape_keys(schema, "", "the harmonic part", "N or N m")
   end subroutine add_load_group

   !> Add the loads, value + (amplitude + unbalance (2πf)²) sin(2πft + phase), or value + amplitude times another shape, to the
   !> harmonics.
   subroutine add_loads(scene, input, harmonics, error)
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(coordinate_t) :: on
      integer :: i

      do i = 1, input%count("load")
         call scene%find_coordinate(on, input, "load", i, "on", error)
         if (.not. allocated(error)) call add_course(harmonics, on%row, .false., input, "load", i, "", "N or N m", error)
         if (allocated(error)) return
         harmonics%constant(:size(on%row)) = harmonics%constant(:size(on%row)) + input%number("load", i, "value")*on%row
      end do
   end subroutine add_loads

end module razy_scenes_loads
