!! Events in doubt in a step of a Runge–Kutta method that looks at the contacts at the ends of steps only: `switching`, `smoothing`
!! (razy_hybrid_cubic_doubts, razy_hybrid_defects).
module razy_runge_kutta_end_doubts
   use razy_contact_contact_law, only: branch_sticking
   use razy_core_kinds, only: wp
   use razy_hybrid_defects, only: defects_t
   use razy_hybrid_cubic_doubts, only: across, barely_passed, cubic_defect, doubts_t, samples_t, turned_near
   use razy_hybrid_field, only: field_t
   use razy_hybrid_force_sensitivity, only: force_sensitivity
   use razy_hybrid_mode, only: constrained, treat_by_smoothing
   use razy_runge_kutta_known, only: known_t, next_order
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: end_doubts_t

   !> Doubts; s and s' of all contacts at the start of the step; whether smoothed friction creeps there (contacts); the defect of
   !> smoothed forces as |s''| at the end of the step and at its start (contacts).
   type, extends(doubts_t) :: end_doubts_t
      real(wp), allocatable :: s(:), rate(:), defect(:), defect_before(:)
      logical, allocatable :: creeps(:)
      type(defects_t) :: defects
      !> Room that friction which sticks has up to its bound at the ends of steps, N (contacts).
      type(samples_t) :: room
      type(known_t) :: known
   contains
      procedure :: begin
      procedure :: of_ends
   end type end_doubts_t

contains

   !> None yet; the field's workspace has s and s' at the start.
   pure subroutine begin(self, field)
      class(end_doubts_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      self%count = 0
      self%first = 0.0_wp
      self%s = field%s
      self%rate = field%rate
      if (allocated(self%creeps)) deallocate (self%creeps)
      allocate (self%creeps(size(self%s)), source=.false.)
      call self%defects%begin(size(self%s))
      call self%room%begin(size(self%s))
      call self%known%begin(field%m)
      if (field%treatment /= treat_by_smoothing) return
      self%defect = defect_of(field)
      self%defect_before = self%defect
   end subroutine begin

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
   !> over, as is the band of sticking; a bound that is barely passed, or as late or early as the next passage; smoothed friction
   !> that comes to creep, so that it is not known whether it sticks: |s'| <= 1/sharpness, or is less than what is known of it.
   subroutine of_ends(self, field, method, stepper, before, after, z, time)
      class(end_doubts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: before(:), after(:)
      real(wp), intent(in) :: z(:), time

      logical :: doubtful, slow, smooth
      integer :: j

      smooth = field%treatment == treat_by_smoothing
      call self%known%step(method, stepper, z, .false.)
      if (smooth) call gather_defects(self, field, stepper%h)
      do j = 1, size(before)
         associate (law => field%machine%contact(j)%law)
            doubtful = .false.
            if (law%of_normal) then
               if (smooth) then
                  slow = abs(field%rate(j)) <= max(1/field%sharpness, self%known%rate(field%w(:, j), z(field%m + 1:)))
                  doubtful = slow .and. .not. self%creeps(j)
                  self%creeps(j) = slow
               else if (before(j) == after(j) .and. field%does(j) == constrained) then
                  call hold(self, field, stepper, j, z, time, doubtful)
               else
                  call self%room%forget(j)
                  doubtful = before(j) /= after(j) .and. all([before(j), after(j)] /= branch_sticking)
               end if
            else if (before(j) /= after(j)) then
               call pass(self, field, stepper, j, z, doubtful)
               doubtful = doubtful .or. across(before(j), after(j))
            else if (self%rate(j)*field%rate(j) < 0.0_wp) then
               doubtful = passed(self, field, stepper, j, before(j), z)
            end if
            if (doubtful) call self%add(time)
         end associate
      end do
      self%s = field%s
      self%rate = field%rate
   end subroutine of_ends

   !> Friction of contact j, which sticks at both ends of a step that starts at `time`, s, and whose force at its end is in the
   !> field's workspace: whether the force has come as near to its bound as it is known.
   subroutine hold(self, field, stepper, j, z, time, doubtful)
      class(end_doubts_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:), time
      logical, intent(out) :: doubtful

      real(wp) :: free, lowest, room

      associate (guard => field%machine%contact(j)%law%force_guard(branch_sticking), force => field%force(j))
         free = min(guard%upper*field%normal(j) - force, force - guard%lower*field%normal(j))
         call self%room%next(j, time + stepper%h, free, doubtful, lowest, room)
         if (.not. doubtful) return
         doubtful = lowest <= room + self%known%form(force_sensitivity(field, j, sign(guard%upper, force)), z)
      end associate
   end subroutine hold

   !> Add up the defects of smoothed forces over a step h.
   subroutine gather_defects(self, field, h)
      type(end_doubts_t), intent(inout) :: self
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
   subroutine pass(self, field, stepper, j, z, doubtful)
      class(end_doubts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
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
      doubtful = barely_passed(direction, speed, second, precision_of(self, field, stepper, j, z))
      self%defects%drift(j) = self%defects%drift(j) + self%known%rate(field%w(:, j), z(field%m + 1:))
      call self%defects%pass(j, field%rate(j), .false., shifted)
      doubtful = doubtful .or. shifted
   end subroutine pass

   !> How well s of contact j is known where only the ends of a step are looked at.
   function precision_of(self, field, stepper, j, z) result(precision)
      class(end_doubts_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: precision

      associate (m => field%m, w => field%w(:, j))
         precision = max(self%known%gap(w, z(:m)), &
                         next_order*abs(cubic_defect(stepper%h, [self%rate(j), field%rate(j)], &
                                                     [dot_product(w, stepper%dz_start(m + 1:)), &
                                                      dot_product(w, stepper%dz_end(m + 1:))])))
      end associate
      if (field%treatment == treat_by_smoothing) precision = precision + 1/field%sharpness + self%defects%way(j)
   end function precision_of

   !> Whether s of contact j, which turned in the step, came to a bound of `branch` as near as it is known, or beyond.
   function passed(self, field, stepper, j, branch, z)
      class(end_doubts_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j, branch
      real(wp), intent(in) :: z(:)
      logical :: passed

      passed = turned_near(field%machine%contact(j)%law, branch, stepper%h, [self%s(j), field%s(j)], &
                           [self%rate(j), field%rate(j)], precision_of(self, field, stepper, j, z))
   end function passed

end module razy_runge_kutta_end_doubts
