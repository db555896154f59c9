!! The result file of razy-modes: natural frequencies and shapes, and for rotors eigenvalues over the speed.
module razy_io_modes_file
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_header, only: result_header_t, write_header
   use razy_io_modes_reduction, only: reduction_content_t, write_reduction
   implicit none(type, external)
   private

   public :: modes_content_t, write_modes_file

   !> The results; what is not allocated is not written.
   type :: modes_content_t
      !> Names of the coordinates (coordinates), undamped shapes at rest (coordinates, modes), their frequencies, Hz (modes).
      character(64), allocatable :: coordinate(:)
      real(wp), allocatable :: shape(:, :), natural(:)
      !> Parts and their shares of the kinetic energy (parts, modes), of the strain energy likewise.
      character(64), allocatable :: part(:), strain_part(:)
      real(wp), allocatable :: share(:, :), strain_share(:, :)
      !> Names of shafts and their shares of the kinetic energy (shafts, modes).
      character(64), allocatable :: shaft(:)
      real(wp), allocatable :: shaft_share(:, :)
      !> Reduced models beside the unreduced one.
      type(reduction_content_t), allocatable :: reduction
      !> Names of gear meshes and their deformation in the shapes (meshes, modes).
      character(64), allocatable :: mesh(:)
      real(wp), allocatable :: deformation(:, :)
      !> Speeds, rad/s; frequencies, Hz (modes, speeds).
      real(wp), allocatable :: speed(:), frequency(:, :)
      !> Real and imaginary parts (2, eigenvalues, speeds), 1/s and rad/s. As many eigenvalues as modes with `branch`.
      real(wp), allocatable :: eigenvalue(:, :, :)
      !> Number of the branch, direction of whirl (modes, speeds).
      real(wp), allocatable :: branch(:, :), direction(:, :)
      !> Critical speeds, rad/s, their excitation orders, frequencies, Hz, directions of whirl, branches (criticals).
      real(wp), allocatable :: critical(:), critical_order(:), critical_frequency(:), critical_direction(:), critical_branch(:)
      !> Crossings that were seen but not located.
      integer(int32) :: lost = 0
      !> The stability limit, rad/s, NaN if there is none; what it is, in words.
      real(wp), allocatable :: limit
      character(:), allocatable :: limit_words
   end type modes_content_t

   character(*), parameter :: mode = "/mode", speed = "/speed"

