!! The groups of a lumped scene: bodies with one coordinate each, and what acts between them.
module razy_scenes_lumped_schema
   use razy_input_schema, only: group, group_spec_t, key_integer, key_name, key_real, key_spec_t, key_string, nonnegative, positive
   use razy_scenes_common_schema, only: common_schema
   use razy_scenes_friction, only: friction_keys
   use razy_scenes_gap_laws, only: gap_law_keys
   implicit none(type, external)
   private

   public :: lumped_observables, lumped_schema

   !> What `&record` accepts in a lumped scene.
   character(*), parameter :: lumped_observables(*) = [character(24) :: "mesh_deformation", "contact_force", &
                                                                                      "relative_displacement", "sliding_velocity", &
                                                                                                "displacement", "velocity", "state"]
   integer, parameter :: most_harmonics = 32

contains

   !> All groups of a lumped scene.
   function lumped_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      schema = [common_schema(lumped_observables), bodies(), connections(), contacts(), actions()]
   end function lumped_schema

   function bodies() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(2))
      keys = [ &
             key_name(), &
             key_real("value", "moment of inertia", unit="kg m^2", rule=positive, required=.true.)]
      schema(1) = group("inertia", "A body that turns", repeatable=.true., keys=keys)
      keys = [ &
             key_name(), &
             key_real("value", "mass", unit="kg", rule=positive, required=.true.)]
      schema(2) = group("mass", "A body that moves along a line", repeatable=.true., keys=keys)
   end function bodies

   function connections() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(2))
      keys = [ &
             key_name(required=.false.), &
             ends(), &
             key_real("stiffness", "stiffness", unit="N/m or N m/rad", rule=nonnegative, required=.true.), &
             key_real("damping", "viscous damping beside the spring", unit="N s/m or N m s/rad", &
                      rule=nonnegative, default="0.0"), &
             key_real("damping_factor", "viscous damping in proportion to the stiffness", unit="s", &
                      rule=nonnegative, default="0.0")]
      schema(1) = group("spring", "A linear spring between two bodies or a body and the frame", repeatable=.true., keys=keys)
      keys = [ &
             key_name(required=.false.), &
             ends(), &
             key_real("damping", "viscous damping", unit="N s/m or N m s/rad", rule=nonnegative, required=.true.)]
      schema(2) = group("damper", "A viscous damper between two bodies or a body and the frame", repeatable=.true., keys=keys)
   end function connections

   function contacts() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(3))
      keys = [ &
             key_name(), &
             ends(), &
             key_string("side", "closes for q > clearance, for q < -clearance, or both", choices=["upper", "lower", &
                                                                                                  "both "], default="upper"), &
             key_real("clearance", "displacement up to contact; a negative one is preload", unit="m or rad", required=.true.), &
             gap_law_keys(), &
             key_real("motion_amplitude", "amplitude of a given motion of the second end, beside its own", unit="m or rad", &
                      default="0.0"), &
             key_real("motion_phase", "phase of that motion", unit="deg", default="0.0"), &
             key_real("motion_frequency", "frequency of that motion", unit="Hz", rule=positive), &
             key_real("motion_angular_frequency", "frequency of that motion, instead of motion_frequency", unit="rad/s", &
                      rule=positive), &
             key_real("motion_order", "frequency in multiples of the speed of &rotation, instead of motion_frequency", &
                      rule=positive)]
      schema(1) = group("stop", "A stop between two bodies or a body and the frame, acting on q = q1 - q2", &
                        repeatable=.true., keys=keys)
      keys = [ &
             key_name(), &
             key_string("between", "names of the two wheels (inertias)", count=2, required=.true.), &
             key_real("radius", "base radii", unit="m", rule=positive, count=2, required=.true.), &
             key_integer("teeth", "numbers of teeth", rule=positive, count=2, required=.true.), &
             key_real("stiffness", "mesh stiffness", unit="N/m", rule=positive, required=.true.), &
             key_real("damping", "mesh damping, acting in contact", unit="N s/m", rule=nonnegative, default="0.0"), &
             key_real("backlash", "backlash along the line of action", unit="m", rule=nonnegative, default="0.0"), &
             key_string("separation", "where a damped contact is lost", choices=["zero_deformation", "zero_force      "], &
                        default="zero_deformation"), &
             key_real("error_sine", &
                      "static transmission error: sine amplitudes of the harmonics of the tooth frequency", unit="m", &
                      least=1, most=most_harmonics), &
             key_real("error_cosine", "static transmission error: cosine amplitudes likewise", unit="m", &
                      least=1, most=most_harmonics)]
      schema(2) = group("gear_mesh", "A pair of gears: d = r1 q1 - r2 q2 + error", repeatable=.true., keys=keys)
      keys = [ &
             key_name(), &
             ends(), &
             friction_keys()]
      schema(3) = group("friction", "Dry friction between two bodies or a body and the frame, with the velocity of sliding "// &
                        "v = q1' - q2' - belt_speed", repeatable=.true., keys=keys)
   end function contacts

   function actions() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(3))
      keys = [ &
             key_string("on", "name of the body", required=.true.), &
             key_real("value", "constant part", unit="N or N m", default="0.0"), &
             key_real("amplitude", "amplitude of the harmonic part", unit="N or N m", default="0.0"), &
             key_real("phase", "phase of the harmonic part", unit="deg", default="0.0"), &
             key_real("frequency", "frequency of the harmonic part", unit="Hz", rule=positive), &
             key_real("angular_frequency", "frequency of the harmonic part, instead of frequency", unit="rad/s", &
                      rule=positive), &
             key_real("order", "frequency in multiples of the speed of &rotation, instead of frequency", rule=positive)]
      schema(1) = group("load", "A force (torque) on a body: value + amplitude*sin(2 pi f t + phase)", repeatable=.true., keys=keys)
      keys = [ &
             key_real("speed_rpm", "mean speed", unit="rpm", required=.true.), &
             key_string("of", "name of the inertia that has this speed", required=.true.)]
      schema(2) = group("rotation", "The mean speed of the machine", keys=keys)
      keys = [ &
             key_string("on", "name of the body", required=.true.), &
             key_real("displacement", "displacement", unit="m or rad", default="0.0"), &
             key_real("velocity", "velocity", unit="m/s or rad/s", default="0.0")]
      schema(3) = group("initial", "State of a body at the start, for start='given'; bodies not named start with zero", &
                        repeatable=.true., keys=keys)
   end function actions

   function ends()
      type(key_spec_t) :: ends

      ends = key_string("between", "names of the two bodies, one of which may be 'frame'", count=2, required=.true.)
   end function ends

end module razy_scenes_lumped_schema
