!! Steps of a Runge-Kutta method along a smooth piece of motion: trial step, error, proposal of the next, dense output.
!!
!! `attempt` changes nothing but the stepper; the caller takes `z_end` if he likes. After an accepted step the next attempt has to
!! start at its end, after one that was not accepted at the same point, unless `restart` is called in between (an event, a shorter
!! piece of the step): slopes known from the step before and the controller's memory are forgotten there. `attempt` evaluates the
!! slope at the end of an accepted step, so that an
!! explicit method of s stages needs s right-hand sides a step.
!!
!! The error of a step is the largest |error_i|/(absolute + relative max(|z_i| before, |z_i| after)); up to 1 it is accepted.
!! Rows of stages are stored with a length that is a multiple of four, zeros beyond n. Nothing is allocated but by `prepare`.
module razy_integrate_stepper
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: i8, wp
   use razy_integrate_dense_output, only: dense_output_t
   use razy_integrate_field, only: field_t
   use razy_integrate_folded_stages, only: folded_stages
   use razy_integrate_radau5, only: radau5_t
   use razy_integrate_stage_sums, only: add_up, combine, scaled_error
   use razy_integrate_step_maps, only: below_on_ladder, half_rung, log_half_rung, near_on_ladder, step_maps_t
   use razy_integrate_step_control, only: factor_of_failure, step_control_t
   use razy_integrate_tableaux, only: new_tableau, tableau_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: stepper_t

   !> A method at work on z of n components.
   type :: stepper_t
      character(16) :: name = ""
      !> Orders of the result and of the dense output; right-hand sides of a step.
      integer :: order = 0, dense_order = 0, stages = 0
      !> Whether the step is controlled, and whether equations have to be solved.
      logical :: adaptive = .false., implicit = .false.
      !> Step last attempted, step proposed for the next, s; scaled error of the last attempt.
      real(wp) :: h = 0.0_wp, h_next = 0.0_wp, error = 0.0_wp
      !> End of the last attempt; slopes at its start and (accepted steps only) at its end (n each).
      real(wp), allocatable :: z_end(:), dz_start(:), dz_end(:)
      !> Attempts that were accepted, and those that were not.
      integer(i8) :: accepted_steps = 0, rejected_steps = 0
      integer :: n = 0
      real(wp) :: relative = 0.0_wp, absolute = 0.0_wp, step = 0.0_wp
      type(tableau_t) :: tableau
      type(step_control_t) :: control
      type(radau5_t) :: radau
      !> Coefficients r_4… of the dense output.
      integer :: polynomials = 0
      type(dense_output_t) :: output
      !> What is known of the slope at the start of the next attempt.
      integer :: known = 0
      !> Start and stage of the step, slopes (padded n, stages).
      real(wp), allocatable :: z_start(:), z_stage(:), k(:, :)
      !> Steps as linear maps, whether the last attempt was one, and error estimates (padded n, estimates).
      type(step_maps_t) :: maps
      logical :: mapped = .false.
      real(wp), allocatable :: estimates(:, :)
   contains
      procedure :: prepare
      procedure :: enter
      procedure :: restart
      procedure :: first_step
      procedure :: begin
      procedure :: attempt
      procedure :: leap
      procedure :: glide
      procedure :: go_on
      procedure :: prepare_dense
      procedure :: at
      procedure :: rate_at
   end type stepper_t

   !> The slope at the start: not known, known (as dz_start), the one at the end of the last step (dz_end).
   integer, parameter :: unknown = 0, same_start = 1, moved_on = 2
   !> Growth of a step for which new factors do not pay.
   real(wp), parameter :: most_kept = 1.2_wp

