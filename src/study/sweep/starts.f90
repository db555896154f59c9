!! The initial states of each point of a sweep, from &starts and &start_range.
!!
!! A start changes some displacements and velocities of the state that &motion start names. In a box each number is formed from
!! the seed, the grid point, the sample and the place of the range (razy_core_uniform), and from nothing else.
module razy_study_sweep_starts
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: did_you_mean, newline, position_of, string_t, texts_of
   use razy_core_uniform, only: uniform
   use razy_input_input, only: input_t
   use razy_io_columns, only: read_columns
   use razy_io_journal, only: checksum
   use razy_machine_excitation, only: excitation_period
   use razy_machine_machine, only: machine_t
   use razy_sweep_grid, only: axis_t, most_points, new_axis
   implicit none(type, external)
   private

   public :: identity_of, new_starts, read_start_file, starts_t

   !> What one &start_range varies.
   type :: start_range_t
      !> Number of the coordinate in the machine; whether it is its velocity; the same as a name, `block.velocity`.
      integer :: coordinate = 0
      logical :: velocity = .false.
      character(:), allocatable :: name, unit
      !> Values of a grid or list.
      type(axis_t) :: axis
      !> Ends of a box.
      real(wp) :: first = 0.0_wp, last = 0.0_wp
   end type start_range_t

   !> All starts; without &starts there is one, that of &motion.
   type :: starts_t
      logical :: wanted = .false.
      !> grid, list, box or file.
      character(:), allocatable :: method
      integer(i8) :: count = 1, seed = 0
      type(start_range_t), allocatable :: range(:)
      !> How attractors are told apart: &starts period, longest_period, tolerance.
      real(wp) :: period = 0.0_wp, tolerance = 0.0_wp
      integer :: longest_period = 0
   contains
      procedure :: value
      procedure :: apply
      procedure :: strobe_period
   end type starts_t

