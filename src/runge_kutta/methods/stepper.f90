!! Steps of a Runge-Kutta method along a smooth piece of motion: trial step, error, proposal of the next, dense output.
!!
!! Each step starts at the time 0 of the right-hand side, which has begun there. `attempt` changes nothing but its own; the caller
!! takes `z_end` if he likes. After an accepted step the next attempt has to start at its end, after one that was not accepted at
!! the same point, unless `restart` is called in between (an event, a shorter piece of the step): slopes known from the step before
!! and the controller's memory are forgotten there. `attempt` evaluates the slope at the end of an accepted step, so that an
!! explicit method of s stages needs s right-hand sides a step. Rows of stages are filled up to whole blocks with zeros.
!!
!! The error of a step is the largest |error_i|/(absolute + relative max(|z_i| before, |z_i| after)); up to 1 it is accepted.
!! Nothing is allocated but by `prepare`.
module razy_runge_kutta_methods_stepper
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_system, only: system_t
   use razy_linalg_blocks, only: filled
   use razy_motion_method, only: method_t
   use razy_runge_kutta_methods_dense_output, only: dense_output_t
   use razy_runge_kutta_methods_radau5, only: radau5_t
   use razy_runge_kutta_methods_step_control, only: factor_of_failure, step_control_t
   use razy_runge_kutta_methods_tableaux, only: new_tableau, sum_t, tableau_t
   use razy_runge_kutta_right_hand_side, only: right_hand_side_t
   implicit none(type, external)
   private

   public :: stepper_t

   !> A method at work on z' = f(t, z) of n components.
   type :: stepper_t
      type(right_hand_side_t) :: rhs
      !> Whether the step is controlled, and whether equations have to be solved.
      logical :: adaptive = .false., implicit = .false.
      !> Whether the motion is not smooth where it starts anew and where it is to end: then errors of steps say little of the next
      !> ones. Whether the error is the first estimate as it is, because a second one supposes that the motion is smooth.
      logical :: rough = .false., plain = .false.
      !> Step last attempted, its scaled error, and the step proposed for the next attempt, s.
      real(wp) :: h = 0.0_wp, error = 0.0_wp, h_next = 0.0_wp
      !> Attempts that were accepted, and those that were not.
      integer(i8) :: accepted_steps = 0, rejected_steps = 0
      !> Start of the last attempt (n, filled up to blocks) and its end (n); slopes at its start and (accepted steps only) at its
      !> end (n each).
      real(wp), allocatable :: z_start(:), z_end(:), dz_start(:), dz_end(:)
      type(dense_output_t) :: output
      type(tableau_t) :: tableau
      type(radau5_t) :: radau
      type(step_control_t), private :: control
      !> Components of z, rows of the stages.
      integer, private :: n = 0, rows = 0
      !> Tolerances, step of the method (0: chosen).
      real(wp) :: relative = 0.0_wp, absolute = 0.0_wp
      real(wp), private :: step = 0.0_wp
      !> What is known of the slope at the start of the next attempt.
      integer, private :: known = 0
      !> Whether the dense output is that of the last step.
      logical, private :: dense = .false.
      !> Stage of the step, nothing (rows each), slopes (rows, stages), error estimates (rows, estimates).
      real(wp), allocatable, private :: z_stage(:), zero(:), k(:, :), estimates(:, :)
   contains
      procedure :: prepare
      procedure :: restart
      procedure :: first_step
      procedure :: begin
      procedure :: attempt
      procedure :: leap
      procedure :: prepare_dense
      procedure :: fine_at
   end type stepper_t

   !> The slope at the start: not known, known (as dz_start), the one at the end of the last step (dz_end).
   integer, parameter :: unknown = 0, same_start = 1, moved_on = 2
   !> Growth of a step for which new factors do not pay.
   real(wp), parameter :: most_kept = 1.2_wp
   !> Weight of the estimate of order 3 in that of DOP853 (Hairer, Nørsett and Wanner I, (10.17)).
   real(wp), parameter :: share_of_third = 0.01_wp

