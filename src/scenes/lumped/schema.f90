!! The groups of a lumped scene: bodies with one coordinate each, and what acts between them.
module razy_scenes_lumped_schema
   use razy_input_schema, only: group, group_spec_t, key_integer, key_name, key_real, key_spec_t, key_string, nonnegative, &
                                positive
   use razy_scenes_common_schema, only: common_schema
   use razy_scenes_contacts, only: friction_keys
   use razy_scenes_gap_laws, only: gap_law_keys
   use razy_scenes_gears, only: gear_keys
   use razy_scenes_harmonics, only: acceleration_key, frequency_keys
   use razy_scenes_loads, only: load_keys
   use razy_scenes_start, only: initial_keys
   implicit none(type, external)
   private

   public :: lumped_schema

   !> What `&record` accepts in a lumped scene.
   character(*), parameter :: lumped_observables(*) = [character(24) :: "mesh_deformation", "contact_force", &
                                                                                      "relative_displacement", "sliding_velocity", &
                                                                                                "displacement", "velocity", "state"]

contains

   !> All groups of a lumped scene.
   function lumped_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      schema = [ &
               common_schema(lumped_observables), &
               group("inertia", "A body that turns", repeatable=.true., keys=[ &
                     key_name(), &
                     key_real("value", "moment of inertia", unit="kg m^2", rule=positive, required=.true.)]), &
               group("mass", "A body that moves along a line", repeatable=.true., keys=[ &
                     key_name(), &
                     key_real("value", "mass", unit="kg", rule=positive, required=.true.)]), &
               group("spring", "A linear spring between two bodies or a body and the frame", repeatable=.true., keys=[ &
                     key_name(required=.false.), &
                     ends(), &
                     key_real("stiffness", "stiffness", unit="N/m or N m/rad", rule=nonnegative, required=.true.), &
                     key_real("damping", "viscous damping beside the spring", unit="N s/m or N m s/rad", rule=nonnegative, &
                              default="0.0"), &
                     key_real("damping_factor", "viscous damping in proportion to the stiffness", unit="s", rule=nonnegative, &
                              default="0.0")]), &
               group("damper", "A viscous damper between two bodies or a body and the frame", repeatable=.true., keys=[ &
                     key_name(required=.false.), &
                     ends(), &
                     key_real("damping", "viscous damping", unit="N s/m or N m s/rad", rule=nonnegative, required=.true.)]), &
               group("stop", "A stop between two bodies or a body and the frame, acting on q = q1 - q2", repeatable=.true., keys=[ &
                     key_name(), ends(), &
                     key_string("side", "closes for q > clearance, for q < -clearance, or both", &
                                choices=["upper", "lower", "both "], default="upper"), &
                     key_real("clearance", "displacement up to contact; a negative one is preload", unit="m or rad", &
                              required=.true.), &
                     gap_law_keys(), &
                     key_real("motion_amplitude", "amplitude of a given motion of the second end, beside its own", &
                              unit="m or rad", default="0.0"), &
                     key_real("motion_phase", "phase of that motion", unit="deg", default="0.0"), &
                     frequency_keys("motion_", "that motion", orders=.true.)]), &
               group("gear_mesh", "A pair of gears: d = r1 q1 - r2 q2 + error", repeatable=.true., keys=[ &
                     key_name(), &
                     key_string("between", "names of the two wheels (inertias)", count=2, required=.true.), &
                     key_real("radius", "base radii", unit="m", rule=positive, count=2, required=.true.), &
                     key_integer("teeth", "numbers of teeth", rule=positive, count=2, required=.true.), &
                     key_real("stiffness", "mesh stiffness", unit="N/m", rule=positive, required=.true.), &
                     key_real("damping", "mesh damping, acting in contact", unit="N s/m", rule=nonnegative, default="0.0"), &
                     gear_keys("where a damped contact is lost")]), &
               group("friction", "Dry friction between two bodies or a body and the frame, with the velocity of sliding v = "// &
                     "q1' - q2' - belt_speed", repeatable=.true., keys=[ &
                     key_name(), ends(), friction_keys()]), &
               group("load", "A force (torque) on a body: value + amplitude*sin(2 pi f t + phase)", repeatable=.true., keys=[ &
                     load_keys("name of the body", orders=.true.)]), &
               group("rotation", "The mean speed of the machine", keys=[ &
                     key_real("speed_rpm", "mean speed", unit="rpm", required=.true.), &
                     acceleration_key(), &
                     key_string("of", "name of the inertia that has this speed", required=.true.)]), &
               group("initial", "State of a body at the start, for start='given'; bodies not named start with zero", &
                     repeatable=.true., keys=[ &
                     initial_keys("name of the body", "displacement")])]
   end function lumped_schema

   function ends()
      type(key_spec_t) :: ends

      ends = key_string("between", "names of the two bodies, one of which may be 'frame'", count=2, required=.true.)
   end function ends

end module razy_scenes_lumped_schema
