!! A study: an input file, checked, as the machine it describes and what is to be done with it.
module razy_scenes_study
   use razy_contact_contact_law, only: branch_open
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t, peek, read_input_text
   use razy_core_kinds, only: i8, wp
   use razy_core_schema, only: group_spec_t, key_string
   use razy_core_text, only: lower, string_t
   use razy_machine_equilibrium, only: find_equilibrium
   use razy_machine_machine, only: machine_t, observable_t
   use razy_machine_method, only: check_method, method_t
   use razy_scenes_factory, only: draw_scene, new_scene, scene_kinds
   use razy_scenes_observables, only: begin_observable, observe_contact
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: check_start, contacts_asked, motion_t, new_drawing, new_machine, new_structure, read_study, record_t, study_schema

   !> What &motion says.
   type :: motion_t
      real(wp) :: t_end = 0.0_wp
      integer(i8) :: most_events = 0
      type(method_t) :: method
   end type motion_t

   !> What one &record asks for. `observable` is its number in the machine, 0 for the whole state or if only statistics are asked
   !> for; these are of contact number `contact`, 0 for all.
   type :: record_t
      integer :: observable = 0, contact = 0
      logical :: extrema = .false., trajectory = .false., statistics = .false.
      !> s.
      real(wp) :: from = 0.0_wp, interval = 0.0_wp
   end type record_t

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

      character(:), allocatable :: kind

      call peek(text, file, "scene", key_string("kind", "kind of machine", choices=scene_kinds, required=.true.), overrides, &
                kind, error)
      if (allocated(error)) return
      call read_input_text(input, text, file, study_schema(kind), overrides, error)
   end subroutine read_study

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
      character(:), allocatable :: kind

      call input%get("scene", 1, "kind", kind)
      if (present(kept)) then
         if (.not. allocated(kept)) call new_scene(kept, kind)
         call from_scene(machine, motion, records, kept, input, error)
      else
         call new_scene(scene, kind)
         call from_scene(machine, motion, records, scene, input, error)
      end if
   end subroutine new_machine

   subroutine from_scene(machine, motion, records, scene, input, error)
      type(machine_t), intent(out) :: machine
      type(motion_t), intent(out) :: motion
      type(record_t), allocatable, intent(out) :: records(:)
      class(scene_t), intent(inout) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i, most_events

      call scene%build(machine, input, error)
      if (allocated(error)) return
      call read_records(machine, records, scene, input, error)
      if (allocated(error)) return
      if (input%count("motion") == 0) then
         call input%complain(error, "motion", 1, "t_end", "required: the end of the motion in s")
         return
      end if
      call input%get("motion", 1, "t_end", motion%t_end)
      call input%get("motion", 1, "max_events", most_events)
      call read_method(motion%method, machine, input, error)
      if (allocated(error)) return
      motion%most_events = most_events
      do i = 1, size(records)
         if (records(i)%from < motion%t_end) cycle
         call input%complain(error, "record", i, "from", "less than the end of the motion, &motion t_end")
         return
      end do
      call set_start(machine, scene, input, error)
   end subroutine from_scene

   !> Numbers of the contacts whose statistics are asked for, ascending.
   pure function contacts_asked(records, contacts) result(numbers)
      type(record_t), intent(in) :: records(:)
      integer, intent(in) :: contacts
      integer, allocatable :: numbers(:)

      integer :: j

      numbers = pack([(j, j=1, contacts)], [(any(records%statistics .and. (records%contact == 0 .or. records%contact == j)), &
                                             j=1, contacts)])
   end function contacts_asked

   !> The machine that an input describes without observables and start: its matrices, contacts and loads.
   subroutine new_structure(machine, input, error)
      type(machine_t), intent(out) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      class(scene_t), allocatable :: scene
      character(:), allocatable :: kind

      call input%get("scene", 1, "kind", kind)
      call new_scene(scene, kind)
      call scene%build(machine, input, error)
   end subroutine new_structure

   !> The method that &motion names, checked against the machine's laws.
   subroutine read_method(method, machine, input, error)
      type(method_t), intent(out) :: method
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: allowed, key, text
      integer :: most_steps

      call input%get("motion", 1, "integrator", text)
      method%integrator = lower(text)
      call input%get("motion", 1, "treatment", text)
      method%treatment = lower(text)
      call input%get("motion", 1, "relative_tolerance", method%relative_tolerance)
      call input%get("motion", 1, "absolute_tolerance", method%absolute_tolerance)
      call input%get("motion", 1, "step", method%step)
      call input%get("motion", 1, "sharpness", method%sharpness)
      call input%get("motion", 1, "band", method%band)
      call input%get("motion", 1, "max_steps", most_steps)
      method%most_steps = most_steps
      call check_method(method, machine, key, allowed)
      if (len(key) > 0) call input%complain(error, "motion", 1, key, allowed)
   end subroutine read_method

   !> The geometry of the machine, for pictures; not allocated where the kind of scene has none.
   subroutine new_drawing(drawing, input, error)
      type(drawing_t), allocatable, intent(out) :: drawing
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(machine_t) :: machine
      class(scene_t), allocatable :: scene
      character(:), allocatable :: kind

      call input%get("scene", 1, "kind", kind)
      call new_scene(scene, kind)
      call scene%build(machine, input, error)
      if (.not. allocated(error)) call draw_scene(scene, drawing, input, error)
   end subroutine new_drawing

   subroutine read_records(machine, records, scene, input, error)
      type(machine_t), intent(inout) :: machine
      type(record_t), allocatable, intent(out) :: records(:)
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(observable_t) :: observable
      type(string_t), allocatable :: what(:)
      character(:), allocatable :: name
      integer :: i, k

      allocate (records(input%count("record")), machine%observable(0))
      do i = 1, size(records)
         call input%get("record", i, "from", records(i)%from)
         call input%get("record", i, "interval", records(i)%interval)
         call input%get("record", i, "what", what)
         do k = 1, size(what)
            records(i)%extrema = records(i)%extrema .or. lower(what(k)%text) == "extrema"
            records(i)%trajectory = records(i)%trajectory .or. lower(what(k)%text) == "trajectory"
            records(i)%statistics = records(i)%statistics .or. lower(what(k)%text) == "statistics"
         end do
         if (records(i)%statistics) call read_statistics(records(i), machine, input, i, error)
         if (allocated(error)) return
         if (.not. (records(i)%extrema .or. records(i)%trajectory)) cycle
         call input%get("record", i, "observable", name)
         if (lower(name) == "state") then
            if (records(i)%extrema) call input%complain(error, "record", i, "what", "'trajectory' for the state")
            if (allocated(error)) return
            cycle
         end if
         call scene%new_observable(observable, machine, input, i, error)
         if (allocated(error)) return
         do k = 1, size(machine%observable)
            if (machine%observable(k)%name /= observable%name) cycle
            call input%complain(error, "record", i, "observable", "recorded once; give both extrema and trajectory in `what`")
            return
         end do
         machine%observable = [machine%observable, observable]
         records(i)%observable = size(machine%observable)
      end do
      call check_times(records, input, error)
   end subroutine read_records

   !> Which contact statistics are asked of.
   subroutine read_statistics(record, machine, input, i, error)
      type(record_t), intent(inout) :: record
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(observable_t) :: observable
      character(:), allocatable :: name
      integer :: j

      call begin_observable(observable, machine, input, i)
      if (observable%name /= "contact_force") then
         call input%complain(error, "record", i, "what", "'statistics' of the observable 'contact_force' only")
         return
      end if
      name = ""
      if (input%given("record", i, "of")) call input%get("record", i, "of", name)
      if (lower(name) == "all" .and. .not. any([(lower(machine%contact(j)%name) == "all", j=1, size(machine%contact))])) then
         if (record%extrema .or. record%trajectory) then
            call input%complain(error, "record", i, "of", "'all' for statistics alone; give them a &record of their own")
         else if (size(machine%contact) == 0) then
            call input%complain(error, "record", i, "observable", "this needs a contact, and the scene has none")
         end if
         return
      end if
      call observe_contact(observable, machine, input, i, 1, size(machine%contact), error)
      record%contact = observable%contact
   end subroutine read_statistics

   !> All trajectories of a file share their times, and all statistics their start.
   subroutine check_times(records, input, error)
      type(record_t), intent(in) :: records(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: first, first_statistics, i

      first = 0
      first_statistics = findloc(records%statistics, .true., dim=1)
      do i = 1, size(records)
         if (records(i)%statistics) then
            if (abs(records(i)%from - records(first_statistics)%from) > 0.0_wp) then
               call input%complain(error, "record", i, "from", "the same for all statistics of contacts")
               return
            end if
         end if
         if (.not. records(i)%trajectory) cycle
         if (first == 0) first = i
         if (abs(records(i)%interval - records(first)%interval) > 0.0_wp) then
            call input%complain(error, "record", i, "interval", "the same for all trajectories, which share their times")
         else if (abs(records(i)%from - records(first)%from) > 0.0_wp) then
            call input%complain(error, "record", i, "from", "the same for all trajectories, which share their times")
         end if
         if (allocated(error)) return
      end do
   end subroutine check_times

   !> The machine without its circulatory forces, the skew part of K, which have no potential. Where K is symmetric, itself.
   pure function at_rest(machine) result(copy)
      type(machine_t), intent(in) :: machine
      type(machine_t) :: copy

      copy = machine
      associate (skew => machine%stiffness - transpose(machine%stiffness))
         if (any(abs(skew) > 1.0e-12_wp*maxval(abs(machine%stiffness)))) copy%stiffness = machine%stiffness - 0.5_wp*skew
      end associate
   end function at_rest

   !> Displacement and velocity at the time 0.
   subroutine set_start(machine, scene, input, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: start
      logical :: found
      integer :: j, n

      n = size(machine%load)
      allocate (machine%displacement(n), machine%velocity(n), source=0.0_wp)
      call input%get("motion", 1, "start", start)
      if (input%count("initial") > 0 .and. lower(start) /= "given") then
         call input%complain(error, "motion", 1, "start", "'given' where the file has &initial")
         return
      end if
      select case (lower(start))
      case ("static")
         do j = 1, size(machine%contact)
            if (.not. any(machine%contact(j)%law%constraint)) cycle
            call input%complain(error, "motion", 1, "start", "'zero', or 'given' with &initial: '"//machine%contact(j)%name// &
                                "' is a rigid stop or dry friction, with which an equilibrium is not one position")
            return
         end do
         call find_equilibrium(at_rest(machine), machine%displacement, found)
         if (.not. found) call input%complain(error, "motion", 1, "start", "the constant loads are in no equilibrium: balance "// &
                                              "them, or start from 'zero' or 'given'")
      case ("zero")
      case default
         call scene%set_initial(machine, input, error)
      end select
      if (.not. allocated(error)) call check_start(machine, input, error)
   end subroutine set_start

   !> A motion cannot start beyond a rigid stop.
   subroutine check_start(machine, input, error)
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: rounding, s
      integer :: j

      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j), edge => machine%contact(j)%law%guard(1, branch_open))
            if (.not. contact%law%impacts) cycle
            s = dot_product(contact%w, machine%displacement) + contact%offset + sum(real(contact%error))
            rounding = 16*epsilon(1.0_wp)*(dot_product(abs(contact%w), abs(machine%displacement)) + abs(contact%offset) &
                                           + sum(abs(contact%error)))
            if (.not. ((edge%above /= 0 .and. s > edge%upper + rounding) &
                       .or. (edge%below /= 0 .and. s < edge%lower - rounding))) cycle
            call input%complain(error, "motion", 1, "start", "a state that is not beyond the rigid stop '"//contact%name// &
                                "'; give the position by start = 'given' and &initial")
            return
         end associate
      end do
   end subroutine check_start

end module razy_scenes_study
