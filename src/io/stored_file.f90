!! An HDF5 file that is read: numbers and texts of its datasets, and texts of its root.
module razy_io_stored_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_loc, c_null_char, c_ptr
   use hdf5, only: h5aclose_f, h5aexists_f, h5aget_space_f, h5aget_type_f, h5aopen_f, h5aread_f, h5dclose_f, h5dget_space_f, &
                   h5dget_type_f, h5dopen_f, h5dread_f, h5dvlen_reclaim_f, h5f_acc_rdonly_f, h5fclose_f, h5fopen_f, &
                   h5lexists_f, h5p_default_f, h5sclose_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
                   h5t_native_double, h5tclose_f, h5tis_variable_str_f, hid_t, hsize_t
   use razy_core_error, only: error_t, refuse
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: excerpt, string_t
   use razy_io_hdf5_library, only: check_hdf5, start_hdf5
   implicit none(type, external)
   private

   public :: stored_file_t, text_of_root

   !> `begin_reading`, then what is wanted, then `end_reading`, after an error of a reading too.
   type :: stored_file_t
      character(:), allocatable, private :: path
      integer(hid_t), private :: id = -1_hid_t
   contains
      procedure :: begin_reading
      procedure :: end_reading
      procedure :: has
      procedure :: read_numbers
      procedure :: read_texts
      procedure :: read_attribute
   end type stored_file_t

   !> Values that a dataset may have.
   integer(i8), parameter :: most_values = 100000000_i8

