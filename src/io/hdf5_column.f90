!! Columns of tables (razy_core_table) as datasets with units, a name and a dimension scale for each dimension, as netCDF-4 and
!! xarray expect them; whole, or with room that is filled part by part.
!!
!! Paths inside the file begin with `/`; groups on the way are made as needed, and so is a scale without coordinates for each
!! dimension that no column has the name of. A column that goes along itself becomes the scale of its dimension.
module razy_io_hdf5_column
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_char, c_ptr
   use h5ds, only: h5dsattach_scale_f, h5dsset_scale_f
   use hdf5, only: h5_integer_kind, h5_real_kind, h5aclose_f, h5acreate_by_name_f, h5awrite_f, h5dclose_f, h5dcreate_f, &
                   h5dget_space_f, h5dopen_f, h5dwrite_f, h5gclose_f, h5gcreate_f, h5kind_to_type, h5lexists_f, &
                   h5p_crt_order_indexed_f, h5p_crt_order_tracked_f, h5p_dataset_create_f, h5p_group_create_f, h5pclose_f, &
                   h5pcreate_f, h5pset_link_creation_order_f, h5pset_obj_track_times_f, h5s_select_set_f, &
                   h5sclose_f, h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
                   h5sselect_hyperslab_f, h5t_cset_utf8_f, h5t_ieee_f64le, h5t_std_i32le, h5t_std_i64le, h5t_std_i8le, &
                   h5t_str_nullterm_f, h5t_string, h5tclose_f, h5tcopy_f, h5tset_cset_f, h5tset_strpad_f, hid_t, hsize_t
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: attribute_t, column_t, table_t
   use razy_core_text, only: string_t
   use razy_io_hdf5_file, only: hdf5_file_t
   use razy_io_hdf5_library, only: check_hdf5
   implicit none(type, external)
   private

   public :: reserve_column, write_attribute, write_part, write_table

   !> Write values behind the first `first` rows of a dataset; rows follow the last dimension.
   interface write_part
      module procedure :: write_reals, write_integers
   end interface write_part

