!! What programs that run on several ranks do when they begin and end.
module rank_frame
   use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use command_line, only: command_t, finish, say
   use mpi_f08, only: mpi_comm_world, mpi_finalize, mpi_init_thread, mpi_thread_single
   use razy_core_error, only: error_t
   use razy_io_posix, only: path_exists
   use razy_io_result_file, only: has_header, new_header
   use razy_linalg_threads, only: use_one_thread
   use razy_sweep_checkpoint, only: checkpoint_path
   use razy_sweep_communicator, only: communicator_t, new_communicator
   use signals, only: hold_signals, let_writes_fail
   implicit none(type, external)
   private

   public :: begin_ranks, end_killed_end, end_ranks, leave_if

contains

   !> Begin on all ranks.
   subroutine begin_ranks(ranks)
      type(communicator_t), intent(out) :: ranks

      logical :: halts(size(ieee_usual))
      integer :: provided

      call use_one_thread()
      call hold_signals()
      call let_writes_fail()
      ! Libraries of MPI may raise what a debug build stops at.
      call ieee_get_halting_mode(ieee_usual, halts)
      call ieee_set_halting_mode(ieee_usual, .false.)
      call mpi_init_thread(mpi_thread_single, provided)
      call ieee_set_flag(ieee_usual, .false.)
      call ieee_set_halting_mode(ieee_usual, halts)
      call new_communicator(ranks, mpi_comm_world)
   end subroutine begin_ranks

   !> A file of the same input beside its checkpoint: a run was killed before it could delete the latter. The same command, which
   !> goes on from a checkpoint, ends that run, though the file is there.
   subroutine end_killed_end(command, effective)
      type(command_t), intent(inout) :: command
      character(*), intent(in) :: effective

      if (command%force .or. command%anew .or. command%so_far) return
      if (.not. path_exists(checkpoint_path(command%output))) return
      command%force = has_header(command%output, new_header(command%program, "", "", "", effective))
   end subroutine end_killed_end

   !> Leave together with one message if any rank has an error.
   subroutine leave_if(ranks, error, code)
      type(communicator_t), intent(inout) :: ranks
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: code

      call ranks%agree(error)
      if (.not. allocated(error)) return
      if (ranks%is_root()) call say(error%message)
      call end_ranks(ranks, code)
   end subroutine leave_if

   !> Leave together.
   subroutine end_ranks(ranks, code)
      type(communicator_t), intent(inout) :: ranks
      integer, intent(in) :: code

      call ranks%free()
      call mpi_finalize()
      call finish(code)
   end subroutine end_ranks

end module rank_frame
