!! Events in doubt in a step of a Runge–Kutta method (razy_integrate_doubts): with `event`, and with the other treatments
!! (razy_integrate_runge_kutta_end_doubts).
module razy_integrate_runge_kutta_doubts
   use razy_core_kinds, only: wp
   use razy_integrate_doubts, only: barely_passed, cubic_turn
   use razy_integrate_field, only: field_t
   use razy_integrate_force_sensitivity, only: force_sensitivity
   use razy_integrate_runge_kutta_end_doubts, only: end_doubts_t
   use razy_integrate_runge_kutta_known, only: known_form, known_gap, known_rate
   use razy_integrate_runge_kutta_locate, only: locator_t
   use razy_integrate_stepper, only: stepper_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: step_doubts_t

   type, extends(end_doubts_t) :: step_doubts_t
   contains
      procedure :: of_turns
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

      real(wp) :: bend, nearest
      integer :: i
      logical :: doubtful, turns

      do i = 1, locator%guards%count
         ! What rests on its bound to rounding does not turn.
         if (max(abs(locator%g0(i)), abs(locator%g1(i))) <= locator%guards%noise(i)) cycle
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
         if (nearest < huge(1.0_wp)) doubtful = abs(nearest) <= known(locator, i, field, method, stepper, z)
         if (found .and. .not. doubtful) then
            bend = (locator%rate1(i) - locator%rate0(i))/stepper%h
            if (locator%hit(i) .and. bend > 0.0_wp) then
               doubtful = barely_passed(-1.0_wp, -locator%rc(i), bend, known(locator, i, field, method, stepper, z))
            end if
         end if
         if (doubtful) call self%add(time)
      end do
   end subroutine of_turns

   !> How well guard i is known in a step from z.
   function known(locator, i, field, method, stepper, z)
      type(locator_t), intent(inout) :: locator
      integer, intent(in) :: i
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      associate (entry => locator%guards%entry(i))
         if (entry%function == 0) then
            call field%accelerate(locator%tau, z, locator%guards%a)
            known = known_form(force_sensitivity(field, entry%contact, entry%bound), method, stepper, z) + locator%guards%noise(i)
            return
         end if
         known = abs(entry%alpha)*known_gap(field, method, stepper, entry%contact, z)
         if (abs(entry%beta) > 0.0_wp) known = known + abs(entry%beta)*known_rate(field, method, stepper, entry%contact, z)
      end associate
   end function known

end module razy_integrate_runge_kutta_doubts
