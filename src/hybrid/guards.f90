!! What can end a branch of a contact, as functions that stay positive as long as it holds.
!!
!! Every bound of a switching function alpha s + beta s' + gamma, and every bound of a constraint force, is a guard
!! g = side (function - bound) >= 0. `look` gives g and its rate; a force's rate is a difference along the motion. `noise` is the
!! rounding in g: what is closer to 0 than that is on the bound.
module razy_hybrid_guards
   use razy_contact_contact_law, only: guard_t
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   implicit none(type, external)
   private

   public :: guard_entry_t, guards_t

   !> One guard: contact, number of its switching function (0: constraint force), side and bound, and the branch beyond.
   type :: guard_entry_t
      integer :: contact = 0, function = 0, next = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp, alpha = 0.0_wp, beta = 0.0_wp, gamma = 0.0_wp
      !> Whether the bound is one per normal force.
      logical :: of_normal = .false.
   end type guard_entry_t

   !> The guards (count) of all contacts in a mode; no array is shorter than any mode needs.
   type :: guards_t
      integer :: count = 0
      type(guard_entry_t), allocatable :: entry(:)
      !> Rounding in g.
      real(wp), allocatable :: noise(:)
      !> Whether a function needs s'', or a constraint force; whether there is a force among them.
      logical :: accelerated = .false., forced = .false.
      !> Time over which rates of forces are taken, s.
      real(wp) :: delta = 0.0_wp
      !> Size of the terms of s and s' seen in this piece (contacts).
      real(wp), allocatable :: size_s(:), size_rate(:)
      !> Lengths of the contact directions (contacts).
      real(wp), allocatable :: reach(:)
      !> Largest angular frequency that the guards feel at once, whatever the motion is, rad/s: of errors of s, and of loads where
      !> there is a force among them; of errors alone, of all tones.
      real(wp) :: fastest = 0.0_wp
      real(wp), private :: fastest_error = 0.0_wp, fastest_tone = 0.0_wp
      !> Rounding of the field's time, s.
      real(wp) :: of_time = 0.0_wp
      real(wp), allocatable :: a(:), moved(:)
   contains
      procedure :: attach
      procedure :: watch
      procedure :: measure
      procedure :: look
      procedure :: on_s
      procedure :: on_rate
   end type guards_t

   !> Rounding of a sum in units of its largest term, and of a constraint force.
   real(wp), parameter :: of_sum = 16*epsilon(1.0_wp), of_force = 256*epsilon(1.0_wp)

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(guards_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: contacts, t

      contacts = size(field%branch)
      if (allocated(self%entry)) deallocate (self%entry, self%noise, self%size_s, self%size_rate, self%a, self%moved, &
                                             self%reach)
      allocate (self%entry(8*contacts), self%noise(8*contacts), self%size_s(contacts), self%size_rate(contacts))
      allocate (self%a(field%m), self%moved(2*field%m), source=0.0_wp)
      self%size_s = 0.0_wp
      self%size_rate = 0.0_wp
      self%reach = norm2(field%w, dim=1)
      self%fastest_error = 0.0_wp
      self%fastest_tone = 0.0_wp
      do t = 1, size(field%omega)
         self%fastest_tone = max(self%fastest_tone, field%omega(t))
         if (any(abs(field%error_re(:, t)) + abs(field%error_im(:, t)) > 0.0_wp)) then
            self%fastest_error = max(self%fastest_error, field%omega(t))
         end if
      end do
   end subroutine attach

   !> List the guards of the field's branches.
   subroutine watch(self, field)
      class(guards_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: f, j

      self%count = 0
      self%accelerated = .false.
      self%forced = .false.
      do j = 1, size(field%branch)
         associate (law => field%machine%contact(j)%law, branch => field%branch(j))
            if (law%constraint(branch)) then
               call add(self, j, 0, law%force_guard(branch), [0.0_wp, 0.0_wp, 0.0_wp], law%of_normal)
               cycle
            end if
            do f = 1, law%functions
               call add(self, j, f, law%guard(f, branch), [law%slope(:, f), law%constant(f)], .false.)
            end do
         end associate
      end do
      self%fastest = merge(self%fastest_tone, self%fastest_error, self%forced)
   end subroutine watch

   subroutine add(self, j, f, guard, coefficients, of_normal)
      type(guards_t), intent(inout) :: self
      integer, intent(in) :: j, f
      type(guard_t), intent(in) :: guard
      real(wp), intent(in) :: coefficients(3)
      logical, intent(in) :: of_normal

      if (guard%below == 0 .and. guard%above == 0) return
      if (guard%below /= 0) call put(guard%below, 1.0_wp, guard%lower)
      if (guard%above /= 0) call put(guard%above, -1.0_wp, guard%upper)
      self%forced = self%forced .or. f == 0
      self%accelerated = self%accelerated .or. f == 0 .or. abs(coefficients(2)) > 0.0_wp

   contains

      subroutine put(next, side, bound)
         integer, intent(in) :: next
         real(wp), intent(in) :: side, bound

         self%count = self%count + 1
         self%entry(self%count) = guard_entry_t(j, f, next, side, bound, coefficients(1), coefficients(2), coefficients(3), &
                                                of_normal)
      end subroutine put

   end subroutine add

   !> Take up the size of the terms at (tau, z), and the rounding of time there; `anew` forgets those seen before.
   pure subroutine measure(self, field, tau, z, anew)
      class(guards_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: tau, z(:)
      logical, intent(in) :: anew

      real(wp) :: length, rate, s, speed
      integer :: i, j, t

      self%of_time = 4*epsilon(1.0_wp)*abs(tau)
      ! What is rounding in one coordinate reaches all others through the matrices.
      length = norm2(z(:field%m))
      speed = norm2(z(field%m + 1:))
      do j = 1, size(field%branch)
         s = abs(field%machine%contact(j)%offset) + self%reach(j)*length
         rate = abs(field%machine%contact(j)%drive) + self%reach(j)*speed
         do t = 1, size(field%omega)
            s = s + (abs(field%error_re(j, t)) + abs(field%error_im(j, t)))
            rate = rate + field%omega(t)*(abs(field%error_re(j, t)) + abs(field%error_im(j, t)))
         end do
         if (.not. anew) s = max(s, self%size_s(j))
         if (.not. anew) rate = max(rate, self%size_rate(j))
         self%size_s(j) = s
         self%size_rate(j) = rate
      end do
      do i = 1, self%count
         associate (entry => self%entry(i))
            self%noise(i) = of_sum*(abs(entry%gamma) + abs(entry%bound)) + abs(entry%alpha)*self%on_s(entry%contact) &
                            + abs(entry%beta)*self%on_rate(entry%contact)
         end associate
      end do
   end subroutine measure

   !> Rounding of s and of s' of contact j.
   pure function on_s(self, j) result(noise)
      class(guards_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp) :: noise

      noise = of_sum*self%size_s(j) + self%of_time*self%size_rate(j)
   end function on_s

   pure function on_rate(self, j) result(noise)
      class(guards_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp) :: noise

      noise = of_sum*self%size_rate(j)
   end function on_rate

   !> g and g' (count each) at (tau, z).
   subroutine look(self, field, tau, z, g, rate)
      class(guards_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: g(:), rate(:)

      integer :: i

      if (self%forced) then
         call field%accelerate(tau, z, self%a)
         self%moved(:field%m) = z(:field%m) + self%delta*z(field%m + 1:)
         self%moved(field%m + 1:) = z(field%m + 1:) + self%delta*self%a
         call field%accelerate(tau + self%delta, self%moved, self%a)
         do i = 1, self%count
            if (self%entry(i)%function == 0) rate(i) = of_constraint(self%entry(i), field)
         end do
      end if
      if (self%accelerated) call field%accelerate(tau, z, self%a)
      call field%look_at_contacts(tau, z)
      do i = 1, self%count
         associate (entry => self%entry(i))
            if (entry%function == 0) then
               g(i) = of_constraint(entry, field)
               rate(i) = (rate(i) - g(i))/self%delta
               self%noise(i) = of_force*(abs(field%force(entry%contact)) + norm2(self%a)/norm2(field%w(:, entry%contact)))
               if (entry%of_normal) self%noise(i) = self%noise(i) + of_force*abs(entry%bound*field%normal(entry%contact))
            else
               g(i) = entry%side*(entry%alpha*field%s(entry%contact) + entry%beta*field%rate(entry%contact) + entry%gamma &
                                  - entry%bound)
               rate(i) = entry%alpha*field%rate(entry%contact)
               if (abs(entry%beta) > 0.0_wp) rate(i) = rate(i) + entry%beta*field%second_rate(entry%contact, self%a)
               rate(i) = entry%side*rate(i)
            end if
         end associate
      end do
   end subroutine look

   pure function of_constraint(entry, field) result(g)
      type(guard_entry_t), intent(in) :: entry
      type(field_t), intent(in) :: field
      real(wp) :: g

      g = entry%bound
      if (entry%of_normal) g = entry%bound*field%normal(entry%contact)
      g = entry%side*(field%force(entry%contact) - g)
   end function of_constraint

end module razy_hybrid_guards