contains

   !> Make ready for `method`, one of razy_runge_kutta_methods_tableaux or "radau5", on z of n components.
   subroutine prepare(self, method, n)
      class(stepper_t), intent(inout) :: self
      type(method_t), intent(in) :: method
      integer, intent(in) :: n

      self%implicit = method%integrator == "radau5"
      call new_tableau(self%tableau, trim(method%integrator))
      if (self%implicit) call self%radau%prepare(n, method%relative_tolerance, method%absolute_tolerance)
      self%adaptive = self%tableau%estimate > 0
      self%control = step_control_t(order=max(self%tableau%estimate, 1), beta=self%tableau%beta, least=self%tableau%least, &
                                    most=self%tableau%most, predictive=self%implicit)
      self%relative = method%relative_tolerance
      self%absolute = method%absolute_tolerance
      self%step = method%step
      self%accepted_steps = 0
      self%rejected_steps = 0
      self%rhs%evaluations = 0
      self%rhs%jacobians = 0
      self%h = 0.0_wp
      self%h_next = self%step
      self%n = n
      self%rows = filled(n)
      if (allocated(self%k)) deallocate (self%z_end, self%dz_start, self%dz_end, self%z_start, self%z_stage, self%zero, self%k, &
                                         self%estimates)
      allocate (self%dz_start(n), self%dz_end(n), self%z_end(n), self%z_start(self%rows), self%z_stage(self%rows), &
                self%zero(self%rows), self%k(self%rows, self%tableau%stages + 1 + self%tableau%extra), &
                self%estimates(self%rows, self%tableau%errors), source=0.0_wp)
      call self%output%prepare(n, 3 + self%tableau%polynomials)
      call self%restart()
   end subroutine prepare

   !> Forget the slope at the start of the next attempt and the controller's memory.
   pure subroutine restart(self)
      class(stepper_t), intent(inout) :: self

      self%known = unknown
      call self%control%forget()
      self%control%beta = merge(0.0_wp, self%tableau%beta, self%rough)
      if (self%implicit) call self%radau%restart()
   end subroutine restart

   !> A step to start with, s, at most `longest`: that of the method if it gives one, else by the size of z, z' and z'' (Hairer,
   !> Nørsett and Wanner I, II.4). `longest` if there is no slope.
   subroutine first_step(self, system, z, longest, h)
      class(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: z(:)
      real(wp), intent(in) :: longest
      real(wp), intent(out) :: h

      real(wp), dimension(size(z)) :: slope, there, unit
      real(wp) :: size_z, size_f

      h = min(self%step, longest)
      if (h > 0.0_wp) return
      call know_start(self, system, z)
      h = longest
      if (.not. all(ieee_is_finite(self%dz_start))) return
      unit = self%absolute + self%relative*abs(z)
      size_z = maxval(abs(z)/unit)
      size_f = maxval(abs(self%dz_start)/unit)
      h = 1.0e-6_wp
      if (min(size_z, size_f) > 1.0e-5_wp) h = 0.01_wp*size_z/size_f
      h = min(h, longest)
      there = z + h*self%dz_start
      call self%rhs%derivative(system, h, there, slope)
      if (.not. all(ieee_is_finite(slope))) return
      size_f = max(size_f, maxval(abs(slope - self%dz_start)/(unit*h)))
      if (size_f > 1.0e-15_wp) then
         h = min(100*h, (0.01_wp/size_f)**(1.0_wp/self%tableau%order), longest)
      else
         h = min(max(1.0e-6_wp, 1.0e-3_wp*h), longest)
      end if
   end subroutine first_step

   !> Evaluate the slope at z, unless `first_step` has done so there: it is as if a step had ended there.
   subroutine begin(self, system, z)
      class(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: z(:)

      call know_start(self, system, z)
      self%dz_end(:) = self%dz_start
      self%known = moved_on
   end subroutine begin

   !> Try a step h from z. `failed`: it led to no number, or its equations were not solved; then, and when it is not accepted,
   !> `h_next` is shorter.
   subroutine attempt(self, system, z, h, accepted, failed)
      class(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: accepted, failed

      call know_start(self, system, z)
      self%h = h
      self%error = 0.0_wp
      failed = .not. all(ieee_is_finite(self%dz_start))
      if (.not. failed) then
         if (self%implicit) then
            call implicit_step(self, system, z, h, failed)
         else
            call explicit_step(self, system, h, failed)
         end if
      end if
      accepted = .false.
      if (.not. failed) accepted = self%error <= 1.0_wp
      if (accepted) then
         call end_slope(self, system, h)
         failed = .not. all(ieee_is_finite(self%dz_end))
         accepted = .not. failed
      end if
      call propose(self, accepted, failed)
   end subroutine attempt

   !> Step h from z, which is part of an accepted one that began there; the next step has to start anew. `taken`: it led to
   !> numbers.
   subroutine leap(self, system, z, h, taken)
      class(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: taken

      self%known = same_start
      call know_start(self, system, z)
      self%h = h
      call form_stages(self, system, h)
      call end_slope(self, system, h)
      self%accepted_steps = self%accepted_steps + 1
      taken = all(ieee_is_finite(self%z_end)) .and. all(ieee_is_finite(self%dz_end))
   end subroutine leap

   !> Stages, end and error of a step h from the start known.
   subroutine explicit_step(self, system, h, failed)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h
      logical, intent(out) :: failed

      integer :: e

      call form_stages(self, system, h)
      if (self%adaptive) then
         do e = 1, self%tableau%errors
            call combine(self%rows, size(self%k, 2), self%zero, h, self%k, self%tableau%error(e), self%estimates(:, e))
         end do
         self%error = scaled_error(self%n, self%rows, merge(1, self%tableau%errors, self%plain), self%estimates, self%z_start, &
                                   self%z_end, self%absolute, self%relative)
      end if
      failed = .not. all(ieee_is_finite(self%z_end)) .or. .not. ieee_is_finite(self%error)
   end subroutine explicit_step

   !> Stages and end of a step h from the start known.
   subroutine form_stages(self, system, h)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h

      integer :: i, last

      last = self%tableau%stages + 1
      do i = 2, self%tableau%stages
         call combine(self%rows, size(self%k, 2), self%z_start, h, self%k, self%tableau%row(i), self%z_stage)
         call self%rhs%derivative(system, self%tableau%node(i)*h, self%z_stage, self%k(:, i))
      end do
      call combine(self%rows, size(self%k, 2), self%z_start, h, self%k, self%tableau%row(last), self%z_stage)
      self%z_end(:) = self%z_stage(:self%n)
      if (self%tableau%fsal) call self%rhs%derivative(system, h, self%z_end, self%k(:, last))
   end subroutine form_stages

   !> The slope at the end of the step h, whose stages have been formed.
   subroutine end_slope(self, system, h)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: h

      if (self%tableau%fsal) then
         self%dz_end(:) = self%k(:self%n, self%tableau%stages + 1)
      else
         call self%rhs%derivative(system, h, self%z_end, self%dz_end)
         self%k(:self%n, self%tableau%stages + 1) = self%dz_end
      end if
   end subroutine end_slope

   !> A step h from z by Newton's iteration.
   subroutine implicit_step(self, system, z, h, failed)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: z(:), h
      logical, intent(out) :: failed

      logical :: again

      call self%radau%solve_stages(self%rhs, system, z, h, failed)
      if (failed) return
      again = self%control%rejected .or. .not. self%control%last_h > 0.0_wp
      call self%radau%estimate_error(self%rhs, system, z, self%dz_start, h, again, self%error)
      self%z_end = z + self%radau%z(:, 3)
      failed = .not. all(ieee_is_finite(self%z_end)) .or. .not. ieee_is_finite(self%error)
   end subroutine implicit_step

   !> Count the attempt, remember where the next one starts, and propose its step. Of the implicit method the proposal depends
   !> on the work of the iteration, and a step that would hardly grow is kept, and its factors with it.
   pure subroutine propose(self, accepted, failed)
      type(stepper_t), intent(inout) :: self
      logical, intent(in) :: accepted, failed

      real(wp) :: factor, safety

      safety = self%control%safety
      if (self%implicit) safety = self%radau%safety(safety)
      if (accepted) then
         self%accepted_steps = self%accepted_steps + 1
         self%known = moved_on
         self%h_next = self%step
         if (self%implicit) call self%radau%keep_polynomial(self%h)
         if (.not. self%adaptive) return
         call self%control%accepted(self%h, self%error, safety, factor)
         if (self%implicit .and. factor >= 1.0_wp .and. factor <= most_kept .and. self%radau%has_jacobian) factor = 1.0_wp
         self%h_next = factor*self%h
         return
      end if
      self%rejected_steps = self%rejected_steps + 1
      self%known = same_start
      if (failed) then
         self%control%rejected = .true.
         factor = factor_of_failure
         if (self%implicit) factor = self%radau%shrink
      else
         call self%control%refused(self%error, safety, factor)
      end if
      self%h_next = factor*self%h
      if (self%implicit) call self%radau%refuse()
   end subroutine propose

   !> Start of the step and the slope there, evaluated unless it is known.
   subroutine know_start(self, system, z)
      type(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: z(:)

      self%z_start(:self%n) = z
      self%dense = .false.
      if (self%known == unknown) then
         call self%rhs%derivative(system, 0.0_wp, z, self%dz_start)
      else if (self%known == moved_on) then
         self%dz_start(:) = self%dz_end
      end if
      self%k(:self%n, 1) = self%dz_start
      self%known = same_start
   end subroutine know_start

   !> Make the dense output of the accepted step unless it has been made; evaluates the stages that only it needs.
   subroutine prepare_dense(self, system)
      class(stepper_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: i, l

      if (self%dense) return
      self%dense = .true.
      self%output%h = self%h
      associate (r => self%output%r, z => self%z_start)
         r(:, 0) = z(:self%n)
         if (self%implicit) then
            call self%radau%dense_coefficients(r(:, 1:4))
            return
         end if
         r(:, 1) = self%z_end - z(:self%n)
         r(:, 2) = self%h*self%dz_start - r(:, 1)
         r(:, 3) = r(:, 1) - self%h*self%dz_end - r(:, 2)
         do i = self%tableau%stages + 2, self%tableau%stages + 1 + self%tableau%extra
            call combine(self%rows, size(self%k, 2), self%z_start, self%h, self%k, self%tableau%row(i), self%z_stage)
            call self%rhs%derivative(system, self%tableau%node(i)*self%h, self%z_stage, self%k(:, i))
         end do
         do l = 1, self%tableau%polynomials
            call combine(self%rows, size(self%k, 2), self%zero, self%h, self%k, self%tableau%dense(l), self%z_stage)
            r(:, 3 + l) = self%z_stage(:self%n)
         end do
      end associate
   end subroutine prepare_dense

   !> Whether the dense output of the step is as good at theta as the step: its highest term, which is more than its error, is
   !> within the tolerance there.
   pure logical function fine_at(self, theta)
      class(stepper_t), intent(in) :: self
      real(wp), intent(in) :: theta

      real(wp) :: factor

      associate (last => self%output%last, r => self%output%r)
         factor = theta**((last + 1)/2)*(1.0_wp - theta)**(last/2)
         fine_at = all(abs(r(:, last))*factor <= self%absolute + self%relative*max(abs(r(:, 0)), abs(self%z_end)))
      end associate
   end function fine_at

   !> Largest component of the error `estimates` e of a step from z0 to z1 (n each) in units of the tolerance; not finite if one is
   !> not.
   pure function scaled_error(n, rows, estimates, e, z0, z1, absolute, relative) result(error)
      integer, intent(in) :: n, rows, estimates
      real(wp), intent(in) :: e(rows, estimates), z0(n), z1(n), absolute, relative
      real(wp) :: error

      real(wp) :: first, largest, scale, second
      integer :: i

      first = 0.0_wp
      second = 0.0_wp
      do i = 1, n
         scale = 1.0_wp/(absolute + relative*max(abs(z0(i)), abs(z1(i))))
         error = abs(e(i, 1))*scale
         if (.not. error <= huge(error)) return
         first = max(first, error)
         if (estimates < 2) cycle
         error = abs(e(i, 2))*scale
         if (.not. error <= huge(error)) return
         second = max(second, error)
      end do
      error = first
      if (estimates < 2 .or. .not. first > 0.0_wp) return
      second = sqrt(share_of_third)*second
      largest = max(first, second)
      error = first*((first/largest)/sqrt((first/largest)**2 + (second/largest)**2))
   end function scaled_error

   !> out = base + h Σ_j value_j k_column(j), four rows at a time.
   pure subroutine combine(rows, columns, base, h, k, sum, out)
      integer, intent(in) :: rows, columns
      real(wp), intent(in) :: base(rows), h, k(rows, columns)
      type(sum_t), intent(in) :: sum
      real(wp), intent(out) :: out(rows)

      real(wp) :: part(4)
      integer :: i, j

      do i = 1, rows, 4
         part = 0.0_wp
         do j = 1, sum%terms
            part = part + sum%value(j)*k(i:i + 3, sum%column(j))
         end do
         out(i:i + 3) = base(i:i + 3) + h*part
      end do
   end subroutine combine

end module razy_runge_kutta_methods_stepper
