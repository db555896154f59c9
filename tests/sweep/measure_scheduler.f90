!! What the distribution of points costs: points of no work and of known work, whose costs vary by a factor of 10.
!!
!! mpirun -n 2 measure_scheduler POINTS MICROSECONDS random|clustered [REPETITIONS]
!!
!! Work is a number of floating-point operations, calibrated on rank 0 before. "random" costs are log-uniform and independent;
!! "clustered" are 1 but for one tenth of the points, side by side in the middle, that cost 10. MICROSECONDS is the mean. Prints
!! for each repetition: ranks, points per second, share of the ranks' time spent in points, messages, points of rank 0.
module measured_task
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use razy_core_error, only: error_t, raise
   use razy_sweep_clock, only: seconds
   use razy_core_table, only: table_t
   use razy_sweep_packet, only: unpack_row
   use razy_sweep_task, only: collector_t, point_task
   implicit none(type, external)
   private

   public :: calibrate, counter_t, measured_task_t

   !> Points that take known numbers of operations.
   type, extends(point_task) :: measured_task_t
      integer(int64) :: n_points = 0
      !> Operations of a point of cost 1.
      real(real64) :: operations = 0
      logical :: clustered = .false.
   contains
      procedure :: describe
      procedure :: run
      procedure :: cost
   end type measured_task_t

   !> Counts rows.
   type, extends(collector_t) :: counter_t
      integer(int64) :: n_points = 0, collected = 0
      type(table_t) :: row
   contains
      procedure :: collect
      procedure :: settle
   end type counter_t

contains

   !> Cost of a point, 1 on the average.
   pure real(real64) function cost(self, point)
      class(measured_task_t), intent(in) :: self
      integer(int64), intent(in) :: point
      integer(int64) :: mixed

      if (self%clustered) then
         cost = merge(10.0_real64, 1.0_real64, abs(point - self%n_points/2) <= self%n_points/20)/1.9_real64
      else
         mixed = ieor(point*2654435761_int64, ishft(point*40503_int64, -7))
         mixed = modulo(mixed*69069_int64 + 12345_int64, 1000003_int64)
         cost = 10.0_real64**(mixed/1000003.0_real64)*log(10.0_real64)/9
      end if
   end function cost

   subroutine describe(self, row)
      class(measured_task_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      call row%add("point", self%n_points, "1", "point")
      call row%add("labour", 0.0_real64, "1", "outcome of the labour")
   end subroutine describe

   subroutine run(self, point, row, before)
      class(measured_task_t), intent(inout) :: self
      integer(int64), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(table_t), intent(in), optional :: before

      if (present(before)) error stop "there are no chains here"
      call row%add("point", point, "1", "point")
      call row%add("labour", labour(nint(self%operations*self%cost(point), int64)), "1", "outcome of the labour")
   end subroutine run

   subroutine collect(self, point, words, error)
      class(counter_t), intent(inout) :: self
      integer(int64), intent(in) :: point, words(:)
      type(error_t), allocatable, intent(out) :: error
      logical :: fits

      call unpack_row(words, self%row, fits)
      if (.not. fits .or. self%row%column(1)%integers(1) /= point) call raise(error, "a row belongs to another point")
      self%collected = self%collected + 1
   end subroutine collect

   !> There is nothing to write down.
   subroutine settle(self, error)
      class(counter_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (self%collected > self%n_points) call raise(error, "more rows than points")
   end subroutine settle

   !> A chain of operations that no compiler shortens.
   real(real64) function labour(operations)
      integer(int64), intent(in) :: operations
      integer(int64) :: i

      labour = 0.5_real64
      do i = 1, operations
         labour = 3.9_real64*labour*(1.0_real64 - labour)
      end do
   end function labour

   !> Operations a microsecond: the fastest of several trials.
   real(real64) function calibrate()
      integer(int64), parameter :: trial = 1000000
      real(real64) :: begun, unused
      integer :: i

      calibrate = 0
      unused = 0
      do i = 1, 20
         begun = seconds()
         unused = unused + labour(trial)
         calibrate = max(calibrate, trial/(1.0e6_real64*(seconds() - begun)))
      end do
      if (unused < 0) calibrate = 0
   end function calibrate

end module measured_task

program measure_scheduler
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use measured_task, only: calibrate, counter_t, measured_task_t
   use mpi_f08, only: mpi_comm_world, mpi_finalize, mpi_init
   use razy_core_error, only: error_t
   use razy_sweep_communicator, only: communicator_t, new_communicator
   use razy_sweep_plan, only: new_plan
   use razy_sweep_protocol, only: sweep_options_t
   use razy_sweep_scheduler, only: run_sweep, sweep_outcome_t
   use razy_sweep_units, only: units_t
   implicit none(type, external)

   type(communicator_t) :: communicator
   type(measured_task_t) :: task
   type(counter_t) :: counter
   type(units_t) :: units
   type(sweep_options_t) :: options
   type(sweep_outcome_t) :: outcome
   type(error_t), allocatable :: error
   real(real64) :: microseconds
   integer :: repetition, repetitions
   logical :: whole
   character(32) :: argument

   call mpi_init()
   call new_communicator(communicator, mpi_comm_world)
   call get_command_argument(1, argument)
   read (argument, *) task%n_points
   call get_command_argument(2, argument)
   read (argument, *) microseconds
   call get_command_argument(3, argument)
   task%clustered = argument == "clustered"
   repetitions = 1
   call get_command_argument(4, argument)
   if (argument /= "") read (argument, *) repetitions
   if (communicator%is_root()) task%operations = microseconds*calibrate()
   call communicator%broadcast(task%operations)
   counter%n_points = task%n_points
   call task%describe(counter%row)
   call new_plan(units%plan, task%n_points, 1_int64, [integer ::])
   call units%plan%close(whole)
   do repetition = 1, repetitions
      counter%collected = 0
      call communicator%broadcast(task%operations)
      call run_sweep(communicator, task, units, counter, options, outcome=outcome, error=error)
      if (allocated(error)) error stop error%message
      if (communicator%is_root()) print '(i0, " ranks, ", es9.3, " points/s, ", f6.2, " % busy, ", i0, " messages, ", i0, a)', &
         & communicator%size, task%n_points/outcome%elapsed, 100*outcome%efficiency(), &
         & sum(outcome%tally%messages), outcome%tally(0)%points, &
         & " points of rank 0"
   end do
   call communicator%free()
   call mpi_finalize()

end program measure_scheduler
