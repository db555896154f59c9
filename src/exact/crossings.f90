!! The bounds that were crossed last, at one time: functions known to start on them in the mode that follows.
!!
!! Where nothing is held, s and s' do not jump, so events at one time are crossed one after the other: those that the search finds
!! on their bounds at one root together, others after pieces of no length. The slope of a function with s' in it jumps where a
!! contact closes on a damper; functions of the force leave together only with others of their kind, at which no force jumps.
!!
!! What is rounding in a function stays so as long as the motion stands: at the start of the next mode their terms may be gone in
!! which the error was made. Of bodies that have just left their stops together, all are near them.
module razy_exact_crossings
   use razy_contact_contact_law, only: most_functions
   use razy_core_kinds, only: wp
   use razy_exact_search_refine, only: watched_t
   use razy_hybrid_guards, only: guard_entry_t
   implicit none(type, external)
   private

   public :: crossings_t

   !> Crossings at one time that are remembered.
   integer, parameter :: most = 16

   !> The bound of a switching function that was crossed, the branch beyond, and the side on which the motion had been; whether the
   !> function has s' in it.
   type :: crossed_t
      integer :: contact = 0, function = 0, next = 0
      logical :: of_rate = .false.
      real(wp) :: side = 0.0_wp, bound = 0.0_wp
   end type crossed_t

   type :: crossings_t
      !> Of `count` those from number `first` on ended the last piece.
      integer, private :: count = 0, first = 1
      type(crossed_t), private :: crossed(most)
      !> Pieces of no length since; what is rounding in the functions at this time (function, contact).
      integer :: standing = 0
      real(wp), allocatable, private :: noise(:, :)
   contains
      procedure :: attach
      procedure :: forget
      procedure :: prepare
      procedure :: end_piece
      procedure :: add
      procedure :: can_add
      procedure :: hand_over
      procedure :: take_noise
   end type crossings_t

contains

   !> Make room for so many contacts.
   subroutine attach(self, contacts)
      class(crossings_t), intent(out) :: self
      integer, intent(in) :: contacts

      allocate (self%noise(most_functions, contacts), source=0.0_wp)
   end subroutine attach

   !> A motion begins.
   pure subroutine forget(self)
      class(crossings_t), intent(inout) :: self

      self%count = 0
      self%standing = 0
   end subroutine forget

   !> Tell the functions of the guards `entry(:)` before a piece which of them start on their bounds, and what is rounding in them.
   pure subroutine prepare(self, entry, watched)
      class(crossings_t), intent(in) :: self
      type(guard_entry_t), contiguous, intent(in) :: entry(:)
      type(watched_t), contiguous, intent(inout) :: watched(:)

      integer :: i, t

      do t = 1, size(watched)
         watched(t)%floor = 0.0_wp
         if (self%standing > 0) watched(t)%floor = self%noise(entry(t)%function, entry(t)%contact)
         watched(t)%from_zero = .false.
         watched(t)%at_rest = .false.
         watched(t)%initial = 0.0_wp
         watched(t)%slip = 0.0_wp
      end do
      do i = 1, self%count
         do t = 1, size(watched)
            if (entry(t)%contact /= self%crossed(i)%contact .or. entry(t)%function /= self%crossed(i)%function) cycle
            ! It has come from the other side of this bound.
            if (.not. watched(t)%side*self%crossed(i)%side < 0.0_wp) cycle
            if (.not. abs(entry(t)%bound - self%crossed(i)%bound) > 0.0_wp) watched(t)%from_zero = .true.
         end do
      end do
   end subroutine prepare

   !> A piece has ended; `stands`: it had no length and ends in an event.
   pure subroutine end_piece(self, stands)
      class(crossings_t), intent(inout) :: self
      logical, intent(in) :: stands

      self%standing = merge(self%standing + 1, 0, stands)
      if (self%standing == 0) self%count = 0
      if (self%standing == 1) self%noise = 0.0_wp
      self%first = min(self%count + 1, most)
   end subroutine end_piece

   !> The function of a guard crosses its bound at the end of the piece.
   pure subroutine add(self, guard, watched)
      class(crossings_t), intent(inout) :: self
      type(guard_entry_t), intent(in) :: guard
      type(watched_t), intent(in) :: watched

      self%count = min(self%count + 1, most)
      self%crossed(self%count) = crossed_t(guard%contact, guard%function, guard%next, abs(guard%beta) > 0.0_wp, watched%side, &
                                           guard%bound)
   end subroutine add

   !> Whether another function may cross its bound with those that have there.
   pure logical function can_add(self, guard)
      class(crossings_t), intent(in) :: self
      type(guard_entry_t), intent(in) :: guard

      associate (there => self%crossed(self%first:self%count))
         can_add = self%count < most .and. .not. any(there%contact == guard%contact) &
                   .and. all(there%of_rate .eqv. abs(guard%beta) > 0.0_wp)
      end associate
   end function can_add

   !> The contacts that crossed bounds at the end of the piece (the first `count`), and their branches beyond.
   pure subroutine hand_over(self, contact, branch, count)
      class(crossings_t), intent(in) :: self
      integer, intent(inout) :: contact(:), branch(:)
      integer, intent(out) :: count

      count = self%count - self%first + 1
      contact(:count) = self%crossed(self%first:self%count)%contact
      branch(:count) = self%crossed(self%first:self%count)%next
   end subroutine hand_over

   !> Take up what was rounding in the functions of a mode.
   pure subroutine take_noise(self, entry, watched)
      class(crossings_t), intent(inout) :: self
      type(guard_entry_t), intent(in) :: entry(:)
      type(watched_t), intent(in) :: watched(:)

      integer :: t

      do t = 1, size(watched)
         associate (known => self%noise(entry(t)%function, entry(t)%contact))
            known = max(known, watched(t)%noise)
         end associate
      end do
   end subroutine take_noise

end module razy_exact_crossings
