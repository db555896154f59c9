!! What the ends of a step say about the guards in it.
!!
!! A path that touches 0 is at least g0 + g1 long; its speed is at most that at the ends and what twice their accelerations add
!! in half the step. A guard that rises or falls all the way (razy_runge_kutta_one_way) is told by its ends. Functions
!! of the rate and forces are trusted only if twice the room of a cubic's control points is left.
!!
!! An excitation that the guards feel and the motion does not (of a gap in free flight, of a force that holds what sticks) does not
!! limit the step. Of a step in which it turns by more than `longest_angle` the ends say nothing.
module razy_runge_kutta_bounds
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_one_way, only: one_way
   use razy_runge_kutta_probe, only: guard_probe_t
   use razy_runge_kutta_methods_step_strip, only: longest_strip, step_strip_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: guard_bounds_t

   type, extends(guard_probe_t) :: guard_bounds_t
      !> Guards and their rates at the start and the end of a step (count each).
      real(wp), allocatable :: g0(:), rate0(:), g1(:), rate1(:)
      !> s'' at the start and the end of a step (contacts each).
      real(wp), allocatable :: bend0(:), bend1(:)
      !> Where a guard that fell has turned in the step, the least |g| there, at least half of it; huge where it has not (count).
      real(wp), allocatable :: nearest(:)
      !> Guards that fall all the way.
      logical, allocatable :: falling(:)
      !> Whether all guards are functions of s alone.
      logical, private :: of_s = .false.
      !> At the start and the ends of the steps of a strip: guards and their rates (0: longest_strip, count), s and s' without their
      !> constant terms, and s'' (0: longest_strip, contacts).
      real(wp), allocatable :: g(:, :), g_rate(:, :)
      real(wp), allocatable, private :: s(:, :), rate(:, :), bend(:, :)
      !> Steps of the strip in which a guard that fell has turned (longest_strip, count), and how often that was seen.
      logical, allocatable :: turned(:, :)
      integer :: turns = 0
   contains
      procedure :: make_bounds
      procedure :: start
      procedure :: advance
      procedure :: choose_suspects
      procedure :: clear
      procedure :: move_on
   end type guard_bounds_t

   !> The cubic of a sine over this angle errs by 0.04 of its amplitude, a sixth of the room that is asked for.
   real(wp), parameter :: longest_angle = 2.0_wp

