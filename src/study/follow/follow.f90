!! What &follow asks for: the first motion, its branch, and the branches that begin where periods double or symmetry breaks.
module razy_study_follow_follow
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_input_input, only: input_t
   use razy_orbits_branch, only: branch_t
   use razy_orbits_orbit, only: orbit_t, problem_t
   use razy_orbits_start, only: find_periodic
   use razy_orbits_switch, only: switch_branch
   use razy_study_follow_family, only: case_family_t
   implicit none(type, external)
   private

   public :: follow_t, new_follow

   type :: follow_t
      type(problem_t) :: problem
      type(branch_t), allocatable :: branch(:)
      integer :: count = 0
      !> What &follow says.
      character(:), allocatable :: name, unit
      real(wp) :: first = 0.0_wp, last = 0.0_wp, from = 0.0_wp
      real(wp), private :: time = 0.0_wp
      integer, private :: period = 0, most_points = 0, settle = 0, doublings = 0
      logical :: settled = .false.
   contains
      procedure :: compute
      procedure, private :: one_branch
   end type follow_t

   !> Groups whose values are not the machine's.
   character(*), parameter :: machineless(*) = [character(8) :: "follow%", "sweep%", "tune%", "record%", "motion%", "starts%"]
   !> Motions nearer than this, relative to the state, where a branch ends in a doubling.
   real(wp), parameter :: same = 0.02_wp
   !> The branches that a file holds at most.
   integer, parameter :: most_branches = 64