contains

   !> Make ready for `method`, one of razy_integrate_tableaux or "radau5", on z of n components.
   subroutine prepare(self, method, n)
      class(stepper_t), intent(inout) :: self
      type(method_t), intent(in) :: method
      integer, intent(in) :: n

      integer :: padded

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
      padded = 4*((n + 3)/4)
      if (allocated(self%k)) then
         if (self%n /= n .or. size(self%k, 2) /= self%stages + 1 + self%tableau%extra) then
            deallocate (self%z_end, self%dz_start, self%dz_end, self%z_start, self%z_stage, self%k, self%estimates)
         end if
      end if
      self%n = n
      if (.not. allocated(self%k)) then
         allocate (self%dz_start(n), self%dz_end(n), self%z_end(n))
         allocate (self%z_start(padded), self%z_stage(padded), self%k(padded, self%stages + 1 + self%tableau%extra))
         allocate (self%estimates(padded, self%tableau%errors))
      end if
      self%z_start = 0.0_wp
      self%z_stage = 0.0_wp
      self%k = 0.0_wp
      call self%output%prepare(n, 3 + self%polynomials)
      call self%maps%forget()
      call self%restart()
   end subroutine prepare

   !> The field has entered a mode: forget what came before.
   subroutine enter(self, field)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      call self%restart()
      if (self%adaptive .and. .not. self%implicit) call self%maps%enter(field)
   end subroutine enter

   !> Forget the slope at the start of the next attempt and the controller's memory.
   pure subroutine restart(self)
      class(stepper_t), intent(inout) :: self

      self%known = unknown
      call self%control%forget()
      if (self%implicit) call self%radau%restart()
   end subroutine restart

   !> A step to start with, s, at most `longest`: that of the method if it gives one, else by the size of z, z' and z''
   !> (Hairer, Nørsett and Wanner I, II.4). `longest` is returned if there is no slope.
   subroutine first_step(self, field, tau, z, longest, h)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), longest
      real(wp), intent(out) :: h

      real(wp) :: scale, size_z, size_f, size_change
      integer :: i

      h = min(self%step, longest)
      if (h > 0.0_wp) return
      h = longest
      call know_start(self, field, tau, z)
      size_z = 0.0_wp
      size_f = 0.0_wp
      do i = 1, self%n
         if (.not. ieee_is_finite(self%dz_start(i))) return
         scale = self%absolute + self%relative*abs(z(i))
         size_z = max(size_z, abs(z(i))/scale)
         size_f = max(size_f, abs(self%dz_start(i))/scale)
      end do
      h = 1.0e-6_wp
      if (min(size_z, size_f) > 1.0e-5_wp) h = 0.01_wp*size_z/size_f
      h = min(h, longest)
      do i = 1, self%n
         self%z_stage(i) = z(i) + h*self%dz_start(i)
      end do
      call field%derivative(tau + h, self%z_stage(:self%n), self%k(:self%n, 2))
      size_change = 0.0_wp
      do i = 1, self%n
         if (.not. ieee_is_finite(self%k(i, 2))) return
         scale = self%absolute + self%relative*abs(z(i))
         size_change = max(size_change, abs(self%k(i, 2) - self%dz_start(i))/(scale*h))
      end do
      size_f = max(size_f, size_change)
      if (size_f > 1.0e-15_wp) then
         h = min(100*h, (0.01_wp/size_f)**(1.0_wp/self%order), longest)
      else
         h = min(max(1.0e-6_wp, 1.0e-3_wp*h), longest)
      end if
   end subroutine first_step

   !> Evaluate the slope at (tau, z), unless `first_step` has done so there: it is as if a step had ended there.
   subroutine begin(self, field, tau, z)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      call know_start(self, field, tau, z)
      self%dz_end = self%dz_start
      self%known = moved_on
   end subroutine begin

   !> Try a step h from (tau, z). `failed`: it led to no number, or its equations were not solved; then, and when it is not
   !> accepted, `h_next` is shorter.
   subroutine attempt(self, field, tau, z, h, accepted, failed)
      class(stepper_t), intent(inout) :: self
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
            call explicit_step(self, field, tau, z, h, failed)
         end if
      end if
      accepted = .false.
      if (.not. failed) accepted = self%error <= 1.0_wp
      if (accepted .and. .not. self%mapped) then
         call end_slope(self, field, tau + h)
         failed = .not. all(ieee_is_finite(self%dz_end))
         accepted = .not. failed
      end if
      if (self%implicit) then
         call propose_implicit(self, accepted, failed)
      else
         call propose(self, field%folded, accepted, failed)
      end if
   end subroutine attempt

   !> Try the proposed step from (tau, z), where a step of the same mode has just ended, by its map: `done`, if there is one and it
   !> would be accepted. Nothing has happened until `go_on` is called; `attempt` may be called instead.
   subroutine glide(self, field, tau, z, done)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: done

      integer :: i
      logical :: failed

      done = self%known == moved_on .and. abs(tau - field%base) <= 0.0_wp
      if (done) call self%maps%try(field, self%tableau, self%h_next, self%dz_end, .false., done)
      if (.not. done) return
      do i = 1, self%n
         self%dz_start(i) = self%dz_end(i)
      end do
      self%known = same_start
      self%h = self%h_next
      self%mapped = .true.
      call mapped_step(self, field, tau + self%h, z, failed)
      done = self%error <= 1.0_wp .and. .not. failed
   end subroutine glide

   !> Accept the step that `glide` has made; its right-hand sides count as if they had been formed.
   pure subroutine go_on(self, field)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field

      logical :: steady

      field%evaluations = field%evaluations + self%stages
      call self%control%is_steady(self%error, log_half_rung, steady)
      if (steady) then
         self%accepted_steps = self%accepted_steps + 1
         self%known = moved_on
         self%h_next = self%h
      else
         call propose(self, .true., .true., .false.)
      end if
   end subroutine go_on

   !> Step h from (tau, z), which is part of an accepted one that began there; the next step has to start anew. `taken`: it led to
   !> numbers.
   subroutine leap(self, field, tau, z, h, taken)
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: taken

      self%known = same_start
      call know_start(self, field, tau, z)
      self%h = h
      self%mapped = .false.
      call form_stages(self, field, tau, h)
      call end_slope(self, field, tau + h)
      self%accepted_steps = self%accepted_steps + 1
      taken = all(ieee_is_finite(self%z_end)) .and. all(ieee_is_finite(self%dz_end))
   end subroutine leap

   !> Stages, end and error of a step h.
   subroutine explicit_step(self, field, tau, z, h, failed)
      type(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: failed

      integer :: e

      if (field%folded .and. abs(tau - field%base) <= 0.0_wp) then
         call self%maps%try(field, self%tableau, h, self%dz_start, .true., self%mapped)
         if (self%mapped) then
            field%evaluations = field%evaluations + self%stages
            call mapped_step(self, field, tau + h, z, failed)
            return
         end if
      end if
      call form_stages(self, field, tau, h)
      if (self%adaptive) then
         do e = 1, self%tableau%errors
            call add_up(self%k, self%tableau%error(e), self%estimates(:, e))
         end do
         self%error = abs(h)*scaled_error(self%n, size(self%estimates, 1), self%tableau%errors, self%estimates, self%z_start, &
                                          self%z_end, self%absolute, self%relative)
      end if
      failed = .not. all(ieee_is_finite(self%z_end)) .or. .not. ieee_is_finite(self%error)
   end subroutine explicit_step

   !> Stages and end of a step h from the start known.
   subroutine form_stages(self, field, tau, h)
      type(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h

      integer :: i, last

      last = self%stages + 1
      if (field%folded) then
         call folded_stages(field, self%tableau, tau, h, 2, last, self%z_start, self%k, self%z_stage)
         field%evaluations = field%evaluations + self%stages
         self%z_end = self%z_stage(:self%n)
      else
         do i = 2, self%stages
            call combine(self%z_start, h, self%k, self%tableau%row(i), self%z_stage)
            call field%derivative(tau + self%tableau%node(i)*h, self%z_stage(:self%n), self%k(:self%n, i))
         end do
         call combine(self%z_start, h, self%k, self%tableau%row(last), self%z_stage)
         self%z_end = self%z_stage(:self%n)
         if (self%tableau%fsal) call field%derivative(tau + h, self%z_end, self%k(:self%n, last))
      end if
   end subroutine form_stages

   !> The slope at the end of the step, at the time `tau`, where the stages have been formed.
   subroutine end_slope(self, field, tau)
      type(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau

      if (self%tableau%fsal .or. (field%folded .and. .not. self%implicit)) then
         self%dz_end = self%k(:self%n, self%stages + 1)
      else
         call field%derivative(tau, self%z_end, self%dz_end)
         self%k(:self%n, self%stages + 1) = self%dz_end
      end if
   end subroutine end_slope

   !> End, slope there and error of the step from z until `tau` whose map has been applied; leaves the field at the phases there.
   pure subroutine mapped_step(self, field, tau, z, failed)
      type(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: failed

      call field%turn_phases(self%maps%cosine, self%maps%sine, tau)
      call take(field%m, size(field%omega), field%matrix, field%constant, field%on_cosine, field%on_sine, field%c, field%d, &
                self%maps%ends, z, self%z_end, self%dz_end)
      self%error = scaled_error(self%n, self%n, self%tableau%errors, self%maps%ends(self%n + 1:), z, self%z_end, self%absolute, &
                                self%relative)
      failed = .not. self%error <= huge(1.0_wp)

   contains

      pure subroutine take(m, tones, matrix, constant, on_cosine, on_sine, c, d, change, z0, z1, slope)
         integer, intent(in) :: m, tones
         real(wp), intent(in) :: matrix(m, 2*m), constant(m), on_cosine(m, tones), on_sine(m, tones), c(tones), d(tones), &
                                 change(2*m), z0(2*m)
         real(wp), intent(out) :: z1(2*m), slope(2*m)

         real(wp) :: a
         integer :: i, j

         do i = 1, 2*m
            z1(i) = z0(i) + change(i)
         end do
         do i = 1, m
            a = constant(i)
            do j = 1, tones
               a = a + (on_cosine(i, j)*c(j) + on_sine(i, j)*d(j))
            end do
            do j = 1, 2*m
               a = a - matrix(i, j)*z1(j)
            end do
            slope(i) = z1(m + i)
            slope(m + i) = a
         end do
      end subroutine take

   end subroutine mapped_step

   !> The same by Newton's iteration.
   subroutine implicit_step(self, field, tau, z, h, failed)
      type(stepper_t), intent(inout) :: self
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

   !> Count the attempt, remember where the next one starts, and propose its step, on the ladder of maps if the mode is `folded`.
   pure subroutine propose(self, folded, accepted, failed)
      type(stepper_t), intent(inout) :: self
      logical, intent(in) :: folded, accepted, failed

      real(wp) :: factor

      if (accepted) then
         self%accepted_steps = self%accepted_steps + 1
         self%known = moved_on
         self%h_next = self%step
         if (self%adaptive) then
            call self%control%accepted(self%h, self%error, self%control%safety, factor)
            self%h_next = factor*self%h
            if (self%mapped .and. factor <= half_rung .and. factor*half_rung >= 1.0_wp) then
               self%h_next = self%h
            else if (folded) then
               self%h_next = near_on_ladder(self%h_next)
            end if
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
      if (folded) self%h_next = below_on_ladder(self%h_next)
   end subroutine propose

   !> The same for the implicit method, whose proposal depends on the work of the iteration; a step that would hardly grow is
   !> kept, and its factors with it.
   pure subroutine propose_implicit(self, accepted, failed)
      type(stepper_t), intent(inout) :: self
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
      type(stepper_t), intent(inout) :: self
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
      class(stepper_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      integer :: i, l, last

      self%output%h = self%h
      do i = 1, self%n
         self%output%r(i, 0) = z(i)
      end do
      if (self%implicit) then
         call self%radau%dense_coefficients(self%output%r(:, 1:4))
         return
      end if
      associate (r => self%output%r)
         do i = 1, self%n
            r(i, 1) = self%z_end(i) - z(i)
            r(i, 2) = self%h*self%dz_start(i) - r(i, 1)
            r(i, 3) = r(i, 1) - self%h*self%dz_end(i) - r(i, 2)
         end do
         if (self%mapped) then
            field%evaluations = field%evaluations + self%tableau%extra
            call self%maps%dense(self%n, r(:, 4:3 + self%tableau%polynomials))
            return
         end if
         last = self%stages + 1
         if (field%folded .and. self%tableau%extra > 0) then
            call folded_stages(field, self%tableau, tau, self%h, last + 1, last + self%tableau%extra, self%z_start, self%k, &
                               self%z_stage)
            field%evaluations = field%evaluations + self%tableau%extra
            last = last + self%tableau%extra
         end if
         do i = last + 1, self%stages + 1 + self%tableau%extra
            call combine(self%z_start, self%h, self%k, self%tableau%row(i), self%z_stage)
            call field%derivative(tau + self%tableau%node(i)*self%h, self%z_stage(:self%n), self%k(:self%n, i))
         end do
         do l = 1, self%tableau%polynomials
            call add_up(self%k, self%tableau%dense(l), self%z_stage)
            do i = 1, self%n
               r(i, 3 + l) = self%h*self%z_stage(i)
            end do
         end do
      end associate
   end subroutine prepare_dense

   !> z at theta in [0, 1] of the step whose dense output was prepared.
   pure subroutine at(self, theta, z)
      class(stepper_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: z(:)

      call self%output%at(theta, z)
   end subroutine at

   !> dz/dt at theta, the derivative of `at`.
   pure subroutine rate_at(self, theta, dz)
      class(stepper_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: dz(:)

      call self%output%rate_at(theta, dz)
   end subroutine rate_at

end module razy_integrate_stepper
