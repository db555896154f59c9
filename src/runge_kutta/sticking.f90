!! Steps over friction that sticks with the treatment `switching`.
!!
!! What sticks feels nothing of its load, nor does what is in free flight feel the edge that moves under it, so the error of a
!! step says nothing of the excitation there: a step is no longer than `longest_angle` of the fastest that counts. Between its
!! ends the cubic with the values and rates of the room that a sticking force has up to its bound tells where that is least. If
!! the force may reach its bound there, the step ends there instead: what slips then does so in a stage, and the error of the step
!! finds where it begins.
module razy_runge_kutta_sticking
   use razy_contact_contact_law, only: branch_sticking
   use razy_core_kinds, only: wp
   use razy_hybrid_cubic_doubts, only: cubic_turn
   use razy_hybrid_field, only: field_t
   use razy_hybrid_mode, only: constrained, treat_by_events, treat_by_switching
   implicit none(type, external)
   private

   public :: sticking_t

   !> Room of the sticking force of each friction element on both sides, N, and its rate, N/s (2, contacts), where it sticks.
   type :: room_t
      logical, allocatable :: held(:)
      real(wp), allocatable :: value(:, :), rate(:, :)
      !> Rounding of the room, N (contacts).
      real(wp), allocatable :: noise(:)
   end type room_t

   type :: sticking_t
      !> Whether steps are looked at.
      logical :: watching = .false.
      !> The longest step from where the last one ended, s.
      real(wp) :: longest = huge(1.0_wp)
      !> Whether a friction element of the machine can stick.
      logical :: sticks = .false.
      !> Angular frequencies of the fastest excitation of any kind, and of edges and errors, rad/s.
      real(wp), private :: fastest = 0.0_wp, fastest_error = 0.0_wp
      !> At the start of a step and at its end.
      type(room_t), private :: start, finish
      real(wp), allocatable, private :: moved(:), a(:)
   contains
      procedure :: attach
      procedure :: begin
      procedure :: passes_over
   end type sticking_t

   !> Longest angle of the excitation in a step: the cubic of a sine over it errs by 1e-5 of its amplitude, and by 2e-3 of its dip.
   real(wp), parameter :: longest_angle = 0.25_wp
   !> Part of a dip by which the cubic may err.
   real(wp), parameter :: uncertain = 0.1_wp
   !> Time over which rates are taken, in parts of a step or of the fastest excitation's radian.
   real(wp), parameter :: of_step = 1.0e-5_wp
   !> Rounding of a force.
   real(wp), parameter :: of_force = 256*epsilon(1.0_wp)

