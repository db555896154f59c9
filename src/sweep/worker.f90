!! The part of a sweep on the ranks above 0.
!!
!! A worker asks for its next chunk before it computes the one it has, so it does not wait while rank 0 is busy with a point;
!! unless points are few and long, and it would keep the next one from others.
!! Results gather in one buffer while another is under way; only when both are full does the worker wait.
!!
!! When rank 0 orders it, or this rank is interrupted itself, the worker finishes the row it is at and gives back the rest.
module razy_sweep_worker
   use razy_core_kinds, only: i8, wp
   use razy_sweep_clock, only: patience_t, seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_message, only: incoming_t, outgoing_t
   use razy_sweep_protocol, only: ask_interrupt, pack_tally, sweep_options_t, tag_chunk, tag_request, tag_results, tag_tally, &
      & tally_t
   use razy_sweep_task, only: point_task
   use razy_sweep_units, only: units_t
   implicit none(type, external)
   private

   public :: work

   !> A packet may grow to so many times its usual size before the worker waits for rank 0.
   integer(i8), parameter :: patience_in_packets = 16

   !> State of a worker.
   type :: worker_t
      type(communicator_t) :: communicator
      type(sweep_options_t) :: options
      type(outgoing_t) :: request
      type(incoming_t) :: reply
      type(outgoing_t) :: results(2)
      integer :: filling = 1
      !> A chunk that has come and not been begun.
      logical :: has_chunk = .false.
      integer(i8) :: first = 0, count = 0
      !> No more points are computed; rank 0 has said that it is over.
      logical :: stopping = .false., told = .false.
      real(wp) :: last_sent = 0.0_wp
      !> Time of a unit in the last chunk; 0: none yet [s].
      real(wp) :: unit_time = 0.0_wp
      type(tally_t) :: tally
   end type worker_t

contains

   !> Ask rank 0 for chunks and compute them until there are none left.
   subroutine work(communicator, task, units, options, interrupted)
      type(communicator_t), intent(in) :: communicator
      class(point_task), intent(inout) :: task
      type(units_t), intent(inout) :: units
      type(sweep_options_t), intent(in) :: options
      procedure(ask_interrupt), optional :: interrupted

      type(worker_t), asynchronous :: worker
      integer(i8) :: first, count, unit
      real(wp) :: begun

      worker%communicator = communicator
      worker%options = options
      worker%last_sent = seconds()
      call ask(worker)
      do
         call await_chunk(worker, first, count)
         if (count == 0) exit
         if (options%ask_ahead) call ask(worker)
         begun = seconds()
         do unit = first, first + count - 1
            if (worker%stopping) exit
            call compute_unit(worker, task, units, interrupted, unit)
         end do
         worker%unit_time = (seconds() - begun)/count
         if (.not. options%ask_ahead) call ask(worker)
      end do
      call finish(worker)
   end subroutine work

   !> Compute a unit, all its rows, unless the worker is to stop between them.
   subroutine compute_unit(worker, task, units, interrupted, unit)
      type(worker_t), intent(inout), asynchronous :: worker
      class(point_task), intent(inout) :: task
      type(units_t), intent(inout) :: units
      procedure(ask_interrupt), optional :: interrupted
      integer(i8), intent(in) :: unit

      real(wp) :: begun, ended
      logical :: more

      do
         begun = seconds()
         call units%run(task, unit, worker%results(worker%filling)%packet, more)
         ended = seconds()
         worker%tally%busy = worker%tally%busy + (ended - begun)
         if (.not. task%broken_off) worker%tally%points = worker%tally%points + 1
         call send_if_due(worker, ended)
         call listen(worker)
         if (present(interrupted)) then
            if (interrupted()) worker%stopping = .true.
         end if
         if (worker%stopping .or. .not. more) return
      end do
   end subroutine compute_unit

   !> Ask for the next chunk. The answer to the request before has come, so its message is over or nearly so.
   subroutine ask(worker)
      type(worker_t), intent(inout), asynchronous :: worker

      call worker%request%send([merge(1_i8, 0_i8, worker%stopping), transfer(worker%unit_time, 0_i8)], worker%communicator, 0, &
                               tag_request)
   end subroutine ask

   !> Take in what rank 0 has sent, if anything: the chunk that was asked for, or the order to stop.
   subroutine listen(worker)
      type(worker_t), intent(inout), asynchronous :: worker

      logical :: arrived

      call worker%reply%look(worker%communicator, arrived)
      if (.not. arrived) return
      if (worker%reply%tag == tag_chunk) then
         worker%has_chunk = .true.
         worker%first = worker%reply%packet%words(1)
         worker%count = worker%reply%packet%words(2)
      else
         worker%stopping = .true.
         worker%told = .true.
      end if
      call worker%reply%release()
   end subroutine listen

   !> Wait for the chunk that was asked for.
   subroutine await_chunk(worker, first, count)
      type(worker_t), intent(inout), asynchronous :: worker
      integer(i8), intent(out) :: first, count

      type(patience_t) :: patience

      do
         if (.not. worker%has_chunk) call listen(worker)
         if (worker%has_chunk) exit
         call patience%pause()
         call send_if_due(worker, seconds())
      end do
      worker%has_chunk = .false.
      first = worker%first
      count = worker%count
   end subroutine await_chunk

   !> Send the results gathered if they are many or if it is time, and the other buffer is free; wait for it if they are too many.
   subroutine send_if_due(worker, now)
      type(worker_t), intent(inout), asynchronous :: worker
      real(wp), intent(in) :: now

      integer(i8) :: length
      logical :: free

      length = worker%results(worker%filling)%packet%length
      call worker%results(3 - worker%filling)%is_free(free)
      if (length == 0) return
      if (length < worker%options%packet_words .and. now - worker%last_sent < worker%options%send_interval) return
      if (.not. free .and. length < patience_in_packets*worker%options%packet_words) return
      call send(worker)
      worker%last_sent = now
   end subroutine send_if_due

   !> Send the results gathered and go on with the other buffer, when it is free.
   subroutine send(worker)
      type(worker_t), intent(inout), asynchronous :: worker

      call worker%results(worker%filling)%post(worker%communicator, 0, tag_results)
      worker%filling = 3 - worker%filling
      call worker%results(worker%filling)%wait()
      call worker%results(worker%filling)%packet%clear()
   end subroutine send

   !> Send the last results and the tally, and wait until rank 0 has them and says that it is over.
   subroutine finish(worker)
      type(worker_t), intent(inout), asynchronous :: worker

      type(patience_t) :: patience
      integer :: i

      if (worker%results(worker%filling)%packet%length > 0) call send(worker)
      worker%tally%messages = worker%request%messages + sum(worker%results%messages) + 1
      call worker%request%send(pack_tally(worker%tally), worker%communicator, 0, tag_tally)
      call worker%request%wait()
      do i = 1, 2
         call worker%results(i)%wait()
      end do
      do while (.not. worker%told)
         call listen(worker)
         if (.not. worker%told) call patience%pause()
      end do
   end subroutine finish

end module razy_sweep_worker
