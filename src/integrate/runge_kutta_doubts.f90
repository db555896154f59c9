!! Events in doubt in a step of a Runge–Kutta method (razy_integrate_doubts), for each of its treatments.
module razy_integrate_runge_kutta_doubts
   use razy_core_kinds, only: wp
   use razy_integrate_defects, only: defects_t
   use razy_integrate_doubts, only: across, barely_passed, between_known_ends, cubic_turn, doubts_t, turned_near
   use razy_integrate_field, only: field_t
   use razy_integrate_force_sensitivity, only: force_sensitivity
   use razy_integrate_mode, only: treat_by_smoothing
   use razy_integrate_runge_kutta_known, only: known_form, known_gap, known_rate
   use razy_integrate_runge_kutta_locate, only: locator_t
   use razy_integrate_stepper, only: stepper_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: step_doubts_t

   !> Doubts; s and s' of all contacts at the start of the step; whether smoothed friction creeps there (contacts); the defect of
   !> smoothed forces as |s''| at the end of the step and at its start (contacts).
   type, extends(doubts_t) :: step_doubts_t
      real(wp), allocatable :: s(:), rate(:), defect(:), defect_before(:)
      logical, allocatable :: creeps(:)
      type(defects_t) :: defects
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
      call self%defects%begin(size(self%s))
      if (field%treatment /= treat_by_smoothing) return
      self%defect = defect_of(field)
      self%defect_before = self%defect
   end subroutine begin

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

   !> |s''| (contacts) by which smoothed forces differ from those of the laws at the s and s' of the field's workspace; friction has
   !> its own criterion.
   pure function defect_of(field) result(defect)
      type(field_t), intent(in) :: field
      real(wp) :: defect(size(field%branch))

      real(wp) :: a(field%m), smoothed, unused_1, unused_2
      integer :: j

      a = 0.0_wp
      do j = 1, size(field%branch)
         associate (law => field%machine%contact(j)%law)
            if (law%of_normal) cycle
            call law%smoothed(field%s(j), field%rate(j), 0.0_wp, field%sharpness, smoothed, unused_1, unused_2)
            a = a + field%w(:, j)*(smoothed - law%force(law%initial_branch(field%s(j), field%rate(j)), field%s(j), field%rate(j), &
                                                        0.0_wp))
         end associate
      end do
      defect = abs(matmul(a, field%w))
   end function defect_of

   !> With `switching` and `smoothing`, where the field's workspace has s and s' at the end of a step from z, `before` and `after`
   !> are the branches there: a bound that was passed and passed back, or nearly so; an open gap between two sides that was jumped
   !> over; a bound that is barely passed, or, because forces are smoothed, as late or early as the next passage; smoothed friction
   !> that comes to creep, so that it is not known whether it sticks: |s'| <= 1/sharpness, or is less than what is known of it.
   subroutine of_ends(self, field, method, stepper, before, after, z, time)
      class(step_doubts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: before(:), after(:)
      real(wp), intent(in) :: z(:), time

      logical :: doubtful, slow, smooth
      integer :: j

      smooth = field%treatment == treat_by_smoothing
      if (smooth) call gather_defects(self, field, stepper%h)
      do j = 1, size(before)
         associate (law => field%machine%contact(j)%law)
            doubtful = .false.
            if (law%of_normal) then
               if (smooth) then
                  slow = abs(field%rate(j)) <= max(1/field%sharpness, known_rate(field, method, stepper, j, z))
                  doubtful = slow .and. .not. self%creeps(j)
                  self%creeps(j) = slow
               end if
            else if (before(j) /= after(j)) then
               call pass(self, field, method, stepper, j, z, doubtful)
               doubtful = doubtful .or. across(before(j), after(j))
            else if (self%rate(j)*field%rate(j) < 0.0_wp) then
               doubtful = passed(self, field, method, stepper, j, before(j), z)
            end if
            if (doubtful) call self%add(time)
         end associate
      end do
      self%s = field%s
      self%rate = field%rate
   end subroutine of_ends

   !> Add up the defects of smoothed forces over a step h.
   subroutine gather_defects(self, field, h)
      type(step_doubts_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: h

      real(wp) :: defect(size(self%defect))

      defect = defect_of(field)
      call self%defects%gather(h, 0.5_wp*(self%defect + defect))
      self%defect_before = self%defect
      self%defect = defect
   end subroutine gather_defects

   !> A bound of contact j was passed in the step: whether s would turn nearer to it than it is known, or the passage is shifted by
   !> an interval.
   subroutine pass(self, field, method, stepper, j, z, doubtful)
      class(step_doubts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      logical, intent(out) :: doubtful

      real(wp) :: direction, second, speed
      logical :: shifted

      ! Before the bound, where the force of the contact does not act yet.
      direction = sign(1.0_wp, field%s(j) - self%s(j))
      speed = direction*self%rate(j)
      second = field%second_rate(j, stepper%dz_start(field%m + 1:))
      if (field%treatment == treat_by_smoothing) then
         second = second - direction*self%defect_before(j)
         speed = speed - self%defects%drift(j)
      end if
      doubtful = barely_passed(direction, speed, second, precision_of(self, field, method, stepper, j, z))
      if (field%treatment /= treat_by_smoothing) return
      call self%defects%pass(j, field%rate(j), .false., shifted)
      doubtful = doubtful .or. shifted
   end subroutine pass

   !> How well s of contact j is known where only the ends of a step are looked at.
   function precision_of(self, field, method, stepper, j, z) result(precision)
      class(step_doubts_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: precision

      precision = max(known_gap(field, method, stepper, j, z), &
                      between_known_ends(stepper%h, [self%rate(j), field%rate(j)], &
                                         [dot_product(field%w(:, j), stepper%dz_start(field%m + 1:)), &
                                          dot_product(field%w(:, j), stepper%dz_end(field%m + 1:))]))
      if (field%treatment == treat_by_smoothing) precision = precision + 1/field%sharpness + self%defects%way(j)
   end function precision_of

   !> Whether s of contact j, which turned in the step, came to a bound of `branch` as near as it is known, or beyond.
   function passed(self, field, method, stepper, j, branch, z)
      class(step_doubts_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j, branch
      real(wp), intent(in) :: z(:)
      logical :: passed

      passed = turned_near(field%machine%contact(j)%law, branch, stepper%h, [self%s(j), field%s(j)], &
                           [self%rate(j), field%rate(j)], precision_of(self, field, method, stepper, j, z))
   end function passed

end module razy_integrate_runge_kutta_doubts
