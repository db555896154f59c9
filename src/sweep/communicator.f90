!! The ranks of a sweep: a duplicated MPI communicator and the collective operations on it.
!!
!! Without mpirun there is one rank, and no collective operation sends anything.
!!
!! How input is read: rank 0 reads, then all ranks call `agree(error)`, leave together if it is allocated (the driver prints the
!! message on rank 0), and only then broadcast values.
module razy_sweep_communicator
   use mpi_f08, only: mpi_character, mpi_comm, mpi_comm_dup, mpi_comm_free, mpi_comm_rank, mpi_comm_set_errhandler, mpi_comm_size, &
      & mpi_double_precision, mpi_errors_return, mpi_iallreduce, mpi_ibarrier, mpi_ibcast, mpi_integer, mpi_integer8, mpi_min, &
      & mpi_request
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
      procedure :: barrier
      procedure :: free
      procedure, private :: broadcast_integer, broadcast_i8, broadcast_real, broadcast_logical, broadcast_text
      procedure, private :: broadcast_i8_vector, broadcast_real_vector
      !> Give the value on rank 0 to all ranks: integer, integer(i8), real(wp), logical; allocatable text, integer(i8) and real(wp)
      !> vectors, which may be unallocated.
      generic :: broadcast => broadcast_integer, broadcast_i8, broadcast_real, broadcast_logical, broadcast_text, &
         & broadcast_i8_vector, broadcast_real_vector
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

   !> Wait until all ranks are here.
   subroutine barrier(self, error)
      class(communicator_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      type(mpi_request) :: request
      integer :: code

      if (self%size == 1) return
      call mpi_ibarrier(self%handle, request, code)
      call check_mpi(code, "MPI_Ibarrier", error)
      if (.not. allocated(error)) call complete(request, error)
   end subroutine barrier

   !> Give all ranks the error of the lowest rank that has one; unallocated everywhere if none has. Collective.
   subroutine agree(self, error)
      class(communicator_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      character(:), allocatable :: message
      type(mpi_request) :: request
      integer, asynchronous :: mine, lowest
      integer :: code

      if (self%size == 1) return
      mine = merge(self%rank, self%size, allocated(error))
      call mpi_iallreduce(mine, lowest, 1, mpi_integer, mpi_min, self%handle, request, code)
      call check_mpi(code, "MPI_Iallreduce", failure)
      if (.not. allocated(failure)) call complete(request, failure)
      if (.not. allocated(failure)) then
         if (lowest == self%size) return
         if (lowest == self%rank) message = error%message
         call share_text(self, message, lowest, failure)
      end if
      if (allocated(failure)) then
         call move_alloc(failure, error)
      else
         call raise(error, message)
      end if
   end subroutine agree

   !> Broadcast an integer.
   subroutine broadcast_integer(self, value, error)
      class(communicator_t), intent(in) :: self
      integer, intent(inout), asynchronous :: value
      type(error_t), allocatable, intent(out) :: error
      type(mpi_request) :: request
      integer :: code

      if (self%size == 1) return
      call mpi_ibcast(value, 1, mpi_integer, 0, self%handle, request, code)
      call check_mpi(code, "MPI_Ibcast", error)
      if (.not. allocated(error)) call complete(request, error)
   end subroutine broadcast_integer

   !> Broadcast a long integer.
   subroutine broadcast_i8(self, value, error)
      class(communicator_t), intent(in) :: self
      integer(i8), intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: vector(1)

      vector = value
      call share_i8(self, vector, error)
      value = vector(1)
   end subroutine broadcast_i8

   !> Broadcast a real.
   subroutine broadcast_real(self, value, error)
      class(communicator_t), intent(in) :: self
      real(wp), intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: vector(1)

      vector = value
      call share_real(self, vector, error)
      value = vector(1)
   end subroutine broadcast_real

   !> Broadcast a logical.
   subroutine broadcast_logical(self, value, error)
      class(communicator_t), intent(in) :: self
      logical, intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error
      integer :: as_integer

      as_integer = merge(1, 0, value)
      call self%broadcast_integer(as_integer, error)
      value = as_integer == 1
   end subroutine broadcast_logical

   !> Broadcast text; its length comes from rank 0.
   subroutine broadcast_text(self, value, error)
      class(communicator_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: value
      type(error_t), allocatable, intent(out) :: error

      call share_text(self, value, 0, error)
   end subroutine broadcast_text

   !> Broadcast a vector of long integers; its size comes from rank 0.
   subroutine broadcast_i8_vector(self, values, error)
      class(communicator_t), intent(in) :: self
      integer(i8), allocatable, intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: n

      n = -1
      if (allocated(values)) n = size(values)
      call self%broadcast_integer(n, error)
      if (allocated(error)) return
      if (.not. self%is_root()) then
         if (allocated(values)) deallocate (values)
         if (n >= 0) allocate (values(n))
      end if
      if (n > 0) call share_i8(self, values, error)
   end subroutine broadcast_i8_vector

   !> Broadcast a vector of reals; its size comes from rank 0.
   subroutine broadcast_real_vector(self, values, error)
      class(communicator_t), intent(in) :: self
      real(wp), allocatable, intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: n

      n = -1
      if (allocated(values)) n = size(values)
      call self%broadcast_integer(n, error)
      if (allocated(error)) return
      if (.not. self%is_root()) then
         if (allocated(values)) deallocate (values)
         if (n >= 0) allocate (values(n))
      end if
      if (n > 0) call share_real(self, values, error)
   end subroutine broadcast_real_vector

   !> Broadcast long integers whose number all ranks know.
   subroutine share_i8(communicator, values, error)
      type(communicator_t), intent(in) :: communicator
      integer(i8), contiguous, intent(inout), asynchronous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(mpi_request) :: request
      integer :: code

      if (communicator%size == 1) return
      call mpi_ibcast(values, size(values), mpi_integer8, 0, communicator%handle, request, code)
      call check_mpi(code, "MPI_Ibcast", error)
      if (.not. allocated(error)) call complete(request, error)
   end subroutine share_i8

   !> Broadcast reals whose number all ranks know.
   subroutine share_real(communicator, values, error)
      type(communicator_t), intent(in) :: communicator
      real(wp), contiguous, intent(inout), asynchronous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(mpi_request) :: request
      integer :: code

      if (communicator%size == 1) return
      call mpi_ibcast(values, size(values), mpi_double_precision, 0, communicator%handle, request, code)
      call check_mpi(code, "MPI_Ibcast", error)
      if (.not. allocated(error)) call complete(request, error)
   end subroutine share_real

   !> Broadcast text, which may be unallocated, from rank `root`.
   subroutine share_text(communicator, value, root, error)
      type(communicator_t), intent(in) :: communicator
      character(:), allocatable, intent(inout), asynchronous :: value
      integer, intent(in) :: root
      type(error_t), allocatable, intent(out) :: error
      type(mpi_request) :: request
      integer, asynchronous :: length
      integer :: code

      if (communicator%size == 1) return
      length = -1
      if (allocated(value)) length = len(value)
      call mpi_ibcast(length, 1, mpi_integer, root, communicator%handle, request, code)
      call check_mpi(code, "MPI_Ibcast", error)
      if (.not. allocated(error)) call complete(request, error)
      if (allocated(error)) return
      if (communicator%rank /= root) then
         if (allocated(value)) deallocate (value)
         if (length >= 0) allocate (character(length) :: value)
      end if
      if (length <= 0) return
      call mpi_ibcast(value, length, mpi_character, root, communicator%handle, request, code)
      call check_mpi(code, "MPI_Ibcast", error)
      if (.not. allocated(error)) call complete(request, error)
   end subroutine share_text

end module razy_sweep_communicator
