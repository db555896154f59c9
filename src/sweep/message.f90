!! Messages between two ranks that neither waits for.
!!
!! Sends are synchronous-mode: one is over when its receiver has begun to take it, so a rank has at most as many messages under
!! way as it has `outgoing_t`, and nothing piles up at the receiver. Long messages need both sides inside MPI to move: a rank that
!! is busy calls `is_free` or `look` now and then.
module razy_sweep_message
   use mpi_f08, only: mpi_any_source, mpi_any_tag, mpi_get_count, mpi_imrecv, mpi_improbe, mpi_integer8, mpi_issend, mpi_message, &
      & mpi_request, mpi_status, mpi_status_ignore, mpi_test
   use razy_core_kinds, only: i8
   use razy_sweep_clock, only: patience_t
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_packet, only: packet_t
   implicit none(type, external)
   private

   public :: incoming_t, outgoing_t

   !> A message to send: `send` words, or fill `packet` while it `is_free`, then `post`.
   type :: outgoing_t
      type(packet_t) :: packet
      !> Messages sent.
      integer(i8) :: messages = 0
      type(mpi_request), private :: request
      logical, private :: under_way = .false.
   contains
      procedure :: send
      procedure :: post
      procedure :: is_free
      procedure :: wait => wait_until_free
   end type outgoing_t

   !> A message being received: `look` until one has arrived in `packet`, then `release`.
   type :: incoming_t
      type(packet_t) :: packet
      integer :: source = -1, tag = -1
      !> A message has been found and not been released.
      logical :: taken = .false.
      type(mpi_request), private :: request
   contains
      procedure :: look
      procedure :: release
   end type incoming_t

contains

   !> Send these words when the message before has been taken.
   subroutine send(self, words, communicator, destination, tag)
      class(outgoing_t), intent(inout), asynchronous :: self
      integer(i8), intent(in) :: words(:)
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: destination, tag

      call self%wait()
      call self%packet%set_length(size(words, kind=i8))
      self%packet%words(:size(words)) = words
      call self%post(communicator, destination, tag)
   end subroutine send

   !> Send the packet. It must not be touched until the message `is_free`.
   subroutine post(self, communicator, destination, tag)
      class(outgoing_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: destination, tag

      call mpi_issend(self%packet%words, int(self%packet%length), mpi_integer8, destination, tag, communicator%handle, &
         & self%request)
      self%under_way = .true.
      self%messages = self%messages + 1
   end subroutine post

   !> No message is under way.
   subroutine is_free(self, free)
      class(outgoing_t), intent(inout), asynchronous :: self
      logical, intent(out) :: free

      free = .not. self%under_way
      if (.not. free) call mpi_test(self%request, free, mpi_status_ignore)
      self%under_way = .not. free
   end subroutine is_free

   !> Wait politely until no message is under way.
   subroutine wait_until_free(self)
      class(outgoing_t), intent(inout), asynchronous :: self

      type(patience_t) :: patience
      logical :: free

      do
         call self%is_free(free)
         if (free) return
         call patience%pause()
      end do
   end subroutine wait_until_free

   !> Begin to receive the next message from any rank, if there is one and none is being received; whether one is complete in
   !> `packet`.
   subroutine look(self, communicator, arrived)
      class(incoming_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      logical, intent(out) :: arrived

      type(mpi_message) :: message
      type(mpi_status) :: status
      integer :: count

      arrived = .false.
      if (.not. self%taken) then
         call mpi_improbe(mpi_any_source, mpi_any_tag, communicator%handle, self%taken, message, status)
         if (.not. self%taken) return
         self%source = status%mpi_source
         self%tag = status%mpi_tag
         call mpi_get_count(status, mpi_integer8, count)
         call self%packet%clear()
         call self%packet%set_length(int(count, i8))
         call mpi_imrecv(self%packet%words, count, mpi_integer8, message, self%request)
      end if
      call mpi_test(self%request, arrived, mpi_status_ignore)
   end subroutine look

   !> The packet has been read.
   elemental subroutine release(self)
      class(incoming_t), intent(inout) :: self

      self%taken = .false.
   end subroutine release

end module razy_sweep_message
