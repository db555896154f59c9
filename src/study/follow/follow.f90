!! What &follow asks for: the first motion, its branch, and the branches that begin where periods double or symmetry breaks; with a
!! second &follow the curves of their special points over two parameters.
module razy_study_follow_follow
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_orbits_beyond_touch, only: switch_at_touch
   use razy_orbits_branch, only: branch_t
   use razy_orbits_curve, only: curve_t
   use razy_orbits_identity, only: is_same_motion
   use razy_orbits_orbit, only: orbit_t, problem_t
   use razy_orbits_search, only: found_t, is_on, new_found, search_t
   use razy_orbits_start, only: find_beside, find_periodic
   use razy_orbits_switch, only: switch_branch
   use razy_orbits_user_values, only: mark_values
   use razy_study_follow_family, only: case_family_t, is_of_machine
   use razy_study_follow_sensitivities, only: moves, new_sensitivities, sensitivities_t
   use razy_study_follow_stored, only: read_stored, stored_motion_t
   use razy_study_sweep_axes, only: check_apart, new_varied, varied_t
   implicit none(type, external)
   private

   public :: follow_t, new_follow, sample_t

   !> What was seen at a value of the parameter: largest Lyapunov exponent of the machine's own motion and its standard error,
   !> 1/s; of the motions that starts settled to, the branch and the number of starts; starts that settled to none.
   type :: sample_t
      real(wp) :: parameter = 0.0_wp, exponent = 0.0_wp, error = 0.0_wp
      integer :: unsettled = 0
      integer, allocatable :: branch(:), starts(:)
      !> Why nothing was found; empty if something was.
      character(:), allocatable :: reason
   end type sample_t

   type :: follow_t
      type(problem_t) :: problem
      type(branch_t), allocatable :: branch(:)
      integer :: count = 0
      type(curve_t), allocatable :: curve(:)
      integer :: curves = 0
      !> What each &follow says: what varies (1 or 2), from where to where.
      type(varied_t), allocatable :: varied(:)
      real(wp), allocatable :: first(:), last(:)
      !> Values of the first parameter at which motions are stored whatever the steps.
      real(wp), allocatable :: values(:)
      real(wp) :: from = 0.0_wp
      type(sensitivities_t) :: sensitivities
      !> A motion of another file that the first branch begins with.
      type(stored_motion_t), allocatable :: stored
      real(wp), private :: time = 0.0_wp
      integer, private :: period = 0, most_points = 0, settle = 0
      integer :: doublings = 0
      logical :: settled = .false.
      !> All motions are wanted, looked for at so many values of the parameter, and how.
      logical :: all_motions = .false.
      integer :: samples = 0
      type(search_t) :: search
      type(sample_t), allocatable :: sample(:)
   contains
      procedure :: compute
      procedure :: plan
      procedure :: reset
      procedure :: follow_from
      procedure :: place_on
      procedure :: contact_name
      procedure, private :: one_branch
      procedure, private :: curve_through
   end type follow_t

   !> Doublings nearer than this, in the scale of the parameter, are compared.
   real(wp), parameter :: same = 1.0e-8_wp
   !> The branches that a file holds at most.
   integer, parameter :: most_branches = 64, most_curves = 64
   !> Points of a curve on each side of where it was found.
   integer, parameter :: most_on_curve = 150

