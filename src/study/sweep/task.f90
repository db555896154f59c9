!! A sweep as the input describes it: its axes and directions, and one motion at each of its points.
!!
!! The propagator keeps modes from point to point as long as only excitation, clearances or start differ; that changes no bit of a
!! result. In a chain each motion starts where the one before ended (razy_study_sweep_continuation_state).
!!
!! A number more of each point is a column more in `run`, in an observer or in the outcome: packets, checkpoint and file go
!! through the columns of a row, whatever they are.
module razy_study_sweep_task
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: counted, to_text
   use razy_core_table, only: table_t
   use razy_hybrid_flow, only: flow_t
   use razy_input_input, only: input_t
   use razy_io_result_file, only: check_name, new_header, result_header_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: outcome_t, status_interrupted, status_no_machine, &
                                     status_not_computed, status_ok
   use razy_scenes_case, only: motion_t, new_machine
   use razy_scenes_factory, only: draw_scene
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   use razy_scenes_start, only: check_start
   use razy_study_sweep_axes, only: new_axes, put_point, put_value, varied_t
   use razy_study_sweep_continuation_state, only: continuation_state_t
   use razy_study_sweep_starts, only: new_starts, starts_t
   use razy_study_tune, only: apply_tune, tunes
   use razy_study_watch, only: watch_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_grid, only: grid_t, most_points
   use razy_sweep_plan, only: new_plan, plan_t
   use razy_sweep_task, only: point_task
   implicit none(type, external)
   private

   public :: new_sweep, sweep_task_t

   !> The task of a sweep over one or two values of an input; `plan` numbers its points, all of which are missing in it.
   type, extends(point_task) :: sweep_task_t
      type(input_t) :: input
      type(varied_t), allocatable :: varied(:)
      type(grid_t) :: grid
      type(starts_t) :: starts
      type(plan_t) :: plan
      !> What the result file says of the whole sweep; the picture of the machine at the first values.
      type(result_header_t) :: header
      type(drawing_t), allocatable :: drawing
      !> What was made of a point last.
      type(machine_t), allocatable :: machine
      type(motion_t) :: motion
      type(watch_t) :: watch
      !> The tuned value of the point and its unit, if &tune is applied; whether processor time is stored.
      real(wp), allocatable, private :: tuned
      character(:), allocatable, private :: tuned_unit
      logical, private :: asks_time = .false.
      class(scene_t), allocatable, private :: scene
      class(flow_t), allocatable, private :: integrator
   contains
      procedure :: describe
      procedure :: run => run_point
      procedure :: machine_at
      procedure, private :: check_ends
      procedure, private :: plan_points
   end type sweep_task_t

