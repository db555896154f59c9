!! Writes sample result files into the current folder, for the tests that read them from Python.
program write_samples
   use io_samples, only: sample_extrema, sample_header, sample_run, sample_tune, write_sample_sweep
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_io_result_file, only: new_header, write_result
   implicit none(type, external)

   type(table_t) :: extrema
   type(error_t), allocatable :: error

   call write_sample_sweep("sample_sweep.h5", .true., error)
   call finish(error)
   call write_result("sample_run.h5", sample_header("razy-run"), sample_run(4), .true., error)
   call finish(error)
   call write_result("sample_empty_run.h5", sample_header("razy-run"), sample_run(0), .true., error)
   call finish(error)
   call write_result("sample_tune.h5", sample_header("razy-tune"), sample_tune(), .true., error)
   call finish(error)
   call sample_extrema(extrema, [0.3_wp, 0.1_wp, 0.2_wp])
   call write_result("sample_extrema_only.h5", new_header("", "", "", "", ""), extrema, .true., error)
   call finish(error)

contains

   !> End the program where a file could not be written.
   subroutine finish(failure)
      type(error_t), allocatable, intent(in) :: failure

      if (allocated(failure)) error stop failure%message
   end subroutine finish

end program write_samples
