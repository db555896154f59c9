!! All motions over the range, by all ranks: cells in rounds (razy_study_follow_cells), until no branch comes to a border that
!! it has not come to before. Which cells a round has depends on the rows of those before, not on ranks, so that a run that
!! was interrupted goes on with the rows in its checkpoint.
module razy_study_follow_rounds
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_study_follow_atlas, only: atlas_t
   use razy_study_follow_cells, only: arrival_t, cells_t, pack_arrivals, unpack_arrivals
   use razy_sweep_clock, only: seconds
   use razy_sweep_checkpoint, only: checkpoint_t
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_manager, only: report_progress
   use razy_sweep_plan, only: new_plan, plan_t
   use razy_sweep_protocol, only: ask_interrupt, sweep_options_t
   use razy_sweep_scheduler, only: run_sweep, sweep_outcome_t
   use razy_sweep_units, only: units_t
   implicit none(type, external)
   private

   public :: follow_all, forecast_rounds, plan_rounds

   !> Rounds for each cell at most: a branch that turns often comes through a cell more than once.
   integer, parameter :: rounds_each = 4

contains

   !> The plan of all rounds, of which nothing is done.
   subroutine plan_rounds(plan, cells)
      type(plan_t), intent(out) :: plan
      type(cells_t), intent(in) :: cells

      call new_plan(plan, int(cells%cells, i8), int(rounds_each*cells%cells, i8), [integer ::])
   end subroutine plan_rounds

   !> Compute what is not in the checkpoint, open on rank 0, and put the branches together there. Collective.
   subroutine follow_all(communicator, cells, checkpoint, progress, interrupted, stopped, error)
      type(communicator_t), intent(in) :: communicator
      type(cells_t), intent(inout) :: cells
      type(checkpoint_t), intent(inout) :: checkpoint
      procedure(report_progress) :: progress
      procedure(ask_interrupt) :: interrupted
      logical, intent(out) :: stopped
      type(error_t), allocatable, intent(out) :: error

      type(atlas_t) :: atlas
      type(sweep_outcome_t) :: outcome
      type(sweep_options_t) :: options
      type(units_t) :: units
      real(wp), allocatable :: numbers(:)
      integer :: round

      options%ask_ahead = .false.
      options%largest_chunk = 1
      do round = 1, rounds_each*cells%cells
         call plan_round(units%plan, cells, checkpoint, round, communicator%is_root())
         call units%share(communicator)
         call run_sweep(communicator, cells, units, checkpoint, options, progress, outcome, error, interrupted)
         stopped = outcome%stopped
         if (allocated(error) .or. stopped) return
         if (communicator%is_root()) call end_round(atlas, cells, checkpoint, round, error)
         call communicator%agree(error)
         ! What end_round computes is broken off, too.
         stopped = interrupted()
         call communicator%broadcast(stopped)
         if (allocated(error) .or. stopped) return
         numbers = pack_arrivals(cells%arrival)
         call communicator%broadcast(numbers)
         cells%arrival = unpack_arrivals(numbers, cells%follow%problem%map%n)
         if (size(cells%arrival) == 0) exit
      end do
      if (communicator%is_root()) call atlas%finish(cells)
   end subroutine follow_all

   !> Compute a part, unless that is to stop, and say in lines what follows from it for all on so many ranks.
   subroutine forecast_rounds(cells, ranks, lines, error)
      type(cells_t), intent(inout) :: cells
      integer, intent(in) :: ranks
      type(string_t), allocatable, intent(out) :: lines(:)
      type(error_t), allocatable, intent(out) :: error

      !> Points of a branch that are timed.
      integer, parameter :: few = 20
      type(table_t) :: row
      real(wp) :: took
      integer :: middle

      lines = cells%follow%plan()
      took = seconds()
      if (cells%follow%all_motions) then
         middle = (cells%cells + 1)/2
         call cells%describe(row)
         call row%rewind()
         call cells%run(int(middle, i8), row)
         took = seconds() - took
         call append_text(lines, counted(to_text(cells%cells), "cell")//", in each "// &
                          counted(to_text(cells%follow%search%starts + 1), "start"))
         if (cells%broken_off) then
            call append_text(lines, "timed: nothing, cell "//to_text(middle)//" takes more than "//to_text(nint(took))// &
                             " s: the time of all is not known")
            return
         end if
         call append_text(lines, "timed: cell "//to_text(middle)//", "//decimal(took, 3)//" s, "// &
                          "pieces of branches in it: "//to_text(cells%follow%count))
         call append_text(lines, "time: "//decimal(took*cells%cells, 1)//" s of one core; on "// &
                          counted(to_text(ranks), "rank")//" "//decimal(took*ceiling(real(cells%cells, wp)/ranks), 1)// &
                          " s, if the others are like it; branches that go on through many cells add to that")
      else
         call cells%follow%compute(error, few)
         took = seconds() - took
         if (cells%follow%problem%map%stop_is_asked()) then
            if (allocated(error)) deallocate (error)
            call append_text(lines, "timed: nothing, the first motion and branches of "//to_text(few)//" points take more than "// &
                             to_text(nint(took))//" s")
         else if (allocated(error)) then
            return
         else
            call append_text(lines, "timed: the first motion and branches of "//to_text(few)//" points at most, so many: "// &
                             to_text(cells%follow%count)//", "//decimal(took, 3)//" s")
         end if
         call append_text(lines, "one motion has no tasks for several ranks; motions='all' has")
      end if
   end subroutine forecast_rounds

   !> The cells of a round that are not in the checkpoint; other ranks are told.
   subroutine plan_round(plan, cells, checkpoint, round, is_root)
      type(plan_t), intent(out) :: plan
      type(cells_t), intent(in) :: cells
      type(checkpoint_t), intent(in) :: checkpoint
      integer, intent(in) :: round
      logical, intent(in) :: is_root

      integer(i8) :: point
      logical :: ignored, wanted

      call plan_rounds(plan, cells)
      if (.not. is_root) return
      do point = 1, plan%points
         wanted = is_wanted(cells, round, point)
         if (wanted) wanted = .not. checkpoint%has(point)
         if (.not. wanted) call plan%mark_done(point, ignored)
      end do
      call plan%close(ignored)
   end subroutine plan_round

   !> Whether a point is a cell of this round: any in the first, later one with arrivals.
   pure logical function is_wanted(cells, round, point)
      type(cells_t), intent(in) :: cells
      integer, intent(in) :: round
      integer(i8), intent(in) :: point

      is_wanted = (point - 1)/cells%cells == round - 1
      if (is_wanted .and. round > 1) is_wanted = any(cells%arrival%cell == 1 + modulo(point - 1, int(cells%cells, i8)))
   end function is_wanted

   !> Take the rows of a round, and find out what goes on.
   subroutine end_round(atlas, cells, checkpoint, round, error)
      type(atlas_t), intent(inout) :: atlas
      type(cells_t), intent(inout) :: cells
      type(checkpoint_t), intent(inout) :: checkpoint
      integer, intent(in) :: round
      type(error_t), allocatable, intent(out) :: error

      type(arrival_t), allocatable :: arrival(:)
      type(table_t) :: row
      integer(i8) :: point
      integer :: cell

      row = checkpoint%row
      do cell = 1, cells%cells
         point = (round - 1)*int(cells%cells, i8) + cell
         if (.not. is_wanted(cells, round, point)) cycle
         call checkpoint%get(point, row, error)
         if (allocated(error)) return
         call atlas%take(cells, cell, row)
      end do
      call atlas%arrivals(cells, arrival)
      call move_alloc(arrival, cells%arrival)
   end subroutine end_round

end module razy_study_follow_rounds
