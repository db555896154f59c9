!! A motion of an earlier file of razy-follow, which another branch begins with.
module razy_study_follow_stored
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower, string_t
   use razy_input_input, only: input_t
   use razy_io_stored_file, only: stored_file_t
   implicit none(type, external)
   private

   public :: read_stored, stored_motion_t

   !> The point, a row of /point from 0; displacements and velocities (2 coordinates), m, rad, m/s, rad/s, at a phase of the
   !> excitation; the period, s, and how many of the excitation's it takes.
   type :: stored_motion_t
      character(:), allocatable :: file
      integer :: point = -1, periods = 1
      real(wp), allocatable :: state(:)
      real(wp) :: phase = 0.0_wp, period = 0.0_wp
      !> The value of the parameter that is followed here, if it was the one that was followed there.
      logical :: has_parameter = .false.
      real(wp) :: parameter = 0.0_wp
   end type stored_motion_t

contains

   !> Read the motion that &follow names, if it does; `parameter` as it is called in result files.
   subroutine read_stored(motion, input, parameter, error)
      type(stored_motion_t), allocatable, intent(out) :: motion
      type(input_t), intent(in) :: input
      character(*), intent(in) :: parameter
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(stored_file_t) :: file
      character(:), allocatable :: key, program
      logical :: by_label, by_point

      by_label = input%given("follow", 1, "start_label")
      by_point = input%given("follow", 1, "start_point")
      key = merge("start_label", "start_point", by_label)
      if (.not. input%given("follow", 1, "start_file")) then
         if (by_label .or. by_point) call input%complain(error, "follow", 1, key, "only with start_file, the file that has it")
         return
      else if (by_label .and. by_point) then
         call input%complain(error, "follow", 1, "start_label", "one of start_point and start_label")
      else if (.not. (by_label .or. by_point)) then
         call input%complain(error, "follow", 1, "start_file", "with start_point or start_label, which say which motion of it")
      end if
      if (allocated(error)) return
      allocate (motion)
      call input%get("follow", 1, "start_file", motion%file)
      call file%begin_reading(motion%file, "is no HDF5 file that can be read", problem)
      if (allocated(problem)) then
         call input%complain(error, "follow", 1, "start_file", "a file of razy-follow; "//problem%message)
         return
      end if
      call file%read_attribute("program", program)
      if (program /= "razy-follow") then
         call input%complain(error, "follow", 1, "start_file", "a file of razy-follow")
      else
         if (by_label) call find_label(motion, file, input, problem, error)
         if (by_point) call input%get("follow", 1, "start_point", motion%point)
         if (.not. (allocated(error) .or. allocated(problem))) then
            call read_point(motion, file, input, key, parameter, problem, error)
         end if
         if (allocated(problem)) call input%complain(error, "follow", 1, "start_file", "a file of razy-follow; "//problem%message)
      end if
      call file%end_reading()
   end subroutine read_stored

   !> The point that bears a label, `PD2` the second PD of the file. `problem`: the file is not as it should be.
   subroutine find_label(motion, file, input, problem, error)
      type(stored_motion_t), intent(inout) :: motion
      type(stored_file_t), intent(in) :: file
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: problem, error

      type(string_t), allocatable :: label(:)
      real(wp), allocatable :: point(:)
      integer(i8), allocatable :: shape(:)
      character(:), allocatable :: known, wanted
      integer :: i, number

      call file%read_texts("/special/label", label, problem)
      if (allocated(problem)) return
      call file%read_numbers("/special/point", point, shape, problem)
      if (allocated(problem)) return
      if (size(point) /= size(label)) then
         call raise(problem, "/special is not whole")
         return
      end if
      call input%get("follow", 1, "start_label", wanted)
      known = ""
      do i = 1, size(label)
         associate (name => label(i)%text)
            number = count([(label(number)%text == name, number=1, i)])
            if (lower(wanted) == lower(name)//to_text(number)) motion%point = nint(point(i))
            if (any([(label(number)%text == name, number=i + 1, size(label))])) cycle
            known = known//", "//name//"1"
            if (number > 1) known = known//" to "//name//to_text(number)
         end associate
      end do
      if (motion%point >= 0) return
      if (known == "") known = ", no labels"
      call input%complain(error, "follow", 1, "start_label", "a label with its number in the file, which has "//known(3:))
   end subroutine find_label

   !> What is stored of the point.
   subroutine read_point(motion, file, input, key, parameter, problem, error)
      type(stored_motion_t), intent(inout) :: motion
      type(stored_file_t), intent(in) :: file
      type(input_t), intent(in) :: input
      character(*), intent(in) :: key, parameter
      type(error_t), allocatable, intent(out) :: problem, error

      real(wp), allocatable :: values(:)
      integer(i8), allocatable :: shape(:)
      integer :: n
      real(wp) :: multiplicity

      multiplicity = 0.0_wp
      call take("phase", motion%phase)
      call take("period", motion%period)
      call take("multiplicity", multiplicity)
      motion%periods = nint(multiplicity)
      motion%has_parameter = file%has("/point/"//parameter)
      if (motion%has_parameter) call take(parameter, motion%parameter)
      if (.not. (allocated(problem) .or. allocated(error))) call file%read_numbers("/point/state", values, shape, problem)
      if (allocated(problem) .or. allocated(error)) return
      n = 0
      if (size(shape) == 2) n = int(shape(1))
      if (n == 0 .or. size(values, kind=i8) < n*(motion%point + 1_i8)) then
         call raise(problem, "/point/state is not whole")
         return
      end if
      motion%state = values(n*motion%point + 1:n*(motion%point + 1))
      associate (numbers => [motion%state, motion%phase, motion%period, motion%parameter])
         if (all(ieee_is_finite(numbers)) .and. motion%periods > 0 .and. motion%period > 0.0_wp) return
      end associate
      call input%complain(error, "follow", 1, key, "a motion with a period, whose numbers are finite")

   contains

      subroutine take(name, value)
         character(*), intent(in) :: name
         real(wp), intent(inout) :: value

         if (allocated(problem) .or. allocated(error)) return
         call file%read_numbers("/point/"//name, values, shape, problem)
         if (allocated(problem)) return
         if (motion%point < size(values)) then
            value = values(motion%point + 1)
         else
            call input%complain(error, "follow", 1, key, "a row of /point, from 0 to "//to_text(size(values) - 1))
         end if
      end subroutine take

   end subroutine read_point

end module razy_study_follow_stored
