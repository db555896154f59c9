!! A journal: records that are safe as soon as they are written, whatever ends the program, in a file that can be taken up again.
!!
!! All in 64-bit words of this machine: 4 words of head (magic, version of the format, number of words of the identity, number of
!! its characters), identity text, checksum; then records (length, words, checksum). All from the first record on whose checksum
!! is wrong is the end that was being written when the program or the machine stopped, or damage, and is dropped.
module razy_io_journal
   use, intrinsic :: iso_fortran_env, only: int64
   use razy_core_error, only: error_t, raise
   use razy_core_resize, only: resize
   use razy_io_locked_file, only: locked_file_t
   use razy_io_posix, only: synchronise
   implicit none(type, external)
   private

   public :: journal_t, checksum

   !> The journal; `begin` or `take_up`, then `put`, `settle`, `get`.
   type :: journal_t
      type(locked_file_t) :: file
      !> Words behind the last whole record, which were dropped.
      integer(int64) :: dropped = 0
      !> Words not handed to the operating system yet.
      integer(int64), allocatable, private :: waiting(:)
      integer(int64), private :: n_waiting = 0
      !> Length of the file up to which it is on the disk.
      integer(int64), private :: on_disk = 0
   contains
      procedure :: open => open_journal
      procedure :: begin
      procedure :: take_up
      procedure :: next
      procedure :: end_of_records
      procedure :: put
      procedure :: get
      procedure :: settle
      procedure :: secure
   end type journal_t

   !> "razychkp" as an integer, which a file of other byte order does not begin with.
   integer(int64), parameter :: magic = 8100683131205083506_int64
   integer(int64), parameter :: format_version = 3, n_head = 4, block = 8192

