!! The groups that every kind of scene has: what it is, how it moves, what is recorded, what is varied.
module razy_scenes_common_schema
   use razy_input_schema, only: add_group, add_integer, add_logical, add_real, add_string, group_spec_t, nonnegative, positive
   use razy_motion_method, only: integrators, treatments
   implicit none(type, external)
   private

   public :: add_common_groups, kind_of_parts, parts, scene_kinds
   public :: of_averages, of_extrema, of_statistics, of_strobe, of_trajectory, recorders

   !> What `&scene kind` may be.
   character(*), parameter :: scene_kinds(*) = [character(8) :: "lumped", "planar", "rotor"]
   !> Groups that make coordinates, and the kind of scene they belong to.
   character(*), parameter :: parts(*) = [character(9) :: "inertia", "mass", "body", "planetary", "shaft", "housing"], &
                                          kind_of_parts(*) = [character(8) :: "lumped", "lumped", "planar", "planar", "rotor", &
                                                                                                  "rotor"]
   !> What `&record` accepts.
   character(*), parameter :: observables(*) = [character(24) :: "mesh_deformation", "contact_force", "connection_force", &
                                                   "relative_displacement", "sliding_velocity", "displacement", "velocity", "state"]
   !> Who records it, and their numbers.
   character(*), parameter :: recorders(*) = [character(10) :: "extrema", "trajectory", "statistics", "averages", "strobe"]
   integer, parameter :: of_extrema = 1, of_trajectory = 2, of_statistics = 3, of_averages = 4, of_strobe = 5

