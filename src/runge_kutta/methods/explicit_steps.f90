!! The steps of explicit Runge-Kutta methods: stages, end, error estimates and dense output, from the start and the slope there.
!!
!! In a mode whose forces are in its matrices stages are formed without calls in between
!! (razy_runge_kutta_methods_folded_stages), and steps that serve often by their maps (razy_runge_kutta_methods_step_maps).
!! Rows of stages have a length that is a multiple of four, zeros beyond n.
module razy_runge_kutta_methods_explicit_steps
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_runge_kutta_methods_dense_output, only: dense_output_t
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_folded_stages, only: folded_stages
   use razy_runge_kutta_methods_stage_sums, only: add_up, combine, scaled_error
   use razy_runge_kutta_methods_step_maps, only: step_maps_t
   use razy_runge_kutta_methods_step_strip, only: step_strip_t
   use razy_runge_kutta_methods_tableaux, only: tableau_t
   implicit none(type, external)
   private

   public :: explicit_steps_t

   !> A step of n components.
   type :: explicit_steps_t
      integer :: n = 0
      !> Right-hand sides of a step.
      integer :: stages = 0
      !> Whether the step is controlled, and whether equations have to be solved (by those who extend this).
      logical :: adaptive = .false., implicit = .false.
      !> Tolerances; step last attempted, s, and its scaled error.
      real(wp) :: relative = 0.0_wp, absolute = 0.0_wp, h = 0.0_wp, error = 0.0_wp
      !> End of the last attempt; slopes at its start and (accepted steps only) at its end (n each).
      real(wp), allocatable :: z_end(:), dz_start(:), dz_end(:)
      type(tableau_t) :: tableau
      type(dense_output_t) :: output
      !> Start and stage of the step, slopes (padded n, stages).
      real(wp), allocatable :: z_start(:), z_stage(:), k(:, :)
      !> Steps as linear maps, whether they are used, whether the last attempt was one, and error estimates (padded n, estimates).
      type(step_maps_t) :: maps
      logical :: mapping = .false., mapped = .false.
      real(wp), allocatable :: estimates(:, :)
      !> Steps made in a row by their map.
      type(step_strip_t) :: strip
   contains
      procedure :: make_room
      procedure :: explicit_step
      procedure :: form_stages
      procedure :: end_slope
      procedure :: mapped_step
      procedure :: explicit_dense
      procedure :: at
      procedure :: fine_at
      procedure :: rate_at
   end type explicit_steps_t

   !> Tolerance below which there are no maps: their rounding, tens of epsilon a step and of the same sign in every step, would be
   !> more than a thousandth of it.
   real(wp), parameter :: least_mapped = 4.5e4_wp*epsilon(1.0_wp)

contains

   !> Make room for n components and the stages of the tableau; forget maps.
   subroutine make_room(self, n)
      class(explicit_steps_t), intent(inout) :: self
      integer, intent(in) :: n

      integer :: padded

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
      call self%maps%forget()
      self%mapping = self%adaptive .and. .not. self%implicit .and. self%relative >= least_mapped
   end subroutine make_room

   !> Stages, end and error of a step h.
   subroutine explicit_step(self, field, tau, z, h, failed)
      class(explicit_steps_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, h
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: failed

      integer :: e

      if (self%mapping .and. field%folded .and. abs(tau - field%base) <= 0.0_wp) then
         call self%maps%try(field, self%tableau, h, self%dz_start, self%mapped)
         if (self%mapped) then
            field%evaluations = field%evaluations + self%stages
            call self%mapped_step(field, tau + h, z, failed)
            return
         end if
      end if
      call self%form_stages(field, tau, h)
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
      class(explicit_steps_t), intent(inout) :: self
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
      class(explicit_steps_t), intent(inout) :: self
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
      class(explicit_steps_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau
      real(wp), intent(in), contiguous :: z(:)
      logical, intent(out) :: failed

      call self%maps%turn(field, tau)
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

   !> Dense output of the accepted step from (tau, z); evaluates the stages that only it needs.
   subroutine explicit_dense(self, field, tau, z)
      class(explicit_steps_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:)

      integer :: i, l, last

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
   end subroutine explicit_dense

   !> Whether the dense output of the step is as good at theta as the step: its highest term, which is more than its error, is
   !> within the tolerance there.
   pure logical function fine_at(self, theta)
      class(explicit_steps_t), intent(in) :: self
      real(wp), intent(in) :: theta

      real(wp) :: factor
      integer :: i

      associate (last => self%output%last, r => self%output%r)
         factor = theta**((last + 1)/2)*(1.0_wp - theta)**(last/2)
         fine_at = .true.
         do i = 1, self%n
            fine_at = fine_at .and. abs(r(i, last))*factor <= self%absolute + self%relative*max(abs(r(i, 0)), abs(self%z_end(i)))
         end do
      end associate
   end function fine_at

   !> z at theta in [0, 1] of the step whose dense output was prepared.
   pure subroutine at(self, theta, z)
      class(explicit_steps_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: z(:)

      call self%output%at(theta, z)
   end subroutine at

   !> dz/dt at theta, the derivative of `at`.
   pure subroutine rate_at(self, theta, dz)
      class(explicit_steps_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: dz(:)

      call self%output%rate_at(theta, dz)
   end subroutine rate_at

end module razy_runge_kutta_methods_explicit_steps
