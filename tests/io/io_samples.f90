!! Sample results for the tests of result files, and what those tests need of the system and of HDF5's reading side.
module io_samples
   use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_intptr_t, c_long, c_loc, c_null_funptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64
   use hdf5, only: h5_integer_kind, h5_real_kind, h5dclose_f, h5dget_space_f, h5dopen_f, h5dread_f, h5f_acc_rdonly_f, h5fclose_f, &
                   h5fopen_f, h5kind_to_type, h5sclose_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, hid_t, hsize_t
   use razy_core_kinds, only: wp
   use razy_io_extrema, only: extrema_t
   use razy_io_header, only: result_header_t
   use razy_io_run_file, only: history_t, run_content_t
   use razy_io_sweep_content, only: axis_t, sweep_content_t
   use razy_io_tune_file, only: tune_content_t
   implicit none(type, external)
   private

   public :: sample_header, sample_sweep, sample_two_axes, sample_run, sample_empty_run, sample_tune
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

   !> Three speeds with two, no and one extremum.
   function sample_sweep() result(content)
      type(sweep_content_t) :: content

      allocate (content%axes(1), content%extrema(1))
      content%axes(1) = axis_t("rotation%speed_rpm", "rpm", "speed of rotation", [1000.0_wp, 1004.0_wp, 1008.0_wp])
      content%status = [0_int32, 2_int32, 0_int32]
      content%status_meanings = [character(20) :: "ok", "chatter", "too many events"]
      content%events = [12_int64, 0_int64, 5000000000_int64]
      content%steps = [100_int64, 3_int64, 77_int64]
      content%doubts = [0_int64, 2_int64, 1_int64]
      content%extrema(1) = extrema_t("mesh_deformation", "m", "deformation of the mesh", [0_int64, 2_int64, 2_int64, 3_int64], &
                                     [1.5e-4_wp, -0.5e-4_wp, 2.5e-4_wp], [0.26_wp, 0.27_wp, 0.28_wp], &
                                     [1_int8, -1_int8, 1_int8])
   end function sample_sweep

   !> Two speeds by three loads, without any extrema.
   function sample_two_axes() result(content)
      type(sweep_content_t) :: content
      integer :: i

      allocate (content%axes(2), content%extrema(1))
      content%axes(1) = axis_t("rotation%speed_rpm", "rpm", "speed of rotation", [1000.0_wp, 1004.0_wp])
      content%axes(2) = axis_t("load(1)%value", "N m", "load", [50.0_wp, 100.0_wp, 200.0_wp])
      content%status = [(0_int32, i=1, 6)]
      content%status_meanings = [character(20) :: "ok", "chatter"]
      content%events = [(int(i, int64), i=1, 6)]
      content%steps = [(int(10*i, int64), i=1, 6)]
      content%doubts = [(int(i - 1, int64), i=1, 6)]
      content%extrema(1) = extrema_t("mesh_deformation", "m", "deformation of the mesh", [(0_int64, i=1, 7)])
      allocate (content%extrema(1)%value(0), content%extrema(1)%time(0), content%extrema(1)%kind(0))
   end function sample_two_axes

   !> Four times, two coordinates of different units, two events, three extrema.
   function sample_run() result(content)
      type(run_content_t) :: content

      allocate (content%observables(1), content%extrema(1))
      content%time = [0.0_wp, 0.1_wp, 0.2_wp, 0.3_wp]
      content%coordinate_names = [character(6) :: "slider", "rotor"]
      content%coordinate_units = [character(3) :: "m", "rad"]
      content%displacement = reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 7.0_wp, 8.0_wp], [2, 4])
      content%velocity = -content%displacement
      content%observables(1) = history_t("gap", "m", "gap of the stop", [0.4_wp, 0.3_wp, 0.2_wp, 0.1_wp])
      content%event_time = [0.11_wp, 0.22_wp]
      content%event_contact = [2_int32, 1_int32]
      content%event_state = [1_int32, 0_int32]
      content%contact_names = [character(5) :: "left", "right"]
      content%event_meanings = "0 = open, 1 = closed"
      content%extrema(1) = extrema_t("gap", "m", "gap of the stop", value=[0.3_wp, 0.1_wp, 0.2_wp], &
                                     time=[0.05_wp, 0.15_wp, 0.25_wp], kind=[1_int8, -1_int8, 1_int8])
   end function sample_run

   !> Every array there, every length zero but that of the coordinates.
   function sample_empty_run() result(content)
      type(run_content_t) :: content

      content = sample_run()
      content%time = [real(wp) ::]
      content%displacement = reshape([real(wp) ::], [2, 0])
      content%velocity = content%displacement
      content%observables(1)%values = [real(wp) ::]
      content%event_time = [real(wp) ::]
      content%event_contact = [integer(int32) ::]
      content%event_state = [integer(int32) ::]
      content%extrema(1)%value = [real(wp) ::]
      content%extrema(1)%time = [real(wp) ::]
      content%extrema(1)%kind = [integer(int8) ::]
   end function sample_empty_run

   !> Three values of the parameter, two modes of three.
   function sample_tune() result(content)
      type(tune_content_t) :: content

      content%name = "spring(1)%stiffness"
      content%units = "N/m"
      content%mode = "the mode that is mostly table"
      content%parameter = [1.0_wp, 2.0_wp, 3.0_wp]
      content%objective = [0.25_wp, 0.0_wp, 0.25_wp]
      content%tuned = [1.0_wp, 2.0_wp, 3.0_wp]
      content%place = [1_int32, 1_int32, 2_int32]
      content%frequency = reshape([1.0_wp, 2.5_wp, 2.0_wp, 2.5_wp, 3.0_wp, 2.5_wp], [2, 3])
      content%frequency_before = [1.0_wp, 2.5_wp, 9.0_wp]
      content%frequency_after = [2.0_wp, 2.5_wp, 9.5_wp]
      content%goal = 2.0_wp
      content%reference = 1.0_wp
      content%optimum = 2.0_wp
      content%share = 0.75_wp
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
