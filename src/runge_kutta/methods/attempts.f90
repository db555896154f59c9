!! Steps of a Runge-Kutta method along a smooth piece of motion: trial step, error, proposal of the next, dense output.
!!
!! `attempt` changes nothing but its own; the caller takes `z_end` if he likes. After an accepted step the next attempt has to
!! start at its end, after one that was not accepted at the same point, unless `restart` is called in between (an event, a shorter
!! piece of the step): slopes known from the step before and the controller's memory are forgotten there. `attempt` evaluates the
!! slope at the end of an accepted step, so that an explicit method of s stages needs s right-hand sides a step.
!!
!! The error of a step is the largest |error_i|/(absolute + relative max(|z_i| before, |z_i| after)); up to 1 it is accepted.
!! Nothing is allocated but by `prepare`, and by maps of steps (razy_runge_kutta_methods_step_maps).
module razy_runge_kutta_methods_attempts
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: i8, wp
   use razy_runge_kutta_methods_explicit_steps, only: explicit_steps_t
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_radau5, only: radau5_t
   use razy_runge_kutta_methods_starting_step, only: starting_step
   use razy_runge_kutta_methods_step_control, only: factor_of_failure, step_control_t
   use razy_runge_kutta_methods_step_ladder, only: below_on_ladder, log_half_rung, near_on_ladder
   use razy_runge_kutta_methods_tableaux, only: new_tableau
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: attempts_t, moved_on, same_start

   !> A method at work on z of n components.
   type, extends(explicit_steps_t) :: attempts_t
      character(16) :: name = ""
      !> Orders of the result and of the dense output.
      integer :: order = 0, dense_order = 0
      !> Step of the method and step proposed for the next attempt, s.
      real(wp) :: step = 0.0_wp, h_next = 0.0_wp
      !> Attempts that were accepted, and those that were not.
      integer(i8) :: accepted_steps = 0, rejected_steps = 0
      type(step_control_t) :: control
      type(radau5_t) :: radau
      !> Coefficients r_4… of the dense output.
      integer :: polynomials = 0
      !> What is known of the slope at the start of the next attempt.
      integer :: known = 0
   contains
      procedure :: prepare
      procedure :: enter
      procedure :: restart
      procedure :: first_step
      procedure :: begin
      procedure :: attempt
      procedure :: leap
      procedure :: propose
      procedure :: prepare_dense
   end type attempts_t

   !> The slope at the start: not known, known (as dz_start), the one at the end of the last step (dz_end).
   integer, parameter :: unknown = 0, same_start = 1, moved_on = 2
   !> Growth of a step for which new factors do not pay.
   real(wp), parameter :: most_kept = 1.2_wp

