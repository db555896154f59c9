!! Events in doubt in a step of a Runge–Kutta method (razy_hybrid_cubic_doubts): with `event`, and with the other treatments
!! (razy_runge_kutta_end_doubts).
module razy_runge_kutta_doubts
   use razy_contact_contact_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_cubic_doubts, only: barely_passed, cubic_turn
   use razy_hybrid_field, only: field_t
   use razy_hybrid_force_sensitivity, only: force_sensitivity
   use razy_runge_kutta_end_doubts, only: end_doubts_t
   use razy_hybrid_guards, only: guard_entry_t
   use razy_runge_kutta_locate, only: locator_t
   use razy_runge_kutta_methods_step_strip, only: step_strip_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: step_doubts_t

   type, extends(end_doubts_t) :: step_doubts_t
   contains
      procedure :: of_turns
      procedure :: of_strip
   end type step_doubts_t

contains

   !> With `event`: guards that the locator has seen turn close to their bound; those that are left, if an event was `found`, but
   !> barely; and forces that hold a constraint as near to their bound at the `opening` of a mode, when it was decided whether they
   !> can. `time`: of the start of the step, s.
   subroutine of_turns(self, locator, field, method, stepper, z, time, opening, found)
      class(step_doubts_t), intent(inout) :: self
      type(locator_t), intent(inout) :: locator
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: z(:), time
      logical, intent(in) :: opening, found

      real(wp) :: nearest
      integer :: i
      logical :: doubtful, shifted, turns

      call self%known%step(method, stepper, z, opening)
      do i = 1, locator%guards%count
         ! What rests on its bound to rounding does not turn.
         if (max(abs(locator%g0(i)), abs(locator%g1(i))) <= locator%guards%noise(i)) cycle
         if (gives_over(field, locator%guards%entry(i))) cycle
         nearest = locator%nearest(i)
         if (.not. nearest < huge(1.0_wp)) then
            if (opening .and. locator%guards%entry(i)%function == 0 .and. locator%rate0(i) > 0.0_wp) then
               nearest = locator%g0(i)
            else if (locator%rate0(i) < 0.0_wp .and. locator%rate1(i) > 0.0_wp) then
               ! Nothing was looked for inside, so the step is short beside the distance, and a cubic will do.
               call cubic_turn(stepper%h, [locator%g0(i), locator%g1(i)], [locator%rate0(i), locator%rate1(i)], turns, nearest)
            end if
         end if
         doubtful = .false.
         if (nearest < huge(1.0_wp) .and. .not. begins(locator, i, opening, nearest)) then
            doubtful = abs(nearest) <= known_guard(self, locator, i, field, z)
         end if
         if (found) then
            if (locator%hit(i)) then
               call leave(self, locator, i, field, stepper, z, shifted)
               doubtful = doubtful .or. shifted
            end if
         end if
         if (doubtful) call self%add(time)
      end do
   end subroutine of_turns

   !> Whether a guard is that of a rigid side without clearance which gives its force over to the other one: the motion is the same.
   pure function gives_over(field, entry)
      type(field_t), intent(in) :: field
      type(guard_entry_t), intent(in) :: entry
      logical :: gives_over

      gives_over = entry%function == 0 .and. entry%next /= branch_open .and. field%machine%contact(entry%contact)%law%impacts
   end function gives_over

   !> Whether what looks like a turn of guard i `nearest` to its bound is where a mode begins: a function of s or s' that starts on
   !> its bound with a rate of nothing but rounding, as a body that breaks loose. Which way it goes has been settled.
   pure function begins(locator, i, opening, nearest)
      type(locator_t), intent(in) :: locator
      integer, intent(in) :: i
      logical, intent(in) :: opening
      real(wp), intent(in) :: nearest
      logical :: begins

      associate (guards => locator%guards)
         begins = opening .and. guards%entry(i)%function /= 0 &
                  .and. max(abs(locator%g0(i)), abs(nearest)) <= guards%noise(i)
      end associate
   end function begins

   !> The same in the first `steps` steps of a strip that the locator has found clear, which began at `time`, s.
   subroutine of_strip(self, locator, field, strip, steps, time)
      class(step_doubts_t), intent(inout) :: self
      type(locator_t), intent(inout) :: locator
      type(field_t), intent(inout) :: field
      type(step_strip_t), intent(in) :: strip
      integer, intent(in) :: steps
      real(wp), intent(in) :: time

      real(wp) :: nearest
      integer :: i, k
      logical :: turns

      do k = 1, steps
         call self%known%more(1)
         if (locator%turns == 0) cycle
         do i = 1, locator%guards%count
            if (.not. locator%turned(k, i)) cycle
            call cubic_turn(strip%h, locator%g(k - 1:k, i), locator%g_rate(k - 1:k, i), turns, nearest)
            if (abs(nearest) <= known_guard(self, locator, i, field, strip%z(:, k - 1))) call self%add(time + strip%at(k - 1))
         end do
      end do
   end subroutine of_strip

   !> Guard i is left: barely, or, by a gap whose speed is known no better, as late or early as the next passage.
   subroutine leave(self, locator, i, field, stepper, z, doubtful)
      class(step_doubts_t), intent(inout) :: self
      type(locator_t), intent(inout) :: locator
      integer, intent(in) :: i
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: z(:)
      logical, intent(out) :: doubtful

      real(wp) :: bend
      logical :: shifted

      doubtful = .false.
      ! A motion that begins on the bound.
      if (locator%g0(i) <= locator%guards%noise(i)) return
      bend = (locator%rate1(i) - locator%rate0(i))/stepper%h
      if (bend > 0.0_wp) doubtful = barely_passed(-1.0_wp, -locator%rc(i), bend, known_guard(self, locator, i, field, z))
      associate (entry => locator%guards%entry(i))
         if (entry%function == 0 .or. abs(entry%beta) > 0.0_wp) return
         self%defects%drift(entry%contact) = self%known%rate(field%w(:, entry%contact), z(field%m + 1:))
         call self%defects%pass(entry%contact, locator%rc(i)/entry%alpha, .false., shifted)
         doubtful = doubtful .or. shifted
      end associate
   end subroutine leave

   !> How well guard i is known in a step from z.
   function known_guard(self, locator, i, field, z) result(known)
      class(step_doubts_t), intent(in) :: self
      type(locator_t), intent(inout) :: locator
      integer, intent(in) :: i
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      associate (entry => locator%guards%entry(i), m => field%m)
         if (entry%function == 0) then
            call field%accelerate(locator%tau, z, locator%guards%a)
            known = self%known%form(force_sensitivity(field, entry%contact, entry%bound), z) + locator%guards%noise(i)
         else
            known = abs(entry%alpha)*self%known%gap(field%w(:, entry%contact), z(:m)) &
                    + abs(entry%beta)*self%known%rate(field%w(:, entry%contact), z(m + 1:))
         end if
      end associate
   end function known_guard

end module razy_runge_kutta_doubts
