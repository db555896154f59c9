!! What is recorded of a motion: &record.
module razy_scenes_records
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: lower, string_t
   use razy_machine_machine, only: machine_t, observable_t
   use razy_scenes_observables, only: begin_observable, new_observable, observe_contact
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: contacts_asked, read_records, record_t

   !> What one &record asks for. `observable` is its number in the machine, 0 for the whole state or if only statistics are asked
   !> for; these are of contact number `contact`, 0 for all.
   type :: record_t
      integer :: observable = 0, contact = 0
      logical :: extrema = .false., trajectory = .false., statistics = .false.
      !> s.
      real(wp) :: from = 0.0_wp, interval = 0.0_wp
   end type record_t

contains

   !> All &record of an input; the machine gets its observables.
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
         call new_observable(observable, machine, scene, input, i, error)
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

   !> Numbers of the contacts whose statistics are asked for, ascending.
   pure function contacts_asked(records, contacts) result(numbers)
      type(record_t), intent(in) :: records(:)
      integer, intent(in) :: contacts
      integer, allocatable :: numbers(:)

      integer :: j

      numbers = pack([(j, j=1, contacts)], [(any(records%statistics .and. (records%contact == 0 .or. records%contact == j)), &
                                             j=1, contacts)])
   end function contacts_asked

end module razy_scenes_records
