!! Steps over friction that sticks with the treatment `switching`.
!!
!! What sticks feels nothing of its load, nor does what is in free flight feel the edge that moves under it, so the error of a
!! step says nothing of the excitation there: a step is no longer than `longest_angle` of the fastest that counts. Between its
!! ends the cubic with the values and rates of the room that a sticking force has up to its bound tells where that is least. If
!! the force may reach its bound there, the step ends there instead: what slips then does so in a stage, and the error of the step
!! finds where it begins.
module razy_runge_kutta_sticking
   use razy_contact_friction_law, only: branch_sticking
   use razy_core_kinds, only: wp
   use razy_hybrid_mode, only: constrained
   use razy_hybrid_system, only: system_t
   use razy_runge_kutta_right_hand_side, only: right_hand_side_t, treat_by_events, treat_by_switching
   implicit none(type, external)
   private

   public :: sticking_t

   !> Room of the sticking force of each friction element on both sides, N, and its rate, N/s (2, contacts), where it sticks.
   type :: room_t
      logical, allocatable :: sticking(:)
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
   contains
      procedure :: make_ready
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

   !> Take a system; steps of a method that is not `adaptive` are as the user wants them.
   subroutine make_ready(self, rhs, system, adaptive)
      class(sticking_t), intent(inout) :: self
      type(right_hand_side_t), intent(in) :: rhs
      type(system_t), intent(in) :: system
      logical, intent(in) :: adaptive

      integer :: j, n

      n = size(rhs%dynamics%mode%branch)
      self%sticks = any([(system%machine%contact(j)%law%of_normal, j=1, n)])
      self%watching = adaptive .and. rhs%treatment == treat_by_switching
      self%longest = huge(1.0_wp)
      self%fastest = system%fastest
      self%fastest_error = 0.0_wp
      do j = 1, n
         self%fastest_error = max(self%fastest_error, maxval([0.0_wp, system%omega], [.true., abs(system%gap(j)%error) > 0.0_wp]))
      end do
      call make_room(self%start, n)
      call make_room(self%finish, n)
   end subroutine make_ready

   pure subroutine make_room(room, n)
      type(room_t), intent(inout) :: room
      integer, intent(in) :: n

      if (allocated(room%sticking)) deallocate (room%sticking, room%value, room%rate, room%noise)
      allocate (room%sticking(n), source=.false.)
      allocate (room%value(2, n), room%rate(2, n), room%noise(n), source=0.0_wp)
   end subroutine make_room

   !> The motion starts at z, now, and may last for `rest`, s.
   subroutine begin(self, rhs, system, rest, z)
      class(sticking_t), intent(inout) :: self
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rest, z(:)

      if (self%sticks) call measure(rhs, system, 0.0_wp, rest, self%fastest, z, self%start)
      call limit(self)
   end subroutine begin

   !> Whether the accepted step h to z may have passed over sliding, so that it has to be made again with the shorter
   !> h given back. If not, the next step starts where this one ends.
   subroutine passes_over(self, rhs, system, z, h, again)
      class(sticking_t), intent(inout) :: self
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:)
      real(wp), intent(inout) :: h
      logical, intent(out) :: again

      real(wp) :: dip, first, least, lowest, theta
      integer :: i, j
      logical :: turns

      again = .false.
      if (.not. self%sticks) return
      call measure(rhs, system, h, h, self%fastest, z, self%finish)
      first = 1.0_wp
      do j = 1, size(self%start%sticking)
         if (.not. (self%start%sticking(j) .and. self%finish%sticking(j))) cycle
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

      fastest = merge(self%fastest, self%fastest_error, any(self%start%sticking))
      self%longest = huge(1.0_wp)
      if (fastest > 0.0_wp) self%longest = longest_angle/fastest
   end subroutine limit

   !> What sticks at (tau, z), after or before a step h, with what room; `fastest` is the excitation, rad/s.
   subroutine measure(rhs, system, tau, h, fastest, z, room)
      type(right_hand_side_t), intent(inout) :: rhs
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, h, fastest, z(:)
      type(room_t), intent(inout) :: room

      real(wp) :: a(system%m), delta, moved(2*system%m)
      integer :: j

      call rhs%accelerate(system, tau, z, a)
      rhs%evaluations = rhs%evaluations + 1
      do j = 1, size(room%sticking)
         room%sticking(j) = rhs%dynamics%mode%does(j) == constrained .and. system%machine%contact(j)%law%of_normal
         if (room%sticking(j)) room%noise(j) = of_force*(abs(rhs%dynamics%force(j)) + abs(rhs%dynamics%normal(j)) &
                                                         + norm2(a)/system%reach(j))
      end do
      if (.not. any(room%sticking)) return
      call look(rhs, system, room%sticking, room%value)
      delta = of_step*h/max(1.0_wp, fastest*h)
      moved(:system%m) = z(:system%m) + delta*z(system%m + 1:)
      moved(system%m + 1:) = z(system%m + 1:) + delta*a
      ! The same branches a little later, whether friction could hold then or not.
      rhs%treatment = treat_by_events
      call rhs%accelerate(system, tau + delta, moved, a)
      rhs%treatment = treat_by_switching
      rhs%evaluations = rhs%evaluations + 1
      call look(rhs, system, room%sticking, room%rate)
      room%rate = (room%rate - room%value)/delta
   end subroutine measure

   !> Room of the forces looked at last.
   subroutine look(rhs, system, sticking, room)
      type(right_hand_side_t), intent(in) :: rhs
      type(system_t), intent(in) :: system
      logical, intent(in) :: sticking(:)
      real(wp), intent(inout) :: room(:, :)

      integer :: j

      do j = 1, size(sticking)
         if (.not. sticking(j)) cycle
         associate (guard => system%machine%contact(j)%law%branch(branch_sticking)%force_guard)
            room(1, j) = guard%upper*rhs%dynamics%normal(j) - rhs%dynamics%force(j)
            room(2, j) = rhs%dynamics%force(j) - guard%lower*rhs%dynamics%normal(j)
         end associate
      end do
   end subroutine look

   !> Whether the cubic with the values f and the rates at the ends of a step h turns in it, and where, in parts of the step.
   pure subroutine cubic_turn(h, f, rate, turns, at_turn, theta)
      real(wp), intent(in) :: h, f(2), rate(2)
      logical, intent(out) :: turns
      real(wp), intent(out) :: at_turn, theta

      real(wp) :: a, b, c, q, unit

      turns = min(rate(1), rate(2)) < 0.0_wp .and. max(rate(1), rate(2)) > 0.0_wp
      at_turn = f(1)
      theta = 0.0_wp
      if (.not. turns) return
      ! f(1) + a θ + b θ² + c θ³
      a = h*rate(1)
      b = 3*(f(2) - f(1)) - h*(2*rate(1) + rate(2))
      c = h*(rate(1) + rate(2)) - 2*(f(2) - f(1))
      ! Squares in units of the coefficients: those of a motion that has died out are none.
      unit = max(abs(a), abs(b), abs(c), tiny(1.0_wp))
      q = b + sign(unit*sqrt(max((b/unit)**2 - 3*(a/unit)*(c/unit), 0.0_wp)), b)
      ! Of the roots -a/q and -q/(3c) of the slope one is in the step.
      theta = 0.5_wp
      if (abs(q) > 0.0_wp) theta = -a/q
      if (.not. (theta >= 0.0_wp .and. theta <= 1.0_wp) .and. abs(c) > epsilon(c)*abs(q)) theta = -q/(3*c)
      theta = min(max(theta, 0.0_wp), 1.0_wp)
      at_turn = f(1) + theta*(a + theta*(b + theta*c))
   end subroutine cubic_turn

end module razy_runge_kutta_sticking
