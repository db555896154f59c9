!! Sample results for the tests of result files, and what those tests need of the system and of HDF5's reading side.
module io_samples
   use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_intptr_t, c_long, c_loc, c_null_funptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8
   use hdf5, only: h5_integer_kind, h5_real_kind, h5dclose_f, h5dget_space_f, h5dopen_f, h5dread_f, h5f_acc_rdonly_f, h5fclose_f, &
                   h5fopen_f, h5kind_to_type, h5sclose_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, hid_t, hsize_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_io_result_file, only: result_header_t
   use razy_io_rows_file, only: rows_file_t
   implicit none(type, external)
   private

   public :: sample_axes, sample_extrema, sample_header, sample_point, sample_run, sample_tune, write_sample_sweep
   public :: read_reals, read_integers, read_table, delete_if_present, limit_file_size, file_has_text

   integer, parameter, public :: long_input_length = 300000

   !> struct rlimit.
   type, bind(C) :: limit_t
      integer(c_long) :: soft
      integer(c_long) :: hard
   end type limit_t

   interface
      function c_getrlimit(resource, limit) result(status) bind(C, name="getrlimit")
         import :: c_int, limit_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: resource
         type(limit_t), intent(out) :: limit
         integer(c_int) :: status
      end function c_getrlimit

      function c_setrlimit(resource, limit) result(status) bind(C, name="setrlimit")
         import :: c_int, limit_t
         implicit none(type, external)
         integer(c_int), value, intent(in) :: resource
         type(limit_t), intent(in) :: limit
         integer(c_int) :: status
      end function c_setrlimit

      function c_signal(number, handler) result(previous) bind(C, name="signal")
         import :: c_funptr, c_int
         implicit none(type, external)
         integer(c_int), value, intent(in) :: number
         type(c_funptr), value, intent(in) :: handler
         type(c_funptr) :: previous
      end function c_signal
   end interface

