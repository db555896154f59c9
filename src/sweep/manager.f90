!! The part of a sweep on rank 0: it hands out chunks, collects results and, between messages, computes points itself.
!!
!! Rank 0 takes one row at a time and looks for messages after each. What others sent is settled before it computes on, what it
!! computed itself from time to time. Its memory does not grow with the sweep: it receives a few
!! packets at a time, and their senders keep the others.
!!
!! When the sweep is to stop, after an interruption or a failure, it tells all ranks, hands out nothing more, and collects what
!! they still send.
!!
!! A working manager was chosen by measurement against a one-sided counter (MPI_Fetch_and_op on rank 0) by which every rank takes
!! its own chunks. Within a node the counter is somewhat better (0.1 microseconds a call); without remote atomics (Open MPI's
!! osc/pt2pt) it is served only when rank 0 enters MPI: 40 ms a call while rank 0 computes points of 20 ms, in which the rank
!! that asks is idle. Asking before the present chunk is computed hides most of that wait, on every network.
module razy_sweep_manager
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_sweep_clock, only: patience_t, seconds
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_message, only: incoming_t, outgoing_t
   use razy_sweep_protocol, only: ask_interrupt, chunk_size, sweep_options_t, tag_chunk, tag_request, tag_results, tag_stop, &
      & tally_t, unpack_tally
   use razy_sweep_packet, only: packet_t
   use razy_sweep_task, only: collector_t, point_task
   use razy_sweep_units, only: units_t
   implicit none(type, external)
   private

   public :: manage, report_progress

   !> Packets received at the same time.
   integer, parameter :: n_incoming = 4

   !> State of rank 0.
   type :: manager_t
      type(communicator_t) :: communicator
      type(sweep_options_t) :: options
      !> Units of the sweep, the next one to hand out, the one that rank 0 is at, or 0; rows in all, and collected.
      integer(i8) :: n_units = 0, next = 1, own = 0, rows = 0, collected = 0
      !> Ranks that may still send.
      integer :: active = 0
      !> No more points are computed.
      logical :: stopping = .false.
      !> What ended the sweep early.
      type(error_t), allocatable :: failure
      !> The row that was computed here.
      type(packet_t) :: packet
      type(incoming_t) :: incoming(n_incoming)
      type(outgoing_t), allocatable :: replies(:), orders(:)
      type(tally_t), allocatable :: tallies(:)
   end type manager_t

   abstract interface
      !> Tells how far the sweep is: rows collected, rows in all, time since its start [s].
      subroutine report_progress(done, total, elapsed)
         import :: i8, wp
         implicit none(type, external)
         integer(i8), intent(in) :: done, total
         real(wp), intent(in) :: elapsed
      end subroutine report_progress
   end interface

