!! What can end a mode, as functions that stay positive as long as it lasts.
!!
!! Every bound of a switching function alpha s + beta s' + gamma, every bound of a constraint force, and every force of a compliant
!! contact that presses friction and may pull, is a guard g = side (function - bound) >= 0. `look` gives g and its rate, in any
!! mode; a constraint force's rate is a difference along the motion. Where laws are piecewise linear a guard is a linear form
!! (`guard_forms`). `noise` is the rounding in g: what is closer to 0 than that is on the bound.
module razy_hybrid_guards
   use razy_contact_contact_law, only: guard_t
   use razy_core_kinds, only: wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_press, only: may_pull
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: guard_entry_t, guard_forms, guards_t, list_guards, lowest_flight, of_force, of_press

   !> Numbers in the place of a switching function's: a constraint force, the force that presses friction.
   integer, parameter :: of_force = 0, of_press = -1

   !> One guard: contact, number of its switching function, and the branch beyond; side and bound of alpha s + beta s' + gamma.
   type :: guard_entry_t
      integer :: contact = 0, function = 0, next = 0
      real(wp) :: side = 0.0_wp, bound = 0.0_wp, alpha = 0.0_wp, beta = 0.0_wp, gamma = 0.0_wp
      !> Whether the bound is one per normal force; whether it is another bound of the function before it in the list.
      logical :: of_normal = .false., shares = .false.
   end type guard_entry_t

   !> The guards (the first `count`) of all contacts in a mode; no array is shorter than any mode needs.
   type :: guards_t
      integer :: count = 0
      type(guard_entry_t), allocatable :: entry(:)
      !> Rounding in g.
      real(wp), allocatable :: noise(:)
      !> Whether a function needs s'', whether there is a force of a constraint among them.
      logical, private :: accelerated = .false.
      logical :: forced = .false.
      !> Time over which rates of constraint forces are taken, s.
      real(wp) :: delta = 0.0_wp
      !> Largest angular frequency that the guards feel at once, whatever the motion is, rad/s: of errors of s, and of loads where
      !> there is a constraint force among them.
      real(wp) :: fastest = 0.0_wp
      !> Size of the terms of s and s' seen in this motion, their rounding, lengths of the contact directions (contacts each).
      real(wp), allocatable :: size_s(:), size_rate(:), on_s(:), on_rate(:), reach(:)
      !> Largest lengths of y and y' seen in this motion, to whose rounding a state is known, and what accelerations change by with
      !> these, 1/s² and 1/s.
      real(wp) :: seen(2) = 0.0_wp, slope(2) = 0.0_wp
      !> Sizes of the errors of s and of their rates (contacts each).
      real(wp), allocatable, private :: error(:), error_rate(:)
      real(wp), private :: fastest_error = 0.0_wp
      real(wp), allocatable, private :: a(:), moved(:)
   contains
      procedure :: make_room
      procedure :: list
      procedure :: measure
      procedure :: look
   end type guards_t

   !> Rounding of a sum in units of its largest term, and of a constraint force.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp), rounding_of_force = 256*epsilon(1.0_wp)

   !> A flight lower than so many roundings of its gap is not followed.
   real(wp), parameter :: lowest_flight = 16.0_wp

