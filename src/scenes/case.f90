!! A study: an input file, checked, as the machine it describes and what is to be done with it.
module razy_scenes_case
   use razy_core_error, only: complaint, error_t, from_option, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, lower, string_t
   use razy_input_input, only: check_input, input_t, peek
   use razy_input_reader, only: entries_t, read_entries
   use razy_input_schema, only: add_group, add_string, group_at, group_spec_t
   use razy_machine_machine, only: machine_t
   use razy_motion_method, only: check_method, method_t
   use razy_scenes_common_schema, only: kind_of_parts, of_trajectory, parts, scene_kinds
   use razy_scenes_factory, only: new_scene
   use razy_scenes_parts_planetary, only: expand_planetary
   use razy_scenes_records, only: read_records, record_t
   use razy_scenes_scene, only: scene_t
   use razy_scenes_start, only: set_start
   use razy_scenes_teeth, only: expand_teeth
   implicit none(type, external)
   private

   public :: motion_t, new_machine, new_observed, new_structure, read_motion, read_study, study_schema

   !> What &motion says.
   type :: motion_t
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      !> Lyapunov exponents asked for, and periods over which they are found.
      integer :: lyapunov = 0, lyapunov_periods = 0
      type(method_t) :: method
   end type motion_t

   !> Points that a trajectory may have.
   real(wp), parameter :: most_points = 1.0e8_wp

