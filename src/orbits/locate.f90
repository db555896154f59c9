!! A special point again, near where it is expected: on a short branch of motions that grows until the point is on it.
module razy_orbits_locate
   use razy_core_kinds, only: wp
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_endings, only: end_at_slip
   use razy_orbits_branch_within_step, only: search_between
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: complete_point_at, point_t
   implicit none(type, external)
   private

   public :: locate_near

   !> Each branch is so many times as long as the one before.
   real(wp), parameter :: wider = 3.0_wp
   !> Motions up to where what sticks slides, each nearer by a tenth of the way at least.
   integer, parameter :: most_steps = 40

contains

   !> The point of this kind that is nearest to the unknowns `expected`, looked for along `row` in branches of at first twice the
   !> length `first`, at last of twice `most`, in scaled unknowns. `point`: one like it.
   subroutine locate_near(problem, label, contact, expected, row, first, most, point, found)
      type(problem_t), intent(inout) :: problem
      character(*), intent(in) :: label
      integer, intent(in) :: contact
      real(wp), intent(in) :: expected(:), row(:), first, most
      type(point_t), intent(inout) :: point
      logical, intent(out) :: found

      type(branch_t) :: short
      type(point_t) :: a, b, before_a, before_b
      real(wp) :: half
      logical :: ends(2)

      ends = .true.
      if (label == "SL" .and. any(point%orbit%stuck == contact)) then
         call slip(found)
         return
      end if
      call end_of(0.0_wp, a, found)
      if (.not. found) return
      half = first
      b = a
      found = .false.
      do while (half < most .and. any(ends))
         before_a = a
         before_b = b
         if (ends(1)) call end_of(-half, a, ends(1))
         if (ends(2)) call end_of(half, b, ends(2))
         if (.not. ends(1)) a = before_a
         if (.not. ends(2)) b = before_b
         call search_between(short, problem, a, b)
         call pick(short, label, contact, expected, point, found)
         if (found) return
         half = wider*half
      end do

   contains

      subroutine end_of(s, motion, ok)
         real(wp), intent(in) :: s
         type(point_t), intent(out) :: motion
         logical, intent(out) :: ok

         call motion_at(problem, expected + s*row, row, motion, ok)
      end subroutine end_of

      !> From motions that friction sticks in all the time, which lie back along `row`, to where it slides: none lies beyond.
      subroutine slip(found)
         logical, intent(out) :: found

         real(wp) :: h
         integer :: i
         logical :: ok

         found = .false.
         half = first
         do while (half < most)
            h = 2*half
            call end_of(-half, a, ok)
            half = wider*half
            if (ok) ok = any(a%orbit%stuck == contact)
            if (.not. ok) cycle
            do i = 1, most_steps
               call end_at_slip(problem, a, h, point, found)
               if (found) found = point%contact == contact
               if (found) return
               call motion_at(problem, a%orbit%u + h*a%tangent, row, b, ok)
               if (.not. ok) exit
               a = b
               h = wider*h
            end do
         end do
      end subroutine slip

   end subroutine locate_near

   !> A motion with its derivatives and the tangent, in the plane across `row` through the unknowns `near`.
   subroutine motion_at(problem, near, row, motion, ok)
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: near(:), row(:)
      type(point_t), intent(out) :: motion
      logical, intent(out) :: ok

      call correct(problem, near, row, motion%orbit, ok)
      if (ok) call complete_point_at(problem, motion, row, ok)
   end subroutine motion_at

   !> Of the points of a branch the one of this kind nearest to where it is expected.
   subroutine pick(short, label, contact, expected, point, found)
      type(branch_t), intent(in) :: short
      character(*), intent(in) :: label
      integer, intent(in) :: contact
      real(wp), intent(in) :: expected(:)
      type(point_t), intent(inout) :: point
      logical, intent(out) :: found

      real(wp) :: nearest
      integer :: i

      nearest = huge(nearest)
      do i = 1, short%count
         if (short%point(i)%label /= label .or. short%point(i)%contact /= contact) cycle
         if (norm2(short%point(i)%orbit%u - expected) >= nearest) cycle
         nearest = norm2(short%point(i)%orbit%u - expected)
         point = short%point(i)
      end do
      found = nearest < huge(nearest)
   end subroutine pick

end module razy_orbits_locate
