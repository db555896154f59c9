!! razy-follow: periodic motions over a parameter, stable or not, and where they change their kind; all of them under mpirun too.
program razy_follow
   use, intrinsic :: iso_fortran_env, only: output_unit
   use command_line, only: command_t, exit_failure, exit_interrupted, exit_ok, exit_usage, of_ranks, say
   use measuring, only: begin_measuring, longest_measuring, measured_enough
   use program_frame, only: check_files, read_case
   use progress, only: show_progress, show_work
   use rank_frame, only: begin_ranks, end_killed_end, end_ranks, leave_if
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_scenes_case, only: read_study
   use razy_study_follow_cells, only: cells_t, new_cells
   use razy_study_follow_result, only: follow_words, write_follow
   use razy_study_follow_rounds, only: follow_all, forecast_rounds, plan_rounds
   use razy_study_follow_summary, only: summary_of
   use razy_sweep_checkpoint, only: checkpoint_path, checkpoint_t
   use razy_sweep_clock, only: seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_units, only: units_t
   use signals, only: time_is_up
   implicit none(type, external)

   type(communicator_t) :: ranks
   type(command_t) :: command
   type(error_t), allocatable :: error
   type(cells_t) :: cells
   type(checkpoint_t) :: checkpoint
   ! Kept to the end: LeakSanitizer takes what an optimised program lets go of as lost.
   character(:), allocatable, save :: effective
   !> What is wrong before anything is computed is the input.
   logical :: computes = .false., go_on, stopped = .false.
   !> Given a value it is static, so that the procedure that a pointer leads to needs no executable stack.
   real(wp) :: began = 0.0_wp

   call begin_ranks(ranks)
   if (ranks%is_root()) call prepare(error)
   call ranks%broadcast(computes)
   call leave_if(ranks, error, merge(exit_failure, exit_usage, computes))
   call ranks%broadcast(go_on)
   call ranks%broadcast(stopped)
   if (go_on) call follow_and_write()
   call end_ranks(ranks, merge(exit_interrupted, exit_ok, stopped))

