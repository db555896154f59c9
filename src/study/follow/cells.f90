!! The range of the parameter in cells, each a task of its own: all motions at its middle are looked for and followed to its
!! borders. What comes to a border and is not met there from the other side is followed on in the next cell, as a task of the
!! next round.
!!
!! A cell yields its branches as a row of numbers (razy_sweep_task), from which they are put together again on rank 0.
module razy_study_follow_cells
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_input_input, only: input_t
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_periodic_identity, only: repeated
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_search, only: found_t, new_found, search_t
   use razy_orbits_start, only: refine
   use razy_study_follow_follow, only: follow_t, sample_t
   use razy_study_follow_request, only: new_request
   use razy_study_follow_uncertainty, only: find_errors
   use razy_sweep_task, only: point_task
   implicit none(type, external)
   private

   public :: arrival_t, cells_t, new_cells, pack_arrivals, unpack_arrivals, unpack_cell

   !> A motion at a border: the cell that it goes into, side as in `follow_from`, state x, SI.
   type :: arrival_t
      integer :: cell = 0, periods = 1, side = 1
      real(wp) :: parameter = 0.0_wp
      real(wp), allocatable :: x(:)
   end type arrival_t

   !> Point number `cell` of the plan is a cell in the first round, `cell + cells` the same in the second, and so on.
   type, extends(point_task) :: cells_t
      type(follow_t) :: follow
      integer :: cells = 1
      !> The whole range.
      real(wp), private :: first = 0.0_wp, last = 0.0_wp
      !> What is followed on in this round.
      type(arrival_t), allocatable :: arrival(:)
   contains
      procedure :: describe
      procedure :: run
      procedure :: border
      procedure, private :: find_and_follow
      procedure, private :: follow_on
   end type cells_t

   !> Of each point in a row: label, contact, events, error, correction, phase and the parameter.
   integer, parameter :: numbers_beside = 8