contains

   !> Run the sweep on rank 0.
   !>
   !> `tallies` (0:ranks-1) is what each rank did, `stopped` tells whether an interruption ended the sweep early, `failure` is an
   !> error of `collect` or `settle`, which does the same.
   subroutine manage(communicator, task, units, collector, options, progress, interrupted, tallies, stopped, failure)
      type(communicator_t), intent(in) :: communicator
      class(point_task), intent(inout) :: task
      type(units_t), intent(inout) :: units
      class(collector_t), intent(inout) :: collector
      type(sweep_options_t), intent(in) :: options
      procedure(report_progress), optional :: progress
      procedure(ask_interrupt), optional :: interrupted
      type(tally_t), allocatable, intent(out) :: tallies(:)
      logical, intent(out) :: stopped
      type(error_t), allocatable, intent(out) :: failure
      type(manager_t), asynchronous :: manager
      type(patience_t) :: patience
      real(wp) :: start, now, reported, settled
      logical :: works, served
      integer :: rank

      manager%communicator = communicator
      manager%options = options
      manager%n_units = units%plan%units()
      manager%rows = units%plan%points - units%plan%n_done
      manager%active = communicator%size - 1
      allocate (manager%replies(communicator%size - 1), manager%orders(communicator%size - 1), &
         & manager%tallies(0:communicator%size - 1))
      works = communicator%size <= max(1, options%largest_working_manager)
      start = seconds()
      reported = start
      settled = start
      do
         call serve(manager, collector, served)
         now = seconds()
         if ((served .and. works) .or. now - settled >= options%settle_interval) then
            if (.not. allocated(manager%failure)) call collector%settle(manager%failure)
            settled = now
         end if
         if (.not. manager%stopping .and. present(interrupted)) manager%stopping = interrupted()
         if (manager%stopping .or. allocated(manager%failure)) call stop_all(manager)
         ! Before its own first row it has answered every rank once, which would wait as long as that row takes.
         if (works .and. all(manager%replies%messages > 0) .and. (manager%own > 0 .or. manager%next <= manager%n_units)) then
            call compute_row(manager, task, units, collector)
            call patience%reset()
         else if (manager%next > manager%n_units .and. .not. expects_messages(manager)) then
            exit
         else if (served) then
            call patience%reset()
         else
            call patience%pause()
         end if
         if (present(progress)) then
            now = seconds()
            if (now - reported >= options%progress_interval .and. manager%collected < manager%rows) then
               call progress(manager%collected, manager%rows, now - start)
               reported = now
            end if
         end if
      end do
      if (.not. allocated(manager%failure)) call collector%settle(manager%failure)
      do rank = 1, communicator%size - 1
         call manager%replies(rank)%wait()
         call manager%orders(rank)%wait()
      end do
      manager%tallies(0)%messages = sum(manager%replies%messages) + sum(manager%orders%messages)
      stopped = manager%stopping .and. manager%collected < manager%rows
      if (.not. allocated(manager%failure) .and. .not. manager%stopping .and. manager%collected /= manager%rows) then
         call raise(manager%failure, "results of the sweep were lost on their way")
      end if
      if (present(progress) .and. .not. allocated(manager%failure) .and. .not. stopped) then
         call progress(manager%collected, manager%rows, seconds() - start)
      end if
      call move_alloc(manager%tallies, tallies)
      call move_alloc(manager%failure, failure)
   end subroutine manage

   !> A rank may still send, or a message is still coming in: a tally can overtake the long message before it.
   pure logical function expects_messages(manager)
      type(manager_t), intent(in) :: manager

      expects_messages = manager%active > 0 .or. any(manager%incoming%taken)
   end function expects_messages

   !> Answer and take over all that has arrived; `served` tells whether there was anything.
   subroutine serve(manager, collector, served)
      type(manager_t), intent(inout), asynchronous :: manager
      class(collector_t), intent(inout) :: collector
      logical, intent(out) :: served

      logical :: again, arrived
      integer :: slot

      served = .false.
      again = expects_messages(manager)
      do while (again)
         again = .false.
         do slot = 1, n_incoming
            call manager%incoming(slot)%look(manager%communicator, arrived)
            if (.not. arrived) cycle
            call answer(manager, collector, slot)
            call manager%incoming(slot)%release()
            again = .true.
            served = .true.
         end do
      end do
   end subroutine serve

   !> Do what the message in `slot` asks for.
   subroutine answer(manager, collector, slot)
      type(manager_t), intent(inout), asynchronous :: manager
      class(collector_t), intent(inout) :: collector
      integer, intent(in) :: slot

      associate (incoming => manager%incoming(slot))
         select case (incoming%tag)
         case (tag_request)
            if (incoming%packet%words(1) == 1) then
               manager%stopping = .true.
               call stop_all(manager)
            end if
            call send_chunk(manager, incoming%source, transfer(incoming%packet%words(2), 0.0_wp))
         case (tag_results)
            call collect(manager, collector, incoming%packet)
         case default
            manager%tallies(incoming%source) = unpack_tally(incoming%packet%words(:3))
            manager%active = manager%active - 1
            call tell(manager, incoming%source)
         end select
      end associate
   end subroutine answer

   !> Hand out the next chunk to a rank, to which a unit took `unit_time` [s]; an empty one if no points are left.
   subroutine send_chunk(manager, rank, unit_time)
      type(manager_t), intent(inout), asynchronous :: manager
      integer, intent(in) :: rank
      real(wp), intent(in) :: unit_time

      integer(i8) :: count

      count = chunk_size(manager%n_units - manager%next + 1, manager%communicator%size, unit_time, manager%options)
      call manager%replies(rank)%send([manager%next, count], manager%communicator, rank, tag_chunk)
      manager%next = manager%next + count
   end subroutine send_chunk

   !> Hand out nothing more, give up the point that rank 0 is at, and tell all ranks.
   subroutine stop_all(manager)
      type(manager_t), intent(inout), asynchronous :: manager

      integer :: rank

      manager%next = manager%n_units + 1
      manager%own = 0
      do rank = 1, size(manager%orders)
         call tell(manager, rank)
      end do
   end subroutine stop_all

   !> Tell a rank, once, that it is over.
   subroutine tell(manager, rank)
      type(manager_t), intent(inout), asynchronous :: manager
      integer, intent(in) :: rank

      if (manager%orders(rank)%messages > 0) return
      call manager%orders(rank)%send([integer(i8) ::], manager%communicator, rank, tag_stop)
   end subroutine tell

   !> Compute the next unit here, or the next row of the one that was begun.
   subroutine compute_row(manager, task, units, collector)
      type(manager_t), intent(inout) :: manager
      class(point_task), intent(inout) :: task
      type(units_t), intent(inout) :: units
      class(collector_t), intent(inout) :: collector
      real(wp) :: begun
      logical :: more

      if (manager%own == 0) then
         manager%own = manager%next
         manager%next = manager%next + 1
      end if
      call manager%packet%clear()
      begun = seconds()
      call units%run(task, manager%own, manager%packet, more)
      manager%tallies(0)%busy = manager%tallies(0)%busy + (seconds() - begun)
      if (.not. task%broken_off) manager%tallies(0)%points = manager%tallies(0)%points + 1
      if (.not. more) manager%own = 0
      call collect(manager, collector, manager%packet)
   end subroutine compute_row

   !> Give the rows of a packet to the collector; after a failure they are dropped.
   subroutine collect(manager, collector, packet)
      type(manager_t), intent(inout) :: manager
      class(collector_t), intent(inout) :: collector
      type(packet_t), intent(inout) :: packet
      integer(i8) :: first, last, point

      do
         call packet%next(point, first, last)
         if (point == 0 .or. allocated(manager%failure)) return
         call collector%collect(point, packet%words(first:last), manager%failure)
         if (.not. allocated(manager%failure)) manager%collected = manager%collected + 1
      end do
   end subroutine collect

end module razy_sweep_manager