contains

   !> Read &follow, and make the first machine.
   subroutine new_follow(self, input, error)
      type(follow_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(case_family_t) :: family
      type(error_t), allocatable :: problem
      character(:), allocatable :: path
      integer :: i

      if (input%count("follow") == 0) then
         call input%complain(error, "follow", 1, "parameter", "required: the group%key that razy-follow varies")
         return
      end if
      family%input = input
      allocate (family%slot(1))
      call input%get("follow", 1, "parameter", path)
      call input%locate(path, family%slot(1), problem)
      if (.not. allocated(problem)) then
         if (family%slot(1)%whole) call raise(problem, "a real number: motions are followed over a continuous value")
         if (any([(index(family%slot(1)%path, trim(machineless(i))) == 1, i=1, size(machineless))])) then
            call raise(problem, "a value that the machine has")
         end if
      end if
      if (allocated(problem)) then
         call input%complain(error, "follow", 1, "parameter", problem%message)
         return
      end if
      self%name = family%slot(1)%path
      self%unit = family%slot(1)%unit
      call input%get("follow", 1, "first", self%first)
      call input%get("follow", 1, "last", self%last)
      if (.not. abs(self%last - self%first) > 1.0e-9_wp*max(abs(self%first), abs(self%last))) then
         call input%complain(error, "follow", 1, "last", "a value apart from first")
         return
      end if
      self%from = self%first
      if (input%given("follow", 1, "from")) call input%get("follow", 1, "from", self%from)
      if ((self%from - self%first)*(self%from - self%last) > 0.0_wp) then
         call input%complain(error, "follow", 1, "from", "a value between first and last")
         return
      end if
      call input%get("follow", 1, "period", self%period)
      call input%get("follow", 1, "doublings", self%doublings)
      call input%get("follow", 1, "max_points", self%most_points)
      call input%get("follow", 1, "settle", self%settle)
      self%problem%map%family = family
      self%problem%parameter = [self%first]
      do i = 1, 2
         call self%problem%map%go_to([merge(self%last, self%from, i == 1)], problem)
         if (.not. allocated(problem)) cycle
         call input%complain(error, "follow", 1, "parameter", problem%message)
         return
      end do
      select type (made => self%problem%map%family)
      type is (case_family_t)
         self%time = made%motion%t_end
         if (made%motion%method%integrator /= "exact") call self%problem%take_steps()
      end select
   end subroutine new_follow

   !> Find the first motion and follow all branches that begin from it.
   subroutine compute(self, error)
      class(follow_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(orbit_t) :: orbit
      integer :: from, i

      allocate (self%branch(most_branches))
      call find_periodic(self%problem, [self%from], abs(self%last - self%first), self%period, self%settle, self%time, orbit, &
                         self%settled, error)
      if (allocated(error)) return
      if (abs(self%from - self%last) > 0.0_wp) call self%one_branch(orbit, 1.0_wp)
      if (abs(self%from - self%first) > 0.0_wp) call self%one_branch(orbit, -1.0_wp)
      i = 0
      do while (i < self%count)
         i = i + 1
         from = 0
         do while (from < self%branch(i)%count)
            from = from + 1
            call follow_switched(self, i, from)
         end do
      end do
   end subroutine compute

   !> The branch of a motion, towards `last` with `side` 1.
   subroutine one_branch(self, orbit, side)
      class(follow_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(in) :: side

      real(wp) :: guide(size(orbit%u))

      guide = 0.0_wp
      guide(size(guide)) = side*sign(1.0_wp, self%last - self%first)
      self%count = self%count + 1
      call self%branch(self%count)%follow(self%problem, orbit, guide, low_of(self), high_of(self), self%most_points)
   end subroutine one_branch

   pure real(wp) function low_of(self)
      class(follow_t), intent(in) :: self

      low_of = min(self%first, self%last)/self%problem%range
   end function low_of

   pure real(wp) function high_of(self)
      class(follow_t), intent(in) :: self

      high_of = max(self%first, self%last)/self%problem%range
   end function high_of

   !> The branches that begin at a point, if it is a doubling or a branch point of a branch that is not itself the child of
   !> too many.
   subroutine follow_switched(self, parent, place)
      class(follow_t), intent(inout) :: self
      integer, intent(in) :: parent, place

      type(orbit_t) :: orbit
      real(wp), allocatable :: guide(:)
      character(2) :: label
      integer :: side
      logical :: ok

      label = self%branch(parent)%point(place)%label
      if (label /= "PD" .and. label /= "BP") return
      if (self%branch(parent)%periods*merge(2, 1, label == "PD") > self%branch(1)%periods*2**self%doublings) return
      if (generation(self, parent) >= self%doublings) return
      if (label == "PD" .and. reached(self, parent, place)) return
      do side = 1, merge(1, 2, label == "PD")
         if (self%count == most_branches) return
         self%problem%periods = self%branch(parent)%periods
         call switch_branch(self%problem, self%branch(parent)%point(place), side == 1, orbit, guide, ok)
         if (.not. ok) cycle
         self%count = self%count + 1
         self%branch(self%count)%parent = parent
         self%branch(self%count)%origin = place
         call self%branch(self%count)%follow(self%problem, orbit, guide, low_of(self), high_of(self), self%most_points)
      end do
   end subroutine follow_switched

   !> Whether a branch of twice the period has already come to an end at this doubling.
   pure logical function reached(self, parent, place)
      class(follow_t), intent(in) :: self
      integer, intent(in) :: parent, place

      integer :: i

      reached = .false.
      associate (u => self%branch(parent)%point(place)%orbit%u)
         do i = 1, self%count
            associate (other => self%branch(i))
               if (other%periods /= 2*self%branch(parent)%periods .or. other%parent == 0) cycle
               associate (last => other%point(other%count))
                  reached = reached .or. (last%label == "EP" .and. abs(last%orbit%u(size(u)) - u(size(u))) < same**2 .and. &
                                          norm2(last%orbit%u(:size(u) - 1) - u(:size(u) - 1)) < same*norm2(u(:size(u) - 1)))
               end associate
            end associate
         end do
      end associate
   end function reached

   pure integer function generation(self, i)
      class(follow_t), intent(in) :: self
      integer, intent(in) :: i

      integer :: k

      generation = 0
      k = i
      do while (self%branch(k)%parent > 0)
         generation = generation + 1
         k = self%branch(k)%parent
      end do
   end function generation

end module razy_study_follow_follow
