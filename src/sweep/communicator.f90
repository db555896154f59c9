!! The ranks of a sweep: a duplicated MPI communicator and the collective operations on it.
!!
!! Without mpirun there is one rank, and no collective operation sends anything.
!!
!! How input is read: rank 0 reads, then all ranks call `agree(error)`, leave together if it is allocated (the driver prints the
!! message on rank 0), and only then broadcast values.
module razy_sweep_communicator
   use mpi_f08, only: mpi_comm, mpi_comm_dup, mpi_comm_free, mpi_comm_rank, mpi_comm_set_errhandler, mpi_comm_size, &
      & mpi_errors_return, mpi_iallreduce, mpi_ibcast, mpi_integer8, mpi_min, mpi_request
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_sweep_mpi, only: check_mpi, complete
   implicit none(type, external)
   private

   public :: communicator_t, new_communicator

   !> The ranks that work together. Made by `new_communicator`.
   type :: communicator_t
      !> The duplicate, with errors returned.
      type(mpi_comm) :: handle
      !> Number of this rank, from 0, and number of ranks.
      integer :: rank = 0, size = 1
   contains
      procedure :: is_root
      procedure :: agree
      procedure :: free
      procedure, private :: broadcast_integer, broadcast_real, broadcast_logical, broadcast_text, broadcast_integers, &
         & broadcast_reals
      !> Give the value on rank 0 to all ranks: integer(i8), real(wp), logical; allocatable text and vectors, which may be
      !> unallocated.
      generic :: broadcast => broadcast_integer, broadcast_real, broadcast_logical, broadcast_text, broadcast_integers, &
         & broadcast_reals
   end type communicator_t

contains

   !> Duplicate `parent`, so that messages of the sweep meet no others. Collective.
   subroutine new_communicator(self, parent, error)
      type(communicator_t), intent(out) :: self
      type(mpi_comm), intent(in) :: parent
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      call mpi_comm_dup(parent, self%handle, code)
      call check_mpi(code, "MPI_Comm_dup", error)
      if (allocated(error)) return
      call mpi_comm_set_errhandler(self%handle, mpi_errors_return, code)
      call check_mpi(code, "MPI_Comm_set_errhandler", error)
      if (allocated(error)) return
      call mpi_comm_rank(self%handle, self%rank, code)
      call check_mpi(code, "MPI_Comm_rank", error)
      if (allocated(error)) return
      call mpi_comm_size(self%handle, self%size, code)
      call check_mpi(code, "MPI_Comm_size", error)
   end subroutine new_communicator

   !> Free the duplicate. Collective.
   subroutine free(self, error)
      class(communicator_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      call mpi_comm_free(self%handle, code)
      call check_mpi(code, "MPI_Comm_free", error)
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
      type(error_t), allocatable :: failure
      character(:), allocatable :: message
      type(mpi_request) :: request
      integer(i8), asynchronous :: mine(1), lowest(1)
      integer :: code

      if (self%size == 1) return
      mine = merge(self%rank, self%size, allocated(error))
      call mpi_iallreduce(mine, lowest, 1, mpi_integer8, mpi_min, self%handle, request, code)
      call check_mpi(code, "MPI_Iallreduce", failure)
      if (.not. allocated(failure)) call complete(request, failure)
      if (.not. allocated(failure)) then
         if (lowest(1) == self%size) return
         if (lowest(1) == self%rank) message = error%message
         call share_text(self, message, int(lowest(1)), failure)
      end if
      if (allocated(failure)) then
         call move_alloc(failure, error)
      else
         call raise(error, message)
      end if
   end subroutine agree

   subroutine broadcast_integer(self, value, error)
      class(communicator_t), intent(in) :: self
      integer(i8), intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      integer(i8), allocatable :: words(:)

      words = [value]
      call share(self, words, 0, error)
      value = words(1)
   end subroutine broadcast_integer

   subroutine broadcast_real(self, value, error)
      class(communicator_t), intent(in) :: self
      real(wp), intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: word

      word = transfer(value, word)
      call self%broadcast_integer(word, error)
      value = transfer(word, value)
   end subroutine broadcast_real

   subroutine broadcast_logical(self, value, error)
      class(communicator_t), intent(in) :: self
      logical, intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: word

      word = merge(1, 0, value)
      call self%broadcast_integer(word, error)
      value = word == 1
   end subroutine broadcast_logical

   subroutine broadcast_text(self, value, error)
      class(communicator_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error

      call share_text(self, value, 0, error)
   end subroutine broadcast_text

   subroutine broadcast_integers(self, values, error)
      class(communicator_t), intent(in) :: self
      integer(i8), allocatable, intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error

      call share(self, values, 0, error)
   end subroutine broadcast_integers

   subroutine broadcast_reals(self, values, error)
      class(communicator_t), intent(in) :: self
      real(wp), allocatable, intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(i8), allocatable :: words(:)

      if (allocated(values)) words = transfer(values, [0_i8], size(values))
      call share(self, words, 0, error)
      if (allocated(values)) deallocate (values)
      if (allocated(words)) values = transfer(words, [0.0_wp], size(words))
   end subroutine broadcast_reals

   !> Broadcast text, which may be unallocated, from rank `root`.
   subroutine share_text(communicator, value, root, error)
      type(communicator_t), intent(in) :: communicator
      character(:), allocatable, intent(inout) :: value
      integer, intent(in) :: root
      type(error_t), allocatable, intent(out) :: error
      integer(i8), allocatable :: words(:)
      integer :: i

      if (communicator%size == 1) return
      if (allocated(value)) words = [(int(ichar(value(i:i)), i8), i=1, len(value))]
      call share(communicator, words, root, error)
      if (allocated(value)) deallocate (value)
      if (allocated(error) .or. .not. allocated(words)) return
      allocate (character(size(words)) :: value)
      do i = 1, len(value)
         value(i:i) = char(words(i))
      end do
   end subroutine share_text

   !> Broadcast words, which may be unallocated, from rank `root`.
   subroutine share(communicator, words, root, error)
      type(communicator_t), intent(in) :: communicator
      integer(i8), allocatable, intent(inout), asynchronous :: words(:)
      integer, intent(in) :: root
      type(error_t), allocatable, intent(out) :: error
      integer(i8), asynchronous :: length(1)

      if (communicator%size == 1) return
      length = -1
      if (allocated(words)) length = size(words, kind=i8)
      call send(length, 1)
      if (allocated(error)) return
      if (communicator%rank /= root) then
         if (allocated(words)) deallocate (words)
         if (length(1) >= 0) allocate (words(length(1)))
      end if
      if (length(1) > 0) call send(words, int(length(1)))

   contains

      subroutine send(values, n)
         integer, intent(in) :: n
         integer(i8), intent(inout), asynchronous :: values(n)
         type(mpi_request) :: request
         integer :: code

         call mpi_ibcast(values, n, mpi_integer8, root, communicator%handle, request, code)
         call check_mpi(code, "MPI_Ibcast", error)
         if (.not. allocated(error)) call complete(request, error)
      end subroutine send

   end subroutine share

end module razy_sweep_communicator
