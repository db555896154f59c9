!! Start and end of MPI, its errors, and waiting for it.
!!
!! `src/sweep` is the only folder that knows MPI, and MPI_COMM_WORLD appears in drivers only: a driver calls `start_mpi`, hands
!! MPI_COMM_WORLD to `new_communicator` (razy_sweep_communicator) and ends with `finish_mpi`.
!!
!! Failures of MPI come back as `error`; the ranks are then no longer in step, and the driver can only call MPI_Abort.
module razy_sweep_mpi
   use mpi_f08, only: mpi_error_string, mpi_finalize, mpi_init_thread, mpi_max_error_string, mpi_request, mpi_status_ignore, &
      & mpi_success, mpi_test, mpi_thread_single
   use razy_core_error, only: error_t, raise
   use razy_sweep_clock, only: patience_t
   implicit none(type, external)
   private

   public :: check_mpi, complete, finish_mpi, start_mpi

contains

   !> Initialise MPI for one thread a rank.
   subroutine start_mpi(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: code, provided

      call mpi_init_thread(mpi_thread_single, provided, code)
      call check_mpi(code, "MPI_Init_thread", error)
   end subroutine start_mpi

   !> End MPI; all communicators are to be freed before.
   subroutine finish_mpi(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: code

      call mpi_finalize(code)
      call check_mpi(code, "MPI_Finalize", error)
   end subroutine finish_mpi

   !> Wait politely for the end of an operation.
   subroutine complete(request, error)
      type(mpi_request), intent(inout) :: request
      type(error_t), allocatable, intent(out) :: error
      type(patience_t) :: patience
      logical :: done
      integer :: code

      do
         call mpi_test(request, done, mpi_status_ignore, code)
         call check_mpi(code, "MPI_Test", error)
         if (allocated(error) .or. done) return
         call patience%pause()
      end do
   end subroutine complete

   !> Raise an error if the MPI procedure `name` returned another `code` than success.
   subroutine check_mpi(code, name, error)
      integer, intent(in) :: code
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      character(mpi_max_error_string) :: text
      integer :: length, ignored

      if (code == mpi_success) return
      text = "error of unknown kind"
      length = len_trim(text)
      call mpi_error_string(code, text, length, ignored)
      call raise(error, name//": "//text(:length))
   end subroutine check_mpi

end module razy_sweep_mpi
