!! Reduced rotor models beside the unreduced one, in the file of razy-modes.
module razy_io_modes_reduction
   use, intrinsic :: iso_fortran_env, only: int32, int64
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_hdf5_dataset, only: add_dimension, write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   implicit none(type, external)
   private

   public :: reduction_content_t, write_reduction

   !> The comparison of several kinds of reduction; NaN where a model has no such number.
   type :: reduction_content_t
      !> What each kind is called, and its number of coordinates (kinds).
      character(64), allocatable :: name(:)
      integer(int32), allocatable :: coordinates(:)
      !> Static compliance of each mesh, m/N (meshes, kinds), and of the unreduced model (meshes).
      real(wp), allocatable :: compliance(:, :), true_compliance(:)
      !> Natural frequencies of the unreduced model with meshes closed, Hz (modes); whether these modes move a mesh (1 or 0); the
      !> nearest frequency that each kind has (modes, kinds).
      real(wp), allocatable :: frequency(:, :), true_frequency(:)
      integer(int32), allocatable :: moves(:)
      !> Frequencies, Hz; real and imaginary part of the transfer function at each mesh (2, frequencies, meshes, kinds), m/N, and
      !> of the unreduced model.
      real(wp), allocatable :: hertz(:), response(:, :, :, :), true_response(:, :, :)
      !> Largest errors (3, kinds) of compliance and frequency, relative, and of the transfer function over its largest modulus.
      real(wp), allocatable :: error(:, :)
   end type reduction_content_t

   character(*), parameter :: kind = "/reduction/kind", mode = "/reduction/mode", hertz = "/reduction/frequency_of_excitation"

contains

   !> Write the group `/reduction`; `/mesh` and the dimension `/complex` are there.
   subroutine write_reduction(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(reduction_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: quantity = "/reduction/quantity"
      character(*), parameter :: quantities(3) = [character(32) :: "static compliance", "frequencies of mesh modes", &
                                                                                                               "transfer function"]
      integer(int32) :: i

      call write_dataset(file, kind, content%name, "1", "kind of reduction", kind, error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/coordinates", content%coordinates, "1", &
                                                     "coordinates of the reduced model", kind, error)
      if (.not. allocated(error)) call write_dataset(file, quantity, quantities, "1", "what is compared", quantity, error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/error", content%error, "1", &
                                                     "largest error, relative; of the transfer function over its largest modulus", &
                                                     [character(24) :: quantity, kind], error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/compliance", content%compliance, "m/N", &
                                                     "static compliance at the open mesh", [character(16) :: "/mesh", kind], error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/unreduced_compliance", content%true_compliance, "m/N", &
                                                     "the same of the unreduced model", "/mesh", error)
      if (.not. allocated(error)) call write_dataset(file, mode, [(i, i=1, size(content%true_frequency))], "1", &
                                                     "number of the mode", mode, error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/frequency", content%frequency, "Hz", &
                                                     "natural frequency with meshes closed, the nearest to the unreduced one", &
                                                     [character(16) :: mode, kind], error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/unreduced_frequency", content%true_frequency, "Hz", &
                                                     "natural frequency of the unreduced model with meshes closed", mode, error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/moves_mesh", content%moves, "1", &
                                                     "1 for a mode of the unreduced model that moves a mesh", mode, error)
      if (.not. allocated(error)) call write_dataset(file, hertz, content%hertz, "Hz", "frequency of a force in the mesh", hertz, &
                                                     error)
      if (.not. allocated(error)) call write_responses(file, content, error)
   end subroutine write_reduction

   !> Meshes follow each other along one dimension of their own, the frequencies inside.
   subroutine write_responses(file, content, error)
      type(hdf5_file_t), intent(in) :: file
      type(reduction_content_t), intent(in) :: content
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: row = "/reduction/mesh_and_frequency"
      integer :: kinds, rows

      rows = size(content%true_response, 2)*size(content%true_response, 3)
      kinds = size(content%name)
      call add_dimension(file, row, int(rows, int64), "frequencies of the first mesh, then of others, dimension only", &
                         error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/response", &
                                                     reshape(content%response, [2, rows, kinds]), "m/N", &
                                                     "transfer function at the closed mesh, real and imaginary part", &
                                                     [character(32) :: "/complex", row, kind], error)
      if (.not. allocated(error)) call write_dataset(file, "/reduction/unreduced_response", &
                                                     reshape(content%true_response, [2, rows]), "m/N", &
                                                     "the same of the unreduced model", [character(32) :: "/complex", row], error)
   end subroutine write_responses

end module razy_io_modes_reduction
