!! A text that the root group of an HDF5 file has as an attribute.
module razy_io_hdf5_text
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_loc, c_null_ptr, c_ptr, c_size_t
   use hdf5, only: h5aclose_f, h5aget_space_f, h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5dvlen_reclaim_f, h5f_acc_rdonly_f, &
                   h5fclose_f, h5fopen_f, h5p_default_f, h5sclose_f, h5sget_simple_extent_npoints_f, h5tclose_f, &
                   h5tis_variable_str_f, hid_t, hsize_t
   use razy_core_error, only: error_t
   use razy_io_hdf5_library, only: start_hdf5
   implicit none(type, external)
   private

   public :: text_of_root

   interface
      pure function c_strlen(text) result(length) bind(c, name="strlen")
         import :: c_ptr, c_size_t
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: text
         integer(c_size_t) :: length
      end function c_strlen
   end interface

contains

   !> The text of this name; empty if there is no such file, no such attribute, or what is no single string of variable length.
   function text_of_root(path, name) result(text)
      character(*), intent(in) :: path, name
      character(:), allocatable :: text

      type(error_t), allocatable :: error
      integer(hid_t) :: attribute, file
      integer :: status

      text = ""
      call start_hdf5(error)
      if (allocated(error)) return
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      if (status < 0) return
      call h5aopen_by_name_f(file, "/", name, attribute, status)
      if (status >= 0) then
         call read_text(attribute, text)
         call h5aclose_f(attribute, status)
      end if
      call h5fclose_f(file, status)
   end function text_of_root

   !> The value of an attribute that is one string of variable length; of any other, `text` stays as it is.
   subroutine read_text(attribute, text)
      integer(hid_t), intent(in) :: attribute
      character(:), allocatable, intent(inout) :: text

      character(kind=c_char), pointer :: characters(:)
      type(c_ptr), target :: buffer, pointer(1)
      integer(hid_t) :: space, type_id
      integer(hsize_t) :: values
      integer :: i, status
      logical :: fits

      call h5aget_type_f(attribute, type_id, status)
      call h5aget_space_f(attribute, space, status)
      call h5tis_variable_str_f(type_id, fits, status)
      call h5sget_simple_extent_npoints_f(space, values, status)
      pointer = c_null_ptr
      buffer = c_loc(pointer)
      if (fits .and. values == 1) call h5aread_f(attribute, type_id, buffer, status)
      if (c_associated(pointer(1))) then
         call c_f_pointer(pointer(1), characters, [c_strlen(pointer(1))])
         deallocate (text)
         allocate (character(size(characters)) :: text)
         do i = 1, size(characters)
            text(i:i) = characters(i)
         end do
         call h5dvlen_reclaim_f(type_id, space, h5p_default_f, buffer, status)
      end if
      call h5sclose_f(space, status)
      call h5tclose_f(type_id, status)
   end subroutine read_text

end module razy_io_hdf5_text
