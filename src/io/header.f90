!! What every result file says: in its root group, which program of which version made it, from which input; and the
!! geometry of the machine where it has one.
module razy_io_header
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_core_version, only: razy_git_commit, razy_version
   use razy_io_drawing, only: write_drawing
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_file, only: hdf5_file_t
   implicit none(type, external)
   private

   public :: result_header_t, write_header

   !> A component that is not allocated is written as an empty string.
   type :: result_header_t
      !> Name of the program, such as `razy-sweep`.
      character(:), allocatable :: program
      !> Title of the scene.
      character(:), allocatable :: title
      !> Method of integration.
      character(:), allocatable :: integrator
      !> What is done about jumps and kinks of contact laws.
      character(:), allocatable :: treatment
      !> The effective input, of any length.
      character(:), allocatable :: input
      !> Not allocated for a machine without geometry.
      type(drawing_t), allocatable :: drawing
   end type result_header_t

contains

   !> Write the attributes of the root group, and the group of the geometry.
   subroutine write_header(file, header, error)
      type(hdf5_file_t), intent(in) :: file
      type(result_header_t), intent(in) :: header
      type(error_t), allocatable, intent(out) :: error

      call write_attribute(file, "/", "razy_version", razy_version, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "git_commit", razy_git_commit, error)
      if (.not. allocated(error)) call write_attribute(file, "/", "program", text(header%program), error)
      if (.not. allocated(error)) call write_attribute(file, "/", "title", text(header%title), error)
      if (.not. allocated(error)) call write_attribute(file, "/", "integrator", text(header%integrator), error)
      if (.not. allocated(error)) call write_attribute(file, "/", "treatment", text(header%treatment), error)
      if (.not. allocated(error)) call write_attribute(file, "/", "input", text(header%input), error)
      if (allocated(error) .or. .not. allocated(header%drawing)) return
      call write_drawing(file, header%drawing, error)
   end subroutine write_header

   !> The string, empty if it is not allocated.
   pure function text(string)
      character(:), allocatable, intent(in) :: string
      character(:), allocatable :: text

      text = ""
      if (allocated(string)) text = string
   end function text

end module razy_io_header