contains

   !> A header whose input has `long_input_length` characters and whose title is not ASCII.
   function sample_header(program) result(header)
      character(*), intent(in) :: program
      type(result_header_t) :: header
      character(*), parameter :: line = "&disk name='d' /"//new_line("a")
      integer :: i, position

      header%program = program
      header%title = "Rázy"
      header%integrator = "exact"
      header%treatment = "event"
      allocate (character(long_input_length) :: header%input)
      do i = 1, long_input_length
         position = mod(i - 1, len(line)) + 1
         header%input(i:i) = line(position:position)
      end do
   end function sample_header

   !> What point number `point` of a sweep yields: counters, a list of as many extrema as there are `values`, a list of three
   !> numbers, and a number that is for the checkpoint alone.
   subroutine sample_point(row, point, values)
      type(table_t), intent(inout) :: row
      integer, intent(in) :: point
      real(wp), intent(in) :: values(:)
      integer :: i

      call row%rewind()
      call row%add("/point/status", merge(2, 0, point == 2), "1", "what became of the point")
      call row%note_meanings([0, 1, 2], [character(20) :: "ok", "too many events", "chatter"])
      call row%add("/point/events", 5000000000_i8*merge(1, 0, point == 3) + point, "1", "contact events")
      call row%add("/contact/left/impulse", 0.5_wp*point, "N s", "impulse")
      call sample_extrema(row, values)
      call row%add("/point/multiplier", [(real(10*point + i, wp), i=1, 3)], "1", "three at each point", "/point/number", &
                   fixed=.true.)
      call row%add("seconds", 0.25_wp*point, "s", "time that it took")
      call row%note_group("/point/", "coordinates", "rotation.speed_rpm")
   end subroutine sample_point

   !> The extrema of an observable.
   subroutine sample_extrema(table, values)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: values(:)
      character(*), parameter :: group = "/extrema/mesh_deformation/"
      integer :: i

      call table%add(group//"value", values, "m", "extrema of deformation of the mesh", group//"extremum")
      call table%add(group//"time", [(0.25_wp + 0.01_wp*i, i=1, size(values))], "s", "time of the extremum", group//"extremum")
      call table%add(group//"kind", [(merge(1_int8, -1_int8, mod(i, 2) == 1), i=1, size(values))], "1", "kind of extremum", &
                     group//"extremum")
      call table%note_meanings([1, -1], ["maximum", "minimum"])
   end subroutine sample_extrema

   !> The axis of three speeds.
   subroutine sample_axes(table)
      type(table_t), intent(inout) :: table
      character(*), parameter :: axis = "/axis/rotation.speed_rpm"
      real(wp), parameter :: speed(3) = [1000.0_wp, 1004.0_wp, 1008.0_wp]

      call table%add(axis, speed, "rpm", "speed of rotation", axis)
      call table%add("/point/rotation.speed_rpm", speed, "rpm", "speed of rotation", "/point/point")
   end subroutine sample_axes

   !> A file of three speeds with two, no and one extremum.
   subroutine write_sample_sweep(path, overwrite, error)
      character(*), intent(in) :: path
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error
      type(rows_file_t) :: file
      type(table_t) :: axes, row

      call sample_axes(axes)
      call sample_point(row, 1, [1.5e-4_wp, -0.5e-4_wp])
      call file%begin(path, sample_header("razy-sweep"), axes, row, 3_i8, [0_i8, 0_i8, 0_i8, 3_i8, 3_i8, 3_i8, 0_i8, 0_i8], error)
      if (.not. allocated(error)) call file%append(row, error)
      call sample_point(row, 2, [real(wp) ::])
      if (.not. allocated(error)) call file%append(row, error)
      call sample_point(row, 3, [2.5e-4_wp])
      if (.not. allocated(error)) call file%append(row, error)
      call file%commit(overwrite, error)
   end subroutine write_sample_sweep

   !> The first `times` of four times, two coordinates of different units, as many of two events and three extrema.
   function sample_run(times) result(table)
      integer, intent(in) :: times
      type(table_t) :: table
      character(*), parameter :: names(2) = [character(6) :: "slider", "rotor"], units(2) = [character(3) :: "m", "rad"]
      character(*), parameter :: state(2) = [character(17) :: "/state/coordinate", "/state/time"]
      real(wp), parameter :: time(4) = [0.0_wp, 0.1_wp, 0.2_wp, 0.3_wp]
      real(wp), parameter :: displacement(2, 4) = reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 7.0_wp, 8.0_wp], [2, 4])

      call table%add("/time", time(:times), "s", "time", "/sample")
      call table%add("/state/coordinate", names, "1", "coordinate", "/state/coordinate")
      call table%add("/state/time", time(:times), "s", "time", "/state/time")
      call table%add("/state/displacement", displacement(:, :times), "mixed", "displacement", state)
      call table%note("names", names)
      call table%note("coordinate_units", units)
      call table%add("/state/velocity", -displacement(:, :times), "mixed", "velocity", state)
      call table%note("coordinate_units", [character(5) :: "m/s", "rad/s"])
      call table%add("/observable/time", time(:times), "s", "time", "/observable/time")
      call table%add("/observable/gap", 0.4_wp - time(:times), "m", "gap of the stop", "/observable/time")
      associate (events => min(times, 2))
         call table%add("/event/time", [0.11_wp, 0.22_wp], "s", "time", "/event/event")
         call table%add("/event/contact", [2, 1], "1", "number of the contact", "/event/event")
         call table%note("names", [character(5) :: "left", "right"])
         call table%add("/event/state", [1, 0], "1", "branch", "/event/event")
         call table%note("meanings", "0 = open, 1 = closed")
         if (events == 0) call cut(table, "/event/")
      end associate
      call sample_extrema(table, [0.3_wp, 0.1_wp, 0.2_wp])
      if (times == 0) call cut(table, "/extrema/")
   end function sample_run

   !> Let the lists of a group be empty.
   subroutine cut(table, group)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: group
      integer :: i

      do i = 1, table%count
         associate (column => table%column(i))
            if (index(column%name, group) /= 1) cycle
            column%extent = [0_i8]
            if (allocated(column%reals)) column%reals = [real(wp) ::]
            if (allocated(column%integers)) column%integers = [integer(i8) ::]
         end associate
      end do
   end subroutine cut

   !> Three values of a parameter, two modes, single numbers.
   function sample_tune() result(table)
      type(table_t) :: table

      call table%add("/parameter", [1.0_wp, 2.0_wp, 3.0_wp], "N/m", "spring(1)%stiffness", "/parameter")
      call table%add("/mode", [1, 2], "1", "number of the mode", "/mode")
      call table%add("/frequency", reshape([1.0_wp, 2.5_wp, 2.0_wp, 2.5_wp, 3.0_wp, 2.5_wp], [2, 3]), "Hz", "frequency", &
                     [character(10) :: "/mode", "/parameter"])
      call table%add("/eigenvalue", reshape([1.0_wp, 2.5_wp, 2.0_wp, 2.5_wp], [2, 2, 1]), "1/s", "eigenvalue", &
                     [character(8) :: "/complex", "/mode", "/single"])
      call table%add("/frequency_after", [2.0_wp, 2.5_wp, 9.5_wp], "Hz", "frequency", "/order")
      call table%add("/optimum", 2.0_wp, "N/m", "spring(1)%stiffness, tuned")
      call table%note("mode", "the mode that is mostly table")
   end function sample_tune

   !> The real dataset of rank 1, read back; not allocated if it cannot be read.
   subroutine read_reals(path, name, values)
      character(*), intent(in) :: path, name
      real(wp), allocatable, target, intent(out) :: values(:)
      integer(hsize_t), allocatable :: extent(:)
      integer(hid_t) :: file, dataset

      call open_dataset(path, name, file, dataset, extent)
      if (size(extent) /= 1) return
      allocate (values(extent(1)))
      call read_and_close(file, dataset, h5kind_to_type(wp, h5_real_kind), c_loc(values))
   end subroutine read_reals

   !> The integer dataset of rank 1, of any kind in the file, read back as default integers.
   subroutine read_integers(path, name, values)
      character(*), intent(in) :: path, name
      integer, allocatable, target, intent(out) :: values(:)
      integer(hsize_t), allocatable :: extent(:)
      integer(hid_t) :: file, dataset

      call open_dataset(path, name, file, dataset, extent)
      if (size(extent) /= 1) return
      allocate (values(extent(1)))
      call read_and_close(file, dataset, h5kind_to_type(kind(values), h5_integer_kind), c_loc(values))
   end subroutine read_integers

   !> The real dataset of rank 2, read back.
   subroutine read_table(path, name, values)
      character(*), intent(in) :: path, name
      real(wp), allocatable, target, intent(out) :: values(:, :)
      integer(hsize_t), allocatable :: extent(:)
      integer(hid_t) :: file, dataset

      call open_dataset(path, name, file, dataset, extent)
      if (size(extent) /= 2) return
      allocate (values(extent(1), extent(2)))
      call read_and_close(file, dataset, h5kind_to_type(wp, h5_real_kind), c_loc(values))
   end subroutine read_table

   !> Open a dataset of an existing file; `extent` is empty if that fails.
   subroutine open_dataset(path, name, file, dataset, extent)
      character(*), intent(in) :: path, name
      integer(hid_t), intent(out) :: file, dataset
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      integer(hsize_t), allocatable :: largest(:)
      integer(hid_t) :: space
      integer :: status, rank

      allocate (extent(0))
      call h5fopen_f(path, h5f_acc_rdonly_f, file, status)
      if (status < 0) return
      call h5dopen_f(file, name, dataset, status)
      if (status < 0) return
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_ndims_f(space, rank, status)
      deallocate (extent)
      allocate (extent(rank), largest(rank))
      call h5sget_simple_extent_dims_f(space, extent, largest, status)
      call h5sclose_f(space, status)
   end subroutine open_dataset

   subroutine read_and_close(file, dataset, memory_type, buffer)
      integer(hid_t), intent(in) :: file, dataset, memory_type
      type(c_ptr), intent(in) :: buffer
      integer :: status
      type(c_ptr) :: target_buffer

      target_buffer = buffer
      call h5dread_f(dataset, memory_type, target_buffer, status)
      call h5dclose_f(dataset, status)
      call h5fclose_f(file, status)
   end subroutine read_and_close

   subroutine delete_if_present(path)
      character(*), intent(in) :: path
      integer :: unit

      open (newunit=unit, file=path)
      close (unit, status="delete")
   end subroutine delete_if_present

   !> Whether the first line of the file is this text.
   function file_has_text(path, text) result(has)
      character(*), intent(in) :: path, text
      logical :: has
      character(200) :: line
      integer :: unit, status

      open (newunit=unit, file=path, action="read", iostat=status)
      has = .false.
      if (status /= 0) return
      read (unit, "(a)", iostat=status) line
      close (unit)
      has = status == 0 .and. line == text
   end function file_has_text

   !> Let no file grow beyond so many bytes, as on a full disk; a negative number lifts the limit.
   subroutine limit_file_size(bytes)
      integer, intent(in) :: bytes
      integer(c_int), parameter :: limit_of_file_size = 1_c_int, signal_of_file_size = 25_c_int
      integer(c_intptr_t), parameter :: ignore = 1_c_intptr_t
      type(limit_t) :: limit
      type(c_funptr) :: previous
      integer(c_int) :: status

      previous = c_signal(signal_of_file_size, transfer(ignore, c_null_funptr))
      status = c_getrlimit(limit_of_file_size, limit)
      limit%soft = limit%hard
      if (bytes >= 0) limit%soft = int(bytes, c_long)
      if (status == 0_c_int) status = c_setrlimit(limit_of_file_size, limit)
      if (status /= 0_c_int) error stop "the limit of the file size cannot be set"
   end subroutine limit_file_size

end module io_samples