contains

   !> Add the common groups.
   subroutine add_common_groups(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "scene", "What the file describes")
      call add_string(schema, "kind", "kind of machine; if left out, that of its parts", choices=scene_kinds)
      call add_string(schema, "title", "title of results and pictures", default="''")
      call add_group(schema, "motion", "The motion that is computed")
      call add_real(schema, "t_end", "end of the motion, which starts at 0", unit="s", rule=positive, required=.true.)
      call add_string(schema, "start", "state at the start: equilibrium under the constant loads, all zero, or as in &initial", &
                      choices=["static", "zero  ", "given "], default="static")
      call add_string(schema, "impacts", "whether all rigid stops that touch take part in an impact at once, or only those "// &
                      "that approach, in turn, until none does", choices=["at_once", "in_turn"], default="at_once")
      call add_string(schema, "integrator", "method; automatic: exact where all laws are piecewise linear and its forms pay, "// &
                      "else dop853", choices=integrators, default="automatic")
      call add_string(schema, "treatment", "of jumps and kinks of the laws, by a Runge-Kutta method; automatic: event", &
                      choices=treatments, default="automatic")
      call add_real(schema, "relative_tolerance", "of the error of a step", rule=positive, default="1.0e-9")
      call add_real(schema, "absolute_tolerance", "of the error of a step, in mass-normalised coordinates", rule=positive, &
                    default="1.0e-12")
      call add_real(schema, "step", "step of rk4 and moreau_jean; first step of the others, 0: chosen", unit="s", &
                    rule=nonnegative, default="0.0")
      call add_real(schema, "sharpness", "of smoothed jumps, per unit of the contact variable", rule=positive, default="1.0e6")
      call add_real(schema, "band", "half width of the band of sticking, for switching", unit="m/s or rad/s", rule=nonnegative, &
                    default="1.0e-6")
      call add_integer(schema, "max_steps", "steps after which a motion is given up", rule=positive, default="1000000000")
      call add_real(schema, "max_seconds", "time on the clock after which a motion is given up", unit="s", rule=positive, &
                    default="3600.0")
      call add_integer(schema, "memory_mb", "memory for the closed forms of exact, of one rank; what does not fit is made again", &
                       unit="2^20 bytes", low=1, high=1000000, default="256")
      call add_integer(schema, "max_events", "events after which a motion is given up", rule=positive, default="10000000")
      call add_integer(schema, "lyapunov", "Lyapunov exponents that are found, the largest ones, from t_end on; 0: none", low=0, &
                       high=10000, default="0")
      call add_integer(schema, "lyapunov_periods", "periods of the excitation over which they are found (hundredths of t_end "// &
                       "where there is none)", low=10, high=100000000, default="1000")
      call add_group(schema, "record", "A quantity that is recorded", repeatable=.true.)
      call add_string(schema, "observable", "what is recorded", choices=observables, required=.true.)
      call add_string(schema, "of", "name of the group it belongs to; needed if there is more than one; for statistics also 'all'")
      call add_string(schema, "what", "extrema, the trajectory (razy-run only), statistics of a contact_force, mean and "// &
                      "RMS, or values once in each period of the excitation", &
                      choices=recorders, least=1, most=size(recorders), required=.true.)
      call add_real(schema, "from", "start of recording", unit="s", rule=nonnegative, default="0.0")
      call add_real(schema, "interval", "time between points of the trajectory; 0 takes the natural times, those of events and "// &
                    "a few between them", unit="s", rule=nonnegative, default="0.0")
      call add_group(schema, "sweep", "A parameter that razy-sweep varies; a second group is a second axis", repeatable=.true.)
      call add_range(schema)
      call add_real(schema, "step", "step from value to value; give this or points (0: as if not given)")
      call add_integer(schema, "points", "number of values; give this or step", rule=positive)
      call add_string(schema, "direction", "whether each motion starts as &motion says, or where the one before ended: in the "// &
                      "order of the values (up), against it (down), or both", &
                      choices=["independent", "up         ", "down       ", "both       "], default="independent")
      call add_logical(schema, "kind_of_motion", "whether the period of each motion and the contacts it touches are found", &
                       default=".true.")
      call add_real(schema, "period_tolerance", "difference from period to period up to which a motion is periodic, relative "// &
                    "to the size of the state", rule=positive, default="1.0e-6")
      call add_logical(schema, "until_periodic", "whether a motion is followed only until it is periodic, t_end being the most", &
                       default=".false.")
      call add_logical(schema, "processor_time", "whether the processor time of each point is stored", default=".false.")
      call add_group(schema, "follow", "The periodic motions that razy-follow follows over a parameter; a second group is a "// &
                     "second parameter, over which their special points are followed", repeatable=.true.)
      call add_range(schema)
      call add_real(schema, "from", "where the first motion is looked for; first, if not given")
      call add_string(schema, "start_file", "file of razy-follow that has a motion to begin with")
      call add_integer(schema, "start_point", "which motion of start_file: the row of /point, from 0", low=0, high=100000000)
      call add_string(schema, "start_label", "or the label that it bears and its number in the file, as in 'PD2'")
      call add_real(schema, "values", "values of the parameter at which a motion is stored, labelled UZ", least=1, most=64)
      call add_string(schema, "sensitivities", "group%key of values whose effect on folds, doublings, tori and grazings is found", &
                      least=1, most=16)
      call add_integer(schema, "period", "periods of the excitation in one of the first motion; 0: those of the motion that "// &
                       "the start settles to", low=0, high=1000, default="0")
      call add_integer(schema, "settle", "periods of the excitation after which a motion counts as settled", low=20, high=1000000, &
                       default="300")
      call add_integer(schema, "doublings", "how often a doubling or branching is followed on", low=0, high=10, default="1")
      call add_integer(schema, "max_points", "points of a branch", rule=positive, default="2000")
      call add_string(schema, "motions", "whether the motion that the start leads to is followed, or all that are found; "// &
                      "period is then the most periods looked for (0: 4)", choices=["one", "all"], default="one")
      call add_integer(schema, "samples", "values of the parameter at which all motions are looked for", low=1, high=2000, &
                       default="20")
      call add_integer(schema, "starts", "starts beside the machine's own at each of these values", low=0, high=10000, default="8")
      call add_group(schema, "tune", "A parameter that razy-tune looks for, and the natural frequency it is to give")
      call add_string(schema, "parameter", "group%key of the value that is looked for, as in --set", required=.true.)
      call add_real(schema, "first", "first value of the range, in the unit of the key", required=.true.)
      call add_real(schema, "last", "last value of the range", required=.true.)
      call add_real(schema, "frequency", "natural frequency that the mode shall have", unit="Hz", rule=positive, required=.true.)
      call add_string(schema, "coordinate", "the mode is the one that is mostly this coordinate; give this or mode")
      call add_integer(schema, "mode", "the mode is the one with this number before tuning; give this or coordinate", rule=positive)
      call add_string(schema, "contacts", "state of the contacts: open, closed as two-way springs, or as in static equilibrium", &
                      choices=["closed     ", "open       ", "equilibrium"], default="closed")
      call add_integer(schema, "points", "values of the parameter for which frequencies are stored", low=2, high=100000, &
                       default="201")
      call add_integer(schema, "modes", "number of frequencies that are stored; all if there are fewer", rule=positive, default="6")
      call add_logical(schema, "apply", "whether razy-run and razy-sweep compute the tuned machine, tuned at each point", &
                       default=".false.")
      call add_group(schema, "duel", "A method that razy-duel sets beside others", repeatable=.true.)
      call add_string(schema, "integrator", "method", choices=integrators, required=.true.)
      call add_string(schema, "treatment", "of jumps and kinks of the laws", choices=treatments, default="automatic")
      call add_real(schema, "tolerance", "relative tolerances, one motion each; the absolute one is in proportion as in &motion", &
                    rule=positive, least=1, most=32)
      call add_real(schema, "step", "steps of a method without step control, one motion each", unit="s", rule=positive, least=1, &
                    most=32)
      call add_real(schema, "sharpness", "of smoothed jumps: one value, or one for each motion; as in &motion if not given", &
                    rule=positive, least=1, most=32)
      call add_real(schema, "band", "half width of the band of sticking; as in &motion if not given", unit="m/s or rad/s", &
                    rule=nonnegative)
      call add_start_groups(schema)
      call add_group(schema, "response", "The linear response to harmonic loads and unbalance that razy-modes finds over a "// &
                     "parameter")
      call add_range(schema)
      call add_integer(schema, "points", "number of values", low=3, high=1000000, default="401")
      call add_real(schema, "operating", "lowest and highest value in operation, for separation margins", least=2, most=2)
      call add_group(schema, "modes", "What razy-modes finds")
      call add_integer(schema, "count", "number of modes; all if there are fewer", low=1, high=100000, default="20")
      call add_string(schema, "contacts", "state of the contacts: open, closed as two-way springs (a ring stays open), or as "// &
                      "in static equilibrium (not in a rotor scene)", choices=["closed     ", "open       ", "equilibrium"], &
                      default="closed")
   end subroutine add_common_groups

   !> Add the keys of what varies, and from where to where.
   subroutine add_range(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_string(schema, "parameter", "group%key of the value that varies, as in --set; or of several that vary together", &
                      least=1, most=16, required=.true.)
      call add_real(schema, "factor", "each parameter is the first's value times its factor, the first 1; all 1 if not given", &
                    least=1, most=16)
      call add_real(schema, "first", "first value, in the unit of the key", required=.true.)
      call add_real(schema, "last", "last value", required=.true.)
   end subroutine add_range

   !> Add the groups for several starts of each point of a sweep.
   subroutine add_start_groups(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "starts", "Several initial states for each point of a sweep")
      call add_string(schema, "method", "all combinations of the values of &start_range, lists taken together, samples of a "// &
                      "box, or the rows of a file", choices=["grid", "list", "box ", "file"], required=.true.)
      call add_string(schema, "file", "comma-separated text (.csv, .txt) or HDF5 with a column for each &start_range")
      call add_integer(schema, "samples", "number of starts from a box", low=1, high=1000000000)
      call add_integer(schema, "seed", "of the samples of a box", rule=nonnegative, default="1")
      call add_real(schema, "period", "time between the states by which attractors are told apart; 0: period of the excitation", &
                    unit="s", rule=nonnegative, default="0.0")
      call add_integer(schema, "longest_period", "longest period of a motion that is recognised, in these periods", low=1, &
                       high=10000, default="8")
      call add_real(schema, "tolerance", "largest difference of states that are the same, of the largest state", rule=positive, &
                    default="1.0e-4")
      call add_group(schema, "start_range", "What &starts varies", repeatable=.true.)
      call add_string(schema, "coordinate", "coordinate that varies from start to start", required=.true.)
      call add_string(schema, "quantity", "its displacement or velocity", choices=["displacement", "velocity    "], &
                      default="displacement")
      call add_real(schema, "first", "first value of a grid, or one end of a box; m, rad, m/s or rad/s")
      call add_real(schema, "last", "last value of a grid, or the other end of a box")
      call add_integer(schema, "points", "number of values of a grid", rule=positive)
      call add_real(schema, "values", "values of a list", least=1, most=10000)
      call add_string(schema, "column", "column of &starts file; coordinate.quantity if not given")
   end subroutine add_start_groups

end module razy_scenes_common_schema
