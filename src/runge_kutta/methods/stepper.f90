!! Steps of a Runge-Kutta method along a smooth piece of motion, one by one (razy_runge_kutta_methods_attempts) or, in modes
!! with maps of steps, several at once: `begin_strip`, `stride`, and then `go_on`, `refuse`, or `load` and `accept`.
module razy_runge_kutta_methods_stepper
   use razy_core_kinds, only: wp
   use razy_runge_kutta_methods_attempts, only: attempts_t, moved_on, same_start
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_step_ladder, only: below_on_ladder
   implicit none(type, external)
   private

   public :: stepper_t

   type, extends(attempts_t) :: stepper_t
   contains
      procedure :: begin_strip
      procedure :: stride
      procedure :: go_on
      procedure :: refuse
      procedure :: load
      procedure :: go_to_end
      procedure :: accept
   end type stepper_t

contains

   !> Begin a strip of the proposed steps at (tau, z), where a step of the same mode has just ended: `done`, if there is a map of
   !> them.
   subroutine begin_strip(self, field, tau, z, done)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: tau
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: done

      done = self%mapping .and. self%known == moved_on .and. .not. abs(tau - field%base) > 0.0_wp
      if (done) call self%maps%begin(field, self%h_next, z, self%dz_end, self%strip, done)
   end subroutine begin_strip

   !> Make steps of the strip up to number `last`, as long as they would be accepted. Nothing has happened until `load` or `go_on`
   !> is called; `attempt` may be called instead.
   pure subroutine stride(self, field, last)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: last

      call self%maps%walk(field, last, self%strip)
      call self%strip%judge(last, self%tableau%errors, self%absolute, self%relative)
   end subroutine stride

   !> Accept the first `steps` steps of the strip, which began at `tau`, and propose the next by the largest of their errors; their
   !> right-hand sides count as if they had been formed.
   pure subroutine go_on(self, field, tau, steps)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      integer, intent(in) :: steps

      call self%load(field, tau, steps)
      self%error = maxval(self%strip%error(:steps))
      call self%propose(.true., .true., .false.)
      self%accepted_steps = self%accepted_steps + (steps - 1)
      field%evaluations = field%evaluations + steps*self%stages
   end subroutine go_on

   !> Refuse the step after those of the strip, and propose a shorter one; `done`: its error is a number that tells how much
   !> shorter.
   pure subroutine refuse(self, field, done)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      logical, intent(out) :: done

      real(wp) :: factor

      associate (error => self%strip%error(self%strip%count + 1))
         done = error <= huge(1.0_wp)
         if (.not. done) return
         call self%control%refused(error, self%control%safety, factor)
      end associate
      self%rejected_steps = self%rejected_steps + 1
      field%evaluations = field%evaluations + self%stages
      self%h_next = below_on_ladder(factor*self%strip%h)
   end subroutine refuse

   !> Go back to step k of the strip, which began at `tau`, as if it had just been attempted; `accept` may follow.
   pure subroutine load(self, field, tau, k)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      integer, intent(in) :: k

      integer :: i, n, t

      n = self%n
      associate (strip => self%strip, tones => size(field%omega))
         self%h = strip%h
         self%error = strip%error(k)
         self%mapped = .true.
         self%known = same_start
         do i = 1, n
            self%z_end(i) = strip%z(i, k)
            self%dz_start(i) = strip%u(i, k - 1)
            self%dz_end(i) = strip%u(i, k)
         end do
         call self%maps%recall(strip, k)
         field%base = tau + strip%at(k - 1)
         field%looked = tau + strip%at(k)
         field%carried = strip%carried + k - 1
         do t = 1, tones
            field%base_cosine(t) = strip%u(n + t, k - 1)
            field%base_sine(t) = strip%u(n + tones + t, k - 1)
            field%c(t) = strip%u(n + t, k)
            field%d(t) = strip%u(n + tones + t, k)
         end do
      end associate
   end subroutine load

   !> The next attempt starts at the end of the step that has been loaded, which has been accepted.
   pure subroutine go_to_end(self)
      class(stepper_t), intent(inout) :: self

      self%known = moved_on
   end subroutine go_to_end

   !> Accept the step that has been loaded.
   pure subroutine accept(self, field)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field

      field%evaluations = field%evaluations + self%stages
      call self%propose(.true., .true., .false.)
   end subroutine accept

end module razy_runge_kutta_methods_stepper
