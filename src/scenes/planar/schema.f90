!! The groups of a planar scene: rigid bodies in a plane, and what acts between their points.
module razy_scenes_planar_schema
   use razy_input_schema, only: group, group_spec_t, key_name, key_real, key_spec_t, key_string, nonnegative, positive
   use razy_scenes_common_schema, only: common_schema
   use razy_scenes_friction, only: friction_keys
   use razy_scenes_gap_laws, only: gap_law_keys
   implicit none(type, external)
   private

   public :: planar_schema, matrix_springs, matrix_all, matrix_untuned

   !> What `&record` accepts in a planar scene.
   character(*), parameter :: planar_observables(*) = [character(24) :: "contact_force", "relative_displacement", &
                                                                            "sliding_velocity", "displacement", "velocity", "state"]
   !> What `&damping matrix` may be.
   character(*), parameter :: matrix_springs = "springs", matrix_all = "all", matrix_untuned = "untuned"
   integer, parameter :: most_ends = 64

contains

   !> All groups of a planar scene.
   function planar_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      schema = [common_schema(planar_observables), bodies(), connections(), contacts(), actions(), states()]
   end function planar_schema

   function bodies() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(2))
      keys = [ &
             key_name(), &
             key_real("mass", "mass", unit="kg", rule=positive, required=.true.), &
             key_real("inertia", "moment of inertia about the centre of mass", unit="kg m^2", rule=positive, required=.true.), &
             key_real("centre", "centre of mass in the reference position, x to the right and y up", unit="m", count=2, &
                      default="0.0, 0.0"), &
             key_real("size", "width and height of the rectangle that stands for the body in pictures", unit="m", &
                      rule=nonnegative, count=2, default="0.0, 0.0")]
      schema(1) = group("body", "A rigid body with the coordinates x, y and phi (counter-clockwise)", repeatable=.true., keys=keys)
      keys = [ &
             key_name(), &
             key_string("body", "name of the body that the point belongs to, or 'frame'", required=.true.), &
             key_real("position", "position in the reference position: from the centre of mass of the body, or in the frame", &
                      unit="m", count=2, required=.true.)]
      schema(2) = group("point", "A point of a body or of the frame", repeatable=.true., keys=keys)
   end function bodies

   function connections() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(3))
      keys = [ &
             key_name(required=.false.), &
             pairs(), direction(), &
             key_real("stiffness", "stiffness of all pairs together", unit="N/m", rule=nonnegative, required=.true.), &
             key_real("damping", "viscous damping beside the spring, of all pairs together", unit="N s/m", rule=nonnegative, &
                      default="0.0"), &
             key_real("untuned_stiffness", "stiffness before tuning, which &damping matrix='untuned' takes", unit="N/m", &
                      rule=nonnegative)]
      schema(1) = group("spring", "A linear spring between two points, or equal ones between several pairs", &
                        repeatable=.true., keys=keys)
      keys = [ &
             key_name(required=.false.), &
             pairs(), direction(), &
             key_real("damping", "viscous damping of all pairs together", unit="N s/m", rule=nonnegative, required=.true.)]
      schema(2) = group("damper", "A viscous damper between two points, or equal ones between several pairs", &
                        repeatable=.true., keys=keys)
      keys = [ &
             key_real("factor", "alpha in B = alpha K", unit="s", rule=nonnegative, required=.true.), &
             key_string("matrix", "the K in it: of the springs; of springs and contacts, as if these were springs; of the "// &
                        "springs before tuning", choices=[character(7) :: matrix_springs, matrix_all, matrix_untuned], &
                        default=matrix_springs)]
      schema(3) = group("damping", "Damping in proportion to a stiffness matrix", keys=keys)
   end function connections

   function contacts() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(2))
      keys = [ &
             key_name(), &
             contact_ends(), &
             key_real("direction", "direction in which the closed stop pushes the first point, of any length; if left out, "// &
                      "from the second point to the first", count=2), &
             key_real("clearance", "gap in the reference position; a negative one is preload", unit="m", default="0.0"), &
             gap_law_keys(), &
             key_real("damping_factor", "damping of the closed contact in proportion to its stiffness, for "// &
                      "'kelvin_voigt'; added to damping", unit="s", rule=nonnegative)]
      schema(1) = group("stop", "A one-way contact between two points", repeatable=.true., keys=keys)
      keys = [ &
             key_name(), &
             contact_ends(), &
             key_real("direction", "direction of sliding, of any length; if left out, that in which the stop of "// &
                      "normal_contact, or else of only_with, pushes, turned clockwise by 90 degrees; without a stop the line "// &
                      "through the points", &
                      count=2), &
             friction_keys()]
      schema(2) = group("friction", "Dry friction between two points, with the velocity of sliding v = direction*(u1' - u2') - "// &
                        "belt_speed", repeatable=.true., keys=keys)
   end function contacts

   function actions() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(3))
      keys = [ &
             key_name(required=.false.), &
             key_string("on", "name of the body", required=.true.), &
             key_real("position", "middle between the two axes, from the centre of mass", unit="m", count=2, &
                      default="0.0, 0.0"), &
             key_real("arm", "distance of each axis from the middle, across the direction", unit="m", rule=nonnegative, &
                      default="0.0"), &
             key_real("direction", "direction of the resultant, of any length", count=2, default="0.0, 1.0"), &
             key_real("frequency", "speed of the rotors", unit="Hz", rule=positive, required=.true.), &
             key_real("unbalance", "mass times eccentricity of each rotor", unit="kg m", rule=nonnegative), &
             key_real("force", "amplitude of the resultant of both rotors at force_frequency; instead of unbalance", unit="N", &
                      rule=nonnegative), &
             key_real("force_frequency", "frequency at which the resultant is force", unit="Hz", rule=positive), &
             key_real("phase", "phase of both rotors", unit="deg", default="0.0"), &
             key_real("phase_error", "phase by which the second rotor is ahead", unit="deg", default="0.0")]
      schema(1) = group("exciter", "Two counter-rotating eccentric rotors on a body, with force unbalance*(2 pi f)^2 each", &
                        repeatable=.true., keys=keys)
      keys = [ &
             key_string("on", "name of a coordinate, such as 'table.y', or of a point with .x or .y", required=.true.), &
             key_real("value", "constant part", unit="N or N m", default="0.0"), &
             key_real("amplitude", "amplitude of the harmonic part", unit="N or N m", default="0.0"), &
             key_real("phase", "phase of the harmonic part", unit="deg", default="0.0"), &
             key_real("frequency", "frequency of the harmonic part", unit="Hz", rule=positive), &
             key_real("angular_frequency", "frequency of the harmonic part, instead of frequency", unit="rad/s", rule=positive)]
      schema(2) = group("load", "A force or moment: value + amplitude*sin(2 pi f t + phase)", repeatable=.true., keys=keys)
      keys = [ &
             key_real("acceleration", "acceleration of free fall", unit="m/s^2", rule=nonnegative, default="9.81"), &
             key_real("direction", "direction, of any length", count=2, default="0.0, -1.0")]
      schema(3) = group("gravity", "Weight of all bodies; none without this group", keys=keys)
   end function actions

   function states() result(schema)
      type(group_spec_t), allocatable :: schema(:)
      type(key_spec_t), allocatable :: keys(:)

      allocate (schema(1))
      keys = [ &
             key_string("on", "name of a coordinate, such as 'table.y'", required=.true.), &
             key_real("displacement", "displacement from the reference position", unit="m or rad", default="0.0"), &
             key_real("velocity", "velocity", unit="m/s or rad/s", default="0.0")]
      schema(1) = group("initial", "State of a coordinate at the start, for start='given'; the others start with zero", &
                        repeatable=.true., keys=keys)
   end function states

   function pairs()
      type(key_spec_t) :: pairs

      pairs = key_string("between", "names of two points, of bodies (their centres), or 'frame'; several pairs share the "// &
                         "stiffness or damping equally", least=2, most=most_ends, required=.true.)
   end function pairs

   function contact_ends()
      type(key_spec_t) :: contact_ends

      contact_ends = key_string("between", "names of two points of different bodies, of bodies (their centres), or 'frame'", &
                                count=2, required=.true.)
   end function contact_ends

   function direction()
      type(key_spec_t) :: direction

      direction = key_real("direction", "direction in which it acts, of any length; if left out, the line through the points", &
                           count=2)
   end function direction

end module razy_scenes_planar_schema