contains

   !> Read the groups; `machine` is the one of the input, `numbers` what `read_start_file` found. Without these
   !> the starts of a file are not known, and `count` is 0.
   subroutine new_starts(self, machine, input, error, numbers)
      type(starts_t), intent(out) :: self
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: numbers(:)

      integer :: i, n

      allocate (self%range(input%count("start_range")))
      self%wanted = input%count("starts") > 0
      if (.not. self%wanted) then
         if (size(self%range) > 0) call input%complain(error, "starts", 1, "method", "required beside &start_range")
         return
      end if
      self%method = input%choice("starts", 1, "method")
      self%seed = input%whole("starts", 1, "seed")
      call input%get("starts", 1, "period", self%period)
      call input%get("starts", 1, "tolerance", self%tolerance)
      call input%get("starts", 1, "longest_period", self%longest_period)
      if (size(self%range) == 0) then
         call input%complain(error, "start_range", 1, "coordinate", "required beside &starts: what varies from start to start")
         return
      end if
      do i = 1, size(self%range)
         call read_range(self%range(i), self%method, machine, input, i, error)
         if (allocated(error)) return
      end do
      if (self%method /= "file") then
         call count_starts(self, input, error)
         return
      end if
      self%count = 0
      if (.not. present(numbers)) return
      n = size(numbers)/size(self%range)
      self%count = n
      do i = 1, size(self%range)
         call new_axis(self%range(i)%axis, numbers((i - 1)*n + 1:i*n))
      end do
   end subroutine new_starts

   !> Number of starts.
   subroutine count_starts(self, input, error)
      type(starts_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      select case (self%method)
      case ("grid")
         do i = 1, size(self%range)
            if (self%count > most_points/self%range(i)%axis%n) then
               call input%complain(error, "start_range", i, "points", "fewer: the grid of starts is too large")
               return
            end if
            self%count = self%count*self%range(i)%axis%n
         end do
      case ("list")
         self%count = self%range(1)%axis%n
         i = findloc(self%range%axis%n == self%count, .false., dim=1)
         if (i > 0) call input%complain(error, "start_range", i, "values", &
                                        "as many as in the first &start_range, one for each start")
      case default
         if (.not. input%given("starts", 1, "samples")) then
            call input%complain(error, "starts", 1, "samples", "required: the number of starts from the box")
            return
         end if
         self%count = input%whole("starts", 1, "samples")
      end select
   end subroutine count_starts

   !> One &start_range, as the method needs it.
   subroutine read_range(range, method, machine, input, i, error)
      type(start_range_t), intent(inout) :: range
      character(*), intent(in) :: method
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      !> Keys, and the method by which each is needed.
      character(*), parameter :: needed(6) = [character(6) :: "first", "first", "last", "last", "points", "values"]
      character(*), parameter :: by(6) = [character(4) :: "grid", "box", "grid", "box", "grid", "list"]
      type(error_t), allocatable :: problem
      character(:), allocatable :: quantity
      integer :: k

      call find_coordinate(range, machine, input, i, error)
      if (allocated(error)) return
      quantity = input%choice("start_range", i, "quantity")
      range%velocity = quantity == "velocity"
      range%name = trim(machine%coordinate(range%coordinate))//"."//quantity
      range%unit = trim(machine%unit(range%coordinate))
      if (range%velocity) range%unit = trim(machine%rate_unit(range%coordinate))
      k = findloc(method == by .and. .not. [(input%given("start_range", i, trim(needed(k))), k=1, size(by))], .true., dim=1)
      if (k > 0) call input%complain(error, "start_range", i, trim(needed(k)), "required for &starts method = '"//method//"'")
      if (allocated(error)) return
      if (method == "file") return
      if (method == "list") then
         call new_axis(range%axis, input%list("start_range", i, "values"))
      else
         call input%get("start_range", i, "first", range%first)
         call input%get("start_range", i, "last", range%last)
         if (method == "box") return
         call new_axis(range%axis, range%first, range%last, input%whole("start_range", i, "points"), problem)
         if (allocated(problem)) call input%complain(error, "start_range", i, "points", problem%message)
      end if
   end subroutine read_range

   subroutine find_coordinate(range, machine, input, i, error)
      type(start_range_t), intent(inout) :: range
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: known(:)
      character(:), allocatable :: name

      call input%get("start_range", i, "coordinate", name)
      known = texts_of(machine%coordinate)
      range%coordinate = position_of(name, known)
      if (range%coordinate == 0) call input%complain(error, "start_range", i, "coordinate", &
                                                     "a coordinate; "//did_you_mean(name, known, "coordinates"))
   end subroutine find_coordinate

   !> What range number `i` has at a start, both from 1, of a grid point.
   pure real(wp) function value(self, i, grid_point, start)
      class(starts_t), intent(in) :: self
      integer, intent(in) :: i
      integer(i8), intent(in) :: grid_point, start

      integer(i8) :: inner

      associate (range => self%range(i))
         select case (self%method)
         case ("grid")
            inner = product(self%range(i + 1:)%axis%n)
            value = range%axis%value(1 + modulo((start - 1)/inner, range%axis%n))
         case ("list", "file")
            value = range%axis%value(start)
         case default
            value = range%first + (range%last - range%first)*uniform([self%seed, grid_point], [start, int(i, i8)])
         end select
      end associate
   end function value

   !> Let a machine begin from a start.
   pure subroutine apply(self, machine, grid_point, start)
      class(starts_t), intent(in) :: self
      type(machine_t), intent(inout) :: machine
      integer(i8), intent(in) :: grid_point, start

      integer :: i

      do i = 1, size(self%range)
         associate (range => self%range(i))
            if (range%velocity) then
               machine%velocity(range%coordinate) = self%value(i, grid_point, start)
            else
               machine%displacement(range%coordinate) = self%value(i, grid_point, start)
            end if
         end associate
      end do
   end subroutine apply

   !> Time between stroboscopic states of a machine, s, of a motion that ends at `t_end`, s.
   subroutine strobe_period(self, machine, t_end, input, period, error)
      class(starts_t), intent(in) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end
      type(input_t), intent(in) :: input
      real(wp), intent(out) :: period
      type(error_t), allocatable, intent(out) :: error

      period = self%period
      if (.not. period > 0.0_wp) period = excitation_period(machine%tone)
      if (.not. period > 0.0_wp) then
         call input%complain(error, "starts", 1, "period", "required: the excitation has no period of its own")
      else if (2*self%longest_period*period > t_end) then
         call input%complain(error, "starts", 1, "longest_period", &
                             "so few that twice as many periods of the excitation fit in the motion, &motion t_end")
      end if
   end subroutine strobe_period

   !> Read the file of starts, if there is one: all first numbers of &start_range, then all second ones. (ranges*starts)
   subroutine read_start_file(numbers, input, error)
      real(wp), allocatable, intent(out) :: numbers(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: columns(:)
      real(wp), allocatable :: values(:, :)
      integer :: i

      allocate (numbers(0))
      if (input%choice("starts", 1, "method") /= "file") return
      if (.not. input%given("starts", 1, "file")) call input%complain(error, "starts", 1, "file", "required for method = 'file'")
      if (allocated(error)) return
      allocate (columns(input%count("start_range")))
      do i = 1, size(columns)
         if (input%given("start_range", i, "column")) then
            call input%get("start_range", i, "column", columns(i)%text)
         else
            call input%get("start_range", i, "coordinate", columns(i)%text)
            columns(i)%text = columns(i)%text//"."//input%choice("start_range", i, "quantity")
         end if
      end do
      if (size(columns) == 0) return
      call read_columns(input%text("starts", 1, "file"), columns, values, error)
      if (.not. allocated(error)) numbers = reshape(values, [size(values)])
   end subroutine read_start_file

   !> A group that tells starts from a file from others, to be added to an effective input; empty if there are none.
   pure function identity_of(numbers) result(text)
      real(wp), intent(in) :: numbers(:)
      character(:), allocatable :: text

      character(16) :: sum

      text = ""
      if (size(numbers) == 0) return
      write (sum, "(z16.16)") checksum(transfer(numbers, [0_i8]))
      text = "&starts"//newline//"   contents_of_file = "//to_text(size(numbers))//" numbers with checksum "//sum//newline// &
             "/"//newline
   end function identity_of

end module razy_study_sweep_starts