contains

   !> Read &follow, and make the first machine.
   subroutine new_follow(self, input, error)
      type(follow_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(case_family_t) :: family
      type(error_t), allocatable :: problem
      integer :: i, n

      n = input%count("follow")
      if (n == 0) then
         call input%complain(error, "follow", 1, "parameter", "required: the group%key that razy-follow varies")
         return
      else if (n > 2) then
         call input%complain(error, "follow", 3, "parameter", "at most two &follow groups, one for each parameter")
         return
      end if
      allocate (self%varied(n), self%first(n), self%last(n))
      do i = 1, n
         call read_parameter(self, input, i, error)
         if (.not. allocated(error) .and. i == 2) call check_apart(self%varied, input, "follow", error)
         if (allocated(error)) return
      end do
      call new_sensitivities(self%sensitivities, input, self%varied, error)
      if (allocated(error)) return
      family%input = input
      allocate (family%varied(n + size(self%sensitivities%key)))
      family%varied(:n) = self%varied
      family%varied(n + 1:) = self%sensitivities%key
      call read_from(self, input, error)
      if (allocated(error)) return
      allocate (self%values(0))
      if (input%given("follow", 1, "values")) call input%get("follow", 1, "values", self%values)
      if (any((self%values - self%first(1))*(self%values - self%last(1)) > 0.0_wp)) then
         call input%complain(error, "follow", 1, "values", "values between first and last")
         return
      end if
      call input%get("follow", 1, "period", self%period)
      call input%get("follow", 1, "doublings", self%doublings)
      call input%get("follow", 1, "max_points", self%most_points)
      call input%get("follow", 1, "settle", self%settle)
      call read_all(self, input, error)
      if (allocated(error)) return
      self%problem%map%family = family
      self%problem%parameter = [(family%varied(i)%slot(1)%number, i=1, size(family%varied))]
      do i = 1, 2
         self%problem%parameter(1) = merge(self%last(1), self%from, i == 1)
         call self%problem%map%go_to(self%problem%parameter, problem)
         if (.not. allocated(problem) .and. self%problem%map%n == 0) then
            call raise(problem, "no contact, and no &record but that of the state, feels a motion that springs or dampers "// &
                       "resist: record a displacement")
         end if
         if (.not. allocated(problem)) cycle
         call input%complain(error, "follow", 1, "parameter", problem%message)
         return
      end do
      if (allocated(self%stored)) call check_stored(self, input, error)
      if (allocated(error)) return
      if (self%all_motions .and. self%problem%is_autonomous()) then
         call input%complain(error, "follow", 1, "motions", "'one': all motions are looked for where there is an excitation")
         return
      end if
      select type (made => self%problem%map%family)
      type is (case_family_t)
         self%time = made%motion%t_end
         if (made%motion%method%integrator /= "exact") call self%problem%take_steps(made%motion%method%relative_tolerance)
      end select
   end subroutine new_follow

   !> Where the first motion is looked for, and the stored one near which it is.
   subroutine read_from(self, input, error)
      class(follow_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      logical :: given

      given = input%given("follow", 1, "from")
      self%from = self%first(1)
      call read_stored(self%stored, input, self%varied(1)%dotted(), error)
      if (allocated(error)) return
      if (allocated(self%stored)) then
         if (self%stored%has_parameter) self%from = self%stored%parameter
      end if
      if (given) call input%get("follow", 1, "from", self%from)
      if (is_beyond(self, self%from)) then
         if (given) then
            call input%complain(error, "follow", 1, "from", "a value between first and last")
         else
            call input%complain(error, "follow", 1, "start_file", "a motion between first and last; this one is at "// &
                                to_text(self%from))
         end if
      end if
   end subroutine read_from

   !> Refuse a stored motion of another machine, or of other periods than those that are asked for.
   subroutine check_stored(self, input, error)
      class(follow_t), intent(in) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: coordinates

      select type (family => self%problem%map%family)
      type is (case_family_t)
         coordinates = size(family%machine%displacement)
         if (size(self%stored%state) /= 2*coordinates) then
            call input%complain(error, "follow", 1, "start_file", "a file of a machine with as many coordinates, "// &
                                to_text(coordinates)//"; its has "//to_text(size(self%stored%state)/2))
         else if (self%period > 0 .and. self%period /= self%stored%periods) then
            call input%complain(error, "follow", 1, "period", "not with start_file, or that of its motion, "// &
                                to_text(self%stored%periods))
         end if
      end select
   end subroutine check_stored

   !> Whether a value is outside the range by more than rounding.
   pure logical function is_beyond(self, value)
      class(follow_t), intent(in) :: self
      real(wp), intent(in) :: value

      associate (first => self%first(1), last => self%last(1))
         is_beyond = max(min(first, last) - value, value - max(first, last)) > same*abs(last - first)
      end associate
   end function is_beyond

   !> Whether all motions are wanted, and where they are looked for.
   subroutine read_all(self, input, error)
      class(follow_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      !> Periods of a motion that are looked for if nothing is said.
      integer, parameter :: usual_periods = 4
      character(*), parameter :: of_all(*) = [character(7) :: "samples", "starts"]
      integer :: i

      self%all_motions = input%choice("follow", 1, "motions") == "all"
      call input%get("follow", 1, "samples", self%samples)
      call input%get("follow", 1, "starts", self%search%starts)
      self%search%settle = self%settle
      self%search%most_periods = merge(self%period, usual_periods, self%period > 0)
      if (self%all_motions .and. allocated(self%stored)) then
         call input%complain(error, "follow", 1, "start_file", "not with motions='all', which begins everywhere")
      else if (self%all_motions .and. size(self%sensitivities%key) > 0) then
         call input%complain(error, "follow", 1, "sensitivities", "not with motions='all': of one motion, as start_file gives it")
      else if (self%all_motions .and. size(self%varied) > 1) then
         call input%complain(error, "follow", 1, "motions", "'one': curves over two parameters begin on the branches of one motion")
      else if (self%all_motions .and. input%given("follow", 1, "from")) then
         call input%complain(error, "follow", 1, "from", "not with motions='all', which looks at samples= values")
      else if (self%all_motions .and. self%settle < 2*self%search%most_periods) then
         call input%complain(error, "follow", 1, "settle", "at least twice the periods of a motion")
      end if
      do i = 1, size(of_all)
         if (allocated(error) .or. self%all_motions) return
         if (input%given("follow", 1, trim(of_all(i)))) call input%complain(error, "follow", 1, trim(of_all(i)), &
                                                                            "only with motions='all'")
      end do
   end subroutine read_all

   !> What &follow number i varies, and its range.
   subroutine read_parameter(self, input, i, error)
      class(follow_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: common(*) = [character(13) :: "from", "start_file", "start_point", "start_label", "period", &
                                                                               "settle", "doublings", "max_points", "sensitivities"]
      integer :: k

      call new_varied(self%varied(i), input, "follow", i, error)
      if (allocated(error)) return
      associate (slot => self%varied(i)%slot)
         do k = 1, size(slot)
            if (slot(k)%whole) then
               call input%complain(error, "follow", i, "parameter", "a real number: motions are followed over a continuous value")
            else if (.not. is_of_machine(slot(k)%path)) then
               call input%complain(error, "follow", i, "parameter", "a value that the machine has")
            end if
            if (allocated(error)) return
         end do
      end associate
      call input%get("follow", i, "first", self%first(i))
      call input%get("follow", i, "last", self%last(i))
      associate (first => self%first(i), last => self%last(i), now => self%varied(i)%slot(1)%number)
         if (.not. abs(last - first) > 1.0e-9_wp*max(abs(first), abs(last))) then
            call input%complain(error, "follow", i, "last", "a value apart from first")
         else if (i == 2 .and. (now - first)*(now - last) > 0.0_wp) then
            call input%complain(error, "follow", 2, "first", "a range that holds "//to_text(now)//", the value that "// &
                                self%varied(2)%parameter//" has in the input")
         end if
      end associate
      if (i == 1) return
      do k = 1, size(common)
         if (allocated(error)) return
         if (input%given("follow", 2, trim(common(k)))) call input%complain(error, "follow", 2, trim(common(k)), &
                                                                            "given in the first &follow only")
      end do
   end subroutine read_parameter

   !> What is going to be done, in lines.
   function plan(self) result(lines)
      class(follow_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      integer :: i, k

      allocate (lines(0))
      do i = 1, size(self%varied)
         associate (varied => self%varied(i))
            call append_text(lines, "parameter: "//varied%parameter//" from "//to_text(self%first(i))//" to "// &
                             to_text(self%last(i))//" "//varied%unit)
            do k = 2, size(varied%slot)
               call append_text(lines, "           with "//varied%slot(k)%path//", "//to_text(varied%factor(k))//" times it")
            end do
         end associate
      end do
      if (self%all_motions) then
         call append_text(lines, "starts: at "//to_text(self%samples)//" values, of motions of up to "// &
                          to_text(self%search%most_periods)//" periods")
      else if (allocated(self%stored)) then
         call append_text(lines, "starts: at "//to_text(self%from)//", with point "//to_text(self%stored%point)//" of "// &
                          self%stored%file//", of period "//to_text(self%stored%periods))
      else
         call append_text(lines, "starts: at "//to_text(self%from)//", with what the machine settles to")
      end if
      call append_text(lines, "branches: of at most "//to_text(self%most_points)//" points, doublings followed "// &
                       to_text(self%doublings)//" times in a row")
      if (size(self%values) > 0) call append_text(lines, "values: "//to_text(size(self%values))//" at which motions are stored")
      do i = 1, size(self%sensitivities%key)
         call append_text(lines, "sensitivities: to "//self%sensitivities%key(i)%parameter)
      end do
   end function plan

   !> Find the first motion and follow all branches that begin from it; with `few` no more than so many points of each.
   subroutine compute(self, error, few)
      class(follow_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: few

      type(orbit_t) :: orbit
      real(wp), allocatable :: begin(:), guide(:)
      integer :: from, i, side

      call self%reset()
      if (present(few)) self%most_points = min(few, self%most_points)
      begin = self%problem%parameter
      begin(1) = self%from
      if (allocated(self%stored)) then
         call begin_with_stored(self, begin, orbit, guide, error)
      else
         call find_periodic(self%problem, begin, abs(self%last(1) - self%first(1)), self%period, self%settle, self%time, orbit, &
                            self%settled, error)
      end if
      if (allocated(error)) return
      side = 0
      if (is_at(self%last(1))) side = -1
      if (is_at(self%first(1))) side = 1
      call self%follow_from(orbit, side, guide)
      call self%sensitivities%find(self%problem, self%branch(:self%count))
      allocate (self%curve(most_curves))
      if (size(self%varied) < 2) return
      do i = 1, self%count
         do from = 1, self%branch(i)%count
            call self%curve_through(i, from)
         end do
      end do

   contains

      pure logical function is_at(end)
         real(wp), intent(in) :: end

         is_at = abs(self%from - end) <= same*abs(self%last(1) - self%first(1))
      end function is_at

   end subroutine compute

   !> The motion nearest to the stored one at these parameters, and the direction of its branch towards `last`.
   subroutine begin_with_stored(self, parameter, orbit, guide, error)
      class(follow_t), intent(inout) :: self
      real(wp), intent(in) :: parameter(:)
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: guide(:)
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: missed

      associate (problem => self%problem, stored => self%stored)
         self%settled = .true.
         problem%periods = stored%periods
         call problem%map%go_to(parameter, error)
         if (allocated(error)) return
         call find_beside(problem, parameter, abs(self%last(1) - self%first(1)), problem%map%from_coordinates(stored%state), &
                          stored%phase, stored%period, orbit, guide, missed)
         if (allocated(missed)) then
            call raise(error, "no motion of this machine is near point "//to_text(stored%point)//" of "//stored%file//": "// &
                       missed%message)
            return
         end if
         guide = sign(1.0_wp, guide(size(guide))*(self%last(1) - self%first(1)))*guide
         if (.not. is_beyond(self, problem%value_of(orbit))) return
         call raise(error, "the motion nearest to point "//to_text(stored%point)//" of "//stored%file// &
                    " is outside the range, at "//to_text(problem%value_of(orbit)))
      end associate
   end subroutine begin_with_stored

   !> Forget all branches.
   subroutine reset(self)
      class(follow_t), intent(inout) :: self

      self%count = 0
      self%curves = 0
      if (allocated(self%branch)) deallocate (self%branch)
      allocate (self%branch(most_branches))
      if (.not. allocated(self%sample)) allocate (self%sample(0))
   end subroutine reset

   !> Follow a motion of the problem's periods to both sides (0), towards `last` (1) or `first` (-1), and all branches that
   !> begin on these; `towards`: the direction of `last`, if it is not that of the parameter.
   subroutine follow_from(self, orbit, side, towards)
      class(follow_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit
      integer, intent(in) :: side
      real(wp), intent(in), optional :: towards(:)

      real(wp) :: guide(size(orbit%u))
      integer :: from, i, side_left

      i = self%count
      side_left = side
      guide = 0.0_wp
      guide(size(guide)) = sign(1.0_wp, self%last(1) - self%first(1))
      if (present(towards)) guide = towards
      if (side >= 0) call self%one_branch(orbit, guide, 0)
      if (self%count > i) then
         ! A closed branch has been gone round.
         if (self%branch(self%count)%closed) side_left = 1
      end if
      if (side_left <= 0) call self%one_branch(orbit, -guide, 0)
      do while (i < self%count)
         i = i + 1
         from = 0
         do while (from < self%branch(i)%count)
            from = from + 1
            call follow_switched(self, i, from)
         end do
      end do
   end subroutine follow_from

   !> The first branch that a motion lies on; 0: none.
   integer function place_on(self, motion) result(place)
      class(follow_t), intent(inout) :: self
      type(found_t), intent(in) :: motion

      do place = 1, self%count
         if (is_on(motion, self%problem, self%branch(place))) return
      end do
      place = 0
   end function place_on

   !> Name of a contact, if it is one.
   function contact_name(self, contact) result(name)
      class(follow_t), intent(in) :: self
      integer, intent(in) :: contact
      character(:), allocatable :: name

      name = ""
      if (contact == 0) return
      select type (family => self%problem%map%family)
      type is (case_family_t)
         name = family%machine%contact(contact)%name
      end select
   end function contact_name

   !> The curve of a special point over both parameters, unless one goes through it already.
   subroutine curve_through(self, branch, place)
      class(follow_t), intent(inout) :: self
      integer, intent(in) :: branch, place

      real(wp) :: at(2), range(2)
      integer :: i

      associate (problem => self%problem, point => self%branch(branch)%point(place))
         if (.not. any(point%label == moves) .or. self%curves == most_curves) return
         at = [problem%value_of(point%orbit), problem%parameter(2)]
         range = abs(self%last - self%first)
         do i = 1, self%curves
            if (self%curve(i)%periods == self%branch(branch)%periods .and. &
                self%curve(i)%passes(point, at, range)) return
         end do
         self%curves = self%curves + 1
         problem%periods = self%branch(branch)%periods
         problem%map%phase = point%orbit%phase
         associate (curve => self%curve(self%curves))
            curve%branch = branch
            call curve%follow(problem, point, min(self%first, self%last), max(self%first, self%last), range(2), most_on_curve)
         end associate
      end associate
   end subroutine curve_through

   !> The branch of a motion on the side of `guide`, which begins on branch `parent`, so far `away`; 0: it was found by itself.
   subroutine one_branch(self, orbit, guide, parent, away)
      class(follow_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(in) :: guide(:)
      integer, intent(in) :: parent
      real(wp), intent(in), optional :: away

      if (self%count == most_branches) return
      self%count = self%count + 1
      associate (branch => self%branch(self%count), ends => [self%first(1), self%last(1)]/self%problem%range)
         branch%parent = parent
         call branch%follow(self%problem, orbit, guide, minval(ends), maxval(ends), self%most_points, away)
         call mark_values(branch, self%problem, self%values/self%problem%range)
      end associate
   end subroutine one_branch

   !> The branches that begin at a point, if it is a doubling or a branch point of a branch that is not itself the child of
   !> too many.
   subroutine follow_switched(self, parent, place)
      class(follow_t), intent(inout) :: self
      integer, intent(in) :: parent, place

      type(orbit_t) :: orbit
      type(found_t) :: motion
      real(wp), allocatable :: guide(:)
      real(wp) :: away
      character(2) :: label
      integer :: side
      logical :: ok

      label = self%branch(parent)%point(place)%label
      if (label == "GR" .and. place == self%branch(parent)%count) call follow_past_touch(self, parent)
      if (label /= "PD" .and. label /= "BP") return
      if (generation(self, parent) >= self%doublings) return
      if (label == "PD") then
         call find_reached(self, parent, place, ok)
         if (ok) return
      end if
      do side = 1, merge(1, 2, label == "PD")
         if (self%count == most_branches) return
         self%problem%periods = self%branch(parent)%periods
         call switch_branch(self%problem, self%branch(parent)%point(place), side == 1, orbit, guide, away, ok)
         if (.not. ok) cycle
         call new_found(motion, self%problem, orbit)
         if (self%place_on(motion) > 0) cycle
         call self%one_branch(orbit, guide, parent, away)
      end do
   end subroutine follow_switched

   !> The other branches at the touch of stops that ends this one, unless one has come to it.
   subroutine follow_past_touch(self, parent)
      class(follow_t), intent(inout) :: self
      integer, intent(in) :: parent

      type(orbit_t) :: orbit
      type(found_t) :: motion
      real(wp), allocatable :: guide(:)
      real(wp) :: away
      integer :: i, which
      logical :: more, ok

      if (self%count == most_branches) return
      associate (last => self%branch(parent)%point(self%branch(parent)%count))
         do i = 1, self%count
            if (i == parent .or. self%branch(i)%periods /= self%branch(parent)%periods) cycle
            associate (other => self%branch(i)%point(self%branch(i)%count), p => size(last%orbit%u))
               if (other%label == "GR" .and. abs(other%orbit%u(p) - last%orbit%u(p)) <= same) return
            end associate
         end do
      end associate
      do which = 0, size(self%branch)
         if (self%count == most_branches) return
         self%problem%periods = self%branch(parent)%periods
         associate (here => self%branch(parent), n => self%branch(parent)%count)
            call switch_at_touch(self%problem, here%point(n - 1), here%point(n), which, orbit, guide, away, more, ok)
         end associate
         if (ok) call new_found(motion, self%problem, orbit)
         do i = 1, self%count
            if (ok .and. i /= parent) ok = .not. is_on(motion, self%problem, self%branch(i))
         end do
         if (ok) then
            call self%one_branch(orbit, guide, parent, away)
            associate (branch => self%branch(self%count))
               ! One motion that nothing leads on from is no branch.
               branch%from_touch = branch%count > 1
               if (branch%count == 1) self%count = self%count - 1
               if (branch%count == 1) branch%count = 0
            end associate
         end if
         if (.not. more) return
      end do
   end subroutine follow_past_touch

   !> Whether a branch of twice the period has already come to an end at this doubling.
   subroutine find_reached(self, parent, place, reached)
      class(follow_t), intent(inout) :: self
      integer, intent(in) :: parent, place
      logical, intent(out) :: reached

      integer :: i

      reached = .false.
      self%problem%periods = self%branch(parent)%periods
      associate (point => self%branch(parent)%point(place)%orbit)
         do i = 1, self%count
            associate (other => self%branch(i))
               if (other%periods /= 2*self%branch(parent)%periods .or. other%parent == 0) cycle
               associate (last => other%point(other%count))
                  if (last%label /= "EP" .or. abs(last%orbit%u(size(point%u)) - point%u(size(point%u))) > same) cycle
                  call is_same_motion(self%problem, last%orbit, point, reached)
               end associate
            end associate
            if (reached) return
         end do
      end associate
   end subroutine find_reached

   pure integer function generation(self, i)
      class(follow_t), intent(in) :: self
      integer, intent(in) :: i

      integer :: k

      generation = 0
      k = i
      do while (self%branch(k)%parent > 0)
         if (.not. self%branch(k)%from_touch) generation = generation + 1
         k = self%branch(k)%parent
      end do
   end function generation

end module razy_study_follow_follow
