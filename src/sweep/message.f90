!! Messages between two ranks that neither waits for.
!!
!! Sends are synchronous-mode: one is over when its receiver has begun to take it, so a rank has at most as many messages under
!! way as it has `outgoing_t`, and nothing piles up at the receiver. Long messages need both sides inside MPI to move: a rank that
!! is busy calls `is_free` or `look` now and then.
module razy_sweep_message
   use mpi_f08, only: mpi_any_source, mpi_any_tag, mpi_get_count, mpi_imrecv, mpi_improbe, mpi_integer8, mpi_issend, mpi_message, &
      & mpi_request, mpi_status, mpi_status_ignore, mpi_test
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8
   use razy_sweep_clock, only: patience_t
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_mpi, only: check_mpi
   use razy_sweep_packet, only: packet_t
   implicit none(type, external)
   private

   public :: incoming_t, outgoing_t

   !> A message to send: fill `packet` while it `is_free`, then `post`.
   type :: outgoing_t
      type(packet_t) :: packet
      type(mpi_request), private :: request
      logical, private :: under_way = .false.
   contains
      procedure :: post
      procedure :: is_free
      procedure :: wait => wait_until_free
   end type outgoing_t

   !> A message being received: `look` for one, it is in `packet` once `arrived`; then `release`.
   type :: incoming_t
      type(packet_t) :: packet
      integer :: source = -1, tag = -1
      !> A message has been found and not been released.
      logical :: taken = .false.
      type(mpi_request), private :: request
      logical, private :: complete = .false.
   contains
      procedure :: look
      procedure :: arrived
      procedure :: release
   end type incoming_t

contains

   !> Send the packet. It must not be touched until the message `is_free`.
   subroutine post(self, communicator, destination, tag, error)
      class(outgoing_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: destination, tag
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      if (self%packet%length > huge(1)) then
         call raise(error, "the row of a point is too long for one message")
         return
      end if
      call mpi_issend(self%packet%words, int(self%packet%length), mpi_integer8, destination, tag, communicator%handle, &
         & self%request, code)
      call check_mpi(code, "MPI_Issend", error)
      self%under_way = .not. allocated(error)
   end subroutine post

   !> No message is under way.
   subroutine is_free(self, free, error)
      class(outgoing_t), intent(inout), asynchronous :: self
      logical, intent(out) :: free
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      free = .not. self%under_way
      if (free) return
      call mpi_test(self%request, free, mpi_status_ignore, code)
      call check_mpi(code, "MPI_Test", error)
      self%under_way = .not. free
   end subroutine is_free

   !> Wait politely until no message is under way.
   subroutine wait_until_free(self, error)
      class(outgoing_t), intent(inout), asynchronous :: self
      type(error_t), allocatable, intent(out) :: error
      type(patience_t) :: patience
      logical :: free

      do
         call self%is_free(free, error)
         if (free .or. allocated(error)) return
         call patience%pause()
      end do
   end subroutine wait_until_free

   !> Begin to receive the next message from any rank, if there is one.
   subroutine look(self, communicator, error)
      class(incoming_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      type(error_t), allocatable, intent(out) :: error
      type(mpi_message) :: message
      type(mpi_status) :: status
      integer :: code, count

      call mpi_improbe(mpi_any_source, mpi_any_tag, communicator%handle, self%taken, message, status, code)
      call check_mpi(code, "MPI_Improbe", error)
      if (allocated(error) .or. .not. self%taken) return
      self%source = status%mpi_source
      self%tag = status%mpi_tag
      self%complete = .false.
      call mpi_get_count(status, mpi_integer8, count, code)
      call check_mpi(code, "MPI_Get_count", error)
      if (allocated(error)) return
      call self%packet%clear()
      call self%packet%set_length(int(count, i8))
      call mpi_imrecv(self%packet%words, count, mpi_integer8, message, self%request, code)
      call check_mpi(code, "MPI_Imrecv", error)
   end subroutine look

   !> A message has been found and is complete in `packet`.
   subroutine arrived(self, complete, error)
      class(incoming_t), intent(inout), asynchronous :: self
      logical, intent(out) :: complete
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      if (self%taken .and. .not. self%complete) then
         call mpi_test(self%request, self%complete, mpi_status_ignore, code)
         call check_mpi(code, "MPI_Test", error)
      end if
      complete = self%taken .and. self%complete
   end subroutine arrived

   !> The packet has been read.
   elemental subroutine release(self)
      class(incoming_t), intent(inout) :: self

      self%taken = .false.
      self%complete = .false.
   end subroutine release

end module razy_sweep_message