contains

   !> Write the columns that belong into a file.
   !>
   !> Errors: a name that is there already, lengths along a dimension that differ, a full disk.
   subroutine write_table(file, table, error)
      type(hdf5_file_t), intent(in) :: file
      type(table_t), intent(in) :: table
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      do i = 1, table%count
         associate (column => table%column(i))
            if (.not. column%is_stored()) cycle
            call reserve_column(file, column, column%along, column%extent, error)
            if (allocated(error)) return
            if (allocated(column%reals)) then
               call write_reals(file, column%name, 0_i8, column%reals, error)
            else if (allocated(column%integers)) then
               call write_integers(file, column%name, 0_i8, column%integers, error)
            else
               call write_texts(file, column%name, column%texts, error)
            end if
         end associate
         if (allocated(error)) return
      end do
   end subroutine write_table

   !> Make the dataset of a column along these dimensions, with all that is said of it, and no values yet.
   subroutine reserve_column(file, column, along, extent, error)
      type(hdf5_file_t), intent(in) :: file
      type(column_t), intent(in) :: column
      type(string_t), intent(in) :: along(:)
      integer(i8), intent(in) :: extent(:)
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: type_id
      integer :: i, status

      do i = 1, size(along)
         if (along(i)%text /= column%name) call need_dimension(file, along(i)%text, extent(i), column%name, error)
         if (allocated(error)) return
      end do
      if (allocated(column%texts)) then
         call open_string_type(type_id, error)
         if (.not. allocated(error)) call create(file, column%name, type_id, int(extent, hsize_t), error)
         call h5tclose_f(type_id, status)
      else if (allocated(column%reals)) then
         call create(file, column%name, h5t_ieee_f64le, int(extent, hsize_t), error)
      else
         call create(file, column%name, integer_type(column%bits), int(extent, hsize_t), error)
      end if
      if (.not. allocated(error)) call write_attribute(file, column%name, "units", column%unit, error)
      if (.not. allocated(error)) call write_attribute(file, column%name, "long_name", column%long_name, error)
      do i = 1, size(column%attribute)
         if (.not. allocated(error)) call write_note(file, column%name, column%attribute(i), &
                                                     merge(column%bits, 32, allocated(column%integers)), error)
      end do
      do i = 1, size(along)
         if (allocated(error)) return
         if (along(i)%text == column%name) then
            call make_scale(file, column%name, column%name(index(column%name, "/", back=.true.) + 1:), error)
         else
            call attach_scale(file, column%name, size(along) + 1 - i, along(i)%text, error)
         end if
      end do
   end subroutine reserve_column

   !> Have a scale of this length at a path: one that is there, or one without values, which takes no room in the file.
   subroutine need_dimension(file, path, length, user, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, user
      integer(i8), intent(in) :: length
      type(error_t), allocatable, intent(out) :: error

      character(80) :: name
      integer(hid_t) :: dataset, space
      integer(hsize_t) :: found(1), most(1)
      integer :: status
      logical :: there

      call h5lexists_f(file%id, group_path(path), there, status)
      if (there) call h5lexists_f(file%id, path, there, status)
      if (.not. there) then
         ! By this name netCDF-4 knows a dimension that is no variable.
         write (name, "(a, i10)") "This is a netCDF dimension but not a netCDF variable.", length
         call create(file, path, h5t_std_i8le, [int(length, hsize_t)], error)
         if (.not. allocated(error)) call write_attribute(file, path, "units", "1", error)
         if (.not. allocated(error)) call write_attribute(file, path, "long_name", "dimension only", error)
         if (.not. allocated(error)) call make_scale(file, path, trim(name), error)
         return
      end if
      call h5dopen_f(file%id, path, dataset, status)
      if (status >= 0) call h5dget_space_f(dataset, space, status)
      if (status >= 0) call h5sget_simple_extent_dims_f(space, found, most, status)
      call check_hdf5(merge(-1, 0, status < 0), file%path//": "//path//" is no dimension", error)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
      if (allocated(error) .or. found(1) == length) return
      call raise(error, file%path//": "//user//" has not as many values as "//path)
   end subroutine need_dimension

   !> The group of a path, without the slash at its end unless it is the root.
   pure function group_path(path) result(group)
      character(*), intent(in) :: path
      character(:), allocatable :: group

      group = path(:max(index(path, "/", back=.true.) - 1, 1))
   end function group_path

   !> Create a dataset and the groups on the way to it; they remember the order in which their members were made.
   subroutine create(file, path, type_id, extent, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(hid_t), intent(in) :: type_id
      integer(hsize_t), intent(in) :: extent(:)
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: creation, item, space
      integer :: last, status
      logical :: exists

      do last = 2, len(path) - 1
         if (path(last + 1:last + 1) /= "/") cycle
         call h5lexists_f(file%id, path(:last), exists, status)
         if (status >= 0 .and. .not. exists) then
            call h5pcreate_f(h5p_group_create_f, creation, status)
            if (status >= 0) call h5pset_link_creation_order_f(creation, ior(h5p_crt_order_tracked_f, h5p_crt_order_indexed_f), &
                                                               status)
            if (status >= 0) call h5pset_obj_track_times_f(creation, .false., status)
            if (status >= 0) call h5gcreate_f(file%id, path(:last), item, status, gcpl_id=creation)
            if (status >= 0) call h5gclose_f(item, status)
            if (status >= 0) call h5pclose_f(creation, status)
         end if
         call check_hdf5(status, file%path//": group "//path(:last)//" cannot be made", error)
         if (allocated(error)) return
      end do
      call h5screate_simple_f(size(extent), extent, space, status)
      ! Without the time of its making, the same results make the same file, byte for byte.
      if (status >= 0) call h5pcreate_f(h5p_dataset_create_f, creation, status)
      if (status >= 0) call h5pset_obj_track_times_f(creation, .false., status)
      if (status >= 0) call h5dcreate_f(file%id, path, type_id, space, item, status, creation)
      if (status >= 0) call h5pclose_f(creation, status)
      if (status >= 0) call h5dclose_f(item, status)
      if (status >= 0) call h5sclose_f(space, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
   end subroutine create

   subroutine write_reals(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(i8), intent(in) :: first
      real(wp), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_rows(file, path, first, size(values, kind=i8), h5kind_to_type(wp, h5_real_kind), c_loc(values), error)
   end subroutine write_reals

   subroutine write_integers(file, path, first, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(i8), intent(in) :: first
      integer(i8), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error

      if (size(values) == 0) return
      call write_rows(file, path, first, size(values, kind=i8), h5kind_to_type(i8, h5_integer_kind), c_loc(values), error)
   end subroutine write_integers

   subroutine write_texts(file, path, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      type(string_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable, target :: text
      type(c_ptr), allocatable, target :: pointers(:)
      integer(hid_t) :: type_id
      integer :: status

      if (size(values) == 0) return
      call string_pointers(values, text, pointers)
      call open_string_type(type_id, error)
      if (allocated(error)) return
      call write_rows(file, path, 0_i8, size(values, kind=i8), type_id, c_loc(pointers), error)
      call h5tclose_f(type_id, status)
   end subroutine write_texts

   !> Write the `n` values that `buffer` points to behind the first `first` rows.
   subroutine write_rows(file, path, first, n, memory_type, buffer, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path
      integer(i8), intent(in) :: first, n
      integer(hid_t), intent(in) :: memory_type
      type(c_ptr), intent(in) :: buffer
      type(error_t), allocatable, intent(out) :: error

      integer(hsize_t), allocatable :: begin(:), extent(:), most(:)
      integer(hid_t) :: dataset, memory, space
      integer :: ignored, rank, status

      call h5dopen_f(file%id, path, dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
      if (allocated(error)) return
      call h5dget_space_f(dataset, space, status)
      if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (status >= 0 .and. rank == 0) then
         call h5dwrite_f(dataset, memory_type, buffer, status)
      else if (status >= 0) then
         allocate (extent(rank), most(rank))
         allocate (begin(rank), source=0_hsize_t)
         call h5sget_simple_extent_dims_f(space, extent, most, status)
         begin(rank) = first
         extent(rank) = n/product(extent(:rank - 1))
         call h5sselect_hyperslab_f(space, h5s_select_set_f, begin, extent, status)
         if (status >= 0) call h5screate_simple_f(rank, extent, memory, status)
         if (status >= 0) call h5dwrite_f(dataset, memory_type, buffer, status, memory, space)
         if (status >= 0) call h5sclose_f(memory, status)
      end if
      if (status >= 0) call h5sclose_f(space, status)
      call check_hdf5(status, file%path//": "//path//" cannot be written", error)
      call h5dclose_f(dataset, ignored)
   end subroutine write_rows

   pure integer(hid_t) function integer_type(bits) result(type_id)
      integer, intent(in) :: bits

      type_id = merge(h5t_std_i32le, h5t_std_i64le, bits == 32)
      if (bits == 8) type_id = h5t_std_i8le
   end function integer_type

   !> Add a text to the group or dataset at the path `object`; trailing blanks are kept.
   subroutine write_attribute(file, object, name, value, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object, name, value
      type(error_t), allocatable, intent(out) :: error

      type(attribute_t) :: attribute

      attribute%name = name
      allocate (attribute%texts(1))
      attribute%texts(1)%text = value
      call write_note(file, object, attribute, 0, error)
   end subroutine write_attribute

   !> Add an attribute: a text, a list of texts, or integers of so many bits; an empty list writes nothing.
   subroutine write_note(file, object, attribute, bits, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: object
      type(attribute_t), intent(in), target :: attribute
      integer, intent(in) :: bits
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable, target :: text
      type(c_ptr), allocatable, target :: pointers(:)
      integer(hid_t) :: type_id
      integer :: status

      if (allocated(attribute%numbers)) then
         call write_raw(integer_type(bits), h5kind_to_type(kind(bits), h5_integer_kind), size(attribute%numbers), &
                        c_loc(attribute%numbers))
         return
      else if (size(attribute%texts) == 0) then
         return
      end if
      call string_pointers(attribute%texts, text, pointers)
      call open_string_type(type_id, error)
      if (allocated(error)) return
      call write_raw(type_id, type_id, merge(size(pointers), 0, attribute%is_list), c_loc(pointers))
      call h5tclose_f(type_id, status)

   contains

      !> `length` 0: a single value.
      subroutine write_raw(file_type, memory_type, length, buffer)
         integer(hid_t), intent(in) :: file_type, memory_type
         integer, intent(in) :: length
         type(c_ptr), intent(in) :: buffer

         integer(hid_t) :: item, space

         call h5screate_simple_f(min(length, 1), [int(length, hsize_t)], space, status)
         if (status >= 0) call h5acreate_by_name_f(file%id, object, attribute%name, file_type, space, item, status)
         if (status >= 0) call h5awrite_f(item, memory_type, buffer, status)
         if (status >= 0) call h5aclose_f(item, status)
         if (status >= 0) call h5sclose_f(space, status)
         call check_hdf5(status, "attribute "//attribute%name//" of "//object, error)
      end subroutine write_raw

   end subroutine write_note

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

   !> The values as C strings one after the other in `text`, and a pointer to each.
   subroutine string_pointers(values, text, pointers)
      type(string_t), intent(in) :: values(:)
      character(:), allocatable, target, intent(out) :: text
      type(c_ptr), allocatable, intent(out) :: pointers(:)

      integer :: first, i, length

      length = size(values) + sum([(len(values(i)%text), i=1, size(values))])
      allocate (character(length) :: text)
      allocate (pointers(size(values)))
      first = 1
      do i = 1, size(values)
         length = len(values(i)%text)
         text(first:first + length) = values(i)%text//c_null_char
         pointers(i) = c_loc(text(first:first))
         first = first + length + 1
      end do
   end subroutine string_pointers

   !> Make the dataset at `path` a dimension scale called `name`.
   subroutine make_scale(file, path, name, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, name
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: dataset
      integer :: status

      call h5dopen_f(file%id, path, dataset, status)
      if (status >= 0) call h5dsset_scale_f(dataset, status, name)
      if (status >= 0) call h5dclose_f(dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be made a dimension scale", error)
   end subroutine make_scale

   !> Attach the scale at the path `scale` to a dimension of the dataset at `path`, counted in the order of the file: slowest first.
   subroutine attach_scale(file, path, dimension, scale, error)
      type(hdf5_file_t), intent(in) :: file
      character(*), intent(in) :: path, scale
      integer, intent(in) :: dimension
      type(error_t), allocatable, intent(out) :: error

      integer(hid_t) :: dataset, scale_dataset
      integer :: status

      call h5dopen_f(file%id, path, dataset, status)
      if (status >= 0) call h5dopen_f(file%id, scale, scale_dataset, status)
      if (status >= 0) call h5dsattach_scale_f(dataset, scale_dataset, dimension, status)
      if (status >= 0) call h5dclose_f(scale_dataset, status)
      if (status >= 0) call h5dclose_f(dataset, status)
      call check_hdf5(status, file%path//": "//path//" cannot be given the dimension scale "//scale, error)
   end subroutine attach_scale

end module razy_io_hdf5_column
