!! What the ends of a step say about the guards in it.
!!
!! A path that touches 0 is at least g0 + g1 long; its speed is at most that at the ends and what twice their accelerations add
!! in half the step. By the same bound a guard may be known to rise or to fall all the way. Functions of the rate and forces are
!! trusted only if twice the room of a cubic's control points is left.
module razy_integrate_runge_kutta_bounds
   use razy_core_kinds, only: wp
   use razy_integrate_field, only: field_t
   use razy_integrate_runge_kutta_probe, only: guard_probe_t
   use razy_integrate_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: guard_bounds_t

   type, extends(guard_probe_t) :: guard_bounds_t
      !> Guards and their rates at the start and the end of a step (count each).
      real(wp), allocatable :: g0(:), rate0(:), g1(:), rate1(:)
      !> |s''| at the start and the end of a step (contacts each).
      real(wp), allocatable :: bend0(:), bend1(:)
      !> Where a guard that fell has turned in the step, the least |g| there, at least half of it; huge where it has not (count).
      real(wp), allocatable :: nearest(:)
      !> Guards that fall all the way.
      logical, allocatable :: falling(:)
      !> Whether all guards are functions of s alone.
      logical, private :: of_s = .false.
   contains
      procedure :: make_bounds
      procedure :: start
      procedure :: advance
      procedure :: choose_suspects
      procedure :: clear
   end type guard_bounds_t

contains

   !> Make room for a machine.
   subroutine make_bounds(self, field)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: n

      call self%make_room(field)
      n = size(self%guards%entry)
      if (allocated(self%g0)) deallocate (self%g0, self%rate0, self%g1, self%rate1, self%bend0, self%bend1, self%falling, &
                                          self%nearest)
      allocate (self%g0(n), self%rate0(n), self%g1(n), self%rate1(n), source=0.0_wp)
      allocate (self%falling(n), source=.false.)
      allocate (self%nearest(n), source=huge(1.0_wp))
      allocate (self%bend0(size(field%branch)), self%bend1(size(field%branch)), source=0.0_wp)
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
         self%bend1(j) = abs(field%second_rate(j, dz(field%m + 1:)))
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

      real(wp) :: b0, b1, lowest, room, turn
      integer :: i, j, m, n

      m = field%m
      n = size(field%branch)
      do j = 1, n
         self%bend1(j) = abs(field%second_rate(j, stepper%dz_end(m + 1:)))
      end do
      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i))
            if (entry%function > 0 .and. .not. abs(entry%beta) > 0.0_wp) then
               turn = abs(entry%alpha)*stepper%h*max(self%bend0(entry%contact), self%bend1(entry%contact))
               self%suspect(i) = reached(self%g0(i), self%rate0(i), self%g1(i), self%rate1(i), turn, stepper%h, &
                                         self%guards%noise(i))
               self%falling(i) = self%g0(i) > self%guards%noise(i) .and. max(self%rate0(i), self%rate1(i)) < -turn
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

   !> Whether a guard may be left in a step h in which its rate cannot change by more than `turn` from that at the nearer end. Of
   !> one that rises all the way only its end tells.
   pure function reached(g0, rate0, g1, rate1, turn, h, noise)
      real(wp), intent(in) :: g0, rate0, g1, rate1, turn, h, noise
      logical :: reached

      reached = min(g0, g1) <= noise .or. g0 + g1 <= h*(max(abs(rate0), abs(rate1)) + turn)
      if (reached .and. g1 > noise) reached = min(rate0, rate1) <= turn
   end function reached

   !> Whether no guard can be left or turn in the step h that follows the one looked at last, and that ends at z with the slope dz
   !> and the phases of the field's workspace. If so that step is the one looked at last.
   pure subroutine clear(self, field, h, z, dz, free)
      class(guard_bounds_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: z(:), dz(:)
      logical, intent(out) :: free

      real(wp) :: g(self%guards%count), g_rate(self%guards%count), turn
      real(wp), dimension(size(self%bend1)) :: bend, rate, s
      integer :: i, j

      free = self%of_s
      if (.not. free) return
      call look(size(bend), field%m, size(field%omega), field%w, field%error_re, field%error_im, field%omega, field%c, field%d, &
                z, dz, s, rate, bend)
      do i = 1, self%guards%count
         associate (entry => self%guards%entry(i))
            j = entry%contact
            g(i) = entry%side*(entry%alpha*(s(j) + field%machine%contact(j)%offset) + entry%gamma - entry%bound)
            g_rate(i) = entry%side*entry%alpha*(rate(j) + field%machine%contact(j)%drive)
            turn = abs(entry%alpha)*h*max(self%bend1(j), bend(j))
         end associate
         free = .not. (self%rate1(i) < 0.0_wp .and. g_rate(i) > 0.0_wp)
         if (free) free = .not. reached(self%g1(i), self%rate1(i), g(i), g_rate(i), turn, h, self%guards%noise(i))
         if (.not. free) return
      end do
      do i = 1, self%guards%count
         self%g0(i) = self%g1(i)
         self%rate0(i) = self%rate1(i)
         self%g1(i) = g(i)
         self%rate1(i) = g_rate(i)
      end do
      do j = 1, size(bend)
         self%bend0(j) = self%bend1(j)
         self%bend1(j) = bend(j)
      end do

   contains

      !> s and s' without their constant terms, and |s''|, of all contacts.
      pure subroutine look(contacts, m, tones, w, re, im, omega, c, d, z, dz, s, rate, bend)
         integer, intent(in) :: contacts, m, tones
         real(wp), intent(in) :: w(m, contacts), re(contacts, tones), im(contacts, tones), omega(tones), c(tones), d(tones)
         real(wp), intent(in) :: z(2*m), dz(2*m)
         real(wp), dimension(contacts), intent(out) :: s, rate, bend

         real(wp) :: error
         integer :: i, j, t

         do j = 1, contacts
            s(j) = 0.0_wp
            rate(j) = 0.0_wp
            bend(j) = 0.0_wp
            do i = 1, m
               s(j) = s(j) + w(i, j)*z(i)
               rate(j) = rate(j) + w(i, j)*dz(i)
               bend(j) = bend(j) + w(i, j)*dz(m + i)
            end do
            do t = 1, tones
               error = re(j, t)*c(t) - im(j, t)*d(t)
               s(j) = s(j) + error
               rate(j) = rate(j) - omega(t)*(re(j, t)*d(t) + im(j, t)*c(t))
               bend(j) = bend(j) - omega(t)**2*error
            end do
            bend(j) = abs(bend(j))
         end do
      end subroutine look

   end subroutine clear

end module razy_integrate_runge_kutta_bounds
