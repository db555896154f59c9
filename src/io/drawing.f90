!! The group `/scene` of a result file: the geometry of a machine that has one, for pictures.
module razy_io_drawing
   use, intrinsic :: iso_fortran_env, only: int32
   use razy_core_drawing, only: drawing_t, element_kinds
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_io_hdf5_attribute, only: write_attribute
   use razy_io_hdf5_dataset, only: write_dataset
   use razy_io_hdf5_file, only: hdf5_file_t
   implicit none(type, external)
   private

   public :: write_drawing

   character(*), parameter :: scene = "/scene/"

contains

   !> Bodies, points and elements.
   subroutine write_drawing(file, drawing, error)
      type(hdf5_file_t), intent(in) :: file
      type(drawing_t), intent(in) :: drawing
      type(error_t), allocatable, intent(out) :: error

      call write_dataset(file, scene//"axis", ["x", "y"], "1", "axis of the plane", scene//"axis", error)
      if (.not. allocated(error)) call write_names("body", drawing%body)
      if (.not. allocated(error)) call write_pairs("centre", "body", drawing%centre, "m", "centre of mass")
      if (.not. allocated(error)) call write_pairs("size", "body", drawing%extent, "m", "width and height")
      if (.not. allocated(error)) call write_names("point", drawing%point)
      if (.not. allocated(error)) call write_numbers("point_body", "point", drawing%point_body, "body, from 1; 0 = frame")
      if (.not. allocated(error)) call write_pairs("position", "point", drawing%position, "m", "position")
      if (allocated(error) .or. .not. allocated(drawing%kind)) return
      call write_names("element", drawing%element)
      if (.not. allocated(error)) call write_numbers("kind", "element", drawing%kind, "kind of element")
      if (.not. allocated(error)) call write_attribute(file, scene//"kind", "meanings", element_kinds, error)
      if (.not. allocated(error)) call write_numbers("first_body", "element", drawing%first_body, "body at the first end")
      if (.not. allocated(error)) call write_numbers("second_body", "element", drawing%second_body, "body at the second end")
      if (.not. allocated(error)) call write_pairs("first", "element", drawing%first, "m", "first end")
      if (.not. allocated(error)) call write_pairs("second", "element", drawing%second, "m", "second end")
      if (.not. allocated(error)) call write_pairs("direction", "element", drawing%direction, "1", "direction, length 1")

   contains

      subroutine write_names(name, values)
         character(*), intent(in) :: name, values(:)

         call write_dataset(file, scene//name, values, "1", name, scene//name, error)
      end subroutine write_names

      subroutine write_numbers(name, along, values, long_name)
         character(*), intent(in) :: name, along, long_name
         integer, intent(in) :: values(:)

         call write_dataset(file, scene//name, int(values, int32), "1", long_name, scene//along, error)
      end subroutine write_numbers

      subroutine write_pairs(name, along, values, units, long_name)
         character(*), intent(in) :: name, along, units, long_name
         real(wp), intent(in), contiguous :: values(:, :)

         character(20) :: scales(2)

         scales(1) = scene//"axis"
         scales(2) = scene//along
         call write_dataset(file, scene//name, values, units, long_name, scales, error)
      end subroutine write_pairs

   end subroutine write_drawing

end module razy_io_drawing
