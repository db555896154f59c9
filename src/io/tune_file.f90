!! The result file of razy-tune: objective and natural frequencies over the parameter, and the tuned value.
module razy_io_tune_file
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_header, only: result_header_t, write_header
   implicit none(type, external)
   private

   public :: tune_content_t, write_tune_file

   !> The results; all are needed.
   type :: tune_content_t
      !> The parameter as the namelist has it, such as `spring(1)%stiffness`, and its units.
      character(:), allocatable :: name, units
      !> What the mode is, in words, such as `the mode that is mostly table`.
      character(:), allocatable :: mode
      !> Values over the range, ascending (points).
      real(wp), allocatable :: parameter(:)
      !> (1 - f/goal)², natural frequency f in Hz and place in ascending order of the mode that is tuned (points).
      real(wp), allocatable :: objective(:), tuned(:)
      integer(int32), allocatable :: place(:)
      !> Natural frequencies, each followed by its shape, in Hz (modes, points).
      real(wp), allocatable :: frequency(:, :)
      !> All natural frequencies with the value of the input and with the tuned one, ascending, Hz (coordinates).
      real(wp), allocatable :: frequency_before(:), frequency_after(:)
      !> The goal in Hz, the value of the input, the tuned value, and the share of the coordinate in the mode with it.
      real(wp) :: goal = 0.0_wp, reference = 0.0_wp, optimum = 0.0_wp, share = 0.0_wp
   end type tune_content_t

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_tune_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(tune_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file

      call check_content(content, error)
      if (allocated(error)) return
      call file%create(path, error)
      if (allocated(error)) return
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_curves(file, content, error)
      if (.not. allocated(error)) call write_answer(file, content, error)
      if (allocated(error)) then
         call file%discard()
      else
         call file%commit(overwrite, error)
      end if
   end subroutine write_tune_file

   !> Refuse arrays that do not belong together.
   pure subroutine check_content(content, error)
      type(tune_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      if (.not. (allocated(content%name) .and. allocated(content%units) .and. allocated(content%mode) .and. &
                 allocated(content%parameter) .and. allocated(content%objective) .and. allocated(content%tuned) .and. &
                 allocated(content%place) .and. allocated(content%frequency) .and. &
                 allocated(content%frequency_before) .and. allocated(content%frequency_after))) then
         call raise(error, "tuning result: a part is missing")
      else if (any([size(content%objective), size(content%tuned), size(content%place), size(content%frequency, 2)] &
                   /= size(content%parameter))) then
         call raise(error, "tuning result: the curves differ in length from the values of the parameter")
      else if (size(content%frequency_before) /= size(content%frequency_after)) then
         call raise(error, "tuning result: frequencies before and after differ in number")
      end if
   end subroutine check_content

   !> What depends on the parameter.
   subroutine write_curves(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(tune_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      integer(int32) :: i

      call write_dataset(file, "/parameter", content%parameter, content%units, content%name, "/parameter", error)
      if (.not. allocated(error)) call write_dataset(file, "/objective", content%objective, "1", &
                                                     "(1 - f/goal)^2 of "//content%mode, "/parameter", error)
      if (.not. allocated(error)) call write_dataset(file, "/tuned_frequency", content%tuned, "Hz", &
                                                     "natural frequency of "//content%mode, "/parameter", error)
      if (.not. allocated(error)) call write_dataset(file, "/tuned_place", content%place, "1", &
                                                     "place in ascending order of "//content%mode, "/parameter", error)
      if (.not. allocated(error)) call write_dataset(file, "/mode", [(i, i=1, size(content%frequency, 1))], "1", &
                                                     "number of the mode before tuning", "/mode", error)
      if (.not. allocated(error)) call write_dataset(file, "/frequency", content%frequency, "Hz", &
                                                     "natural frequency, each mode followed by its shape", &
                                                     [character(10) :: "/mode", "/parameter"], error)
   end subroutine write_curves

   !> The tuned value and what it brings.
   subroutine write_answer(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(tune_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: order = "/order"

      call add_dimension(file, order, size(content%frequency_before, kind=int64), &
                         "natural frequencies in ascending order, dimension only", error)
      if (.not. allocated(error)) call write_dataset(file, "/frequency_before", content%frequency_before, "Hz", &
                                                     "natural frequency with the value of the input", order, error)
      if (.not. allocated(error)) call write_dataset(file, "/frequency_after", content%frequency_after, "Hz", &
                                                     "natural frequency with the tuned value", order, error)
      if (.not. allocated(error)) call write_dataset(file, "/goal", content%goal, "Hz", &
                                                     "natural frequency asked for, of "//content%mode, error)
      if (.not. allocated(error)) call write_dataset(file, "/reference", content%reference, content%units, &
                                                     content%name//" of the input", error)
      if (.not. allocated(error)) call write_dataset(file, "/optimum", content%optimum, content%units, &
                                                     content%name//", tuned", error)
      if (.not. allocated(error)) call write_dataset(file, "/share", content%share, "1", &
                                                     "share of the coordinate in the tuned mode", error)
      if (.not. allocated(error)) call write_attribute(file, "/optimum", "mode", content%mode, error)
   end subroutine write_answer

end module razy_io_tune_file
