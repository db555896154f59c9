!! A point on the closed form: amplitudes at a time of a piece, moved by steps of 2^-level s or to any time.
!!
!! Steps multiply amplitudes by tabulated factors and serve the search for events; what is kept of an event is evaluated from the
!! start of the piece, so that the state between events does not depend on the steps. Nothing is allocated here but by `reserve`,
!! when a response is larger than all before it, and by entries of the table of steps.
module razy_exact_closed_form_amplitudes
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_response, only: response_t
   use razy_linalg_exponential, only: exponential_action, matrix_exponential
   use razy_linalg_blocks, only: copy_blocks, grow_shortly, product, rotate, rotate_self
   implicit none(type, external)
   private

   public :: amplitudes_t, carry_disturbances, copy, enter_terms, go_from, move_to, reserve, rigid_of, rigid_rate_of, &
             set_excitation, set_state, shift, state_of, step, tabulate

   !> Arrays may be longer than the response at hand needs.
   type :: amplitudes_t
      !> Time since the start of the segment, s.
      real(wp) :: tau = 0.0_wp
      !> Real parts of the amplitudes of terms and tones, their imaginary parts, each filled up to pairs; 1; rigid modes, their
      !> rates, and the constant force on each.
      real(wp), allocatable :: x(:)
      !> Dense states.
      real(wp), allocatable :: dense(:)
      !> Workspace: cosine and sine of each tone.
      real(wp), allocatable :: tone(:)
   end type amplitudes_t

   !> Times the fastest exponent, a shift for which short series do.
   real(wp), parameter :: tiny_angle = 3.0e-3_wp

