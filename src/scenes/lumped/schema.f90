!! The groups of a lumped scene: bodies with one coordinate each, and what acts between them.
module razy_scenes_lumped_schema
   use razy_input_schema, only: add_group, add_integer, add_name, add_real, add_string, group_spec_t, nonnegative, positive
   use razy_scenes_common_schema, only: add_common_groups
   use razy_scenes_contacts, only: add_friction_keys
   use razy_scenes_gap_laws, only: add_gap_law_keys
   use razy_scenes_gears, only: add_gear_keys
   use razy_scenes_harmonics, only: add_acceleration_key
   use razy_scenes_loads, only: add_load_group
   use razy_scenes_shapes, only: add_motion_keys
   use razy_scenes_start, only: add_initial_group
   use razy_scenes_tables, only: add_spring_keys
   implicit none(type, external)
   private

   public :: lumped_schema

contains

   !> All groups of a lumped scene.
   function lumped_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      call add_common_groups(schema)
      call add_group(schema, "inertia", "A body that turns", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "value", "moment of inertia", unit="kg m^2", rule=positive, required=.true.)
      call add_group(schema, "mass", "A body that moves along a line", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "value", "mass", unit="kg", rule=positive, required=.true.)
      call add_group(schema, "spring", "A spring between two bodies or a body and the frame", repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_ends(schema)
      call add_real(schema, "stiffness", "stiffness, for law='linear'", unit="N/m or N m/rad", rule=nonnegative)
      call add_real(schema, "damping", "viscous damping beside the spring", unit="N s/m or N m s/rad", rule=nonnegative, &
                    default="0.0")
      call add_real(schema, "damping_factor", "viscous damping in proportion to the stiffness", unit="s", rule=nonnegative, &
                    default="0.0")
      call add_spring_keys(schema)
      call add_group(schema, "damper", "A viscous damper between two bodies or a body and the frame", repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_ends(schema)
      call add_real(schema, "damping", "viscous damping", unit="N s/m or N m s/rad", rule=nonnegative, required=.true.)
      call add_group(schema, "stop", "A stop between two bodies or a body and the frame, acting on q = q1 - q2", repeatable=.true.)
      call add_name(schema)
      call add_ends(schema)
      call add_string(schema, "side", "closes for q > clearance, for q < -clearance, or both", &
                      choices=["upper", "lower", "both "], default="upper")
      call add_real(schema, "clearance", "displacement up to contact; a negative one is preload", unit="m or rad", required=.true.)
      call add_gap_law_keys(schema)
      call add_motion_keys(schema, "a given motion of the second end, beside its own")
      call add_group(schema, "gear_mesh", "A pair of gears: d = r1 q1 - r2 q2 + error", repeatable=.true.)
      call add_name(schema)
      call add_string(schema, "between", "names of the two wheels (inertias)", count=2, required=.true.)
      call add_real(schema, "radius", "base radii", unit="m", rule=positive, count=2, required=.true.)
      call add_gear_keys(schema)
      call add_group(schema, "friction", "Dry friction between two bodies or a body and the frame, with the velocity of "// &
                     "sliding v = q1' - q2' - belt_speed", repeatable=.true.)
      call add_name(schema)
      call add_ends(schema)
      call add_friction_keys(schema)
      call add_load_group(schema, "name of the body")
      call add_group(schema, "rotation", "The mean speed of the machine")
      call add_real(schema, "speed_rpm", "mean speed", unit="rpm", required=.true.)
      call add_acceleration_key(schema)
      call add_string(schema, "of", "name of the inertia that has this speed", required=.true.)
      call add_initial_group(schema, "name of the body", "displacement")
   end function lumped_schema

   subroutine add_ends(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "between", "names of the two bodies, one of which may be 'frame'", count=2, required=.true.)
   end subroutine add_ends

end module razy_scenes_lumped_schema