contains

   !> Make the task of an input, on every rank.
   subroutine new_cells(self, input, error)
      type(cells_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      call new_request(self%follow, input, error)
      if (allocated(error)) return
      self%cells = self%follow%samples
      self%first = self%follow%first(1)
      self%last = self%follow%last(1)
      allocate (self%arrival(0))
   end subroutine new_cells

   !> Border number i, 0 to `cells`, from the first value of the range to the last.
   pure real(wp) function border(self, i)
      class(cells_t), intent(in) :: self
      integer, intent(in) :: i

      border = merge(self%last, self%first + (self%last - self%first)*(real(i, wp)/self%cells), i == self%cells)
   end function border

   !> The columns of a row.
   subroutine describe(self, row)
      class(cells_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      type(sample_t) :: sample

      call self%follow%reset()
      allocate (sample%branch(0), sample%starts(0))
      sample%reason = ""
      call fill(self, sample, row)
   end subroutine describe

   !> Compute a cell.
   subroutine run(self, point, row, before)
      class(cells_t), intent(inout) :: self
      integer(i8), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(table_t), intent(in), optional :: before

      type(sample_t) :: sample
      integer :: cell

      associate (ignored => before)
      end associate
      cell = 1 + int(modulo(point - 1, int(self%cells, i8)))
      call self%follow%reset()
      self%follow%first(1) = self%border(cell - 1)
      self%follow%last(1) = self%border(cell)
      allocate (sample%branch(0), sample%starts(0))
      sample%reason = ""
      sample%parameter = 0.5_wp*(self%follow%first(1) + self%follow%last(1))
      if (point <= self%cells) then
         call self%find_and_follow(sample)
      else
         call self%follow_on(cell)
      end if
      call find_errors(self%follow%problem, self%follow%branch(:self%follow%count))
      if (associated(self%follow%problem%map%stop_is_asked)) self%broken_off = self%follow%problem%map%stop_is_asked()
      call fill(self, sample, row)
   end subroutine run

   !> All motions at the middle of the cell, and their branches; those of few periods first, as the others may lie on branches that
   !> begin there.
   subroutine find_and_follow(self, sample)
      class(cells_t), intent(inout) :: self
      type(sample_t), intent(inout) :: sample

      type(error_t), allocatable :: error
      type(search_t) :: search
      real(wp) :: values(size(self%follow%problem%parameter))
      integer :: i, periods, place

      search = self%follow%search
      values = self%follow%problem%parameter
      values(1) = sample%parameter
      call search%run(self%follow%problem, values, abs(self%last - self%first), error)
      if (allocated(error)) then
         sample%reason = "nothing was looked for: "//error%message
         return
      end if
      sample%exponent = search%exponent
      sample%error = search%error
      sample%unsettled = search%unsettled
      do periods = 1, search%most_periods
         do i = 1, size(search%found)
            associate (motion => search%found(i))
               if (motion%periods /= periods) cycle
               place = self%follow%place_on(motion)
               if (place == 0) then
                  place = self%follow%count + 1
                  self%follow%problem%periods = periods
                  call self%follow%follow_from(motion%orbit, 0)
               end if
               if (motion%starts == 0 .or. place > self%follow%count) cycle
               sample%branch = [sample%branch, place]
               sample%starts = [sample%starts, motion%starts]
            end associate
         end do
      end do
      if (self%follow%is_full()) sample%reason = "as many branches as are followed in a cell; there may be more"
   end subroutine find_and_follow

   !> The branches of what comes into the cell.
   subroutine follow_on(self, cell)
      class(cells_t), intent(inout) :: self
      integer, intent(in) :: cell

      type(error_t), allocatable :: error
      type(found_t) :: motion
      type(orbit_t) :: orbit
      integer :: i
      logical :: begun, ok

      begun = .false.
      associate (problem => self%follow%problem)
         do i = 1, size(self%arrival)
            associate (arrival => self%arrival(i))
               if (arrival%cell /= cell) cycle
               problem%parameter(1) = arrival%parameter
               call problem%map%go_to(problem%parameter, error)
               if (allocated(error)) cycle
               problem%periods = arrival%periods
               if (.not. begun) call problem%begin(arrival%x, 0.0_wp, abs(self%last - self%first))
               begun = .true.
               call refine(problem, arrival%x, orbit, ok)
               if (.not. ok) cycle
               call new_found(motion, problem, orbit)
               if (self%follow%place_on(motion) > 0) cycle
               call self%follow%follow_from(orbit, arrival%side)
            end associate
         end do
      end associate
   end subroutine follow_on

   !> The branches and the sample as columns: lists of the branches, and of the numbers of all their points.
   subroutine fill(self, sample, row)
      class(cells_t), intent(inout) :: self
      type(sample_t), intent(in) :: sample
      type(table_t), intent(inout) :: row

      real(wp), allocatable :: numbers(:), s(:)
      character(:), allocatable :: text
      integer :: b, i, k, n

      associate (branch => self%follow%branch(:self%follow%count), problem => self%follow%problem)
         n = problem%map%n
         allocate (numbers(sum(branch%count*(numbers_beside + n*(branch%periods + 3)))))
         text = sample%reason
         k = 0
         do b = 1, size(branch)
            text = text//new_line("a")//branch(b)%ending
            problem%periods = branch(b)%periods
            s = problem%scales()
            do i = 1, branch(b)%count
               associate (point => branch(b)%point(i), next => k + numbers_beside + n*(branch(b)%periods + 3))
                  numbers(k + 1:next) = [real([iachar(point%label(1:1)), iachar(point%label(2:2)), point%contact, &
                                               point%orbit%sequence%count], wp), point%error, point%orbit%correction, &
                                         point%orbit%phase, point%orbit%u*s, real(point%orbit%multiplier, wp), &
                                         point%orbit%multiplier%im, point%orbit%doubt]
                  k = next
               end associate
            end do
         end do
         call row%add("value", sample%parameter, "1", "middle of the cell")
         call row%add("exponent", sample%exponent, "1/s", "largest Lyapunov exponent")
         call row%add("error", sample%error, "1/s", "its standard error")
         call row%add("unsettled", sample%unsettled, "1", "starts that settle to no motion")
         call row%add("settled_to", sample%branch, "1", "branch", "settled")
         call row%add("starts", sample%starts, "1", "starts that settle to it", "settled")
         call row%add("text", [(iachar(text(i:i)), i=1, len(text))], "1", "reason, endings", "character")
         call row%add("periods", branch%periods, "1", "periods", "branch")
         call row%add("points", branch%count, "1", "points", "branch")
         call row%add("parent", branch%parent, "1", "branch that it begins on", "branch")
         call row%add("unexplained", branch%unexplained, "1", "steps that its labels do not explain", "branch")
      end associate
      call row%add("point", numbers, "1", &
                   "label, contact, events, error, correction, phase, u, multipliers, their errors", "number")
   end subroutine fill

   !> The branches of a row that `fill` has filled, in units of the `scales` of a state and the parameter, and the sample.
   subroutine unpack_cell(row, scales, branch, sample)
      type(table_t), intent(in) :: row
      real(wp), intent(in) :: scales(:)
      type(branch_t), allocatable, intent(out) :: branch(:)
      type(sample_t), intent(out) :: sample

      character(:), allocatable :: text
      integer, allocatable :: periods(:), points(:)
      real(wp), allocatable :: numbers(:), s(:), seen(:)
      integer :: b, i, k, m, n

      text = text_of(integers("text"))
      periods = integers("periods")
      points = integers("points")
      n = size(scales) - 1
      numbers = reals("point")
      seen = [reals("value"), reals("exponent"), reals("error")]
      sample%parameter = seen(1)
      sample%exponent = seen(2)
      sample%error = seen(3)
      sample%unsettled = sum(integers("unsettled"))
      sample%branch = integers("settled_to")
      sample%starts = integers("starts")
      sample%reason = first_line(text)
      allocate (branch(size(periods)))
      branch%parent = integers("parent")
      branch%unexplained = integers("unexplained")
      k = 0
      do b = 1, size(branch)
         branch(b)%periods = periods(b)
         branch(b)%count = points(b)
         branch(b)%ending = first_line(text)
         allocate (branch(b)%point(points(b)))
         s = repeated(scales, periods(b))
         m = size(s)
         do i = 1, points(b)
            associate (point => branch(b)%point(i), number => numbers(k + 1:k + numbers_beside + n*(periods(b) + 3)))
               k = k + size(number)
               point%label = achar(nint(number(1)))//achar(nint(number(2)))
               point%contact = nint(number(3))
               point%orbit%sequence%count = nint(number(4))
               point%error = number(5)
               point%orbit%correction = number(6)
               point%orbit%phase = number(7)
               point%orbit%u = number(8:m + 7)/s
               point%orbit%multiplier = cmplx(number(m + 8:m + n + 7), number(m + n + 8:m + 2*n + 7), kind=wp)
               point%orbit%doubt = number(m + 2*n + 8:)
            end associate
         end do
      end do

   contains

      pure function integers(name) result(values)
         character(*), intent(in) :: name
         integer, allocatable :: values(:)

         values = int(row%column(row%place_of(name))%integers)
      end function integers

      pure function reals(name) result(values)
         character(*), intent(in) :: name
         real(wp), allocatable :: values(:)

         values = row%column(row%place_of(name))%reals
      end function reals

   end subroutine unpack_cell

   pure function text_of(codes) result(text)
      integer, intent(in) :: codes(:)
      character(size(codes)) :: text

      integer :: i

      do i = 1, size(codes)
         text(i:i) = achar(codes(i))
      end do
   end function text_of

   !> Take the first line off a text.
   function first_line(text) result(line)
      character(:), allocatable, intent(inout) :: text
      character(:), allocatable :: line

      integer :: ends

      ends = index(text//new_line("a"), new_line("a"))
      line = text(:ends - 1)
      text = text(ends + 1:)
   end function first_line

   !> Arrivals as numbers, for the other ranks.
   pure function pack_arrivals(arrival) result(numbers)
      type(arrival_t), intent(in) :: arrival(:)
      real(wp), allocatable :: numbers(:)

      integer :: i

      allocate (numbers(0))
      do i = 1, size(arrival)
         numbers = [numbers, real([arrival(i)%cell, arrival(i)%periods, arrival(i)%side], wp), arrival(i)%parameter, &
                    arrival(i)%x]
      end do
   end function pack_arrivals

   !> Arrivals with states of n unknowns.
   pure function unpack_arrivals(numbers, n) result(arrival)
      real(wp), intent(in) :: numbers(:)
      integer, intent(in) :: n
      type(arrival_t), allocatable :: arrival(:)

      integer :: at, i

      allocate (arrival(size(numbers)/(4 + n)))
      do i = 1, size(arrival)
         at = (i - 1)*(4 + n)
         arrival(i) = arrival_t(nint(numbers(at + 1)), nint(numbers(at + 2)), nint(numbers(at + 3)), numbers(at + 4), &
                                numbers(at + 5:at + 4 + n))
      end do
   end function unpack_arrivals

end module razy_study_follow_cells