contains

   !> All guards of a mode, of friction in play and of contacts that can move only: the first `count` of `entry`, whose size has to
   !> be 8 a contact.
   subroutine list_guards(system, mode, entry, count)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(guard_entry_t), intent(inout) :: entry(:)
      integer, intent(out) :: count

      integer :: f, j

      count = 0
      do j = 1, size(mode%branch)
         associate (law => system%machine%contact(j)%law, branch => mode%branch(j))
            if (law%of_normal .and. .not. mode%in_play(system, j)) cycle
            if (law%branch(branch)%constraint) then
               call add(guard_entry_t(contact=j, function=of_force, of_normal=law%of_normal), law%branch(branch)%force_guard)
               cycle
            end if
            if (mode%still(j)) cycle
            do f = 1, law%functions
               call add(guard_entry_t(contact=j, function=f, alpha=law%slope(1, f), beta=law%slope(2, f), gamma=law%constant(f)), &
                        law%branch(branch)%guard(f))
            end do
         end associate
      end do
      do j = 1, size(mode%branch)
         if (may_pull(system, mode, j)) call add(guard_entry_t(contact=j, function=of_press), guard_t(below=mode%branch(j)))
      end do

   contains

      subroutine add(guard, bounds)
         type(guard_entry_t), intent(in) :: guard
         type(guard_t), intent(in) :: bounds

         call put(guard, bounds%below, 1.0_wp, bounds%lower, .false.)
         call put(guard, bounds%above, -1.0_wp, bounds%upper, bounds%below /= 0 .and. .not. guard%of_normal)
      end subroutine add

      subroutine put(guard, next, side, bound, shares)
         type(guard_entry_t), intent(in) :: guard
         integer, intent(in) :: next
         real(wp), intent(in) :: side, bound
         logical, intent(in) :: shares

         if (next == 0) return
         count = count + 1
         entry(count) = guard_entry_t(guard%contact, guard%function, next, side, bound, guard%alpha, guard%beta, guard%gamma, &
                                      guard%of_normal, shares)
      end subroutine put

   end subroutine list_guards

   !> The guards of a mode with piecewise-linear laws as linear forms less their bounds' parts that move: form `i` stays on `side`
   !> of `entry(i)%bound`, which is 0 for bounds per normal force. `force`: the forces of all contacts, constraints included.
   pure subroutine guard_forms(system, mode, force, entry, form)
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(linear_form_t), intent(in) :: force(:)
      type(guard_entry_t), intent(inout) :: entry(:)
      type(linear_form_t), intent(out) :: form(:)

      type(linear_form_t) :: normal
      integer :: i

      do i = 1, size(entry)
         associate (guard => entry(i))
            select case (guard%function)
            case (of_force)
               form(i) = force(guard%contact)
               if (.not. guard%of_normal) cycle
               normal = total_normal(guard%contact)
               call form(i)%add(-guard%bound, normal)
               guard%bound = 0.0_wp
            case (of_press)
               form(i) = force(system%machine%contact(guard%contact)%normal_of)
               guard%side = real(mode%press(guard%contact), wp)
            case default
               form(i) = system%contact_form(guard%contact, guard%alpha, guard%beta, guard%gamma)
            end select
         end associate
      end do

   contains

      !> Normal force of friction element j that sticks.
      pure function total_normal(j) result(total)
         integer, intent(in) :: j
         type(linear_form_t) :: total

         total = mode%normal_form(system, j)
         associate (by => system%machine%contact(j)%normal_of)
            if (by == 0) return
            associate (law => system%machine%contact(by)%law)
               if (.not. law%branch(mode%branch(by))%constraint) return
               call total%add(merge(1.0_wp, -1.0_wp, law%branch(mode%branch(by))%force_guard%below /= 0), force(by))
            end associate
         end associate
      end function total_normal

   end subroutine guard_forms

   !> Make room for a system.
   subroutine make_room(self, system)
      class(guards_t), intent(out) :: self
      type(system_t), intent(in) :: system

      integer :: contacts, j

      contacts = size(system%machine%contact)
      allocate (self%entry(8*contacts))
      allocate (self%noise(8*contacts), source=0.0_wp)
      allocate (self%size_s(contacts), self%size_rate(contacts), self%on_s(contacts), self%on_rate(contacts), source=0.0_wp)
      allocate (self%a(system%m), self%moved(2*system%m), source=0.0_wp)
      self%reach = system%reach
      self%slope = [norm2(system%coupled%stiffness), norm2(system%coupled%damping)]
      self%error = [(sum(abs(system%gap(j)%error)), j=1, contacts)]
      self%error_rate = [(sum(system%omega*abs(system%gap(j)%error)), j=1, contacts)]
      self%fastest_error = 0.0_wp
      do j = 1, contacts
         self%fastest_error = max(self%fastest_error, maxval([0.0_wp, system%omega], [.true., abs(system%gap(j)%error) > 0.0_wp]))
      end do
      self%count = 0
   end subroutine make_room

   !> List the guards of a mode.
   subroutine list(self, system, mode)
      class(guards_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode

      call list_guards(system, mode, self%entry, self%count)
      associate (guard => self%entry(:self%count))
         self%forced = any(guard%function == of_force)
         self%accelerated = any(guard%function <= 0 .or. abs(guard%beta) > 0.0_wp)
      end associate
      self%fastest = merge(system%fastest, self%fastest_error, self%forced)
   end subroutine list

   !> Take up the size of the terms at z, and the rounding of the time `tau` there, `now` from the start of the
   !> motion; `anew` forgets those seen before.
   pure subroutine measure(self, system, tau, z, anew, now)
      class(guards_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:), now
      logical, intent(in) :: anew

      real(wp), dimension(maxval(system%set)) :: lengths, speeds
      real(wp) :: rate, s
      integer :: i, j

      ! What is rounding in one coordinate reaches all that are coupled with it through the matrices.
      do i = 1, size(lengths)
         lengths(i) = norm2(merge(z(:system%m), 0.0_wp, system%set == i))
         speeds(i) = norm2(merge(z(system%m + 1:), 0.0_wp, system%set == i))
      end do
      self%seen = max([norm2(lengths), norm2(speeds)], merge(0.0_wp, self%seen, anew))
      do j = 1, size(self%reach)
         associate (gap => system%gap(j), length => lengths(system%feels(j)), speed => speeds(system%feels(j)))
            s = abs(gap%constant) + self%reach(j)*length + self%error(j) + sum(abs(system%frame(j)%centre))
            rate = abs(system%machine%contact(j)%drive) + abs(system%machine%contact(j)%drive_rate*now) + self%reach(j)*speed &
                   + self%error_rate(j)
         end associate
         if (.not. anew) s = max(s, self%size_s(j))
         if (.not. anew) rate = max(rate, self%size_rate(j))
         self%size_s(j) = s
         self%size_rate(j) = rate
         self%on_s(j) = rounding*s + 4*epsilon(1.0_wp)*abs(tau)*rate
         self%on_rate(j) = rounding*rate
      end do
      do i = 1, self%count
         associate (guard => self%entry(i))
            self%noise(i) = rounding*(abs(guard%gamma) + abs(guard%bound)) + abs(guard%alpha)*self%on_s(guard%contact) &
                            + abs(guard%beta)*self%on_rate(guard%contact)
         end associate
      end do
   end subroutine measure

   !> g and g' (count each) at (tau, z) of `dynamics`, which is in the mode.
   subroutine look(self, system, dynamics, tau, z, g, rate)
      class(guards_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: g(:), rate(:)

      real(wp) :: held
      integer :: i, j

      associate (m => system%m)
         if (self%forced) then
            call dynamics%accelerate(system, tau, z, self%a)
            self%moved(:m) = z(:m) + self%delta*z(m + 1:)
            self%moved(m + 1:) = z(m + 1:) + self%delta*self%a
            call dynamics%accelerate(system, tau + self%delta, self%moved, self%a)
            do i = 1, self%count
               if (self%entry(i)%function == of_force) rate(i) = of_constraint(self%entry(i), dynamics)
            end do
         end if
         if (self%accelerated) call dynamics%accelerate(system, tau, z, self%a)
         call dynamics%look_at_contacts(system, tau, z)
         ! Forces of constraints come out of one system of equations: none is less uncertain than the largest, nor than the state,
         ! nor than what contacts that give way make of it.
         held = dot_product(self%slope, self%seen)
         if (self%forced) then
            do j = 1, size(self%reach)
               associate (branch => system%machine%contact(j)%law%branch(dynamics%mode%branch(j)))
                  held = held + self%reach(j)*(abs(branch%stiffness)*self%size_s(j) + abs(branch%damping)*self%size_rate(j))
               end associate
            end do
            associate (held_by => dynamics%mode%constraints)
               if (held_by%count > 0) held = held + sum(abs(dynamics%force(held_by%contact))*system%reach(held_by%contact))
            end associate
         end if
         do i = 1, self%count
            select case (self%entry(i)%function)
            case (of_force)
               g(i) = of_constraint(self%entry(i), dynamics)
               ! On a step of no length, as where sequences of impacts end at once, there is no difference.
               rate(i) = (rate(i) - g(i))/max(self%delta, tiny(1.0_wp))
               associate (guard => self%entry(i), j => self%entry(i)%contact, noise => self%noise(i))
                  noise = abs(dynamics%force(j)) + (norm2(self%a) + held)/system%reach(j)
                  if (guard%of_normal) noise = noise + abs(guard%bound*dynamics%normal(j))
                  noise = rounding_of_force*noise
               end associate
            case (of_press)
               call look_at_press(self, system, dynamics, self%entry(i)%contact, g(i), rate(i), self%noise(i))
            case default
               associate (guard => self%entry(i), j => self%entry(i)%contact)
                  g(i) = guard%side*(guard%alpha*dynamics%s(j) + guard%beta*dynamics%rate(j) + guard%gamma - guard%bound)
                  rate(i) = guard%alpha*dynamics%rate(j)
                  if (abs(guard%beta) > 0.0_wp) rate(i) = rate(i) + guard%beta*dynamics%second_rate(system, j, self%a)
                  rate(i) = guard%side*rate(i)
               end associate
            end select
         end do
      end associate
   end subroutine look

   pure function of_constraint(guard, dynamics) result(g)
      type(guard_entry_t), intent(in) :: guard
      type(dynamics_t), intent(in) :: dynamics
      real(wp) :: g

      g = guard%bound
      if (guard%of_normal) g = guard%bound*dynamics%normal(guard%contact)
      g = guard%side*(dynamics%force(guard%contact) - g)
   end function of_constraint

   !> The force that presses friction element j, with the sign it has in the mode, its rate and its rounding.
   pure subroutine look_at_press(self, system, dynamics, j, g, rate, noise)
      type(guards_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: j
      real(wp), intent(out) :: g, rate, noise

      associate (by => system%machine%contact(j)%normal_of, sign => dynamics%mode%press(j))
         associate (piece => system%machine%contact(by)%law%branch(dynamics%mode%branch(by)))
            g = sign*(piece%stiffness*dynamics%s(by) + piece%damping*dynamics%rate(by) + piece%offset)
            rate = sign*(piece%stiffness*dynamics%rate(by) + piece%damping*dynamics%second_rate(system, by, self%a))
            noise = abs(piece%stiffness)*self%on_s(by) + abs(piece%damping)*self%on_rate(by) + rounding*abs(piece%offset)
         end associate
      end associate
   end subroutine look_at_press

end module razy_hybrid_guards
