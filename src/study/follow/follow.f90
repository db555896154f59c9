!! What &follow finds: the first motion, its branch, and the branches that begin where periods double or symmetry breaks; with a
!! second &follow the curves of their special points over two parameters.
module razy_study_follow_follow
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_orbits_beyond_touch, only: switch_at_touch
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_follow, only: follow_branch
   use razy_orbits_curve, only: curve_t
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_search, only: found_t, is_on, new_found, search_t
   use razy_orbits_start, only: find_beside, find_periodic
   use razy_orbits_switch, only: switch_branch
   use razy_orbits_user_values, only: mark_values
   use razy_study_follow_family, only: case_family_t
   use razy_study_follow_request, only: request_t, same
   use razy_study_follow_sensitivities, only: moves
   use razy_study_follow_uncertainty, only: find_errors
   implicit none(type, external)
   private

   public :: follow_t, sample_t

   !> What was seen at a value of the parameter: largest Lyapunov exponent of the machine's own motion and its standard error,
   !> 1/s; of the motions that starts settled to, the branch and the number of starts; starts that settled to none.
   type :: sample_t
      real(wp) :: parameter = 0.0_wp, exponent = 0.0_wp, error = 0.0_wp
      integer :: unsettled = 0
      integer, allocatable :: branch(:), starts(:)
      !> Why nothing was looked for, or what may be missing; else empty.
      character(:), allocatable :: reason
   end type sample_t

   type, extends(request_t) :: follow_t
      type(branch_t), allocatable :: branch(:)
      integer :: count = 0
      type(curve_t), allocatable :: curve(:)
      integer :: curves = 0
      logical :: settled = .false.
      type(sample_t), allocatable :: sample(:)
   contains
      procedure :: compute
      procedure :: is_full
      procedure :: reset
      procedure :: follow_from
      procedure :: place_on
      procedure :: contact_name
      procedure, private :: one_branch
      procedure, private :: curve_through
   end type follow_t

   !> The branches, with all motions of a cell, and curves that are followed at most.
   integer, parameter :: most_branches = 256, most_curves = 64
   !> A multiplier of a motion that a branch is not begun with: right beside a touch steps become tiny.
   real(wp), parameter :: too_steep = 1.0e3_wp
   !> Points of a curve on each side of where it was found.
   integer, parameter :: most_on_curve = 150

contains

   !> Find the first motion and follow all branches that begin from it; with `few` no more than so many points of each.
   subroutine compute(self, error, few)
      class(follow_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: few

      type(orbit_t) :: orbit
      real(wp), allocatable :: begin(:), guide(:)
      integer :: from, i, side
      logical :: ok

      call self%reset()
      if (present(few)) self%most_points = min(few, self%most_points)
      begin = self%problem%parameter
      begin(1) = self%from
      if (allocated(self%stored)) then
         call begin_with_stored(self, begin, orbit, guide, error)
      else
         call find_periodic(self%problem, begin, abs(self%last(1) - self%first(1)), self%period, self%settle, self%time, orbit, &
                            self%settled, error)
         if (allocated(error)) call look_all_over()
      end if
      if (allocated(error)) return
      side = 0
      if (is_at(self%last(1))) side = -1
      if (is_at(self%first(1))) side = 1
      call self%follow_from(orbit, side, guide)
      call find_errors(self%problem, self%branch(:self%count))
      call self%sensitivities%find(self%problem, self%branch(:self%count))
      allocate (self%curve(most_curves))
      if (size(self%varied) < 2) return
      do i = 1, self%count
         do from = 1, self%branch(i)%count
            call self%curve_through(i, from)
         end do
      end do

   contains

      !> A motion that none of the close returns leads to, if there is one that is not too steep to follow: the least steep.
      subroutine look_all_over()
         type(error_t), allocatable :: lost
         type(search_t) :: search
         real(wp) :: least, steep

         if (.not. self%problem%map%period > 0.0_wp) return
         search%settle = self%settle
         search%most_periods = max(self%period, 1)
         call search%run(self%problem, begin, abs(self%last(1) - self%first(1)), lost)
         if (allocated(lost)) return
         least = too_steep
         do i = 1, size(search%found)
            if (search%found(i)%periods /= search%most_periods) cycle
            steep = maxval([0.0_wp, abs(search%found(i)%orbit%multiplier)])
            if (steep >= least) cycle
            least = steep
            orbit = search%found(i)%orbit
            call self%problem%go_to(orbit%u, ok)
            if (allocated(error)) deallocate (error)
         end do
      end subroutine look_all_over

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
         if (.not. self%is_beyond(problem%value_of(orbit))) return
         call raise(error, "the motion nearest to point "//to_text(stored%point)//" of "//stored%file// &
                    " is outside the range, at "//to_text(problem%value_of(orbit)))
      end associate
   end subroutine begin_with_stored

   !> Whether no more branches are followed.
   pure logical function is_full(self)
      class(follow_t), intent(in) :: self

      is_full = self%count == most_branches
   end function is_full

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
      ! The motion in the middle has its label on one side.
      if (self%count == i + 2) self%branch(self%count)%point(1)%label = ""
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
            ! A motion of so many periods may touch a stop as the one of fewer that it is.
            if (modulo(self%branch(branch)%periods, self%curve(i)%periods) > 0) cycle
            if (self%curve(i)%passes(point, at, range)) return
         end do
         self%curves = self%curves + 1
         problem%periods = self%branch(branch)%periods
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

      if (self%is_full()) return
      self%count = self%count + 1
      associate (branch => self%branch(self%count), ends => [self%first(1), self%last(1)]/self%problem%range)
         branch%parent = parent
         call follow_branch(branch, self%problem, orbit, guide, minval(ends), maxval(ends), self%most_points, away)
         call mark_values(branch, self%problem, self%values/self%problem%range)
         if (self%is_full()) branch%ending = branch%ending//"; no more branches are followed"
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
      ! Of all motions each doubling is followed up to a number of periods, whatever its branch was found by.
      if (self%all_motions .and. label == "PD") then
         if (self%branch(parent)%periods > self%search%most_periods*2**self%doublings/2) return
      else if (generation(self, parent) >= self%doublings) then
         return
      end if
      do side = 1, merge(1, 2, label == "PD")
         if (self%is_full()) return
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

      if (self%is_full()) return
      associate (last => self%branch(parent)%point(self%branch(parent)%count))
         do i = 1, self%count
            if (i == parent .or. self%branch(i)%periods /= self%branch(parent)%periods) cycle
            associate (other => self%branch(i)%point(self%branch(i)%count), p => size(last%orbit%u))
               if (other%label == "GR" .and. abs(other%orbit%u(p) - last%orbit%u(p)) <= same) return
            end associate
         end do
      end associate
      do which = 0, size(self%branch)
         if (self%is_full()) return
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
