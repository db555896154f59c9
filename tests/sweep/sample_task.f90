!! A task for the tests of the scheduler: results and costs vary from point to point.
module sample_task
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_sweep_task, only: point_result_t, point_task
   implicit none(type, external)
   private

   public :: sample_task_t

   type, extends(point_task) :: sample_task_t
      !> Mean number of operations of a point.
      integer(i8) :: operations = 1000
      !> Reals in the longest result.
      integer(i8) :: longest = 10
      !> `collect` fails at this point; if it is negative, `settle` fails after so many. 0: nothing fails.
      integer(i8) :: fails_at = 0
      !> Each point yields so many results, one after the other.
      integer :: parts = 1
      !> The part that comes next.
      integer :: part = 1
      !> What `settle` saw last: results collected.
      integer(i8) :: settled = 0
      !> What was collected (points): how often, sums over the bits of the results, last real.
      integer(i8), allocatable :: times(:), sums(:)
      real(wp), allocatable :: last(:)
   contains
      procedure :: run
      procedure :: collect
      procedure :: settle
      procedure :: begin
   end type sample_task_t

contains

   !> Make room for the results of `n` points.
   subroutine begin(self, n)
      class(sample_task_t), intent(inout) :: self
      integer(i8), intent(in) :: n

      if (allocated(self%times)) deallocate (self%times, self%sums, self%last)
      allocate (self%times(n), self%sums(n), source=0_i8)
      allocate (self%last(n), source=-1.0_wp)
   end subroutine begin

   subroutine run(self, point, result)
      class(sample_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(inout) :: result
      integer(i8) :: i, mixed
      real(wp) :: x

      mixed = modulo(point*69069_i8 + 12345_i8, 1009_i8)
      x = 0.1_wp + 0.8_wp*real(mixed, wp)/1009
      do i = 1, self%operations*(1 + mod(mixed, 10_i8))/5
         x = 3.9_wp*x*(1.0_wp - x)
      end do
      x = x/self%part
      call result%append([point, int(self%part, i8)])
      result%continues = self%part < self%parts
      self%part = merge(self%part + 1, 1, result%continues)
      do i = 1, 1 + mod(mixed, self%longest)
         call result%append(x/i)
      end do
   end subroutine run

   subroutine collect(self, point, result, error)
      class(sample_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(point_result_t), intent(in) :: result
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: i

      if (point == self%fails_at) then
         call raise(error, "the disk is full")
         return
      end if
      if (result%integers(1) /= point .or. result%integers(2) /= 1 + mod(self%times(point), int(self%parts, i8))) then
         call raise(error, "a result belongs to another point")
      end if
      self%times(point) = self%times(point) + 1
      do i = 1, result%n_reals
         self%sums(point) = ieor(ishftc(self%sums(point), 1), transfer(result%reals(i), 0_i8))
      end do
      self%last(point) = result%reals(result%n_reals)
   end subroutine collect

   !> Note how many points had been collected.
   subroutine settle(self, error)
      class(sample_task_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      self%settled = sum(self%times)
      if (self%fails_at < 0 .and. self%settled >= -self%fails_at) call raise(error, "the disk is full")
   end subroutine settle

end module sample_task