contains

   !> Make room for a response, beside all those before.
   pure subroutine reserve(self, response)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      integer :: room(2)

      room = [response%length, response%nx] + 8
      if (allocated(self%x)) then
         associate (now => [size(self%x), size(self%dense)])
            if (all(now >= room - 8)) return
            room = max(room, now)
         end associate
         deallocate (self%x, self%dense, self%tone)
      end if
      allocate (self%x(room(1)), self%tone(room(1)), self%dense(room(2)), source=0.0_wp)
   end subroutine reserve

   !> Rigid mode k, and its rate.
   pure real(wp) function rigid_of(self, response, k)
      type(amplitudes_t), intent(in) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: k

      rigid_of = self%x(response%one + k)
   end function rigid_of

   pure real(wp) function rigid_rate_of(self, response, k)
      type(amplitudes_t), intent(in) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: k

      rigid_rate_of = self%x(response%one + response%rigid + k)
   end function rigid_rate_of

   !> Put the cursor at tau = 0 with the state z (2m) and the tones' phasors (tones).
   pure subroutine set_state(self, response, z, phasor)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: z(:)
      complex(wp), contiguous, intent(in) :: phasor(:)

      real(wp) :: rest(2*response%m), y(response%rows)
      integer :: j

      rest = (z - response%origin) - response%from(:, response%one)
      associate (n => response%terms)
         do j = 1, response%tones
            rest = rest - (response%from(:, n + j)*phasor(j)%re + response%from(:, response%filled + n + j)*phasor(j)%im)
         end do
      end associate
      call product(response%rows, 2*response%m, response%into, rest, y)
      call enter_terms(response, y, self%x)
      call set_excitation(self, response, phasor)
      if (response%nx > 0) call start_dense(self, response, z - response%origin, phasor)
   end subroutine set_state

   !> Enter terms and rigid modes `y` (rows) into a list; all else in it is 0.
   pure subroutine enter_terms(response, y, x)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: y(response%rows)
      real(wp), intent(inout) :: x(response%length)

      integer :: i

      associate (n => response%terms, f => response%filled, one => response%one)
         !$omp simd
         do i = 1, response%length
            x(i) = 0.0_wp
         end do
         !$omp simd
         do i = 1, n
            x(i) = y(i)
            x(f + i) = y(n + i)
         end do
         do i = 1, 2*response%rigid
            x(one + i) = y(2*n + i)
         end do
      end associate
   end subroutine enter_terms

   !> What of the list at tau = 0 is not the state: the tones' phasors (tones) and what is constant.
   pure subroutine set_excitation(self, response, phasor)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      complex(wp), contiguous, intent(in) :: phasor(:)

      integer :: j

      self%tau = 0.0_wp
      do j = 1, response%tones
         self%x(response%terms + j) = phasor(j)%re
         self%x(response%filled + response%terms + j) = phasor(j)%im
      end do
      if (response%driven%loaded) self%x(response%amplitudes) = 1.0_wp
      self%x(response%one) = 1.0_wp
      do j = 1, response%rigid
         self%x(response%one + 2*response%rigid + j) = response%rigid_force(j)
      end do
   end subroutine set_excitation

   !> Dense states at tau = 0.
   pure subroutine start_dense(self, response, z, phasor)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: z(:)
      complex(wp), contiguous, intent(in) :: phasor(:)

      integer :: j

      do j = 1, size(response%dense)
         call response%dense(j)%start(z, phasor, self%dense(response%first(j):response%first(j + 1) - 1))
      end do
   end subroutine start_dense

   !> The state z (2m) at the cursor.
   pure subroutine state_of(self, response, z)
      type(amplitudes_t), intent(in) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(out) :: z(:)

      integer :: j

      call product(2*response%m, response%columns, response%from, self%x, z)
      z = z + response%origin
      if (response%nx == 0) return
      do j = 1, size(response%dense)
         call response%dense(j)%add_state(self%dense(response%first(j):response%first(j + 1) - 1), z)
      end do
   end subroutine state_of

   !> Copy what the response uses of a cursor.
   pure subroutine copy(from, response, to)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(inout) :: to

      to%tau = from%tau
      call copy_blocks(response%length, from%x, to%x)
      if (response%nx > 0) to%dense(:response%nx) = from%dense(:response%nx)
   end subroutine copy

   !> Move from `from` by 2^-level s; makes the table's entry when it is used for the first time.
   pure subroutine step(from, response, level, self)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: h

      if (.not. response%has_step(level)) call tabulate(response, level)
      h = response%step_length(level)
      self%tau = from%tau + h
      call rotate(response%filled, from%x, response%factor(:, level), self%x)
      call copy_blocks(response%length - response%one + 1, from%x(response%one), self%x(response%one))
      if (response%rigid > 0) call move_rigid(response, h, self)
      if (response%ramps) call move_ramps(response, h, self%x)
      if (response%driven%count > 0) then
         call take_tones(self, response, from%x)
         call push_by_table(self, response, level)
      end if
      if (response%nx == 0) return
      self%dense(:response%nx) = from%dense(:response%nx)
      call step_dense(response, level, self%dense)
   end subroutine step

   !> Move rigid modes by `h`, s.
   pure subroutine move_rigid(response, h, self)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: h
      type(amplitudes_t), intent(inout) :: self

      integer :: i

      associate (n => response%rigid)
         do i = response%one + 1, response%one + n
            self%x(i) = self%x(i) + h*(self%x(i + n) + 0.5_wp*h*self%x(i + 2*n))
            self%x(i + n) = self%x(i + n) + h*self%x(i + 2*n)
         end do
      end associate
   end subroutine move_rigid

   !> Move tones that are straight lines by `h`, s.
   pure subroutine move_ramps(response, h, x)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: x(:)

      integer :: t

      associate (n => response%terms, f => response%filled)
         do t = 1, response%tones
            x(n + t) = x(n + t) + h*response%slope(t)*x(f + n + t)
         end do
      end associate
   end subroutine move_ramps

   !> Evaluate the closed form that starts at `start` at the time `tau` of the segment.
   pure subroutine move_to(start, response, tau, self)
      type(amplitudes_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: factor(2*response%filled)
      integer :: i

      self%tau = tau
      factor = 0.0_wp
      do i = 1, response%amplitudes
         call growth(response%exponent(i), tau, factor(i), factor(response%filled + i))
      end do
      call rotate(response%filled, start%x, factor, self%x)
      call copy_blocks(response%length - response%one + 1, start%x(response%one), self%x(response%one))
      if (response%rigid > 0) call move_rigid(response, tau, self)
      if (response%ramps) call move_ramps(response, tau, self%x)
      if (response%driven%count > 0) call add_excitation(start, response, tau, factor, self)
      if (response%nx > 0) call move_dense(response, start%dense(:response%nx), tau, self%dense)
   end subroutine move_to

   !> Dense states `tau` s after `from`.
   pure subroutine move_dense(response, from, tau, to)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: from(:), tau
      real(wp), intent(inout) :: to(:)

      integer :: i, j, k

      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         call exponential_action(response%dense(i)%matrix, response%dense(i)%norm, tau, from(j:k), to(j:k))
      end do
   end subroutine move_dense

   !> Go from `from` by `tau` (s), shorter than 2^-level: binary digits of tau down to the response's fine level by the table
   !> of steps; what is left of tau by `shift`, or not at all if `coarsely`, and then tau is shortened by it.
   pure subroutine go_from(from, response, level, coarsely, tau, self)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      logical, intent(in) :: coarsely
      real(wp), intent(inout) :: tau
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: h, rest
      integer :: k

      call copy(from, response, self)
      rest = tau
      h = response%step_length(level)
      do k = level + 1, response%fine_level
         h = 0.5_wp*h
         if (rest < h) cycle
         rest = rest - h
         if (.not. response%has_step(k)) call tabulate(response, k)
         if (response%driven%count > 0) call take_tones(self, response, self%x)
         call rotate_self(response%filled, response%factor(:, k), self%x)
         if (response%ramps) call move_ramps(response, h, self%x)
         if (response%driven%count > 0) call push_by_table(self, response, k)
         if (response%nx > 0) call step_dense(response, k, self%dense)
      end do
      if (response%rigid > 0) call move_rigid(response, tau - rest, self)
      if (coarsely) then
         tau = tau - rest
      else
         call shift(self, response, rest)
      end if
      self%tau = from%tau + tau
   end subroutine go_from

   !> Move by the small time `delta`: series that are right to rounding for |exponent*delta| <= 0.08.
   pure subroutine shift(self, response, delta)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      logical :: tiny_step

      tiny_step = abs(delta)*response%fastest <= tiny_angle
      self%tau = self%tau + delta
      if (response%driven%count > 0) call take_tones(self, response, self%x)
      call grow_shortly(response%filled, response%decay, response%turn, delta, tiny_step, self%x)
      if (response%rigid > 0) call move_rigid(response, delta, self)
      if (response%ramps) call move_ramps(response, delta, self%x)
      if (response%driven%count > 0) then
         associate (first => response%driven%first + 1, n => response%terms, f => response%filled)
            call response%driven%push_shortly(delta, tiny_step, self%tone, self%x(first:n), self%x(f + first:f + n))
         end associate
      end if
      ! A copy, as the states must not be written while they are read.
      if (response%nx > 0) call move_dense(response, [self%dense(:response%nx)], delta, self%dense)
   end subroutine shift

   !> Move dense states by a step of 2^-level s.
   pure subroutine step_dense(response, level, dense)
      type(response_t), intent(in) :: response
      integer, intent(in) :: level
      real(wp), intent(inout) :: dense(:)

      integer :: i

      do i = 1, size(response%dense)
         associate (j => response%first(i), k => response%first(i + 1) - 1)
            dense(j:k) = matmul(response%step_dense(j:k, j:k, level), dense(j:k))
         end associate
      end do
   end subroutine step_dense

   !> Add to driven terms what the excitation gives in `tau` s after `start`; `grown` are the factors of all amplitudes.
   pure subroutine add_excitation(start, response, tau, grown, self)
      type(amplitudes_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau, grown(:)
      type(amplitudes_t), intent(inout) :: self

      complex(wp) :: factor(response%amplitudes)

      call take_tones(self, response, start%x)
      associate (driven => response%driven, first => response%driven%first + 1, n => response%terms, f => response%filled)
         factor = cmplx(grown(:response%amplitudes), grown(f + 1:f + response%amplitudes), wp)
         call driven%push(tau, factor(first:n), factor(n + 1:), self%tone, self%x(first:n), self%x(f + first:f + n))
      end associate
   end subroutine add_excitation

   !> Cosine and sine of each tone that acts on driven terms, from amplitudes x, into the workspace.
   pure subroutine take_tones(self, response, x)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: x(:)

      integer :: t

      do t = 1, response%driven%tones
         self%tone(2*t - 1) = x(response%terms + t)
         self%tone(2*t) = x(response%filled + response%terms + t)
      end do
   end subroutine take_tones

   !> Add to driven terms what the excitation gives in a step of 2^-level s, from the tones in the workspace.
   pure subroutine push_by_table(self, response, level)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: level

      real(wp) :: pushed(response%driven%count)

      associate (first => response%driven%first + 1, n => response%driven%count, f => response%filled)
         call product(n, 2*response%driven%tones, response%push_re(:, :, level), self%tone, pushed)
         self%x(first:first + n - 1) = self%x(first:first + n - 1) + pushed
         call product(n, 2*response%driven%tones, response%push_im(:, :, level), self%tone, pushed)
         self%x(f + first:f + first + n - 1) = self%x(f + first:f + first + n - 1) + pushed
      end associate
   end subroutine push_by_table

   !> Enter the factors over 2^-level s into the table of the response.
   pure subroutine tabulate(response, level)
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level

      complex(wp) :: factor(response%amplitudes)
      real(wp) :: re, im
      integer :: i, j, k

      response%step_length(level) = scale(1.0_wp, -level)
      do i = 1, response%amplitudes
         call growth(response%exponent(i), response%step_length(level), re, im)
         factor(i) = cmplx(re, im, wp)
      end do
      associate (driven => response%driven, n => response%amplitudes, f => response%filled)
         response%factor(:2*f, level) = [real(factor), (0.0_wp, i=n + 1, f), aimag(factor), (0.0_wp, i=n + 1, f)]
         if (driven%count > 0) call driven%tabulate_push(response%step_length(level), factor(driven%first + 1:response%terms), &
                                                         factor(response%terms + 1:), response%push_re(:, :, level), &
                                                         response%push_im(:, :, level))
      end associate
      if (response%nx > 0) response%step_dense(:, :, level) = 0.0_wp
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         response%step_dense(j:k, j:k, level) = matrix_exponential(response%dense(i)%matrix, response%step_length(level))
      end do
      response%has_step(level) = .true.
   end subroutine tabulate

   !> Real and imaginary part of exp(exponent*tau); growth beyond the range of the numbers is held at its edge, where the
   !> caller sees a blow-up.
   pure subroutine growth(exponent, tau, re, im)
      complex(wp), intent(in) :: exponent
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: re, im

      real(wp) :: angle, factor

      angle = aimag(exponent)*tau
      re = cos(angle)
      im = sin(angle)
      if (.not. abs(real(exponent)) > 0.0_wp) return
      factor = exp(min(max(real(exponent)*tau, -700.0_wp), 200.0_wp))
      re = factor*re
      im = factor*im
   end subroutine growth

   !> Carry disturbances z (2m, columns) of the state through `tau`, s: the transition matrix of the mode, applied.
   pure subroutine carry_disturbances(response, tau, z)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:, :)

      real(wp) :: before(size(z, 1), size(z, 2)), factor(2*response%filled), x(response%length), y(response%rows)
      integer :: c, i

      before = z
      factor = 0.0_wp
      do i = 1, response%terms
         call growth(response%exponent(i), tau, factor(i), factor(response%filled + i))
      end do
      do c = 1, size(z, 2)
         ! Neither tones nor constant forces change: what is not a term or a rigid mode is 0.
         call product(response%rows, size(z, 1), response%into, before(:, c), y)
         call enter_terms(response, y, x)
         call rotate_self(response%filled, factor, x)
         do i = response%one + 1, response%one + response%rigid
            x(i) = x(i) + tau*x(i + response%rigid)
         end do
         call product(size(z, 1), response%columns, response%from, x, z(:, c))
      end do
      if (response%nx > 0) call carry_dense(response, tau, before, z)
   end subroutine carry_disturbances

   !> Add what dense parts make of disturbances `before` (2m, columns) to z.
   pure subroutine carry_dense(response, tau, before, z)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau, before(:, :)
      real(wp), intent(inout) :: z(:, :)

      complex(wp) :: none(response%tones)
      real(wp), allocatable :: grown(:, :), x(:)
      integer :: c, i

      none = (0.0_wp, 0.0_wp)
      do i = 1, size(response%dense)
         associate (part => response%dense(i))
            grown = matrix_exponential(part%matrix, tau)
            x = grown(:, 1)
            do c = 1, size(z, 2)
               call part%start(before(:, c), none, x)
               ! Of a disturbance there is no load.
               x(part%states + 1:) = 0.0_wp
               x = matmul(grown, x)
               call part%add_state(x, z(:, c))
            end do
         end associate
      end do
   end subroutine carry_dense

end module razy_exact_closed_form_amplitudes
