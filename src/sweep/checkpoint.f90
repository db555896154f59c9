!! Rows of a sweep on disk while it is being computed: they leave memory at once, survive a kill, and are read back in any order.
!!
!! The journal (razy_io_journal) lies beside the result file under its name and `.checkpoint`, locked by the run that is at work.
!! Its identity is version and commit of the program, and the effective input: a sweep is taken up again only by the same program
!! with the same input. A record is the number of a point and its row (razy_sweep_packet).
module razy_sweep_checkpoint
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_core_text, only: newline
   use razy_core_version, only: razy_git_commit, razy_version
   use razy_input_difference, only: first_difference
   use razy_io_hdf5_file, only: delete_partial_files
   use razy_io_journal, only: journal_t
   use razy_io_posix, only: path_exists
   use razy_sweep_clock, only: seconds
   use razy_sweep_packet, only: count_row, unpack_row
   use razy_sweep_task, only: collector_t
   use razy_sweep_units, only: units_t
   implicit none(type, external)
   private

   public :: checkpoint_t, checkpoint_path

   !> Lives on rank 0 only.
   type, extends(collector_t) :: checkpoint_t
      !> Rows are on the disk itself after this time [s] at the latest.
      real(wp) :: interval = 60.0_wp
      !> Rows after which they are on the disk itself before that; 0: however many.
      integer(i8) :: most_rows = 0
      !> Points that are here, and for each column of a row the length of its lists in all, or the rows in which it is not 0.
      integer(i8) :: n_done = 0
      integer(i8), allocatable :: tally(:)
      !> The columns of a row, as they are for a point that is not here.
      type(table_t) :: row
      type(journal_t), private :: journal
      !> Where the record of each point begins (points); -1: nowhere yet.
      integer(i8), allocatable, private :: place(:)
      !> When rows were last on the disk, and how many have come since.
      real(wp), private :: secured = 0.0_wp
      integer(i8), private :: fresh = 0
      integer(i8), allocatable, private :: words(:)
   contains
      procedure :: open => open_checkpoint
      procedure :: discard_old
      procedure :: has
      procedure :: dropped
      procedure :: tally_of
      procedure :: collect
      procedure :: settle => settle_rows
      procedure :: secure
      procedure :: get
      procedure :: give_up
      procedure :: remove
      procedure, private :: check_identity, recall, recall_chains, refuse
   end type checkpoint_t

