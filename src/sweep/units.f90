!! What is handed out of a plan (razy_sweep_plan), and how a rank computes it: a point, or the links of a chain one after the
!! other, each with the row of the one before.
module razy_sweep_units
   use razy_core_kinds, only: i8
   use razy_core_table, only: table_t
   use razy_sweep_communicator, only: communicator_t
   use razy_sweep_packet, only: packet_t, unpack_row
   use razy_sweep_plan, only: plan_t
   use razy_sweep_task, only: point_task
   implicit none(type, external)
   private

   public :: units_t

   !> The units of a plan that is closed.
   type :: units_t
      type(plan_t) :: plan
      !> Rows of the links after which chains are taken up, as words one after the other; words before that of each unit
      !> (units + 1).
      integer(i8), allocatable :: last_rows(:), words_before(:)
      !> The chain that is being computed and its link that was last; the rows of this point and of the link before.
      integer(i8), private :: at = 0, link = 0
      type(table_t), private :: row, before
   contains
      procedure :: share
      procedure :: begin
      procedure :: run
      procedure, private :: run_link
   end type units_t

contains

   !> Give all ranks what rank 0 knows to be missing. Collective.
   subroutine share(self, communicator)
      class(units_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator

      call communicator%broadcast(self%plan%n_done)
      if (self%plan%has_chains()) then
         call communicator%broadcast(self%plan%chain)
         call communicator%broadcast(self%plan%reached)
         call communicator%broadcast(self%last_rows)
         call communicator%broadcast(self%words_before)
      else
         call communicator%broadcast(self%plan%run_first)
         call communicator%broadcast(self%plan%run_before)
      end if
   end subroutine share

   !> Begin a sweep.
   subroutine begin(self, task)
      class(units_t), intent(inout) :: self
      class(point_task), intent(inout) :: task

      self%at = 0
      self%row = table_t()
      call task%describe(self%row)
      self%before = self%row
   end subroutine begin

   !> Compute a missing point, or the next link of a chain, and append its row to a packet, unless it was
   !> interrupted; `more`: the unit has another.
   subroutine run(self, task, unit, packet, more)
      class(units_t), intent(inout) :: self
      class(point_task), intent(inout) :: task
      integer(i8), intent(in) :: unit
      type(packet_t), intent(inout) :: packet
      logical, intent(out) :: more

      integer(i8) :: point

      more = .false.
      call self%row%rewind()
      if (self%plan%has_chains()) then
         call self%run_link(task, unit, point, more)
      else
         point = self%plan%point_of_unit(unit)
         call task%run(point, self%row)
      end if
      if (task%broken_off) then
         ! A chain is taken up again from its last whole link.
         self%at = 0
         more = .false.
      else
         call packet%put(point, self%row)
      end if
   end subroutine run

   subroutine run_link(self, task, unit, point, more)
      class(units_t), intent(inout) :: self
      class(point_task), intent(inout) :: task
      integer(i8), intent(in) :: unit
      integer(i8), intent(out) :: point
      logical, intent(out) :: more

      logical :: fits

      if (self%at /= unit) then
         self%at = unit
         self%link = self%plan%reached(unit)
         if (self%link > 0) call unpack_row(self%last_rows(self%words_before(unit) + 1:self%words_before(unit + 1)), &
                                            self%before, fits)
      end if
      self%link = self%link + 1
      point = self%plan%point_of_link(self%plan%chain(unit), self%link)
      if (self%link == 1) then
         call task%run(point, self%row)
      else
         call task%run(point, self%row, self%before)
      end if
      more = self%link < self%plan%first_axis
      if (more) self%before = self%row
      if (.not. more) self%at = 0
   end subroutine run_link

end module razy_sweep_units
