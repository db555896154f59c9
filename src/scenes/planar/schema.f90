!! The groups of a planar scene: rigid bodies in a plane, and what acts between their points.
module razy_scenes_planar_schema
   use razy_input_schema, only: group, group_spec_t, key_name, key_real, key_spec_t, key_string, nonnegative, positive
   use razy_scenes_common_schema, only: common_schema
   use razy_scenes_contacts, only: friction_keys
   use razy_scenes_gap_laws, only: gap_law_keys
   use razy_scenes_loads, only: load_keys
   use razy_scenes_start, only: initial_keys
   implicit none(type, external)
   private

   public :: planar_schema, matrix_all, matrix_untuned

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

      schema = [ &
               common_schema(planar_observables), &
               group("body", "A rigid body with the coordinates x, y and phi (counter-clockwise)", repeatable=.true., keys=[ &
                     key_name(), &
                     key_real("mass", "mass", unit="kg", rule=positive, required=.true.), &
                     key_real("inertia", "moment of inertia about the centre of mass", unit="kg m^2", rule=positive, &
                              required=.true.), &
                     key_real("centre", "centre of mass in the reference position, x to the right and y up", unit="m", count=2, &
                              default="0.0, 0.0"), &
                     key_real("size", "width and height of the rectangle that stands for the body in pictures", unit="m", &
                              rule=nonnegative, count=2, default="0.0, 0.0")]), &
               group("point", "A point of a body or of the frame", repeatable=.true., keys=[ &
                     key_name(), &
                     key_string("body", "name of the body that the point belongs to, or 'frame'", required=.true.), &
                     key_real("position", "position in the reference position: from the centre of mass of the body, or in the "// &
                              "frame", unit="m", count=2, required=.true.)]), &
               group("spring", "A linear spring between two points, or equal ones between several pairs", &
                     repeatable=.true., keys=[ &
                     key_name(required=.false.), &
                     pairs(), direction(), &
                     key_real("stiffness", "stiffness of all pairs together", unit="N/m", rule=nonnegative, required=.true.), &
                     key_real("damping", "viscous damping beside the spring, of all pairs together", unit="N s/m", &
                              rule=nonnegative, default="0.0"), &
                     key_real("untuned_stiffness", "stiffness before tuning, which &damping matrix='untuned' takes", unit="N/m", &
                              rule=nonnegative)]), &
               group("damper", "A viscous damper between two points, or equal ones between several pairs", &
                     repeatable=.true., keys=[ &
                     key_name(required=.false.), &
                     pairs(), direction(), &
                     key_real("damping", "viscous damping of all pairs together", unit="N s/m", rule=nonnegative, &
                              required=.true.)]), &
               group("damping", "Damping in proportion to a stiffness matrix", keys=[ &
                     key_real("factor", "alpha in B = alpha K", unit="s", rule=nonnegative, required=.true.), &
                     key_string("matrix", "the K in it: of the springs; of springs and contacts, as if these were springs; of "// &
                                "the springs before tuning", choices=[character(7) :: matrix_springs, matrix_all, matrix_untuned], &
                                default=matrix_springs)]), &
               contacts_and_actions()]
   end function planar_schema

   function contacts_and_actions() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      schema = [ &
               group("stop", "A one-way contact between two points", repeatable=.true., keys=[ &
                     key_name(), contact_ends(), &
                     key_real("direction", "direction in which the closed stop pushes the first point, of any length; if left "// &
                              "out, from the second point to the first", count=2), &
                     key_real("clearance", "gap in the reference position; a negative one is preload", unit="m", default="0.0"), &
                     gap_law_keys(), &
                     key_real("damping_factor", "damping of the closed contact in proportion to its stiffness, for "// &
                              "'kelvin_voigt'; added to damping", unit="s", rule=nonnegative)]), &
               group("friction", "Dry friction between two points, with the velocity of sliding v = direction*(u1' - u2') - "// &
                     "belt_speed", repeatable=.true., keys=[ &
                     key_name(), contact_ends(), &
                     key_real("direction", "direction of sliding, of any length; if left out, that in which the stop of "// &
                              "normal_contact, or else of only_with, pushes, turned clockwise by 90 degrees; without a stop "// &
                              "the line through the points", count=2), &
                     friction_keys()]), &
               group("exciter", "Two counter-rotating eccentric rotors on a body, with force unbalance*(2 pi f)^2 each", &
                     repeatable=.true., keys=[ &
                     key_name(required=.false.), &
                     key_string("on", "name of the body", required=.true.), &
                     key_real("position", "middle between the two axes, from the centre of mass", unit="m", count=2, &
                              default="0.0, 0.0"), &
                     key_real("arm", "distance of each axis from the middle, across the direction", unit="m", rule=nonnegative, &
                              default="0.0"), &
                     key_real("direction", "direction of the resultant, of any length", count=2, default="0.0, 1.0"), &
                     key_real("frequency", "speed of the rotors", unit="Hz", rule=positive, required=.true.), &
                     key_real("unbalance", "mass times eccentricity of each rotor", unit="kg m", rule=nonnegative), &
                     key_real("force", "amplitude of the resultant of both rotors at force_frequency; instead of unbalance", &
                              unit="N", rule=nonnegative), &
                     key_real("force_frequency", "frequency at which the resultant is force", unit="Hz", rule=positive), &
                     key_real("phase", "phase of both rotors", unit="deg", default="0.0"), &
                     key_real("phase_error", "phase by which the second rotor is ahead", unit="deg", default="0.0")]), &
               group("load", "A force or moment: value + amplitude*sin(2 pi f t + phase)", repeatable=.true., keys=[ &
                     load_keys("name of a coordinate, such as 'table.y', or of a point with .x or .y", orders=.false.)]), &
               group("gravity", "Weight of all bodies; none without this group", keys=[ &
                     key_real("acceleration", "acceleration of free fall", unit="m/s^2", rule=nonnegative, default="9.81"), &
                     key_real("direction", "direction, of any length", count=2, default="0.0, -1.0")]), &
               group("initial", "State of a coordinate at the start, for start='given'; the others start with zero", &
                     repeatable=.true., keys=[ &
                     initial_keys("name of a coordinate, such as 'table.y'", "displacement from the reference position")])]
   end function contacts_and_actions

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