contains

   !> Rank 0 reads and checks everything, and follows one motion alone.
   subroutine prepare(error)
      type(error_t), allocatable, intent(out) :: error

      type(input_t) :: input
      type(string_t), allocatable :: lines(:), written(:)
      integer :: i
      logical :: answered

      go_on = .false.
      call read_case("razy-follow", &
                     "follow periodic motions over a parameter, stable or not, through their bifurcations; also under mpirun", &
                     of_ranks, command, input, answered, error)
      if (answered) return
      if (.not. allocated(error)) call new_cells(cells, input, error)
      if (allocated(error)) return
      cells%follow%problem%map%stop_is_asked => time_is_up
      effective = input%effective()
      if (command%check) then
         write (output_unit, "(a)", advance="no") effective
      else if (command%dry_run) then
         computes = .true.
         call say("measuring for "//to_text(longest_measuring)//" s at most")
         call begin_measuring()
         cells%follow%problem%map%stop_is_asked => measured_enough
         call forecast_rounds(cells, ranks%size, lines, error)
         call break_off(error)
         if (.not. (stopped .or. allocated(error))) write (output_unit, "(a)") (lines(i)%text, i=1, size(lines))
      else
         allocate (written(0))
         call append_text(written, checkpoint_path(command%output))
         call end_killed_end(command, effective)
         call check_files(command, input, written, error)
         if (.not. allocated(error) .and. .not. cells%follow%all_motions) then
            computes = .true.
            began = seconds()
            cells%follow%problem%report => show_following
            call cells%follow%compute(error)
            call break_off(error)
         end if
         go_on = .not. allocated(error) .and. (cells%follow%count > 0 .or. .not. stopped)
      end if
   end subroutine prepare

   !> Of what was computed until a signal came the branches count; its error is none.
   subroutine break_off(error)
      type(error_t), allocatable, intent(inout) :: error

      stopped = time_is_up()
      if (.not. stopped) return
      if (allocated(error)) deallocate (error)
      if (command%dry_run .or. cells%follow%count == 0) then
         call say("stopped: nothing was written")
      else
         call say("stopped: what was followed is written, and start_file goes on from there")
      end if
   end subroutine break_off

   !> One motion is followed already, on rank 0.
   subroutine follow_and_write()
      type(input_t) :: input
      type(string_t) :: none(0)
      logical :: all_motions

      all_motions = cells%follow%all_motions
      call ranks%broadcast(all_motions)
      if (.not. all_motions) then
         if (ranks%is_root()) call end_follow(error)
         call leave_if(ranks, error, exit_failure)
         return
      end if
      call ranks%broadcast(effective)
      if (.not. ranks%is_root()) then
         call read_study(input, effective, "effective input", none, error)
         if (.not. allocated(error)) call new_cells(cells, input, error)
         cells%follow%problem%map%stop_is_asked => time_is_up
      else
         began = seconds()
         cells%follow%problem%report => show_following
         call open_checkpoint(error)
      end if
      call leave_if(ranks, error, exit_usage)
      call follow_all(ranks, cells, checkpoint, show_long_rounds, time_is_up, stopped, error)
      if (ranks%is_root()) call end_together(error)
      call leave_if(ranks, error, exit_failure)
   end subroutine follow_and_write

   !> How far one motion is followed, where that takes its time.
   subroutine show_following(what, count, value)
      character(*), intent(in) :: what
      integer, intent(in) :: count
      real(wp), intent(in) :: value

      character(:), allocatable :: line

      associate (follow => cells%follow)
         select case (what)
         case ("branch")
            line = "branch "//to_text(follow%count)//": point "//to_text(count)
         case ("curve")
            line = "curve "//to_text(follow%curves)//": point "//to_text(count)
         case ("sensitivities")
            line = "sensitivities: special point "//to_text(count)
         case default
            line = what//": period "//to_text(count)
         end select
         call show_work(line//", "//follow%varied(1)%parameter//" "//decimal(value, 6), seconds() - began)
      end associate
   end subroutine show_following

   !> Progress of the first round, and of others that take their time.
   subroutine show_long_rounds(done, total, elapsed)
      integer(i8), intent(in) :: done, total
      real(wp), intent(in) :: elapsed

      if (total == cells%cells .or. elapsed > 1.0_wp) call show_progress(done, total, elapsed)
   end subroutine show_long_rounds

   subroutine open_checkpoint(error)
      type(error_t), allocatable, intent(out) :: error

      type(table_t) :: row
      type(units_t) :: units

      checkpoint%interval = command%checkpoint
      checkpoint%most_rows = command%checkpoint_points
      call cells%describe(row)
      call plan_rounds(units%plan, cells)
      if (command%anew) call checkpoint%discard_old(command%output, error)
      if (.not. allocated(error)) call checkpoint%open(command%output, effective, row, units, error)
      if (allocated(error) .or. checkpoint%n_done == 0) return
      call say("going on: "//to_text(checkpoint%n_done)//" cells are in "//checkpoint_path(command%output))
   end subroutine open_checkpoint

   subroutine end_together(error)
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call checkpoint%secure(error)
      if (.not. allocated(error) .and. stopped) then
         call say("stopped: "//to_text(checkpoint%n_done)//" cells are safe in "//checkpoint_path(command%output)// &
                  "; the same command goes on from there")
         return
      end if
      if (.not. allocated(error) .and. nothing_begins()) then
         call checkpoint%remove(error)
         if (.not. allocated(error)) call raise(error, cells%follow%sample(1)%reason)
         return
      end if
      if (.not. allocated(error)) call end_follow(error)
      if (allocated(error)) then
         call checkpoint%give_up(error)
      else
         call checkpoint%remove(error)
      end if
   end subroutine end_together

   !> In no cell anything was looked for, as where the machine cannot begin as the input says.
   logical function nothing_begins()
      integer :: i

      nothing_begins = cells%follow%count == 0
      if (nothing_begins) nothing_begins = all([(cells%follow%sample(i)%reason /= "", i=1, cells%cells)])
   end function nothing_begins

   !> Say what was found, and write it.
   subroutine end_follow(error)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: lines(:)
      integer :: i

      lines = follow_words(cells%follow)
      do i = 1, size(lines)
         call say(lines(i)%text)
      end do
      call write_follow(cells%follow, effective, command%output, command%force, error)
      if (allocated(error)) return
      call say("wrote "//command%output)
      if (.not. cells%follow%all_motions) return
      lines = summary_of(cells%follow)
      write (output_unit, "(a)") (lines(i)%text, i=1, size(lines))
   end subroutine end_follow

end program razy_follow