contains

   !> Take the machine of a field; steps of a method that is not `adaptive` are as the user wants them.
   subroutine attach(self, field, adaptive)
      class(sticking_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      logical, intent(in) :: adaptive

      integer :: j, n, t

      n = size(field%branch)
      self%sticks = any([(field%machine%contact(j)%law%constraint(branch_sticking), j=1, n)])
      self%watching = adaptive .and. field%treatment == treat_by_switching
      self%longest = huge(1.0_wp)
      self%fastest = 0.0_wp
      self%fastest_error = 0.0_wp
      do t = 1, size(field%omega)
         self%fastest = max(self%fastest, field%omega(t))
         if (any(abs(field%error_re(:, t)) + abs(field%error_im(:, t)) > 0.0_wp)) then
            self%fastest_error = max(self%fastest_error, field%omega(t))
         end if
      end do
      call make_room(self%start, n)
      call make_room(self%finish, n)
      if (allocated(self%moved)) deallocate (self%moved, self%a)
      allocate (self%moved(2*field%m), self%a(field%m), source=0.0_wp)
   end subroutine attach

   pure subroutine make_room(room, n)
      type(room_t), intent(inout) :: room
      integer, intent(in) :: n

      if (allocated(room%held)) deallocate (room%held, room%value, room%rate, room%noise)
      allocate (room%held(n), source=.false.)
      allocate (room%value(2, n), room%rate(2, n), room%noise(n), source=0.0_wp)
   end subroutine make_room

   !> The motion starts at (tau, z) and may last for `rest`, s.
   subroutine begin(self, field, tau, rest, z)
      class(sticking_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, rest, z(:)

      if (self%sticks) call measure(self, field, tau, rest, z, self%start)
      call limit(self)
   end subroutine begin

   !> Whether the accepted step h from tau to z may have passed over sliding, so that it has to be made again with the shorter
   !> h given back. If not, the next step starts where this one ends.
   subroutine passes_over(self, field, tau, z, h, again)
      class(sticking_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(inout) :: h
      logical, intent(out) :: again

      real(wp) :: dip, first, least, lowest, theta
      integer :: i, j
      logical :: turns

      again = .false.
      if (.not. self%sticks) return
      call measure(self, field, tau + h, h, z, self%finish)
      first = 1.0_wp
      do j = 1, size(self%start%held)
         if (.not. (self%start%held(j) .and. self%finish%held(j))) cycle
         do i = 1, 2
            if (.not. self%start%rate(i, j) < 0.0_wp) cycle
            call cubic_turn(h, [self%start%value(i, j), self%finish%value(i, j)], [self%start%rate(i, j), self%finish%rate(i, j)], &
                            turns, lowest, theta)
            if (.not. turns) cycle
            least = min(self%start%value(i, j), self%finish%value(i, j))
            dip = least - lowest
            if (dip > self%finish%noise(j) .and. lowest < uncertain*dip) first = min(first, theta)
         end do
      end do
      again = first < 1.0_wp .and. first > 0.0_wp
      if (again) then
         h = first*h
         return
      end if
      self%start = self%finish
      call limit(self)
   end subroutine passes_over

   !> The longest step from where the last one ended.
   pure subroutine limit(self)
      class(sticking_t), intent(inout) :: self

      real(wp) :: fastest

      fastest = merge(self%fastest, self%fastest_error, any(self%start%held))
      self%longest = huge(1.0_wp)
      if (fastest > 0.0_wp) self%longest = longest_angle/fastest
   end subroutine limit

   !> What sticks at (tau, z), after or before a step h, with what room.
   subroutine measure(self, field, tau, h, z, room)
      class(sticking_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h, z(:)
      type(room_t), intent(inout) :: room

      real(wp) :: delta
      integer :: j

      call field%accelerate(tau, z, self%a)
      field%evaluations = field%evaluations + 1
      do j = 1, size(room%held)
         room%held(j) = field%does(j) == constrained .and. field%machine%contact(j)%law%of_normal
         if (room%held(j)) room%noise(j) = of_force*(abs(field%force(j)) + abs(field%normal(j)) &
                                                     + norm2(self%a)/norm2(field%w(:, j)))
      end do
      if (.not. any(room%held)) return
      call look(field, room%held, room%value)
      delta = of_step*h/max(1.0_wp, self%fastest*h)
      self%moved(:field%m) = z(:field%m) + delta*z(field%m + 1:)
      self%moved(field%m + 1:) = z(field%m + 1:) + delta*self%a
      ! The same branches a little later, whether friction could hold then or not.
      field%treatment = treat_by_events
      call field%accelerate(tau + delta, self%moved, self%a)
      field%treatment = treat_by_switching
      field%evaluations = field%evaluations + 1
      call look(field, room%held, room%rate)
      room%rate = (room%rate - room%value)/delta
   end subroutine measure

   !> Room of the forces in the field's workspace.
   subroutine look(field, held, room)
      type(field_t), intent(in) :: field
      logical, intent(in) :: held(:)
      real(wp), intent(inout) :: room(:, :)

      integer :: j

      do j = 1, size(held)
         if (.not. held(j)) cycle
         associate (guard => field%machine%contact(j)%law%force_guard(branch_sticking))
            room(1, j) = guard%upper*field%normal(j) - field%force(j)
            room(2, j) = field%force(j) - guard%lower*field%normal(j)
         end associate
      end do
   end subroutine look

end module razy_runge_kutta_sticking
