!! Results of a sweep on disk while it is being computed: they leave memory at once, survive a kill, and are read back in any order.
!!
!! The journal (razy_io_journal) lies beside the result file under its name and `.checkpoint`, locked by the run that is at work.
!! Its identity is version and commit of the program, and the effective input: a sweep is taken up again only by the same program
!! with the same input. A record is a packet (razy_sweep_packet) of one result, with the point's number in the sweep.
module razy_sweep_checkpoint
   use razy_input_difference, only: first_difference
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: newline
   use razy_core_version, only: razy_git_commit, razy_version
   use razy_io_journal, only: journal_t
   use razy_io_posix, only: path_exists
   use razy_sweep_clock, only: seconds
   use razy_sweep_packet, only: packet_t
   use razy_sweep_plan, only: plan_t
   use razy_sweep_task, only: point_result_t
   implicit none(type, external)
   private

   public :: checkpoint_t, checkpoint_path

   !> Lives on rank 0 only.
   type :: checkpoint_t
      !> Results are on the disk itself after this time [s] at the latest.
      real(wp) :: interval = 60.0_wp
      !> Results after which they are on the disk itself before that; 0: however many.
      integer(i8) :: most_results = 0
      type(journal_t) :: journal
      !> Where the result of each point begins (points); -1: nowhere yet.
      integer(i8), allocatable :: place(:)
      !> Integers of a result.
      integer(i8) :: n_integers = 0
      !> When results were last on the disk, and how many have come since.
      real(wp), private :: secured = 0.0_wp
      integer(i8), private :: fresh = 0
      type(packet_t), private :: packet
   contains
      procedure :: open => open_checkpoint
      procedure :: discard_old
      procedure :: put
      procedure :: get
      procedure :: settle
      procedure :: close => close_checkpoint
      procedure :: remove
      procedure, private :: check_identity
      procedure, private :: recall
   end type checkpoint_t

contains

   !> The checkpoint of a result file.
   pure function checkpoint_path(output) result(path)
      character(*), intent(in) :: output
      character(:), allocatable :: path

      path = output//".checkpoint"
   end function checkpoint_path

   !> Open the checkpoint of a result file, a new one or that of a run that was interrupted, whose points are marked in `plan`.
   !>
   !> Errors: another run is at work on it; it is of another input or program, or damaged.
   subroutine open_checkpoint(self, output, input, n_integers, plan, error)
      class(checkpoint_t), intent(inout) :: self
      character(*), intent(in) :: output, input
      integer(i8), intent(in) :: n_integers
      type(plan_t), intent(inout) :: plan
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: identity, found
      integer(i8) :: start

      call self%journal%open(checkpoint_path(output), error)
      if (allocated(error)) return
      self%n_integers = n_integers
      self%secured = seconds()
      allocate (self%place(plan%points), source=-1_i8)
      identity = "razy-sweep "//razy_version//" "//razy_git_commit//newline//input
      if (self%journal%is_new()) then
         call self%journal%begin(identity, error)
      else
         call self%journal%take_up(found, start, error)
         if (.not. allocated(error)) call self%check_identity(identity, found, error)
         if (.not. allocated(error)) call self%recall(start, plan, error)
      end if
      if (allocated(error)) call self%journal%file%close()
   end subroutine open_checkpoint

   !> Delete the checkpoint of a result file, if there is one that no run is at work on.
   subroutine discard_old(self, output, error)
      class(checkpoint_t), intent(inout) :: self
      character(*), intent(in) :: output
      type(error_t), allocatable, intent(out) :: error

      if (.not. path_exists(checkpoint_path(output))) return
      call self%journal%open(checkpoint_path(output), error)
      if (.not. allocated(error)) call self%remove(error)
   end subroutine discard_old

   !> Refuse a checkpoint of another program or input, with what differs.
   subroutine check_identity(self, here, there, error)
      class(checkpoint_t), intent(in) :: self
      character(*), intent(in) :: here, there
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: difference
      integer :: line, other

      line = index(here, newline)
      other = index(there, newline)
      if (other == 0) other = len(there) + 1
      if (here(:line - 1) /= there(:other - 1)) then
         call raise(error, self%journal%file%path//": was begun by "//there(:other - 1)//", this is "//here(:line - 1)// &
                    "; finish it with that, or begin anew with --anew")
         return
      end if
      difference = first_difference(here(line + 1:), there(other + 1:))
      if (len(difference) == 0) return
      call raise(error, self%journal%file%path//": was begun with another input: here "//difference// &
                 "; give that input again, name another output, or begin anew with --anew")
   end subroutine check_identity

   !> Find the records of a run that was interrupted.
   subroutine recall(self, start, plan, error)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: start
      type(plan_t), intent(inout) :: plan
      type(error_t), allocatable, intent(out) :: error

      integer(i8), allocatable :: words(:)
      integer(i8) :: at, n, place
      logical :: found, ours

      place = start
      do
         call self%journal%next(place, at, words, n, found, error)
         if (allocated(error)) return
         if (.not. found) exit
         ours = n >= 4
         if (ours) ours = words(3) == self%n_integers .and. n == 4 + words(3) + words(4)
         if (ours) call plan%mark_done(words(1), ours)
         if (.not. ours) then
            call raise(error, self%journal%file%path//": does not belong to this sweep; delete it to begin anew")
            return
         end if
         self%place(words(1)) = at
      end do
      call self%journal%end_of_records(place, error)
   end subroutine recall

   !> Keep the result of a point; it is safe after the next `settle`.
   subroutine put(self, point, result)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(in) :: result

      call self%packet%clear()
      call self%packet%put(point, result)
      call self%journal%put(self%packet%words(:self%packet%length), self%place(point))
      self%fresh = self%fresh + 1
   end subroutine put

   !> The result of a point that was kept.
   subroutine get(self, point, result, error)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: n, same

      call self%packet%clear()
      call self%journal%get(self%place(point), self%packet%words, n, error)
      if (allocated(error)) return
      self%packet%length = n
      call self%packet%get(same, result)
      if (same /= point) call raise(error, self%journal%file%path//": a record is that of another point")
   end subroutine get

   !> Hand what was put to the operating system, and from time to time, after many results, or `now`, to the disk.
   subroutine settle(self, error, now)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: now

      logical :: due

      due = .false.
      if (present(now)) due = now
      if (.not. due .and. self%most_results > 0) due = self%fresh >= self%most_results
      if (.not. due) due = seconds() - self%secured >= self%interval
      if (due) then
         call self%journal%secure(error)
         self%secured = seconds()
         self%fresh = 0
      else
         call self%journal%settle(error)
      end if
   end subroutine settle

   !> Leave the checkpoint to a later run.
   subroutine close_checkpoint(self)
      class(checkpoint_t), intent(inout) :: self

      call self%journal%file%close()
   end subroutine close_checkpoint

   !> Delete the checkpoint: the sweep is complete.
   subroutine remove(self, error)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%journal%file%remove(error)
   end subroutine remove

end module razy_sweep_checkpoint
