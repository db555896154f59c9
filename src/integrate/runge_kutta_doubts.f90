!! Events in doubt in a step of a Runge–Kutta method (razy_integrate_doubts), for each of its treatments.
module razy_integrate_runge_kutta_doubts
   use razy_core_kinds, only: wp
   use razy_integrate_doubts, only: across, between_known_ends, cubic_turn, doubts_t, turned_near, within_tolerance
   use razy_integrate_field, only: field_t
   use razy_integrate_force_sensitivity, only: force_sensitivity
   use razy_integrate_mode, only: treat_by_smoothing
   use razy_integrate_runge_kutta_guards, only: guard_entry_t
   use razy_integrate_runge_kutta_locate, only: locator_t
   use razy_integrate_stepper, only: stepper_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: step_doubts_t

   !> Doubts; s and s' of all contacts at the start of the step; whether smoothed friction creeps there (contacts).
   type, extends(doubts_t) :: step_doubts_t
      real(wp), allocatable :: s(:), rate(:)
      logical, allocatable :: creeps(:)
   contains
      procedure :: begin
      procedure :: of_turns
      procedure :: of_ends
   end type step_doubts_t

contains

   !> None yet; the field's workspace has s and s' at the start.
   pure subroutine begin(self, field)
      class(step_doubts_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      self%count = 0
      self%first = 0.0_wp
      self%s = field%s
      self%rate = field%rate
      if (allocated(self%creeps)) deallocate (self%creeps)
      allocate (self%creeps(size(self%s)), source=.false.)
   end subroutine begin

   !> With `event`: guards that the locator has seen turn close to their bound, and forces that hold a constraint as near to it at
   !> the `opening` of a mode, when it was decided whether they can. `time`: of the start of the step, s.
   subroutine of_turns(self, locator, field, method, stepper, z, time, opening)
      class(step_doubts_t), intent(inout) :: self
      type(locator_t), intent(inout) :: locator
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: z(:), time
      logical, intent(in) :: opening

      real(wp) :: nearest
      integer :: i
      logical :: turns

      do i = 1, locator%guards%count
         ! What rests on its bound to rounding does not turn.
         if (max(abs(locator%g0(i)), abs(locator%g1(i))) <= locator%guards%noise(i)) cycle
         nearest = locator%nearest(i)
         if (.not. nearest < huge(1.0_wp)) then
            if (opening .and. locator%guards%entry(i)%function == 0 .and. locator%rate0(i) > 0.0_wp) then
               nearest = locator%g0(i)
            else
               ! Nothing was looked for inside, so the step is short beside the distance, and a cubic will do.
               if (.not. (locator%rate0(i) < 0.0_wp .and. locator%rate1(i) > 0.0_wp)) cycle
               call cubic_turn(stepper%h, [locator%g0(i), locator%g1(i)], [locator%rate0(i), locator%rate1(i)], turns, nearest)
            end if
         end if
         if (abs(nearest) <= known(locator, i, field, method, stepper, z)) call self%add(time)
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

   !> How well Σ row_i z_i (2m) is known in a step that starts at z.
   pure function known_form(row, method, stepper, z) result(known)
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: row(:), z(:)
      real(wp) :: known

      real(wp) :: of_y
      integer :: i, m

      if (stepper%adaptive) then
         known = within_tolerance(row, z, method%relative_tolerance, method%absolute_tolerance)
         return
      end if
      m = size(z)/2
      known = 0.0_wp
      do i = 1, m
         of_y = between_known_ends(stepper%h, [z(m + i), stepper%z_end(m + i)], [stepper%dz_start(m + i), stepper%dz_end(m + i)])
         known = known + (abs(row(i)) + abs(row(m + i))*4/stepper%h)*of_y
      end do
   end function known_form

   !> How well s of contact j is known in a step that starts at z.
   function known_gap(field, method, stepper, j, z) result(known)
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      associate (m => field%m, w => field%w(:, j))
         if (stepper%adaptive) then
            known = within_tolerance(w, z(:m), method%relative_tolerance, method%absolute_tolerance)
         else
            known = between_known_ends(stepper%h, [dot_product(w, z(m + 1:)), dot_product(w, stepper%z_end(m + 1:))], &
                                       [dot_product(w, stepper%dz_start(m + 1:)), dot_product(w, stepper%dz_end(m + 1:))])
         end if
      end associate
   end function known_gap

   !> The same of s': without a tolerance a change of s over a quarter of the step.
   function known_rate(field, method, stepper, j, z) result(known)
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      if (stepper%adaptive) then
         known = within_tolerance(field%w(:, j), z(field%m + 1:), method%relative_tolerance, method%absolute_tolerance)
      else
         known = 4*known_gap(field, method, stepper, j, z)/stepper%h
      end if
   end function known_rate

   !> With `switching` and `smoothing`, where the field's workspace has s and s' at the end of a step from z, `before` and `after`
   !> are the branches there: a bound that was passed and passed back, or nearly so; an open gap between two sides that was jumped
   !> over; smoothed friction that comes to creep, so that it is not known whether it sticks: |s'| <= 1/sharpness, or is less than
   !> what is known of it. A smoothed edge is known to 1/sharpness.
   subroutine of_ends(self, field, method, stepper, before, after, z, time)
      class(step_doubts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: before(:), after(:)
      real(wp), intent(in) :: z(:), time

      logical :: creeps
      integer :: j

      do j = 1, size(before)
         associate (law => field%machine%contact(j)%law)
            if (law%of_normal) then
               if (field%treatment == treat_by_smoothing) then
                  creeps = abs(field%rate(j)) <= max(1/field%sharpness, known_rate(field, method, stepper, j, z))
                  if (creeps .and. .not. self%creeps(j)) call self%add(time)
                  self%creeps(j) = creeps
               end if
            else if (across(before(j), after(j))) then
               call self%add(time)
            else if (before(j) == after(j) .and. self%rate(j)*field%rate(j) < 0.0_wp) then
               if (passed(self, field, method, stepper, j, before(j), z)) call self%add(time)
            end if
         end associate
      end do
      self%s = field%s
      self%rate = field%rate
   end subroutine of_ends

   !> Whether s of contact j, which turned in the step, came to a bound of `branch` as near as it is known, or beyond.
   function passed(self, field, method, stepper, j, branch, z)
      class(step_doubts_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j, branch
      real(wp), intent(in) :: z(:)
      logical :: passed

      real(wp) :: precision

      precision = max(known_gap(field, method, stepper, j, z), &
                      between_known_ends(stepper%h, [self%rate(j), field%rate(j)], &
                                         [dot_product(field%w(:, j), stepper%dz_start(field%m + 1:)), &
                                          dot_product(field%w(:, j), stepper%dz_end(field%m + 1:))]))
      if (field%treatment == treat_by_smoothing) precision = precision + 1/field%sharpness
      passed = turned_near(field%machine%contact(j)%law, branch, stepper%h, [self%s(j), field%s(j)], &
                           [self%rate(j), field%rate(j)], precision)
   end function passed

end module razy_integrate_runge_kutta_doubts
