!! What a motion by a Runge-Kutta method has learned of its modes from visits before: the step that served first, and how far one
!! may go beyond the end, where a curved law is not smooth (razy_contact_power_law).
module razy_runge_kutta_visits
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: long, visits_t

   !> A step, s, longer than any.
   real(wp), parameter :: long = 1.0e200_wp
   !> Growth of the first step of a mode from visit to visit that pays.
   real(wp), parameter :: worth_a_refusal = 1.15_wp

   !> The step that served first, s (0: none), and the longest that may go beyond the end of the mode.
   type :: known_t
      integer, allocatable :: branch(:)
      real(wp) :: opening = 0.0_wp, closing = long
   end type known_t

   type :: visits_t
      !> Modes entered last, the one to be replaced next, the present one, and whether no step has been made in it.
      type(known_t) :: known(16)
      integer, private :: oldest = 1
      integer :: now = 1
      logical :: opening = .true.
   contains
      procedure :: forget
      procedure :: recall
      procedure :: keep
      procedure :: learn_closing
   end type visits_t

contains

   !> Nothing of a run depends on another.
   subroutine forget(self)
      class(visits_t), intent(inout) :: self

      integer :: i

      do i = 1, size(self%known)
         self%known(i) = known_t()
         self%known(i)%branch = [integer ::]
      end do
   end subroutine forget

   !> Look up what is known of the mode of these branches.
   pure subroutine recall(self, branch)
      class(visits_t), intent(inout) :: self
      integer, intent(in) :: branch(:)

      integer :: i

      self%opening = .true.
      do i = 1, size(self%known)
         if (size(self%known(i)%branch) /= size(branch)) cycle
         if (any(self%known(i)%branch /= branch)) cycle
         self%now = i
         return
      end do
      self%now = self%oldest
      self%known(self%oldest) = known_t(branch)
      self%oldest = modulo(self%oldest, size(self%known)) + 1
   end subroutine recall

   !> Remember the first step h of the mode, or what follows it if that is shorter or so much longer that it is worth a refusal.
   pure subroutine keep(self, h, h_next)
      class(visits_t), intent(inout) :: self
      real(wp), intent(in) :: h, h_next

      if (.not. self%opening) return
      self%opening = .false.
      self%known(self%now)%opening = merge(h, h_next, h_next > h .and. h_next < worth_a_refusal*h)
   end subroutine keep

   !> What a step that was to go beyond the end of the mode says: it was accepted, or `h_next` is next.
   pure subroutine learn_closing(self, accepted, h_next)
      class(visits_t), intent(inout) :: self
      logical, intent(in) :: accepted
      real(wp), intent(in) :: h_next

      associate (known => self%known(self%now))
         if (.not. accepted) then
            known%closing = h_next
            if (known%opening > 0.0_wp) known%closing = min(h_next, known%opening)
         else if (known%closing < long) then
            known%closing = max(known%closing, h_next)
         end if
      end associate
   end subroutine learn_closing

end module razy_runge_kutta_visits
