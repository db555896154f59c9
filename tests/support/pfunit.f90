!! MPI half of the stand-in for pFUnit: a test runs on a communicator of the first npes ranks, the others wait for its outcome.
!! As the real one it hands on all of module mpi.
module pfunit
   use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use mpi
   use funit
   implicit none(type, external)

   !> A fixture of tests that run on several ranks.
   type, extends(TestCase) :: MpiTestCase
      integer, private :: communicator = MPI_COMM_NULL
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

      getMpiCommunicator = this%communicator
   end function getMpiCommunicator

   !> Rank in the test's communicator, from 0.
   integer function getProcessRank(this)
      class(MpiTestCase), intent(in) :: this
      integer :: status

      call MPI_Comm_rank(this%communicator, getProcessRank, status)
   end function getProcessRank

   !> Number of ranks of the test's communicator.
   integer function getNumProcesses(this)
      class(MpiTestCase), intent(in) :: this
      integer :: status

      call MPI_Comm_size(this%communicator, getNumProcesses, status)
   end function getNumProcesses

   !> Start a test on the first npes ranks; `active` tells whether this is one of them. Too few ranks are a failure of the test.
   subroutine begin_mpi_test(this, name, npes, location, active)
      class(MpiTestCase), intent(inout) :: this
      character(*), intent(in) :: name
      integer, intent(in) :: npes
      type(SourceLocation), intent(in) :: location
      logical, intent(out) :: active
      character(16) :: suffix, process
      integer :: rank, ranks, status

      call MPI_Comm_rank(MPI_COMM_WORLD, rank, status)
      call MPI_Comm_size(MPI_COMM_WORLD, ranks, status)
      write (suffix, "(a, i0, a)") "[npes=", npes, "]"
      write (process, "(a, i0, a)") " (PE=", rank, ")"
      call begin_test(name//trim(suffix), trim(process))
      active = rank < npes .and. npes <= ranks
      call MPI_Comm_split(MPI_COMM_WORLD, merge(0, MPI_UNDEFINED, active), rank, this%communicator, status)
      if (npes > ranks .and. rank == 0) call assert_never("Insufficient processes to run this test.", location)
   end subroutine begin_mpi_test

   !> End a test begun by `begin_mpi_test`: it has failed if it failed on any rank.
   subroutine end_mpi_test(this)
      class(MpiTestCase), intent(inout) :: this
      integer :: status

      if (this%communicator /= MPI_COMM_NULL) call MPI_Comm_free(this%communicator, status)
      call end_shared_test()
   end subroutine end_mpi_test

   !> End a test that every rank ran by itself.
   subroutine end_shared_test()
      logical :: failed
      integer :: status

      call MPI_Allreduce(anyExceptions(), failed, 1, MPI_LOGICAL, MPI_LOR, MPI_COMM_WORLD, status)
      call end_test(failed)
   end subroutine end_shared_test

   !> Start MPI, whose libraries may raise what the tests stop at (Open MPI 5 of Debian 13 does).
   subroutine begin_mpi()
      logical :: halts(size(ieee_usual))
      integer :: status

      call ieee_get_halting_mode(ieee_usual, halts)
      call ieee_set_halting_mode(ieee_usual, .false.)
      call MPI_Init(status)
      call ieee_set_flag(ieee_usual, .false.)
      call ieee_set_halting_mode(ieee_usual, halts)
   end subroutine begin_mpi

   !> Print the closing lines on the first rank and end MPI.
   subroutine end_mpi()
      integer :: rank, status

      call MPI_Comm_rank(MPI_COMM_WORLD, rank, status)
      if (rank == 0) call print_summary()
      call MPI_Finalize(status)
   end subroutine end_mpi

end module pfunit
