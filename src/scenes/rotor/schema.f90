!! The groups of a rotor scene: shafts by finite elements, what sits on them, and meshes between them.
module razy_scenes_rotor_schema
   use razy_core_kinds, only: wp
   use razy_input_schema, only: add_group, add_integer, add_logical, add_name, add_real, add_string, group_spec_t, nonnegative, &
                                positive
   use razy_scenes_common_schema, only: add_common_groups
   use razy_scenes_connections, only: add_connection_groups
   use razy_scenes_gears, only: add_gear_group
   use razy_scenes_harmonics, only: add_rotation_group
   implicit none(type, external)
   private

   public :: rotor_schema
   public :: bearing_kinds, bearing_ball, bearing_matrix, bearing_roller, bearing_rolling, bearing_table
   public :: coordinate_choices, damping_choices, methods, method_none, method_craig_bampton, sortings

   !> Kinds of bearings, in the order of `bearing_kinds`.
   integer, parameter :: bearing_rolling = 1, bearing_matrix = 2, bearing_ball = 3, bearing_roller = 4, bearing_table = 5
   character(*), parameter :: bearing_kinds(5) = [character(7) :: "rolling", "matrix", "ball", "roller", "table"]
   character(*), parameter :: coordinate_choices(6) = [character(5) :: "u", "v", "w", "phi", "theta", "psi"]
   !> In the order of damping_none, damping_nodal, damping_modal, damping_proportional.
   character(*), parameter :: damping_choices(4) = [character(12) :: "none", "nodal", "modal", "proportional"]
   character(*), parameter :: method_none = "none", method_craig_bampton = "craig_bampton"
   character(*), parameter :: methods(3) = [character(15) :: method_none, "modal_synthesis", method_craig_bampton]
   !> In the order of sort_absolute, sort_signed, sort_frequency.
   character(*), parameter :: sortings(3) = [character(9) :: "absolute", "signed", "frequency"]
   integer, parameter :: most_orders = 32, most_shafts = 64

