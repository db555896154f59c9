!! The groups of bodies that turn, on lines and in a plane, and of what acts between them.
module razy_scenes_parts_schema
   use razy_core_kinds, only: wp
   use razy_input_schema, only: add_group, add_name, add_real, add_string, group_spec_t, nonnegative, positive
   use razy_scenes_common_schema, only: add_common_groups
   use razy_scenes_connections, only: add_connection_groups, add_place
   use razy_scenes_gears, only: add_gear_group
   use razy_scenes_harmonics, only: add_rotation_group
   use razy_scenes_parts_planetary, only: add_planetary
   implicit none(type, external)
   private

   public :: parts_schema, matrix_all, matrix_untuned

   !> What `&damping matrix` may be.
   character(*), parameter :: matrix_springs = "springs", matrix_all = "all", matrix_untuned = "untuned"

contains

   !> All groups of a lumped or planar scene.
   function parts_schema() result(schema)
      type(group_spec_t), allocatable :: schema(:)

      call add_common_groups(schema)
      call add_group(schema, "body", "A rigid body with the coordinates x, y and phi (counter-clockwise)", repeatable=.true.)
      call add_name(schema)
      call add_real(schema, "mass", "mass", unit="kg", rule=positive, required=.true.)
      call add_real(schema, "inertia", "moment of inertia about the centre of mass", unit="kg m^2", rule=positive, required=.true.)
      call add_string(schema, "pin", "name of the &point, of the frame or of a body before this one, about which the body "// &
                      "turns; its only coordinate is then phi")
      call add_string(schema, "held", "coordinates that the frame holds", choices=["x  ", "y  ", "phi"], least=1, most=3)
      call add_place(schema)
      call add_group(schema, "point", "A point of a body or of the frame", repeatable=.true.)
      call add_name(schema)
      call add_string(schema, "body", "name of the body that the point belongs to, or 'frame'", required=.true.)
      call add_real(schema, "position", "position in the reference position: from the centre of mass of the body, or in the "// &
                    "frame", unit="m", low=-1.0e9_wp, high=1.0e9_wp, count=2, required=.true.)
      call add_group(schema, "damping", "Damping in proportion to a stiffness matrix")
      call add_real(schema, "factor", "alpha in B = alpha K", unit="s", rule=nonnegative, required=.true.)
      call add_string(schema, "matrix", "the K in it: of the springs; of springs and contacts, as if these were springs; of "// &
                      "the springs before tuning", choices=[character(7) :: matrix_springs, matrix_all, matrix_untuned], &
                      default=matrix_springs)
      call add_connection_groups(schema)
      call add_meshes_and_actions(schema)
   end function parts_schema

   subroutine add_meshes_and_actions(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_gear_group(schema)
      call add_planetary(schema)
      call add_rotation_group(schema)
      call add_group(schema, "exciter", "Two counter-rotating eccentric rotors on a body, with force unbalance*(2 pi f)^2 each", &
                     repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_string(schema, "on", "name of the body", required=.true.)
      call add_real(schema, "position", "middle between the two axes, from the centre of mass", unit="m", low=-1.0e9_wp, &
                    high=1.0e9_wp, count=2, default="0.0, 0.0")
      call add_real(schema, "arm", "distance of each axis from the middle, across the direction", unit="m", rule=nonnegative, &
                    default="0.0")
      call add_real(schema, "direction", "direction of the resultant, of any length", count=2, default="0.0, 1.0")
      call add_real(schema, "frequency", "speed of the rotors", unit="Hz", rule=positive, required=.true.)
      call add_real(schema, "unbalance", "mass times eccentricity of each rotor", unit="kg m", rule=nonnegative)
      call add_real(schema, "force", "amplitude of the resultant of both rotors at force_frequency; instead of unbalance", &
                    unit="N", rule=nonnegative)
      call add_real(schema, "force_frequency", "frequency at which the resultant is force", unit="Hz", rule=positive)
      call add_real(schema, "phase", "phase of both rotors", unit="deg", default="0.0")
      call add_real(schema, "phase_error", "phase by which the second rotor is ahead", unit="deg", default="0.0")
   end subroutine add_meshes_and_actions

end module razy_scenes_parts_schema