contains

   !> The checkpoint of a result file.
   pure function checkpoint_path(output) result(path)
      character(*), intent(in) :: output
      character(:), allocatable :: path

      path = output//".checkpoint"
   end function checkpoint_path

   !> Open the checkpoint of a result file, a new one or that of a run that was interrupted, and find out what of `units` is
   !> to be done; `row` has the columns.
   !>
   !> Errors: another run is at work on it; it is of another input or program, or damaged.
   subroutine open_checkpoint(self, output, input, row, units, error)
      class(checkpoint_t), intent(inout) :: self
      character(*), intent(in) :: output, input
      type(table_t), intent(in) :: row
      type(units_t), intent(inout) :: units
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: identity, found
      integer(i8) :: start

      call self%journal%open(checkpoint_path(output), error)
      if (allocated(error)) return
      self%row = row
      self%secured = seconds()
      allocate (self%place(units%plan%points), source=-1_i8)
      allocate (self%tally(row%count), source=0_i8)
      identity = "razy-sweep "//razy_version//" "//razy_git_commit//newline//input
      if (self%journal%file%is_empty()) then
         call self%journal%begin(identity, error)
      else
         call self%journal%take_up(found, start, error)
         if (.not. allocated(error)) call self%check_identity(identity, found, error)
         if (.not. allocated(error)) call self%recall(start, units, error)
      end if
      if (.not. allocated(error)) call self%recall_chains(units, error)
      if (allocated(error)) call self%journal%file%close()
      ! Nobody else is at work on this file, and what was killed while it wrote is done again.
      if (self%n_done > 0 .and. .not. allocated(error)) call delete_partial_files(output)
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
   subroutine recall(self, start, units, error)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: start
      type(units_t), intent(inout) :: units
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: at, n, place
      logical :: found, ours

      place = start
      do
         call self%journal%next(place, at, self%words, n, found)
         if (.not. found) exit
         ours = n >= 1
         if (ours) call units%plan%mark_done(self%words(1), ours)
         if (ours) call count_row(self%words(2:n), self%row, self%tally, ours)
         if (.not. ours) call self%refuse(error)
         if (.not. ours) return
         self%place(self%words(1)) = at
         self%n_done = self%n_done + 1
      end do
      call self%journal%end_of_records(place, error)
   end subroutine recall

   subroutine refuse(self, error)
      class(checkpoint_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      call raise(error, self%journal%file%path//": does not belong to this sweep; delete it to begin anew")
   end subroutine refuse

   !> Close the plan, and read the rows after which chains go on.
   subroutine recall_chains(self, units, error)
      class(checkpoint_t), intent(inout) :: self
      type(units_t), intent(inout) :: units
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: n, unit
      logical :: whole

      call units%plan%close(whole)
      if (.not. whole) call self%refuse(error)
      if (allocated(error) .or. .not. units%plan%has_chains()) return
      allocate (units%words_before(units%plan%units() + 1), source=0_i8)
      allocate (units%last_rows(0))
      do unit = 1, units%plan%units()
         if (units%plan%reached(unit) > 0) then
            associate (last => units%plan%point_of_link(units%plan%chain(unit), units%plan%reached(unit)))
               call self%journal%get(self%place(last), self%words, n, error)
            end associate
            if (allocated(error)) return
            units%last_rows = [units%last_rows, self%words(2:n)]
         end if
         units%words_before(unit + 1) = size(units%last_rows, kind=i8)
      end do
   end subroutine recall_chains

   !> The row of a point is here.
   pure logical function has(self, point)
      class(checkpoint_t), intent(in) :: self
      integer(i8), intent(in) :: point

      has = self%place(point) >= 0
   end function has

   !> The end of an interrupted write was dropped.
   pure logical function dropped(self)
      class(checkpoint_t), intent(in) :: self

      dropped = self%journal%dropped > 0
   end function dropped

   !> `tally` of the column with this name; 0 if there is none.
   pure integer(i8) function tally_of(self, name)
      class(checkpoint_t), intent(in) :: self
      character(*), intent(in) :: name

      integer :: i

      i = self%row%place_of(name)
      tally_of = 0
      if (i > 0) tally_of = self%tally(i)
   end function tally_of

   !> Keep the row of a point; it is safe after the next `settle`, or at once if `most_rows` are.
   subroutine collect(self, point, words, error)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: point, words(:)
      type(error_t), allocatable, intent(out) :: error

      logical :: fresh

      fresh = point >= 1 .and. point <= size(self%place, kind=i8)
      if (fresh) fresh = .not. self%has(point)
      if (fresh) call count_row(words, self%row, self%tally, fresh)
      if (.not. fresh) call raise(error, "a point has sent a row of another sweep, or twice")
      if (allocated(error)) return
      call self%journal%put([point, words], self%place(point))
      self%n_done = self%n_done + 1
      self%fresh = self%fresh + 1
      if (self%most_rows > 0 .and. self%fresh >= self%most_rows) call self%secure(error)
   end subroutine collect

   !> Fill a row with that of a point which is here.
   subroutine get(self, point, row, error)
      class(checkpoint_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(error_t), allocatable, intent(out) :: error

      integer(i8) :: n
      logical :: fits

      call self%journal%get(self%place(point), self%words, n, error)
      if (allocated(error)) return
      call unpack_row(self%words(2:n), row, fits)
      if (.not. fits .or. self%words(1) /= point) call raise(error, self%journal%file%path//": a record is that of another point")
   end subroutine get

   !> Hand what was collected to the operating system, and from time to time to the disk.
   subroutine settle_rows(self, error)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (seconds() - self%secured >= self%interval) then
         call self%secure(error)
      else
         call self%journal%settle(error)
      end if
   end subroutine settle_rows

   !> Have all rows on the disk itself.
   subroutine secure(self, error)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%journal%secure(error)
      self%secured = seconds()
      self%fresh = 0
   end subroutine secure

   !> Leave the checkpoint to a later run after an error, which is told with what is safe.
   subroutine give_up(self, error)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      character(:), allocatable :: message
      type(error_t), allocatable :: ignored

      call self%journal%settle(ignored)
      call self%journal%file%close()
      message = error%message//"; what was computed is safe in "//self%journal%file%path// &
                ", and the same command goes on from there"
      call raise(error, message)
   end subroutine give_up

   !> Delete the checkpoint: the sweep is complete.
   subroutine remove(self, error)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%journal%file%remove(error)
   end subroutine remove

end module razy_sweep_checkpoint
