!! Writes sample result files into the current folder, for the tests that read them from Python.
program write_samples
   use io_samples, only: sample_empty_run, sample_header, sample_run, sample_sweep, sample_tune, sample_two_axes
   use razy_core_error, only: error_t
   use razy_io_header, only: result_header_t
   use razy_io_run_file, only: run_content_t, write_run_file
   use razy_io_sweep_file, only: write_sweep_file
   use razy_io_tune_file, only: write_tune_file
   implicit none(type, external)

   type(run_content_t) :: extrema_only, run
   type(result_header_t) :: bare_header
   type(error_t), allocatable :: error

   call write_sweep_file("sample_sweep.h5", sample_header("razy-sweep"), sample_sweep(), .true., error)
   call finish(error)
   call write_sweep_file("sample_two_axes.h5", sample_header("razy-sweep"), sample_two_axes(), .true., error)
   call finish(error)
   call write_run_file("sample_run.h5", sample_header("razy-run"), sample_run(), .true., error)
   call finish(error)
   call write_run_file("sample_empty_run.h5", sample_header("razy-run"), sample_empty_run(), .true., error)
   call finish(error)
   call write_tune_file("sample_tune.h5", sample_header("razy-tune"), sample_tune(), .true., error)
   call finish(error)
   extrema_only = sample_run()
   run = run_content_t(extrema=extrema_only%extrema)
   call write_run_file("sample_extrema_only.h5", bare_header, run, .true., error)
   call finish(error)

contains

   !> End the program where a file could not be written.
   subroutine finish(failure)
      type(error_t), allocatable, intent(in) :: failure

      if (allocated(failure)) error stop failure%message
   end subroutine finish

end program write_samples