contains

   !> Make ready for `method`, one of razy_runge_kutta_methods_tableaux or "radau5", on z of n components.
   subroutine prepare(self, method, n)
      class(attempts_t), intent(inout) :: self
      type(method_t), intent(in) :: method
      integer, intent(in) :: n

      self%name = method%integrator
      self%implicit = self%name == "radau5"
      call new_tableau(self%tableau, trim(method%integrator))
      if (self%implicit) then
         self%order = 5
         self%dense_order = 4
         self%stages = 3
         self%polynomials = 1
         self%adaptive = .true.
         self%control = step_control_t(order=4, least=0.2_wp, most=8.0_wp, predictive=.true.)
         call self%radau%prepare(n, method%relative_tolerance, method%absolute_tolerance)
      else
         self%order = self%tableau%order
         self%dense_order = self%tableau%dense_order
         self%stages = self%tableau%stages
         self%polynomials = self%tableau%polynomials
         self%adaptive = self%tableau%estimate > 0
         self%control = step_control_t(order=max(self%tableau%estimate, 1), beta=self%tableau%beta, least=self%tableau%least, &
                                       most=self%tableau%most)
      end if
      self%relative = method%relative_tolerance
      self%absolute = method%absolute_tolerance
      self%step = method%step
      self%accepted_steps = 0
      self%rejected_steps = 0
      self%h = 0.0_wp
      self%h_next = self%step
      call self%make_room(n)
      call self%output%prepare(n, 3 + self%polynomials)
      call self%restart()
   end subroutine prepare

   !> The field has entered a mode: forget what came before.
   subroutine enter(self, field)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      call self%restart()
      if (self%mapping) call self%maps%enter(field)
   end subroutine enter

   !> Forget the slope at the start of the next attempt and the controller's memory.
   pure subroutine restart(self)
      class(attempts_t), intent(inout) :: self

      self%known = unknown
      call self%control%forget()
      if (self%implicit) call self%radau%restart()
   end subroutine restart

   !> A step to start with, s, at most `longest`: that of the method if it gives one, else by what the field is like here.
   subroutine first_step(self, field, tau, z, longest, h)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), longest
      real(wp), intent(out) :: h

      h = min(self%step, longest)
      if (h > 0.0_wp) return
      call know_start(self, field, tau, z)
      call starting_step(field, tau, z, self%dz_start, self%order, self%absolute, self%relative, longest, h)
   end subroutine first_step

   !> Evaluate the slope at (tau, z), unless `first_step` has done so there: it is as if a step had ended there.
   subroutine begin(self, field, tau, z)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      call know_start(self, field, tau, z)
      self%dz_end = self%dz_start
      self%known = moved_on
   end subroutine begin

   !> Try a step h from (tau, z). `failed`: it led to no number, or its equations were not solved; then, and when it is not
   !> accepted, `h_next` is shorter.
   subroutine attempt(self, field, tau, z, h, accepted, failed)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: accepted, failed

      call know_start(self, field, tau, z)
      self%h = h
      self%error = 0.0_wp
      self%mapped = .false.
      failed = .not. all(ieee_is_finite(self%dz_start))
      if (.not. failed) then
         if (self%implicit) then
            call implicit_step(self, field, tau, z, h, failed)
         else
            call self%explicit_step(field, tau, z, h, failed)
         end if
      end if
      accepted = .false.
      if (.not. failed) accepted = self%error <= 1.0_wp
      if (accepted .and. .not. self%mapped) then
         call self%end_slope(field, tau + h)
         failed = .not. all(ieee_is_finite(self%dz_end))
         accepted = .not. failed
      end if
      if (self%implicit) then
         call propose_implicit(self, accepted, failed)
      else
         call propose(self, field%folded .and. self%mapping, accepted, failed)
      end if
   end subroutine attempt

   !> Step h from (tau, z), which is part of an accepted one that began there; the next step has to start anew. `taken`: it led to
   !> numbers.
   subroutine leap(self, field, tau, z, h, taken)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: taken

      self%known = same_start
      call know_start(self, field, tau, z)
      self%h = h
      self%mapped = .false.
      call self%form_stages(field, tau, h)
      call self%end_slope(field, tau + h)
      self%accepted_steps = self%accepted_steps + 1
      taken = all(ieee_is_finite(self%z_end)) .and. all(ieee_is_finite(self%dz_end))
   end subroutine leap

   !> The same by Newton's iteration.
   subroutine implicit_step(self, field, tau, z, h, failed)
      type(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), h
      logical, intent(out) :: failed

      logical :: again

      call self%radau%solve_stages(field, tau, z, h, failed)
      if (failed) return
      again = self%control%rejected .or. .not. self%control%last_h > 0.0_wp
      call self%radau%estimate_error(field, tau, z, self%dz_start, h, again, self%error)
      self%z_end = z + self%radau%z(:, 3)
      failed = .not. all(ieee_is_finite(self%z_end)) .or. .not. ieee_is_finite(self%error)
   end subroutine implicit_step

   !> Count the attempt, remember where the next one starts, and propose its step, on the ladder of maps if there are any.
   pure subroutine propose(self, on_ladder, accepted, failed)
      class(attempts_t), intent(inout) :: self
      logical, intent(in) :: on_ladder, accepted, failed

      real(wp) :: factor
      logical :: kept

      if (accepted) then
         self%accepted_steps = self%accepted_steps + 1
         self%known = moved_on
         self%h_next = self%step
         if (self%adaptive) then
            if (self%mapped) then
               call self%control%accepted_on_ladder(self%h, self%error, log_half_rung, factor)
            else
               call self%control%accepted(self%h, self%error, self%control%safety, factor)
            end if
            self%h_next = factor*self%h
            kept = self%mapped .and. .not. abs(factor - 1.0_wp) > 0.0_wp
            if (on_ladder .and. .not. kept) self%h_next = near_on_ladder(self%h_next)
         end if
         return
      end if
      self%rejected_steps = self%rejected_steps + 1
      self%known = same_start
      if (failed) then
         self%control%rejected = .true.
         self%h_next = factor_of_failure*self%h
      else
         call self%control%refused(self%error, self%control%safety, factor)
         self%h_next = factor*self%h
      end if
      if (on_ladder) self%h_next = below_on_ladder(self%h_next)
   end subroutine propose

   !> The same for the implicit method, whose proposal depends on the work of the iteration; a step that would hardly grow is
   !> kept, and its factors with it.
   pure subroutine propose_implicit(self, accepted, failed)
      type(attempts_t), intent(inout) :: self
      logical, intent(in) :: accepted, failed

      real(wp) :: factor, safety

      safety = self%radau%safety(self%control%safety)
      if (accepted) then
         self%accepted_steps = self%accepted_steps + 1
         self%known = moved_on
         call self%radau%keep_polynomial(self%h)
         call self%control%accepted(self%h, self%error, safety, factor)
         if (factor >= 1.0_wp .and. factor <= most_kept .and. self%radau%has_jacobian) factor = 1.0_wp
         self%h_next = factor*self%h
         return
      end if
      self%rejected_steps = self%rejected_steps + 1
      self%known = same_start
      if (failed) then
         self%control%rejected = .true.
         self%h_next = self%radau%shrink*self%h
      else
         call self%control%refused(self%error, safety, factor)
         self%h_next = factor*self%h
      end if
      call self%radau%refuse()
   end subroutine propose_implicit

   !> Start of the step and the slope there, evaluated unless it is known.
   subroutine know_start(self, field, tau, z)
      type(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      self%z_start(:self%n) = z
      if (self%known == unknown) then
         call field%derivative(tau, z, self%dz_start)
      else if (self%known == moved_on) then
         self%dz_start = self%dz_end
      end if
      self%k(:self%n, 1) = self%dz_start
      self%known = same_start
   end subroutine know_start

   !> Make the dense output of the accepted step from (tau, z); evaluates the stages that only it needs.
   subroutine prepare_dense(self, field, tau, z)
      class(attempts_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      integer :: i

      self%output%h = self%h
      do i = 1, self%n
         self%output%r(i, 0) = z(i)
      end do
      if (self%implicit) then
         call self%radau%dense_coefficients(self%output%r(:, 1:4))
         return
      end if
      call self%explicit_dense(field, tau, z)
   end subroutine prepare_dense

end module razy_runge_kutta_methods_attempts
