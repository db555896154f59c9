!! A task for the tests of the scheduler, whose rows and costs vary from point to point, and one who collects its rows.
module sample_task
   use, intrinsic :: iso_fortran_env, only: int8
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_sweep_packet, only: unpack_row
   use razy_sweep_plan, only: new_plan
   use razy_sweep_task, only: collector_t, point_task
   use razy_sweep_units, only: units_t
   implicit none(type, external)
   private

   public :: new_units, sample_collector_t, sample_task_t

   type, extends(point_task) :: sample_task_t
      !> Mean number of operations of a point.
      integer(i8) :: operations = 1000
      !> A point that takes some thousand times as many; 0: none.
      integer(i8) :: slow = 0
      !> Reals in the longest row.
      integer(i8) :: longest = 10
   contains
      procedure :: describe
      procedure :: run
   end type sample_task_t

   type, extends(collector_t) :: sample_collector_t
      !> `collect` fails at this point; if it is negative, `settle` fails after so many. 0: nothing fails.
      integer(i8) :: fails_at = 0
      !> What `settle` saw last: rows collected; how often it was called.
      integer(i8) :: settled = 0
      integer :: settlings = 0
      !> What was collected (points): how often, link of its chain, sums over the bits of the rows, last real.
      integer(i8), allocatable :: times(:), link(:), sums(:)
      real(wp), allocatable :: last(:)
      type(table_t) :: row
   contains
      procedure :: begin
      procedure :: collect
      procedure :: settle
   end type sample_collector_t

contains

   !> The units of `n` points alone, or of `n` chains of so many links.
   subroutine new_units(units, n, links)
      type(units_t), intent(out) :: units
      integer(i8), intent(in) :: n, links

      logical :: whole

      if (links == 1) call new_plan(units%plan, n, 1_i8, [integer ::])
      if (links > 1) call new_plan(units%plan, links, n, [1])
      call units%plan%close(whole)
      if (.not. whole) error stop "a new plan has no gaps"
   end subroutine new_units

   subroutine describe(self, row)
      class(sample_task_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      call self%run(1_i8, row)
   end subroutine describe

   subroutine run(self, point, row, before)
      class(sample_task_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(table_t), intent(in), optional :: before
      integer(i8) :: i, link, mixed, n
      real(wp) :: x

      mixed = modulo(point*69069_i8 + 12345_i8, 1009_i8)
      x = 0.1_wp + 0.8_wp*real(mixed, wp)/1009
      do i = 1, self%operations*merge(5000_i8, 1 + mod(mixed, 10_i8), point == self%slow)/5
         x = 3.9_wp*x*(1.0_wp - x)
      end do
      link = 1
      if (present(before)) link = before%column(2)%integers(1) + 1
      n = 1 + mod(mixed, self%longest)
      call row%add("/point/number", point, "1", "number")
      call row%add("/point/link", link, "1", "link of a chain")
      call row%add("/list/x/small", [(int(mod(i, 100_i8) - 50, int8), i=1, n/2)], "1", "small numbers", "/list/x/small_number")
      call row%add("/list/x/values", [(x/i, i=1, n)], "1", "values", "/list/x/value")
   end subroutine run

   !> Make room for the rows of `n` points of a task.
   subroutine begin(self, task, n)
      class(sample_collector_t), intent(inout) :: self
      type(sample_task_t), intent(in) :: task
      integer(i8), intent(in) :: n

      type(sample_task_t) :: same

      if (allocated(self%times)) deallocate (self%times, self%link, self%sums, self%last)
      allocate (self%times(n), self%link(n), self%sums(n), source=0_i8)
      allocate (self%last(n), source=-1.0_wp)
      same = task
      self%row = table_t()
      call same%describe(self%row)
   end subroutine begin

   subroutine collect(self, point, words, error)
      class(sample_collector_t), intent(inout) :: self
      integer(i8), intent(in) :: point, words(:)
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: i
      logical :: fits

      if (point == self%fails_at) then
         call raise(error, "the disk is full")
         return
      end if
      call unpack_row(words, self%row, fits)
      if (.not. fits) then
         call raise(error, "a row has other columns")
         return
      else if (self%row%column(1)%integers(1) /= point) then
         call raise(error, "a row belongs to another point")
      end if
      self%times(point) = self%times(point) + 1
      self%link(point) = self%row%column(2)%integers(1)
      do i = 1, size(words, kind=i8)
         self%sums(point) = ieor(ishftc(self%sums(point), 1), words(i))
      end do
      associate (values => self%row%column(4)%reals)
         self%last(point) = values(size(values))
      end associate
   end subroutine collect

   !> Note how many rows had been collected, and that it was asked.
   subroutine settle(self, error)
      class(sample_collector_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      self%settled = sum(self%times)
      self%settlings = self%settlings + 1
      if (self%fails_at < 0 .and. self%settled >= -self%fails_at) call raise(error, "the disk is full")
   end subroutine settle

end module sample_task
