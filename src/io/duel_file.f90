!! The result file of razy-duel: one motion by several methods, error against cost, a row for each method and setting.
module razy_io_duel_file
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_header, only: result_header_t, write_header
   implicit none(type, external)
   private

   public :: duel_content_t, write_duel_file

   !> The rows, and what they were compared with.
   type :: duel_content_t
      !> Integrator and treatment (rows); number of the &duel that a row belongs to, from 1.
      character(:), allocatable :: method(:), treatment(:)
      integer(int32), allocatable :: series(:), status(:)
      character(:), allocatable :: status_meanings(:)
      !> Tolerance, or step in s, and sharpness of smoothing (0: none) (rows).
      real(wp), allocatable :: setting(:), sharpness(:)
      logical, allocatable :: is_step(:)
      !> Error of displacements and velocities, relative as `relative_to` says; of the times of matched events, s;
      !> NaN where the motion ended early (rows).
      real(wp), allocatable :: error(:), velocity_error(:), event_time_error(:)
      !> Events, events missing (negative) or too many against the reference, leading events that match it (rows).
      integer(int64), allocatable :: events(:), event_surplus(:), events_matched(:)
      !> s, and counters (rows).
      real(wp), allocatable :: cpu_time(:)
      integer(int64), allocatable :: evaluations(:), steps(:), rejected(:), jacobians(:), doubts(:)
      !> What the rows were compared with, and the difference between it and its check, as `error` and `event_time_error`.
      character(:), allocatable :: reference, check
      real(wp) :: reference_error = 0.0_wp, reference_event_error = 0.0_wp
      integer(int64) :: reference_events = 0
   end type duel_content_t

   character(*), parameter :: row = "/row", single = "/reference/single"
   character(*), parameter :: relative_to = "largest value of the coordinate in the reference; if that is below 1e-9 "// &
                              "of the largest of all coordinates of its unit, that largest value"

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_duel_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(duel_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      type(hdf5_file_t) :: file

      call file%create(path, error)
      if (allocated(error)) return
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_reference(file, content, error)
      if (.not. allocated(error)) call write_settings(file, content, error)
      if (.not. allocated(error)) call write_errors(file, content, error)
      if (.not. allocated(error)) call write_costs(file, content, error)
      if (allocated(error)) then
         call file%discard()
      else
         call file%commit(overwrite, error)
      end if
   end subroutine write_duel_file

   subroutine write_reference(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(duel_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      call add_dimension(file, row, size(content%setting, kind=int64), "methods and settings, dimension only", error)
      if (.not. allocated(error)) call add_dimension(file, single, 1_int64, "one value, dimension only", error)
      if (.not. allocated(error)) call write_dataset(file, "/reference/error", [content%reference_error], "1", &
                                                     "difference of the displacements of the reference and its check", &
                                                     single, error)
      if (.not. allocated(error)) call write_attribute(file, "/reference/error", "reference", content%reference, error)
      if (.not. allocated(error)) call write_attribute(file, "/reference/error", "check", content%check, error)
      if (.not. allocated(error)) call write_dataset(file, "/reference/event_time_error", [content%reference_event_error], "s", &
                                                     "difference of their event times", single, error)
      if (.not. allocated(error)) call write_dataset(file, "/reference/events", [content%reference_events], "1", &
                                                     "events of the reference", single, error)
   end subroutine write_reference

   subroutine write_settings(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(duel_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      call write_dataset(file, "/method", content%method, "1", "integrator", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/treatment", content%treatment, "1", &
                                                     "treatment of jumps and kinks", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/series", content%series, "1", "number of the &duel group", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/setting", content%setting, "1", &
                                                     "relative tolerance, or step in s where setting_is_step", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/setting_is_step", merge(1_int32, 0_int32, content%is_step), "1", &
                                                     "1 where the setting is a step in s", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/sharpness", content%sharpness, "1", &
                                                     "sharpness of smoothing, per unit of the contact variable; 0: none", &
                                                     row, error)
      if (.not. allocated(error)) call write_dataset(file, "/status", content%status, "1", "how the motion ended", row, error)
      if (.not. allocated(error)) call write_attribute(file, "/status", "meanings", content%status_meanings, error)
   end subroutine write_settings

   subroutine write_errors(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(duel_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      call write_dataset(file, "/error", content%error, "1", &
                         "largest error of a displacement, relative to the largest of its coordinate", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/velocity_error", content%velocity_error, "1", &
                                                     "largest error of a velocity, relative likewise", row, error)
      if (.not. allocated(error)) call write_attribute(file, "/error", "relative_to", relative_to, error)
      if (.not. allocated(error)) call write_attribute(file, "/velocity_error", "relative_to", relative_to, error)
      if (.not. allocated(error)) call write_dataset(file, "/event_time_error", content%event_time_error, "s", &
                                                     "largest error of the times of matched events", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/events", content%events, "1", "events", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/event_surplus", content%event_surplus, "1", &
                                                     "events more than the reference has", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/events_matched", content%events_matched, "1", &
                                                     "leading events of the same contact and branch as the reference's", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/doubts", content%doubts, "1", &
                                                     "events in doubt: missed or none, for all that the method knows", row, error)
   end subroutine write_errors

   subroutine write_costs(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(duel_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      call write_dataset(file, "/cpu_time", content%cpu_time, "s", "processor time, least of several runs", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/rhs_evaluations", content%evaluations, "1", &
                                                     "right-hand sides", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/steps", content%steps, "1", "steps accepted", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/rejected", content%rejected, "1", "steps rejected", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/jacobians", content%jacobians, "1", "Jacobian matrices", row, error)
   end subroutine write_costs

end module razy_io_duel_file
