!! The result file of razy-run: trajectory, observables, events and extrema of one motion, whatever of them was asked for.
module razy_io_run_file
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: check_name, extrema_t, write_extrema
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_header, only: result_header_t, write_header
   implicit none(type, external)
   private

   public :: contact_value_t, history_t, run_content_t, run_outcome_t, write_run_file

   !> How the motion ended, and what it took: status (explained by `status_meanings`), time reached in s, counters.
   type :: run_outcome_t
      integer(int32) :: status = 0
      character(:), allocatable :: status_meanings(:)
      real(wp) :: time = 0.0_wp
      integer(int64) :: events = 0, steps = 0, rejected = 0, evaluations = 0, jacobians = 0, factorisations = 0, impacts = 0, &
                        accumulations = 0, doubts = 0
      !> Time of the first event in doubt, s.
      real(wp) :: doubt_time = 0.0_wp
   end type run_outcome_t

   !> An observable over time.
   type :: history_t
      character(:), allocatable :: name
      character(:), allocatable :: units
      character(:), allocatable :: long_name
      !> Values (times) in `units`.
      real(wp), allocatable :: values(:)
   end type history_t

   !> A number of a contact, with the path of its dataset, such as `/contact/mesh/impulse`.
   type :: contact_value_t
      character(:), allocatable :: path, units, long_name
      real(wp) :: value = 0.0_wp
   end type contact_value_t

   !> The results; an array that is not allocated was not asked for and is not written.
   type :: run_content_t
      !> Times in s (times); needed by displacement, velocity and observables.
      real(wp), allocatable :: time(:)
      !> Names of the coordinates (coordinates).
      character(:), allocatable :: coordinate_names(:)
      !> Units of each displacement (coordinates).
      character(:), allocatable :: coordinate_units(:)
      !> State (coordinates, times), in `coordinate_units` and the same per second.
      real(wp), allocatable :: displacement(:, :)
      real(wp), allocatable :: velocity(:, :)
      type(history_t), allocatable :: observables(:)
      !> Times of the events in s (events).
      real(wp), allocatable :: event_time(:)
      !> Contact of each event (events), an index from 1 into `contact_names`.
      integer(int32), allocatable :: event_contact(:)
      !> Branch that was entered (events), explained by `event_meanings`.
      integer(int32), allocatable :: event_state(:)
      character(:), allocatable :: contact_names(:)
      character(:), allocatable :: event_meanings
      type(run_outcome_t), allocatable :: outcome
      !> Extrema, without `offset`.
      type(extrema_t), allocatable :: extrema(:)
      !> Statistics of contacts.
      type(contact_value_t), allocatable :: contact_values(:)
   end type run_content_t

   character(*), parameter :: coordinate = "/state/coordinate"
   character(*), parameter :: state_time = "/state/time"

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_run_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(run_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file

      call check_content(content, error)
      if (allocated(error)) return
      call file%create(path, error)
      if (allocated(error)) return
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_content(file, content, error)
      if (allocated(error)) then
         call file%discard()
      else
         call file%commit(overwrite, error)
      end if
   end subroutine write_run_file

   !> Refuse arrays that do not belong together.
   subroutine check_content(content, error)
      type(run_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (allocated(content%displacement)) call check_state(content, shape(content%displacement), "displacement", error)
      if (allocated(error)) return
      if (allocated(content%velocity)) call check_state(content, shape(content%velocity), "velocity", error)
      if (allocated(error)) return
      if (allocated(content%observables)) then
         do i = 1, size(content%observables)
            call check_history(content, content%observables(i), error)
            if (allocated(error)) return
         end do
      end if
      if (allocated(content%event_time)) then
         if (size(content%event_contact) /= size(content%event_time) .or. &
             size(content%event_state) /= size(content%event_time)) then
            call raise(error, "run result: time, contact and state of the events differ in length")
         else if (any(content%event_contact < 1) .or. any(content%event_contact > size(content%contact_names))) then
            call raise(error, "run result: an event has a contact without a name")
         end if
      end if
   end subroutine check_content

   !> Refuse a state that does not fit the times and the names of the coordinates.
   subroutine check_state(content, extent, what, error)
      type(run_content_t), intent(in) :: content
      integer, intent(in) :: extent(2)
      character(*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(content%time)) then
         call raise(error, "run result: "//what//" without time")
      else if (extent(2) /= size(content%time)) then
         call raise(error, "run result: "//what//" and time differ in length")
      else if (extent(1) /= size(content%coordinate_names) .or. extent(1) /= size(content%coordinate_units)) then
         call raise(error, "run result: "//what//" has not as many coordinates as there are names and units")
      end if
   end subroutine check_state

   !> Refuse an observable that does not fit the times, or whose name netCDF would take for the dimension.
   subroutine check_history(content, history, error)
      type(run_content_t), intent(in) :: content
      type(history_t), intent(in) :: history
      type(error_t), allocatable, intent(out) :: error

      call check_name(history%name, error)
      if (allocated(error)) return
      if (history%name == "time") then
         call raise(error, "run result: an observable cannot be called time")
      else if (.not. allocated(content%time)) then
         call raise(error, "run result: observable "//history%name//" without time")
      else if (size(history%values) /= size(content%time)) then
         call raise(error, "run result: observable "//history%name//" and time differ in length")
      end if
   end subroutine check_history

   !> The datasets of all groups.
   subroutine write_content(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(run_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (allocated(content%time)) then
         ! Were /time a coordinate of the root, xarray would let it hide the times of events and extrema in the groups below.
         call add_dimension(file, "/sample", size(content%time, kind=int64), "samples, dimension only", error)
         if (.not. allocated(error)) call write_dataset(file, "/time", content%time, "s", "time", "/sample", error)
         if (allocated(error)) return
      end if
      if (allocated(content%outcome)) call write_outcome(file, content%outcome, error)
      if (allocated(error)) return
      call write_state(file, content, error)
      if (allocated(error)) return
      if (allocated(content%observables)) call write_observables(file, content, error)
      if (allocated(error)) return
      if (allocated(content%event_time)) call write_events(file, content, error)
      if (allocated(content%extrema)) then
         do i = 1, size(content%extrema)
            if (allocated(error)) return
            call write_extrema(file, content%extrema(i), error)
         end do
      end if
      if (.not. allocated(content%contact_values)) return
      do i = 1, size(content%contact_values)
         if (allocated(error)) return
         associate (stored => content%contact_values(i))
            call write_dataset(file, stored%path, stored%value, stored%units, stored%long_name, error)
         end associate
      end do
   end subroutine write_content

   !> The group `/state`, if displacement or velocity is there.
   subroutine write_state(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(run_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(content%displacement) .and. .not. allocated(content%velocity)) return
      call write_dataset(file, coordinate, content%coordinate_names, "1", "coordinate", coordinate, error)
      if (allocated(error)) return
      call write_dataset(file, state_time, content%time, "s", "time", state_time, error)
      if (allocated(error)) return
      if (allocated(content%displacement)) then
         call write_motion(file, "/state/displacement", content%displacement, content%coordinate_names, &
                           content%coordinate_units, "displacement", error)
         if (allocated(error)) return
      end if
      if (allocated(content%velocity)) then
         call write_motion(file, "/state/velocity", content%velocity, content%coordinate_names, &
                           per_second(content%coordinate_units), "velocity", error)
      end if
   end subroutine write_state

   !> Displacement or velocity with the names and the units of the coordinates.
   subroutine write_motion(file, path, values, names, units, long_name, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, names(:), units(:), long_name
      real(wp), intent(in), contiguous :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: unit

      unit = "1"
      if (size(units) > 0) then
         unit = trim(units(1))
         if (any(units /= unit)) unit = "mixed"
      end if
      call write_dataset(file, path, values, unit, long_name, [character(len(coordinate)) :: coordinate, state_time], error)
      if (.not. allocated(error)) call write_attribute(file, path, "names", names, error)
      if (.not. allocated(error)) call write_attribute(file, path, "coordinate_units", units, error)
   end subroutine write_motion

   !> The units divided by s.
   pure function per_second(units) result(rates)
      character(*), intent(in) :: units(:)
      character(len(units) + 2) :: rates(size(units))
      integer :: i

      do i = 1, size(units)
         rates(i) = trim(units(i))//"/s"
      end do
   end function per_second

   !> The group `/observable`, if there are observables.
   subroutine write_observables(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(run_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      character(*), parameter :: time = "/observable/time"
      integer :: i

      if (size(content%observables) == 0) return
      call write_dataset(file, time, content%time, "s", "time", time, error)
      do i = 1, size(content%observables)
         if (allocated(error)) return
         associate (history => content%observables(i))
            call write_dataset(file, "/observable/"//history%name, history%values, history%units, history%long_name, time, error)
         end associate
      end do
   end subroutine write_observables

   !> The group `/outcome`.
   subroutine write_outcome(file, outcome, error)
      type(hdf5_file_t), intent(in) :: file
      type(run_outcome_t), intent(in) :: outcome
      type(error_t), allocatable, intent(out) :: error
      character(*), parameter :: single = "/outcome/single"

      call add_dimension(file, single, 1_int64, "one value, dimension only", error)
      if (.not. allocated(error)) call write_dataset(file, "/outcome/status", [outcome%status], "1", "how the motion ended", &
                                                     single, error)
      if (.not. allocated(error)) call write_attribute(file, "/outcome/status", "meanings", outcome%status_meanings, error)
      if (.not. allocated(error)) call write_dataset(file, "/outcome/time", [outcome%time], "s", "time reached", single, error)
      call count_of("events", outcome%events, "changes of branch")
      call count_of("steps", outcome%steps, "steps taken")
      call count_of("rejected", outcome%rejected, "steps rejected")
      call count_of("rhs_evaluations", outcome%evaluations, "right-hand sides")
      call count_of("jacobians", outcome%jacobians, "Jacobian matrices")
      call count_of("factorisations", outcome%factorisations, "factorisations of matrices")
      call count_of("impacts", outcome%impacts, "jumps of the velocity")
      call count_of("accumulations", outcome%accumulations, "accumulations of impacts carried to their end")
      call count_of("doubts", outcome%doubts, "events in doubt: missed or none, for all that the method knows")
      if (.not. allocated(error)) call write_dataset(file, "/outcome/doubt_time", [outcome%doubt_time], "s", &
                                                     "start of the step with the first event in doubt", single, error)

   contains

      subroutine count_of(name, number, meaning)
         character(*), intent(in) :: name, meaning
         integer(int64), intent(in) :: number

         if (.not. allocated(error)) call write_dataset(file, "/outcome/"//name, [number], "1", meaning, single, error)
      end subroutine count_of

   end subroutine write_outcome

   !> The group `/event`.
   subroutine write_events(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(run_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error
      character(*), parameter :: event = "/event/event"

      call add_dimension(file, event, size(content%event_time, kind=int64), "events, dimension only", error)
      if (allocated(error)) return
      call write_dataset(file, "/event/time", content%event_time, "s", "time of the event", event, error)
      if (allocated(error)) return
      call write_dataset(file, "/event/contact", content%event_contact, "1", "number of the contact, from 1", event, error)
      if (allocated(error)) return
      call write_attribute(file, "/event/contact", "names", content%contact_names, error)
      if (allocated(error)) return
      call write_dataset(file, "/event/state", content%event_state, "1", "branch of the contact law entered", event, error)
      if (.not. allocated(error)) call write_attribute(file, "/event/state", "meanings", content%event_meanings, error)
   end subroutine write_events

end module razy_io_run_file
