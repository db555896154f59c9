!! MPI half of the stand-in for pFUnit: a test runs on a communicator of the first npes ranks, the others wait for its outcome.
module pfunit
   use mpi_f08, only: MPI_Allreduce, MPI_COMM_NULL, MPI_COMM_WORLD, MPI_Comm, MPI_Comm_free, MPI_Comm_rank, MPI_Comm_size, &
      & MPI_Comm_split, MPI_Finalize, MPI_Init, MPI_LOGICAL, MPI_LOR, MPI_UNDEFINED, operator(/=)
   use funit, only: SourceLocation, TestCase, anyExceptions, assert_close, assert_condition, assert_finite, assert_nan, &
      & assert_never, assert_order, begin_test, end_test, has_failed, pf_values, print_summary, skip_test
   implicit none(type, external)
   private

   public :: MpiTestCase, MpiTestMethod, begin_mpi, begin_mpi_test, end_mpi, end_mpi_test, end_shared_test
   public :: SourceLocation, TestCase, anyExceptions, assert_close, assert_condition, assert_finite, assert_nan
   public :: assert_never, assert_order, begin_test, end_test, has_failed, pf_values, print_summary, skip_test

   !> A fixture of tests that run on several ranks.
   type, extends(TestCase) :: MpiTestCase
      type(MPI_Comm), private :: communicator
   contains
      procedure :: getMpiCommunicator
      procedure :: getProcessRank
      procedure :: getNumProcesses
   end type MpiTestCase

   !> What a test without a fixture is given.
   type, extends(MpiTestCase) :: MpiTestMethod
   end type MpiTestMethod

contains

   !> Handle of the test's communicator, as an integer.
   integer function getMpiCommunicator(this)
      class(MpiTestCase), intent(in) :: this

      getMpiCommunicator = this%communicator%mpi_val
   end function getMpiCommunicator

   !> Rank in the test's communicator, from 0.
   integer function getProcessRank(this)
      class(MpiTestCase), intent(in) :: this

      call MPI_Comm_rank(this%communicator, getProcessRank)
   end function getProcessRank

   !> Number of ranks of the test's communicator.
   integer function getNumProcesses(this)
      class(MpiTestCase), intent(in) :: this

      call MPI_Comm_size(this%communicator, getNumProcesses)
   end function getNumProcesses

   !> Start a test on the first npes ranks; `active` tells whether this is one of them. Too few ranks are a failure of the test.
   subroutine begin_mpi_test(this, name, npes, location, active)
      class(MpiTestCase), intent(inout) :: this
      character(*), intent(in) :: name
      integer, intent(in) :: npes
      type(SourceLocation), intent(in) :: location
      logical, intent(out) :: active
      character(16) :: suffix, process
      integer :: rank, ranks

      call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      call MPI_Comm_size(MPI_COMM_WORLD, ranks)
      write (suffix, "(a, i0, a)") "[npes=", npes, "]"
      write (process, "(a, i0, a)") " (PE=", rank, ")"
      call begin_test(name//trim(suffix), trim(process))
      active = rank < npes .and. npes <= ranks
      call MPI_Comm_split(MPI_COMM_WORLD, merge(0, MPI_UNDEFINED, active), rank, this%communicator)
      if (npes > ranks .and. rank == 0) call assert_never("Insufficient processes to run this test.", location)
   end subroutine begin_mpi_test

   !> End a test begun by `begin_mpi_test`: it has failed if it failed on any rank.
   subroutine end_mpi_test(this)
      class(MpiTestCase), intent(inout) :: this

      if (this%communicator /= MPI_COMM_NULL) call MPI_Comm_free(this%communicator)
      call end_shared_test()
   end subroutine end_mpi_test

   !> End a test that every rank ran by itself.
   subroutine end_shared_test()
      logical :: failed

      call MPI_Allreduce(anyExceptions(), failed, 1, MPI_LOGICAL, MPI_LOR, MPI_COMM_WORLD)
      call end_test(failed)
   end subroutine end_shared_test

   !> Start MPI.
   subroutine begin_mpi()
      call MPI_Init()
   end subroutine begin_mpi

   !> Print the closing lines on the first rank and end MPI.
   subroutine end_mpi()
      integer :: rank

      call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      if (rank == 0) call print_summary()
      call MPI_Finalize()
   end subroutine end_mpi

end module pfunit
