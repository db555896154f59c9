!! Dynamic distribution of the points of a sweep over the ranks of a communicator.
!!
!! Rank 0 manages and, with not too many ranks, computes too (razy_sweep_manager); the others compute (razy_sweep_worker). A row
!! carries the number of its point and is collected in whatever order it comes, so what is collected does not depend on the
!! number of ranks, bit for bit, as long as a point depends on its number and its chain alone. With one rank there are no messages.
!!
!! A point that fails is data and never ends a sweep. An error of `collect` or `settle` ends it on all ranks with that error. When
!! any rank is interrupted, each finishes the row it is at, all of them reach rank 0, and the sweep ends as `stopped`.
!!
!! What is handed out are units: points that are missing, or the rest of chains (razy_sweep_units).
module razy_sweep_scheduler
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_sweep_clock, only: seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_manager, only: manage, report_progress
   use razy_sweep_protocol, only: ask_interrupt, sweep_options_t, tally_t
   use razy_sweep_task, only: collector_t, point_task
   use razy_sweep_units, only: units_t
   use razy_sweep_worker, only: work
   implicit none(type, external)
   private

   public :: run_sweep, sweep_outcome_t

   !> How a sweep went: rank 0 knows all of it, the others `stopped` and their own time.
   type :: sweep_outcome_t
      !> Time from start to end [s].
      real(wp) :: elapsed = 0.0_wp
      !> The sweep was interrupted before its end.
      logical :: stopped = .false.
      !> What each rank did (0:ranks - 1).
      type(tally_t), allocatable :: tally(:)
   contains
      procedure :: efficiency
   end type sweep_outcome_t

contains

   !> Compute what the units have missing. Collective: units and `options` are the same on all ranks, which return together.
   !>
   !> `progress` is called on rank 0, between points, and once at the end; `interrupted` on every rank between rows.
   !> Errors, the same on all ranks: that of `collect` or `settle`.
   subroutine run_sweep(communicator, task, units, collector, options, progress, outcome, error, interrupted)
      type(communicator_t), intent(in) :: communicator
      class(point_task), intent(inout) :: task
      type(units_t), intent(inout) :: units
      class(collector_t), intent(inout) :: collector
      type(sweep_options_t), intent(in) :: options
      procedure(report_progress), optional :: progress
      type(sweep_outcome_t), intent(out) :: outcome
      type(error_t), allocatable, intent(out) :: error
      procedure(ask_interrupt), optional :: interrupted
      real(wp) :: start

      start = seconds()
      call units%begin(task)
      if (communicator%is_root()) then
         call manage(communicator, task, units, collector, options, progress, interrupted, outcome%tally, outcome%stopped, error)
      else
         call work(communicator, task, units, options, interrupted)
      end if
      call communicator%agree(error)
      call communicator%broadcast(outcome%stopped)
      outcome%elapsed = seconds() - start
   end subroutine run_sweep

   !> Share of the ranks' time that was spent in computing points.
   pure real(wp) function efficiency(self)
      class(sweep_outcome_t), intent(in) :: self

      efficiency = 1.0_wp
      if (self%elapsed > 0.0_wp) efficiency = sum(self%tally%busy)/(size(self%tally)*self%elapsed)
   end function efficiency

end module razy_sweep_scheduler