contains

   !> Open a file. Errors: there is none of this name, it is no HDF5 file, which is said as `otherwise` does.
   subroutine begin_reading(self, path, otherwise, error)
      class(stored_file_t), intent(inout) :: self
      character(*), intent(in) :: path, otherwise
      type(error_t), allocatable, intent(out) :: error

      integer :: status
      logical :: exists

      self%path = path
      inquire (file=path, exist=exists)
      if (.not. exists) call refuse(error, excerpt(path), "there is no such file")
      if (.not. allocated(error)) call start_hdf5(error)
      if (allocated(error)) return
      call h5fopen_f(path, h5f_acc_rdonly_f, self%id, status)
      call check_hdf5(status, excerpt(path)//": "//otherwise, error)
   end subroutine begin_reading

   subroutine end_reading(self)
      class(stored_file_t), intent(inout) :: self

      integer :: status

      call h5fclose_f(self%id, status)
   end subroutine end_reading

   !> Whether there is something at a path in an open file.
   logical function has(self, name)
      class(stored_file_t), intent(in) :: self
      character(*), intent(in) :: name

      integer :: status

      call h5lexists_f(self%id, name, has, status)
      has = has .and. status >= 0
   end function has

   !> All numbers of a dataset, one after the other, and its shape, the fastest dimension first.
   subroutine read_numbers(self, name, values, shape, error)
      class(stored_file_t), intent(in) :: self
      character(*), intent(in) :: name
      real(wp), allocatable, target, intent(out) :: values(:)
      integer(i8), allocatable, intent(out) :: shape(:)
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: set
      integer :: status
      type(c_ptr) :: buffer

      call begin(self, name, set, shape, error)
      if (allocated(error)) return
      allocate (values(product(shape)))
      buffer = c_loc(values)
      call h5dread_f(set, h5t_native_double, buffer, status)
      call check_hdf5(status, self%path//": '"//excerpt(name)//"' cannot be read as real numbers", error)
      call h5dclose_f(set, status)
   end subroutine read_numbers

   !> All texts of a dataset of texts of any length.
   subroutine read_texts(self, name, values, error)
      class(stored_file_t), intent(in) :: self
      character(*), intent(in) :: name
      type(string_t), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error

      type(c_ptr), allocatable, target :: texts(:)
      type(c_ptr) :: buffer
      integer(hid_t) :: kind, set, space
      integer(i8), allocatable :: shape(:)
      integer :: i, status
      logical :: are_texts

      call begin(self, name, set, shape, error)
      if (allocated(error)) return
      call h5dget_type_f(set, kind, status)
      call h5tis_variable_str_f(kind, are_texts, status)
      if (are_texts) then
         allocate (texts(product(shape)), values(product(shape)))
         buffer = c_loc(texts)
         call h5dread_f(set, kind, buffer, status)
         call check_hdf5(status, self%path//": '"//excerpt(name)//"' cannot be read", error)
         if (.not. allocated(error)) then
            do i = 1, size(values)
               values(i)%text = text_at(texts(i))
            end do
            call h5dget_space_f(set, space, status)
            call h5dvlen_reclaim_f(kind, space, h5p_default_f, buffer, status)
            call h5sclose_f(space, status)
         end if
      else
         call refuse(error, self%path, "'"//excerpt(name)//"' holds no texts")
      end if
      call h5tclose_f(kind, status)
      call h5dclose_f(set, status)
   end subroutine read_texts

   !> A text of the root; empty if there is none of this name.
   subroutine read_attribute(self, name, value)
      class(stored_file_t), intent(in) :: self
      character(*), intent(in) :: name
      character(:), allocatable, intent(out) :: value

      type(c_ptr), target :: text(1)
      type(c_ptr) :: buffer
      integer(hid_t) :: item, kind, space
      integer :: dimensions, status
      logical :: is_text, there

      value = ""
      call h5aexists_f(self%id, name, there, status)
      if (status < 0 .or. .not. there) return
      call h5aopen_f(self%id, name, item, status)
      call h5aget_type_f(item, kind, status)
      call h5aget_space_f(item, space, status)
      call h5sget_simple_extent_ndims_f(space, dimensions, status)
      call h5tis_variable_str_f(kind, is_text, status)
      if (is_text .and. dimensions == 0) then
         buffer = c_loc(text)
         call h5aread_f(item, kind, buffer, status)
         if (status >= 0) then
            value = text_at(text(1))
            call h5dvlen_reclaim_f(kind, space, h5p_default_f, buffer, status)
         end if
      end if
      call h5sclose_f(space, status)
      call h5tclose_f(kind, status)
      call h5aclose_f(item, status)
   end subroutine read_attribute

   !> The text of this name in the root of a file; empty if there is no such file or text.
   function text_of_root(path, name) result(text)
      character(*), intent(in) :: path, name
      character(:), allocatable :: text

      type(stored_file_t) :: file
      type(error_t), allocatable :: error

      text = ""
      call file%begin_reading(path, "not read", error)
      if (allocated(error)) return
      call file%read_attribute(name, text)
      call file%end_reading()
   end function text_of_root

   !> Open a dataset whose values are not too many; a single value has no dimension.
   subroutine begin(self, name, set, shape, error)
      class(stored_file_t), intent(in) :: self
      character(*), intent(in) :: name
      integer(hid_t), intent(out) :: set
      integer(i8), allocatable, intent(out) :: shape(:)
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: space
      integer(hsize_t), allocatable :: length(:), most(:)
      integer :: dimensions, status

      if (.not. self%has(name)) call refuse(error, self%path, "has no dataset '"//excerpt(name)//"'")
      if (allocated(error)) return
      call h5dopen_f(self%id, name, set, status)
      call check_hdf5(status, self%path//": '"//excerpt(name)//"' is no dataset", error)
      if (allocated(error)) return
      call h5dget_space_f(set, space, status)
      call h5sget_simple_extent_ndims_f(space, dimensions, status)
      allocate (length(dimensions), most(dimensions))
      if (dimensions > 0) call h5sget_simple_extent_dims_f(space, length, most, status)
      call h5sclose_f(space, status)
      shape = int(length, i8)
      if (product(real(shape, wp)) <= real(most_values, wp)) return
      call refuse(error, self%path, "'"//excerpt(name)//"' has more than 1e8 values")
      call h5dclose_f(set, status)
   end subroutine begin

   !> The C string at an address; one without an address is empty.
   function text_at(address) result(text)
      type(c_ptr), intent(in) :: address
      character(:), allocatable :: text

      character(kind=c_char), pointer :: characters(:)
      integer :: length

      text = ""
      if (.not. c_associated(address)) return
      call c_f_pointer(address, characters, [huge(length)])
      length = 0
      do while (characters(length + 1) /= c_null_char)
         length = length + 1
      end do
      text = transfer(characters(:length), repeat(" ", length))
   end function text_at

end module razy_io_stored_file
