!! The ranks of a sweep: a duplicated MPI communicator and the collective operations on it.
!!
!! Without mpirun there is one rank, and no collective operation sends anything.
!!
!! How input is read: rank 0 reads, then all ranks call `agree(error)`, leave together if it is allocated (the driver prints the
!! message on rank 0), and only then broadcast values.
!!
!! `src/sweep` is the only folder that knows MPI; a driver starts it, hands MPI_COMM_WORLD to `new_communicator`, and ends it.
!! A failure of MPI ends all ranks, with the message of its library: they would no longer be in step.
module razy_sweep_communicator
   use mpi_f08, only: mpi_comm, mpi_comm_dup, mpi_comm_free, mpi_comm_rank, mpi_comm_set_errhandler, mpi_comm_size, &
      & mpi_errors_are_fatal, mpi_iallreduce, mpi_ibcast, mpi_integer8, mpi_min, mpi_request, mpi_status_ignore, mpi_test
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_sweep_clock, only: patience_t
   implicit none(type, external)
   private

   public :: communicator_t, new_communicator

   !> The ranks that work together. Made by `new_communicator`.
   type :: communicator_t
      !> The duplicate.
      type(mpi_comm) :: handle
      !> Number of this rank, from 0, and number of ranks.
      integer :: rank = 0, size = 1
   contains
      procedure :: is_root
      procedure :: agree
      procedure :: free
      procedure, private :: broadcast_integer, broadcast_logical, broadcast_text, broadcast_integers, &
         & broadcast_reals
      !> Give the value on rank 0 to all ranks: integer(i8), real(wp), logical; allocatable text and vectors, which may be
      !> unallocated, text and integers also from another rank `root`.
      generic :: broadcast => broadcast_integer, broadcast_logical, broadcast_text, broadcast_integers, &
         & broadcast_reals
   end type communicator_t

contains

   !> Duplicate `parent`, so that messages of the sweep meet no others. Collective.
   subroutine new_communicator(self, parent)
      type(communicator_t), intent(out) :: self
      type(mpi_comm), intent(in) :: parent

      call mpi_comm_dup(parent, self%handle)
      call mpi_comm_set_errhandler(self%handle, mpi_errors_are_fatal)
      call mpi_comm_rank(self%handle, self%rank)
      call mpi_comm_size(self%handle, self%size)
   end subroutine new_communicator

   !> Free the duplicate. Collective.
   subroutine free(self)
      class(communicator_t), intent(inout) :: self

      call mpi_comm_free(self%handle)
   end subroutine free

   !> This is rank 0, the one that reads, collects, writes and prints.
   elemental logical function is_root(self)
      class(communicator_t), intent(in) :: self

      is_root = self%rank == 0
   end function is_root

   !> Give all ranks the error of the lowest rank that has one; unallocated everywhere if none has. Collective.
   subroutine agree(self, error)
      class(communicator_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      character(:), allocatable :: message
      type(mpi_request) :: request
      integer(i8), asynchronous :: mine(1), lowest(1)

      if (self%size == 1) return
      mine = merge(self%rank, self%size, allocated(error))
      call mpi_iallreduce(mine, lowest, 1, mpi_integer8, mpi_min, self%handle, request)
      call complete(request)
      if (lowest(1) == self%size) return
      if (lowest(1) == self%rank) message = error%message
      call self%broadcast_text(message, int(lowest(1)))
      call raise(error, message)
   end subroutine agree

   subroutine broadcast_integer(self, value)
      class(communicator_t), intent(in) :: self
      integer(i8), intent(inout) :: value
      integer(i8), allocatable :: words(:)

      words = [value]
      call self%broadcast_integers(words)
      value = words(1)
   end subroutine broadcast_integer

   subroutine broadcast_logical(self, value)
      class(communicator_t), intent(in) :: self
      logical, intent(inout) :: value
      integer(i8) :: word

      word = merge(1, 0, value)
      call self%broadcast_integer(word)
      value = word == 1
   end subroutine broadcast_logical

   subroutine broadcast_reals(self, values)
      class(communicator_t), intent(in) :: self
      real(wp), allocatable, intent(inout) :: values(:)
      integer(i8), allocatable :: words(:)

      if (allocated(values)) words = transfer(values, [0_i8], size(values))
      call self%broadcast_integers(words)
      if (allocated(values)) deallocate (values)
      if (allocated(words)) values = transfer(words, [0.0_wp], size(words))
   end subroutine broadcast_reals

   subroutine broadcast_text(self, value, root)
      class(communicator_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: value
      integer, intent(in), optional :: root
      integer(i8), allocatable :: words(:)
      integer :: i

      if (self%size == 1) return
      if (allocated(value)) words = [(int(ichar(value(i:i)), i8), i=1, len(value))]
      call self%broadcast_integers(words, root)
      if (allocated(value)) deallocate (value)
      if (.not. allocated(words)) return
      value = transfer(char(words), repeat(" ", size(words)))
   end subroutine broadcast_text

   subroutine broadcast_integers(self, values, root)
      class(communicator_t), intent(in) :: self
      integer(i8), allocatable, intent(inout), asynchronous :: values(:)
      integer, intent(in), optional :: root
      integer(i8), asynchronous :: length(1)
      integer :: from

      if (self%size == 1) return
      from = 0
      if (present(root)) from = root
      length = -1
      if (allocated(values)) length = size(values, kind=i8)
      call send(length, 1)
      if (self%rank /= from) then
         if (allocated(values)) deallocate (values)
         if (length(1) >= 0) allocate (values(length(1)))
      end if
      if (length(1) > 0) call send(values, int(length(1)))

   contains

      subroutine send(words, n)
         integer, intent(in) :: n
         integer(i8), intent(inout), asynchronous :: words(n)

         type(mpi_request) :: request

         call mpi_ibcast(words, n, mpi_integer8, from, self%handle, request)
         call complete(request)
      end subroutine send

   end subroutine broadcast_integers

   !> Wait politely for the end of an operation.
   subroutine complete(request)
      type(mpi_request), intent(inout) :: request

      type(patience_t) :: patience
      logical :: done

      do
         call mpi_test(request, done, mpi_status_ignore)
         if (done) return
         call patience%pause()
      end do
   end subroutine complete

end module razy_sweep_communicator
