!! Attributes of groups and datasets: UTF-8 strings of variable length and small integer arrays.
module razy_io_hdf5_attribute
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_char, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8, int32
   use hdf5, only: h5_integer_kind, h5aclose_f, h5acreate_by_name_f, h5awrite_f, h5kind_to_type, h5s_scalar_f, h5sclose_f, &
                   h5screate_f, h5screate_simple_f, h5t_cset_utf8_f, h5t_std_i32le, h5t_std_i8le, h5t_str_nullterm_f, &
                   h5t_string, h5tclose_f, h5tcopy_f, h5tset_cset_f, h5tset_strpad_f, hid_t, &
                   hsize_t
   use razy_core_error, only: error_t
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_library, only: check_hdf5
   implicit none(type, external)
   private

   public :: write_attribute, open_string_type, string_pointers

   !> Add an attribute to the group or dataset at the path `object`.
   interface write_attribute
      module procedure write_string
      module procedure write_strings
      module procedure write_int32
      module procedure write_int8
   end interface write_attribute

contains

   !> One string; trailing blanks are kept.
   subroutine write_string(file, object, name, value, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object, name, value
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable, target :: text
      type(c_ptr), target :: pointer_to_text
      integer(hid_t) :: type_id

      text = value//c_null_char
      pointer_to_text = c_loc(text)
      call open_string_type(type_id, error)
      if (allocated(error)) return
      call write_raw(file, object, name, type_id, type_id, [integer ::], c_loc(pointer_to_text), error)
      call close_type(type_id, error)
   end subroutine write_string

   !> A list of strings, each without its trailing blanks; an empty list writes nothing.
   subroutine write_strings(file, object, name, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object, name, values(:)
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable, target :: text
      type(c_ptr), allocatable, target :: pointers(:)
      integer(hid_t) :: type_id

      if (size(values) == 0) return
      call string_pointers(values, text, pointers)
      call open_string_type(type_id, error)
      if (allocated(error)) return
      call write_raw(file, object, name, type_id, type_id, [size(values)], c_loc(pointers), error)
      call close_type(type_id, error)
   end subroutine write_strings

   !> An array of 32-bit integers, at least one.
   subroutine write_int32(file, object, name, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object, name
      integer(int32), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, object, name, h5t_std_i32le, h5kind_to_type(int32, h5_integer_kind), [size(values)], &
                     c_loc(values), error)
   end subroutine write_int32

   !> An array of 8-bit integers, at least one.
   subroutine write_int8(file, object, name, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object, name
      integer(int8), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      call write_raw(file, object, name, h5t_std_i8le, h5kind_to_type(int8, h5_integer_kind), [size(values)], &
                     c_loc(values), error)
   end subroutine write_int8

   !> The type of UTF-8 strings of variable length; the caller closes it.
   subroutine open_string_type(type_id, error)
      integer(hid_t), intent(out) :: type_id
      type(error_t), allocatable, intent(out) :: error
      integer :: status

      call h5tcopy_f(h5t_string, type_id, status)
      if (status >= 0) call h5tset_cset_f(type_id, h5t_cset_utf8_f, status)
      if (status >= 0) call h5tset_strpad_f(type_id, h5t_str_nullterm_f, status)
      call check_hdf5(status, "string type", error)
   end subroutine open_string_type

   !> Close the type unless something failed before, which is then what is reported.
   subroutine close_type(type_id, error)
      integer(hid_t), intent(in) :: type_id
      type(error_t), allocatable, intent(inout) :: error
      integer :: status

      call h5tclose_f(type_id, status)
      if (.not. allocated(error)) call check_hdf5(status, "string type", error)
   end subroutine close_type

   !> The values as C strings one after the other in `text`, without their trailing blanks, and a pointer to each.
   subroutine string_pointers(values, text, pointers)
      character(*), intent(in) :: values(:)
      character(:), allocatable, target, intent(out) :: text
      type(c_ptr), allocatable, intent(out) :: pointers(:)
      integer :: i, first

      allocate (character(sum(len_trim(values)) + size(values)) :: text)
      allocate (pointers(size(values)))
      first = 1
      do i = 1, size(values)
         text(first:first + len_trim(values(i))) = trim(values(i))//c_null_char
         pointers(i) = c_loc(text(first:first))
         first = first + len_trim(values(i)) + 1
      end do
   end subroutine string_pointers

   !> Create and write; `shape` is empty for a scalar, `buffer` points at the values.
   subroutine write_raw(file, object, name, file_type, memory_type, shape, buffer, error)
      type(hdf5_file_t), intent(in) :: file
      integer(hid_t), intent(in) :: file_type, memory_type
      character(*), intent(in) :: object, name
      integer, intent(in) :: shape(:)
      type(c_ptr), intent(in) :: buffer
      type(error_t), allocatable, intent(out) :: error
      character(:), allocatable :: what
      integer(hid_t) :: space, attribute
      integer :: status

      what = "attribute "//name//" of "//object
      if (size(shape) == 0) then
         call h5screate_f(h5s_scalar_f, space, status)
      else
         call h5screate_simple_f(size(shape), int(shape, hsize_t), space, status)
      end if
      call check_hdf5(status, what, error)
      if (allocated(error)) return
      call h5acreate_by_name_f(file%id, object, name, file_type, space, attribute, status)
      call check_hdf5(status, what, error)
      if (.not. allocated(error)) then
         call h5awrite_f(attribute, memory_type, buffer, status)
         call check_hdf5(status, what, error)
         call h5aclose_f(attribute, status)
         if (.not. allocated(error)) call check_hdf5(status, what, error)
      end if
      call h5sclose_f(space, status)
      if (.not. allocated(error)) call check_hdf5(status, what, error)
   end subroutine write_raw

end module razy_io_hdf5_attribute
