!! Why a branch ends right ahead of its last motion, and where: friction that has stuck all the time begins to slide, a stop whose
!! force jumps is touched with no speed, the motion becomes one of half its periods as that touches a stop, or it jumps.
module razy_orbits_branch_endings
   use razy_contact_friction_law, only: branch_backward, branch_forward
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_identity, only: part_way
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: kink, point_t
   use razy_orbits_branch_special, only: name_change
   use razy_orbits_touch, only: find_touch, find_touch_beside
   implicit none(type, external)
   private

   public :: end_at_half, end_at_jump, end_at_slip, end_at_touch, grows_without_bound, jump, least_step

   !> Steps of a branch in scaled unknowns are no shorter.
   real(wp), parameter :: least_step = 1.0e-9_wp
   !> Motions on both sides of a change of contacts that are farther apart than this, relative to the state, are no neighbours.
   real(wp), parameter :: jump = 1.0e-5_wp
   !> A motion that has grown so many times, from the scale of the unknowns on, like the reciprocal of what its parameter is off a
   !> limit has no limit of its own.
   real(wp), parameter :: boundless = 1.0e6_wp, reciprocal = 0.1_wp

contains

   !> Whether the branch of these points goes to infinity: the machine without loads and clearances, which far out are too small
   !> to matter, has a motion of any size at the limit of the parameter, or where it stays.
   pure logical function grows_without_bound(point) result(grows)
      type(point_t), intent(in) :: point(:)

      real(wp), dimension(size(point)) :: extent, p
      real(wp) :: limit
      integer :: i, last, near, seen

      last = size(point)
      associate (n => size(point(last)%orbit%u))
         grows = norm2(point(last)%orbit%u(:n - 1)) >= boundless
         if (.not. grows) return
         extent = [(max(1.0_wp, norm2(point(i)%orbit%u(:n - 1))), i=1, last)]
         p = [(point(i)%orbit%u(n), i=1, last)]
      end associate
      seen = findloc(extent <= extent(last)/boundless, .true., 1, back=.true.)
      grows = seen > 0
      if (.not. grows) return
      near = findloc(extent <= extent(last)/sqrt(boundless), .true., 1, back=.true.)
      limit = p(last) + (p(last) - p(near))*extent(near)/(extent(last) - extent(near))
      associate (far => extent(seen)*(p(seen) - limit), now => extent(near)*(p(near) - limit))
         grows = abs(far - now) < reciprocal*abs(now) .or. abs(p(last) - p(seen)) <= 16*spacing(p(last))
      end associate
   end function grows_without_bound

   !> Where friction that has stuck all the time begins to slide one way within a step of length h from `here`: no motion is there
   !> then, as it comes to stick at another place. That is the branch's last point, SL, or the step becomes shorter.
   subroutine end_at_slip(problem, here, h, at, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(inout) :: h
      type(point_t), intent(out) :: at
      logical, intent(out) :: found

      found = .false.
      if (size(here%orbit%stuck) == 0) return
      at = here
      call find_edge(problem, here, h, at%contact)
      found = at%contact > 0 .and. h < kink
      if (.not. found) then
         if (at%contact > 0) h = 0.9_wp*h
         return
      end if
      at%orbit%u = here%orbit%u + h*here%tangent
      at%label = "SL"
   end subroutine end_at_slip

   !> Where the branch of these points ends as its motion begins to touch a rigid stop, or one whose force jumps, GR, and how many
   !> of them are before that; with `here` only if it is at these unknowns.
   subroutine end_at_touch(problem, point, at, before, found, here)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point(:)
      type(point_t), intent(out) :: at
      integer, intent(out) :: before
      logical, intent(out) :: found
      real(wp), intent(in), optional :: here(:)

      real(wp), allocatable :: u(:)
      real(wp) :: most
      integer :: contact, i

      before = size(point)
      found = before > 1
      if (.not. found) return
      associate (last => point(before)%orbit)
         call find_touch_beside(problem, last, u, contact, found)
         if (.not. found) call find_touch(problem, point(before - 1)%orbit, last, u, contact, found)
      end associate
      ! Multipliers go with the inverse root of the distance: where they are so large the change may be located to a kink only.
      most = merge(10*kink, kink, maxval([0.0_wp, abs(point(before)%orbit%multiplier)]) > 1.0_wp/sqrt(kink))
      if (found .and. present(here)) found = norm2(u - here) <= most*norm2(here)
      if (.not. found) return
      ! Steps too short to be looked at may have come past the touch.
      do i = before - 1, 1, -1
         if (norm2(point(i)%orbit%u - u) > kink) exit
         if (.not. point(i)%orbit%sequence%is_like(point(before)%orbit%sequence)) exit
      end do
      if (i > 0) then
         if (norm2(point(i)%orbit%u - u) <= kink) before = i
      end if
      at = point(before)
      at%contact = contact
      at%orbit%u = u
      at%label = "GR"
      at%touches = .true.
   end subroutine end_at_touch

   !> Where the branch of these two motions ends in one of half its periods right ahead, as that touches a stop and a multiplier of
   !> it jumps past -1: what they miss after half the time falls to nothing there, in a straight line.
   subroutine end_at_half(problem, before, last, at, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: before, last
      type(point_t), intent(out) :: at
      logical, intent(out) :: found

      real(wp), allocatable :: farther(:), near(:)
      real(wp) :: ahead

      found = .not. abs(before%orbit%phase - last%orbit%phase) > 0.0_wp
      if (.not. found) return
      farther = part_way(problem, before%orbit, 2)
      near = part_way(problem, last%orbit, 2)
      found = norm2(near) < norm2(farther)
      if (found) ahead = norm2(near)/(norm2(farther) - norm2(near))
      if (found) found = norm2(ahead*(last%orbit%u - before%orbit%u)) <= kink*norm2(last%orbit%u)
      if (.not. found) return
      at = last
      at%orbit%u = last%orbit%u + ahead*(last%orbit%u - before%orbit%u)
      at%label = "EP"
   end subroutine end_at_half

   !> Where a branch ends because its map jumps right ahead of `here`, as a change of contacts, another one or much earlier, has no
   !> motion on its other side: its last point becomes that, of friction ST or SL, else CH.
   subroutine end_at_jump(problem, here, at, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      type(point_t), intent(inout) :: at
      logical, intent(out) :: found

      type(orbit_t) :: ahead
      character(2) :: label
      real(wp) :: h, off(2)
      integer :: contact, i

      call problem%begin_as(here%orbit)
      ! Nearer than a method's errors it may be on either side.
      h = max(10*least_step, problem%resolution)
      do i = 1, 2
         call problem%evaluate(here%orbit%u + 100.0_wp**(i - 1)*h*here%tangent, .false., ahead, found)
         if (.not. found) return
         off(i) = norm2(ahead%residual)
      end do
      ! Beside a grazing what is missed has a square root, and elsewhere it is proportional to the step.
      found = off(1) >= 0.5_wp*off(2) .and. off(1) >= max(kink, 10*problem%resolution)*norm2(here%orbit%u)
      if (.not. found) return
      at%label = "CH"
      call find_edge(problem, here, h, at%contact, 0.5_wp*off(1))
      if (at%contact > 0) at%orbit%u = here%orbit%u + h*here%tangent
      call name_change(problem, here%orbit, ahead, label, contact)
      if (contact == at%contact .and. any(label == ["ST", "SL"])) at%label = label
   end subroutine end_at_jump

   !> How far the tangent leads, up to h, until friction that has stuck all the time slides one way, or until the map jumps by
   !> `missed`, with the contact; 0: it does not.
   subroutine find_edge(problem, here, h, contact, missed)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: here
      real(wp), intent(inout) :: h
      integer, intent(out) :: contact
      real(wp), intent(in), optional :: missed

      integer :: changed
      real(wp) :: high, middle

      contact = change_at(h)
      if (contact == 0) return
      high = h
      h = 0.0_wp
      do
         middle = 0.5_wp*(h + high)
         if (middle <= h .or. middle >= high .or. high - h <= epsilon(h)*least_step) exit
         changed = change_at(middle)
         if (changed == 0) h = middle
         if (changed > 0) high = middle
         if (changed > 0) contact = changed
      end do

   contains

      integer function change_at(s) result(j)
         real(wp), intent(in) :: s

         type(orbit_t) :: ahead
         integer :: i
         logical :: ok

         j = 0
         call problem%evaluate(here%orbit%u + s*here%tangent, .false., ahead, ok)
         if (.not. ok) return
         if (present(missed)) then
            if (norm2(ahead%residual) < missed) return
            j = here%orbit%sequence%difference(ahead%sequence)
            associate (n => min(here%orbit%sequence%count, ahead%sequence%count))
               ! Of a sequence that stays the contact whose change jumps.
               if (j == 0 .and. n > 0) then
                  j = ahead%sequence%contact(maxloc(abs(ahead%sequence%time(:n) - here%orbit%sequence%time(:n)), 1))
               end if
            end associate
            return
         end if
         associate (stuck => here%orbit%stuck, seen => ahead%sequence)
            i = findloc([(seen%changes_to(stuck(i), branch_forward) > 0 .neqv. &
                          seen%changes_to(stuck(i), branch_backward) > 0, i=1, size(stuck))], .true., 1)
            if (i > 0) j = stuck(i)
         end associate
      end function change_at

   end subroutine find_edge

end module razy_orbits_branch_endings
