!! How the special points of the branches change with values of the machine that &follow names.
module razy_study_follow_sensitivities
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_sensitivity, only: find_slope
   use razy_study_follow_family, only: is_of_machine
   use razy_study_sweep_axes, only: shares, varied_t
   implicit none(type, external)
   private

   public :: moves, new_sensitivities, sensitivities_t

   !> `key`: the values; of each special point branch, point of it and row of /special, from 0 (points); derivatives of the
   !> parameter by the keys in their units and how far they may be off, NaN where the point was not found again, and why
   !> (keys, points).
   type :: sensitivities_t
      type(varied_t), allocatable :: key(:)
      integer, allocatable, private :: branch(:), place(:), special(:)
      real(wp), allocatable, private :: slope(:, :), error(:, :)
      character(200), allocatable, private :: reason(:, :)
   contains
      procedure :: find
      procedure :: columns
      procedure :: words
   end type sensitivities_t

   !> Kinds of points that a change of the machine moves and leaves what they are.
   character(*), parameter :: moves(*) = [character(2) :: "LP", "PD", "TR", "GR", "ST", "SL"]

contains

   !> Which values &follow names, beside those that it varies.
   subroutine new_sensitivities(self, input, varied, error)
      type(sensitivities_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(varied_t), intent(in) :: varied(:)
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(string_t), allocatable :: paths(:)
      integer :: i, k

      call input%get("follow", 1, "sensitivities", paths)
      allocate (self%key(size(paths)), self%branch(0), self%place(0), self%special(0), self%slope(size(paths), 0), &
                self%error(size(paths), 0), self%reason(size(paths), 0))
      do k = 1, size(paths)
         call new_key(self%key(k), paths(k)%text)
         if (allocated(error)) return
         if (any([(shares(self%key(k)%slot, varied(i)%slot), i=1, size(varied))]) .or. &
             any([(shares(self%key(k)%slot, self%key(i)%slot), i=1, k - 1)])) then
            call complain("each value once, and none that &follow varies")
            return
         end if
      end do

   contains

      !> Values that vary in proportion, as in 'load(1)%value + load(2)%value'.
      subroutine new_key(key, text)
         type(varied_t), intent(out) :: key
         character(*), intent(in) :: text

         character(:), allocatable :: rest
         integer :: j, n

         n = count([(text(j:j) == "+", j=1, len(text))]) + 1
         allocate (key%slot(n))
         key%parameter = ""
         rest = text//"+"
         do j = 1, n
            associate (slot => key%slot(j))
               call input%locate(trim(adjustl(rest(:index(rest, "+") - 1))), slot, problem)
               rest = rest(index(rest, "+") + 1:)
               if (allocated(problem)) then
                  call complain(problem%message)
               else if (slot%whole .or. .not. is_of_machine(slot%path)) then
                  call complain("real values that the machine has")
               else if (.not. abs(slot%number) > 0.0_wp) then
                  call complain("values that the input gives and that are not 0, as the steps are parts of them")
               end if
               if (allocated(error)) return
               key%parameter = key%parameter//"+"//slot%path
            end associate
         end do
         key%parameter = key%parameter(2:)
         key%factor = key%slot%number/key%slot(1)%number
         key%unit = key%slot(1)%unit
      end subroutine new_key

      subroutine complain(allowed)
         character(*), intent(in) :: allowed

         call input%complain(error, "follow", 1, "sensitivities", allowed)
      end subroutine complain

   end subroutine new_sensitivities

   !> Find them for the branches, of a problem whose last parameters are the keys.
   subroutine find(self, problem, branch)
      class(sensitivities_t), intent(inout) :: self
      type(problem_t), intent(inout) :: problem
      type(branch_t), intent(in) :: branch(:)

      real(wp) :: error(size(self%key)), slope(size(self%key))
      character(200) :: reason(size(self%key))
      logical :: found
      integer :: b, i, k, n, special

      if (size(self%key) == 0) return
      special = -1
      n = size(self%key)
      do b = 1, size(branch)
         do i = 1, branch(b)%count
            associate (point => branch(b)%point(i))
               if (point%label == "") cycle
               special = special + 1
               if (.not. any(point%label == moves)) cycle
               do k = 1, n
                  reason(k) = ""
                  call find_slope(problem, point, branch(b)%periods, size(problem%parameter) - n + k, slope(k), error(k), found)
                  if (found) cycle
                  slope(k) = ieee_value(slope(k), ieee_quiet_nan)
                  error(k) = slope(k)
                  reason(k) = problem%reason
               end do
               call problem%tell("sensitivities", size(self%branch) + 1, problem%value_of(point%orbit))
               self%branch = [self%branch, b]
               self%place = [self%place, i]
               self%special = [self%special, special]
               self%slope = reshape([self%slope, slope], [n, size(self%branch)])
               self%error = reshape([self%error, error], [n, size(self%branch)])
               self%reason = reshape([self%reason, reason], [n, size(self%branch)])
            end associate
         end do
      end do
   end subroutine find

   !> Their part of a result file.
   subroutine columns(self, table, varied)
      class(sensitivities_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(varied_t), intent(in) :: varied

      character(*), parameter :: group = "/sensitivity/", along = group//"sensitivity"
      character(64) :: name(size(self%key))
      character(:), allocatable :: unit
      real(wp) :: value(size(self%key))
      integer :: k

      if (size(self%key) == 0) return
      do k = 1, size(self%key)
         name(k) = self%key(k)%dotted()
         value(k) = self%key(k)%slot(1)%number
      end do
      call table%add(group//"name", name, "1", "values by which the parameter is derived", group//"key")
      call table%add(group//"value", value, "mixed", "what they are in the input", group//"key")
      call table%add(group//"special", self%special, "1", "row of /special, from 0", along)
      do k = 1, size(self%key)
         unit = ratio(varied%unit, self%key(k)%unit)
         associate (key => self%key(k))
            call table%add(group//key%dotted(), self%slope(k, :), unit, &
                           "derivative of "//varied%parameter//" by "//key%parameter//" at special points", along)
            call table%add(group//key%dotted()//"_error", self%error(k, :), unit, "how far it may be off", along)
         end associate
      end do
   end subroutine columns

   !> A line for each point and value.
   subroutine words(self, lines, branch, varied)
      class(sensitivities_t), intent(in) :: self
      type(string_t), allocatable, intent(inout) :: lines(:)
      type(branch_t), intent(in) :: branch(:)
      type(varied_t), intent(in) :: varied

      character(:), allocatable :: place
      real(wp) :: part
      integer :: i, k

      do i = 1, size(self%branch)
         do k = 1, size(self%key)
            associate (key => self%key(k), slope => self%slope(k, i), error => self%error(k, i), &
                       point => branch(self%branch(i))%point(self%place(i)))
               place = "branch "//to_text(self%branch(i))//", point "//to_text(self%place(i))//", "//point%label
               if (ieee_is_finite(slope)) then
                  part = 0.01_wp*key%slot(1)%number
                  call append_text(lines, place//": +1 % of "//key%parameter//" moves it by "// &
                                   rounded(part*slope, abs(part*error))//unit_behind(varied%unit))
               else
                  call append_text(lines, place//": not found again with another "//key%parameter//": "//trim(self%reason(k, i)))
               end if
            end associate
         end do
      end do
   end subroutine words

   !> A number with the decimals that its error leaves, no more than anybody reads.
   pure function rounded(number, error) result(text)
      real(wp), intent(in) :: number, error
      character(:), allocatable :: text

      integer, parameter :: most = 6

      text = decimal(number, max(0, min(most - ceiling(log10(max(abs(number), error))), floor(-log10(error)), 2*most)))
   end function rounded

   pure function unit_behind(unit) result(text)
      character(*), intent(in) :: unit
      character(:), allocatable :: text

      text = ""
      if (unit /= "1") text = " "//unit
   end function unit_behind

   !> The unit of one quantity over another.
   pure function ratio(above, below) result(unit)
      character(*), intent(in) :: above, below
      character(:), allocatable :: unit

      unit = bracketed(above)
      if (below /= "1" .and. below /= "") unit = unit//"/"//bracketed(below)
   end function ratio

   !> A unit that another may stand beside.
   pure function bracketed(unit) result(text)
      character(*), intent(in) :: unit
      character(:), allocatable :: text

      text = unit
      if (text == "") text = "1"
      if (scan(text, " /") > 0) text = "("//text//")"
   end function bracketed

end module razy_study_follow_sensitivities