contains

   !> Make room for a machine.
   subroutine make_bounds(self, field)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: contacts, n

      call self%make_room(field)
      n = size(self%guards%entry)
      contacts = size(field%branch)
      if (allocated(self%g0)) deallocate (self%g0, self%rate0, self%g1, self%rate1, self%bend0, self%bend1, self%falling, &
                                          self%nearest, self%g, self%g_rate, self%s, self%rate, self%bend, self%turned)
      allocate (self%g(0:longest_strip, n), self%g_rate(0:longest_strip, n), source=0.0_wp)
      allocate (self%turned(longest_strip, n), source=.false.)
      allocate (self%s(0:longest_strip, contacts), self%rate(0:longest_strip, contacts), self%bend(0:longest_strip, contacts), &
                source=0.0_wp)
      allocate (self%g0(n), self%rate0(n), self%g1(n), self%rate1(n), source=0.0_wp)
      allocate (self%falling(n), source=.false.)
      allocate (self%nearest(n), source=huge(1.0_wp))
      allocate (self%bend0(contacts), self%bend1(contacts), source=0.0_wp)
   end subroutine make_bounds

   !> List the guards of the field's mode, which begins at (tau, z) with the slope dz: it is as if a step had ended there.
   subroutine start(self, field, tau, z, dz)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), dz(:)

      integer :: j

      call self%guards%watch(field)
      call self%guards%measure(field, tau, z, .false.)
      call self%guards%look(field, tau, z, self%g1, self%rate1)
      call field%look_at_time(tau)
      do j = 1, size(self%bend1)
         self%bend1(j) = field%second_rate(j, dz(field%m + 1:))
      end do
      self%of_s = .not. (self%guards%forced .or. self%guards%accelerated)
   end subroutine start

   !> Go on to the next step of the mode, after nothing was found.
   pure subroutine advance(self)
      class(guard_bounds_t), intent(inout) :: self

      integer :: i

      do i = 1, self%guards%count
         self%g0(i) = self%g1(i)
         self%rate0(i) = self%rate1(i)
      end do
      do i = 1, size(self%bend0)
         self%bend0(i) = self%bend1(i)
      end do
   end subroutine advance

   !> The guards that could be left in the step, at whose end the guards have just been looked at, and those that fall all the way
   !> and have no more than one root.
   pure subroutine choose_suspects(self, field, stepper)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper

      real(wp) :: b0, b1, lowest, room
      integer :: i, j, m, n

      m = field%m
      n = size(field%branch)
      if (self%guards%fastest*stepper%h > longest_angle) then
         self%suspect(:self%guards%count) = .true.
         self%falling(:self%guards%count) = .false.
      end if
      do j = 1, n
         self%bend1(j) = field%second_rate(j, stepper%dz_end(m + 1:))
      end do
      if (self%guards%fastest*stepper%h > longest_angle) return
      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i))
            if (entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp) then
               self%suspect(i) = reached(self%g0(i), self%rate0(i), self%g1(i), self%rate1(i), entry%side*entry%alpha, &
                                         self%bend0(entry%contact), self%bend1(entry%contact), stepper%h, self%guards%noise(i))
               self%falling(i) = self%g0(i) > self%guards%noise(i)
               if (self%falling(i)) self%falling(i) = one_way(stepper%h, self%rate0(i), self%rate1(i), &
                                                              entry%side*entry%alpha*self%bend0(entry%contact), &
                                                              entry%side*entry%alpha*self%bend1(entry%contact)) < 0
            else
               b0 = self%g0(i) + stepper%h*self%rate0(i)/3
               b1 = self%g1(i) - stepper%h*self%rate1(i)/3
               lowest = min(self%g0(i), b0, b1, self%g1(i))
               room = 2*max(abs(b0 - self%g0(i)), abs(b1 - self%g1(i)), abs(self%g1(i) - self%g0(i)))
               self%suspect(i) = lowest <= room
               self%falling(i) = .false.
            end if
         end associate
      end do
   end subroutine choose_suspects

   !> Whether a guard may be left in a step h; its second derivative is `factor` times those at the ends, bend0 and bend1. Of one
   !> that goes one way only its values at the ends tell.
   pure function reached(g0, rate0, g1, rate1, factor, bend0, bend1, h, noise)
      real(wp), intent(in) :: g0, rate0, g1, rate1, factor, bend0, bend1, h, noise
      logical :: reached

      integer :: way

      reached = min(g0, g1) <= noise &
                .or. g0 + g1 <= h*(max(abs(rate0), abs(rate1)) + h*abs(factor)*max(abs(bend0), abs(bend1)))
      if (.not. reached .or. .not. g1 > noise) return
      way = one_way(h, rate0, rate1, factor*bend0, factor*bend1)
      if (way < 0) reached = .false.
      if (way > 0) reached = g0 < -noise
   end function reached

   !> Number of steps of a strip, which begins where the step looked at last ends, in which no guard can be left; `free` of them are
   !> known to be such. Of those in which a guard turns, `turned` is noted.
   pure subroutine clear(self, field, strip, free)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(step_strip_t), intent(in) :: strip
      integer, intent(inout) :: free

      integer :: before, i, j, k

      if (.not. self%of_s) return
      before = free
      if (self%guards%fastest*strip%h > longest_angle) return
      free = strip%count
      if (before == 0) self%turns = 0
      call look(size(self%bend1), field%m, size(field%omega), before + 1, free, field%w, field%error_re, field%error_im, &
                field%omega, strip%z, strip%u, self%s, self%rate, self%bend)
      if (before == 0) self%bend(0, :) = self%bend1
      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i), g => self%g(:, i), rate => self%g_rate(:, i), noise => self%guards%noise(i))
            j = entry%contact
            if (before == 0) then
               g(1) = self%g1(i)
               rate(1) = self%rate1(i)
            end if
            do k = before + 1, free
               g(k + 1) = entry%side*(entry%alpha*(self%s(k, j) + field%machine%contact(j)%offset) + entry%gamma - entry%bound)
               rate(k + 1) = entry%side*entry%alpha*(self%rate(k, j) + field%machine%contact(j)%drive)
               if (reached(g(k), rate(k), g(k + 1), rate(k + 1), entry%side*entry%alpha, self%bend(k - 1, j), self%bend(k, j), &
                           strip%h, noise)) exit
               self%turned(k, i) = rate(k) < 0.0_wp .and. rate(k + 1) > 0.0_wp
               if (self%turned(k, i)) self%turns = self%turns + 1
            end do
            free = min(free, k - 1)
         end associate
      end do

   contains

      !> s and s' without their constant terms, and s'', of all contacts at the ends of all steps.
      pure subroutine look(contacts, m, tones, first, last, w, re, im, omega, z, u, s, rate, bend)
         integer, intent(in) :: contacts, m, tones, first, last
         real(wp), intent(in) :: w(m, contacts), re(contacts, tones), im(contacts, tones), omega(tones)
         real(wp), intent(in) :: z(2*m, 0:longest_strip), u(2*(m + tones), 0:longest_strip)
         real(wp), dimension(0:longest_strip, contacts), intent(inout) :: s, rate, bend

         real(wp) :: error, s_bend, s_rate, s_value
         integer :: i, j, k, t

         do j = 1, contacts
            do k = first, last
               s_value = 0.0_wp
               s_rate = 0.0_wp
               s_bend = 0.0_wp
               do i = 1, m
                  s_value = s_value + w(i, j)*z(i, k)
                  s_rate = s_rate + w(i, j)*u(i, k)
                  s_bend = s_bend + w(i, j)*u(m + i, k)
               end do
               do t = 1, tones
                  error = re(j, t)*u(2*m + t, k) - im(j, t)*u(2*m + tones + t, k)
                  s_value = s_value + error
                  s_rate = s_rate - omega(t)*(re(j, t)*u(2*m + tones + t, k) + im(j, t)*u(2*m + t, k))
                  s_bend = s_bend - omega(t)**2*error
               end do
               s(k, j) = s_value
               rate(k, j) = s_rate
               bend(k, j) = s_bend
            end do
         end do
      end subroutine look

   end subroutine clear

   !> The step looked at last is number k of the strip that `clear` has looked at.
   pure subroutine move_on(self, k)
      class(guard_bounds_t), intent(inout) :: self
      integer, intent(in) :: k

      integer :: i, j

      do i = 1, self%guards%count
         self%g0(i) = self%g(k - 1, i)
         self%rate0(i) = self%g_rate(k - 1, i)
         self%g1(i) = self%g(k, i)
         self%rate1(i) = self%g_rate(k, i)
      end do
      do j = 1, size(self%bend1)
         self%bend0(j) = self%bend(k - 1, j)
         self%bend1(j) = self%bend(k, j)
      end do
   end subroutine move_on

end module razy_runge_kutta_bounds