contains

   !> Write the whole file under a temporary name, then give it its own.
   subroutine write_modes_file(path, header, content, overwrite, error)
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      type(modes_content_t), intent(in) :: content
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      type(hdf5_file_t) :: file

      if (.not. (allocated(content%coordinate) .and. allocated(content%shape) .and. allocated(content%natural) .and. &
                 allocated(content%part) .and. allocated(content%share) .and. allocated(content%speed) .and. &
                 allocated(content%frequency))) then
         call raise(error, "result of razy-modes: a part is missing")
         return
      end if
      call file%create(path, error)
      if (allocated(error)) return
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_rest(file, content, error)
      if (.not. allocated(error) .and. (allocated(content%eigenvalue) .or. allocated(content%reduction))) then
         call add_dimension(file, "/complex", 2_int64, "real and imaginary part, dimension only", error)
      end if
      if (.not. allocated(error)) call write_speeds(file, content, error)
      if (.not. allocated(error) .and. allocated(content%reduction)) call write_reduction(file, content%reduction, error)
      if (.not. allocated(error) .and. allocated(content%critical)) call write_critical(file, content, error)
      if (allocated(error)) then
         call file%discard()
      else
         call file%commit(overwrite, error)
      end if
   end subroutine write_modes_file

   !> Undamped modes at rest.
   subroutine write_rest(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(modes_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      integer(int32) :: i

      call write_dataset(file, mode, [(i, i=1, size(content%natural))], "1", "number of the mode", mode, error)
      if (.not. allocated(error)) call write_dataset(file, "/coordinate", content%coordinate, "1", "name of the coordinate", &
                                                     "/coordinate", error)
      if (.not. allocated(error)) call write_dataset(file, "/natural_frequency", content%natural, "Hz", &
                                                     "undamped natural frequency at rest", mode, error)
      if (.not. allocated(error)) call write_dataset(file, "/shape", content%shape, "1", &
                                                     "undamped mode at rest, mass-normalised", &
                                                     [character(11) :: "/coordinate", mode], error)
      if (.not. allocated(error)) call write_dataset(file, "/part", content%part, "1", "what a share belongs to", "/part", error)
      if (.not. allocated(error)) call write_dataset(file, "/energy_share", content%share, "1", &
                                                     "share of the kinetic energy of an undamped mode at rest", &
                                                     [character(5) :: "/part", mode], error)
      if (allocated(error) .or. .not. allocated(content%strain_share)) return
      call write_dataset(file, "/strain_part", content%strain_part, "1", "what a share of strain energy belongs to", &
                         "/strain_part", error)
      if (.not. allocated(error)) call write_dataset(file, "/strain_share", content%strain_share, "1", &
                                                     "share of the strain energy of an undamped mode at rest", &
                                                     [character(12) :: "/strain_part", mode], error)
      if (.not. allocated(error)) call write_dataset(file, "/mesh", content%mesh, "1", "name of the gear mesh", "/mesh", error)
      if (.not. allocated(error)) call write_dataset(file, "/mesh_deformation", content%deformation, "1", &
                                                     "deformation of a mesh in an undamped mode at rest", &
                                                     [character(5) :: "/mesh", mode], error)
      if (.not. allocated(error)) call write_dataset(file, "/shaft", content%shaft, "1", "name of the shaft", "/shaft", error)
      if (.not. allocated(error)) call write_dataset(file, "/shaft_share", content%shaft_share, "1", &
                                                     "share of a shaft in the kinetic energy of an undamped mode at rest", &
                                                     [character(6) :: "/shaft", mode], error)
   end subroutine write_rest

   !> What depends on the speed.
   subroutine write_speeds(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(modes_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: table(2) = [character(6) :: mode, speed]
      character(11) :: rows

      call write_dataset(file, speed, content%speed, "rad/s", "angular speed of the shaft of &rotation", speed, error)
      if (.not. allocated(error)) call write_dataset(file, "/frequency", content%frequency, "Hz", &
                                                     "frequency in ascending order", table, error)
      if (allocated(error) .or. .not. allocated(content%eigenvalue)) return
      rows = mode
      if (.not. allocated(content%branch)) then
         rows = "/root"
         if (.not. allocated(error)) call add_dimension(file, trim(rows), size(content%eigenvalue, 2, int64), &
                                                        "eigenvalues, dimension only", error)
      end if
      if (.not. allocated(error)) call write_dataset(file, "/eigenvalue", content%eigenvalue, "1/s", &
                                                     "eigenvalue, imaginary part ascending", &
                                                     [character(11) :: "/complex", rows, speed], error)
      if (allocated(error) .or. .not. allocated(content%branch)) return
      call write_dataset(file, "/branch", content%branch, "1", "branch that an eigenvalue belongs to, followed by its shape", &
                         table, error)
      if (.not. allocated(error)) call write_dataset(file, "/direction", content%direction, "1", &
                                                     "direction of whirl: +1 forward, -1 backward", table, error)
   end subroutine write_speeds

   subroutine write_critical(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(modes_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: row = "/critical"

      call add_dimension(file, row, size(content%critical, kind=int64), "critical speeds, dimension only", error)
      if (.not. allocated(error)) call write_dataset(file, "/critical_speed", content%critical, "rad/s", &
                                                     "critical speed", row, error)
      if (.not. allocated(error)) call write_attribute(file, "/critical_speed", "not_located", [content%lost], error)
      if (.not. allocated(error)) call write_dataset(file, "/critical_order", content%critical_order, "1", &
                                                     "excitation frequency over that of rotation", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/critical_frequency", content%critical_frequency, "Hz", &
                                                     "frequency at the critical speed", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/critical_direction", content%critical_direction, "1", &
                                                     "direction of whirl: +1 forward, -1 backward", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/critical_branch", content%critical_branch, "1", &
                                                     "branch at the critical speed", row, error)
      if (.not. allocated(error)) call write_dataset(file, "/stability_limit", content%limit, "rad/s", &
                                                     "speed above which motion grows", error)
      if (.not. allocated(error)) call write_attribute(file, "/stability_limit", "meaning", content%limit_words, error)
   end subroutine write_critical

end module razy_io_modes_file