contains

   !> Open and lock the file; it may be new.
   subroutine open_journal(self, path, error)
      class(journal_t), intent(inout) :: self
      character(*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      call self%file%open(path, error)
      self%n_waiting = 0
      self%on_disk = 0
      self%dropped = 0
      if (.not. allocated(self%waiting)) allocate (self%waiting(block))
   end subroutine open_journal

   !> Begin the journal of what `identity` describes.
   subroutine begin(self, identity, error)
      class(journal_t), intent(inout) :: self
      character(*), intent(in) :: identity
      type(error_t), allocatable, intent(out) :: error

      integer(int64), allocatable :: head(:)
      integer(int64) :: n

      n = (len(identity, kind=int64) + 7)/8
      allocate (head(n_head + n + 1))
      head(:n_head) = [magic, format_version, n, len(identity, kind=int64)]
      if (n > 0) head(n_head + 1:n_head + n) = transfer(identity//repeat(" ", int(8*n) - len(identity)), head, n)
      head(n_head + n + 1) = checksum(head(:n_head + n))
      call self%file%cut(0_int64, error)
      if (.not. allocated(error)) call self%file%append(head, error)
   end subroutine begin

   !> Read the identity of an existing journal; `place` is where its first record begins.
   !>
   !> Errors: it is none, of another format, or damaged.
   subroutine take_up(self, identity, place, error)
      class(journal_t), intent(inout) :: self
      character(:), allocatable, intent(out) :: identity
      integer(int64), intent(out) :: place
      type(error_t), allocatable, intent(out) :: error

      integer(int64), allocatable :: words(:)
      integer(int64) :: head(n_head)
      logical :: there

      place = 0
      identity = ""
      call look(self, 0_int64, head, there)
      if (.not. there .or. head(1) /= magic) then
         call raise(error, self%file%path//": is not a checkpoint of razy; move it away, or name another output")
         return
      else if (head(2) /= format_version) then
         call raise(error, self%file%path//": is a checkpoint of another version of razy; finish the sweep with that, or delete it")
         return
      end if
      there = head(3) >= 0 .and. head(3) <= self%file%length .and. head(4) <= 8*head(3) .and. head(4) > 8*head(3) - 8
      if (there) then
         allocate (words(n_head + head(3) + 1))
         call look(self, 0_int64, words, there)
         place = size(words, kind=int64)
         if (there) there = words(place) == checksum(words(:place - 1))
      end if
      if (.not. there) call raise(error, self%file%path//": is damaged at its beginning; delete it to begin anew")
      if (allocated(error)) return
      deallocate (identity)
      allocate (character(head(4)) :: identity)
      identity = transfer(words(n_head + 1:place - 1), identity)
   end subroutine take_up

   !> The record at `place`, which moves behind it: it begins behind the first `at` words of the file. `found` is false where no
   !> whole one is.
   subroutine next(self, place, at, words, n, found)
      class(journal_t), intent(inout) :: self
      integer(int64), intent(inout) :: place
      integer(int64), intent(out) :: at, n
      integer(int64), allocatable, intent(inout) :: words(:)
      logical, intent(out) :: found

      at = place
      call read_record(self, place, words, n, found)
      if (found) place = place + n + 2
   end subroutine next

   !> The records end behind the first `place` words: drop what is left there.
   subroutine end_of_records(self, place, error)
      class(journal_t), intent(inout) :: self
      integer(int64), intent(in) :: place
      type(error_t), allocatable, intent(out) :: error

      self%dropped = self%file%length - place
      call self%file%cut(place, error)
   end subroutine end_of_records

   !> Append a record; `at` is its place. It is safe after the next `settle`.
   pure subroutine put(self, words, at)
      class(journal_t), intent(inout) :: self
      integer(int64), intent(in) :: words(:)
      integer(int64), intent(out) :: at

      integer(int64) :: n

      at = self%file%length + self%n_waiting
      n = size(words, kind=int64)
      if (self%n_waiting + n + 2 > size(self%waiting, kind=int64)) call resize(self%waiting, 2*(self%n_waiting + n + 2))
      self%waiting(self%n_waiting + 1) = n
      self%waiting(self%n_waiting + 2:self%n_waiting + n + 1) = words
      self%waiting(self%n_waiting + n + 2) = checksum(self%waiting(self%n_waiting + 1:self%n_waiting + n + 1))
      self%n_waiting = self%n_waiting + n + 2
   end subroutine put

   !> Hand all records to the operating system, where they survive the end of the program.
   subroutine settle(self, error)
      class(journal_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (self%n_waiting == 0) return
      call self%file%append(self%waiting(:self%n_waiting), error)
      self%n_waiting = 0
   end subroutine settle

   !> Have all records on the disk itself, where they survive the end of the machine.
   subroutine secure(self, error)
      class(journal_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%settle(error)
      if (allocated(error) .or. self%on_disk == self%file%length) return
      call synchronise(self%file%path, error)
      self%on_disk = self%file%length
   end subroutine secure

   !> Read the record that `put` or `next` placed at `at`, of which `n` words are valid.
   subroutine get(self, at, words, n, error)
      class(journal_t), intent(inout) :: self
      integer(int64), intent(in) :: at
      integer(int64), allocatable, intent(inout) :: words(:)
      integer(int64), intent(out) :: n
      type(error_t), allocatable, intent(out) :: error

      logical :: found

      call read_record(self, at, words, n, found)
      if (.not. found) call raise(error, self%file%path//": a record cannot be read back")
   end subroutine get

   !> Read a record and see whether it is whole.
   subroutine read_record(self, at, words, n, found)
      class(journal_t), intent(inout) :: self
      integer(int64), intent(in) :: at
      integer(int64), allocatable, intent(inout) :: words(:)
      integer(int64), intent(out) :: n
      logical, intent(out) :: found

      integer(int64) :: length(1), sum(1)

      n = 0
      call look(self, at, length, found)
      if (found) found = length(1) >= 0 .and. length(1) <= self%file%length - at - 2
      if (.not. found) return
      n = length(1)
      if (.not. allocated(words)) allocate (words(max(n, 64_int64)))
      if (size(words, kind=int64) < n) call resize(words, 2*n)
      call look(self, at + 1, words(:n), found)
      if (found) call look(self, at + n + 1, sum, found)
      if (found) found = sum(1) == checksum_from(checksum(length), words(:n))
   end subroutine read_record

   !> Words behind the first `offset`; `there` is false where the file ends before.
   subroutine look(self, offset, words, there)
      class(journal_t), intent(in) :: self
      integer(int64), intent(in) :: offset
      integer(int64), contiguous, intent(out) :: words(:)
      logical, intent(out) :: there

      integer(int64) :: got

      call self%file%fetch(offset, words, got)
      there = got == size(words, kind=int64)
   end subroutine look

   !> A checksum of words: no change of a single word escapes it, other changes do with probability 2^-64.
   pure integer(int64) function checksum(words)
      integer(int64), intent(in) :: words(:)

      checksum = checksum_from(7640891576956012809_int64, words)
   end function checksum

   !> The checksum of words behind others whose checksum is `before`. (Xorshift: Marsaglia, J. Stat. Softw. 8 (14), 2003.)
   pure integer(int64) function checksum_from(before, words) result(sum)
      integer(int64), intent(in) :: before, words(:)

      integer(int64) :: i

      sum = before
      do i = 1, size(words, kind=int64)
         sum = ieor(sum, words(i))
         sum = ieor(sum, ishft(sum, 13))
         sum = ieor(sum, ishft(sum, -7))
         sum = ieor(sum, ishft(sum, 17))
      end do
   end function checksum_from

end module razy_io_journal