contains

   !> The schema of a kind of scene.
   function study_schema(kind) result(schema)
      character(*), intent(in) :: kind
      type(group_spec_t), allocatable :: schema(:)

      class(scene_t), allocatable :: scene

      call new_scene(scene, kind)
      if (allocated(scene)) then
         schema = scene%schema()
      else
         allocate (schema(0))
      end if
   end function study_schema

   !> Check the text of an input file against the schema of its kind of scene, `--set` overrides included.
   subroutine read_study(input, text, file, overrides, error)
      type(input_t), intent(out) :: input
      character(*), intent(in) :: text, file
      type(string_t), intent(in) :: overrides(:)
      type(error_t), allocatable, intent(out) :: error

      type(entries_t) :: said
      type(group_spec_t), allocatable :: scene(:), schema(:)
      type(string_t), allocatable :: more(:)
      character(:), allocatable :: kind
      logical :: is_given

      call read_entries(said, text, file, overrides, error)
      if (allocated(error)) return
      more = overrides
      call add_group(scene, "scene", "")
      call add_string(scene, "kind", "", choices=scene_kinds)
      call peek(said, scene, kind, error)
      is_given = .not. allocated(error)
      if (is_given) is_given = len(kind) > 0
      if (.not. allocated(error)) call find_kind(said, kind, error)
      if (.not. (allocated(error) .or. is_given)) then
         call append_text(more, "scene%kind="//kind)
         call read_entries(said, text, file, more, error)
      end if
      if (allocated(error)) return
      schema = study_schema(kind)
      call expand_planetary(said, text, more, schema, error)
      if (.not. allocated(error)) call expand_teeth(said, schema, error)
      if (.not. allocated(error)) call refuse_foreign(said, kind, schema, error)
      if (.not. allocated(error)) call check_input(input, said, schema, error)
   end subroutine read_study

   !> Refuse a group that is not in the schema but in that of machines with shafts, or of those without, by what it needs.
   subroutine refuse_foreign(said, kind, schema, error)
      type(entries_t), intent(in) :: said
      character(*), intent(in) :: kind
      type(group_spec_t), intent(in) :: schema(:)
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: needs(2) = [character(60) :: "for machines with shafts, &shaft, and this one has none", &
                                                                               "for machines without shafts, and this one has them"]
      type(group_spec_t), allocatable :: other(:)
      character(:), allocatable :: origin
      integer :: i

      do i = 1, size(said%list)
         associate (item => said%list(i))
            if (group_at(schema, item%path%group) > 0) cycle
            if (.not. allocated(other)) other = study_schema(trim(merge("planar", "rotor ", lower(kind) == "rotor")))
            if (group_at(other, item%path%group) == 0) cycle
            origin = said%file//":"//to_text(item%line)
            if (allocated(item%option)) origin = from_option
            call raise(error, complaint(origin, item%path%group, "", "", trim(needs(merge(2, 1, lower(kind) == "rotor")))))
            return
         end associate
      end do
   end subroutine refuse_foreign

   !> The kind of scene that all parts are of, if `kind` is empty; parts of another kind are refused.
   subroutine find_kind(said, kind, error)
      type(entries_t), intent(in) :: said
      character(:), allocatable, intent(inout) :: kind
      type(error_t), allocatable, intent(out) :: error

      integer :: g, i, part(size(said%list))

      ! Of each group the kind of its part, 0 for none; each kind has the bodies with one coordinate.
      do i = 1, size(part)
         g = findloc(parts == said%list(i)%path%group, .true., dim=1)
         part(i) = 0
         if (g > 0 .and. len(said%list(i)%path%key) == 0) part(i) = findloc(scene_kinds, kind_of_parts(max(g, 1)), dim=1)
      end do
      if (len(kind) == 0 .and. any(part > 0)) kind = trim(scene_kinds(maxval(part)))
      do i = 1, size(part)
         if (part(i) < 2 .or. (part(i) == 3 .eqv. lower(kind) == "rotor")) cycle
         call raise(error, complaint(said%file//":"//to_text(said%list(i)%line), said%list(i)%path%group, "", "", "a part of a "// &
                                     trim(scene_kinds(part(i)))//" scene, and this scene is "//lower(kind)//": beside shafts a "// &
                                     "body is a &housing, and without shafts there is none"))
         return
      end do
      if (len(kind) == 0) call raise(error, complaint(said%file, "scene", "kind", "", "is required, one of 'lumped', 'planar', "// &
                                                      "'rotor', where no &inertia, &mass, &body or &shaft says it"))
   end subroutine find_kind

   !> The machine that an input describes, with observables and start, and what is to be done with it. `kept`: the scene of the
   !> machine before, with the same kind; what this machine has in common with that one is not made again.
   subroutine new_machine(machine, motion, records, input, error, kept)
      type(machine_t), intent(out) :: machine
      type(motion_t), intent(out) :: motion
      type(record_t), allocatable, intent(out) :: records(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error
      class(scene_t), allocatable, intent(inout), optional :: kept

      class(scene_t), allocatable :: scene

      if (present(kept)) call move_alloc(kept, scene)
      call new_observed(machine, records, input, error, scene)
      if (.not. allocated(error)) call read_motion(motion, machine, records, input, error)
      if (.not. allocated(error)) call set_start(machine, scene, input, error)
      if (present(kept)) call move_alloc(scene, kept)
   end subroutine new_machine

   !> The same but for motion and start, which is rest in the reference position.
   subroutine new_observed(machine, records, input, error, scene)
      type(machine_t), intent(out) :: machine
      type(record_t), allocatable, intent(out) :: records(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error
      class(scene_t), allocatable, intent(inout) :: scene

      if (.not. allocated(scene)) call new_scene(scene, input%choice("scene", 1, "kind"))
      call scene%build(machine, input, error)
      if (.not. allocated(error)) call read_records(machine, records, scene, input, error)
      if (allocated(error)) return
      machine%impacts_in_turn = input%choice("motion", 1, "impacts") == "in_turn"
      machine%displacement = 0*machine%load
      machine%velocity = machine%displacement
   end subroutine new_observed

   !> What &motion says of a machine and what is recorded of it.
   subroutine read_motion(motion, machine, records, input, error)
      type(motion_t), intent(out) :: motion
      type(machine_t), intent(in) :: machine
      type(record_t), intent(in) :: records(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      logical, allocatable :: dense(:), late(:)
      integer :: i

      if (input%count("motion") == 0) call input%complain(error, "motion", 1, "t_end", "required: the end of the motion in s")
      if (allocated(error)) return
      call input%get("motion", 1, "t_end", motion%t_end)
      call read_method(motion%method, machine, input, error)
      if (allocated(error)) return
      motion%most_events = input%whole("motion", 1, "max_events")
      call input%get("motion", 1, "lyapunov", motion%lyapunov)
      call input%get("motion", 1, "lyapunov_periods", motion%lyapunov_periods)
      late = .not. records%from < motion%t_end
      dense = records%asks(of_trajectory) .and. records%interval > 0.0_wp &
              .and. motion%t_end - records%from > most_points*records%interval
      if (motion%lyapunov > 0 .and. .not. motion%method%gives_tangents()) then
         call input%complain(error, "motion", 1, "lyapunov", "0 with this method: exponents need integrator='exact', or a "// &
                             "Runge-Kutta method with treatment='event'")
      else if (motion%lyapunov > 0 .and. abs(machine%acceleration) > 0.0_wp) then
         call input%complain(error, "motion", 1, "lyapunov", "0 where &rotation has an acceleration_rpm_per_s")
      else if (motion%lyapunov > 0 .and. any([(machine%contact(i)%law%remembers, i=1, size(machine%contact))])) then
         call input%complain(error, "motion", 1, "lyapunov", "0 with a Jenkins element, which remembers where it slid to")
      else if (any(late)) then
         call input%complain(error, "record", findloc(late, .true., dim=1), "from", &
                             "less than the end of the motion, &motion t_end")
      else if (any(dense)) then
         call input%complain(error, "record", findloc(dense, .true., dim=1), "interval", &
                             "longer: the trajectory would have more than 1e8 points")
      end if
   end subroutine read_motion

   !> The machine that an input describes without observables and start: its matrices, contacts and loads.
   subroutine new_structure(machine, input, error)
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      class(scene_t), allocatable :: scene

      call new_scene(scene, input%choice("scene", 1, "kind"))
      call scene%build(machine, input, error)
   end subroutine new_structure

   !> The method that &motion names, checked against the machine's laws.
   subroutine read_method(method, machine, input, error)
      type(method_t), intent(out) :: method
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: allowed, key

      method%integrator = input%choice("motion", 1, "integrator")
      method%treatment = input%choice("motion", 1, "treatment")
      call input%get("motion", 1, "relative_tolerance", method%relative_tolerance)
      call input%get("motion", 1, "absolute_tolerance", method%absolute_tolerance)
      call input%get("motion", 1, "step", method%step)
      call input%get("motion", 1, "sharpness", method%sharpness)
      call input%get("motion", 1, "band", method%band)
      method%most_steps = input%whole("motion", 1, "max_steps")
      call input%get("motion", 1, "max_seconds", method%most_seconds)
      call input%get("motion", 1, "memory_mb", method%memory_mb)
      call check_method(method, machine, key, allowed)
      if (len(key) > 0) call input%complain(error, "motion", 1, key, allowed)
   end subroutine read_method

end module razy_scenes_case
