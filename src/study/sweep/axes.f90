!! The axes of a sweep: for each &sweep the values, and the places of the input that they go to.
!!
!! An axis may vary several values of the input together: each is the axis' value times a factor.
module razy_study_sweep_axes
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t, slot_t
   use razy_sweep_grid, only: axis_t, grid_t, new_axis, new_grid
   implicit none(type, external)
   private

   public :: check_apart, new_axes, new_varied, put_point, put_value, shares, varied_t

   !> What one &sweep varies: places of the input (places) and factors (places); name of the first, and its unit, of which the
   !> values of the axis are.
   type :: varied_t
      type(slot_t), allocatable :: slot(:)
      real(wp), allocatable :: factor(:)
      character(:), allocatable :: parameter, unit
   contains
      procedure :: dotted
   end type varied_t

contains

   !> Read all &sweep groups: what each varies, and the grid of their values. The last runs fastest.
   subroutine new_axes(varied, grid, input, error)
      type(varied_t), allocatable, intent(out) :: varied(:)
      type(grid_t), intent(out) :: grid
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(axis_t), allocatable :: axes(:)
      integer :: i, n

      n = input%count("sweep")
      if (n == 0) then
         call input%complain(error, "sweep", 1, "parameter", "required: the group%key that razy-sweep varies")
      else if (n > 2) then
         call input%complain(error, "sweep", 3, "parameter", "at most two &sweep groups, one for each axis of the grid")
      end if
      if (allocated(error)) return
      allocate (varied(n), axes(n))
      do i = 1, n
         call new_varied(varied(i), input, "sweep", i, error)
         if (.not. allocated(error)) call read_axis(axes(i), varied(i), input, i, error)
         if (.not. allocated(error) .and. i == 2) call check_second(varied, input, error)
         if (allocated(error)) return
      end do
      call new_grid(grid, axes, problem)
      if (allocated(problem)) call input%complain(error, "sweep", n, "points", "fewer points: "//problem%message)
   end subroutine new_axes

   !> Where the values of this group, number i, go.
   subroutine new_varied(varied, input, group, i, error)
      type(varied_t), intent(out) :: varied
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(string_t), allocatable :: paths(:)
      integer :: k

      call input%get(group, i, "parameter", paths)
      allocate (varied%slot(size(paths)))
      do k = 1, size(paths)
         call input%locate(paths(k)%text, varied%slot(k), problem)
         if (allocated(problem)) then
            call input%complain(error, group, i, "parameter", problem%message)
         else if (index(varied%slot(k)%path, group//"%") == 1 .or. index(varied%slot(k)%path, group//"(") == 1) then
            call input%complain(error, group, i, "parameter", "a value of another group than &"//group)
         else if (shares(varied%slot(:k - 1), varied%slot(k:k))) then
            call input%complain(error, group, i, "parameter", "each value once")
         end if
         if (allocated(error)) return
      end do
      varied%factor = spread(1.0_wp, 1, size(paths))
      if (input%given(group, i, "factor")) call input%get(group, i, "factor", varied%factor)
      if (size(varied%factor) /= size(paths)) then
         call input%complain(error, group, i, "factor", "one factor for each parameter")
      else if (abs(varied%factor(1) - 1.0_wp) > 0.0_wp) then
         call input%complain(error, group, i, "factor", "1 for the first parameter, whose values are those of the axis")
      end if
      if (allocated(error)) return
      varied%parameter = varied%slot(1)%path
      varied%unit = varied%slot(1)%unit
   end subroutine new_varied

   !> Refuse a second group that varies what the first one does.
   subroutine check_apart(varied, input, group, error)
      type(varied_t), intent(in) :: varied(:)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      type(error_t), allocatable, intent(out) :: error

      if (shares(varied(1)%slot, varied(2)%slot)) then
         call input%complain(error, group, 2, "parameter", "a value that the first &"//group//" does not vary")
      end if
   end subroutine check_apart

   !> Whether some of these places of an input are one.
   pure logical function shares(some, others)
      type(slot_t), intent(in) :: some(:), others(:)

      integer :: k

      shares = any([(any(others%instance == some(k)%instance .and. others%key == some(k)%key .and. &
                         others%element == some(k)%element), k=1, size(some))])
   end function shares

   !> Refuse a second axis that varies what the first one does, or says what is said for the whole sweep.
   subroutine check_second(varied, input, error)
      type(varied_t), intent(in) :: varied(:)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: common(*) = [character(16) :: "direction", "kind_of_motion", "until_periodic", &
                                                                                               "processor_time", "period_tolerance"]
      integer :: k

      call check_apart(varied, input, "sweep", error)
      if (allocated(error)) return
      ! An effective input says defaults too.
      k = findloc([(input%differs("sweep", 2, trim(common(k))), k=1, size(common))], .true., dim=1)
      if (k > 0) call input%complain(error, "sweep", 2, trim(common(k)), "given in the first &sweep only, for the whole sweep")
   end subroutine check_second

   !> The values of axis i, from first, last, and step or points. Those of an integer have to be whole: between both ends, which are
   !> tried as any other value.
   subroutine read_axis(axis, varied, input, i, error)
      type(axis_t), intent(out) :: axis
      type(varied_t), intent(in) :: varied
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      character(:), allocatable :: key, whole
      real(wp) :: first, last, step
      integer :: points

      call input%get("sweep", i, "first", first)
      call input%get("sweep", i, "last", last)
      step = input%number("sweep", i, "step", otherwise=0.0_wp)
      if (abs(step) > 0.0_wp .eqv. input%given("sweep", i, "points")) then
         call input%complain(error, "sweep", i, "step", "one of step and points has to be given")
         return
      end if
      if (abs(step) > 0.0_wp) then
         key = "step"
         whole = "a whole number, as "//varied%parameter//" is"
         call new_axis(axis, first, last, step, problem)
      else
         key = "points"
         whole = "a number that makes all values of "//varied%parameter//" whole numbers"
         call input%get("sweep", i, "points", points)
         call new_axis(axis, first, last, points, problem)
         if (points > 1) step = (last - first)/(points - 1)
      end if
      if (allocated(problem)) then
         call input%complain(error, "sweep", i, key, problem%message)
      else if (any(varied%slot%whole .and. abs(varied%factor*step - anint(varied%factor*step)) > 0.0_wp)) then
         call input%complain(error, "sweep", i, key, whole)
      end if
   end subroutine read_axis

   !> Set the values of an axis in the input; an error if a key does not allow one.
   pure subroutine put_value(varied, input, value, error)
      type(varied_t), intent(in) :: varied
      type(input_t), intent(inout) :: input
      real(wp), intent(in) :: value
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      do k = 1, size(varied%slot)
         call input%put(varied%slot(k), varied%factor(k)*value, error)
         if (allocated(error)) return
      end do
   end subroutine put_value

   !> Set the values of point number `point` of the grid.
   pure subroutine put_point(varied, grid, input, point, error)
      type(varied_t), intent(in) :: varied(:)
      type(grid_t), intent(in) :: grid
      type(input_t), intent(inout) :: input
      integer(i8), intent(in) :: point
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: values(size(varied))
      integer :: i

      values = grid%values(point)
      do i = 1, size(varied)
         call put_value(varied(i), input, values(i), error)
         if (allocated(error)) return
      end do
   end subroutine put_point

   !> The parameter as it is called in result files, with `.` for `%`.
   pure function dotted(self) result(name)
      class(varied_t), intent(in) :: self
      character(:), allocatable :: name

      integer :: i

      name = self%parameter
      do i = 1, len(name)
         if (name(i:i) == "%") name(i:i) = "."
      end do
   end function dotted

end module razy_study_sweep_axes
