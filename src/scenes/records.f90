!! What is recorded of a motion: &record.
module razy_scenes_records
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_text, only: append_text, did_you_mean, lower, position_of, string_t
   use razy_core_tone, only: rate_of
   use razy_input_input, only: input_t
   use razy_machine_excitation, only: strobe_period
   use razy_machine_machine, only: machine_t, observable_t, observe_contact_force, observe_in_plane, observe_linear
   use razy_scenes_common_schema, only: of_averages, of_statistics, of_strobe, of_trajectory, recorders
   use razy_scenes_scene, only: coordinate_t, force_t, scene_t
   implicit none(type, external)
   private

   public :: contacts_asked, read_records, record_t

   !> What one &record asks for. `observable` is its number in the machine, 0 for the whole state or if only statistics are asked
   !> for; these are of contact number `contact`, 0 for all.
   type :: record_t
      integer :: observable = 0, contact = 0
      !> Of which recorders.
      logical :: asks(size(recorders)) = .false.
      !> s.
      real(wp) :: from = 0.0_wp, interval = 0.0_wp
   contains
      procedure :: of_points
      procedure :: has_observable
   end type record_t

   !> Quantities of contacts, and what they are called in results.
   character(*), parameter :: quantities(4) = [character(21) :: "mesh_deformation", "contact_force", "sliding_velocity", &
                                                                                                            "relative_displacement"]
   character(*), parameter :: in_words(4) = [character(21) :: "deformation", "contact force", "sliding velocity", &
                                                                                                        "relative displacement"]

