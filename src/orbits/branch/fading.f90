!! Where on a step of a branch changes of a contact are no more that motions on one side have alone: beside a grazing the square of
!! how long they last is a line along the branch, but for its power of three halves.
module razy_orbits_branch_fading
   use razy_core_kinds, only: wp
   use razy_orbits_periodic_orbit, only: orbit_t
   implicit none(type, external)
   private

   public :: fading_t, new_fading, shortest

   type :: fading_t
      private
      integer :: contact = 0, count = 0, seen = 0
      !> On which side they are not: 1 at the end, -1 at the beginning.
      integer :: poor = 1
      !> Of the step and the shortest that counts; where the last two were seen, and the squares there; what was left of the step.
      real(wp) :: length = 0.0_wp, least = 0.0_wp, place(2) = 0.0_wp, square(2) = 0.0_wp, before = huge(1.0_wp)
   contains
      procedure :: see
      procedure :: trial
   end type fading_t

   !> How far off the line may lead, beside what that power makes of it.
   real(wp), parameter :: share = 0.2_wp

contains

   !> Led by the contact whose changes are more on one side, if there is one.
   type(fading_t) function new_fading(a, b, length, width) result(fading)
      type(orbit_t), intent(in) :: a, b
      real(wp), intent(in) :: length, width

      fading%length = length
      fading%least = 0.5_wp*width
      fading%count = max(a%sequence%count, b%sequence%count)
      if (a%sequence%count == b%sequence%count) return
      fading%contact = a%sequence%difference(b%sequence)
      fading%poor = merge(1, -1, a%sequence%count > b%sequence%count)
      if (fading%contact == 0) return
      if (fading%poor > 0) call fading%see(a, 0.0_wp)
      if (fading%poor < 0) call fading%see(b, length)
   end function new_fading

   !> Note how long the shortest of its changes lasts in a motion that has them all.
   subroutine see(self, orbit, s)
      class(fading_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), intent(in) :: s

      if (self%contact == 0 .or. orbit%sequence%count /= self%count) return
      self%place = [self%place(2), s]
      self%square = [self%square(2), shortest(orbit, self%contact)**2]
      self%seen = self%seen + 1
   end subroutine see

   !> Where to look between `low` and `high`: on either side of where it lasts no time, or, where that led to less than half of what
   !> was between, in the middle.
   real(wp) function trial(self, low, high)
      class(fading_t), intent(inout) :: self
      real(wp), intent(in) :: low, high

      real(wp) :: margin, root
      logical :: vain

      vain = self%seen < 2 .or. high - low > 0.5_wp*self%before
      self%before = high - low
      trial = 0.5_wp*(low + high)
      if (vain) self%before = 2*self%before
      if (vain .or. .not. abs(self%square(2) - self%square(1)) > 0.0_wp) return
      root = self%place(2) - self%square(2)*(self%place(2) - self%place(1))/(self%square(2) - self%square(1))
      margin = max(self%least, share*abs(root - self%place(2))*sqrt(abs(root - self%place(1))/self%length))
      ! First the side without is made short, then that with it, from which the next line is nearer.
      if (self%poor*(merge(high, low, self%poor > 0) - root) <= 4*margin) margin = -margin
      root = root + self%poor*margin
      if (root > low .and. root < high) trial = root
   end function trial

   !> The shortest time between changes of a contact, in parts of the whole.
   pure real(wp) function shortest(orbit, contact)
      type(orbit_t), intent(in) :: orbit
      integer, intent(in) :: contact

      real(wp) :: last
      integer :: i

      shortest = 1.0_wp
      associate (changes => orbit%sequence)
         do i = changes%count, 1, -1
            if (changes%contact(i) /= contact) cycle
            last = changes%time(i) - orbit%duration
            exit
         end do
         do i = 1, changes%count
            if (changes%contact(i) /= contact) cycle
            shortest = min(shortest, (changes%time(i) - last)/orbit%duration)
            last = changes%time(i)
         end do
      end associate
   end function shortest

end module razy_orbits_branch_fading