contains

   !> All groups of a rotor scene.
   function rotor_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      call add_common_groups(schema)
      call add_parts(schema)
      call add_meshes_and_more(schema)
   end function rotor_schema

   subroutine add_parts(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "shaft", "A shaft of circular sections along x", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "young_modulus", "Young's modulus", unit="Pa", rule=positive, required=.true.)
      call add_real(schema, "shear_modulus", "shear modulus; give this or poisson_ratio", unit="Pa", rule=positive)
      call add_real(schema, "poisson_ratio", "Poisson's ratio, from which the shear modulus follows", low=-0.99_wp, high=0.5_wp)
      call add_real(schema, "density", "density; 0 for a shaft without mass", unit="kg/m^3", rule=nonnegative, required=.true.)
      call add_string(schema, "element", "bending without shear (Euler, Bernoulli, Rayleigh) or with it (Timoshenko, Cowper's "// &
                      "coefficient)", choices=["rayleigh  ", "timoshenko"], default="rayleigh")
      call add_real(schema, "damping_ratio", "D of the internal damping", low=0.0_wp, high=1.0e6_wp, default="0.0")
      call add_real(schema, "mass_damping", "alpha of a damping alpha M + beta K of the shaft's elements, beside the "// &
                    "internal one, which does not turn with the shaft", unit="1/s", rule=nonnegative, default="0.0")
      call add_real(schema, "stiffness_damping", "beta of it", unit="s", rule=nonnegative, default="0.0")
      call add_logical(schema, "rotary_inertia", "whether sections have inertia of rotation in bending", default=".true.")
      call add_string(schema, "damping", "internal damping: dampers on the nodes (the source's), the ratio D in every mode of "// &
                      "the shaft on its bearings, or in the lowest and by the frequency in the others; one kind for all shafts", &
                      choices=damping_choices(2:), default="proportional")
      call add_real(schema, "speed_ratio", "speed over that of &rotation, with sign; if left out, from the teeth of gear meshes")
      call add_group(schema, "section", "A cylinder or cone of a shaft; sections follow each other along +x as in the file", &
                     repeatable=.true.)
      call add_shaft(schema)
      call add_real(schema, "length", "length", unit="m", low=1.0e-9_wp, high=1.0e9_wp, required=.true.)
      call add_real(schema, "outer_diameter", "outer diameter", unit="m", low=1.0e-9_wp, high=1.0e4_wp, required=.true.)
      call add_real(schema, "inner_diameter", "diameter of the bore", unit="m", rule=nonnegative, default="0.0")
      call add_real(schema, "outer_diameter_end", "of a cone: outer diameter at the end of largest x", unit="m", low=1.0e-9_wp, &
                    high=1.0e4_wp)
      call add_real(schema, "inner_diameter_end", "of a cone: diameter of the bore there", unit="m", rule=nonnegative)
      call add_integer(schema, "elements", "number of equal elements", low=1, high=100000, default="1")
      call add_integer(schema, "first_node", "makes it a layer on the sections that are there, such as a sleeve: its first "// &
                       "node; its elements have the lengths of those below", rule=positive)
      call add_real(schema, "axial_force", "tension that it carries, which straightens it; negative: compression", unit="N", &
                    default="0.0")
      call add_real(schema, "torque", "torque that it carries: about +x on its face of largest x", unit="N m", default="0.0")
      call add_string(schema, "torque_axis", "where the torque begins and ceases, whether it tilts with the shaft or keeps the "// &
                      "direction x", choices=["shaft", "fixed"], default="shaft")
      call add_real(schema, "young_modulus", "if not that of the shaft", unit="Pa", rule=positive)
      call add_real(schema, "shear_modulus", "if not that of the shaft", unit="Pa", rule=positive)
      call add_real(schema, "density", "if not that of the shaft", unit="kg/m^3", rule=nonnegative)
      call add_group(schema, "housing", "A rigid body: housing, pedestal, foundation or wheel; other groups call its place by "// &
                     "its name and node 1, as of a shaft", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "mass", "mass", unit="kg", rule=positive, required=.true.)
      call add_real(schema, "inertia", "moments of inertia about x, and about y and z, if it tilts and twists", unit="kg m^2", &
                    rule=nonnegative, count=2, default="0.0, 0.0")
      call add_logical(schema, "turns", "whether it turns about x as a shaft does, such as the rotor of a motor with its gear", &
                       default=".false.")
      call add_group(schema, "disk", "A rigid disk on a node", repeatable=.true.)
      call add_place(schema)
      call add_real(schema, "mass", "mass", unit="kg", rule=nonnegative, required=.true.)
      call add_real(schema, "polar_inertia", "moment of inertia about the axis", unit="kg m^2", rule=nonnegative, required=.true.)
      call add_real(schema, "diametral_inertia", "moment of inertia about a diameter through the centre of mass", unit="kg m^2", &
                    rule=nonnegative, required=.true.)
      call add_real(schema, "offset", "distance of the centre of mass from the node along +x", unit="m", default="0.0")
      call add_group(schema, "support", "Coordinates of a node that the frame holds", repeatable=.true.)
      call add_place(schema)
      call add_string(schema, "held", "coordinates that the frame holds", choices=coordinate_choices, least=1, most=6, &
                      required=.true.)
      call add_group(schema, "freedom", "Motions that exist; of one left out there are no coordinates")
      call add_logical(schema, "axial", "motion along the axis", default=".true.")
      call add_logical(schema, "bending", "lateral motion and tilting", default=".true.")
      call add_logical(schema, "torsion", "twist", default=".true.")
      call add_group(schema, "bearing", "A bearing, seal, coupling or spring between a node and the frame or another node", &
                     repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_place(schema)
      call add_string(schema, "to", "the second end: shaft and node, such as 'outer.2', or a housing; the frame if left out")
      call add_string(schema, "kind", "rolling elements of given stiffness; matrices; balls or steel rollers, whose radial "// &
                      "stiffness follows from their geometry; coefficients over the speed from a file", choices=bearing_kinds, &
                      default="rolling")
      call add_integer(schema, "elements", "number of rolling elements", low=2, high=1000)
      call add_real(schema, "radial_stiffness", "radial stiffness of each element, for kind = 'rolling'", unit="N/m", &
                    rule=nonnegative)
      call add_real(schema, "axial_stiffness", "axial stiffness of each element", unit="N/m", rule=nonnegative, default="0.0")
      call add_real(schema, "axial_radius", "radius at which axial forces act", unit="m", rule=nonnegative, default="0.0")
      call add_real(schema, "clearance", "radial gap at each rolling element where both rings are concentric, half of the "// &
                    "diametral clearance; negative: preload; the elements then act one by one and turn with the cage", unit="m")
      call add_real(schema, "contact_stiffness", "K of Q = K delta^n of an element with clearance, between both races; n = 1.5 "// &
                    "for 'ball', 10/9 for 'roller'; in the place of geometry", unit="N/m^n", rule=positive)
      call add_real(schema, "hysteresis", "factor alpha of its damping, Q = K delta^n (1 + 1.5 alpha delta'); 0 if not given", &
                    unit="s/m", rule=nonnegative)
      call add_real(schema, "cage_ratio", "speed of the cage over that of the shaft, seen from the other end; if not given, "// &
                    "(1 - ball_diameter/pitch_diameter)/2", low=0.0_wp, high=1.0_wp)
      call add_real(schema, "first_angle", "angle of the first element from y towards z", unit="deg", default="0.0")
      call add_real(schema, "offset", "distance of the row from the node along +x", unit="m", default="0.0")
      call add_real(schema, "damping_factor", "damping in proportion to the stiffness of rolling elements", unit="s", &
                    rule=nonnegative, default="0.0")
      call add_real(schema, "stiffness", "for kind = 'matrix': all rows of a matrix, which need not be symmetric: 4 values for "// &
                    "v, w (k_yy, k_yz, k_zy, k_zz), 16 for v, w, theta, psi, 25 with u, 36 with phi too; or 6, the diagonal", &
                    unit="N/m, N/rad, N m/rad", least=4, most=36)
      call add_real(schema, "damping_matrix", "for kind = 'matrix': damping likewise; zero if not given", &
                    unit="N s/m, N s/rad, N m s/rad", least=4, most=36)
      call add_string(schema, "file", "for kind = 'table': comma-separated text with the columns speed_rpm, the shaft's own, "// &
                      "kxx, kxy, kyx, kyy [N/m], cxx, cxy, cyx, cyy [N s/m], x being v and y w")
      call add_real(schema, "ball_diameter", "for kind = 'ball'", unit="m", rule=positive)
      call add_real(schema, "pitch_diameter", "diameter of the circle of the balls' centres", unit="m", rule=positive)
      call add_real(schema, "inner_groove", "radius of the groove of the inner ring", unit="m", rule=positive)
      call add_real(schema, "outer_groove", "radius of the groove of the outer ring", unit="m", rule=positive)
      call add_real(schema, "young_modulus", "of balls and rings", unit="Pa", rule=positive, default="2.08e11")
      call add_real(schema, "poisson_ratio", "of balls and rings", low=0.0_wp, high=0.5_wp, default="0.3")
      call add_real(schema, "roller_length", "effective length, for kind = 'roller'", unit="m", rule=positive)
      call add_real(schema, "element_load", "load of an element at which its stiffness is taken, for 'ball' and 'roller'", &
                    unit="N", rule=positive)
   end subroutine add_parts

   subroutine add_meshes_and_more(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_gear_group(schema)
      call add_connection_groups(schema)
      call add_group(schema, "unbalance", "An unbalance, which turns with its shaft", repeatable=.true.)
      call add_place(schema)
      call add_real(schema, "moment", "mass times eccentricity", unit="kg m", rule=nonnegative, required=.true.)
      call add_real(schema, "angle", "angle at time 0 from y towards z", unit="deg", default="0.0")
      call add_rotation_group(schema)
      call add_group(schema, "reduction", "Fewer coordinates; without this group all of them")
      call add_string(schema, "method", "modes of each shaft alone, or Craig and Bampton's with bearings and gears as interface", &
                      choices=methods, default="modal_synthesis")
      call add_integer(schema, "modes", "modes kept of each shaft: one number for all, of which a housing takes what it "// &
                       "has; or one for each, housings last", low=0, high=100000, least=1, most=most_shafts)
      call add_real(schema, "frequency_limit", "no modes above; instead of modes or with it", unit="Hz", rule=positive)
      call add_logical(schema, "static_correction", "whether the static shapes of mesh forces are added", default=".false.")
      call add_string(schema, "level", "second level: modes with meshes open (a) or closed (b)", choices=["none", "a   ", "b   "], &
                      default="none")
      call add_integer(schema, "kept", "modes kept on the second level", rule=positive)
      call add_string(schema, "sorting", "order in which modes of the second level are kept: |d| or d of the mesh falling, or "// &
                      "frequency rising", choices=sortings, default="absolute")
      call add_string(schema, "compare", "what razy-modes compares with the unreduced model: nothing; this reduction with and "// &
                      "without static correction; all kinds with these numbers of modes", choices=["none ", "asked", "all  "], &
                      default="asked")
      call add_integer(schema, "compare_modes", "number of frequencies that are compared", low=1, high=10000, default="16")
      call add_real(schema, "compare_limit", "the transfer functions at the meshes are compared up to this frequency; if left "// &
                    "out, to the highest frequency compared", unit="Hz", rule=positive)
      call add_group(schema, "campbell", "Speeds for which razy-modes finds frequencies, critical speeds and the stability limit")
      call add_real(schema, "first_rpm", "first speed of &rotation", unit="rpm", rule=nonnegative, default="0.0")
      call add_real(schema, "last_rpm", "last speed", unit="rpm", rule=positive, required=.true.)
      call add_integer(schema, "points", "number of speeds", low=2, high=100000, default="101")
      call add_real(schema, "orders", "excitation frequencies over that of rotation, for critical speeds; that of teeth is "// &
                    "their number", rule=positive, least=1, most=most_orders, default="1.0")
      call add_logical(schema, "damped", "whether damping and circulatory matrix act on frequencies and critical speeds; on "// &
                       "the stability limit they always do, the latter as &rotation says", default=".false.")
   end subroutine add_meshes_and_more

   subroutine add_shaft(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "shaft", "name of the shaft", required=.true.)
   end subroutine add_shaft

   !> Shaft and node.
   subroutine add_place(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_shaft(schema)
      call add_integer(schema, "node", "node of the shaft, counted from 1 at its end of smallest x", rule=positive, required=.true.)
   end subroutine add_place

end module razy_scenes_rotor_schema