contains

   !> Make the task of an input, on every rank; `starts` is what `read_start_file` found.
   subroutine new_sweep(self, input, starts, error)
      type(sweep_task_t), intent(out) :: self
      type(input_t), intent(in) :: input
      real(wp), intent(in) :: starts(:)
      type(error_t), allocatable, intent(out) :: error

      type(record_t), allocatable :: records(:)
      integer :: i

      self%input = input
      call new_axes(self%varied, self%grid, input, error)
      if (allocated(error)) return
      allocate (self%machine)
      call new_machine(self%machine, self%motion, records, self%input, error, self%scene)
      if (.not. allocated(error)) call new_starts(self%starts, self%machine, input, error, starts)
      if (.not. allocated(error) .and. self%starts%count > most_points/self%grid%n_points()) then
         call input%complain(error, "starts", 1, "", "at most "//counted(to_text(most_points/self%grid%n_points()), "start")// &
                             " of each of "//to_text(self%grid%n_points())//" points")
      end if
      if (allocated(error)) return
      if (self%starts%wanted) self%watch%periods = 2*self%starts%longest_period
      call self%plan_points()
      call self%check_ends(records, error)
      if (allocated(error)) return
      if (.not. any(records%of_points())) then
         call input%complain(error, "record", 1, "what", "more than a 'trajectory' of at least one observable, for a sweep")
         return
      end if
      call input%get("sweep", 1, "kind_of_motion", self%watch%asks_kind)
      call input%get("sweep", 1, "period_tolerance", self%watch%periodicity%tolerance)
      call input%get("sweep", 1, "until_periodic", self%watch%until_periodic)
      call input%get("sweep", 1, "processor_time", self%asks_time)
      if (self%watch%until_periodic .and. .not. self%watch%asks_kind) then
         call input%complain(error, "sweep", 1, "until_periodic", "only with kind_of_motion=.true.")
      else if (self%plan%has_chains() .and. abs(self%machine%acceleration) > 0.0_wp) then
         call input%complain(error, "sweep", 1, "direction", "'independent' where &rotation has an acceleration_rpm_per_s")
      end if
      if (allocated(error)) return
      self%watch%keep_all = self%plan%has_chains()
      call self%watch%ask(records, self%machine, self%motion, error)
      do i = 1, size(self%varied)
         if (.not. allocated(error)) call check_name(self%varied(i)%parameter, error)
      end do
      do i = 1, size(self%starts%range)
         if (.not. allocated(error)) call check_name(self%starts%range(i)%name, error)
      end do
      if (allocated(error)) return
      self%header = new_header("razy-sweep", self%machine%title, self%motion%method%integrator, self%motion%method%treatment, &
                               input%effective())
      call draw_scene(self%scene, self%drawing, self%input, error)
   end subroutine new_sweep

   !> All points, alone or as chains.
   subroutine plan_points(self)
      class(sweep_task_t), intent(inout) :: self

      character(:), allocatable :: asked
      integer, allocatable :: directions(:)
      logical :: whole

      asked = self%input%choice("sweep", 1, "direction")
      directions = pack([1, -1], [any(asked == ["up  ", "both"]), any(asked == ["down", "both"])])
      associate (first => self%grid%axes(1)%n)
         call new_plan(self%plan, first, self%grid%n_points()/first, directions, self%starts%count)
      end associate
      call self%plan%close(whole)
   end subroutine plan_points

   !> Refuse a sweep whose ends are out of the key's range or no machine; what fails between them becomes a status.
   subroutine check_ends(self, records, error)
      class(sweep_task_t), intent(inout) :: self
      type(record_t), allocatable, intent(inout) :: records(:)
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      integer :: i, k

      do k = 2**size(self%varied) - 1, 0, -1
         do i = 1, size(self%varied)
            associate (axis => self%grid%axes(i), at_first => btest(k, i - 1))
               call put_value(self%varied(i), self%input, axis%value(merge(1_i8, axis%n, at_first)), problem)
               if (allocated(problem)) call self%input%complain(error, "sweep", i, trim(merge("first", "last ", at_first)), &
                                                                problem%message)
            end associate
            if (allocated(error)) return
         end do
         call make_machine(self, records, error)
         if (self%starts%wanted .and. .not. allocated(error)) then
            call self%starts%strobe_period(self%machine, self%motion%t_end, self%input, self%watch%states%interval, error)
         end if
         if (allocated(error)) return
      end do
   end subroutine check_ends

   !> Make the machine of a point, and take over what is asked of it.
   subroutine machine_at(self, point, error)
      class(sweep_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(error_t), allocatable, intent(out) :: error

      type(record_t), allocatable :: records(:)

      call put_point(self%varied, self%grid, self%input, self%plan%grid_point(point), error)
      if (.not. allocated(error)) call make_machine(self, records, error)
      if (allocated(error)) return
      call self%watch%ask(records, self%machine, self%motion, error)
      if (allocated(error) .or. .not. self%starts%wanted) return
      call self%starts%apply(self%machine, self%plan%grid_point(point), self%plan%start_of(point))
      call check_start(self%machine, self%input, error)
      if (.not. allocated(error)) call self%starts%strobe_period(self%machine, self%motion%t_end, self%input, &
                                                                 self%watch%states%interval, error)
   end subroutine machine_at

   !> The machine of the input as it is now, tuned if it says so.
   subroutine make_machine(self, records, error)
      class(sweep_task_t), intent(inout) :: self
      type(record_t), allocatable, intent(inout) :: records(:)
      type(error_t), allocatable, intent(out) :: error

      type(input_t) :: tuned
      type(machine_t), allocatable :: machine
      character(:), allocatable :: unit
      real(wp), allocatable :: value

      allocate (machine)
      if (tunes(self%input)) then
         tuned = self%input
         call apply_tune(tuned, value, unit, error)
         ! Every row has the same columns, also that of a point that cannot be tuned.
         if (allocated(self%tuned)) self%tuned = ieee_value(self%tuned, ieee_quiet_nan)
         if (allocated(value)) then
            self%tuned = value
            self%tuned_unit = unit
         end if
         if (.not. allocated(error)) call new_machine(machine, self%motion, records, tuned, error, self%scene)
      else
         call new_machine(machine, self%motion, records, self%input, error, self%scene)
      end if
      ! The row of a point without a machine has the columns of the one before.
      if (.not. allocated(error)) call move_alloc(machine, self%machine)
   end subroutine make_machine

   !> The columns of a row, with what they are for a point that is not computed yet.
   subroutine describe(self, row)
      class(sweep_task_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      type(continuation_state_t) :: continuation

      call self%watch%forget(self%machine)
      call continuation%take_from()
      call fill(self, row, outcome_t(status=status_not_computed), 0.0_wp, 0.0_wp, continuation)
   end subroutine describe

   !> `took` and `worked`: time on the clock and of the processor, s.
   subroutine fill(self, row, outcome, took, worked, continuation)
      class(sweep_task_t), intent(in) :: self
      type(table_t), intent(inout) :: row
      type(outcome_t), intent(in) :: outcome
      real(wp), intent(in) :: took, worked
      type(continuation_state_t), intent(in) :: continuation

      call outcome%columns(row, "/point/", brief=.true.)
      call self%watch%columns(row, self%machine)
      if (allocated(self%tuned)) call row%add("/point/tuned", self%tuned, self%tuned_unit, "tuned value")
      if (self%asks_time) call row%add("/point/processor_time", worked, "s", "processor time")
      call row%add("seconds", took, "s", "time that the point took")
      if (self%plan%has_chains()) call continuation%columns(row)
   end subroutine fill

   !> Compute one motion; in a chain its row has what is carried on, too.
   subroutine run_point(self, point, row, before)
      class(sweep_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(table_t), intent(in), optional :: before

      type(error_t), allocatable :: error
      type(outcome_t) :: outcome
      type(continuation_state_t) :: continuation
      real(wp) :: begun, work_begun, work_ended

      begun = seconds()
      call cpu_time(work_begun)
      call self%watch%forget()
      call continuation%take_from(before)
      call self%machine_at(point, error)
      if (self%plan%has_chains() .and. .not. allocated(error)) call continuation%begin(self%machine)
      if (.not. allocated(error)) call self%watch%run(self%machine, self%motion, outcome, error, self%integrator)
      if (allocated(error)) outcome%status = status_no_machine
      self%broken_off = outcome%status == status_interrupted
      if (self%plan%has_chains() .and. outcome%status == status_ok) then
         call continuation%finish(self%machine, self%watch%followed, self%integrator)
      else
         call continuation%take_from()
      end if
      call cpu_time(work_ended)
      call fill(self, row, outcome, seconds() - begun, work_ended - work_begun, continuation)
   end subroutine run_point

end module razy_study_sweep_task
