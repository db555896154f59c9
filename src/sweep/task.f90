!! What a sweep does at one of its points, and what comes out.
!!
!! A concrete task extends `point_task`. Every rank has its own copy: `run` is called on whichever rank has the point and works in
!! the task's own workspace; `collect` is called on rank 0 only, once for each point, in any order. What the numbers of a result
!! mean is between these two. A "point" of the sweep is the unit that is handed out: a grid point, the next unfinished one of a
!! list, or a chain of grid points; the task knows which. A chain yields a result for each of its grid points: while `continues`
!! is true in a result, `run` is called again with the same number on the same rank, and nothing else between.
module razy_sweep_task
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   implicit none(type, external)
   private

   public :: point_task, point_result_t

   !> Numbers that one point yields. The arrays are buffers that are used again from point to point: only their first
   !> `n_integers` and `n_reals` elements are valid.
   type :: point_result_t
      integer(i8), allocatable :: integers(:)
      real(wp), allocatable :: reals(:)
      integer(i8) :: n_integers = 0, n_reals = 0
      !> The point has more to yield.
      logical :: continues = .false.
   contains
      procedure :: clear
      procedure :: reserve
      procedure, private :: append_integer, append_integers, append_real, append_reals
      !> Append a scalar or a vector of integers (i8) or reals (wp).
      generic :: append => append_integer, append_integers, append_real, append_reals
   end type point_result_t

   !> The work at a point.
   type, abstract :: point_task
   contains
      procedure(run_point), deferred :: run
      procedure(collect_point), deferred :: collect
      procedure(settle_results), deferred :: settle
   end type point_task

   abstract interface
      !> Compute point number `point`, from 1, or the next part of it; `result` comes empty. Must depend on nothing but `point` and
      !> the parts of it before: not on other points, not on the rank. A failure of the numerics is a status among the integers.
      subroutine run_point(self, point, result)
         import :: i8, point_result_t, point_task
         implicit none(type, external)
         class(point_task), intent(inout) :: self
         integer(i8), intent(in) :: point
         type(point_result_t), intent(inout) :: result
      end subroutine run_point

      !> Take over a result of point number `point` on rank 0. An error ends the sweep on all ranks.
      subroutine collect_point(self, point, result, error)
         import :: error_t, i8, point_result_t, point_task
         implicit none(type, external)
         class(point_task), intent(inout) :: self
         integer(i8), intent(in) :: point
         type(point_result_t), intent(in) :: result
         type(error_t), allocatable, intent(out) :: error
      end subroutine collect_point

      !> Write down what was collected; called on rank 0 whenever nothing else waits to be collected, and at the end of the sweep.
      !> An error (a full disk) ends the sweep on all ranks.
      subroutine settle_results(self, error)
         import :: error_t, point_task
         implicit none(type, external)
         class(point_task), intent(inout) :: self
         type(error_t), allocatable, intent(out) :: error
      end subroutine settle_results
   end interface

contains

   !> Empty the result; the buffers stay.
   elemental subroutine clear(self)
      class(point_result_t), intent(inout) :: self

      self%n_integers = 0
      self%n_reals = 0
      self%continues = .false.
   end subroutine clear

   !> Make room for so many more integers and reals.
   pure subroutine reserve(self, integers, reals)
      class(point_result_t), intent(inout) :: self
      integer(i8), intent(in) :: integers, reals
      integer(i8), allocatable :: more_integers(:)
      real(wp), allocatable :: more_reals(:)

      if (.not. allocated(self%integers)) allocate (self%integers(0))
      if (.not. allocated(self%reals)) allocate (self%reals(0))
      if (self%n_integers + integers > size(self%integers, kind=i8)) then
         allocate (more_integers(max(self%n_integers + integers, 2*self%n_integers, 16_i8)))
         more_integers(:self%n_integers) = self%integers(:self%n_integers)
         call move_alloc(more_integers, self%integers)
      end if
      if (self%n_reals + reals > size(self%reals, kind=i8)) then
         allocate (more_reals(max(self%n_reals + reals, 2*self%n_reals, 16_i8)))
         more_reals(:self%n_reals) = self%reals(:self%n_reals)
         call move_alloc(more_reals, self%reals)
      end if
   end subroutine reserve

   !> Append one integer.
   pure subroutine append_integer(self, value)
      class(point_result_t), intent(inout) :: self
      integer(i8), intent(in) :: value

      call self%reserve(1_i8, 0_i8)
      self%n_integers = self%n_integers + 1
      self%integers(self%n_integers) = value
   end subroutine append_integer

   !> Append integers.
   pure subroutine append_integers(self, values)
      class(point_result_t), intent(inout) :: self
      integer(i8), intent(in) :: values(:)

      call self%reserve(size(values, kind=i8), 0_i8)
      self%integers(self%n_integers + 1:self%n_integers + size(values)) = values
      self%n_integers = self%n_integers + size(values)
   end subroutine append_integers

   !> Append one real.
   pure subroutine append_real(self, value)
      class(point_result_t), intent(inout) :: self
      real(wp), intent(in) :: value

      call self%reserve(0_i8, 1_i8)
      self%n_reals = self%n_reals + 1
      self%reals(self%n_reals) = value
   end subroutine append_real

   !> Append reals.
   pure subroutine append_reals(self, values)
      class(point_result_t), intent(inout) :: self
      real(wp), intent(in) :: values(:)

      call self%reserve(0_i8, size(values, kind=i8))
      self%reals(self%n_reals + 1:self%n_reals + size(values)) = values
      self%n_reals = self%n_reals + size(values)
   end subroutine append_reals

end module razy_sweep_task
