!! What a sweep does at one of its points, and who takes what comes out.
!!
!! A concrete task extends `point_task`. Every rank has its own copy: `run` is called on whichever rank has the point and works in
!! the task's own workspace. What a point yields is a row: a table of named columns of numbers (razy_core_table), the same columns
!! at all points. A `collector_t` takes the rows on rank 0, in any order, in the form of a packet (razy_sweep_packet).
module razy_sweep_task
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8
   use razy_core_table, only: table_t
   implicit none(type, external)
   private

   public :: collector_t, point_task

   !> The work at a point.
   type, abstract :: point_task
      !> The last point was interrupted: its row is none.
      logical :: broken_off = .false.
   contains
      procedure(describe_row), deferred :: describe
      procedure(run_point), deferred :: run
   end type point_task

   !> Who takes rows on rank 0.
   type, abstract :: collector_t
   contains
      procedure(collect_row), deferred :: collect
      procedure(settle_rows), deferred :: settle
   end type collector_t

   abstract interface
      !> Give a row its columns, with any values.
      subroutine describe_row(self, row)
         import :: point_task, table_t
         implicit none(type, external)
         class(point_task), intent(inout) :: self
         type(table_t), intent(inout) :: row
      end subroutine describe_row

      !> Compute point number `point` of the plan and fill its row, which comes rewound; `before` is the row of the link before
      !> in a chain, absent at its first. Must depend on nothing else: not on other points, not on the rank. A failure of the
      !> numerics is a status among the columns.
      subroutine run_point(self, point, row, before)
         import :: i8, point_task, table_t
         implicit none(type, external)
         class(point_task), intent(inout) :: self
         integer(i8), intent(in) :: point
         type(table_t), intent(inout) :: row
         type(table_t), intent(in), optional :: before
      end subroutine run_point

      !> Take over the row of point number `point`, as words. An error ends the sweep on all ranks.
      subroutine collect_row(self, point, words, error)
         import :: collector_t, error_t, i8
         implicit none(type, external)
         class(collector_t), intent(inout) :: self
         integer(i8), intent(in) :: point, words(:)
         type(error_t), allocatable, intent(out) :: error
      end subroutine collect_row

      !> Write down what was collected; called after messages, every `settle_interval`, and at the end of the sweep.
      !> An error (a full disk) ends the sweep on all ranks.
      subroutine settle_rows(self, error)
         import :: collector_t, error_t
         implicit none(type, external)
         class(collector_t), intent(inout) :: self
         type(error_t), allocatable, intent(out) :: error
      end subroutine settle_rows
   end interface

end module razy_sweep_task