contains

   !> All &record of an input; the machine gets its observables.
   subroutine read_records(machine, records, scene, input, error)
      type(machine_t), intent(inout) :: machine
      type(record_t), allocatable, intent(out) :: records(:)
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(observable_t), allocatable :: list(:)
      type(string_t), allocatable :: what(:)
      integer :: i, k, n

      allocate (records(input%count("record")), list(input%count("record")))
      n = 0
      do i = 1, size(records)
         call input%get("record", i, "from", records(i)%from)
         call input%get("record", i, "interval", records(i)%interval)
         call input%get("record", i, "what", what)
         records(i)%asks = [(position_of(trim(recorders(k)), what) > 0, k=1, size(recorders))]
         if (records(i)%asks(of_strobe) .and. .not. strobe_period(machine) > 0.0_wp) then
            call input%complain(error, "record", i, "what", "'strobe' where the excitation has a period")
         end if
         if (allocated(error)) return
         if (records(i)%asks(of_statistics)) call read_statistics(records(i), machine, input, i, error)
         if (allocated(error)) return
         if (.not. records(i)%has_observable()) cycle
         if (input%choice("record", i, "observable") == "state") then
            if (records(i)%of_points()) call input%complain(error, "record", i, "what", "'trajectory' for the state")
            if (allocated(error)) return
            cycle
         end if
         n = n + 1
         call new_observable(list(n), machine, scene, input, i, error)
         if (allocated(error)) return
         if (any([(list(k)%name == list(n)%name, k=1, n - 1)])) then
            call input%complain(error, "record", i, "observable", "recorded once; give both extrema and trajectory in `what`")
            return
         end if
         records(i)%observable = n
      end do
      machine%observable = list(:n)
      call check_times(records, input, error)
      if (.not. allocated(error)) call note_aliasing(machine, records)
   end subroutine read_records

   !> Add a caution where a trajectory has fewer than two values in a period of the fastest excitation.
   subroutine note_aliasing(machine, records)
      type(machine_t), intent(inout) :: machine
      type(record_t), intent(in) :: records(:)

      real(wp) :: fastest, interval

      interval = maxval([0.0_wp, pack(records%interval, records%asks(of_trajectory))])
      fastest = maxval([0.0_wp, abs(machine%tone%omega)])
      if (interval*fastest <= pi) return
      if (.not. allocated(machine%caution)) allocate (machine%caution(0))
      call append_text(machine%caution, "&record interval = "//to_text(interval)//" s: fewer than two values in a period of "// &
                       "the fastest excitation, "//decimal(fastest/(2*pi), 1)//" Hz, which spectra then show at another "// &
                       "frequency; an interval below "//decimal(1.0e6_wp*pi/fastest, 1)//" microseconds does not")
   end subroutine note_aliasing

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
      name = input%text("record", i, "of")
      if (lower(name) == "all" .and. .not. any([(lower(machine%contact(j)%name) == "all", j=1, size(machine%contact))])) then
         if (record%has_observable()) then
            call input%complain(error, "record", i, "of", "'all' for statistics alone; give them a &record of their own")
         else if (size(machine%contact) == 0) then
            call input%complain(error, "record", i, "observable", "this needs a contact, and the scene has none")
         end if
         return
      end if
      call observe_contact(observable, machine, input, i, 1, size(machine%contact), error)
      record%contact = observable%contact
   end subroutine read_statistics

   !> Something of it is stored of each point of a sweep.
   elemental logical function of_points(self)
      class(record_t), intent(in) :: self

      of_points = count(self%asks) > merge(1, 0, self%asks(of_trajectory))
   end function of_points

   !> Its observable is recorded, not only what becomes of a contact.
   pure logical function has_observable(self)
      class(record_t), intent(in) :: self

      has_observable = count(self%asks) > merge(1, 0, self%asks(of_statistics))
   end function has_observable

   !> All trajectories of a file share their times, and all statistics, averages and strobes their start.
   subroutine check_times(records, input, error)
      type(record_t), intent(in) :: records(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call same(records%asks(of_trajectory), records%interval, "interval", "trajectories, which share their times")
      call same(records%asks(of_trajectory), records%from, "from", "trajectories, which share their times")
      call same(records%asks(of_statistics), records%from, "from", "statistics of contacts")
      call same(records%asks(of_averages), records%from, "from", "averages")
      call same(records%asks(of_strobe), records%from, "from", "strobes")

   contains

      subroutine same(asked, time, key, what)
         logical, intent(in) :: asked(:)
         real(wp), intent(in) :: time(:)
         character(*), intent(in) :: key, what

         integer :: i

         i = findloc(asked .and. time > minval(time, mask=asked), .true., dim=1)
         if (i > 0 .and. .not. allocated(error)) call input%complain(error, "record", i, key, "the same for all "//what)
      end subroutine same

   end subroutine check_times

   !> Numbers of the contacts whose statistics are asked for, ascending.
   pure function contacts_asked(records, contacts) result(numbers)
      type(record_t), intent(in) :: records(:)
      integer, intent(in) :: contacts
      integer, allocatable :: numbers(:)

      integer :: j

      numbers = pack([(j, j=1, contacts)], [(any(records%asks(of_statistics) .and. (records%contact == 0 &
                                                                                    .or. records%contact == j)), j=1, contacts)])
   end function contacts_asked

   !> An observable of a machine, called what `&record` number i calls it, that is zero so far.
   subroutine begin_observable(observable, machine, input, i)
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i

      integer :: n

      observable%name = input%choice("record", i, "observable")
      n = size(machine%load)
      allocate (observable%on_displacement(n), observable%on_velocity(n), source=0.0_wp)
      allocate (observable%error(size(machine%tone)), source=(0.0_wp, 0.0_wp))
   end subroutine begin_observable

   !> The observable of `&record` number i, which is not `observable = 'state'`.
   subroutine new_observable(observable, machine, scene, input, i, error)
      type(observable_t), intent(out) :: observable
      type(machine_t), intent(in) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(coordinate_t) :: of
      type(force_t) :: force
      integer :: bounds(2, size(quantities)), q

      call begin_observable(observable, machine, input, i)
      select case (observable%name)
      case ("connection_force")
         call scene%find_force(force, input, i, input%text("record", i, "of"), error)
         if (allocated(error)) return
         observable%on_displacement = force%on_displacement
         observable%on_velocity = force%on_velocity
         observable%unit = trim(merge("N m", "N  ", force%turns))
         observable%long_name = "force of "//input%text("record", i, "of")
      case ("displacement", "velocity")
         call scene%find_coordinate(of, input, "record", i, "of", error)
         if (allocated(error)) return
         if (observable%name == "displacement") observable%on_displacement = of%row
         if (observable%name == "velocity") observable%on_velocity = of%row
         observable%unit = trim(merge("rad", "m  ", of%turns))
         if (observable%name == "velocity") observable%unit = observable%unit//"/s"
         observable%long_name = observable%name//" of "//of%name
      case default
         ! The contacts of a machine are its gear meshes, its stops, its springs that are not linear, and its friction elements.
         associate (meshes => input%count("gear_mesh"), n => size(machine%contact), frictions => input%count("friction"))
            bounds = reshape([1, meshes, 1, n, n - frictions + 1, n, meshes + 1, n - frictions], shape(bounds))
         end associate
         q = findloc(quantities == observable%name, .true., dim=1)
         call observe_contact(observable, machine, input, i, bounds(1, q), bounds(2, q), error)
      end select
      if (allocated(error)) return
      if (input%given("record", i, "of")) observable%name = observable%name//"."//input%text("record", i, "of")
   end subroutine new_observable

   !> Make it the force, the variable s or the rate s' of the contact that the record names, one of `first` to `last`.
   subroutine observe_contact(observable, machine, input, i, first, last, error)
      type(observable_t), intent(inout) :: observable
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, first, last
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      integer :: contact

      allocate (known(max(0, last - first + 1)))
      do contact = first, last
         known(contact - first + 1)%text = machine%contact(contact)%name
      end do
      if (size(known) == 0) then
         call input%complain(error, "record", i, "observable", "this needs a contact, and the scene has none of its kind")
         return
      end if
      call pick(input, i, known, contact, error)
      if (allocated(error)) return
      observable%contact = first - 1 + contact
      associate (chosen => machine%contact(observable%contact))
         observable%kind = merge(observe_in_plane, observe_linear, allocated(chosen%frame) &
                                 .or. (chosen%law%of_normal .and. abs(chosen%drive_rate) > 0.0_wp))
         if (observable%name == "contact_force") observable%kind = observe_contact_force
         observable%on_displacement = chosen%w
         observable%constant = chosen%offset
         observable%error = chosen%error
         if (chosen%law%remembers) observable%error = (0.0_wp, 0.0_wp)
         observable%unit = chosen%unit
         if (observable%name == "contact_force") observable%unit = chosen%force_unit
         if (observable%name == "sliding_velocity") then
            observable%on_displacement = 0.0_wp
            observable%on_velocity = chosen%w
            observable%constant = chosen%drive
            observable%error = rate_of(machine%tone, chosen%error)
            observable%unit = chosen%unit//"/s"
         end if
         observable%long_name = chosen%name//" "//trim(in_words(findloc(quantities == observable%name, .true., dim=1)))
      end associate
   end subroutine observe_contact

   !> The place in `known` of the name in `of`; without a name the only one there is.
   subroutine pick(input, i, known, place, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(string_t), intent(in) :: known(:)
      integer, intent(out) :: place
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name

      place = 1
      if (.not. input%given("record", i, "of")) then
         if (size(known) > 1) call input%complain(error, "record", i, "of", &
                                                  "required where there are several; "//did_you_mean("", known, "contacts"))
         return
      end if
      name = input%text("record", i, "of")
      place = position_of(name, known)
      if (place == 0) call input%complain(error, "record", i, "of", did_you_mean(name, known, "contacts"))
   end subroutine pick

end module razy_scenes_records
